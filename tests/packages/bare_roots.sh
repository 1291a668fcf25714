#!/usr/bin/env bash
# Installs a .deb on bare roots of Debian 12 and 13 with one command, runs the demonstration, and removes it again. Needs root
# and mmdebstrap. SUITES names others.
set -euo pipefail
package=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
for suite in ${SUITES:-bookworm trixie}; do
	root=$work/$suite
	mmdebstrap --quiet --variant=apt --architectures="$(dpkg-deb -f "$package" Architecture)" "$suite" "$root"
	# What a removal should leave.
	listed() { (cd "$root" && find . -xdev -path ./proc -prune -o -path ./tmp -prune -o -print | sort); }
	listed >"$work/before"
	cp "$package" "$root/tmp/boresight.deb"
	began=$(date +%s)
	chroot "$root" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends /tmp/boresight.deb >/dev/null
	installed=$(date +%s)
	chroot "$root" sh -c 'cd /tmp && boresight demo --out demo' 2>"$work/said" || { cat "$work/said"; exit 1; }
	ended=$(date +%s)
	grep 'SIMULATED: GOOD' "$work/said"
	test -s "$root/tmp/demo/report.html"
	bytes=$(stat -c %s "$package")
	echo "$suite: $bytes bytes, installed in $((installed - began)) s, report after $((ended - installed)) s more"
	chroot "$root" apt-get purge -qq -y --autoremove boresight >/dev/null
	listed >"$work/after"
	# apt and dpkg keep a log of what they did, and the lists that they were given.
	left=$(comm -13 "$work/before" "$work/after" | grep -v -e '^./var/log' -e '^./var/cache' -e '^./var/lib/apt' -e '^./var/lib/dpkg/.*-old$' || true)
	[ -z "$left" ] || { echo "$suite: left behind:"; echo "$left"; exit 1; }
	echo "$suite: nothing is left"
done
