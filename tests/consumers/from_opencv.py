#!/usr/bin/env python3
"""The OpenCV script of python/README.md, before and after, on your pictures: what each prints, side by side.

usage: from_opencv.py 9x6 25 PICTURES…

The board is named by its inner corners; 25 is the side of a square in millimetres.
"""
import contextlib, io, os, pathlib, re, shutil, sys, tempfile, time
from importlib.metadata import version

import numpy as np

README = pathlib.Path(__file__).resolve().parents[2] / "python/README.md"


def main():
    board, square, pictures = sys.argv[1], sys.argv[2], sys.argv[3:]
    columns, rows = board.split("x")
    script = README.read_text().split("## From an OpenCV script")[1]
    before, after = re.findall(r"```python\n(.*?)```", script, re.DOTALL)[:2]
    named = {"7, 5": f"{columns}, {rows}", ":7, :5": f":{columns}, :{rows}", "35": str(int(columns) * int(rows)), '"7x5"': f'"{board}"', "30 *": f"{square} *", "square_mm=30": f"square_mm={square}"}
    ended = {}
    pictures = [os.path.abspath(picture) for picture in pictures]
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        pathlib.Path("pictures").mkdir()
        for number, picture in enumerate(pictures):
            # OpenCV reads any picture whatever its name ends with.
            shutil.copy(picture, f"pictures/{number:04}.png")
        for name, block in (("OpenCV", before), ("boresight", after)):
            for was, becomes in named.items():
                block = block.replace(was, becomes)
            began, ended[name] = time.time(), {}
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block, name, "exec"), ended[name])
            lines = sum(1 for line in block.splitlines() if line.strip())
            ended[name] |= {"seconds": time.time() - began, "lines": lines}
        os.chdir("/")
    cv2 = ended["OpenCV"]["cv2"]
    result, sigma = ended["boresight"]["result"], ended["boresight"]["result"].sigma
    print(f"{len(pictures)} pictures of {result.image_size[0]} x {result.image_size[1]}, board {board}; cv2 {cv2.__version__}, boresight {version('boresight')}")
    views = {name: len(end["rvecs"]) for name, end in ended.items()}
    rows_of = {name: (end["mtx"], np.append(np.ravel(end["dist"]), np.zeros(8))) for name, end in ended.items()}
    stated = {"fx": sigma["f_px"][0], "fy": sigma["f_px"][1], "cx": sigma["pp_px"][0], "cy": sigma["pp_px"][1], "k1": sigma["k1"], "k2": sigma["k2"]}
    print(f"{'':8}{'OpenCV':>12}{'boresight':>12}  stated sd")
    for what in ("lines", "seconds"):
        print(f"{what:8}" + "".join(f"{end[what]:12.{0 if what == 'lines' else 1}f}" for end in ended.values()))
    print(f"{'lens':8}{'k1k2p1p2k3':>12}{result.data['result']['model']:>12}")
    print(f"{'views':8}{views['OpenCV']:12}{views['boresight']:12}")
    print(f"{'RMS px':8}{ended['OpenCV']['rms']:12.3f}{result.data['result']['rms_px']:12.3f}")
    for what, of in (("fx", lambda k, d: k[0, 0]), ("fy", lambda k, d: k[1, 1]), ("cx", lambda k, d: k[0, 2]), ("cy", lambda k, d: k[1, 2]), ("k1", lambda k, d: d[0]), ("k2", lambda k, d: d[1])):
        print(f"{what:8}" + "".join(f"{of(k, d):12.4f}" for k, d in rows_of.values()) + f"  {stated[what]:.4f}")
    apart = cv2.absdiff(ended["OpenCV"]["flat"], ended["boresight"]["flat"])
    print(f"the last picture without distortion: median difference {np.median(apart):.0f} grey levels")
    print(f"boresight says {result.verdict.upper()}:", ", ".join(finding["code"] for finding in result.findings) or "nothing found")


main()
