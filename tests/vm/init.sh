#!/bin/sh
# The first program of the test machine: mounts, loads the drivers, plugs the camera in, runs the test.
export PATH=/bin HOME=/tmp
mount -t proc none /proc
mount -t sysfs none /sys
mount -t devtmpfs none /dev
mount -t tmpfs none /tmp
for number in 1 2 3; do stty -F /dev/ttyS$number raw 115200 -echo; done
. /vm.env

load() {
	for module in "$@"; do
		while read -r file; do insmod "/m/$file" 2>/dev/null; done <"/m/$module.list"
	done
}
finish() {
	# Written here first: a busy disk must not hold up a program that is tested against time.
	[ ! -d /back ] || busybox cp -R /out/. /back || echo "vm: /out could not be copied" >/dev/ttyS2
	echo "$1" >/dev/ttyS3
	sync
	poweroff -f
}
lost() {
	echo "vm: no camera: $1" >/dev/ttyS2
	finish 125
}

if [ -n "$SHARES" ]; then
	load virtio_pci 9pnet_virtio 9p
	for share in $SHARES; do
		mkdir -p "/$share"
		mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 "$share" "/$share" || lost "9p $share"
	done
fi
case $CAMERA in
uvc)
	load vhci-hcd
	# The last of the list is the driver itself.
	while read -r file; do
		case $file in
		uvcvideo.*) insmod "/m/$file" $DRIVER_ARGS ;;
		*) insmod "/m/$file" 2>/dev/null ;;
		esac
	done </m/uvcvideo.list
	export CAMERA_CONTROL=/tmp/camera
	mkfifo $CAMERA_CONTROL
	sleep 1000000 >$CAMERA_CONTROL &
	/bin/uvcsim --pictures /pictures $CAMERA_ARGS <$CAMERA_CONTROL >/tmp/camera.log 2>&1 &
	;;
vivid) load vivid ;;
esac
if [ "$CAMERA" != none ]; then
	# Where time is counted, it runs on while this computer's disk is busy.
	tries=0
	while [ ! -e /dev/video0 ]; do
		usleep 50000
		tries=$((tries + 1))
		[ $tries -gt 4000 ] && {
			cat /tmp/camera.log
			dmesg | tail -20
			lost "$CAMERA"
		}
	done
fi
mkfifo /tmp/1 /tmp/2
cat /tmp/1 >/dev/ttyS1 &
first=$!
cat /tmp/2 >/dev/ttyS2 &
second=$!
cd /tmp
/vm.run >/tmp/1 2>/tmp/2 </dev/null
result=$?
wait $first $second
[ -f /tmp/camera.log ] && tail -100 /tmp/camera.log
finish $result
