#!/usr/bin/env python3
"""The Python package beside OpenCV on the same pictures, in one run and one thread.

usage: python_beside_opencv.py [--boards FOLDER] [--session FOLDER]

FOLDER of boards has a manifest.csv (file, inner_cols, inner_rows, has_board, visible): time per picture, as medians of the
ratio. FOLDER of a session has truth.json of the simulated camera: error of the corners. OpenCV is
findChessboardCorners with its usual flags and cornerSubPix, as its tutorials call them.
Needs boresight, numpy and opencv-python-headless.
"""
import argparse
import csv
import json
import statistics
import time
from pathlib import Path

import cv2
import numpy as np

import boresight

FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.001)
REPEATS = 3


def opencv(image, size):
    found, corners = cv2.findChessboardCorners(image, size, None, FLAGS)
    if not found:
        return None
    grid = corners.reshape(size[1], size[0], 2)
    side = min(np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1))
    half = int(np.clip(round(side * 0.35), 2, 11))
    return cv2.cornerSubPix(image, corners, (half, half), (-1, -1), STOP).reshape(-1, 2)


def ours(image, size):
    return boresight.detect(image, size).corners_px


def cpu_secs(find, image, size):
    """The least of some runs: what else runs on the computer only adds to it."""
    times = []
    for _ in range(REPEATS):
        began = time.thread_time()
        found = find(image, size)
        times.append(time.thread_time() - began)
    return min(times), found


def speed(folder):
    ratios, own, theirs, found = [], [], [], [0, 0, 0]
    for row in csv.DictReader((folder / "manifest.csv").open()):
        if row["has_board"] != "1" or row["visible"] != "full":
            continue
        image = cv2.imread(str(folder / row["file"]), cv2.IMREAD_GRAYSCALE)
        if image is None:
            continue
        size = (int(row["inner_cols"]), int(row["inner_rows"]))
        own_secs, own_found = cpu_secs(ours, image, size)
        their_secs, their_found = cpu_secs(opencv, image, size)
        own.append(own_secs)
        theirs.append(their_secs)
        ratios.append(their_secs / own_secs)
        found[0] += 1
        found[1] += own_found is not None
        found[2] += their_found is not None
    count, own_found, their_found = found
    print(f"{count} pictures: boresight finds {own_found}, OpenCV {their_found}")
    print(f"median time: boresight {statistics.median(own) * 1e3:.1f} ms, OpenCV {statistics.median(theirs) * 1e3:.1f} ms")
    print(f"median of the ratio: {statistics.median(ratios):.1f}")


def error(session):
    truth = json.loads((session / "truth.json").read_text())
    result = json.loads((session / "calibration.json").read_text())
    board = boresight.Board(result["board"]["columns"], result["board"]["rows"], result["board"]["square_mm"])
    poses = {pose["frame"]: pose for pose in truth["cam_from_board"]}
    lens = truth["distortion"]
    lens = np.array([lens[name] for name in ("k1", "k2", "p1", "p2", "k3")] if isinstance(lens, dict) else lens)
    (fx, fy), (cx, cy) = truth["f_px"], truth["pp_px"]
    camera = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    errors = {"boresight": [], "OpenCV": []}
    for path in sorted((session / "frames").glob("*.png")):
        pose = poses.get(int(path.stem))
        if pose is None:
            continue
        w, x, y, z = pose["rotation_wxyz"]
        angle = 2 * np.arctan2(np.linalg.norm([x, y, z]), w)
        axis = np.array([x, y, z]) / max(np.linalg.norm([x, y, z]), 1e-300)
        where, _ = cv2.projectPoints(
            board.points_mm / 1000, axis * angle, np.array(pose["translation_m"]), camera, lens
        )
        where = where.reshape(-1, 2)
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        for name, find in (("boresight", ours), ("OpenCV", opencv)):
            corners = find(image, (board.columns, board.rows))
            if corners is not None:
                apart = min((corners - where, corners - where[::-1]), key=lambda d: np.abs(d).max())
                errors[name].append(np.sqrt((apart**2).mean()))
    for name, all_errors in errors.items():
        print(f"{name}: {len(all_errors)} boards, RMS error {np.sqrt(np.mean(np.square(all_errors))):.4f} px per coordinate")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boards", type=Path)
    parser.add_argument("--session", type=Path)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    if arguments.boards:
        speed(arguments.boards)
    if arguments.session:
        error(arguments.session)
