#!/usr/bin/env python3
"""Reads every export with the program or the rules that it is for, and projects 1,000 points through that reader's
own lens model.

usage: read_exports.py CALIBRATION.json|SESSION [--boresight target/release/boresight]

Of a session folder, mrcal also gets its views.

Needs numpy, opencv-python-headless and PyYAML. Used if they are there: ROS's own reader (Debian:
python3-camera-calibration-parsers), Octave, mrcal, pycolmap, open3d, and Nerfstudio.
"""
import argparse, json, pathlib, re, shutil, subprocess, tempfile
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version

import cv2
import numpy as np
import yaml


def export(program, calibration, kind):
    run = subprocess.run([program, "export", calibration, "--format", kind], capture_output=True, text=True)
    return (run.stdout, run.stderr) if run.returncode in (0, 3) else (None, run.stderr.strip())


def installed(package):
    """Its version: that of the Python package, else that of Debian's."""
    try:
        return version(package)
    except PackageNotFoundError:
        asked = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", f"python3-{package}"], capture_output=True, text=True)
        return asked.stdout or "from elsewhere"


def ours(k, points):
    """The models as documented: x_d = x m + tangential, px = f x_d + c."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    if k["fisheye"]:
        flat = np.arctan2(np.hypot(x, y), 1) / np.maximum(np.hypot(x, y), 1e-12)
        x, y = x * flat, y * flat
    r2 = x * x + y * y
    radial = 1 + r2 * (k["k1"] + r2 * (k["k2"] + r2 * k["k3"]))
    if k["fisheye"]:
        radial += r2**4 * k["k4"]
    else:
        radial /= 1 + r2 * (k["k4"] + r2 * (k["k5"] + r2 * k["k6"]))
    xd = x * radial + 2 * k["p1"] * x * y + k["p2"] * (r2 + 2 * x * x)
    yd = y * radial + k["p1"] * (r2 + 2 * y * y) + 2 * k["p2"] * x * y
    return np.stack([k["fx"] * xd + k["cx"], k["fy"] * yd + k["cy"]], -1)


def by_opencv(matrix, distortion, points):
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.array(matrix, float).reshape(3, 3), np.array(distortion, float))[0].reshape(-1, 2)


def by_opencv_fisheye(matrix, distortion, points):
    projected = cv2.fisheye.projectPoints(points.reshape(1, -1, 3), np.zeros(3), np.zeros(3), np.array(matrix, float).reshape(3, 3), np.array(distortion, float))
    return projected[0].reshape(-1, 2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("calibration")
    parser.add_argument("--boresight", default="target/release/boresight")
    arguments = parser.parse_args()
    result = pathlib.Path(arguments.calibration)
    report = json.loads((result / "calibration.json" if result.is_dir() else result).read_text())
    r, (w, h) = report["result"], report["image_size"]
    k = dict(k4=0.0, k5=0.0, k6=0.0, fisheye=False) | r["distortion"]
    k |= dict(fx=r["f_px"][0], fy=r["f_px"][1], cx=r["pp_px"][0], cy=r["pp_px"][1])
    fisheye, rational = k["fisheye"], any(k[n] for n in ("k4", "k5", "k6")) and not k["fisheye"]
    project = by_opencv_fisheye if fisheye else by_opencv
    rng = np.random.default_rng(1)
    reach = np.array([0.5 * w / k["fx"], 0.5 * h / k["fy"]])
    points = np.column_stack([rng.uniform(-1, 1, (1000, 2)) * reach, np.ones(1000)])
    if fisheye:
        # In proportion to the angle, up to 84 degrees.
        angle = np.minimum(np.hypot(points[:, 0], points[:, 1]), 1.47)
        points[:, :2] *= (np.tan(angle) / np.hypot(points[:, 0], points[:, 1]))[:, None]
    points *= rng.uniform(0.3, 3, (1000, 1))
    truth = ours(k, points)
    coefficients = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    lens = [k[n] for n in ("fx", "fy", "cx", "cy", *coefficients)]
    failed = []

    def tell(kind, reader, numbers, projected, offset=0.0, within=1e-6):
        worst = max((abs(a - b) for a, b in zip(numbers, lens[: len(numbers)])), default=0.0)
        off = float(np.abs(projected - offset - truth).max())
        ok = worst == 0 and off < within
        failed.extend([] if ok else [kind])
        print(f"{kind:12} {reader:28} parameters off by {worst:g}, projection by {off:.1e} px  {'ok' if ok else 'FAILED'}")

    text, _ = export(arguments.boresight, arguments.calibration, "opencv-yaml")
    store = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    m, d = store.getNode("camera_matrix").mat(), store.getNode("distortion_coefficients").mat().ravel()
    assert (store.getNode("fisheye_model").real() == 1) == fisheye
    tell("opencv-yaml", "cv2.FileStorage", [m[0, 0], m[1, 1], m[0, 2], m[1, 2], *d], project(m, d, points))

    for kind in ("opencv-xml", "opencv-json"):
        text, _ = export(arguments.boresight, arguments.calibration, kind)
        store = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        m, d = store.getNode("camera_matrix").mat(), store.getNode("distortion_coefficients").mat().ravel()
        tell(kind, f"cv2.FileStorage {cv2.__version__}", [m[0, 0], m[1, 1], m[0, 2], m[1, 2], *d], project(m, d, points))
    read_named(arguments, export, tell, project, points, k, fisheye, rational, (w, h), failed)

    text, _ = export(arguments.boresight, arguments.calibration, "ros-yaml")
    info = yaml.safe_load(text)
    assert info["distortion_model"] == ("equidistant" if fisheye else "rational_polynomial" if rational else "plumb_bob")
    assert (info["image_width"], info["image_height"]) == (w, h)
    for name, shape in (("camera_matrix", (3, 3)), ("rectification_matrix", (3, 3)), ("projection_matrix", (3, 4)), ("distortion_coefficients", (1, 4 if fisheye else 8 if rational else 5))):
        block = info[name]
        assert (block["rows"], block["cols"]) == shape and len(block["data"]) == shape[0] * shape[1]
    m, d = info["camera_matrix"]["data"], info["distortion_coefficients"]["data"]
    tell("ros-yaml", "PyYAML, camera_info rules", [m[0], m[4], m[2], m[5], *d], project(m, d, points))
    read_ros(text, tell, points, project, info)

    text, why = export(arguments.boresight, arguments.calibration, "kalibr")
    if text is None:
        print(f"kalibr       refused: {why}")
        failed.extend([] if rational or (k["k3"] and not fisheye) else ["kalibr"])
    else:
        cam = yaml.safe_load(text)["cam0"]
        assert cam["camera_model"] == "pinhole" and cam["resolution"] == [w, h]
        assert cam["distortion_model"] == ("equidistant" if fisheye else "radtan")
        f, d = cam["intrinsics"], cam["distortion_coeffs"]
        tell("kalibr", "PyYAML, camchain rules", [*f, *d], project([f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1], d, points))

    text, _ = export(arguments.boresight, arguments.calibration, "colmap")
    line = [t for t in text.splitlines() if not t.startswith("#")][0].split()
    assert line[0] == "1" and (int(line[2]), int(line[3])) == (w, h)
    p = [float(v) for v in line[4:]]
    count = {"PINHOLE": 4, "OPENCV": 8, "FULL_OPENCV": 12, "OPENCV_FISHEYE": 8}[line[1]]
    assert len(p) == count
    # COLMAP's (0, 0) is the corner of the top-left pixel, ours its centre.
    d = p[4:] if fisheye else p[4:] + [0.0] * (8 - len(p[4:])) if count > 4 else [0.0] * 8
    numbers = [p[0], p[1], p[2] - 0.5, p[3] - 0.5]
    tell("colmap", f"text rules, {line[1]}", numbers, project([p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1], d, points), 0.5)
    read_colmap(text, tell, points, numbers, line[1])

    text, why = export(arguments.boresight, arguments.calibration, "matlab")
    if text is None:
        print(f"matlab       refused: {why}")
        failed.extend([] if fisheye or rational else ["matlab"])
    else:
        read_matlab(text, tell, points)

    text, why = export(arguments.boresight, arguments.calibration, "mrcal")
    if text is None:
        print(f"mrcal        refused: {why}")
        failed.extend([] if fisheye else ["mrcal"])
    else:
        read_mrcal(text, tell, points, (w, h))
    raise SystemExit(f"failed: {failed}" if failed else 0)


def read_named(arguments, export, tell, project, points, k, fisheye, rational, size, failed):
    """Formats that name each number; those of programs that read with cv::FileStorage are read with it."""
    from xml.etree import ElementTree

    flat = lambda f, d: project([f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1], d, points)

    def written(kind, refused):
        text, why = export(arguments.boresight, arguments.calibration, kind)
        if text is None:
            print(f"{kind:12} refused: {why.splitlines()[0]}")
            failed.extend([] if refused else [kind])
        return text

    four, browns = ["k1", "k2", "k3", "k4"], ["k1", "k2", "p1", "p2", "k3"]
    names = four if fisheye else browns

    def stored(text, *path):
        store = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        node = store.getNode(path[0])
        for name in path[1:]:
            node = node.getNode(name)
        return 0.0 if node.empty() else node.real() if not node.isString() else node.string()

    if text := written("orb-slam3", rational):
        # As its Settings.cc reads them.
        assert stored(text, "Camera.type") == ("KannalaBrandt8" if fisheye else "PinHole")
        assert (stored(text, "Camera.width"), stored(text, "Camera.height")) == size
        f, d = ([stored(text, f"Camera1.{n}") for n in group] for group in (["fx", "fy", "cx", "cy"], names))
        tell("orb-slam3", f"cv2.FileStorage {cv2.__version__}", [*f, *d], flat(f, d))
    if text := written("vins", True):
        if fisheye:
            f = [stored(text, "projection_parameters", n) for n in ("mu", "mv", "u0", "v0")]
            d = [stored(text, "projection_parameters", n) for n in ("k2", "k3", "k4", "k5")]
        else:
            f = [stored(text, "projection_parameters", n) for n in ("fx", "fy", "cx", "cy")]
            d = [stored(text, "distortion_parameters", n) for n in ("k1", "k2", "p1", "p2")]
        tell("vins", f"cv2.FileStorage {cv2.__version__}", [*f, *d], flat(f, d))
    if text := written("nerf", rational):
        t = json.loads(text)
        assert (t["camera_model"], t["w"], t["h"]) == ("OPENCV_FISHEYE" if fisheye else "OPENCV", *size)
        f, d = [t["fl_x"], t["fl_y"], t["cx"], t["cy"]], [t.get(n, 0.0) for n in names]
        tell("nerf", "json, Nerfstudio's rules", [*f[:2], f[2] - 0.5, f[3] - 0.5, *d], flat(f, d), 0.5)
        read_nerfstudio(t, tell, points, k)
    if text := written("metashape", rational):
        t = {e.tag: e.text for e in ElementTree.fromstring(text)}
        v = lambda n: float(t[n])
        assert t["projection"] == ("fisheye" if fisheye else "frame") and (v("width"), v("height")) == size
        # u = w/2 + cx + x' f + x' b1, pixels from the corner; P1 and P2 the other way round.
        f = [v("f") + v("b1"), v("f"), v("cx") + size[0] / 2, v("cy") + size[1] / 2]
        d = [v(n) for n in four] if fisheye else [v("k1"), v("k2"), v("p2"), v("p1"), v("k3")]
        off = flat(f, d) - 0.5
        tell("metashape", "ElementTree, its manual's rules", [f[0], f[1]], off)
    if text := written("realitycapture", fisheye or rational or k["fx"] != k["fy"]):
        # As its article on the XMP's mathematics says: in longer sides, from the middle; t1 and t2 the other way round.
        t = next(e for e in ElementTree.fromstring(text).iter() if e.tag.endswith("Description"))
        v = lambda n: float(t.attrib["{http://www.capturingreality.com/ns/xcr/1.1#}" + n])
        f = [v("FocalLength35mm") / 36 * max(size)] * 2 + [side / 2 + v(n) * max(size) for side, n in zip(size, ("PrincipalPointU", "PrincipalPointV"))]
        k1, k2, k3, k4, t1, t2 = map(float, t[0].text.split())
        assert k4 == 0
        off = flat(f, [k1, k2, t2, t1, k3]) - 0.5
        tell("realitycapture", "ElementTree, its article's rules", [], off)
    if text := written("basalt", False):
        t = json.loads(text)["value0"]
        i = t["intrinsics"][0]["intrinsics"]
        assert t["resolution"] == [[*size]]
        d = [i[n] for n in four] if fisheye else [i.get(n, 0.0) for n in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
        f = [i[n] for n in ("fx", "fy", "cx", "cy")]
        tell("basalt", f"json, {t['intrinsics'][0]['camera_type']}", [*f, *d], flat(f, d))
    if text := written("photonvision", fisheye):
        t = json.loads(text)
        assert (t["resolution"]["width"], t["resolution"]["height"]) == size
        m, d = t["cameraIntrinsics"]["data"], t["distCoeffs"]["data"]
        tell("photonvision", "json, its rules", [m[0], m[4], m[2], m[5], *d], project(m, d, points))
    if text := written("gyroflow", not fisheye):
        t = json.loads(text)["fisheye_params"]
        m, d = np.array(t["camera_matrix"]), t["distortion_coeffs"]
        tell("gyroflow", "json, its rules", [m[0, 0], m[1, 1], m[0, 2], m[1, 2], *d], project(m, d, points))
    if text := written("open3d", True):
        try:
            import open3d
        except ImportError:
            return
        with in_file(text, ".json") as path:
            read = open3d.io.read_pinhole_camera_intrinsic(path)
        m = read.intrinsic_matrix
        assert (read.width, read.height) == size
        tell("open3d", f"open3d {open3d.__version__}", [m[0, 0], m[1, 1], m[0, 2], m[1, 2]], project(m, np.zeros(5), points))


@contextmanager
def in_file(text, suffix):
    """Path of a file with this text, for readers that take nothing else."""
    with tempfile.NamedTemporaryFile("w", suffix=suffix) as file:
        file.write(text)
        file.flush()
        yield file.name


def read_ros(text, tell, points, project, info):
    try:
        from camera_calibration_parsers import readCalibration
    except ImportError:
        return
    with in_file(text, ".yaml") as path:
        name, read = readCalibration(path)
    assert (name, read.width, read.height) == (info["camera_name"], info["image_width"], info["image_height"])
    assert read.distortion_model == info["distortion_model"] and read.P[:3] == read.K[:3]
    numbers = [read.K[0], read.K[4], read.K[2], read.K[5], *read.D]
    reader = f"camera_calibration_parsers {installed('camera-calibration-parsers')}"
    tell("ros-yaml", reader, numbers, project(read.K, read.D, points))


def read_colmap(text, tell, points, numbers, model):
    try:
        import pycolmap
    except ImportError:
        return
    with tempfile.TemporaryDirectory() as folder:
        for name, content in (("cameras", text), ("images", ""), ("points3D", "")):
            (pathlib.Path(folder) / f"{name}.txt").write_text(content)
        (camera,) = pycolmap.Reconstruction(folder).cameras.values()
    assert camera.model.name == model
    read = [*camera.params[:2], *(camera.params[2:4] - 0.5)]
    assert read == numbers[:4]
    projected = np.array([camera.img_from_cam(point) for point in points]).reshape(-1, 2)
    tell("colmap", f"pycolmap {pycolmap.__version__}", [*read, *camera.params[4:]], projected, 0.5)


def read_nerfstudio(transforms, tell, points, k):
    try:
        import torch
        from nerfstudio.data.dataparsers.nerfstudio_dataparser import NerfstudioDataParserConfig
    except ImportError:
        return
    from PIL import Image

    with tempfile.TemporaryDirectory() as folder:
        frame = {"file_path": "frame.png", "transform_matrix": np.eye(4).tolist()}
        (pathlib.Path(folder) / "transforms.json").write_text(json.dumps(transforms | {"frames": [frame]}))
        Image.new("L", (transforms["w"], transforms["h"])).save(pathlib.Path(folder) / "frame.png")
        as_it_is = dict(orientation_method="none", center_method="none", auto_scale_poses=False, load_3D_points=False)
        parser = NerfstudioDataParserConfig(data=pathlib.Path(folder), eval_mode="all", downscale_factor=1, **as_it_is).setup()
        cameras = parser.get_dataparser_outputs("train").cameras
    # The rays of 1,000 pixels, which it computes with 32 bits, and where they lead by the lens as documented.
    down_right = torch.tensor(ours(k, points)[:, ::-1] + 0.5, dtype=torch.float32)
    rays = cameras.generate_rays(camera_indices=0, coords=down_right).directions.numpy().astype(float)
    tell("nerf", f"nerfstudio {version('nerfstudio')}, its rays", [], ours(k, rays * [1, -1, -1]), within=1e-3)


def read_matlab(text, tell, points):
    value = lambda name: [float(v) for v in re.search(rf"^{name} = \[?([^\];]*)", text, re.M).group(1).split(",")]
    by = {"assignments as text": [value(n) for n in ("focal_length", "principal_point", "radial_distortion", "tangential_distortion")]}
    if shutil.which("octave"):
        said = text + "printf('%.17g ', focal_length, principal_point, radial_distortion, tangential_distortion, intrinsic_matrix);"
        ran = subprocess.run(["octave", "--no-gui", "--quiet", "--eval", said], capture_output=True, text=True, check=True)
        n = [float(number) for number in ran.stdout.split()]
        assert n[9:] == [n[0], 0, 0, 0, n[1], 0, n[2], n[3], 1], "columns of the intrinsic matrix"
        name = subprocess.run(["octave", "--version"], capture_output=True, text=True).stdout.split(",")[1].split("\n")[0].strip()
        by[f"Octave {name.removeprefix('version ')}"] = [n[:2], n[2:4], n[4:7], n[7:9]]
    for reader, (f, c, radial, tangential) in by.items():
        d = [*radial[:2], *tangential, radial[2]]
        tell("matlab", reader, [*f, c[0] - 1, c[1] - 1, *d], by_opencv([f[0], 0, c[0], 0, f[1], c[1], 0, 0, 1], d, points), 1.0)


def read_mrcal(text, tell, points, size):
    try:
        import mrcal

        with in_file(text, ".cameramodel") as path:
            model = mrcal.cameramodel(path)
        tell("mrcal", f"mrcal {installed('mrcal')}", list(model.intrinsics()[1]), mrcal.project(points, *model.intrinsics()))
        if (inputs := model.optimization_inputs()) is not None:
            # What mrcal makes of the session's views: residuals, and its own uncertainty in the picture's middle.
            x = mrcal.optimizer_callback(**inputs, no_jacobian=True, no_factorization=True)[1]
            count = np.count_nonzero(inputs["observations_board"][..., 2] > 0)
            rms = np.sqrt(np.mean(x[: mrcal.num_measurements_boards(**inputs)] ** 2) * inputs["observations_board"][..., 2].size / count)
            ray = mrcal.unproject((np.array(size) - 1.0) / 2, *model.intrinsics())
            sd = mrcal.projection_uncertainty(ray * 1.0, model, what="worstdirection-stdev")
            print(f"mrcal        its own: {len(inputs['observations_board'])} views, {count} corners, rms {rms:.3f} px, uncertainty in the middle {sd:.3f} px")
            if not (rms < 1 and 0 < sd < 10):
                raise SystemExit("mrcal's view of the session is another one")
    except ImportError:
        # The file is a Python literal; this is how mrcal reads it.
        model = eval(text, {"__builtins__": {}})
        assert model["imagersize"] == list(size) and len(model["extrinsics"]) == 6
        numbers = model["intrinsics"]
        d = numbers[4:] or [0.0] * 5
        tell("mrcal", f"literal, {model['lensmodel']}", numbers, by_opencv([numbers[0], 0, numbers[2], 0, numbers[1], numbers[3], 0, 0, 1], d, points))


main()
