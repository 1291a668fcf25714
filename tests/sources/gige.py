"""Whole sessions from machine-vision cameras that aren't ours, over this computer's own network: Aravis' fake camera with pictures
of a board, which loses packets and sends none again, and the fake camera of viva-genicam (PyPI), whose own client says what its
pictures are.

Run by `make test-sources`: gige.py --boresight PROGRAM. PROGRAM has the feature `gige`.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import viva_genicam
from scene import Program, all_as_sent, both, poses, save, stored, verdict, wait_for
from viva_genicam.testing import FakeGigeCamera

SIDE = 512  # Aravis' usual picture


class Aravis:
    def __init__(self, files, loss=0.0, each=3.0, serial="BOARD"):
        script = Path(__file__).with_name("aravis_camera.py")
        words = [sys.executable, script, "127.0.0.1", serial, loss, each, *files]
        self.process = subprocess.Popen([*map(str, words)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        said = self.process.stdout.readline()
        assert said.strip() == "ready", said

    def say(self, words):
        self.process.stdin.write(words + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline().strip() == words.split()[0]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def sessions(program, place):
    pictures = poses(SIDE, SIDE)
    files, sent = save(pictures, place), both(pictures)
    mode = ["--set", f"camera.mode={SIDE}x{SIDE}"]
    for loss in (0.0, 0.0005, 0.01):
        session = place / f"loss-{loss}"
        with Aravis(files, loss):
            began = time.monotonic()
            ended = program.run(*program.guide("gige:BOARD", session, *mode), status=None, timeout=600)
        assert (session / "calibration.json").exists(), ended.stderr[-2000:]
        kept = all_as_sent(session, sent)
        print(f"Aravis, {100 * loss:g} % of packets lost: {kept} pictures, all as sent; {verdict(session)}; "
              f"{time.monotonic() - began:.0f} s", flush=True)

    # Behind our back, and unplugged.
    session = place / "troubles"
    with Aravis(files) as camera:
        running = program.start(*program.guide("gige:BOARD", session, *mode, "--set", "guidance.plan=full"))
        wait_for(running, "Taken: ")
        camera.say("exposure 33333")
        told = wait_for(running, "xposure changed")[-1].strip()
        wait_for(running, "Taken: ")
    gone = wait_for(running, "DEV-UNPLUG")[-1].strip()
    with Aravis(files):
        wait_for(running, "Taken: ")
        running.terminate()
        rest = running.stderr.read()
        assert running.wait(60) in (0, 3), rest[-2000:]
    print(f"told: {told!r}, {gone!r}; {all_as_sent(session, sent)} pictures, all as sent", flush=True)


def third_camera(program, place):
    """Its pattern isn't a board: the pictures are what matters."""
    for words, options in (("whole", {}), ("a packet lost, sent again", {"drop_packets": [(3, 2)]}),
                           ("packets lost, none sent again", {"drop_packets": [(n, 2) for n in range(2, 90, 3)], "packet_resend": False})):
        with FakeGigeCamera(width=640, height=480, fps=20, **options) as fake:
            session = place / f"viva-{len(list(place.iterdir()))}"
            running = program.start(*program.guide(f"gige:{fake.ip}", session))
            until = time.monotonic() + 60
            while time.monotonic() < until and len(list((session / "frames").glob("*"))) < 9:
                time.sleep(0.1)
            running.terminate()
            rest = running.stderr.read()
            assert running.wait(60) in (0, 1, 3), rest[-2000:]
            kept = stored(session)
            seen = {picture.tobytes() for picture in kept.values()}
            size = next(iter(kept.values())).shape
            camera = viva_genicam.connect_gige(fake.device_info())
            own = set()
            with camera.stream() as frames:
                for frame in frames:
                    own.add(frame.to_numpy().tobytes())
                    # A pattern that moves comes round again.
                    if seen <= own or len(own) > 600:
                        break
            assert kept and seen <= own, f"{words}: {len(seen - own)} of {len(seen)} pictures aren't the camera's, {size}"
            print(f"viva-genicam, {words}: {len(kept)} pictures of {size[1]}x{size[0]}, all as its own client has them", flush=True)


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--boresight", required=True)
    program = Program(arguments.parse_args().boresight)
    with tempfile.TemporaryDirectory(dir=os.environ.get("BORESIGHT_TEST_DIR")) as folder:
        sessions(program, Path(folder))
        third_camera(program, Path(folder))
    print("machine-vision cameras: all well")


if __name__ == "__main__":
    sys.exit(main())
