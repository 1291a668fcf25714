#!/bin/sh
# In the test machine: a session on the camera in mode $1, the same pictures from disk, and the first one replayed.
set -e
guide="/app/boresight guide --headless --record-stream"
$guide --source /dev/video0 --set "camera.mode=$1" --out /out/camera
$guide --source /data/recording --out /out/disk 2>/dev/null
/app/boresight replay --json /out/camera >/out/replayed.json
