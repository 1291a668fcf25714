"""Writes the kernel that is packed in a Linux boot image: unpack_kernel.py VMLINUZ VMLINUX."""

import lzma
import subprocess
import sys
import zlib


def unzstd(data):
    return subprocess.run(["zstd", "-qdc"], input=data, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout


PACKERS = (
    (b"\xfd7zXZ\0", lambda data: lzma.LZMADecompressor().decompress(data)),
    (b"\x28\xb5\x2f\xfd", unzstd),
    (b"\x1f\x8b\x08", lambda data: zlib.decompressobj(31).decompress(data)),
)

image = open(sys.argv[1], "rb").read()
for magic, unpack in PACKERS:
    at = image.find(magic)
    while at >= 0:
        try:
            kernel = unpack(image[at:])
        except (lzma.LZMAError, zlib.error):
            kernel = b""
        if kernel[:4] == b"\x7fELF":
            with open(sys.argv[2], "wb") as out:
                out.write(kernel)
            sys.exit()
        at = image.find(magic, at + 1)
sys.exit(1)
