#!/usr/bin/env python3
"""Measures how hands move in a video of a checkerboard: the numbers behind the simulated people's sway.

usage: hand_motion.py DETECTIONS.jsonl FPS WIDTHxHEIGHT [--grid-mm 200]

DETECTIONS.jsonl is what `boresight detect --json` prints for the video's pictures, in order. Focal length and one
radial coefficient are fitted over the video's own views, with the principal point in the middle. Lengths are
millimetres on a board whose longer side of inner corners measures --grid-mm. Prints, per axis (translation in mm,
rotation in degrees):

- windows: rms over the quietest twentieth of all windows of 0.3 to 2 s, and the corners' rms displacement in px;
- spectrum: slope of the log density between 1.5 and 6 Hz, and rms at 7-12.5 Hz, in the quieter half of all windows
  of 1 and 2 s, without their linear trend.

Needs numpy, scipy and opencv-python-headless.
"""
import argparse, json

import cv2
import numpy as np
from scipy.signal import detrend
from scipy.spatial.transform import Rotation


def read(path):
    """Corners of every picture in numbering order, or None; and the board's columns and rows."""
    views, board = [], None
    for line in open(path, encoding="utf-8"):
        picture = json.loads(line)
        board = tuple(picture["board"])
        if not picture["found"]:
            views.append(None)
            continue
        at = {(int(c[0]), int(c[1])): c[2:4] for c in picture["corners"]}
        columns, rows = board
        views.append(np.array([at[i, j] for j in range(rows) for i in range(columns)]))
    return views, board


def lens_of(views, board_mm, size):
    found = [view for view in views if view is not None]
    some = [found[i] for i in np.unique(np.linspace(0, len(found) - 1, 40).astype(int))]
    guess = np.array([[0.9 * size[0], 0, size[0] / 2], [0, 0.9 * size[0], size[1] / 2], [0, 0, 1.0]])
    flags = (cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO
             | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3)
    _, matrix, distortion, _, _ = cv2.calibrateCamera(
        [board_mm] * len(some), [view.astype(np.float32) for view in some], size, guess.copy(), None, flags=flags)
    plausible = 0.4 * size[0] < matrix[0, 0] < 2.5 * size[0]
    return (matrix, distortion) if plausible else (guess, np.zeros(5))


def poses_of(views, board_mm, matrix, distortion):
    poses, last = [], None
    for view in views:
        if view is None:
            poses.append(None)
            last = None
            continue
        if last is None:
            _, turn, shift, _ = cv2.solvePnPGeneric(board_mm, view, matrix, distortion, flags=cv2.SOLVEPNP_IPPE)
            last = turn[0], shift[0]
        turn, shift = last[0].copy(), last[1].copy()
        _, turn, shift = cv2.solvePnP(board_mm, view, matrix, distortion, turn, shift, True, cv2.SOLVEPNP_ITERATIVE)
        last = turn, shift
        poses.append((Rotation.from_rotvec(turn.ravel()), shift.ravel()))
    return poses


def track(poses, start, end):
    """Six columns against the middle picture, or None if a picture has no pose."""
    part = poses[start:end]
    if any(pose is None for pose in part):
        return None
    turn0, shift0 = part[len(part) // 2]
    return np.array([np.r_[shift - shift0, np.degrees((turn * turn0.inv()).as_rotvec())] for turn, shift in part])


def print_windows(views, poses, fps):
    for secs in (0.3, 0.6, 1.0, 2.0):
        count = max(3, round(secs * fps) + 1)
        rows = []
        for start in range(len(poses) - count + 1):
            part = track(poses, start, start + count)
            if part is not None:
                corners = np.array(views[start:start + count])
                moved_px = np.sqrt(((corners - corners.mean(0)) ** 2).sum(2).mean())
                rows.append((moved_px, part.std(0)))
        if rows:
            rows.sort(key=lambda row: row[0])
            quiet = rows[:max(1, len(rows) // 20)]
            rms = np.sqrt(np.mean([row[1] ** 2 for row in quiet], 0))
            print(f"  {secs} s, {len(rows)} windows: {quiet[0][0]:.2f}-{quiet[-1][0]:.2f} px; {np.round(rms, 3)}")


def print_spectrum(poses, fps):
    for secs in (1.0, 2.0):
        count = round(secs * fps)
        rows = []
        for start in range(0, len(poses) - count + 1, max(1, count // 4)):
            part = track(poses, start, start + count) if count >= 16 else None
            if part is not None:
                part = detrend(part, axis=0)
                taper = np.hanning(count)[:, None]
                density = np.abs(np.fft.rfft(part * taper, axis=0)) ** 2 * 2 / (fps * (taper ** 2).sum())
                rows.append((part[:, :2].std(), density))
        if not rows:
            continue
        rows.sort(key=lambda row: row[0])
        density = np.median([row[1] for row in rows[:max(1, len(rows) // 2)]], 0)
        hz = np.fft.rfftfreq(count, 1 / fps)
        falling = (hz >= 1.5) & (hz <= min(6, 0.4 * fps))
        slope = np.polyfit(np.log(hz[falling]), np.log(density[falling]), 1)[0]
        print(f"  {secs} s, {len(rows)} windows: slope {np.round(slope, 1)}", end="")
        tremor = (hz >= 7) & (hz <= 12.5)
        if fps > 25:
            print(f"; 7-12.5 Hz rms {np.round(np.sqrt(np.trapezoid(density[tremor], hz[tremor], axis=0)), 3)}", end="")
        print()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("detections")
    parser.add_argument("fps", type=float)
    parser.add_argument("size")
    parser.add_argument("--grid-mm", type=float, default=200.0)
    args = parser.parse_args()
    size = tuple(int(side) for side in args.size.split("x"))
    views, (columns, rows) = read(args.detections)
    board_mm = np.zeros((columns * rows, 3), np.float32)
    board_mm[:, :2] = np.mgrid[:columns, :rows].T.reshape(-1, 2) * args.grid_mm / (max(columns, rows) - 1)
    board_mm -= board_mm.mean(0)
    matrix, distortion = lens_of(views, board_mm, size)
    poses = poses_of(views, board_mm, matrix, distortion)
    distance_mm = np.median([pose[1][2] for pose in poses if pose])
    print(f"f {matrix[0, 0]:.0f} px, {matrix[0, 0] / distance_mm:.2f} px/mm; x y z in mm, then about x y z in degrees")
    print_windows(views, poses, args.fps)
    print_spectrum(poses, args.fps)


if __name__ == "__main__":
    main()
