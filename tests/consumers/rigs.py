#!/usr/bin/env python3
"""Reads each export of a rig with the program or the rules that it is for, and carries points from the first camera to
the second: 1e-9 m apart at most.

usage: rigs.py RIG.json [--boresight target/release/boresight]

Needs numpy, opencv-python-headless and PyYAML. Used if they are there: Octave, pycolmap, aniposelib, yourdfpy.
"""
import argparse, importlib.util, json, pathlib, re, shutil, subprocess, tempfile
import xml.etree.ElementTree as xml

import cv2
import numpy as np
import yaml

POINTS = np.random.default_rng(1).uniform([-1, -1, 0.5], [1, 1, 4], (1000, 3))


def pose(entry):
    """Rotation and translation of a pose in rig.json."""
    return quaternion(*entry["rotation_wxyz"]), np.array(entry["translation_m"])


def quaternion(w, x, y, z):
    """Rotation matrix of a unit quaternion."""
    v = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * (np.outer(v, v) - v @ v * np.eye(3))


def opencv(text, folder):
    path = folder / "stereo.yaml"
    path.write_text(text)
    stored = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    get = lambda name: stored.getNode(name).mat()
    size = tuple(int(stored.getNode(name).real()) for name in ("image_width", "image_height"))
    r, t = get("R"), get("T").reshape(3, 1)
    if stored.getNode("fisheye_model").empty():
        made = cv2.stereoRectify(get("M1"), get("D1"), get("M2"), get("D2"), size, r, t, flags=cv2.CALIB_ZERO_DISPARITY, alpha=-1)
        for name, own in zip(("R1", "R2"), made):
            assert np.abs(get(name) - own).max() < 1e-9, name
        # The common focal length is a choice of each program; rows must agree.
        rows = [(lambda p: p[1] / p[2])(get(f"P{n}") @ np.vstack([get("R1") @ POINTS.T, np.ones(len(POINTS))])) for n in "12"]
        assert np.abs(rows[0] - rows[1]).max() < 1e-9
    return f"OpenCV {cv2.__version__}", POINTS @ r.T + t.T


def kalibr(text, _):
    motion = np.array(yaml.safe_load(text)["cam1"]["T_cn_cnm1"])
    return "Kalibr's rules", POINTS @ motion[:3, :3].T + motion[:3, 3]


def urdf(text, folder):
    name = "second"
    if importlib.util.find_spec("yourdfpy"):
        import yourdfpy

        path = folder / "rig.urdf"
        path.write_text(text)
        robot = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
        child = [link for link in robot.link_map if link.endswith("_optical_frame")][1]
        rig_from_cam, name = robot.get_transform(child, "rig"), "yourdfpy"
    else:
        origin = xml.fromstring(text).findall("joint")[1].find("origin")
        xyz, rpy = ([float(v) for v in origin.get(key).split()] for key in ("xyz", "rpy"))
        about = lambda axis, angle: cv2.Rodrigues(np.eye(3)[axis] * angle)[0]
        rig_from_cam, name = np.eye(4), "URDF's rules"
        rig_from_cam[:3, :3] = about(2, rpy[2]) @ about(1, rpy[1]) @ about(0, rpy[0])
        rig_from_cam[:3, 3] = xyz
    return name, (POINTS - rig_from_cam[:3, 3]) @ rig_from_cam[:3, :3]


def ros_tf(text, _):
    args = xml.fromstring(text).findall("node")[1].get("args")
    get = lambda name: float(re.search(rf"--{name} (\S+)", args).group(1))
    turn = quaternion(*(get(name) for name in ("qw", "qx", "qy", "qz")))
    return "tf2's rules", (POINTS - [get(name) for name in "xyz"]) @ turn


def matlab(text, folder):
    if not shutil.which("octave"):
        return None
    (folder / "stereo.m").write_text(text)
    said = f"cd {folder}; stereo; printf('%.17g ', R, T, principal_point1, principal_point2)"
    ran = subprocess.run(["octave", "--no-gui", "--quiet", "--eval", said], capture_output=True, text=True, check=True)
    n = [float(v) for v in ran.stdout.split()]
    return "Octave", POINTS @ np.array(n[:9]).reshape(3, 3) + np.array(n[9:12]) / 1e3


def colmap(text, folder):
    if not importlib.util.find_spec("pycolmap"):
        return None
    import pycolmap

    path = folder / "rig_config.json"
    path.write_text(text)
    camera = pycolmap.read_rig_config(str(path))[0].cameras[1]
    return f"pycolmap {pycolmap.__version__}", np.array([camera.cam_from_rig * point for point in POINTS])


def anipose(text, folder):
    if not importlib.util.find_spec("aniposelib"):
        return None
    from aniposelib.cameras import CameraGroup

    path = folder / "calibration.toml"
    path.write_text(text)
    motion = CameraGroup.load(str(path)).cameras[1].get_extrinsics_mat()
    return "aniposelib", (1e3 * POINTS @ motion[:3, :3].T + motion[:3, 3]) / 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rig")
    parser.add_argument("--boresight", default="target/release/boresight")
    arguments = parser.parse_args()
    rig = json.loads(pathlib.Path(arguments.rig).read_text())
    (r1, t1), (r2, t2) = (pose(camera["cam_from_rig"]) for camera in rig["cameras"][:2])
    wanted = ((POINTS - t1) @ r1) @ r2.T + t2
    formats = {"opencv-stereo": opencv, "kalibr-rig": kalibr, "urdf": urdf, "ros-tf": ros_tf, "matlab-stereo": matlab, "colmap-rig": colmap, "anipose": anipose}
    failed = []
    for kind, read in formats.items():
        text = subprocess.run([arguments.boresight, "export", arguments.rig, "--format", kind], capture_output=True, text=True)
        if text.returncode not in (0, 3):
            print(f"{kind:14} refused: {text.stderr.strip()}")
            continue
        with tempfile.TemporaryDirectory() as folder:
            got = read(text.stdout, pathlib.Path(folder))
        if got is None:
            print(f"{kind:14} not read: its program isn't here")
            continue
        reader, carried = got
        off_m = np.abs(carried - wanted).max()
        print(f"{kind:14} {reader:22} {off_m:.1e} m")
        failed.extend([] if off_m < 1e-9 else [kind])
    if failed:
        raise SystemExit(f"wrong: {', '.join(failed)}")


main()
