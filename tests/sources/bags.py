"""Whole sessions from bags that others wrote, held against the pictures that went in.

Run by `make test-sources`: bags.py --boresight PROGRAM. PROGRAM has the feature `bags`.
"""

import argparse
import json
import os
import sqlite3
import subprocess
import tempfile
from pathlib import Path

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from write_bags import TOPIC, TYPES, every_kind, stamp

arguments = argparse.ArgumentParser()
arguments.add_argument("--boresight", required=True)
PROGRAM = str(Path(arguments.parse_args().boresight).resolve())


def run(*words, status=0):
    ended = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)
    if status is not None:
        assert ended.returncode == status, (words, ended.returncode, ended.stderr[-2000:])
    return ended


def simulated(place):
    """Pictures of a simulated camera and person, as a session stores them, in order."""
    session = place / "simulated"
    run("guide", "--headless", "--source", "sim", "--out", session, "--record-stream", "--max-frames", 900,
        "--set", "guidance.plan=quick", status=None)
    files = sorted((session / "frames").iterdir())
    return [cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files]


def stored(session):
    return {int(file.stem): cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in (session / "frames").iterdir()}


def guided(place, bag, *more):
    """A session from `bag`; its stored pictures, and its result."""
    session = place / f"session-{bag.name}-{len(list(place.iterdir()))}"
    ended = run("guide", "--headless", "--source", bag, "--out", session, "--record-stream",
                "--set", "guidance.plan=quick", *more, status=None)
    result = session / "calibration.json"
    return stored(session) if session.exists() else {}, json.loads(result.read_text()) if result.exists() else None, ended


def lens(result):
    return result["camera"] if "camera" in result else result


with tempfile.TemporaryDirectory(dir=os.environ.get("BORESIGHT_TEST_DIR")) as folder:
    place = Path(folder)
    pictures = simulated(place)
    print(f"{len(pictures)} pictures of {pictures[0].shape[1]}x{pictures[0].shape[0]}")
    bags = every_kind(place, pictures, 1 << 20)

    # Every kind: the same pictures, hence the same session.
    verdicts = set()
    for name, bag in bags.items():
        more = ["--topic", "/right/image_raw"] if name == "two.db3" else []
        seen, result, ended = guided(place, bag, *more)
        assert result, (name, ended.stderr[-1000:])
        for number, picture in seen.items():
            assert np.array_equal(picture, pictures[number]), (name, number)
        views = result["views"] if "views" in result else []
        verdicts.add((result["verdict"], len(views), json.dumps(result.get("intrinsics", result.get("lens")))))
        print(f"{name}: {bag.stat().st_size} bytes, {len(seen)} pictures stored, all equal; {result['verdict']}")
    assert len(verdicts) == 1, verdicts

    # A folder of ROS 2, as it is.
    seen, result, ended = guided(place, bags["rosbags.db3"].parent)
    assert result and all(np.array_equal(p, pictures[n]) for n, p in seen.items())

    # Several topics, none named.
    ended = run("guide", "--headless", "--source", bags["two.db3"], status=1)
    assert "/left/image_raw" in ended.stderr and "--topic" in ended.stderr, ended.stderr

    # Cut in a row of places: equal pictures, and the end is said.
    for name in ["lz4.mcap", "zstd.mcap", "plain.mcap", "rosbags.db3", "messages.db3"]:
        whole, counts = bags[name].read_bytes(), []
        for share in [0.02, 0.1, 0.37, 0.61, 0.9, 0.999]:
            cut = place / f"cut-{name}"
            cut.write_bytes(whole[: int(share * len(whole))])
            ended = run("detect", "--json", "--board", "9x6", cut, status=None)
            counts.append(len(ended.stdout.splitlines()))
            assert "damaged after picture" in ended.stderr or "can't be read" in ended.stderr, (name, share, ended.stderr[-300:])
            cut.unlink()
        print(f"{name} cut at 2, 10, 37, 61, 90, 99.9 %: pictures {counts} of {len(pictures)}")

    # All of them at once: each kind's row has the session's verdict, a cut one what its whole pictures give.
    many = place / "many"
    many.mkdir()
    for name in ["lz4.mcap", "rosbags.db3", "messages.db3"]:
        (many / name).write_bytes(bags[name].read_bytes())
    cut = many / "cut.mcap"
    cut.write_bytes(bags["plain.mcap"].read_bytes()[: int(0.9 * bags["plain.mcap"].stat().st_size)])
    manifest = place / "manifest.jsonl"
    manifest.write_text(run("batch", "plan", many).stdout)
    run("batch", "run", manifest, "--action", "calibrate", "--out", place / "batch", "--set", "guidance.plan=quick")
    rows = [json.loads(line) for line in run("batch", "gather", place / "batch", status=None).stdout.splitlines()]
    rows = {Path(row["session"]).name: row for row in rows if "session" in row}
    wanted = next(iter(verdicts))[0]
    assert {name: (row["code"], row["verdict"]) for name, row in rows.items() if name != "cut.mcap"} == {
        name: ("OK", wanted) for name in ["lz4.mcap", "rosbags.db3", "messages.db3"]}, rows
    assert rows["cut.mcap"]["code"] == "BAG" and rows["cut.mcap"]["verdict"], rows["cut.mcap"]
    print(f"batch: {[(name, row['code'], row['verdict']) for name, row in rows.items()]}")

    # The calibration in a copy, read by others.
    calibration = next(place.glob("session-*/calibration.json"))
    yaml = run("export", calibration, "--format", "ros-yaml", status=None).stdout
    fx = float(yaml.split("data: [")[1].split(",")[0])
    copy = place / "copy.mcap"
    run("export", calibration, "--bag", bags["zstd.mcap"], "--out", copy, status=None)
    stamps = []
    with open(copy, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, info in reader.iter_decoded_messages(topics=["/camera/camera_info"]):
            assert abs(info.k[0] - fx) < 1e-9 and info.header.frame_id == "optical" and info.distortion_model
            assert (info.height, info.width) == pictures[0].shape and info.p[10] == 1.0
            stamps.append(info.header.stamp.sec * 10**9 + info.header.stamp.nanosec)
        assert stamps == [stamp(n) for n in range(len(pictures))]
        count = reader.get_summary().statistics.message_count
        assert count == 3 * len(pictures), count
    copy = place / "copy.db3"
    run("export", calibration, "--bag", bags["jazzy.db3"], "--out", copy, status=None)
    database = sqlite3.connect(copy)
    rows = database.execute(
        "SELECT data FROM messages JOIN topics ON topics.id = topic_id WHERE name = '/camera/camera_info' ORDER BY messages.id"
    ).fetchall()
    infos = [TYPES.deserialize_cdr(row[0], "sensor_msgs/msg/CameraInfo") for row in rows]
    assert [i.header.stamp.sec * 10**9 + i.header.stamp.nanosec for i in infos] == stamps
    assert all(abs(i.k[0] - fx) < 1e-9 for i in infos)
    print(f"CameraInfo beside {len(stamps)} pictures, read by mcap-ros2-support and rosbags")
print("recorded bags: all well")
