#!/usr/bin/env bash
# Runs the tests in the virtual machine (run.sh, with the same arguments) if the code of cameras or the
# machine has changed since they passed; `passed` holds the sum of those sources. With --note, notes that
# they have passed.
set -eu
cd "$(dirname "$0")/../.."
passed=tests/vm/passed
sum=$(git ls-files -z crates/capture/src crates/v4l2-sys tests/driver tests/vm | grep -zvx "$passed" |
	xargs -0 sha256sum | sha256sum | cut -d' ' -f1)
if [ "${1:-}" = --note ]; then
	echo "$sum" >"$passed"
elif [ "$sum" = "$(cat "$passed" 2>/dev/null)" ]; then
	echo "Cameras and the virtual machine are as they passed its tests: make test-vm runs them again."
else
	tests/vm/run.sh "$@"
fi
