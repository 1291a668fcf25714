#!/usr/bin/env bash
# Packs the program as a .deb: target/packages/boresight_VERSION_ARCH.deb.
#
#   PROGRAM  the program to pack; default: target/dist/boresight, as `make dist` builds it
#   RUNS     a program of the same version that runs here, for man pages and completions; default: PROGRAM
#   ARCH     Debian's name of PROGRAM's architecture; default: this computer's
#   OUT      folder for the package; default: target/packages
#
# Needs Debian's dpkg-dev. The same program gives the same package: times are those of the last commit.
set -euo pipefail
cd "$(dirname "$0")/.."
umask 022
PROGRAM=$(realpath "${PROGRAM:-target/dist/boresight}")
RUNS=$(realpath "${RUNS:-$PROGRAM}")
ARCH=${ARCH:-$(dpkg --print-architecture)}
OUT=${OUT:-target/packages}
version=$(sed -n '/^\[workspace.package\]/,/^\[/ s/^version = "\(.*\)"/\1/p' Cargo.toml)
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
mkdir -p "$OUT"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root

install -D -m 755 "$PROGRAM" "$root/usr/bin/boresight"

"$RUNS" man "$root/usr/share/man/man1" 2>/dev/null
gzip -9n "$root"/usr/share/man/man1/*.1
completions() { # SHELL FILE
	mkdir -p "$(dirname "$root/$2")"
	"$RUNS" completions "$1" >"$root/$2"
}
completions bash usr/share/bash-completion/completions/boresight
completions zsh usr/share/zsh/vendor-completions/_boresight
completions fish usr/share/fish/vendor_completions.d/boresight.fish

shared=packaging/linux
install -D -m 644 $shared/boresight.desktop "$root/usr/share/applications/boresight.desktop"
install -D -m 644 $shared/boresight.svg "$root/usr/share/icons/hicolor/scalable/apps/boresight.svg"
install -D -m 644 $shared/boresight.mime.xml "$root/usr/share/mime/packages/boresight.xml"
install -D -m 644 -t "$root/usr/share/metainfo" $shared/*.metainfo.xml
install -D -m 644 -t "$root/usr/lib/systemd/system" $shared/boresight-watch.service

doc=$root/usr/share/doc/boresight
mkdir -p "$doc"
cat >"$doc/copyright" <<EOF
Upstream-Name: boresight
Comment: The program holds libraries of others under permissive licences; NOTICE in this folder names what they ask for.

Files: *
Copyright: 2026 The boresight authors
License: MIT or Apache-2.0

License: MIT
$(sed -n '/^Permission/,$p' LICENSE-MIT | sed 's/^$/./; s/^/ /')

License: Apache-2.0
 On Debian systems, the text of the licence is in /usr/share/common-licenses/Apache-2.0.
EOF
install -m 644 NOTICE "$doc/NOTICE"
gzip -9nc CHANGELOG.md >"$doc/changelog.gz"
{
	echo "boresight ($version-1) unstable; urgency=medium"
	echo
	echo "  * New version; see changelog.gz."
	echo
	echo " -- The boresight authors <maintainers@boresight.invalid>  $(date -Ru -d "@$SOURCE_DATE_EPOCH")"
} | gzip -9n >"$doc/changelog.Debian.gz"
mkdir -p "$root/usr/share/lintian/overrides"
install -m 644 $shared/lintian-overrides "$root/usr/share/lintian/overrides/boresight"

# What the program is linked with. What the window opens at run time is recommended: on a headless computer it isn't needed.
mkdir -p "$work/debian"
printf 'Source: boresight\n\nPackage: boresight\nArchitecture: %s\n' "$ARCH" >"$work/debian/control"
# Another processor's libraries are in the packages that its compiler came with: libc6-arm64-cross stands for libc6.
libraries=/usr/$(dpkg-architecture -a"$ARCH" -qDEB_HOST_MULTIARCH 2>/dev/null)/lib
depends=$(cd "$work" && dpkg-shlibdeps -O -l"$libraries" -e"$root/usr/bin/boresight" 2>said | sed -n "s/-$ARCH-cross//g; s/:$ARCH//g; s/^shlibs:Depends=//p") || {
	cat "$work/said" >&2
	exit 1
}
find "$root" -exec touch -hd "@$SOURCE_DATE_EPOCH" {} +
mkdir "$root/DEBIAN"
(cd "$root" && find usr -type f -print0 | sort -z | xargs -0 md5sum) >"$root/DEBIAN/md5sums"
cat >"$root/DEBIAN/control" <<EOF
Package: boresight
Version: $version-1
Architecture: $ARCH
Maintainer: The boresight authors <maintainers@boresight.invalid>
Installed-Size: $(du -sk --exclude=DEBIAN "$root" | cut -f1)
Depends: $depends
Recommends: libgl1, libegl1, libgl1-mesa-dri, libxkbcommon-x11-0, libxcursor1, libxi6, libxrandr2, xdg-utils, ffmpeg
Suggests: speech-dispatcher | espeak-ng, libglib2.0-bin
Section: graphics
Priority: optional
Description: guided camera calibration with honest uncertainty
 You hold a checkerboard in front of a camera; boresight shows you where to
 hold it next, takes useful views automatically, and ends with a calibration
 whose uncertainty is stated and checked.
 .
 It guides in a window, in the terminal, on a phone and by voice, and writes
 calibrations for OpenCV, ROS, Kalibr, COLMAP, mrcal, MATLAB and others.
EOF
touch -d "@$SOURCE_DATE_EPOCH" "$root/DEBIAN" "$root/DEBIAN"/*
package=$OUT/boresight_$version-1_$ARCH.deb
dpkg-deb --root-owner-group --build -Zxz "$root" "$package" >/dev/null
echo "$package: $(stat -c %s "$package") bytes"
