#!/usr/bin/env bash
# The Windows program under Wine beside the Linux program of the same commit: detect, calibrate, report, batch and the
# demonstration give the same bytes, but for times and names of folders. Debian 12's Wine has no bcryptprimitives.dll, from which
# Rust's library takes its random numbers: one that asks Wine's own source for them is made by MinGW and put beside the program.
#
#     tests/packages/wine.sh target/x86_64-pc-windows-gnu/dist/boresight.exe target/x86_64-unknown-linux-gnu/dist/boresight
set -euo pipefail
windows=$(realpath "$1")
linux=$(realpath "$2")
recorded=$(realpath "$(dirname "$0")/../../fixtures/recordings/v1/good")
work=$(mktemp -d)
export HOME=$work WINEPREFIX=$work/wine WINEDEBUG=-all WINEDLLOVERRIDES='mscoree,mshtml='
trap 'wineserver --kill 2>/dev/null || true; rm -rf "$work"' EXIT
wineboot --init >/dev/null 2>&1
cp "$windows" "$work/boresight.exe"
windows=$work/boresight.exe
if [ ! -e "$WINEPREFIX/drive_c/windows/system32/bcryptprimitives.dll" ]; then
	x86_64-w64-mingw32-gcc -shared -o "$work/bcryptprimitives.dll" -x c - -ladvapi32 <<-END
		#include <windows.h>
		BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
		__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T length) { return SystemFunction036(data, length); }
	END
fi

everything() { # PROGRAM…
	cp -r "$recorded" session &&
		"$@" --version >version.txt &&
		"$@" detect --board 7x5 --json session/frames/*.png >detect.jsonl &&
		"$@" calibrate session/frames/*.png --board 7x5 --square 30mm --json --out calibrated.json >calibrate.json &&
		"$@" report session --out report.html &&
		"$@" batch plan session >manifest.jsonl &&
		"$@" batch run manifest.jsonl --action replay --out replayed &&
		"$@" batch gather replayed >gathered.jsonl &&
		"$@" demo --fast --no-open --json --out demo >demo.json
}
for side in linux windows; do
	mkdir "$work/$side"
	cd "$work/$side"
	program=("$linux")
	[ $side = linux ] || program=(wine "$windows")
	began=$SECONDS
	everything "${program[@]}" 2>said.txt || { cat said.txt; echo "$side failed"; exit 1; }
	echo "$side: $(head -n 1 version.txt), everything in $((SECONDS - began)) s, $(grep '^GOOD (SIMULATED)' said.txt | tail -n 1)"
	sed -i -E 's/,"millis":[^,}]*//' detect.jsonl
	# The manifest holds the folder's own name, and so does what's planned from it.
	rm -r manifest.jsonl replayed said.txt
	sed -i -E 's/"(id|session|crc32)":"[^"]*",?//g' gathered.jsonl
	sed -i -E 's/"session":"[0-9a-f]*"//' demo/journal.jsonl
	sed -i '/^created = /d' demo/session.toml
	sed -i -E '/>(Date|Started)</d' report.html demo/report.html
done
cd "$work"
diff -rq --exclude version.txt linux windows
echo "$(find linux -type f | wc -l) files are the same"
