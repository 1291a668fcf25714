"""Boards of every kind as textures, and pictures of them with known answers, quickly made: see board_identities.py."""
import itertools, zlib

import cv2
import numpy as np

import detector_table as table

LIGHT, DARK = 240, 20
# Pixels of a texture: side of a square or tag, and distance of rows of circles.
Q = 48


class Board:
    """A texture, the points in it, what the detector is asked for, and the other numberings that look the same."""

    def __init__(self, name, tex, points, grid, same=()):
        self.name, self.tex, self.points, self.grid = name, tex, np.asarray(points, float), grid
        self.orders = [np.arange(len(self.points)), *map(np.asarray, same)]
        self.is_plain = ":" not in name


def half_turn(count):
    return np.arange(count)[::-1]


def aprilgrid(across, down, spacing, first, from_top, half_turned):
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    side, gap = 50, int(round(50 * spacing))
    pitch, rim = side + gap, 2 * gap + 10
    tex = np.full((down * pitch + gap + 2 * rim, across * pitch + gap + 2 * rim), LIGHT, np.uint8)
    for row, column in itertools.product(range(down), range(across)):
        number = first + (row if from_top else down - 1 - row) * across + column
        tag = cv2.aruco.generateImageMarker(tags, number, side, borderBits=2)
        tag = np.where(tag[::-1, ::-1] if half_turned else tag, LIGHT, DARK)
        x, y = rim + gap + column * pitch, rim + gap + row * pitch
        tex[y:y + side, x:x + side] = tag
    for row, column in itertools.product(range(down + 1), range(across + 1)):
        x, y = rim + column * pitch, rim + row * pitch
        tex[y:y + gap, x:x + gap] = DARK
    line = lambda k: rim + gap + k // 2 * pitch + k % 2 * side - .5
    points = [[line(x), line(y)] for y in range(2 * down) for x in range(2 * across)]
    name = f"aprilgrid:{across}x{down}:{gap / side:g}:{first}"
    return Board(name, tex, points, [2 * across, 2 * down])


def circle_grid(across, down, shifted, diameter):
    step = 2 if shifted else 1
    place = np.array([[step * x + y % step, y] for y in range(down) for x in range(across)])
    width, height = place.max(0)
    rim = 1.3
    at = np.round((place + rim) * Q).astype(int)
    tex = np.full((int((height + 2 * rim) * Q), int((width + 2 * rim) * Q)), LIGHT, np.uint8)
    for x, y in at:
        cv2.circle(tex, (int(x), int(y)), int(diameter / 2 * Q), DARK, -1, cv2.LINE_AA)
    index = {tuple(p): k for k, p in enumerate(place)}
    # Turns that map every circle to a circle.
    turns = [lambda x, y: (width - x, height - y), lambda x, y: (width - y, x), lambda x, y: (y, height - x)]
    orders = ([index.get(turn(*p)) for p in place] for turn in turns)
    name = f"{'acircles' if shifted else 'circles'}:{across}x{down}"
    return Board(name, tex, at, [across, down], [order for order in orders if None not in order])


def charuco(across, down, dictionary, legacy):
    d = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    board = cv2.aruco.CharucoBoard((across, down), 1.0, .75, d)
    board.setLegacyPattern(legacy)
    r = int(.6 * Q)
    drawn = cv2.resize(board.generateImage((4 * across * Q, 4 * down * Q)), (across * Q, down * Q), interpolation=cv2.INTER_AREA)
    tex = cv2.copyMakeBorder(drawn, r, r, r, r, cv2.BORDER_CONSTANT, value=255)
    tex = (DARK + (LIGHT - DARK) / 255 * tex).astype(np.uint8)
    points = [[r + (x + 1) * Q - .5, r + (y + 1) * Q - .5] for y in range(down - 1) for x in range(across - 1)]
    return Board(f"charuco:{across}x{down}:{dictionary}", tex, points, [across - 1, down - 1])


def plain(n, m, rim=1.0):
    tex, points = table.plain(n, m, rim, Q)
    same = [half_turn(n * m)] if n % 2 == m % 2 else []
    return Board(f"{n}x{m}", tex, points, [n, m], same)


def coded(n, m, number, edges):
    """A plain board with the code of crates/geometry/src/board_code, whose squares are 25 mm."""
    fields = [(n, 7), (m, 7), (25000, 20), (number, 20)]
    fields.append((zlib.crc32(b"boresight/1" + b"".join(value.to_bytes(4, "big") for value, _ in fields)), 32))
    cells = "110" + "".join(f"{value:0{bits}b}" for value, bits in fields) + "101"
    fine = 4  # The strip's cells are small: it needs a finer texture.
    board = plain(n, m)
    tex = cv2.resize(board.tex, None, fx=fine, fy=fine, interpolation=cv2.INTER_NEAREST)
    q = fine * Q
    for edge in edges:
        length = (n if edge in ("top", "bottom") else m) + 1
        near, far = {"top": (-.66, -.42), "left": (-.66, -.42), "bottom": (m + 1.42, m + 1.66), "right": (n + 1.42, n + 1.66)}[edge]
        across = slice(round((1 + near) * q), round((1 + far) * q))
        for k, cell in enumerate(cells):
            along = slice(*(round((1 + at / len(cells) * length) * q) for at in (k, k + 1)))
            where = (across, along) if edge in ("top", "bottom") else (along, across)
            tex[where] = DARK if cell == "1" else LIGHT
    return Board(board.name, tex, (board.points + .5) * fine - .5, board.grid)


class Pictures(table.Scenes):
    """Pictures of boards, each with what is asked for, and the true points of every board that may be found. The parts of a scene
    are those of detector_table.py, made faster: in float32, only where something changes, with noise that is kept."""

    NOISE = np.random.default_rng(0).standard_normal(1 << 21, np.float32)
    SIZES = [(640, 480), (800, 600), (960, 720)]
    photos = {}

    def size(self):
        return self.SIZES[self.rng.integers(len(self.SIZES))]

    def photo(self, w, h):
        key = int(self.rng.integers(len(self.backgrounds))), w, h
        if key not in self.photos:
            b = self.backgrounds[key[0]]
            s = max(w / b.shape[1], h / b.shape[0]) * 1.01
            self.photos[key] = cv2.resize(b, None, fx=s, fy=s, interpolation=cv2.INTER_AREA)[:h, :w].copy()
        return self.photos[key].astype(np.float32)

    def paste(self, img, tex, hom, over=3):
        h, w = img.shape
        th, tw = tex.shape
        ends = cv2.perspectiveTransform(np.array([[[-.5, -.5], [tw - .5, -.5], [tw - .5, th - .5], [-.5, th - .5]]]), hom)[0]
        low = np.clip(np.floor(ends.min(0)) - 2, 0, (w, h)).astype(int)
        high = np.clip(np.ceil(ends.max(0)) + 3, 0, (w, h)).astype(int)
        if (high <= low).any():
            return img
        middle = (over - 1) / 2
        fine = np.array([[over, 0, middle - over * low[0]], [0, over, middle - over * low[1]], [0, 0, 1.]])
        size = tuple(map(int, high - low))
        large = tuple(over * side for side in size)
        down = lambda picture: cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        seen = down(cv2.warpPerspective(tex, fine @ hom, large, borderMode=cv2.BORDER_REPLICATE))
        mask = np.zeros(large[::-1], np.uint8)
        sheet = cv2.perspectiveTransform(ends[None], fine)[0]
        cv2.fillConvexPoly(mask, np.round(sheet * 16).astype(np.int32), 255, shift=4)
        k = down(mask) / 255
        part = np.s_[low[1]:high[1], low[0]:high[0]]
        img = img.copy()
        img[part] += (seen - img[part]) * k
        return img

    def noise(self, shape):
        count = shape[0] * shape[1]
        start = int(self.rng.integers(len(self.NOISE) - count))
        return self.NOISE[start:start + count].reshape(shape)

    def lay_over(self, img, outline, may_be_white=True):
        """Covers what is within an outline by something grey, white, or of another picture."""
        rng = self.rng
        mask = np.zeros(img.shape, np.uint8)
        cv2.fillPoly(mask, [np.round(outline).astype(int)], 255)
        k = cv2.GaussianBlur(mask, (5, 5), 1).astype(np.float32) / 255
        fill = [None, rng.uniform(0, 160), 250.][rng.integers(3 if may_be_white else 2)]
        over = self.photo(*img.shape[::-1]) if fill is None else fill + 4 * self.noise(img.shape)
        return img + (over - img) * k

    def cover(self, img, corners, side):
        rng = self.rng
        for _ in range(rng.integers(1, 4)):
            c, r = corners[rng.integers(len(corners))], rng.uniform(.8, 3.5) * side
            if rng.random() < .4:
                axes = int(r) + 1, int(r * rng.uniform(.3, 1)) + 1
                outline = cv2.ellipse2Poly((int(c[0]), int(c[1])), axes, int(rng.integers(180)), 0, 360, 10)
            else:
                outline = cv2.boxPoints((c.tolist(), (2 * r, r * rng.uniform(.5, 3)), rng.uniform(0, 180)))
            img = self.lay_over(img, outline)
        return img

    def finish(self, img, blur=(.5, 1.4), noise=(1, 5)):
        rng = self.rng
        img = cv2.GaussianBlur(img, (0, 0), rng.uniform(*blur))
        low, high = rng.uniform(5, 50), rng.uniform(150, 245)
        img = low + (high - low) / 255 * img + rng.uniform(*noise) * self.noise(img.shape)
        return np.clip(img, 0, 255).astype(np.uint8)

    def put(self, img, board, fill, tilt, off=.08):
        """Pastes a board turned by any angle, as large as `fill` of the picture's width; returns its true points, too."""
        rng, (h, w) = self.rng, img.shape
        fill = min(fill, fill * h / w * board.tex.shape[1] / board.tex.shape[0] * 1.2)
        off = (rng.uniform(-off, off), rng.uniform(-off, off) * h / w, rng.uniform(0, 6.28))
        hom = self.pose(w, h, board.tex, fill, tilt, rng.uniform(0, 360), off)
        return self.paste(img, board.tex, hom), cv2.perspectiveTransform(board.points[None], hom)[0]

    def picture(self, board, kind, second=None):
        rng = self.rng
        w, h = self.size()
        img = self.photo(w, h)
        fill, tilt, off = rng.uniform(.4, .9), rng.uniform(0, 50), .1
        blur, noise = (.5, 1.4), (1, 5)
        if kind == "cut":
            fill, off = rng.uniform(.8, 1.8), .3
        elif kind == "tipped":
            fill, tilt = rng.uniform(.6, 1.1), rng.uniform(50, 70)
        elif kind == "far":
            side_px = rng.uniform(*((20, 32) if "april" in board.name else (9, 16)))
            fill, off = side_px / Q * board.tex.shape[1] / w, .3
        elif kind == "blurred":
            blur = (1.4, 4)
        elif kind == "noisy":
            noise = (8, 25)
        truths = []
        if second is not None:
            fill = rng.uniform(.3, .6)
            img, other = self.put(img, second, rng.uniform(.3, .6), rng.uniform(0, 40), .4)
            if second.name == board.name:
                truths.append((other, second))
        img, t = self.put(img, board, fill, tilt, off)
        truths.append((t, board))
        if kind in ("covered", "cut and covered"):
            across = np.median(np.linalg.norm(t[1:] - t[:-1], axis=1))
            img = self.cover(img, t, across * (2 if "april" in board.name else 1) * rng.uniform(.3, 1))
        if kind == "row hidden":
            img = self.hide_lines(img, t.reshape(board.grid[1], board.grid[0], 2))
        if kind == "light on dark":
            img = 255 - img
        return self.finish(img, blur, noise), truths

    def hide_lines(self, img, t):
        """Covers one to three whole rows or columns at an end of the board by a strip of something else; white would be its rim."""
        rng = self.rng
        t = t if rng.random() < .5 else t.transpose(1, 0, 2)
        t = t if rng.random() < .5 else t[::-1]
        count = rng.integers(1, min(4, len(t)))
        last, next_in, out = t[count - 1], t[count], t[0] + .9 * (t[0] - t[1])
        inner = last + rng.uniform(.3, .55) * (next_in - last)
        grow = lambda line: np.array([line[0] + 1.5 * (line[0] - line[1]), line[-1] + 1.5 * (line[-1] - line[-2])])
        return self.lay_over(img, np.concatenate([grow(inner), grow(out + (t[0] - t[1]))[::-1]]), may_be_white=False)
