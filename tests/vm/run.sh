#!/usr/bin/env bash
# Runs the camera tests on the kernel's own drivers, in a small virtual machine. Its arguments say what `cargo test` builds;
# without any, it's the program with its default features.
#
# Where the machine cannot run, it says so; in continuous integration (CI is set) that is a failure.
#
# Longer runs: BORESIGHT_REPLUGS=100 and BORESIGHT_CONTROLS_MS=20,60,250,1000,4900, with BORESIGHT_VM_SECS=3000 for each
# part. BORESIGHT_VM_PARTS='clock|slow' runs the parts whose names match.
set -u
cd "$(dirname "$0")/../.."
vm=tests/vm/vm.sh
target=${CARGO_TARGET_DIR:-target}
[ $# -gt 0 ] || set -- --package boresight
# `cargo test` builds the program and the examples, too.
built=$(cargo test --no-run --message-format=json "$@" 2>/dev/null)
tests=$(sed -n 's/.*"executable":"\([^"]*\/driver-[^"]*\)".*/\1/p' <<<"$built" | tail -1)
[ -n "$tests" ] || exit 1
uvcsim=$(realpath "$target/debug/examples/uvcsim")

said=$(mktemp)
trap 'rm -f "$said"' EXIT
# Runs a part; ends all if it fails.
part() {
	local name=$1
	shift
	[[ $name =~ ${BORESIGHT_VM_PARTS:-.} ]] || return 0
	echo "In the test machine: $name"
	"$@" | tee -a "$said"
	local result=${PIPESTATUS[0]}
	if [ $result = 125 ] && [ -z "${CI:-}" ]; then
		echo "The camera tests on real drivers did not run: the machine did not come up (see above)."
		exit 0
	fi
	[ $result = 0 ] || {
		echo "In the test machine: $name failed ($result)"
		exit 1
	}
}
options=(--ignored --test-threads=1 --nocapture)
# Time counted by instructions, so that nothing depends on what else this computer does.
vm="$vm --pace counted --timeout ${BORESIGHT_VM_SECS:-400}"
part "a USB camera and its faults" $vm --uvcsim "$uvcsim" --with "$target/debug/boresight" \
	--env BORESIGHT_REPLUGS="${BORESIGHT_REPLUGS:-}" \
	"$tests" "${options[@]}" camera:: --skip two_equal --skip the_test_driver --skip nokhwa:: --skip time_stamps
part "a USB camera with a clock that jumps" $vm --uvcsim "$uvcsim" --driver-args hwtimestamps=1 \
	"$tests" "${options[@]}" time_stamps
part "two equal cameras" $vm --uvcsim "$uvcsim" --camera-args --twin "$tests" "${options[@]}" two_equal
part "the kernel's test driver" $vm --camera vivid --with "$(command -v v4l2-ctl)" "$tests" "${options[@]}" the_test_driver
part "the backend nokhwa" $vm --uvcsim "$uvcsim" "$tests" "${options[@]}" nokhwa:: --skip freezes
# Apart, for its thread keeps the camera.
part "the backend nokhwa, and a camera that freezes" $vm --uvcsim "$uvcsim" "$tests" "${options[@]}" \
	nokhwa::a_camera_that_freezes
part "a guided session, and the same pictures from disk" env BORESIGHT_UVCSIM="$uvcsim" \
	"$tests" "${options[@]}" session::
part "whole sessions with slow controls" env BORESIGHT_UVCSIM="$uvcsim" \
	"$tests" "${options[@]}" slow_controls::
echo "Times are of the machine's own clock."
echo "| fault | what the person saw | went on after |"
echo "|---|---|---|"
sed -n 's/^\(test .* \.\.\. \)\{0,1\}\(| .* | .* | \([0-9.]* s\|at once\) |\)$/\2/p' "$said"
