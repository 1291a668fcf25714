#!/usr/bin/env python3
"""Compares two builds of boresight: recordings, calibrations, exports and pictures must give the same.

    lab/same_results.py --old OLD --new NEW --sessions FOLDER --corners FOLDER --pictures BOARD=FOLDER …

OLD and NEW are programs. Every session below a folder of --sessions is replayed. Every corner table
(.vnl) in the folder of --corners is calibrated with board and size as the table in its README.md
states them, and the result is exported in every format. Every picture below a folder of --pictures is
searched for its board. Text is compared byte for byte, without the program's version and the time.
Exits with 1 if anything differs.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

OWN = [
    (re.compile(r'"(build|version|program|created|elapsed_secs|time|took_secs|millis)":\s*("[^"]*"|[\d.e+-]+)'), ""),
    (re.compile(r"boresight \d+\.\d+\.\d+\S*"), "boresight"),
]


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    text = f"{done.returncode}\n{done.stdout}"
    for pattern, instead in OWN:
        text = pattern.sub(instead, text)
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--old", required=True)
    parser.add_argument("--new", required=True)
    parser.add_argument("--sessions", nargs="*", default=[], type=Path)
    parser.add_argument("--corners", type=Path)
    parser.add_argument("--pictures", nargs="*", default=[])
    parser.add_argument("--most", type=int, default=10**9, help="pictures of a folder at most")
    options = parser.parse_args()
    differs, counts = [], {}

    def compare(kind, name, *arguments):
        old, new = (run(program, *arguments) for program in (options.old, options.new))
        counts[kind] = counts.get(kind, 0) + 1
        if old != new:
            differs.append(f"{kind}: {name}")

    for root in options.sessions:
        for header in sorted(root.rglob("session.toml")):
            compare("recordings", header.parent, "replay", header.parent, "--json")
    formats = re.findall(r"^\s+- ([a-z0-9-]+):", run(options.new, "export", "--help"), re.M)
    stated = (options.corners / "README.md").read_text() if options.corners else ""
    for name, board, size in re.findall(r"^\| (\w+) \| (\d+x\d+) \| (\d+x\d+) \|", stated, re.M):
        table = options.corners / f"{name}.vnl"
        known = ["--board", board, "--square", "25mm", "--image-size", size]
        compare("calibrations", table.name, "calibrate", table, *known, "--json")
        with tempfile.TemporaryDirectory() as folder:
            result = Path(folder) / "calibration.json"
            run(options.old, "calibrate", table, *known, "--out", result)
            for name in formats if result.exists() else []:
                compare("exports", f"{table.name} {name}", "export", result, "--format", name)
    for named in options.pictures:
        board, folder = named.split("=", 1)
        pictures = [p for p in sorted(Path(folder).rglob("*")) if p.suffix.lower() in (".png", ".jpg", ".jpeg")]
        for start in range(0, min(len(pictures), options.most), 25):
            some = pictures[start : min(start + 25, options.most)]
            old, new = (
                run(program, "detect", "--board", board, "--square", "25mm", "--json", *some).split("\n")
                for program in (options.old, options.new)
            )
            counts["pictures"] = counts.get("pictures", 0) + len(some)
            differs += [f"pictures: {a[:90]}" for a, b in zip(old, new) if a != b]
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()) + f": {len(differs)} differ")
    print("\n".join(differs))
    sys.exit(bool(differs))


if __name__ == "__main__":
    main()
