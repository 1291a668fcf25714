#!/usr/bin/env bash
# Runs a program in a small virtual machine with Debian's kernel and a camera; its output and exit code come back.
#
#   vm.sh [options] PROGRAM [ARGUMENTS...]
#
#   --camera uvc|vivid|none   uvc: the simulated USB camera (uvcsim) under the kernel's own USB and camera drivers;
#                             vivid: the kernel's test driver                                               [uvc]
#   --uvcsim FILE             the built uvcsim
#   --camera-args TEXT        for uvcsim, such as '--twin'
#   --driver-args TEXT        for the kernel's camera driver, such as 'hwtimestamps=1'
#   --pictures DIR            PNG files that the camera plays, in order
#   --with FILE               one more program, at /app/NAME; may be repeated
#   --data DIR                readable at /data
#   --out DIR                 gets what is in /out when the program has ended
#   --env NAME=VALUE          may be repeated        --timeout S for the whole machine [120]
#   --log FILE                the kernel's console
#   --pace counted            time in the machine passes by counting instructions: nothing there depends on how
#                             busy this computer is; it takes longer then
#
# Exit codes: the program's own; 124 out of time; 125 the machine or the camera did not come up.
# Needs neither root nor KVM. The kernel is kept in ~/.cache/boresight-vm (BORESIGHT_VM_CACHE); which one:
# BORESIGHT_VM_KERNEL, else the one that is kept, else the newest of Debian.
set -u

camera=uvc uvcsim='' camera_args='' driver_args='' pictures='' data='' out='' limit=120 log='' envs=() others=() pace=''
while [ $# -gt 0 ]; do
	case $1 in
	--camera) camera=$2 ;;
	--uvcsim) uvcsim=$2 ;;
	--camera-args) camera_args=$2 ;;
	--driver-args) driver_args=$2 ;;
	--pictures) pictures=$2 ;;
	--with) others+=("$2") ;;
	--data) data=$2 ;;
	--out) out=$2 ;;
	--env) envs+=("$2") ;;
	--timeout) limit=$2 ;;
	--log) log=$2 ;;
	--pace) pace=$2 ;;
	*) break ;;
	esac
	shift 2
done
[ $# -ge 1 ] || {
	sed -n '2,25s/^# \{0,1\}//p' "$0"
	exit 2
}
program=$1
shift
cache=${BORESIGHT_VM_CACHE:-$HOME/.cache/boresight-vm}
die() {
	echo "vm.sh: $*" >&2
	exit 125
}
for tool in qemu-system-x86_64 busybox cpio depmod modprobe strip xz python3; do
	PATH=$PATH:/sbin:/usr/sbin command -v "$tool" >/dev/null || die "$tool is missing: make test-vm installs it"
done
PATH=$PATH:/sbin:/usr/sbin

# Libraries that a program needs, copied into a root folder.
libraries() {
	ldd "$1" 2>/dev/null | grep -o '/[^ ]*' | while read -r file; do
		mkdir -p "$2$(dirname "$file")"
		[ -e "$2$file" ] || cp -L "$file" "$2$file"
	done
}

# vmlinux (uncompressed, which boots fastest) and the base of the root file system, from Debian's package.
build_cache() {
	local package=$1 into=$2 work root version module file name
	work=$(mktemp -d) && mkdir -p "$work/x" "$work/root" && root=$work/root
	echo "vm.sh: fetching $package" >&2
	(cd "$work" && apt-get download "$package" >/dev/null 2>&1) || die "apt-get download $package failed"
	dpkg-deb --fsys-tarfile "$work"/*.deb | tar -x -C "$work/x" --wildcards '*/boot/vmlinuz*' '*/modules.builtin*' \
		'*/modules.order' '*/kernel/drivers/media/*' '*/kernel/drivers/usb/*' '*/kernel/drivers/virtio/*' \
		'*/kernel/fs/*' '*/kernel/net/9p/*' || die "$package cannot be unpacked"
	[ -e "$work/x/lib" ] || ln -s usr/lib "$work/x/lib"
	version=$(ls "$work/x/lib/modules") && depmod -b "$work/x" "$version" 2>/dev/null
	mkdir -p "$root"/{bin,dev,proc,sys,tmp,m,app,data,out,pictures}
	cp "$(command -v busybox)" "$root/bin/busybox"
	for name in sh mount insmod cat echo sleep usleep mkfifo poweroff cut dmesg sync stty tail; do
		ln -sf busybox "$root/bin/$name"
	done
	for module in vhci-hcd uvcvideo vivid 9pnet_virtio 9p virtio_pci; do
		: >"$root/m/$module.list"
		modprobe -d "$work/x" -S "$version" --show-depends $module | sed -n 's/^insmod \([^ ]*\).*/\1/p' | while read -r file; do
			name=$(basename "$file") && name=${name%.xz} && name=${name%.zst}
			case $file in
			*.xz) xz -dc "$file" ;;
			*.zst) zstd -qdc "$file" ;;
			*) cat "$file" ;;
			esac >"$root/m/$name"
			echo "$name" >>"$root/m/$module.list"
		done
	done
	strip --strip-debug "$root"/m/*.ko
	mkdir -p "$into.new"
	(cd "$root" && find . | cpio -o -H newc --quiet --owner 0:0) >"$into.new/base.cpio"
	python3 "$(dirname "$0")/unpack_kernel.py" "$work"/x/boot/vmlinuz-* "$into.new/vmlinux" || die "there is no kernel in $package"
	rm -rf "$work" "$into" && mv "$into.new" "$into"
}

package=${BORESIGHT_VM_KERNEL:-}
if [ -z "$package" ]; then
	for kept in "$cache"/linux-image-*; do [ -s "$kept/vmlinux" ] && package=$(basename "$kept"); done
fi
[ -n "$package" ] || package=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: //p' | head -1)
[ -n "$package" ] || die "Debian's list of packages has no kernel: apt-get update"
mkdir -p "$cache" && kernel=$cache/$package
(
	flock 9
	[ -s "$kernel/base.cpio" ] || build_cache "$package" "$kernel"
) 9>"$cache/lock" || exit 125

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/root/app" "$work/root/bin"
# A script is taken as it is.
take() {
	strip -o "$2" "$1" 2>/dev/null || cp "$1" "$2" || die "$1 cannot be read"
	libraries "$1" "$work/root"
}
take "$program" "$work/root/app/program"
for other in "${others[@]}"; do take "$other" "$work/root/app/$(basename "$other")"; done
if [ $camera = uvc ]; then
	cp "$uvcsim" "$work/root/bin/uvcsim" || die "uvcsim is not built: cargo build --example uvcsim"
	libraries "$uvcsim" "$work/root"
fi
shares='' devices=()
share() {
	shares="$shares $1"
	devices+=(-fsdev "local,id=$1,path=$(realpath "$2"),security_model=none$3" -device "virtio-9p-pci,fsdev=$1,mount_tag=$1")
}
[ -n "$data" ] && share data "$data" ,readonly=on
[ -n "$pictures" ] && share pictures "$pictures" ,readonly=on
[ -n "$out" ] && mkdir -p "$out" && share back "$out" ''
cp "$(dirname "$0")/init.sh" "$work/root/init" && chmod 755 "$work/root/init"
printf 'CAMERA=%q SHARES=%q CAMERA_ARGS=%q DRIVER_ARGS=%q\n' "$camera" "$shares" "$camera_args" "$driver_args" >"$work/root/vm.env"
{
	echo '#!/bin/sh'
	for one in "${envs[@]}"; do printf 'export %q\n' "$one"; done
	printf 'exec /app/program'
	[ $# -gt 0 ] && printf ' %q' "$@"
	echo
} >"$work/root/vm.run"
chmod 755 "$work/root/vm.run"
(cd "$work/root" && find . | cpio -o -H newc --quiet --owner 0:0) >"$work/run.cpio"
cat "$kernel/base.cpio" "$work/run.cpio" >"$work/initrd"

# /dev/kvm alone proves nothing: some virtual hosts have it and hang.
# Wide vectors are slow when they are emulated.
accelerator=tcg cpu=Nehalem
[ -z "$pace" ] && [ -w /dev/kvm ] && grep -qwE 'vmx|svm' /proc/cpuinfo && accelerator=kvm cpu=host
# One instruction in a nanosecond: an old computer. Pauses are passed over.
[ -n "$pace" ] && devices+=(-icount "shift=0,sleep=off")
# Console, the program's output, its errors, its exit code.
mkfifo "$work/1" "$work/2"
cat "$work/1" &
first=$!
cat "$work/2" >&2 &
second=$!
timeout -k 2 "$limit" qemu-system-x86_64 -accel $accelerator -cpu $cpu -smp 1 -M q35 -m 1024 -nodefaults -no-user-config \
	-display none -no-reboot -serial "file:$work/console" -serial "file:$work/1" -serial "file:$work/2" \
	-serial "file:$work/3" "${devices[@]}" -kernel "$kernel/vmlinux" -initrd "$work/initrd" \
	-append "console=ttyS0 panic=-1 quiet mitigations=off random.trust_cpu=on" </dev/null >"$work/qemu" 2>&1
ended=$?
# Lets the readers end if the machine never wrote.
: <>"$work/1" <>"$work/2"
wait $first $second
[ -n "$log" ] && tr -d '\r' <"$work/console" >"$log"
[ $ended = 124 ] || [ $ended = 137 ] && {
	echo "vm.sh: not done after $limit s" >&2
	exit 124
}
[ $ended = 0 ] && [ -s "$work/3" ] || {
	cat "$work/qemu" >&2
	tail -20 "$work/console" >&2
	die "the machine ended without a result"
}
exit "$(tr -dc 0-9 <"$work/3")"
