"""Whole sessions from a ROS 2 camera's driver over Eclipse Cyclone DDS (PyPI: cyclonedds) and eProsima Fast DDS, and the
calibration for that driver.

Run by `make test-sources`: ros2.py --boresight PROGRAM. PROGRAM has the feature `ros2`; BORESIGHT_FASTDDS is the program of
fastdds_camera.cpp.
"""

import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from scene import Program, all_as_sent, both, poses, save, verdict, wait_for

WIDTH, HEIGHT = 640, 480
DRIVER = Path(__file__).resolve().parents[2] / "wings/sources/tests/ros2_camera.py"
DOMAIN = "77"


class Driver:
    def __init__(self, topic, files, *more):
        self.start(sys.executable, DRIVER, "--domain", DOMAIN, "--topic", topic, "--size", f"{WIDTH}x{HEIGHT}",
                   "--rate", 15, "--each", 3, *more, *files)

    def start(self, *words):
        self.process = subprocess.Popen([*map(str, words)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.wait_for("ready")

    def wait_for(self, word):
        for line in self.process.stdout:
            if line.startswith(word):
                return line.strip()
        raise AssertionError(f"it ended before {word!r}")

    def say(self, words):
        self.process.stdin.write(words + "\n")
        self.process.stdin.flush()

    def do(self, words):
        """Says what it then says back."""
        self.say(words)
        self.wait_for(words.split()[0])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


class FastDds(Driver):
    def __init__(self, files):
        self.start(os.environ["BORESIGHT_FASTDDS"], DOMAIN, WIDTH, HEIGHT, 3, *files)


@dataclass
class Text(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


class Watcher:
    """Another node, which watches sessions."""

    def __init__(self):
        participant = DomainParticipant(int(DOMAIN))
        qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)
        self.reader = DataReader(participant, Topic(participant, "rt/boresight/state", Text), qos=qos)

    def events(self):
        return [json.loads(text.data) for text in self.reader.take(100_000) if isinstance(text, Text)]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--boresight", required=True)
    program = Program(arguments.parse_args().boresight)
    os.environ["ROS_DOMAIN_ID"] = DOMAIN
    with tempfile.TemporaryDirectory(dir=os.environ.get("BORESIGHT_TEST_DIR")) as folder:
        place = Path(folder)
        pictures = poses(WIDTH, HEIGHT)
        files, sent = save(pictures, place), both(pictures)
        watcher = Watcher()

        for topic, more in (("/camera/image_raw", []), ("/camera/image_raw", ["--best-effort"]),
                            ("/camera/image_raw/compressed", [])):
            session = place / f"session-{len(list(place.iterdir()))}"
            with Driver(topic, files, *more) as driver:
                devices = json.loads(program.run("devices", "--json").stdout)
                assert any(camera["source"] == f"ros2:{topic}" for camera in devices["cameras"]), devices
                words = program.guide(f"ros2:{topic}", session, "--set-camera-info", "--ros2-state")
                ended = program.run(*words, status=None, timeout=600)
                assert (session / "calibration.json").exists(), ended.stderr[-2000:]
                judged = verdict(session)
                kept = all_as_sent(session, sent)
                said = ended.stderr.splitlines()
                if judged == "untrustworthy":
                    assert any("keeps its old calibration" in line for line in said), said[-9:]
                    told = "kept from the driver"
                else:
                    info = driver.wait_for("info").split(" ", 4)
                    result = json.loads((session / "calibration.json").read_text())
                    assert info[1:3] == [str(WIDTH), str(HEIGHT)], info
                    yaml = program.run("export", session, "--format", "ros-yaml", "--name", "front", status=None).stdout
                    assert "camera_name: front" in yaml and result
                    fx = float(yaml.split("data: [")[1].split(",")[0])
                    assert f"[{fx}, 0.0," in info[4], (fx, info)
                    told = f"the driver has fx = {fx:.3f}"
                events = watcher.events()
                assert {"message", "view-taken", "end"} <= {event["event"] for event in events}, events[-9:]
                driver.say("quit")
                count = driver.wait_for("sent").split()[1]
            print(f"{topic} {' '.join(more)}: {kept} of {count} pictures kept, all as sent; {judged}; {told}; "
                  f"{len(events)} lines on /boresight/state", flush=True)

        # The other middleware. Its driver prints the request's bytes.
        session = place / "fastdds"
        with FastDds(files) as driver:
            words = program.guide("ros2:/camera/image_raw", session, "--set-camera-info")
            ended = program.run(*words, status=None, timeout=600)
            assert (session / "calibration.json").exists(), ended.stderr[-2000:]
            assert verdict(session) != "untrustworthy", ended.stderr[-2000:]
            info = driver.wait_for("info").split()[1]
            yaml = program.run("export", session, "--format", "ros-yaml", status=None).stdout
            fx = float(yaml.split("data: [")[1].split(",")[0])
            assert struct.pack("<d", fx).hex() in info, (fx, info)
        print(f"Fast DDS: {all_as_sent(session, sent)} pictures, all as sent; {verdict(session)}; "
              f"the driver has fx = {fx:.3f}", flush=True)

        # A result that must not be used isn't given away; a driver may refuse; none may be there.
        with Driver("/camera/image_raw", files) as driver:
            bad = place / "bad"
            words = program.guide("ros2:/camera/image_raw", bad, "--set-camera-info")
            running = program.start(*words)
            wait_for(running, "Taken: ")
            running.terminate()
            said = running.stderr.read()
            assert running.wait(60) == 3 and "keeps its old calibration" in said, said[-2000:]
            good = place / "good.json"
            good.write_text(GOOD)
            driver.do("refuse not today")
            refused = program.run("export", good, "--set-camera-info", "ros2:/camera/image_raw", status=1)
            assert "not today" in refused.stderr, refused.stderr
            nobody = program.run("export", good, "--set-camera-info", "ros2:/other/image_raw", status=1)
            assert "/other/set_camera_info" in nobody.stderr, nobody.stderr
            print("kept back, refused, and nobody there: each is said", flush=True)

            # The publisher goes and comes back.
            session = place / "troubles"
            running = program.start(*program.guide("ros2:/camera/image_raw", session))
            wait_for(running, "Taken: ")
            driver.do("silent")
            gone = wait_for(running, "NET-LOST")[-1].strip()
            driver.do("speaking")
            began = time.monotonic()
            wait_for(running, "Taken: ")
            running.terminate()
            running.stderr.read()
            assert running.wait(60) in (0, 3)
            print(f"{gone!r}, and a view {time.monotonic() - began:.0f} s after it was back; "
                  f"{all_as_sent(session, sent)} pictures, all as sent", flush=True)
    print("cameras of ROS 2: all well")


# A calibration that OpenCV wrote.
GOOD = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 576., 0., 319.5, 0., 576., 239.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0., 0., 0., 0., 0. ]
"""

if __name__ == "__main__":
    sys.exit(main())
