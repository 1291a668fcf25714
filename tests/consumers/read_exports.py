#!/usr/bin/env python3
"""Reads every export with the program or the rules that it is for, and projects 1,000 points through that reader's
own lens model.

usage: read_exports.py CALIBRATION.json [--boresight target/release/boresight]

Needs numpy, opencv-python-headless and PyYAML; mrcal is used if it is there (Debian: python3-mrcal).
"""
import argparse, json, re, subprocess

import cv2
import numpy as np
import yaml


def export(program, calibration, kind):
    run = subprocess.run([program, "export", calibration, "--format", kind], capture_output=True, text=True)
    return (run.stdout, run.stderr) if run.returncode in (0, 3) else (None, run.stderr.strip())


def ours(k, points):
    """The model as documented: x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + tangential, px = f x_d + c."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x * x + y * y
    radial = 1 + r2 * (k["k1"] + r2 * (k["k2"] + r2 * k["k3"]))
    xd = x * radial + 2 * k["p1"] * x * y + k["p2"] * (r2 + 2 * x * x)
    yd = y * radial + k["p1"] * (r2 + 2 * y * y) + 2 * k["p2"] * x * y
    return np.stack([k["fx"] * xd + k["cx"], k["fy"] * yd + k["cy"]], -1)


def by_opencv(matrix, distortion, points):
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.array(matrix, float).reshape(3, 3), np.array(distortion, float))[0].reshape(-1, 2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("calibration")
    parser.add_argument("--boresight", default="target/release/boresight")
    arguments = parser.parse_args()
    report = json.load(open(arguments.calibration))
    r, (w, h) = report["result"], report["image_size"]
    k = dict(fx=r["f_px"][0], fy=r["f_px"][1], cx=r["pp_px"][0], cy=r["pp_px"][1], **r["distortion"])
    rng = np.random.default_rng(1)
    reach = np.array([0.5 * w / k["fx"], 0.5 * h / k["fy"]])
    points = np.column_stack([rng.uniform(-1, 1, (1000, 2)) * reach, np.ones(1000)]) * rng.uniform(0.3, 3, (1000, 1))
    truth = ours(k, points)
    lens = [k[n] for n in ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")]
    failed = []

    def tell(kind, reader, numbers, projected, offset=0.0):
        worst = max(abs(a - b) for a, b in zip(numbers, lens[: len(numbers)]))
        off = float(np.abs(projected - offset - truth).max())
        ok = worst == 0 and off < 1e-6
        failed.extend([] if ok else [kind])
        print(f"{kind:12} {reader:28} parameters off by {worst:g}, projection by {off:.1e} px  {'ok' if ok else 'FAILED'}")

    text, _ = export(arguments.boresight, arguments.calibration, "opencv-yaml")
    store = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    m, d = store.getNode("camera_matrix").mat(), store.getNode("distortion_coefficients").mat().ravel()
    tell("opencv-yaml", "cv2.FileStorage", [m[0, 0], m[1, 1], m[0, 2], m[1, 2], *d], by_opencv(m, d, points))

    text, _ = export(arguments.boresight, arguments.calibration, "ros-yaml")
    info = yaml.safe_load(text)
    assert info["distortion_model"] == "plumb_bob" and (info["image_width"], info["image_height"]) == (w, h)
    for name, shape in (("camera_matrix", (3, 3)), ("rectification_matrix", (3, 3)), ("projection_matrix", (3, 4)), ("distortion_coefficients", (1, 5))):
        block = info[name]
        assert (block["rows"], block["cols"]) == shape and len(block["data"]) == shape[0] * shape[1]
    m, d = info["camera_matrix"]["data"], info["distortion_coefficients"]["data"]
    tell("ros-yaml", "PyYAML, camera_info rules", [m[0], m[4], m[2], m[5], *d], by_opencv(m, d, points))

    text, why = export(arguments.boresight, arguments.calibration, "kalibr")
    if text is None:
        print(f"kalibr       refused: {why}")
        failed.extend([] if k["k3"] else ["kalibr"])
    else:
        cam = yaml.safe_load(text)["cam0"]
        assert cam["camera_model"] == "pinhole" and cam["distortion_model"] == "radtan" and cam["resolution"] == [w, h]
        f, d = cam["intrinsics"], cam["distortion_coeffs"]
        tell("kalibr", "PyYAML, camchain rules", [*f, *d], by_opencv([f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1], d, points))

    text, _ = export(arguments.boresight, arguments.calibration, "colmap")
    line = [t for t in text.splitlines() if not t.startswith("#")][0].split()
    assert line[0] == "1" and (int(line[2]), int(line[3])) == (w, h)
    p = [float(v) for v in line[4:]]
    count = {"PINHOLE": 4, "OPENCV": 8, "FULL_OPENCV": 12}[line[1]]
    assert len(p) == count
    # COLMAP's (0, 0) is the corner of the top-left pixel, ours its centre.
    d = p[4:] + [0.0] * (8 - len(p[4:])) if count > 4 else [0.0] * 8
    tell("colmap", f"text rules, {line[1]}", [p[0], p[1], p[2] - 0.5, p[3] - 0.5], by_opencv([p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1], d, points), 0.5)

    text, _ = export(arguments.boresight, arguments.calibration, "matlab")
    value = lambda name: [float(v) for v in re.search(rf"^{name} = \[?([^\];]*)", text, re.M).group(1).split(",")]
    f, c, radial, tangential = value("focal_length"), value("principal_point"), value("radial_distortion"), value("tangential_distortion")
    d = [*radial[:2], *tangential, radial[2]]
    tell("matlab", "assignments as text", [*f, c[0] - 1, c[1] - 1, *d], by_opencv([f[0], 0, c[0], 0, f[1], c[1], 0, 0, 1], d, points), 1.0)

    text, _ = export(arguments.boresight, arguments.calibration, "mrcal")
    try:
        import mrcal, os, tempfile

        with tempfile.NamedTemporaryFile("w", suffix=".cameramodel", delete=False) as file:
            file.write(text)
        model = mrcal.cameramodel(file.name)
        os.unlink(file.name)
        tell("mrcal", "mrcal.cameramodel", list(model.intrinsics()[1]), mrcal.project(points, *model.intrinsics()))
    except ImportError:
        # The file is a Python literal; this is how mrcal reads it.
        model = eval(text, {"__builtins__": {}})
        assert model["imagersize"] == [w, h] and len(model["extrinsics"]) == 6
        numbers = model["intrinsics"]
        d = numbers[4:] or [0.0] * 5
        tell("mrcal", f"literal, {model['lensmodel']}", numbers, by_opencv([numbers[0], 0, numbers[2], 0, numbers[1], numbers[3], 0, 0, 1], d, points))
    raise SystemExit(f"failed: {failed}" if failed else 0)


main()
