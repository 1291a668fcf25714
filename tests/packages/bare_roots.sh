#!/usr/bin/env bash
# Installs a .deb on bare roots of Debian 12 and 13 with one command, runs the demonstration, and removes it again; lintian
# has nothing to say before. Needs root and mmdebstrap; for another processor arch-test and qemu-user-static with binfmt_misc, too.
# SUITES names other releases, DEMO has options of the demonstration. OLDER is the .deb of an earlier version: it's installed and
# used first, and what it has kept must then be there to the byte, and be read by the newer one.
#
#     tests/packages/bare_roots.sh target/packages/boresight_*_arm64.deb
set -euo pipefail
package=$(realpath "$1")
lintian --allow-root --fail-on error,warning,info "$package"
architecture=$(dpkg-deb -f "$package" Architecture)
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
for suite in ${SUITES:-bookworm trixie}; do
	root=$work/$suite
	mmdebstrap --quiet --variant=apt --architectures="$architecture" "$suite" "$root"
	# What a removal should leave.
	listed() { (cd "$root" && find . -xdev -path ./proc -prune -o -path ./tmp -prune -o -print | sort); }
	listed >"$work/before"
	install=(chroot "$root" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends /tmp/boresight.deb)
	in_place() { chroot "$root" sh -c "mkdir -p /tmp/kept && cd /tmp/kept && $1"; }
	if [ -n "${OLDER:-}" ]; then
		cp "$OLDER" "$root/tmp/boresight.deb"
		"${install[@]}" >/dev/null
		in_place "boresight demo --fast --no-open --out older 2>/dev/null && boresight history add older >/dev/null"
		(cd "$root/tmp/kept" && find . -type f -exec sha256sum {} +) >"$work/kept"
		was=$(chroot "$root" dpkg-query -W -f='${Version}' boresight)
	fi
	cp "$package" "$root/tmp/boresight.deb"
	# Of each file that would be fetched: its address, name, size and sum.
	fetched=$("${install[@]}" --print-uris | awk '{ sum += $3 } END { print sum }')
	began=$(date +%s)
	"${install[@]}" >/dev/null
	installed=$(date +%s)
	chroot "$root" sh -c "cd /tmp && boresight demo ${DEMO:-} --out demo" 2>"$work/said" || { cat "$work/said"; exit 1; }
	ended=$(date +%s)
	grep 'GOOD (SIMULATED)' "$work/said"
	test -s "$root/tmp/demo/report.html"
	echo "$suite $architecture: $fetched bytes fetched, installed in $((installed - began)) s, report after $((ended - installed)) s more"
	if [ -n "${OLDER:-}" ]; then
		(cd "$root/tmp/kept" && sha256sum --check --quiet "$work/kept")
		in_place "boresight doctor older && boresight history && boresight replay older --json >/tmp/replayed.json"
		echo "$suite: over $was, $(wc -l <"$work/kept") files are as they were, and are read"
	fi
	chroot "$root" apt-get purge -qq -y --autoremove boresight >/dev/null
	listed >"$work/after"
	# apt and dpkg keep a log of what they did, and the lists that they were given.
	left=$(comm -13 "$work/before" "$work/after" | grep -v -e '^./var/log' -e '^./var/cache' -e '^./var/lib/apt' -e '^./var/lib/dpkg/.*-old$' || true)
	[ -z "$left" ] || { echo "$suite: left behind:"; echo "$left"; exit 1; }
	echo "$suite: nothing is left"
done
