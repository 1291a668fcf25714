#!/usr/bin/env bash
# The container image in programs that aren't ours: skopeo copies it, umoci unpacks it, and what it starts runs the
# demonstration there, as the image's user and with nothing else in its root. Needs root, skopeo, umoci and jq.
#
#     tests/packages/image.sh target/packages/boresight-*-amd64.oci.tar
set -euo pipefail
image=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
skopeo copy --quiet "oci-archive:$image" oci:layout:boresight
umoci unpack --image layout:boresight unpacked
said=$(skopeo inspect --config oci:layout:boresight)
configured() { jq -r ".config.$1" <<<"$said"; }
echo "$(stat -c %s "$image") bytes, $(find unpacked/rootfs -type f | wc -l) files, starts $(configured 'Entrypoint | join(" ")')"
began=$SECONDS
mapfile -t variables < <(configured 'Env[]')
start() { env -i "${variables[@]}" "$(command -v chroot)" --userspec="$(configured User)" unpacked/rootfs "$(configured 'Entrypoint[0]')" "$@"; }
start --version | head -n 1
start demo --fast --out "$(configured WorkingDir)/demo" 2>said || { cat said; exit 1; }
grep '^GOOD (SIMULATED)' said
test -s "unpacked/rootfs$(configured WorkingDir)/demo/report.html"
echo "report after $((SECONDS - began)) s"
