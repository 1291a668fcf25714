#!/usr/bin/env bash
# The Python package as a wheel, and with it the program without its window: python/dist. It needs maturin and wheel on the
# PATH.
#
# PROGRAM takes a program that's already built; PROFILE is Cargo's profile, dist without it.
set -euo pipefail
cd "$(dirname "$0")/.."
profile=${PROFILE:-dist}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [ -z "${PROGRAM:-}" ]; then
	built=$(cargo build --profile "$profile" --locked -p boresight --no-default-features \
		--features live,report,manual,serve,watch,history --message-format json |
		sed -n 's/.*"executable":"\([^"]*\)".*/\1/p')
	PROGRAM=${built##*$'\n'}
fi
(cd python && maturin build --profile "$profile" --out "$work")
wheel unpack --dest "$work" "$work"/*.whl
unpacked=$(echo "$work"/boresight-*/)
data=$unpacked/$(basename "$unpacked").data
install -D --mode=755 "$PROGRAM" "$data/scripts/boresight"
# The texts that the licences of all that is in it ask for.
install -D --mode=644 --target-directory="$(echo "$unpacked"/boresight-*.dist-info)/licenses" LICENSE-MIT LICENSE-APACHE NOTICE
mkdir -p python/dist
wheel pack --dest-dir python/dist "$unpacked"
