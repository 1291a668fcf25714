#!/usr/bin/env bash
# Makes fixtures/screenshots/guide.webp: 18 s of the guide page, from a session that the simulated person of `boresight demo`
# follows, painted by the code that paints the stills. Needs ffmpeg with libwebp. PROGRAM is boresight.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PROGRAM:-target/release/boresight}" guide --headless --source sim:demo:1 --record-stream --out "$work/session" >/dev/null 2>&1
mkdir "$work/pictures"
BORESIGHT_SCREENSHOTS=$work/session BORESIGHT_MOVING=$work/pictures cargo test ${CARGO_ARGS:-} --test window the_moving_picture
ffmpeg -v error -y -framerate 5 -i "$work/pictures/%03d.png" -c:v libwebp_anim -quality ${QUALITY:-45} -compression_level 6 -loop 0 \
	fixtures/screenshots/guide.webp
stat -c '%n: %s bytes' fixtures/screenshots/guide.webp
