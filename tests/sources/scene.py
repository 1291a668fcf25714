"""What the tests of sources share: pictures of a board, the program, and the pictures that a session stored."""

import json
import subprocess
from pathlib import Path

import cv2
import numpy as np

COLUMNS, ROWS, SQUARE_M = 9, 6, 0.025


def poses(width, height, count=12, seed=1):
    """Pictures of a board before a camera without distortion, tipped in turn to each side, as views are asked for."""
    rng = np.random.default_rng(seed)
    f = 0.9 * width
    k = np.array([[f, 0, width / 2 - 0.5], [0, f, height / 2 - 0.5], [0, 0, 1]])
    cell, margin, fine = 64, 1, 3
    squares = np.add.outer(np.arange(ROWS + 1), np.arange(COLUMNS + 1)) % 2
    board = np.pad(np.kron(255 * squares, np.ones((cell, cell))), margin * cell, constant_values=255).astype(np.uint8)
    middle = np.array([(COLUMNS - 1) / 2, (ROWS - 1) / 2, 0]) * SQUARE_M
    shift = [[SQUARE_M / cell, 0, -(margin + 1) * SQUARE_M + SQUARE_M / cell / 2],
             [0, SQUARE_M / cell, -(margin + 1) * SQUARE_M + SQUARE_M / cell / 2], [0, 0, 1]]
    finer = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
    room = cv2.resize(rng.integers(60, 150, (9, 12)).astype(np.uint8), (fine * width, fine * height))
    made = []
    for number in range(count):
        way = 2 * np.pi * number / 8 + (0.3 if number >= 8 else 0)
        tilt = np.radians(40 if number < 8 else 25)
        turn, _ = cv2.Rodrigues(tilt * np.array([np.cos(way), np.sin(way), 0.0]))
        far = 1.8 * COLUMNS * SQUARE_M * f / width * (1.0 if number < 8 else 1.3)
        place = np.array([0.04 * far * np.cos(3 * way), 0.04 * far * np.sin(3 * way), far]) - turn @ middle
        plane = k @ np.column_stack([turn[:, 0], turn[:, 1], place])
        to_picture = finer @ plane @ shift
        size = (fine * width, fine * height)
        seen = cv2.warpPerspective(np.full_like(board, 255), to_picture, size)
        shown = cv2.warpPerspective(board, to_picture, size)
        large = np.where(seen > 127, 25 + shown // 255 * 195, room).astype(np.uint8)
        made.append(cv2.blur(cv2.resize(large, (width, height), interpolation=cv2.INTER_AREA), (2, 2)))
    return made


def save(pictures, place):
    """The pictures as files of one byte a pixel."""
    files = []
    for number, picture in enumerate(pictures):
        files.append(place / f"{number}.raw")
        files[-1].write_bytes(picture.tobytes())
    return files


def both(pictures):
    """Each picture as a camera sends it: every other time with its lowest bit turned, as noise would have it."""
    return {version.tobytes() for picture in pictures for version in (picture, picture ^ 1)}


class Program:
    def __init__(self, path):
        self.path = str(Path(path).resolve())

    def run(self, *words, status=0, **more):
        ended = subprocess.run([self.path, *map(str, words)], capture_output=True, text=True, **more)
        if status is not None:
            assert ended.returncode == status, (words, ended.returncode, ended.stderr[-2000:])
        return ended

    def start(self, *words, **more):
        return subprocess.Popen([self.path, *map(str, words)], stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL, text=True, **more)

    def guide(self, source, session, *more):
        """The words of a whole session with every picture kept."""
        return ["guide", "--headless", "--source", source, "--out", session, "--record-stream", "--board",
                f"{COLUMNS}x{ROWS}", "--square", f"{1000 * SQUARE_M}mm", "--set", "guidance.plan=quick", *more]


def stored(session):
    """The pictures that a session kept, by number."""
    files = sorted((session / "frames").iterdir())
    return {int(file.stem): cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files}


def verdict(session):
    return json.loads((session / "calibration.json").read_text())["verdict"]


def all_as_sent(session, sent):
    """How many pictures a session kept; each is one of those that were sent, every pixel."""
    seen = stored(session)
    wrong = [number for number, picture in seen.items() if picture.tobytes() not in sent]
    assert seen and not wrong, f"{len(wrong)} of {len(seen)} pictures aren't as they were sent: {wrong[:9]}"
    return len(seen)


def wait_for(process, words):
    """Reads what a program says until it says that."""
    said = []
    for line in process.stderr:
        said.append(line)
        if words in line:
            return said
    raise AssertionError(f"it never said {words!r}: {''.join(said)[-2000:]}")
