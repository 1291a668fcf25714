#!/usr/bin/env bash
# Builds the program for packages from two clones of the last commit, in folders with names of different lengths. Both
# programs must have the same bytes. DIST_FEATURES is passed on. DIST_WORK names a new folder for the clones, which is
# kept.
set -euo pipefail
checkout=$(cd "$(dirname "$0")/.." && pwd)
if [ -n "${DIST_WORK:-}" ]; then
	mkdir "$DIST_WORK"
	work=$(realpath "$DIST_WORK")
else
	work=$(mktemp -d)
	trap 'rm -rf "$work"' EXIT
fi
# Both before the first build: a commit made meanwhile belongs to neither.
folders=(one another/folder)
for folder in "${folders[@]}"; do
	git clone --quiet "$checkout" "$work/$folder"
done
sums=()
for folder in "${folders[@]}"; do
	env -u CARGO_TARGET_DIR make --no-print-directory -C "$work/$folder" dist DIST_FEATURES="${DIST_FEATURES:-}"
	program=$work/$folder/target/dist/boresight
	sums+=("$(sha256sum <"$program" | cut -d' ' -f1)")
	echo "$folder: ${sums[-1]} ($(stat -c %s "$program") bytes)"
	if grep -aq "$work" "$program"; then
		echo "The program holds the path of the folder in which it was built." >&2
		exit 1
	fi
done
[ "${sums[0]}" = "${sums[1]}" ] || {
	echo "The two programs differ." >&2
	exit 1
}
echo "The two programs are the same."
