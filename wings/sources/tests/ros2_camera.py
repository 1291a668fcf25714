"""A ROS 2 camera's driver in software, over Eclipse Cyclone DDS (PyPI: cyclonedds), the middleware that ROS 2 itself uses.

    ros2_camera.py --topic /camera/image_raw [--size WxH] [--rate 20] [--encoding mono8] [--best-effort] [FILE.raw ...]

Publishes sensor_msgs/msg/Image, or CompressedImage if the topic ends with /compressed: a pattern in which pixel (x, y) of
picture n is (x + y + 16 n) mod 256, or files of one byte a pixel, shown one after the other for --each seconds, whose lowest
bit alternates, as a sensor's noise would have it. The service set_camera_info beside the topic is served as
rmw_cyclonedds does.

Commands on standard input: `silent`, `speaking`, `size WxH`, `refuse WORDS` and `deaf` for the service, `quit`. It says on standard output what
happens, a line each: `ready`, `info WIDTH HEIGHT MODEL D K` for a calibration, `sent COUNT` at the end.
"""

import argparse
import select
import struct
import sys
import time
import zlib
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class Request(IdlStruct, typename="sensor_msgs::srv::dds_::SetCameraInfo_Request_"):
    caller: uint64
    number: int64
    camera_info: CameraInfo


@dataclass
class Response(IdlStruct, typename="sensor_msgs::srv::dds_::SetCameraInfo_Response_"):
    caller: uint64
    number: int64
    success: bool
    status_message: str


def png(width, height, rows):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    body = b"".join(b"\0" + rows[y * width:(y + 1) * width] for y in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(body, 1))
            + chunk(b"IEND", b""))


class Pictures:
    def __init__(self, options):
        self.size = tuple(int(side) for side in options.size.split("x"))
        self.files = [open(name, "rb").read() for name in options.files]
        self.each = options.each
        self.ramp = bytes(range(256)) * 64

    def grey(self, n, seconds):
        width, height = self.size
        if not self.files:
            return b"".join(self.ramp[(y + 16 * n) % 256:][:width] for y in range(height))
        picture = self.files[int(seconds / self.each) % len(self.files)]
        return bytes(value ^ 1 for value in picture) if n % 2 else picture


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--topic", required=True)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--rate", type=float, default=20)
    parser.add_argument("--each", type=float, default=2)
    parser.add_argument("--encoding", default="mono8")
    parser.add_argument("--frame", default="optical")
    parser.add_argument("--best-effort", action="store_true")
    parser.add_argument("files", nargs="*")
    options = parser.parse_args()
    pictures = Pictures(options)
    participant = DomainParticipant(options.domain)
    reliable = Policy.Reliability.Reliable(duration(seconds=1))
    kind = Policy.Reliability.BestEffort if options.best_effort else reliable
    compressed = options.topic.endswith("/compressed")
    topic = Topic(participant, "rt" + options.topic, CompressedImage if compressed else Image)
    writer = DataWriter(participant, topic, qos=Qos(kind, Policy.History.KeepLast(2)))
    space = options.topic.removesuffix("/compressed").rsplit("/", 1)[0]
    service = Qos(reliable, Policy.History.KeepLast(10))
    requests = DataReader(participant, Topic(participant, f"rq{space}/set_camera_infoRequest", Request), qos=service)
    responses = DataWriter(participant, Topic(participant, f"rr{space}/set_camera_infoReply", Response), qos=service)
    say("ready")
    n, refusal, silent, deaf, began = 0, None, False, False, time.monotonic()
    next_at = began
    while True:
        left = max(next_at - time.monotonic(), 0)
        if select.select([sys.stdin], [], [], left)[0]:
            word, _, rest = sys.stdin.readline().strip().partition(" ")
            if word in ("quit", ""):
                break
            silent = {"silent": True, "speaking": False}.get(word, silent)
            if word == "size":
                pictures.size = tuple(int(side) for side in rest.split("x"))
            if word == "refuse":
                refusal = rest
            deaf |= word == "deaf"
            say(word)
        # A client that has gone leaves a sample without data.
        for request in [] if deaf else [it for it in requests.take(10) if isinstance(it, Request)]:
            info = request.camera_info
            say(f"info {info.width} {info.height} {info.distortion_model} {list(info.d)} {list(info.k)}")
            words = refusal or "stored"
            responses.write(Response(request.caller, request.number, refusal is None, words))
        if time.monotonic() < next_at:
            continue
        next_at = max(next_at + 1 / options.rate, time.monotonic())
        if silent:
            continue
        taken = time.time_ns()
        header = Header(Time(taken // 10**9, taken % 10**9), options.frame)
        (width, height), grey = pictures.size, pictures.grey(n, time.monotonic() - began)
        if compressed:
            writer.write(CompressedImage(header, "mono8; png compressed ", png(width, height, grey)))
        elif options.encoding == "mono16":
            deep = bytes(byte for value in grey for byte in (value, value))
            writer.write(Image(header, height, width, "mono16", 0, 2 * width, deep))
        else:
            writer.write(Image(header, height, width, options.encoding, 0, width, grey))
        n += 1
    say(f"sent {n}")


def say(line):
    print(line, flush=True)


if __name__ == "__main__":
    main()
