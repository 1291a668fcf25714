"""From capture to decision, by source, in one table: pictures of the same board, 1280x720, 30 a second, over this computer's own
pipes and network, each with the time when it was sent in it. On a machine that does nothing else.

Run by `make test-sources`. `--bench PROGRAM` is tests/bench/sources.rs, if it's built already.
"""

import argparse
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scene import poses, save

WIDTH, HEIGHT, RATE = 1280, 720, 30
EACH = 1.0  # seconds that a picture is shown
DOMAIN = 78
ROOT = Path(__file__).resolve().parents[2]
BENCH = "cargo bench --quiet --no-default-features --features live,bags,gige,ros2 --bench sources --".split()
ADDRESS = "http://127.0.0.1:8931/"


def stamped(picture):
    """The picture with the time in it, as tests/bench/sources.rs reads it."""
    now = time.monotonic_ns() // 1000 % (1 << 40)
    check = 0xA5
    for byte in now.to_bytes(8, "little"):
        check ^= byte
    bits = now | check << 40
    row = np.repeat(np.array([255 * (bits >> bit & 1) for bit in range(48)], np.uint8), 8)
    sent = np.frombuffer(picture, np.uint8).reshape(HEIGHT, WIDTH).copy()
    sent[:8, : len(row)] = row
    return sent.tobytes()


def paced(files):
    """Pictures at their rate, for ever."""
    pictures = [Path(file).read_bytes() for file in files]
    began, number = time.monotonic(), 0
    while True:
        time.sleep(max(0, began + number / RATE - time.monotonic()))
        yield stamped(pictures[int(number / RATE / EACH) % len(pictures)])
        number += 1


def send(how, files):
    if how == "pipe":
        out = sys.stdout.buffer
        out.write(f"YUV4MPEG2 W{WIDTH} H{HEIGHT} F{RATE}:1 Ip A1:1 Cmono\n".encode())
        for picture in paced(files):
            out.write(b"FRAME\n" + picture)
            out.flush()
    elif how == "http":
        raw = f"-f rawvideo -pix_fmt gray -s {WIDTH}x{HEIGHT} -r {RATE} -i -"
        words = f"ffmpeg -v error {raw} -c:v mjpeg -threads 1 -q:v 3 -pix_fmt yuvj420p -flush_packets 1 -f mpjpeg -listen 1 {ADDRESS}"
        ffmpeg = subprocess.Popen(words.split(), stdin=subprocess.PIPE)
        for picture in paced(files):
            ffmpeg.stdin.write(picture)
    elif how == "gige":
        import aravis_camera

        aravis_camera.main(["127.0.0.1", "TIMED", 0, EACH, f"{WIDTH}x{HEIGHT}", *files], stamped)
    elif how == "ros2":
        sys.path.append(str(ROOT / "wings/sources/tests"))
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic
        from ros2_camera import Header, Image, Time

        participant = DomainParticipant(DOMAIN)
        qos = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(2))
        writer = DataWriter(participant, Topic(participant, "rt/timed", Image), qos=qos)
        message = Image(Header(Time(0, 0), "optical"), HEIGHT, WIDTH, "mono8", 0, WIDTH, bytes(WIDTH * HEIGHT))
        # Once: in Python, that takes longer than all the rest.
        packed = message.serialize(use_version_2=writer._use_version_2)[: -WIDTH * HEIGHT]
        for picture in paced(files):
            now = struct.pack("<II", *divmod(time.time_ns(), 10**9))
            message.serialize = lambda sent=packed[:4] + now + packed[12:] + picture, **_: sent
            writer.write(message)


def table(bench, place):
    from mcap.writer import CompressionType
    from write_bags import mcap_file

    pictures = poses(WIDTH, HEIGHT)
    raw = place / "raw"
    raw.mkdir()
    files = [str(file) for file in save(pictures, raw)]
    # No picture of a video comes twice.
    shown = [picture ^ (number & 1) for picture in pictures for number in range(RATE)]
    bag = mcap_file(place / "timed.mcap", shown, CompressionType.LZ4)
    video = place / "timed.mkv"
    coded = f"ffmpeg -v error -f rawvideo -pix_fmt gray -s {WIDTH}x{HEIGHT} -r {RATE} -i - -c:v ffv1 {video}"
    subprocess.run(coded.split(), input=b"".join(picture.tobytes() for picture in shown), check=True)

    if bench is BENCH:
        subprocess.run([*bench[:-1], "--no-run"], cwd=ROOT, check=True)
    os.environ["ROS_DOMAIN_ID"] = str(DOMAIN)
    sender = [sys.executable, __file__, "--send"]
    rows = [("kernel's camera (V4L2), simulated", None, f"v4l2:{raw}"),
            ("another program (`pipe:`), YUV4MPEG2", None, f"pipe:{' '.join([*sender, 'pipe', *files])}"),
            ("GigE Vision, Aravis, Mono8", "gige", "gige:TIMED"),
            ("ROS 2, Cyclone DDS, mono8", "ros2", "ros2:/timed"),
            ("stream, `http://`, MJPEG", "http", ADDRESS),
            ("bag, MCAP, LZ4", None, bag),
            ("video file, FFV1", None, video),
            ("kernel's camera again", None, f"v4l2:{raw}")]
    print("| source | decisions | on its way, ms: median | p95 | to the decision: median | p95 | together: median | p95 |")
    print("|---|---|---|---|---|---|---|---|")
    for name, how, source in rows:
        sending = subprocess.Popen([*sender, how, *files], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) if how else None
        try:
            # A sender needs a moment to begin.
            for _ in range(5 if how else 1):
                time.sleep(3 if how else 0)
                measured = subprocess.run([*bench, str(source)], capture_output=True, text=True, timeout=300, cwd=ROOT)
                if measured.returncode == 0:
                    break
            assert measured.returncode == 0, (name, measured.stderr[-2000:])
            print(f"| {name} | {measured.stdout.strip().replace(' decisions', '')} |", flush=True)
        finally:
            if sending:
                sending.kill()
                sending.wait()


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--bench")
    arguments.add_argument("--send", nargs="+")
    options = arguments.parse_args()
    if options.send:
        return send(options.send[0], options.send[1:])
    with tempfile.TemporaryDirectory(dir=os.environ.get("BORESIGHT_TEST_DIR")) as folder:
        bench = [str(Path(options.bench).resolve())] if options.bench else BENCH
        table(bench, Path(folder))


if __name__ == "__main__":
    main()
