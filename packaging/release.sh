#!/usr/bin/env bash
# Builds every package into target/packages, with SHA256SUMS. Arguments name the parts to build; without
# any, all. A part whose compiler isn't here is named and left out; CI=1 makes that a failure.
#
#   deb tar static oci arm64 windows wheel source manifests
#
# Programs that are already built are taken instead of building them: PROGRAM (deb, tar), STATIC_PROGRAM (static, oci),
# ARM64_PROGRAM, WINDOWS_PROGRAM, WHEEL_PROGRAM. HOMEPAGE is for the manifests. KEY signs the sums with GnuPG.
set -euo pipefail
cd "$(dirname "$0")/.."
OUT=target/packages
version=$(sed -n '/^\[workspace.package\]/,/^\[/ s/^version = "\(.*\)"/\1/p' Cargo.toml)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
BORESIGHT_COMMIT=${BORESIGHT_COMMIT:-$(git rev-parse --short=12 HEAD)}
export OUT SOURCE_DATE_EPOCH BORESIGHT_COMMIT
HEADLESS="--no-default-features --features live,report,manual,serve,watch,history"
parts=" ${*:-deb tar static oci arm64 windows wheel source manifests} "
mkdir -p "$OUT"

asked() { [[ $parts == *" $1 "* ]]; }
missing() {
	echo "left out: $1 ($2)" >&2
	[ -z "${CI:-}" ] || exit 1
}
has_target() { [ -d "$(rustc --print sysroot)/lib/rustlib/$1" ]; }
dist() { # TARGET FEATURES… → path of the program
	local target=$1
	shift
	make --no-print-directory dist DIST_FEATURES="--target $target $*" >&2
	echo "target/$target/dist/boresight"
}
native=$(rustc -vV | sed -n 's/^host: //p')

if asked deb || asked tar || asked arm64 || asked windows; then
	PROGRAM=${PROGRAM:-$(dist "$native")}
	export RUNS=$PROGRAM
fi
if asked deb; then PROGRAM=$PROGRAM packaging/deb.sh; fi
if asked tar; then PROGRAM=$PROGRAM packaging/tar.sh; fi

static=x86_64-unknown-linux-musl
if asked static || asked oci; then
	if has_target $static && command -v musl-gcc >/dev/null; then
		program=${STATIC_PROGRAM:-$(dist $static "$HEADLESS")}
		if asked static; then
			PROGRAM=$program RUNS=$program PLATFORM=$(uname -m)-linux-static packaging/tar.sh
		fi
		if asked oci; then
			packaging/oci.py "$program" --out "$OUT/boresight-$version-amd64.oci.tar"
		fi
	else
		missing "static, oci" "rustup target add $static; apt install musl-tools"
	fi
fi

arm=aarch64-unknown-linux-gnu
if asked arm64; then
	if has_target $arm && command -v aarch64-linux-gnu-gcc >/dev/null; then
		export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
		program=${ARM64_PROGRAM:-$(dist $arm)}
		PROGRAM=$program ARCH=arm64 packaging/deb.sh
		PROGRAM=$program PLATFORM=aarch64-linux packaging/tar.sh
	else
		missing arm64 "rustup target add $arm; apt install gcc-aarch64-linux-gnu libc6-dev-arm64-cross"
	fi
fi

windows=x86_64-pc-windows-gnu
if asked windows; then
	if has_target $windows && command -v x86_64-w64-mingw32-gcc >/dev/null; then
		program=${WINDOWS_PROGRAM:-$(dist $windows).exe}
		PROGRAM=$program PLATFORM=x86_64-windows packaging/tar.sh
		packaging/zip.py "$OUT/boresight-$version-x86_64-windows.tar.gz"
	else
		missing windows "rustup target add $windows; apt install gcc-mingw-w64-x86-64"
	fi
fi

if asked wheel; then
	# The wheel's program has no window.
	PROGRAM=${WHEEL_PROGRAM:-} make --no-print-directory wheel
	cp python/dist/boresight-"$version"-*.whl "$OUT"
fi
if asked source; then
	git archive --prefix="boresight-$version/" HEAD | gzip -9n >"$OUT/boresight-$version.tar.gz"
fi
if asked manifests; then
	zip=$OUT/boresight-$version-x86_64-windows.zip
	packaging/manifests.py --homepage "${HOMEPAGE:-https://example.org/boresight}" \
		$([ -f "$OUT/boresight-$version.tar.gz" ] && echo --source "$OUT/boresight-$version.tar.gz") \
		$([ -f "$zip" ] && echo --windows "$zip") --out "$OUT/manifests" >/dev/null
fi

(cd "$OUT" && find . -maxdepth 1 -type f ! -name 'SHA256SUMS*' -printf '%P\n' | sort | xargs -r sha256sum >SHA256SUMS)
if [ -n "${KEY:-}" ]; then
	gpg --batch --yes --local-user "$KEY" --armor --detach-sign "$OUT/SHA256SUMS"
fi
cat "$OUT/SHA256SUMS"
