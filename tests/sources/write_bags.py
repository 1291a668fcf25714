"""Writes bags as others do: rosbags and mcap, both from PyPI. `write_bags.py FOLDER` writes small ones, which are
fixtures/bags; bags.py uses the same functions for whole sessions."""

import sys
from pathlib import Path

import cv2
import numpy as np
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

TOPIC = "/camera/image_raw"
TYPES = get_typestore(Stores.ROS2_HUMBLE)
TIME = TYPES.types["builtin_interfaces/msg/Time"]
HEADER = TYPES.types["std_msgs/msg/Header"]
IMAGE = TYPES.types["sensor_msgs/msg/Image"]
COMPRESSED = TYPES.types["sensor_msgs/msg/CompressedImage"]
TEXT = TYPES.types["std_msgs/msg/String"]

IMAGE_DEFINITION = """std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""

TEXT_DEFINITION = "string data"
START = 1_700_000_000_000_000_000


def small_picture(number, width=16, height=12):
    """The picture of that number in fixtures/bags."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return ((7 * x + 13 * y + 31 * number) % 256).astype(np.uint8)


def stamp(number):
    """When picture `number` was taken; the recording was 7 ms later."""
    return START + number * 33_333_333


def image_message(grey, number):
    header = HEADER(TIME(stamp(number) // 10**9, stamp(number) % 10**9), "optical")
    height, width = grey.shape
    return IMAGE(header, height, width, "mono8", 0, width, grey.reshape(-1))


def compressed_message(grey, number):
    header = HEADER(TIME(stamp(number) // 10**9, stamp(number) % 10**9), "optical")
    return COMPRESSED(header, "mono8; png compressed", cv2.imencode(".png", grey)[1].reshape(-1))


def rosbag(folder, pictures, plugin, mode=None, kind="image", topics=(TOPIC,), version=8):
    """A bag folder as rosbags writes it."""
    with_type = {"image": (IMAGE, image_message), "png": (COMPRESSED, compressed_message)}[kind]
    writer = Writer(folder, version=version, storage_plugin=plugin)
    if mode:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        links = [writer.add_connection(t, with_type[0].__msgtype__, typestore=TYPES) for t in topics]
        chatter = writer.add_connection("/chatter", TEXT.__msgtype__, typestore=TYPES)
        for number, grey in enumerate(pictures):
            at = stamp(number) + 7_000_000
            for link in links:
                message = with_type[1](grey, number)
                writer.write(link, at, TYPES.serialize_cdr(message, with_type[0].__msgtype__))
            writer.write(chatter, at + 1, TYPES.serialize_cdr(TEXT("hello"), TEXT.__msgtype__))
    return next(path for path in sorted(Path(folder).iterdir()) if path.name != "metadata.yaml")


def mcap_file(path, pictures, compression, chunk_bytes=1 << 20):
    """An MCAP file as mcap and mcap-ros2-support write it."""
    with open(path, "wb") as file:
        writer = McapWriter(file, chunk_size=chunk_bytes, compression=compression)
        images = writer.register_msgdef("sensor_msgs/msg/Image", IMAGE_DEFINITION)
        texts = writer.register_msgdef("std_msgs/msg/String", TEXT_DEFINITION)
        for number, grey in enumerate(pictures):
            height, width = grey.shape
            when = {"sec": stamp(number) // 10**9, "nanosec": stamp(number) % 10**9}
            message = {
                "header": {"stamp": when, "frame_id": "optical"},
                "height": height,
                "width": width,
                "encoding": "mono8",
                "is_bigendian": 0,
                "step": width,
                "data": grey.tobytes(),
            }
            at = stamp(number) + 7_000_000
            writer.write_message(TOPIC, images, message, log_time=at, publish_time=at, sequence=number)
            writer.write_message("/chatter", texts, {"data": "hello"}, log_time=at + 1, publish_time=at + 1)
        writer.finish()
    return Path(path)


def every_kind(folder, pictures, chunk_bytes):
    """One bag of each kind that is read, by name."""
    folder = Path(folder)
    mcap, db3 = StoragePlugin.MCAP, StoragePlugin.SQLITE3
    bags = {
        "plain.mcap": mcap_file(folder / "plain.mcap", pictures, CompressionType.NONE, chunk_bytes),
        "lz4.mcap": mcap_file(folder / "lz4.mcap", pictures, CompressionType.LZ4, chunk_bytes),
        "zstd.mcap": mcap_file(folder / "zstd.mcap", pictures, CompressionType.ZSTD, chunk_bytes),
        "rosbags.mcap": rosbag(folder / "a", pictures, mcap),
        "packed.mcap": rosbag(folder / "b", pictures, mcap, CompressionMode.STORAGE),
        "rosbags.db3": rosbag(folder / "c", pictures, db3),
        "messages.db3": rosbag(folder / "d", pictures, db3, CompressionMode.MESSAGE),
        "file.db3.zstd": rosbag(folder / "e", pictures, db3, CompressionMode.FILE),
        "png.mcap": rosbag(folder / "f", pictures, mcap, kind="png"),
        "jazzy.db3": rosbag(folder / "g", pictures, db3, version=9),
        "two.db3": rosbag(folder / "h", pictures, db3, topics=("/left/image_raw", "/right/image_raw")),
    }
    return bags


if __name__ == "__main__":
    import shutil
    import tempfile

    out = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as place:
        for name, path in every_kind(place, [small_picture(n) for n in range(8)], 700).items():
            shutil.copy(path, out / name)
