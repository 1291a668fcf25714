#!/usr/bin/env bash
# A release without its publication: what the workflow release.yml does, with a signing key that's thrown away. Every package of
# docs/releasing.md must come out, each with its sum, and the sums signed. Arguments name the parts, as for packaging/release.sh;
# so do the variables for programs that are already built.
set -euo pipefail
cd "$(dirname "$0")/../.."
parts=("${@:-deb tar static oci arm64 windows wheel source manifests}")
read -ra parts <<<"${parts[*]}"
version=$(sed -n '/^\[workspace.package\]/,/^\[/ s/^version = "\(.*\)"/\1/p' Cargo.toml)
key=$(mktemp -d)
trap 'gpgconf --homedir "$key" --kill all; rm -rf "$key"' EXIT
export GNUPGHOME=$key KEY="boresight dry run" CI=1
gpg --batch --quiet --passphrase '' --quick-generate-key "$KEY" ed25519 sign 1d

rm -rf target/packages
packaging/release.sh "${parts[@]}" >/dev/null
cd target/packages

declare -A made=(
	[deb]="boresight_$version-1_$(dpkg --print-architecture).deb"
	[tar]="boresight-$version-$(uname -m)-linux.tar.gz"
	[static]="boresight-$version-$(uname -m)-linux-static.tar.gz"
	[oci]="boresight-$version-amd64.oci.tar"
	[arm64]="boresight_$version-1_arm64.deb boresight-$version-aarch64-linux.tar.gz"
	[windows]="boresight-$version-x86_64-windows.zip"
	[wheel]="boresight-$version-*.whl"
	[source]="boresight-$version.tar.gz"
	[manifests]=""
)
for part in "${parts[@]}"; do
	for name in ${made[$part]}; do
		grep -qF "  $name" SHA256SUMS || { echo "$part: SHA256SUMS lacks $name" >&2; exit 1; }
		echo "$name: $(stat -c %s "$name") bytes"
	done
done
sha256sum --check --quiet --strict SHA256SUMS
gpg --batch --quiet --verify SHA256SUMS.asc SHA256SUMS
sed '1s/^./x/' SHA256SUMS >changed
if gpg --batch --quiet --verify SHA256SUMS.asc changed 2>/dev/null; then echo "changed sums pass" >&2 && exit 1; fi
rm changed
if grep -rn '@[A-Z0-9_]*@' manifests; then echo "a manifest has an empty place" >&2 && exit 1; fi
echo "$(wc -l <SHA256SUMS) packages, signed sums, $(find manifests -type f 2>/dev/null | wc -l) manifests"
