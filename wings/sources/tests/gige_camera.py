"""A GigE Vision camera in software, written from the standard and independent of the program's client.

    gige_camera.py --address 127.0.0.1 --serial A1 [--size WxH] [--sensor WxH] [--loss 0.01] [--no-resend] [FILE.raw ...]

Without files it sends a pattern: pixel (x, y) of picture n is (x + y + 16 n) mod 256, in any pixel format with the same
brightness over its whole range; a Bayer mosaic is (16 n) mod 256 all over. Files are pictures of one byte a pixel, shown
one after the other for --each seconds; the lowest bit alternates, as noise would have it.

Commands on standard input: `loss SHARE`, `set FEATURE VALUE` (behind the client's back), `silent`, `speaking`,
`reset` (as if the plug had been pulled: registers, stream and owner are forgotten), `look NAME` (the pictures: frozen, black,
blinking, cut to their first half, slow, none, or usual), `stats`. It says on standard output
what happens, a line each.
"""

import argparse
import random
import select
import socket
import struct
import sys
import time

XML_AT = 0x10000
REGISTERS = {  # name: (address, type, value)
    "Width": (0x8000, "I", 0), "Height": (0x8004, "I", 0), "OffsetX": (0x8008, "I", 0), "OffsetY": (0x800C, "I", 0),
    "WidthMax": (0x8010, "I", 0), "HeightMax": (0x8014, "I", 0), "PixelFormat": (0x8018, "I", 0x01080001),
    "PayloadSize": (0x801C, "I", 0), "Acquisition": (0x8020, "I", 0), "AcquisitionMode": (0x8024, "I", 1),
    "TLParamsLocked": (0x8028, "I", 0), "TriggerMode": (0x802C, "I", 1), "ExposureAuto": (0x8030, "I", 2),
    "GainAuto": (0x8034, "I", 2), "BlackLevelAuto": (0x8038, "I", 2), "BalanceWhiteAuto": (0x803C, "I", 2),
    "BalanceRatioSelector": (0x8040, "I", 1), "AcquisitionFrameRateEnable": (0x8044, "I", 0),
    "ExposureTime": (0x8100, "f", 8000.0), "Gain": (0x8104, "f", 3.0), "BlackLevel": (0x8108, "f", 1.5),
    "AcquisitionFrameRate": (0x810C, "f", 20.0), "BalanceRatioRed": (0x8110, "f", 1.25),
    "BalanceRatioBlue": (0x8114, "f", 1.75),
}
FORMATS = {
    "Mono8": 0x01080001, "Mono10": 0x01100003, "Mono10p": 0x010A0046, "Mono10Packed": 0x010C0004,
    "Mono12": 0x01100005, "Mono12p": 0x010C0047, "Mono12Packed": 0x010C0006, "Mono16": 0x01100007,
    "BayerRG8": 0x01080009, "BayerRG10": 0x0110000D, "BayerRG12Packed": 0x010C002B, "BayerRG16": 0x0110002F,
}
EXPOSURE_STEP = 0.7  # microseconds: no camera takes every value


def xml(formats):
    def integer(name, access="RW", more=""):
        address = REGISTERS[name][0]
        return (f'<Integer Name="{name}"><pValue>{name}Reg</pValue>{more}</Integer><IntReg Name="{name}Reg"><Address>'
                f'{address:#x}</Address><Length>4</Length><AccessMode>{access}</AccessMode><pPort>Device</pPort>'
                '<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>')

    def number(name, least, most, at=None):
        address = at or f"<Address>{REGISTERS[name][0]:#x}</Address>"
        return (f'<Float Name="{name}"><pValue>{name}Reg</pValue><Min>{least}</Min><Max>{most}</Max></Float>'
                f'<FloatReg Name="{name}Reg">{address}<Length>4</Length><AccessMode>RW</AccessMode>'
                '<pPort>Device</pPort><Endianess>BigEndian</Endianess></FloatReg>')

    def choice(name, entries):
        listed = "".join(f'<EnumEntry Name="{entry}"><Value>{value}</Value></EnumEntry>' for entry, value in entries)
        return (f'<Enumeration Name="{name}">{listed}<pValue>{name}Reg</pValue></Enumeration><IntReg Name="{name}Reg">'
                f'<Address>{REGISTERS[name][0]:#x}</Address><Length>4</Length><AccessMode>RW</AccessMode>'
                '<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>')

    def command(name, value):
        return f'<Command Name="{name}"><pValue>AcquisitionReg</pValue><CommandValue>{value}</CommandValue></Command>'

    automatic = [("Off", 0), ("Once", 1), ("Continuous", 2)]
    # The address of a ratio follows from the selector.
    ratio = ('<IntSwissKnife Name="RatioAt"><pVariable Name="SEL">BalanceRatioSelectorReg</pVariable><Formula>'
             f'{REGISTERS["BalanceRatioRed"][0]} + 4 * (SEL - 1)</Formula></IntSwissKnife>')
    return ('<?xml version="1.0" encoding="utf-8"?><RegisterDescription ModelName="Fake" VendorName="Tests" '
            'StandardNameSpace="GEV" SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0" '
            'MajorVersion="1" MinorVersion="0" SubMinorVersion="0" ToolTip="" ProductGuid="1" VersionGuid="1" '
            'xmlns="http://www.genicam.org/GenApi/Version_1_1">'
            '<Category Name="Root"><pFeature>Width</pFeature><pFeature>ExposureTime</pFeature></Category>'
            + integer("Width", more="<Min>16</Min><pMax>WidthMax</pMax><Inc>16</Inc>")
            + integer("Height", more="<Min>16</Min><pMax>HeightMax</pMax><Inc>2</Inc>")
            + integer("OffsetX") + integer("OffsetY") + integer("WidthMax", "RO") + integer("HeightMax", "RO")
            + integer("PayloadSize", "RO") + integer("Acquisition") + integer("TLParamsLocked")
            + choice("PixelFormat", [(name, FORMATS[name]) for name in formats])
            + choice("AcquisitionMode", [("SingleFrame", 0), ("Continuous", 1)])
            + choice("TriggerMode", [("Off", 0), ("On", 1)])
            + command("AcquisitionStart", 1) + command("AcquisitionStop", 0)
            + choice("ExposureAuto", automatic) + choice("GainAuto", automatic)
            + choice("BlackLevelAuto", automatic) + choice("BalanceWhiteAuto", automatic)
            + choice("BalanceRatioSelector", [("Red", 1), ("Blue", 2)])
            + '<Boolean Name="AcquisitionFrameRateEnable"><pValue>RateReg</pValue><OnValue>1</OnValue><OffValue>0'
            + '</OffValue></Boolean><IntReg Name="RateReg"><Address>0x8044</Address><Length>4</Length><AccessMode>RW'
            + '</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>'
            + number("ExposureTime", 10, 200000) + number("Gain", 0, 24) + number("BlackLevel", 0, 32)
            + number("AcquisitionFrameRate", 1, 100) + ratio
            + number("BalanceRatio", 0.1, 8, "<pAddress>RatioAt</pAddress>")
            + '<Port Name="Device"/></RegisterDescription>').encode()


def packed(values, name):
    """The numbers as the pixel format of that name has them."""
    if name.endswith("8"):
        return bytes(values)
    depth = int("".join(c for c in name if c.isdigit()))
    deep = [(v << (depth - 8)) | (v >> (16 - depth)) for v in values]
    if name.endswith("p"):
        bits = 0
        out = bytearray()
        have = 0
        for v in deep:
            bits |= v << have
            have += depth
            while have >= 8:
                out.append(bits & 255)
                bits >>= 8
                have -= 8
        return bytes(out) + (bytes([bits]) if have else b"")
    if name.endswith("Packed"):
        out = bytearray()
        low = (1 << (depth - 8)) - 1
        for a, b in zip(deep[::2], deep[1::2]):
            out += bytes([a >> (depth - 8), (a & low) | (b & low) << 4, b >> (depth - 8)])
        return bytes(out)
    return struct.pack(f"<{len(deep)}H", *deep)


class Camera:
    def __init__(self, options):
        self.options = options
        self.random = random.Random(1)
        self.loss = options.loss
        self.silent = False
        self.look, self.frozen = "usual", 0
        self.width, self.height = (int(n) for n in options.size.split("x"))
        self.files = [open(name, "rb").read() for name in options.files]
        formats = list(FORMATS) if not self.files else ["Mono8"]
        self.xml = xml(formats)
        self.xml += b" " * (-len(self.xml) % 4)
        self.control = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.control.bind((options.address, 3956))
        # Questions to everybody reach all cameras of this computer.
        self.everybody = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.everybody.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.everybody.bind(("127.255.255.255", 3956))
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.out.bind((options.address, 0))
        self.made = {}
        self.block = 0
        self.stats = dict(pictures=0, packets=0, lost=0, resent=0, refused=0)
        self.began = time.monotonic()
        self.reset()

    def reset(self):
        """As after power-up."""
        self.memory = bytearray(XML_AT)
        self.memory[XML_AT:] = self.xml
        self.owner = None
        self.heard = 0.0
        self.sent = {}
        write = self.memory.__setitem__
        put = lambda at, text, size: write(slice(at, at + size), text.encode()[:size].ljust(size, b"\0"))
        self.set32(0x0000, 0x00010002)
        mac = bytes([2, 0, 0, 0]) + struct.pack(">H", sum(self.options.serial.encode()) * 251 & 0xFFFF)
        write(slice(0x000A, 0x0010), mac)
        self.set32(0x0024, struct.unpack(">I", socket.inet_aton(self.options.address))[0])
        self.set32(0x0034, 0xFF000000)
        put(0x0048, "Tests", 32)
        put(0x0068, "Fake", 32)
        put(0x00D8, self.options.serial, 16)
        put(0x00E8, self.options.name, 16)
        put(0x0200, f"Local:fake.xml;{XML_AT:x};{len(self.xml):x}", 512)
        self.set32(0x0904, 1)
        self.set32(0x0934, 0b11 | (0 if self.options.no_resend else 0b100))
        self.set32(0x0938, 3000)
        self.set32(0x0940, 1_000_000_000 // 8)
        self.set32(0x0D04, 1400)
        for name, (_, _, value) in REGISTERS.items():
            self.feature(name, value)
        sensor = (int(n) for n in (self.options.sensor or self.options.size).split("x"))
        for name, value, most in zip(("Width", "Height"), (self.width, self.height), sensor):
            self.feature(name, value)
            self.feature(name + "Max", most)
        self.payload()

    def set32(self, at, value):
        self.memory[at:at + 4] = struct.pack(">I", value)

    def get32(self, at):
        return struct.unpack(">I", self.memory[at:at + 4])[0]

    def feature(self, name, value=None):
        at, kind, _ = REGISTERS[name]
        if value is not None:
            self.memory[at:at + 4] = struct.pack(">" + kind, float(value) if kind == "f" else int(value))
        return struct.unpack(">" + kind, self.memory[at:at + 4])[0]

    def payload(self):
        bits = self.feature("PixelFormat") >> 16 & 0xFF
        self.feature("PayloadSize", (self.feature("Width") * self.feature("Height") * bits + 7) // 8)

    # Control

    def answer(self, datagram, client):
        if len(datagram) < 8 or datagram[0] != 0x42:
            return
        code, length, request = struct.unpack(">HHH", datagram[2:8])
        body = datagram[8:8 + length]
        reply = lambda status, answer, body=b"": self.control.sendto(
            struct.pack(">HHHH", status, answer, len(body), request) + body, client)
        if client == self.owner:
            self.heard = time.monotonic()
        if code == 0x0002:
            reply(0, 0x0003, bytes(self.memory[:0xF8]))
        elif code == 0x0080:
            addresses = struct.unpack(f">{len(body) // 4}I", body)
            reply(0, 0x0081, b"".join(bytes(self.memory[at:at + 4]) for at in addresses))
        elif code == 0x0084:
            at, _, count = struct.unpack(">IHH", body)
            reply(0, 0x0085, struct.pack(">I", at) + bytes(self.memory[at:at + count]).ljust(count, b"\0"))
        elif code in (0x0082, 0x0086):
            if code == 0x0082:
                writes = [(struct.unpack(">I", body[i:i + 4])[0], body[i + 4:i + 8]) for i in range(0, len(body), 8)]
            else:
                writes = [(struct.unpack(">I", body[:4])[0], body[4:])]
            for index, (at, data) in enumerate(writes):
                status = self.write(at, data, client)
                if status:
                    self.stats["refused"] += 1
                    return reply(status, code + 1, struct.pack(">HH", 0, index))
            reply(0, code + 1, struct.pack(">HH", 0, len(writes)))
        elif code == 0x0040:
            self.resend(body)
        else:
            reply(0x8001, code + 1)

    def write(self, at, data, client):
        if self.owner not in (None, client):
            return 0x8006
        if at == 0x0A00:
            if data[3] & 3:
                self.owner, self.heard = client, time.monotonic()
                print("taken", flush=True)
            else:
                self.release("released")
            self.memory[at:at + len(data)] = data
            return 0
        if self.owner is None:
            return 0x8006
        locked = self.feature("TLParamsLocked")
        if locked and REGISTERS["Width"][0] <= at <= REGISTERS["PixelFormat"][0]:
            return 0x8006
        exposure = REGISTERS["ExposureTime"][0]
        if at == exposure:
            if self.feature("ExposureAuto"):
                return 0x8006
            wanted = struct.unpack(">f", data)[0]
            data = struct.pack(">f", round(wanted / EXPOSURE_STEP) * EXPOSURE_STEP)
        self.memory[at:at + len(data)] = data
        self.payload()
        if at == 0x0D04 and data[0] & 0x80:
            size = self.get32(at) & 0xFFFF
            self.set32(at, size)
            if size <= self.options.packet:
                self.out.sendto(bytes(size - 28), self.target())
        if at == REGISTERS["Acquisition"][0]:
            print("streaming" if self.feature("Acquisition") else "stopped", flush=True)
            self.next = self.started = time.monotonic()
        return 0

    def release(self, why):
        if self.owner:
            print(why, flush=True)
        self.owner = None
        self.feature("Acquisition", 0)
        self.feature("TLParamsLocked", 0)
        self.set32(0x0A00, 0)

    def target(self):
        return socket.inet_ntoa(self.memory[0x0D18:0x0D1C]), self.get32(0x0D00) & 0xFFFF

    # Pictures

    def picture(self, number):
        if self.look in ("black", "blinking"):
            light = 4 if self.look == "black" else 40 if number % 2 else 160
            # Noise, so that no two are the same.
            count = self.feature("Width") * self.feature("Height")
            return bytes(light + (at + number) % 5 for at in range(5)) * (count // 5 + 1)
        if self.look == "frozen":
            number = self.frozen
        if self.files:
            turn = int((time.monotonic() - self.began) / self.options.each) % len(self.files)
            key = (turn, number % 2)
            if key not in self.made:
                self.made[key] = bytes(v ^ number % 2 for v in self.files[turn])
            return self.made[key]
        code = self.feature("PixelFormat")
        width, height = self.feature("Width"), self.feature("Height")
        key = (code, number % 16, width, height)
        if key not in self.made:
            name = next(name for name, known in FORMATS.items() if known == code)
            shift = number % 16 * 16
            if name.startswith("Bayer"):
                values = [shift] * (width * height)
            else:
                row = [(x + shift) & 255 for x in range(width + 256)]
                values = [v for y in range(height) for v in row[y % 256:y % 256 + width]]
            self.made[key] = packed(values, name)
        return self.made[key]

    def take(self, at):
        """Takes a picture at that time and sends it."""
        self.block = self.block % 65535 + 1
        number = self.block
        if self.feature("ExposureAuto"):
            self.feature("ExposureTime", 8000 + 100 * (number % 3))
        data = self.picture(number)[:self.feature("PayloadSize")]
        if self.look == "cut":
            data = data[:len(data) // 2]
        stamp = int((at - self.began) * 1e9 / 8)
        width, height = self.feature("Width"), self.feature("Height")
        leader = struct.pack(">HHQIIIIIHH", 0, 1, stamp, self.feature("PixelFormat"), width, height, 0, 0, 0, 0)
        each = (self.get32(0x0D04) & 0xFFFF) - 36
        parts = [(1, leader)] + [(3, data[i:i + each]) for i in range(0, len(data), each)]
        parts.append((2, struct.pack(">HHI", 0, 1, height)))
        self.sent[number] = parts
        if len(self.sent) > 4:
            del self.sent[next(iter(self.sent))]
        self.stats["pictures"] += 1
        for index in range(len(parts)):
            self.packet(number, index)

    def packet(self, number, index, status=0):
        kind, body = self.sent[number][index]
        self.stats["packets"] += 1
        if self.random.random() < self.loss:
            self.stats["lost"] += 1
            return
        try:
            self.out.sendto(struct.pack(">HHI", status, number, kind << 24 | index) + body, self.target())
        except OSError:
            pass

    def resend(self, body):
        _, number, first, last = struct.unpack(">HHII", body[:12])
        for index in range(first & 0xFFFFFF, (last & 0xFFFFFF) + 1):
            if index < len(self.sent.get(number, [])):
                self.stats["resent"] += 1
                self.packet(number, index, 0x0100)

    # All of it

    def command(self, line):
        word, *rest = line.split() or [""]
        if word == "loss":
            self.loss = float(rest[0])
        elif word == "set":
            self.feature(rest[0], rest[1])
        elif word in ("silent", "speaking"):
            self.silent = word == "silent"
        elif word == "reset":
            self.reset()
        elif word == "look":
            self.look, self.frozen = rest[0], self.block
        if word:
            said = f"stats {self.stats}" if word == "stats" else line.strip()
            print(said, flush=True)

    def run(self):
        print("ready", flush=True)
        self.next = time.monotonic()
        while True:
            streams = self.feature("Acquisition") and self.owner and not self.silent and not self.feature("TriggerMode")
            pause = max(0.0, self.next - time.monotonic()) if streams else 0.05
            ready, _, _ = select.select([self.control, self.everybody, sys.stdin], [], [], pause)
            for asked in (self.control, self.everybody):
                if asked in ready:
                    datagram, client = asked.recvfrom(65536)
                    if not self.silent:
                        self.answer(datagram, client)
            if sys.stdin in ready:
                line = sys.stdin.readline()
                if not line:
                    return
                self.command(line)
            now = time.monotonic()
            if self.owner and now > self.heard + self.get32(0x0938) / 1000:
                self.release("heartbeat lost")
            if streams and now >= self.next:
                # Pictures are taken in time; those that this program was too late to send have numbers, too.
                between = 1 / self.feature("AcquisitionFrameRate")
                late = int((now - self.next) / between)
                self.block = (self.block + late) % 65535
                self.next += late * between
                if self.look != "none":
                    self.take(self.next)
                self.next += between * (4 if self.look == "slow" else 1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--address", default="127.0.0.1")
    parser.add_argument("--serial", default="A1")
    parser.add_argument("--name", default="")
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--sensor", help="if it is larger than the pictures")
    parser.add_argument("--loss", type=float, default=0.0)
    parser.add_argument("--packet", type=int, default=9000, help="largest packet that its network carries")
    parser.add_argument("--no-resend", action="store_true")
    parser.add_argument("--each", type=float, default=4.0)
    parser.add_argument("files", nargs="*")
    Camera(parser.parse_args()).run()


main()
