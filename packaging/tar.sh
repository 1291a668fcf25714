#!/usr/bin/env bash
# Packs the program as a .tar.gz that's unpacked anywhere: target/packages/boresight-VERSION-PLATFORM.tar.gz.
#
#   PROGRAM   the program to pack; default: target/dist/boresight
#   RUNS      a program of the same version that runs here, for man pages and completions; default: PROGRAM
#   PLATFORM  what the file is called after; default: this computer's, such as x86_64-linux
#   OUT       folder for the package; default: target/packages
#
# The same program gives the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."
umask 022
PROGRAM=${PROGRAM:-target/dist/boresight}
RUNS=$(realpath "${RUNS:-$PROGRAM}")
PLATFORM=${PLATFORM:-$(uname -m)-linux}
OUT=${OUT:-target/packages}
version=$(sed -n '/^\[workspace.package\]/,/^\[/ s/^version = "\(.*\)"/\1/p' Cargo.toml)
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
name=boresight-$version-$PLATFORM
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/$name
mkdir -p "$root/completions" "$OUT"
install -m 755 "$PROGRAM" "$root/$(basename "$PROGRAM")"
install -m 644 README.md CHANGELOG.md NOTICE LICENSE-MIT LICENSE-APACHE "$root"
install -D -m 644 -t "$root/share" packaging/linux/boresight.*
"$RUNS" man "$root/man" 2>/dev/null
for shell in bash zsh fish powershell elvish; do
	"$RUNS" completions $shell >"$root/completions/boresight.$shell"
done
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" -C "$work" -c "$name" |
	gzip -9n >"$OUT/$name.tar.gz"
echo "$OUT/$name.tar.gz: $(stat -c %s "$OUT/$name.tar.gz") bytes"
