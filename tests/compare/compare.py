#!/usr/bin/env python3
"""boresight, OpenCV, mrcal, calib-targets and vision-calibration on the same pictures of a board: what each finds, and how well
what it calibrates predicts views that it hasn't seen.

usage: compare.py --boresight PROGRAM --board 9x6 [--square 25mm] [--peers PROGRAM] FOLDER… (or a pattern: "pictures/left*")

OpenCV finds corners as its tutorial does (findChessboardCorners and cornerSubPix), and by findChessboardCornersSB; it solves with
calibrateCamera as it comes (k1 k2 p1 p2 k3). mrcal solves for the same lens, and for the bend of the board, as it comes; its own
finder, mrgingham, has no option for boards that aren't as wide as high. calib-targets finds corners and vision-calibration solves as
the first example of each does (k1 k2 p1 p2); both are in the program of tests/compare/peers. Needs numpy and
opencv-python-headless; mrcal from Debian and the peers' program are optional.

- found: pictures in which the whole board is found. Parts of it, which boresight and calib-targets find, too, don't count.
- wrong: of those, pictures with a corner that is off by more than a quarter of a square: from the truth, or without one from
  the median of all finders, where three have found the board.
- error: median distance of corners from the truth, where a recorded simulation has it (truth.json).
- rms: of the residuals with that lens in all views, per coordinate.
- unseen: solved on every second view, RMS of residuals in the other views, whose poses alone are fitted; and the other way
  round. The corners are OpenCV's and, behind the stroke, boresight's; the board is taken as flat.
- apart: difference of the halves' focal length, cx and cy in their stated standard deviations. About 1 is right.
- seconds: of one processor, to find the corners in all pictures and to solve once.
"""
import argparse
import ast
import collections
import glob
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.001)
# A corner that's further off isn't this corner, in squares.
WRONG_SQUARES = 0.25
# In OpenCV's order, the rational lens's last three behind them.
BROWN = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
FISHEYE = ("k1", "k2", "k3", "k4")


class Failed(Exception):
    pass


def run(command, **options):
    """What it prints, and its seconds of the processor. Printing nothing is a failure, whose reason is the Failed raised."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if not ended.stdout and ended.returncode:
        raise Failed(f"{pathlib.Path(command[0]).name} failed: {ended.stderr.strip()}")
    return ended.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


class Set:
    def __init__(self, named, board, square):
        files = map(pathlib.Path, glob.glob(f"{named}/*" if os.path.isdir(named) else named))
        self.pictures = sorted(path.resolve() for path in files if path.suffix.lower() in (".png", ".jpg", ".jpeg"))
        if not self.pictures:
            sys.exit(f"no pictures: {named}")
        self.columns, self.rows = map(int, board.split("x"))
        self.board, self.square = board, square
        self.square_m = float(square.removesuffix("mm")) / 1000
        grid = np.mgrid[: self.columns, : self.rows].T.reshape(-1, 2)
        self.points = np.column_stack([grid, np.zeros(len(grid))]).astype(np.float32)
        self.size = cv2.imread(str(self.pictures[0]), cv2.IMREAD_GRAYSCALE).shape[::-1]
        truth = self.pictures[0].parent.parent / "truth.json"
        self.truth = json.loads(truth.read_text()) if truth.exists() else None

    def true_corners(self):
        """Where a recorded simulation has the corners of each picture; nothing without one."""
        if not self.truth:
            return {}
        poses = {pose["frame"]: pose for pose in self.truth["cam_from_board"]}
        (fx, fy), (cx, cy) = self.truth["f_px"], self.truth["pp_px"]
        camera = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        lens = np.array([self.truth["distortion"].get(name, 0.0) for name in BROWN])
        middle = np.array([self.columns - 1, self.rows - 1, 0]) / 2
        placed = (self.points - middle) * self.square_m
        true = {}
        for path in self.pictures:
            w, *axis = poses[int(path.stem)]["rotation_wxyz"]
            sine = np.linalg.norm(axis)
            turn = np.array(axis) / sine * 2 * np.arctan2(sine, w)
            seen, _ = cv2.projectPoints(placed, turn, np.array(poses[int(path.stem)]["translation_m"]), camera, lens)
            true[path] = seen.reshape(-1, 2)
        return true

    def agreed_corners(self, finders):
        """Where the finders have the corners: their median, of pictures in which at least three have found the board."""
        agreed = {}
        for path in self.pictures:
            seen = [found[path] for found, _ in finders if path in found]
            if len(seen) >= 3:
                agreed[path] = np.median([as_numbered(each, seen[0]) for each in seen], axis=0)
        return agreed

    def wrong(self, corners, reference):
        """Pictures in which a corner isn't where it should be."""
        shape = (self.rows, self.columns, 2)
        side = lambda grid: min(np.linalg.norm(np.diff(grid.reshape(shape), axis=axis), axis=-1).min() for axis in (0, 1))
        off = lambda path, true: np.linalg.norm(as_numbered(corners[path], true) - true, axis=1).max()
        return sum(off(path, true) > WRONG_SQUARES * side(true) for path, true in reference.items() if path in corners)


def as_numbered(seen, other):
    """The corners in the other's order: a plain board may be numbered from either end."""
    return min((seen, seen[::-1]), key=lambda turned: np.abs(turned - other).max())


def found_by_opencv(images, size, classic):
    began, found = time.process_time(), {}
    for path, image in images.items():
        if classic:
            there, seen = cv2.findChessboardCorners(image, size, None, FLAGS)
            if there:
                grid = seen.reshape(size[1], size[0], 2)
                side = min(np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1))
                half = int(np.clip(round(side * 0.35), 2, 11))
                seen = cv2.cornerSubPix(image, seen, (half, half), (-1, -1), STOP)
        else:
            there, seen = cv2.findChessboardCornersSB(image, size, None, cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY)
        if there:
            found[path] = seen.reshape(-1, 2).astype(float)
    return found, time.process_time() - began


def found_by_boresight(program, given):
    printed, seconds = run([program, "detect", "--json", "--board", given.board, *given.pictures])
    found = {}
    for line in map(json.loads, printed.splitlines()):
        if line["found"] and len(line["corners"]) == len(given.points):
            corners = sorted(line["corners"], key=lambda corner: (corner[1], corner[0]))
            found[pathlib.Path(line["file"])] = np.array([corner[2:4] for corner in corners])
    return found, seconds


def found_by_calib_targets(peers, given):
    printed, seconds = run([peers, "detect", given.board, *given.pictures])
    found = collections.defaultdict(list)
    for line in printed.splitlines()[1:]:
        picture, x, y, _ = line.rsplit(" ", 3)
        found[pathlib.Path(picture)].append((float(x), float(y)))
    return {path: np.array(corners) for path, corners in found.items()}, seconds


def table(corners, path):
    with path.open("w") as out:
        out.write("# filename x y level\n")
        for picture, seen in corners.items():
            out.writelines(f"{picture} {x!r} {y!r} 0\n" for x, y in seen.tolist())


def solved_by_opencv(given, corners):
    began = time.process_time()
    seen = [each.astype(np.float32) for each in corners.values()]
    _, camera, lens, _, _, sd, *_ = cv2.calibrateCameraExtended([given.points] * len(seen), seen, given.size, None, None)
    sd = sd.ravel()
    return dict(camera=camera, lens=lens.ravel()[:5], sd=sd[[0, 2, 3]], seconds=time.process_time() - began)


def solved_by_boresight(program, given, corners):
    with tempfile.TemporaryDirectory() as folder:
        written = pathlib.Path(folder) / "corners.vnl"
        table(corners, written)
        size = "x".join(map(str, given.size))
        command = [program, "calibrate", written, "--board", given.board, "--square", given.square, "--image-size", size, "--json"]
        printed, seconds = run(command)
    judged = json.loads(printed)
    result = judged["result"]
    (fx, fy), (cx, cy) = result["f_px"], result["pp_px"]
    variance = np.diag(result["covariance"]["matrix"])
    order = result["covariance"]["order"]
    sd = np.sqrt([variance[order.index(name)] for name in ("f" if "f" in order else "fx", "cx", "cy")])
    camera = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    names = FISHEYE if result["model"].startswith("fisheye") else BROWN
    lens = np.array([result["distortion"].get(name, 0.0) for name in names])
    said = f"{judged['verdict'].upper()}, lens {result['model']}" + "".join(f", {finding['code']}" for finding in judged["findings"])
    return dict(camera=camera, lens=lens, sd=sd, seconds=seconds, said=said)


def solved_by_mrcal(given, corners):
    with tempfile.TemporaryDirectory() as folder:
        written = pathlib.Path(folder) / "corners.vnl"
        table(corners, written)
        command = ["mrcal-calibrate-cameras", "--corners-cache", written, "--lensmodel", "LENSMODEL_OPENCV5", "--focal", given.size[0]]
        command += ["--imagersize", *given.size, "--object-spacing", given.square_m, "--object-width-n", given.columns, "--object-height-n", given.rows]
        _, seconds = run([*command, "--outdir", folder, "*"])
        text = (pathlib.Path(folder) / "camera-0.cameramodel").read_text()
    model = ast.literal_eval("\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#")))
    fx, fy, cx, cy, *lens = model["intrinsics"]
    return dict(camera=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), lens=np.array(lens), sd=None, seconds=seconds)


def solved_by_vision_calibration(peers, given, corners):
    with tempfile.TemporaryDirectory() as folder:
        written = pathlib.Path(folder) / "corners.vnl"
        table(corners, written)
        printed, seconds = run([peers, "solve", given.board, given.square_m, written])
    (fx, fy, cx, cy, *lens), sd = (list(map(float, line.split())) for line in printed.splitlines())
    return dict(camera=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), lens=np.array(lens), sd=np.array(sd), seconds=seconds)


def project(given, solution, pose):
    """Where the corners of a board with that pose are seen: four coefficients are a fisheye's."""
    if len(solution["lens"]) == len(FISHEYE):
        where, _ = cv2.fisheye.projectPoints(given.points[:, None].astype(float), pose[:3], pose[3:], solution["camera"], solution["lens"])
    else:
        where, _ = cv2.projectPoints(given.points, pose[:3], pose[3:], solution["camera"], solution["lens"])
    return where.reshape(-1, 2)


def squares(given, solution, corners):
    """Squares of the residuals in views that only give their poses."""
    undistort = cv2.fisheye.undistortPoints if len(solution["lens"]) == len(FISHEYE) else cv2.undistortPoints
    all_views = []
    for seen in corners.values():
        _, turn, shift = cv2.solvePnP(given.points, undistort(seen[:, None], solution["camera"], solution["lens"]), np.eye(3), None)
        pose = np.concatenate([turn, shift]).ravel()
        # Gauss and Newton's method, in pixels.
        for _ in range(8):
            off = project(given, solution, pose) - seen
            slopes = [(project(given, solution, pose + step) - project(given, solution, pose - step)).ravel() / 2e-5 for step in np.eye(6) * 1e-5]
            pose = pose - np.linalg.lstsq(np.array(slopes).T, off.ravel(), rcond=None)[0]
        all_views.append((project(given, solution, pose) - seen) ** 2)
    return all_views


def unseen(given, halves, corners, common):
    """RMS of each half's residuals in the views of the other."""
    return np.sqrt(np.mean([each for half in (0, 1) for each in squares(given, halves[half], {path: corners[path] for path in common[1 - half :: 2]})]))


# Each by itself first, then the corners of one with the solver of another.
ROWS = [
    ("boresight", "boresight"),
    ("OpenCV", "OpenCV"),
    ("OpenCV SB", "OpenCV"),
    ("calib-targets", "vision-calibration"),
    ("boresight", "OpenCV"),
    ("boresight", "mrcal"),
    ("boresight", "vision-calibration"),
    ("OpenCV", "boresight"),
    ("OpenCV", "mrcal"),
    ("calib-targets", "boresight"),
]


def compare(program, peers, given):
    images = {path: cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in given.pictures}
    size = (given.columns, given.rows)
    finders = {
        "boresight": found_by_boresight(program, given),
        "OpenCV": found_by_opencv(images, size, classic=True),
        "OpenCV SB": found_by_opencv(images, size, classic=False),
    }
    solvers = {"boresight": lambda corners: solved_by_boresight(program, given, corners), "OpenCV": lambda corners: solved_by_opencv(given, corners)}
    if shutil.which("mrcal-calibrate-cameras"):
        solvers["mrcal"] = lambda corners: solved_by_mrcal(given, corners)
    if peers:
        finders["calib-targets"] = found_by_calib_targets(peers, given)
        solvers["vision-calibration"] = lambda corners: solved_by_vision_calibration(peers, given, corners)
    true = given.true_corners()
    reference = true or given.agreed_corners(finders.values())
    # Views that all have found judge all.
    common = [path for path in given.pictures if all(path in found for found, _ in finders.values())]
    print("| corners | solved by | found | wrong | error | rms | unseen | apart | seconds |\n|---|---|---|---|---|---|---|---|---|")
    said, notes = "", []
    for finder, solver in ROWS:
        if finder not in finders or solver not in solvers:
            continue
        found, finding = finders[finder]
        judged, apart = "failed", "failed"
        whole = solvers[solver](found)
        try:
            halves = [solvers[solver]({path: found[path] for path in common[half::2]}) for half in (0, 1)]
            judged = " / ".join(f"{unseen(given, halves, finders[judge][0], common):.3f}" for judge in ("OpenCV", "boresight"))
            apart = "–"
            if whole["sd"] is not None:
                centres = [np.array([half["camera"][0, 0], half["camera"][0, 2], half["camera"][1, 2]]) for half in halves]
                apart = ", ".join(f"{value:.1f}" for value in abs(centres[0] - centres[1]) / np.hypot(halves[0]["sd"], halves[1]["sd"]))
        except Failed as failed:
            notes.append(f"{solver} with {finder}'s corners, a half: {failed}.")
        rms = np.sqrt(np.mean(squares(given, whole, found)))
        errors = [np.linalg.norm(as_numbered(found[path], seen) - seen, axis=1) for path, seen in true.items() if path in found]
        error = f"{np.median(np.concatenate(errors)):.4f}" if errors else "–"
        cells = [finder, solver, f"{len(found)} of {len(images)}", str(given.wrong(found, reference)), error, f"{rms:.3f}", judged, apart, f"{finding:.2f} + {whole['seconds']:.2f}"]
        print("| " + " | ".join(cells) + " |")
        said = said or whole["said"]
    print(f"\nThe halves are compared in the {len(common)} views that all of them found. Verdict of boresight on its own result: {said}.", *notes)


def locked(name):
    """The version of a crate that the peers' program is built with."""
    lock = pathlib.Path(__file__).parent / "peers/Cargo.lock"
    return re.search(rf'^name = "{name}"\nversion = "(.*)"', lock.read_text(), re.M)[1]


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--boresight", required=True)
    arguments.add_argument("--peers", help="the program of tests/compare/peers")
    arguments.add_argument("--board", required=True)
    arguments.add_argument("--square", default="25mm")
    arguments.add_argument("folders", nargs="+", metavar="FOLDER")
    asked = arguments.parse_args()
    cv2.setNumThreads(1)
    mrcal = run(["dpkg-query", "-W", "-f=${Version}", "mrcal"])[0] if shutil.which("mrcal-calibrate-cameras") else "not installed"
    program = run([asked.boresight, "--version"])[0].splitlines()[0]
    peers = [f"{name} {locked(name)}" for name in ("calib-targets", "vision-calibration") if asked.peers]
    print("; ".join([program, f"OpenCV {cv2.__version__}", f"mrcal {mrcal}", *peers, time.strftime("%d %B %Y")]))
    for folder in asked.folders:
        given = Set(folder, asked.board, asked.square)
        print(f"\n### {'/'.join(pathlib.Path(folder).parts[-2:])}: {len(given.pictures)} pictures, {given.size[0]} × {given.size[1]}, board {asked.board}\n")
        try:
            compare(asked.boresight, asked.peers, given)
        except Failed as failed:
            sys.exit(str(failed))


if __name__ == "__main__":
    main()
