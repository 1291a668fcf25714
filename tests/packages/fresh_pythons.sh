#!/usr/bin/env bash
# The wheel in a fresh environment of each Python from 3.10 on that is here (PYTHONS names others), and run by pipx and uvx
# straight from the file: it imports, its program guides the demonstration to GOOD, and removal leaves nothing.
#
#     tests/packages/fresh_pythons.sh python/dist/boresight-*.whl
set -euo pipefail

wheel=$(realpath "$1")
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"
mkdir home
export HOME=$place/home PIP_DISABLE_PIP_VERSION_CHECK=1

demo() {
	# The last line is JSON.
	"$@" demo --fast --no-open --json --out demo 2>said | tail -n 1 |
		python3 -c 'import json, sys; result = json.load(sys.stdin); assert result["verdict"] == "good", result["verdict"]'
	test -s demo/report.html
	rm -rf demo
}

for text in LICENSE-MIT LICENSE-APACHE NOTICE; do
	python3 -m zipfile --list "$wheel" | grep --quiet "dist-info/licenses/$text"
done
count=0
for python in ${PYTHONS:-$(echo python3.{10..19})}; do
	# A name on the PATH may stand for a version that isn't in use here.
	"$python" --version >/dev/null 2>&1 || continue
	"$python" -m venv fresh
	began=$SECONDS
	fresh/bin/pip install --quiet "$wheel"
	installed=$((SECONDS - began))
	demo fresh/bin/boresight
	said=$(fresh/bin/python -c 'import sys, boresight, numpy; assert not boresight.detect(numpy.zeros((300, 400), numpy.uint8), "7x5"); print(sys.version.split()[0], "with NumPy", numpy.__version__)')
	fresh/bin/pip uninstall --quiet --yes boresight
	test -z "$(find fresh -iname '*boresight*')"
	echo "Python $said: installed in $installed s, demonstration GOOD after $((SECONDS - began)) s, nothing left"
	rm -rf fresh
	count=$((count + 1))
done
[ "$count" -gt 0 ] || { echo "no Python from 3.10 on is here"; exit 1; }

"${PYTHON:-python3}" -m venv tools
tools/bin/pip install --quiet pipx uv
began=$SECONDS
demo tools/bin/pipx run --spec "$wheel" boresight
echo "pipx $(tools/bin/pipx --version): GOOD after $((SECONDS - began)) s"
began=$SECONDS
demo tools/bin/uvx --quiet --from "$wheel" boresight
echo "$(tools/bin/uv --version): GOOD after $((SECONDS - began)) s"
