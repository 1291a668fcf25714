#!/usr/bin/env bash
# Runs the camera tests on the kernel's own drivers, in a small virtual machine.
#
# Where the machine cannot run, it says so; in continuous integration (CI is set) that is a failure.
set -u
cd "$(dirname "$0")/../.."
vm=tests/vm/vm.sh
target=${CARGO_TARGET_DIR:-target}
cargo build --quiet --example uvcsim --bin boresight || exit 1
tests=$(cargo test --no-run --message-format=json --test camera_driver 2>/dev/null |
	sed -n 's/.*"executable":"\([^"]*camera_driver[^"]*\)".*/\1/p' | tail -1)
[ -n "$tests" ] || exit 1
nokhwa_tests=$(cargo test --no-run --message-format=json --test camera_nokhwa 2>/dev/null |
	sed -n 's/.*"executable":"\([^"]*camera_nokhwa[^"]*\)".*/\1/p' | tail -1)
[ -n "$nokhwa_tests" ] || exit 1
uvcsim=$target/debug/examples/uvcsim

# Runs a part; ends all if it fails.
part() {
	local name=$1
	shift
	echo "In the test machine: $name"
	"$@"
	local result=$?
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
part "a USB camera and its faults" $vm --uvcsim "$uvcsim" --timeout 150 "$tests" "${options[@]}" \
	--skip two_equal --skip the_test_driver
part "two equal cameras" $vm --uvcsim "$uvcsim" --camera-args --twin --timeout 60 "$tests" "${options[@]}" two_equal
part "the kernel's test driver" $vm --camera vivid --timeout 60 "$tests" "${options[@]}" the_test_driver
part "the backend nokhwa" $vm --uvcsim "$uvcsim" --timeout 90 "$nokhwa_tests" "${options[@]}"
