#!/usr/bin/env python3
"""Makes the sessions of the book's page "Gallery" by the commands that stand there, and holds the page to what comes out.

    examples/gallery/make.py --boresight PROGRAM --out target/gallery [--write] [--pictures FOLDER] [NAME …]

OUT/NAME is a session, OUT/NAME.html its report; with names, only those are made. A page that says something else is a failure; --write writes it anew.
--pictures also takes a picture of each report, with Chromium and cwebp.
"""

import argparse
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "book/src/gallery.md"
VERDICTS = {"good": "Good", "care": "Use with care", "unfinished": "Unfinished", "untrustworthy": "Not trustworthy"}


def sections(page):
    """Each session by its name, with its commands: its folder's name stands in the marker of its facts."""
    for section in re.split(r"^## ", page, flags=re.M)[1:]:
        if name := re.search(r"<!-- facts of (\w+) -->", section):
            commands = re.findall(r"^```sh.*?\n(.*?)^```", section, flags=re.M | re.S)
            yield name[1], "".join(commands)


def record(program, commands, folder):
    """Runs the commands in `folder`. A verdict that isn't good is no failure here."""
    path = f"{program.parent}:{os.environ['PATH']}"
    for line in filter(None, commands.splitlines()):
        ended = subprocess.run(line, shell=True, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True)
        if ended.returncode not in (0, 3):
            sys.exit(f"{line}\n{ended.stderr}")


def facts(session):
    """What the session's calibration says, and how far it is from the truth where that's known."""
    calibration = json.loads((session / "calibration.json").read_text())
    found, lens = calibration["findings"], calibration["result"]
    codes = ", ".join(f"[`{code}`](findings/{code.lower()}.md)" for code in (finding["code"] for finding in found)) or "none"
    rows = [
        ("verdict", f"**{VERDICTS[calibration['verdict']]} (SIMULATED)**"),
        ("findings", codes),
        ("views, RMS", f"{len(calibration['views'])}, {lens['rms_px']:.3f} px"),
    ]
    truth = session / "truth.json"
    if truth.exists():
        true = json.loads(truth.read_text())
        order, matrix = lens["covariance"]["order"], lens["covariance"]["matrix"]
        places = [order.index(name) for name in ("fx" if "fx" in order else "f", "cx", "cy")]
        deviations = [math.sqrt(matrix[at][at]) for at in places]
        pairs = [(lens["f_px"][0], true["f_px"][0]), (lens["pp_px"][0], true["pp_px"][0]), (lens["pp_px"][1], true["pp_px"][1])]
        off = [f"{ours - theirs:+.2f} ± {sd:.2f}" for (ours, theirs), sd in zip(pairs, deviations)]
        rows.append(("off the truth: f, cx, cy", ", ".join(off) + " px"))
    return "| | |\n|---|---|\n" + "".join(f"| {what} | {value} |\n" for what, value in rows)


def shoot(report, into):
    """What follows the report's first sheet, as a small picture: verdict, findings, principal lines, uncertainty, residuals."""
    with tempfile.TemporaryDirectory() as place:
        shot, page = pathlib.Path(place) / "shot.png", pathlib.Path(place) / "page.html"
        page.write_text(report.read_text().replace("</head>", "<style>#certificate { display: none }</style></head>"))
        window = ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--window-size=900,1500", f"--screenshot={shot}"]
        subprocess.run(["chromium", *window, page.as_uri()], check=True, capture_output=True)
        sheet = ["-crop", "52", "20", "796", "1400", "-resize", "640", "0"]
        subprocess.run(["cwebp", "-quiet", "-q", "60", *sheet, shot, "-o", into], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boresight", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("names", metavar="NAME", nargs="*")
    options = parser.parse_args()
    shutil.rmtree(options.out, ignore_errors=True)
    options.out.mkdir(parents=True)
    (options.out / "examples").symlink_to(ROOT / "examples")
    page = held = PAGE.read_text()
    for name, commands in sections(held):
        if options.names and name not in options.names:
            continue
        record(options.boresight.resolve(), commands, options.out)
        report = options.out / f"{name}.html"
        shutil.copy(options.out / name / "report.html", report)
        mark = f"<!-- facts of {name} -->\n"
        before, rest = page.split(mark)
        page = before + mark + facts(options.out / name) + rest[rest.index("<!-- end -->") :]
        if options.pictures:
            shoot(report, options.pictures / f"{name}.webp")
        print(f"{name}: {report.stat().st_size} bytes of report")
    if options.write:
        PAGE.write_text(page)
    elif page != held:
        (options.out / "gallery.md").write_text(page)
        subprocess.run(["diff", PAGE, options.out / "gallery.md"])
        sys.exit(f"{PAGE.relative_to(ROOT)} says something else. To write it: examples/gallery/make.py … --write")
    (options.out / "examples").unlink()


if __name__ == "__main__":
    main()
