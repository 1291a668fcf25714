#!/usr/bin/env python3
"""Every format with every kind of lens, through the whole program: 1,000 points are projected through the camera before it
was written and after it was read back, 1e-9 px apart at most, or the format refuses the lens, or is for rigs.
Then `read_exports.py` lets other programs read the files.

usage: every_format.py --boresight target/release/boresight [--session SESSION]

Needs what `read_exports.py` needs.
"""
import argparse, json, pathlib, re, subprocess, sys, tempfile

import cv2
import numpy as np

SIZE = (1280, 960)
# Focal lengths, principal point, and OpenCV's coefficients, whether of cv2.fisheye.
LENSES = {
    "pinhole": ([905.3, 905.3, 640.25, 477.125], [], False),
    "square": ([905.3, 905.3, 640.25, 477.125], [-0.21, 0.07, 8e-4, -5e-4, -0.013], False),
    "brown": ([905.3, 907.1, 640.25, 477.125], [-0.21, 0.07, 8e-4, -5e-4], False),
    "brown k3": ([905.3, 907.1, 640.25, 477.125], [-0.21, 0.07, 8e-4, -5e-4, -0.013], False),
    "rational": ([905.3, 907.1, 640.25, 477.125], [0.3, 0.05, 5e-4, -3e-4, 0.002, 0.65, 0.15, 0.01], False),
    "fisheye": ([405.3, 406.1, 640.25, 477.125], [-0.02, 0.011, -0.004, 0.0007], True),
}


def camera_of(path):
    read = json.loads(path.read_text())
    assert tuple(read["image_size"]) == SIZE
    return read["result"]


def projected(result, rays):
    """The lens models as docs/schemas.md states them."""
    d, fisheye = dict(k4=0.0, k5=0.0, k6=0.0) | result["distortion"], bool(result["distortion"].get("fisheye"))
    x, y = rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
    if fisheye:
        away = np.hypot(x, y)
        x, y = x * np.arctan(away) / away, y * np.arctan(away) / away
    r2 = x * x + y * y
    radial = 1 + r2 * (d["k1"] + r2 * (d["k2"] + r2 * d["k3"]))
    if fisheye:
        radial += r2**4 * d["k4"]
    else:
        radial /= 1 + r2 * (d["k4"] + r2 * (d["k5"] + r2 * d["k6"]))
    x, y = (
        x * radial + 2 * d["p1"] * x * y + d["p2"] * (r2 + 2 * x * x),
        y * radial + d["p1"] * (r2 + 2 * y * y) + 2 * d["p2"] * x * y,
    )
    return np.stack([x, y], -1) * result["f_px"] + result["pp_px"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boresight", default="target/release/boresight")
    parser.add_argument("--session")
    arguments = parser.parse_args()
    place = tempfile.TemporaryDirectory()
    folder = pathlib.Path(place.name)

    def boresight(*words):
        return subprocess.run([arguments.boresight, *map(str, words)], capture_output=True, text=True)

    formats = re.findall(r"^ +- ([\w-]+): ", boresight("convert", "--help").stdout, re.M)
    cameras = [name for name in formats if name not in ("json", "views-csv", "vnl")]
    assert len(cameras) >= 17, cameras
    rays = np.random.default_rng(3).uniform([-0.65, -0.5, 1], [0.65, 0.5, 1], (1000, 3))
    rays *= np.random.default_rng(4).uniform(0.3, 3, (1000, 1))
    worst, failed = {name: {} for name in cameras}, []
    for lens, ((fx, fy, cx, cy), coefficients, fisheye) in LENSES.items():
        begun = folder / f"{lens}.yaml"
        file = cv2.FileStorage(str(begun), cv2.FILE_STORAGE_WRITE)
        file.write("image_width", SIZE[0])
        file.write("image_height", SIZE[1])
        file.write("fisheye_model", int(fisheye))
        file.write("camera_matrix", np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]))
        file.write("distortion_coefficients", np.array([coefficients or [0.0] * 5]).T)
        file.release()
        first = folder / f"{lens}.json"
        ended = boresight("convert", begun, first, "--format", "json")
        assert ended.returncode == 0, ended.stderr
        truth = projected(camera_of(first), rays)
        by_cv2 = (cv2.fisheye if fisheye else cv2).projectPoints(
            rays.reshape(1, -1, 3), np.zeros(3), np.zeros(3), np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(coefficients or [0.0] * 4)
        )[0].reshape(-1, 2)
        assert np.abs(by_cv2 - truth).max() < 1e-9, "boresight reads another lens than OpenCV"
        for name in cameras:
            there, back = folder / f"{lens}.{name}", folder / f"{lens}.{name}.json"
            ended = boresight("convert", first, there, "--format", name)
            if ended.returncode != 0:
                known = {"can't hold this lens": "refused", "takes several cameras": "a rig's"}
                words = (word for text, word in known.items() if text in ended.stderr)
                worst[name][lens] = next(words, "FAILED")
                if worst[name][lens] == "FAILED" or there.exists():
                    failed.append((name, lens, ended.stderr))
            elif name == "matlab":
                worst[name][lens] = "written"
            else:
                ended = boresight("convert", there, back, "--format", "json")
                off = np.abs(projected(camera_of(back), rays) - truth).max() if ended.returncode == 0 else np.inf
                worst[name][lens] = f"{off:.0e}"
                if not off <= 1e-9:
                    failed.append((name, lens, off, ended.stderr))
    print(f"{'there and back, px':18}", *(f"{lens:>9}" for lens in LENSES))
    for name in cameras:
        print(f"{name:18}", *(f"{worst[name][lens]:>9}" for lens in LENSES))
    for source in [folder / f"{lens}.json" for lens in LENSES] + ([arguments.session] if arguments.session else []):
        print(f"\n{pathlib.Path(source).stem}:", flush=True)
        readers = pathlib.Path(__file__).parent / "read_exports.py"
        ended = subprocess.run([sys.executable, readers, source, "--boresight", arguments.boresight])
        if ended.returncode != 0:
            failed.append(("read_exports.py", str(source)))
    raise SystemExit(f"failed: {failed}" if failed else 0)


main()
