"""Our bundle adjustment and OpenCV's calibrateCamera on the same corners, and what each method says of real cameras.

usage: compare_calibrations.py --boresight BINARY --board 9x6 [--square 25mm] PICTURES…

Corners are found once, by this program, and handed to both as a table, all with the same weight. OpenCV
estimates each lens model that was tried here, with square pixels. Printed are both root mean squares per
coordinate and the largest relative difference of the parameters, then every method's principal point
beside OpenCV's own from its own corners.
"""
import argparse, json, os, subprocess, tempfile
import cv2
import numpy as np


def opencv(objects, corners, size, model, start):
    flags = cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_USE_INTRINSIC_GUESS
    for name, flag in [("k1", cv2.CALIB_FIX_K1), ("k2", cv2.CALIB_FIX_K2), ("k3", cv2.CALIB_FIX_K3)]:
        flags |= 0 if name in model else flag
    flags |= 0 if "p1" in model else cv2.CALIB_ZERO_TANGENT_DIST
    matrix = np.array([[start[0], 0, start[1]], [0, start[0], start[2]], [0, 0, 1.0]])
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 500, 1e-14)
    rms, matrix, distortion, *_ = cv2.calibrateCamera(
        objects, corners, size, matrix, np.zeros(5), flags=flags, criteria=criteria)
    d = distortion.ravel()
    # OpenCV's figure is per corner, ours per coordinate.
    return rms / np.sqrt(2), matrix, d


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--boresight", required=True)
    arguments.add_argument("--board", required=True)
    arguments.add_argument("--square", default="25mm")
    arguments.add_argument("pictures", nargs="+")
    given = arguments.parse_args()
    columns, rows = map(int, given.board.split("x"))
    common = ["--board", given.board, "--square", given.square]
    found = subprocess.run([given.boresight, "detect", *common, "--json", *given.pictures],
                           capture_output=True, text=True).stdout
    views = [json.loads(line) for line in found.splitlines()]
    views = [view for view in views if view["found"]]
    height, width = cv2.imread(given.pictures[0], cv2.IMREAD_GRAYSCALE).shape
    with tempfile.TemporaryDirectory() as folder:
        table = os.path.join(folder, "corners.vnl")
        with open(table, "w") as out:
            out.write("# filename x y level\n")
            for view in views:
                for _, _, x, y, _ in sorted(view["corners"], key=lambda c: (c[1], c[0])):
                    out.write(f"{os.path.basename(view['file'])} {x!r} {y!r} 0\n")
        printed = subprocess.run(
            [given.boresight, "calibrate", table, *common, "--image-size", f"{width}x{height}", "--json"],
            capture_output=True, text=True)
    ours = json.loads(printed.stdout)
    result = ours["result"]
    grid = np.array([[c, r, 0] for r in range(rows) for c in range(columns)], np.float32)
    corners = [np.array([[x, y] for _, _, x, y, _ in sorted(view["corners"], key=lambda c: (c[1], c[0]))],
                        np.float32) for view in views]
    print(f"{len(views)} views, {width}x{height}, verdict {ours['verdict']}, "
          f"findings {[finding['code'] for finding in ours['findings']]}")
    names = ["k1", "k2", "p1", "p2", "k3"]
    # All corners have one weight: the cost is their squares over one variance.
    coordinates = 2 * len(views) * columns * rows
    sigma = 0.1
    for candidate in ours["candidates"]:
        model = candidate["model"]
        start = (candidate["f_px"][0], *candidate["pp_px"])
        rms, matrix, d = opencv([grid] * len(views), corners, (width, height), model, start)
        theirs = [matrix[0, 0], matrix[0, 2], matrix[1, 2], *d[:5]]
        mine = [*start, *[candidate["distortion"][name] for name in names]]
        free = [0, 1, 2] + [3 + i for i, name in enumerate(names) if name in model]
        worst = max(abs(mine[i] - theirs[i]) / abs(theirs[i]) for i in free)
        values = ", ".join(f"{['f', 'cx', 'cy', *names][i]} {mine[i]:.6g}" for i in free)
        print(f"  {model:10} rms ours {np.sqrt(candidate['cost'] / coordinates) * sigma:.6f} px, rms OpenCV {rms:.6f} px, "
              f"parameters differ by at most {worst:.1e}: {values}")
    for name, estimate in ours["principal_point"].items():
        if estimate:
            sigma = estimate.get("sigma_px")
            spread = f" ± ({sigma[0]:.2f}, {sigma[1]:.2f})" if sigma else ""
            f_px = estimate.get("f_px")
            focal = f", f {f_px if isinstance(f_px, float) else f_px[0]:.1f}" if f_px else ""
            print(f"  {name:16} ({estimate['px'][0]:.2f}, {estimate['px'][1]:.2f}){spread}{focal}")
    own = []
    for path in given.pictures:
        image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
        ok, seen = cv2.findChessboardCorners(image, (columns, rows))
        if ok:
            criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
            own.append(cv2.cornerSubPix(image, seen, (5, 5), (-1, -1), criteria).reshape(-1, 2))
    rms, matrix, d, *_ = cv2.calibrateCamera([grid] * len(own), own, (width, height), None, None)
    print(f"  OpenCV, its own corners and model (k1 k2 p1 p2 k3), {len(own)} views: "
          f"({matrix[0, 2]:.2f}, {matrix[1, 2]:.2f}), f {matrix[0, 0]:.1f} {matrix[1, 1]:.1f}, rms {rms / np.sqrt(2):.3f}")


main()
