#!/usr/bin/env python3
"""Compares `boresight detect` with OpenCV's CharucoDetector, and calib-targets if it's installed, on ChArUco boards that
OpenCV draws and this script projects.

usage: charuco_beside_peers.py FOLDER [--boresight target/release/boresight] [--each 28] [--every 5] [--no-peers]

Pictures are drawn into FOLDER once and read again by later runs: 72 boards (three dictionaries, four sizes, three sizes of
markers, both layouts), so many pictures of EACH. Squares have 22 to 90 px; blur, noise, tilt and light vary, boards are cut
off by the picture's edge, and every fifth picture is seen through a fisheye lens. Needs numpy and opencv-python-headless.
"""
import argparse, itertools, json, os, subprocess, time

import cv2
import numpy as np

DICTIONARIES = ["DICT_4X4_100", "DICT_5X5_100", "DICT_6X6_250"]
SQUARES = [(8, 11), (11, 8), (7, 5), (14, 10)]
MARKERS = [0.6, 0.7, 0.75]
SIZE = (960, 720)
# Samples of a pixel, along each side.
FINE = 3
# A corner this far from the truth, in squares, has another corner's number.
WRONG_SQUARES = 0.5


def charuco(squares, dictionary, marker, legacy):
    code = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    board = cv2.aruco.CharucoBoard(squares, 1.0, marker, code)
    board.setLegacyPattern(legacy)
    return board


def boards():
    return list(itertools.product(SQUARES, DICTIONARIES, MARKERS, (False, True)))


def print_of(board, squares, square_px):
    """The board with white around it, a square wide, at `square_px` texture pixels per square."""
    large = 280
    drawn = board.generateImage((squares[0] * large, squares[1] * large), marginSize=0, borderBits=1)
    drawn = cv2.copyMakeBorder(drawn, large, large, large, large, cv2.BORDER_CONSTANT, value=255)
    size = ((squares[0] + 2) * square_px, (squares[1] + 2) * square_px)
    return cv2.resize(drawn, size, interpolation=cv2.INTER_AREA)


class Lens:
    """A pinhole, or a fisheye lens with image radius f (theta + k theta^3)."""

    def __init__(self, rng, fisheye):
        width, height = SIZE
        self.f = rng.uniform(380, 460) if fisheye else rng.uniform(750, 1100)
        self.k = rng.uniform(-0.06, 0.02) if fisheye else None
        self.centre = np.array([(width - 1) / 2, (height - 1) / 2]) + rng.uniform(-15, 15, 2)

    def px(self, points):
        """Pixels of points in the camera's frame, N x 3; NaN behind it."""
        xy, z = points[:, :2], points[:, 2:]
        if self.k is None:
            return np.where(z > 0.05, self.f * xy / np.maximum(z, 1e-9) + self.centre, np.nan)
        radius = np.linalg.norm(xy, axis=1, keepdims=True)
        theta = np.arctan2(radius, z)
        scale = self.f * (theta + self.k * theta**3) / np.maximum(radius, 1e-12)
        return np.where(theta < 1.4, xy * scale + self.centre, np.nan)

    def rays(self, px):
        """Rays through pixels, ... x 2 to ... x 3."""
        at = (px - self.centre) / self.f
        if self.k is None:
            return np.concatenate([at, np.ones(at.shape[:-1] + (1,))], axis=-1)
        radius = np.linalg.norm(at, axis=-1, keepdims=True)
        table = np.linspace(0, 1.5, 20001)
        theta = np.interp(radius, table + self.k * table**3, table)
        return np.concatenate([at / np.maximum(radius, 1e-12) * np.sin(theta), np.cos(theta)], axis=-1)


def rotation(axis_angle):
    return cv2.Rodrigues(np.asarray(axis_angle, dtype=float))[0]


def picture(rng, board, squares, number):
    """A picture, where its corners are, and the mean side of a square in it."""
    width, height = SIZE
    fisheye = number % 5 == 4
    lens = Lens(rng, fisheye)
    columns, rows = squares
    square_px = np.exp(rng.uniform(np.log(22), np.log(90)))
    tilt, way = np.radians(rng.uniform(0, 50)), rng.uniform(0, 2 * np.pi)
    turn = rotation([0, 0, rng.uniform(0, 2 * np.pi)])
    cam_from_board = rotation(tilt * np.array([np.cos(way), np.sin(way), 0])) @ turn
    depth = lens.f / square_px
    # Where the middle of the board is: large boards leave the picture at any place.
    middle = lens.rays(np.array([rng.uniform(0.25, 0.75) * width, rng.uniform(0.25, 0.75) * height]))
    at = middle / middle[2] * depth
    y, x = np.mgrid[1:rows, 1:columns]
    inner = np.stack([x.ravel() - columns / 2, y.ravel() - rows / 2, np.zeros(x.size)], axis=1)
    truth = lens.px(inner @ cam_from_board.T + at)

    texture_px = int(np.clip(round(FINE * square_px), 50, 280))
    texture = print_of(board, squares, texture_px).astype(np.float32)
    if fisheye:
        # Only where the board is.
        edge = np.linspace(-1, 1, 41)
        rim = np.concatenate([np.stack(pair, axis=1) for e in (-1.0, 1.0) for pair in ((edge, 0 * edge + e), (0 * edge + e, edge))])
        rim = np.column_stack([rim * [columns / 2 + 1, rows / 2 + 1], np.zeros(len(rim))])
        ends = lens.px(rim @ cam_from_board.T + at)
        ends = [[0, 0], [width, height]] if np.isnan(ends).any() else [ends.min(axis=0) - 3, ends.max(axis=0) + 3]
        (left, top), (right, bottom) = (FINE * np.clip(np.round(ends), 0, SIZE)).astype(int)
        py, px = np.mgrid[top:bottom, left:right].astype(np.float64)
        pixels = np.stack([(px + 0.5) / FINE - 0.5, (py + 0.5) / FINE - 0.5], axis=-1)
        rays = lens.rays(pixels) @ cam_from_board
        origin = -cam_from_board.T @ at
        with np.errstate(divide="ignore", invalid="ignore"):
            along = -origin[2] / rays[..., 2]
        plane = origin[:2] + along[..., None] * rays[..., :2]
        plane[along <= 0] = 1e4
        u = (plane[..., 0] + columns / 2 + 1) * texture_px - 0.5
        v = (plane[..., 1] + rows / 2 + 1) * texture_px - 0.5
        limit = 32000
        maps = [np.nan_to_num(np.clip(m, -limit, limit), nan=-limit).astype(np.float32) for m in (u, v)]
        fine = np.full((FINE * height, FINE * width), -1, np.float32)
        fine[top:bottom, left:right] = cv2.remap(texture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=-1)
    else:
        # Texture pixels to fine pixels.
        squares_from_texture = np.array(
            [[1 / texture_px, 0, 0.5 / texture_px - 1 - columns / 2], [0, 1 / texture_px, 0.5 / texture_px - 1 - rows / 2], [0, 0, 1]]
        )
        pose = np.column_stack([cam_from_board[:, :2], at])
        camera = np.array([[lens.f, 0, lens.centre[0]], [0, lens.f, lens.centre[1]], [0, 0, 1]])
        fine_from_px = np.array([[FINE, 0, (FINE - 1) / 2], [0, FINE, (FINE - 1) / 2], [0, 0, 1]])
        h = fine_from_px @ camera @ pose @ squares_from_texture
        size = (FINE * width, FINE * height)
        fine = cv2.warpPerspective(texture, h, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=-1)
    back = cv2.resize(rng.uniform(0.15, 0.75, (9, 12)).astype(np.float32), (FINE * width, FINE * height), interpolation=cv2.INTER_CUBIC)
    fine = np.where(fine < 0, 255 * back, fine)
    dark, light = rng.uniform(8, 60), rng.uniform(130, 235)
    fine = dark + (light - dark) / 255 * fine
    sigma = FINE * rng.uniform(0.4, 1.2)
    fine = cv2.GaussianBlur(fine.astype(np.float32), (0, 0), sigma)
    seen = cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA)
    slope = rng.uniform(-0.15, 0.15, 2)
    seen *= 1 + slope[0] * np.linspace(-1, 1, width)[None, :] + slope[1] * np.linspace(-1, 1, height)[:, None]
    seen += rng.normal(0, rng.uniform(1, 5), seen.shape)
    return np.clip(np.round(seen), 0, 255).astype(np.uint8), truth, float(square_px)


def draw(folder, each, every):
    os.makedirs(folder, exist_ok=True)
    for index, (squares, dictionary, marker, legacy) in list(enumerate(boards()))[::every]:
        path = os.path.join(folder, f"{index:02}.json")
        if os.path.exists(path):
            continue
        board = charuco(squares, dictionary, marker, legacy)
        pictures = []
        for number in range(each):
            image, truth, square_px = picture(np.random.default_rng([index, number]), board, squares, number)
            name = f"{index:02}-{number:03}.png"
            cv2.imwrite(os.path.join(folder, name), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
            pictures.append({"file": name, "corners": truth.tolist(), "square_px": square_px})
        with open(path, "w") as file:
            json.dump(pictures, file)


def boresight(program, folder, pictures, board):
    (across, down), dictionary, marker, _ = board
    named = f"charuco:{across}x{down}:{dictionary}:{marker * 100}mm"
    files = [os.path.join(folder, picture["file"]) for picture in pictures]
    command = [program, "detect", "--json", "--board", named, "--square", "100mm", *files]
    said = subprocess.run(command, capture_output=True, text=True).stdout
    for line in map(json.loads, said.splitlines()):
        corners = {row * (across - 1) + column: (x, y) for column, row, x, y, _ in line["corners"] or []}
        yield corners, line["millis"]


def opencv(folder, pictures, board):
    detector = cv2.aruco.CharucoDetector(charuco(*board))
    for picture in pictures:
        image = cv2.imread(os.path.join(folder, picture["file"]), cv2.IMREAD_GRAYSCALE)
        began = time.process_time()
        corners, ids, _, _ = detector.detectBoard(image)
        millis = 1e3 * (time.process_time() - began)
        found = {} if ids is None else dict(zip(ids.ravel().tolist(), corners.reshape(-1, 2).tolist()))
        yield found, millis


def calib_targets(folder, pictures, board):
    import calib_targets as peer

    (across, down), dictionary, marker, legacy = board
    if legacy and down % 2 == 0:
        # It knows the present layout only.
        return
    spec = peer.CharucoBoardSpec(rows=down, cols=across, cell_size=1.0, marker_size_rel=marker, dictionary=dictionary)
    params = peer.CharucoParams(board=spec)
    for picture in pictures:
        image = cv2.imread(os.path.join(folder, picture["file"]), cv2.IMREAD_GRAYSCALE)
        began = time.process_time()
        try:
            found = {corner.id: tuple(corner.position) for corner in peer.detect_charuco(image, params=params).corners}
        except (RuntimeError, ValueError):
            found = {}
        yield found, 1e3 * (time.process_time() - began)


class Tally:
    def __init__(self):
        self.found, self.wrong, self.pictures, self.empty, self.visible, self.outside = 0, 0, 0, 0, 0, 0
        self.millis, self.errors = [], {}

    def add(self, picture, found, millis):
        width, height = SIZE
        truth = np.array(picture["corners"])
        inside = (truth > 0).all(axis=1) & (truth < [width - 1, height - 1]).all(axis=1)
        self.visible += int(inside.sum())
        self.pictures += 1
        self.empty += not found
        self.millis.append(millis)
        for number, at in found.items():
            error = float(np.hypot(*(truth[number] - at)))
            if not error < WRONG_SQUARES * picture["square_px"]:
                self.wrong += 1
                print(f"  wrong: {picture['file']} corner {number} off by {error:.1f} px")
                continue
            self.found += inside[number]
            self.outside += not inside[number]
            self.errors[picture["file"], number] = error

    def line(self, name):
        return (
            f"{name}: {self.pictures} pictures, {self.empty} without a board, {self.found} of {self.visible} corners, "
            f"{self.wrong} wrong, {np.mean(self.millis):.1f} ms mean, {np.median(self.millis):.1f} ms median"
        )


def spread(errors):
    errors = np.array(errors)
    return f"median {np.median(errors):.4f}, rms {np.sqrt(np.mean(errors**2)):.4f}, 99 % {np.quantile(errors, 0.99):.4f} px"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder")
    parser.add_argument("--boresight", default="target/release/boresight")
    parser.add_argument("--each", type=int, default=28)
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--every", type=int, default=1, help="only every so many boards")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    draw(arguments.folder, arguments.each, arguments.every)
    contestants = {"boresight": lambda *args: boresight(arguments.boresight, *args)}
    if not arguments.no_peers:
        contestants["OpenCV"] = opencv
        try:
            import calib_targets as _
            contestants["calib-targets"] = calib_targets
        except ImportError:
            print("calib-targets isn't installed")
    tallies = {name: Tally() for name in contestants}
    for index, board in list(enumerate(boards()))[:: arguments.every]:
        with open(os.path.join(arguments.folder, f"{index:02}.json")) as file:
            pictures = json.load(file)
        for name, run in contestants.items():
            for picture, (found, millis) in zip(pictures, run(arguments.folder, pictures, board)):
                tallies[name].add(picture, found, millis)
    ours = tallies["boresight"].errors
    for name, tally in tallies.items():
        print(tally.line(name))
        common = sorted(set(ours) & set(tally.errors))
        if name == "boresight":
            print(f"  all: {spread(list(ours.values()))}")
        elif common:
            print(f"  {len(common)} corners in common: boresight {spread([ours[c] for c in common])}")
            print(f"    {name} {spread([tally.errors[c] for c in common])}")


main()
