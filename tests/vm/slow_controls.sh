#!/bin/sh
# In the test machine: a whole session on a camera whose controls take $2, $3 ... ms each to answer, in mode $1.
mode=$1
shift
for millis in "$@"; do
	echo "ctldelay $millis" >$CAMERA_CONTROL
	began=$(cut -d. -f1 /proc/uptime)
	/app/boresight guide --headless --source /dev/video0 --set "camera.mode=$mode" --set guidance.plan=quick \
		--out "/out/$millis" 2>"/out/$millis.txt"
	echo "exit status $?" >>"/out/$millis.txt"
	echo $(($(cut -d. -f1 /proc/uptime) - began)) >"/out/$millis.secs"
	echo "controls of $millis ms: done"
done
