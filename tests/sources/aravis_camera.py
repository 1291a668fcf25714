"""Aravis' fake camera with pictures of ours, through its own library (Debian: aravis-tools brings it).

    aravis_camera.py ADDRESS SERIAL LOSS EACH WIDTHxHEIGHT FILE.raw …

Shows the files of that size, one byte a pixel, one after the other for EACH seconds; the lowest bit alternates. Loses that share of
its packets, and sends none again. Commands on standard input: `exposure MICROSECONDS`, behind the client's back.
"""

import ctypes
import sys
import time
from ctypes import CFUNCTYPE, c_char_p, c_double, c_int, c_uint32, c_void_p

WIDTH_REGISTER, HEIGHT_REGISTER, EXPOSURE_REGISTER = 0x100, 0x104, 0x120  # arvfakecamera.h
LIBRARY = ctypes.CDLL("libaravis-0.8.so.0")
FILL = CFUNCTYPE(None, c_void_p, c_void_p, c_uint32, c_uint32, c_uint32)


def call(name, result, *arguments):
    function = getattr(LIBRARY, name)
    function.restype = result
    function.argtypes = [kind for kind, _ in arguments]
    return function(*(value for _, value in arguments))


def main(words, shown=lambda picture: picture):
    """`shown` makes of a picture the one that is sent."""
    address, serial, loss, each, size, *files = words
    pictures = [open(file, "rb").read() for file in files]
    pictures += [bytes(value ^ 1 for value in picture) for picture in pictures]
    count, began, number = len(files), time.monotonic(), 0

    @FILL
    def fill(buffer, *_):
        nonlocal number
        data = call("arv_buffer_get_data", c_void_p, (c_void_p, buffer), (c_void_p, None))
        number += 1
        picture = shown(pictures[int((time.monotonic() - began) / float(each)) % count + count * (number % 2)])
        ctypes.memmove(data, picture, len(picture))

    camera = call("arv_gv_fake_camera_new", c_void_p, (c_char_p, address.encode()), (c_char_p, serial.encode()))
    objects = ctypes.CDLL("libgobject-2.0.so.0")
    objects.g_object_set(c_void_p(camera), b"gvsp-lost-ratio", c_double(float(loss)), None)
    fake = call("arv_gv_fake_camera_get_fake_camera", c_void_p, (c_void_p, camera))

    def write(register, value):
        call("arv_fake_camera_write_register", c_int, (c_void_p, fake), (c_uint32, register), (c_uint32, int(value)))

    for register, side in zip((WIDTH_REGISTER, HEIGHT_REGISTER), size.split("x")):
        write(register, side)
    call("arv_fake_camera_set_fill_pattern", None, (c_void_p, fake), (FILL, fill), (c_void_p, None))
    running = call("arv_gv_fake_camera_is_running", c_int, (c_void_p, camera))
    print("ready" if running else "not running", flush=True)
    for line in sys.stdin:
        word, _, rest = line.strip().partition(" ")
        if word == "exposure":
            write(EXPOSURE_REGISTER, rest)
        print(word, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
