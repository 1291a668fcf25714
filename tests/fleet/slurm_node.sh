#!/bin/sh
# A job array of examples/fleet/slurm.sh under Slurm itself: this computer is its controller and its only node. The table is
# the same bytes as without Slurm; a task whose runner is killed is started again. Needs root, and slurmctld, slurmd,
# slurm-client and munge of Debian.
#   usage: slurm_node.sh PROGRAM [SESSIONS]
set -eu
program=$(realpath "$1")
count=${2:-60}
here=$(cd "$(dirname "$0")/../.." && pwd)
place=$(mktemp -d)
host=$(hostname -s)
chmod 755 "$place"
mkdir "$place/state" "$place/spool" "$place/munge" "$place/bin" "$place/sessions"
ln -s "$program" "$place/bin/boresight"
PATH=$place/bin:$PATH
export PATH SLURM_CONF="$place/slurm.conf"
ended() {
	for pid in "$place"/*.pid; do kill "$(cat "$pid")" 2>/dev/null || true; done
	if [ -e "$place/munge/munged.pid" ]; then kill "$(cat "$place/munge/munged.pid")" 2>/dev/null || true; fi
	rm -rf "$place"
}
trap ended EXIT

cat > "$SLURM_CONF" <<END
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$place/munge/socket
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool
SlurmctldLogFile=$place/slurmctld.log
SlurmdLogFile=$place/slurmd.log
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=2048 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
END
dd if=/dev/urandom of="$place/munge/key" bs=1024 count=1 2>/dev/null
chown -R munge: "$place/munge"
chmod 400 "$place/munge/key"
su -s /bin/sh munge -c "munged --key-file=$place/munge/key --socket=$place/munge/socket --log-file=$place/munge/log \
	--pid-file=$place/munge/munged.pid --seed-file=$place/munge/seed --force" 2>/dev/null
slurmctld
slurmd
sinfo --version

number=0
while [ "$number" -lt "$count" ]; do
	cp -r "$here/fixtures/recordings/v1/good" "$place/sessions/s$number"
	number=$((number + 1))
done
boresight batch plan "$place/sessions" > "$place/manifest.jsonl"
boresight batch run "$place/manifest.jsonl" --action replay --out "$place/alone" 2>/dev/null
boresight batch gather "$place/alone" > "$place/alone.jsonl"

# The first task is killed where it stands, as by a node that's lost, and queued again.
cat > "$place/task.sh" <<END
#!/bin/sh
#SBATCH --requeue
if [ "\$SLURM_ARRAY_TASK_ID" = 1 ] && [ -z "\${SLURM_RESTART_COUNT:-}" ]; then
	boresight batch run "\$1" --action "\$2" --out "\$3" --jobs 1 &
	runner=\$!
	until [ -d "\$3/claims" ]; do sleep 0.1; done
	kill -9 \$runner
	scontrol requeue "\$SLURM_JOB_ID"
	wait
	exit 1
fi
exec sh "$here/examples/fleet/slurm.sh" "\$@"
END
sbatch --wait --array=1-4 --output="$place/%a.log" "$place/task.sh" "$place/manifest.jsonl" replay "$place/out" || true
boresight batch gather "$place/out" > "$place/out.jsonl"
cmp "$place/alone.jsonl" "$place/out.jsonl"
echo "Slurm: $(wc -l < "$place/out.jsonl") sessions in 4 tasks, one killed and queued again: the same table"
