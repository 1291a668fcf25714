#!/usr/bin/env python3
"""The whole program on mutated input: cameras of every format, tables, pictures, bags, streams in pipes, sessions and stores
of watched cameras whose checksums are mended, files of several cameras, indexes, manifests, scenes, settings and arguments,
from files and from standard input. Each run must end by itself, without
a panic, with an exit code that docs/commands.md has, within 10 s of the processor and 1 GB. A run that doesn't is kept with
its files.

usage: whole_program.py --boresight target/debug/boresight [--runs 10000] [--seed 1] [--keep FOLDER]
"""
import argparse, collections, hashlib, json, os, pathlib, random, re, resource, shutil, struct, subprocess, sys, tempfile, time, zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
GOOD = ROOT / "fixtures/recordings/v1/good"
CODES, PROCESSOR_S, MEMORY_KB, WAIT_S = {0, 1, 2, 3, 4, 5}, 10, 1 << 20, 300
MOST_BYTES = 8 << 20
NUMBERS = "0 -0 -1 1 1e308 -1e308 5e-324 nan .nan inf -.inf Infinity 1e999 2147483648 4294967295 4294967296 9223372036854775808 18446744073709551616 0x10 1_000 1.5.5 1/0 --1 ١ 0.1mm".split() + ["9" * 400]
WORDS = ["", "null", "true", "~", "{}", "[]", '"', "'", "[[[[[[[[", "}}}}", "&a *a", "<<: *a", "!!binary aGk=", "%YAML 9.9", "---", "...", "\0", "\r", "\u2028", "\u202e", "\ufeff", "a" * 5000, "../../../etc/passwd", "/dev/zero", "$(id)", "%s%n", "{0}", "\\ud800", "-", "--", "#", "<script>", "\t", "日本", "\x1b[2J"]
FORMATS = "opencv-yaml opencv-xml opencv-json ros-yaml kalibr colmap mrcal orb-slam3 nerf instant-ngp metashape realitycapture basalt vins photonvision gyroflow open3d json".split()


class Mutator(random.Random):
    def text(self, text, times=None):
        for _ in range(times or self.choice([1, 1, 1, 2, 3, 8])):
            numbers, words, lines = list(re.finditer(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", text)), list(re.finditer(r"\w+", text)), text.split("\n")
            at, kind = self.randrange(len(text) + 1), self.randrange(12)
            if kind < 4 and numbers:
                found = self.choice(numbers)
                text = text[: found.start()] + self.choice(NUMBERS) + text[found.end() :]
            elif kind == 4 and words:
                found = self.choice(words)
                text = text[: found.start()] + self.choice(WORDS) + text[found.end() :]
            elif kind == 5 and words:
                found = self.choice(words)
                text = text[: found.start()] + self.choice(words).group() + text[found.end() :]
            elif kind == 6:
                del lines[self.randrange(len(lines))]
                text = "\n".join(lines)
            elif kind == 7:
                line = self.randrange(len(lines))
                lines[line:line] = [lines[line]] * self.choice([1, 2, 1000 if len(text) < 20000 else 3])
                text = "\n".join(lines)
            elif kind == 8 and len(lines) < 200:
                self.shuffle(lines)
                text = "\n".join(lines)
            elif kind == 9:
                text = text[:at]
            elif kind == 10:
                text = text[:at] + text[at + self.randrange(1, 60) :]
            else:
                text = text[:at] + self.choice(WORDS + NUMBERS) + text[at:]
        made = text.encode("utf-8", "surrogatepass")
        return self.bytes(made) if self.random() < 0.05 else made

    def bytes(self, given):
        made = bytearray(given)
        for _ in range(self.choice([1, 1, 2, 4, 16])):
            made = made or bytearray(b"\0")
            kind, start = self.randrange(6), self.randrange(len(made))
            end = min(len(made), start + self.choice([1, 2, 4, 64, 1000]))
            if kind == 0:
                made[start] ^= 1 << self.randrange(8)
            elif kind == 1:
                made[start] = self.choice([0, 1, 127, 128, 254, 255])
            elif kind == 2:
                del made[start:end]
            elif kind == 3:
                made[start:start] = made[start:end] * self.choice([1, 2, 50])
            elif kind == 4:
                made[start:end] = self.randbytes(end - start)
            else:
                del made[start:]
        return bytes(made)

    def tree(self, value, share):
        if self.random() < share:
            return self.choice([None, True, 0, -1, 1.5, 1e308, -1e-308, 2**64, -(2**63), "", "NaN", "a" * 300, [], {}, [[]], {"a": 1}, [value, value]])
        if isinstance(value, dict):
            made = {name: self.tree(inner, share) for name, inner in value.items()}
            if made and self.random() < share:
                made.pop(self.choice(list(made)))
            return made
        if isinstance(value, list):
            made = [self.tree(inner, share) for inner in value]
            return self.choice([made[:-1], made + made[-1:], made * (9 if len(made) < 50 else 1), made[::-1]]) if self.random() < share else made
        if type(value) in (int, float) and self.random() < 2 * share:
            return self.choice([-value, value * 1e9, value * 1e-9, value + 1, 0, 1e200, 2**53])
        return value

    def png(self, given):
        if self.random() < 0.2:
            return self.bytes(given)
        chunks, at = [], 8
        while at + 8 <= len(given):
            (length,) = struct.unpack(">I", given[at : at + 4])
            chunks.append([given[at + 4 : at + 8], given[at + 8 : at + 8 + length]])
            at += 12 + length
        for _ in range(self.choice([1, 1, 2, 3])):
            kind, chosen = self.randrange(7), self.randrange(len(chunks))
            header = bytearray(chunks[0][1].ljust(13, b"\0")[:13])
            if kind == 0:
                struct.pack_into(">I", header, self.choice([0, 4]), self.choice([0, 1, 17, 320, 4096, 16385, 60000, 2**31, 2**32 - 1]))
                chunks[0][1] = bytes(header)
            elif kind == 1:
                header[self.randrange(8, 13)] = self.choice([0, 1, 2, 3, 4, 6, 8, 16, 255])
                chunks[0][1] = bytes(header)
            elif kind == 2 and len(chunks) > 1:
                del chunks[chosen]
            elif kind == 3:
                chunks.insert(self.randrange(len(chunks) + 1), list(chunks[chosen]))
            elif kind == 4:
                chunks[chosen][1] = self.bytes(chunks[chosen][1])
            elif kind == 5:
                name = self.choice([b"tRNS", b"PLTE", b"iCCP", b"acTL", b"eXIf", b"zTXt", b"sBIT", b"IDAT"])
                chunks.insert(1, [name, self.choice([b"", self.randbytes(768), b"x\0\0" + zlib.compress(bytes(20_000_000), 1)])])
            else:
                data = next((chunk for chunk in chunks if chunk[0] == b"IDAT"), chunks[0])
                data[1] = zlib.compress(self.choice([b"", self.randbytes(1000), bytes(30_000_000)]), 1)
        return given[:8] + b"".join(struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks)


class Inputs:
    """Good inputs, and by name how each kind is mutated and given to the program."""

    def __init__(self, program, mutator, folder):
        self.program, self.mutate, self.folder, self.stdin = program, mutator, folder, None
        say = lambda *words: subprocess.run([program, *map(str, words)], capture_output=True, cwd=folder).stdout
        self.own, self.table = say("export", GOOD, "--format", "json").decode(), say("export", GOOD, "--format", "vnl").decode()
        fisheye = json.loads(self.own)
        fisheye["result"]["distortion"] = {"fisheye": True, "k1": 0.02, "k2": -0.008, "k3": 0.003, "k4": -4e-4, "p1": 0, "p2": 0}
        fisheye["result"].pop("covariance", None)
        (folder / "fisheye.json").write_text(json.dumps(fisheye))
        exported = [say("export", camera, "--format", name) for camera in (GOOD, "fisheye.json") for name in FORMATS]
        self.cameras = [text.decode() for text in exported if text]
        assert len(self.cameras) >= 25, len(self.cameras)
        lines = (GOOD / "journal.jsonl").read_bytes().splitlines()
        self.header, self.bodies = (GOOD / "session.toml").read_text(), [line[line.index(b'"body":') + 7 : -1] for line in lines]
        self.picture = next((GOOD / "frames").glob("*.png")).read_bytes()
        self.put("fits.png", self.picture)
        self.manifest = say("batch", "plan", GOOD).decode()
        say("history", "add", GOOD, "--index", "index.jsonl")
        self.index = (folder / "index.jsonl").read_text()
        self.settings = (ROOT / "config/default.toml").read_text()
        rust = (ROOT / "tests/hostile/scene.rs").read_text()
        self.scene = rust[rust.index('r#"') + 3 : rust.index('"#;')]
        # Cameras that fit the recorded session's.
        (folder / "fits.toml").write_text('name = "fits"\nseed = 1\nimage_size_px = [400, 300]\nfps = 10\n')
        assert self.table and self.manifest and self.index
        say("watch", "sim:street:1,days=0.5", "--store", "watched", "--once", "--every", "1h", "--patches-only")
        lines = [json.loads(line) for line in (folder / "watched/watch.jsonl").read_text().splitlines()]
        self.lines = [{name: value for name, value in line.items() if name not in ("seq", "sum")} for line in lines]
        lens, pose = json.loads(self.own)["result"], {"rotation_wxyz": [1, 0, 0, 0], "translation_m": [-0.12, 0, 0]}
        camera = {"image_size": [400, 300], "lens": lens, "cam_from_rig": pose, "views": 9, "alone_rms_px": 0.1}
        pair = {"of": ["left", "right"], "instants": 9, "second_from_first": pose, "baseline_m": 0.12, "baseline_sd_m": None, "row_rms_px": 0.1, "row_sd_px": 0.1, "distance_sd": 0.01, "at_m": 0.8, "length_bound_m": None, "covariance": None}
        self.rig = {"schema": "boresight.rig/1", "board": json.loads(self.own)["board"], "stretch": 1.0, "verdict": "good", "findings": [], "cameras": [{"name": name, **camera} for name in ("left", "right")], "pairs": [pair], "instants": [{"number": 1, "rig_from_board": pose, "residual_px": {"left": 0.1, "right": 0.1}}], "covariance": {"order": ["right.turn_x"], "matrix": [[1e-8]]}}
        # A calibration for pictures of their size.
        small = json.loads(self.own)
        small["image_size"], small["result"]["pp_px"] = [16, 12], [8, 6]
        (folder / "small.json").write_text(json.dumps(small))
        self.bags = {path.name: path.read_bytes() for path in sorted((ROOT / "fixtures/bags").iterdir())}
        self.kinds = {name[2:]: getattr(self, name) for name in dir(self) if name.startswith("a_")}

    def put(self, name, content):
        (self.folder / name).write_bytes(content[:MOST_BYTES])
        return name

    def some(self, *choices):
        return list(self.mutate.choice(choices))

    def a_camera(self):
        text = self.mutate.choice(self.cameras)
        made = self.mutate.text(text) if self.mutate.random() < 0.85 else self.mutate.bytes(text.encode())
        if self.mutate.random() < 0.5:
            self.stdin, name = made, "-"
        else:
            name = self.put("in.dat", made)
        sized = self.some([], [], ["--image-size", self.argument("1280x720")])
        return ["convert", name, "out.dat", "--force", "--format", self.mutate.choice(FORMATS + ["json"] * 8), *sized]

    def a_bomb(self):
        """Small files that ask for much."""
        count = self.mutate.choice([300, 20_000, 400_000])
        self.stdin = self.mutate.choice([
            "<calibration" + "".join(f' a{i}=">"' for i in range(count)) + "/>",
            "<opencv_storage>" + "<a>" * count,
            "<x:xmpmeta " + "".join(f'xmlns:a{i}="b{i}" ' for i in range(count)) + "/>",
            "a: &a [x, x, x, x, x, x, x, x]\n" + "".join(f"b{i}: &b{i} [*a, *a, *a]\n" for i in range(count)),
            "[" * count,
            '{"mtx": ' + "[" * count,
            "{'lensmodel': " + "(" * count,
            "1 OPENCV 640 480 " + "1 " * count,
        ]).encode()
        return ["convert", "-", "out.dat", "--force", "--format", "json", "--image-size", "640x480"]

    def a_calibration(self):
        made = self.mutate.text(self.own) if self.mutate.random() < 0.5 else json.dumps(self.mutate.tree(json.loads(self.own), self.mutate.choice([0.001, 0.01]))).encode()
        name = self.put("in.json", made)
        return self.some(["report", name, "--out", "out.html", "--force"], ["export", name, "--format", self.mutate.choice(FORMATS)], ["check", "--against", name, "--source", str(GOOD), "--board", "7x5", "--square", "30mm", "--json"])

    def a_table(self):
        self.stdin = self.mutate.text(self.table)
        size = self.mutate.choice(["400x300", "400x300", "1x1", "65535x65535", "0x0"])
        return ["calibrate", "-", "--json", "--image-size", size, "--board", "7x5"] + self.some([], [], ["--varying-focal"], ["--accept", self.argument("0.2px")])

    def a_picture(self):
        self.stdin = self.mutate.png(self.picture)
        return ["detect", "-", "--board", self.mutate.choice(["7x5", "7x5", "charuco:8x6:DICT_4X4_50", "aprilgrid:4x3"])] + self.some([], ["--json"])

    def a_other_picture(self):
        """Formats without checksums."""
        width, height = 48, 36
        grey = bytes((5 * x + 11 * y) % 256 for y in range(height) for x in range(width))
        bmp = struct.pack("<2sIIIIiiHHIIiiII", b"BM", 54 + 4 * len(grey), 0, 54, 40, width, height, 1, 32, 0, 0, 0, 0, 0, 0) + b"".join(bytes([v, v, v, 255]) for v in grey)
        fields = [(256, 3, width), (257, 3, height), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, 200), (277, 3, 1), (278, 3, height), (279, 4, len(grey))]
        tiff = (b"II*\0\x08\0\0\0" + struct.pack("<H", len(fields)) + b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in fields) + b"\0\0\0\0").ljust(200, b"\0") + grey
        webp = b"RIFF\x1a\0\0\0WEBPVP8L\x0d\0\0\0\x2f\x00\x00\x00\x10\x07\x10\x11\x11\x88\x88\xfe\x07\0"
        pgm = b"P5 %d %d 255\n" % (width, height) + grey
        exif = struct.pack(">HHHIHH", 1, 0x0112, 3, 1, 6, 0)
        jpeg = b"\xff\xd8\xff\xe1" + struct.pack(">H", 16 + len(exif)) + b"Exif\0\0MM\0*\0\0\0\x08" + exif + b"\xff\xd9"
        self.stdin = self.bytes_mostly_whole(self.mutate.choice([bmp, tiff, webp, pgm, jpeg]))
        return ["detect", "-", "--board", "7x5"]

    def bytes_mostly_whole(self, good):
        return good if self.mutate.random() < 0.02 else self.mutate.bytes(good)

    def a_bag(self):
        name = self.mutate.choice(list(self.bags))
        bag = self.put("in" + name[name.index(".") :], self.bytes_mostly_whole(self.bags[name]))
        shutil.rmtree(self.folder / "new", ignore_errors=True)
        (self.folder / "out.mcap").unlink(missing_ok=True)
        topic = self.some([], [], ["--topic", self.argument("/left/image_raw")])
        return self.some(["detect", bag, "--board", "7x5", *topic], ["guide", "--headless", "--source", bag, "--max-frames", "2", "--out", "new", *topic], ["export", "small.json", "--bag", bag, "--out", "out.mcap", *topic])

    def a_stream(self):
        """YUV4MPEG2, motion JPEG, PNG or raw pictures at standard input."""
        header = self.mutate.text("YUV4MPEG2 W48 H36 F30:1 Ip A1:1 C420\n") if self.mutate.random() < 0.6 else b"YUV4MPEG2 W48 H36 F30:1 Ip A1:1 Cmono\n"
        frame = (b"FRAME\n" if self.mutate.random() < 0.8 else self.mutate.text("FRAME Ip\n")) + bytes(range(48)) * 54
        stream = header + frame * 4
        self.stdin = self.mutate.choice([stream, stream, self.mutate.bytes(stream), self.mutate.png(self.picture) * 2, self.mutate.bytes(bytes(48 * 36 * 3))])
        shutil.rmtree(self.folder / "new", ignore_errors=True)
        return ["guide", "--headless", "--source", "-", "--max-frames", "3", "--out", "new", *self.some([], [], ["--raw", self.argument("48x36:gray@30")])]

    def a_store(self):
        folder, lines = self.folder / "store", [dict(line) for line in self.lines]
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self.folder / "watched", folder)
        for _ in range(self.mutate.choice([0, 1, 1, 3])):
            kind, at = self.mutate.randrange(4), self.mutate.randrange(len(lines))
            if kind == 0:
                lines[at] = self.mutate.tree(lines[at], self.mutate.choice([0.01, 0.05]))
            elif kind == 1:
                lines[at:at] = [self.mutate.choice(lines)] * self.mutate.choice([1, 3, 300])
            elif kind == 2 and len(lines) > 1:
                del lines[at]
            else:
                lines.insert(at, {"kind": "accepted", "at": self.mutate.choice([0, 1.78e9, 1e300]), "reason": self.mutate.choice(WORDS)})
        text = b""
        for number, line in enumerate(lines):
            body = json.dumps({"seq": number} | line if isinstance(line, dict) else [line])[:-1].encode()
            text += body + b',"sum":"' + hashlib.sha256(body).hexdigest()[:16].encode() + b'"}\n'
        (folder / "watch.jsonl").write_bytes(self.bytes_mostly_whole(text) if self.mutate.random() < 0.3 else text)
        if self.mutate.random() < 0.3:
            (folder / "watch.json").write_bytes(self.mutate.text((folder / "watch.json").read_text()))
        return self.some(
            ["watch", "state", "--store", "store", "--json"], ["watch", "replay", "--store", "store"], ["watch", "--recover", "--store", "store"],
            ["watch", "accept", "--store", "store", "--reason", "a new pole"], ["history", "due", "--watch", "store"], ["history", "page", "--watch", "store", "--out", "out.html", "--force"],
        )  # fmt: skip

    def a_rig(self):
        name = self.put("rig.json", json.dumps(self.mutate.tree(self.rig, self.mutate.choice([0.002, 0.01, 0.05]))).encode())
        return self.some(["report", name, "--out", "out.html", "--force"], ["export", name, "--format", self.mutate.choice(["kalibr", "ros-yaml", "opencv-yaml", "opencv-stereo"]), *self.some([], ["--name", self.argument("left")])])

    def a_judged(self):
        """A calibration's file with corners of its own, without a picture."""
        points = " ".join(f"{60 + 30 * (at % 7) + number}. {40 + 25 * (at // 7)}." for number in range(4) for at in range(35))
        text = f'<?xml version="1.0"?>\n<opencv_storage>\n<nframes>4</nframes>\n<image_width>400</image_width>\n<image_height>300</image_height>\n<board_width>7</board_width>\n<board_height>5</board_height>\n<square_size>0.03</square_size>\n<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>\n<data>342. 0. 202.5 0. 342. 147.5 0. 0. 1.</data></camera_matrix>\n<distortion_coefficients type_id="opencv-matrix"><rows>5</rows><cols>1</cols><dt>d</dt>\n<data>-.12 .05 0. 0. 0.</data></distortion_coefficients>\n<image_points type_id="opencv-matrix"><rows>4</rows><cols>35</cols><dt>"2f"</dt>\n<data>{points}</data></image_points>\n</opencv_storage>'
        return ["judge", self.put("in.xml", self.mutate.text(text)), *self.some([], ["--json"])]

    def a_manifest(self):
        self.stdin = self.mutate.text(self.manifest)
        shutil.rmtree(self.folder / "batch", ignore_errors=True)
        return ["batch", "run", "-", "--action", self.mutate.choice(["recorded", "export", "replay", "report"]), "--out", "batch", "--jobs", "1"]

    def a_index(self):
        name = self.put("in.jsonl", self.mutate.text(self.index) if self.mutate.random() < 0.6 else self.mutate.bytes(self.index.encode()))
        return ["history", *self.some([], ["--json"], ["add", str(GOOD)], ["due"], ["page", "--out", "out.html", "--force"]), "--index", name]

    def session(self, bodies, header):
        folder = self.folder / "session"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(GOOD / "frames", folder / "frames")
        shutil.copy(GOOD / "calibration.json", folder)
        (folder / "session.toml").write_bytes(header)
        first = b'"session":"%08x",' % zlib.crc32(header)
        lines = [b'{"seq":%d,"crc32":"%08x",%s"body":%s}\n' % (number, zlib.crc32(body), b"" if number else first, body) for number, body in enumerate(bodies)]
        (folder / "journal.jsonl").write_bytes(b"".join(lines))
        shutil.rmtree(self.folder / "recovered", ignore_errors=True)
        return self.some(
            ["calibrate", "session", "--json"], ["doctor", "session"], ["doctor", "session", "--recover", "recovered"], ["replay", "session", "--json"],
            ["replay", "session", "--redetect"], ["report", "session", "--out", "out.html", "--force"], ["export", "session", "--format", self.mutate.choice(["mrcal", "vnl", "json"])],
            ["guide", "--headless", "--session", "session", "--source", "sim:fits.toml", "--max-frames", "2"],
        )  # fmt: skip

    def a_journal(self):
        bodies = list(self.bodies)
        for _ in range(self.mutate.choice([1, 1, 2, 5])):
            kind, at = self.mutate.randrange(5), self.mutate.randrange(len(bodies))
            if kind == 0:
                try:
                    bodies[at] = json.dumps(self.mutate.tree(json.loads(bodies[at]), self.mutate.choice([0.003, 0.02]))).encode()
                except ValueError:
                    pass
            elif kind == 1:
                bodies[at] = self.mutate.text(bodies[at].decode(errors="replace")).replace(b"\n", b" ")
            elif kind == 2:
                bodies[at:at] = [self.mutate.choice(bodies)] * self.mutate.choice([1, 3, 40])
            elif kind == 3:
                del bodies[at : at + self.mutate.choice([1, 5, 30])]
                bodies = bodies or [b"{}"]
            else:
                command = self.mutate.choice(["force_next", "undo_last", "restore", "pause", "resume", "take_more", {"remove": {"view": 2**32}}])
                decision = json.loads(self.mutate.choice(self.bodies))["decision"]
                bodies.insert(at, json.dumps({"input": {"command": command}, "decision": decision}).encode())
        return self.session(bodies, self.header.encode())

    def a_header(self):
        return self.session(self.bodies, self.mutate.text(self.header))

    def a_settings(self):
        name = self.put("in.toml", self.mutate.text(self.settings))
        shutil.rmtree(self.folder / "new", ignore_errors=True)
        pictures = sorted(map(str, (GOOD / "frames").glob("*.png")))
        return self.some(
            ["guide", "--headless", "--source", "sim:fits.toml", "--max-frames", "2", "--out", "new", "--config", name],
            ["detect", "--config", name, *pictures[:1]], ["calibrate", "--config", name, "--json", *pictures],
            ["check", "--against", str(GOOD / "calibration.json"), "--source", str(GOOD), "--same-camera", "--config", name],
        )  # fmt: skip

    def a_scene(self):
        name = self.put("in.toml", self.mutate.text(self.scene))
        shutil.rmtree(self.folder / "new", ignore_errors=True)
        return self.some(["simulate", name, "--out", "new", "--max-frames", "2"], ["guide", "--headless", "--source", f"sim:{name}", "--max-frames", "2", "--out", "new"])

    def a_arguments(self):
        size, board, word = self.argument("320x240"), self.argument(self.mutate.choice(["5x4", "charuco:8x11:DICT_4X4_50:15mm", "aprilgrid:6x6:0.3:1"])), self.argument("guidance.hold_secs=0.5")
        return self.some(
            ["plan-board", "--distance", self.argument("1.5m"), self.mutate.choice(["--fov", "--fov-diagonal"]), self.argument("60deg"), "--image-size", size, "--board", board],
            ["target", "--board", board, "--square", self.argument("20mm"), "--out", self.mutate.choice(["out.pdf", "out.svg"]), "--force"],
            ["replay", str(GOOD), "--set", word], ["detect", "--board", board, str(self.folder / "fits.png")], ["schema", word], ["calibrate", str(GOOD), "--accept", self.argument("length 800mm at 2m <= 0.5mm")],
        )  # fmt: skip

    def argument(self, good):
        if self.mutate.random() < 0.5:
            return good
        return self.mutate.text(good, self.mutate.choice([1, 1, 2])).decode("utf-8", "replace").replace("\0", "")[:2000]


def fault(code, waited_s, processor_s, memory_kb, said):
    if waited_s > WAIT_S:
        return f"didn't end in {WAIT_S} s"
    if b"panicked" in said or code not in CODES:
        return f"ended with {code}"
    if processor_s > PROCESSOR_S or memory_kb > MEMORY_KB:
        return f"took {processor_s:.1f} s of the processor and {memory_kb >> 10} MB"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boresight", required=True, type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("hostile-failures"))
    arguments = parser.parse_args()
    place = tempfile.TemporaryDirectory()
    folder, mutator = pathlib.Path(place.name), Mutator(arguments.seed)
    inputs = Inputs(arguments.boresight.resolve(), mutator, folder)
    environment = {"PATH": os.environ["PATH"], "HOME": place.name, "TMPDIR": place.name}
    counted, most, failures, began, told = collections.defaultdict(collections.Counter), collections.defaultdict(lambda: [0.0, 0]), 0, time.monotonic(), 0.0
    limits = lambda: (resource.setrlimit(resource.RLIMIT_CPU, (60, 60)), resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)))
    for number in range(arguments.runs):
        kind = mutator.choice(list(inputs.kinds))
        inputs.stdin = None
        words = [word.replace("\0", "") for word in inputs.kinds[kind]()]
        given = inputs.put("stdin", inputs.stdin or b"")
        with open(folder / given) as stdin, open(folder / "said", "w+b") as said:
            started, program = time.monotonic(), [inputs.program, *words]
            child = subprocess.Popen(program, stdin=stdin, stdout=subprocess.DEVNULL, stderr=said, cwd=folder, env=environment, preexec_fn=limits)
            waited_s = 0.0
            while waited_s <= WAIT_S:
                ended, status, used = os.wait4(child.pid, os.WNOHANG)
                if ended:
                    break
                time.sleep(0.002)
                waited_s = time.monotonic() - started
            else:
                child.kill()
                _, status, used = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            said.seek(0)
            why = fault(child.returncode, waited_s, used.ru_utime + used.ru_stime, used.ru_maxrss, said.read())
        counted[kind][child.returncode] += 1
        most[kind] = [max(most[kind][0], used.ru_utime + used.ru_stime), max(most[kind][1], used.ru_maxrss)]
        if why:
            failures += 1
            kept = arguments.keep / f"{arguments.seed}-{number}"
            shutil.copytree(folder, kept, dirs_exist_ok=True)
            (kept / "command.json").write_text(json.dumps(words))
            print(f"{kind}: {why}, kept in {kept}: {words}", flush=True)
        if time.monotonic() - told > 60:
            told = time.monotonic()
            print(f"{number + 1} of {arguments.runs} runs, {failures} failures, {told - began:.0f} s", file=sys.stderr, flush=True)
    for kind, codes in sorted(counted.items()):
        print(f"{kind:12} {sum(codes.values()):6} runs, exit codes {dict(sorted(codes.items()))}, at most {most[kind][0]:.1f} s and {most[kind][1] >> 10} MB")
    print(f"{arguments.runs} runs, {failures} failures, {time.monotonic() - began:.0f} s")
    raise SystemExit(1 if failures else 0)


main()
