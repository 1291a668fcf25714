"""Whole sessions from machine-vision cameras that aren't ours, over this computer's own network: Aravis' fake camera with pictures
of a board, which loses packets and sends none again, and the fake camera of viva-genicam (PyPI), whose own client says what its
pictures are.

Run by `make test-sources`: gige.py --boresight PROGRAM. PROGRAM has the feature `gige`.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import viva_genicam
from scene import Program, all_as_sent, both, poses, save, stored, verdict, wait_for
from viva_genicam.testing import FakeGigeCamera

SIDE = 512  # Aravis' usual picture, of 209 packets


class Aravis:
    def __init__(self, files, loss=0.0, each=3.0, side=SIDE):
        script = Path(__file__).with_name("aravis_camera.py")
        words = [sys.executable, script, "127.0.0.1", "BOARD", loss, each, f"{side}x{side}", *files]
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
        whole_session(program, place / f"loss-{loss}", files, sent, SIDE, loss)
    # Of a smaller picture, some get through; each is shown for longer.
    small = place / "small"
    small.mkdir()
    pictures = poses(SIDE // 2, SIDE // 2)
    whole_session(program, place / "loss-0.05", save(pictures, small), both(pictures), SIDE // 2, 0.05, each=10.0)

    # Behind our back, and unplugged.
    session = place / "troubles"
    with Aravis(files) as camera:
        running = program.start(*program.guide("gige:BOARD", session, *mode, "--set", "guidance.plan=full"))
        wait_for(running, "Taken: ")
        camera.say("exposure 33333")
        told = [wait_for(running, words)[-1].strip() for words in ("Exposure changed", "Exposure is set back")]
        wait_for(running, "Taken: ")
    gone = wait_for(running, "DEV-UNPLUG")[-1].strip()
    with Aravis(files):
        wait_for(running, "Taken: ")
        running.terminate()
        rest = running.stderr.read()
        assert running.wait(60) in (0, 3), rest[-2000:]
    print(f"told: {told}, {gone!r}; {all_as_sent(session, sent)} pictures, all as sent", flush=True)


def whole_session(program, session, files, sent, side, loss, each=3.0):
    with Aravis(files, loss, each, side):
        began = time.monotonic()
        words = program.guide("gige:BOARD", session, "--set", f"camera.mode={side}x{side}")
        ended = program.run(*words, status=None, timeout=600)
    assert (session / "calibration.json").exists(), ended.stderr[-2000:]
    kept = all_as_sent(session, sent)
    print(f"Aravis, {100 * loss:g} % of packets lost, {side}x{side}: {kept} pictures, all as sent; {verdict(session)}; "
          f"{time.monotonic() - began:.0f} s", flush=True)


def two_at_once(program, place):
    """Cameras of two makers on one network, a session each: neither gets a picture of the other."""
    pictures = poses(SIDE, SIDE)
    files, sent = save(pictures, place), both(pictures)
    first_session, second_session = place / "first", place / "second"
    with Aravis(files), FakeGigeCamera(width=640, height=480, fps=20, bind_ip="127.0.0.2") as fake:
        mode = ["--set", f"camera.mode={SIDE}x{SIDE}"]
        first = program.start(*program.guide("gige:BOARD", first_session, *mode))
        second = program.start(*program.guide(f"gige:{fake.ip}", second_session))
        wait_for(first, "Finished")
        first.stderr.read()
        second.terminate()
        second.stderr.read()
        assert first.wait(60) in (0, 3) and second.wait(60) in (0, 1, 3)
    sizes = {picture.shape for picture in stored(second_session).values()}
    assert sizes == {(480, 640)}, sizes
    print(f"two cameras at once: {all_as_sent(first_session, sent)} pictures, all as sent; {verdict(first_session)}; "
          f"of the other {len(stored(second_session))}, all of its size", flush=True)


def third_camera(program, place):
    """Its pattern isn't a board: the pictures are what matters."""
    chance = random.Random(1)
    some = [(n, packet) for n in range(1, 400) for packet in range(1, 1200) if chance.random() < 0.05]
    for words, options in (("whole", {}), ("a packet lost, sent again", {"drop_packets": [(3, 2)]}),
                           ("5 % of packets lost, sent again", {"drop_packets": some}),
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
        for part in (sessions, two_at_once, third_camera):
            place = Path(folder) / part.__name__
            place.mkdir()
            part(program, place)
    print("machine-vision cameras: all well")


if __name__ == "__main__":
    sys.exit(main())
