#!/usr/bin/env bash
# Every combination of features brings no more crates than it may. With --each, every one also compiles without a warning.
#
# Counted are the packages of others in `cargo tree -e normal,build` on this system: each name and version once, with
# procedural macros and build dependencies.
set -euo pipefail
cd "$(dirname "$0")/.."

count() {
    cargo tree --quiet -e normal,build --prefix none "$@" | sed 's/ (.*//' | sort -u | grep -vc '^boresight'
}

failed=0
limit() {
    local most=$1 name=$2 crates
    shift 2
    crates=$(count "$@")
    echo "$name: $crates crates, at most $most"
    [ "$crates" -le "$most" ] || failed=1
}
# What a user of one crate gets.
limit 31 "geometry" -p boresight-geometry
limit 39 "detect" -p boresight-detect
limit 36 "calibrate" -p boresight-calibrate
limit 56 "formats" -p boresight-formats
limit 40 "guide" -p boresight-guide
# With tar and filetime, which pack what a bug report needs, and the decoders of TIFF and WebP.
limit 116 "the program's core" --no-default-features
# With shlex, which splits a command into words.
limit 120 "headless with live cameras" --no-default-features --features live
# With qrcodegen, which brings no other crate: the code on a certificate.
limit 133 "headless with everything" --no-default-features --features live,nokhwa,report
# The phone's page: a web server (tokio, hyper, axum, rustls, and what they are made of), a QR code, comparison in constant time.
limit 168 "headless with everything, a phone and history" --no-default-features --features live,nokhwa,report,serve,history
limit 321 "everything"
# Not in the default features: GigE Vision and GenICam, its channels, its XML, and waits on sockets.
limit 138 "headless with machine-vision cameras" --no-default-features --features gige
# Not in the default features: DDS and what it's made of: async streams (futures), the names of network cards (netlink), a clock
# and a calendar (chrono), two libraries for bytes.
limit 169 "headless with cameras of ROS 2" --no-default-features --features ros2
# Not in the default features: MCAP and its two compressions, SQLite, and what describes MCAP's records.
limit 150 "headless with recorded bags" --no-default-features --features bags
# Not in the default features: Thrift, its schema language, and Snappy.
limit 127 "a table of a batch in Parquet" --no-default-features --features parquet
# Not in the default features: requests to an object store, their signatures, TLS with the system's certificates, and
# XML. The most of all features, for names in other scripts (ICU) come with addresses.
limit 224 "a batch in object stores" --no-default-features --features cloud

# Products of matrices that are chosen by the processor would decide otherwise on another one.
if cargo tree --quiet --workspace -e normal,features -i nalgebra | grep -q 'nalgebra feature "matrixmultiply"'; then
    echo "nalgebra has its feature matrixmultiply"
    failed=1
fi

[ "${1:-}" = --each ] || exit $failed
for features in "" live gige ros2 bags watch batch window window,accessibility nokhwa report manual serve history parquet cloud live,report; do
    echo "compiling: ${features:-no features}"
    cargo clippy --quiet --no-default-features --features "$features" -- -D warnings || failed=1
done
echo "compiling: default features"
cargo clippy --quiet -- -D warnings || failed=1
exit $failed
