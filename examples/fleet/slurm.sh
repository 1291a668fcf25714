#!/bin/sh
# A batch as a job array of Slurm:
#   boresight batch plan /data/sessions > manifest.jsonl
#   sbatch --wait slurm.sh manifest.jsonl replay /data/out
#   boresight batch gather /data/out > results.jsonl
#
# The shard is the array's task. A task whose node was lost is queued again, and works on what is missing only.
#SBATCH --job-name=boresight
#SBATCH --array=1-16
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=1G
#SBATCH --requeue
#SBATCH --open-mode=append
set -eu
exec boresight batch run "$1" --action "$2" --out "$3" --jobs "${SLURM_CPUS_PER_TASK:-1}"
