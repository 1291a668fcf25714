#!/usr/bin/env python3
"""Makes pictures with known answers, and judges what the detector says of them.

usage: detector_table.py make FOLDER [--boards DIR] [--videos DIR] [--count N] [--seed S]
       cargo run --release -p boresight-detect --example look < FOLDER/list > table
       detector_table.py judge FOLDER table [older-table]

Rendered: whole, covered, cut, doubled and far boards, boards of another size, circle grids, AprilTag grids, ChArUco boards, a
ChArUco board with a plain one beside it, blurred, sharpened and compressed pictures, boards that jump by whole squares while
their ends are covered. Real: folders with a manifest.csv (file, set, inner_cols, inner_rows, has_board, visible), and videos
as sequences. Backgrounds are those of the manifest's pictures without a board. Needs numpy and opencv-contrib-python-headless.

Of each kind it prints how many were found, wrong ones (a corner more than 1.5 px off or numbered wrongly; any board where
there is none), the corners' error, error over stated standard deviation, the reasons of misses, and milliseconds.
"""
import argparse, collections, csv, glob, json, os, re, sys

import cv2
import numpy as np

WRONG_PX = 1.5
SIZES = [(9, 6), (8, 6), (7, 5), (11, 8), (8, 5), (10, 7)]
CIRCLES = ("circles", "circles_asym", "april")
PICTURED = ("gauss", "disc", "motion", "sharpened", "disc_sharpened", "bayer", "bayer_jpeg80", "jpeg50", "dim")


# ---- textures: picture and the corners' pixels in it --------------------------------------------------------------------

def plain(n, m, rim=1.0, q=60):
    a = np.full((int((m + 1 + 2 * rim) * q), int((n + 1 + 2 * rim) * q)), 240, np.uint8)
    o = int(rim * q)
    for y in range(m + 1):
        for x in range(n + 1):
            if (x + y) % 2 == 0:
                a[o + y * q:o + (y + 1) * q, o + x * q:o + (x + 1) * q] = 20
    g = np.array([[o + (x + 1) * q - .5, o + (y + 1) * q - .5] for y in range(m) for x in range(n)])
    return a, g


def circles(n, m, asym, q=60):
    a = np.full(((m + 2) * q, (n + 2) * q * (2 if asym else 1)), 240, np.uint8)
    for y in range(m):
        for x in range(n):
            at = ((2 * x + y % 2) * q + 2 * q, y * q + 2 * q) if asym else ((x + 1.5) * q, (y + 1.5) * q)
            cv2.circle(a, (int(at[0]), int(at[1])), int((.45 if asym else .3) * q), 20, -1, cv2.LINE_AA)
    return a


def april(n, m, q=60, gap=.3):
    d = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    p = int(q * (1 + gap))
    a = np.full(((m + 1) * p, (n + 1) * p), 240, np.uint8)
    s = int(gap * q)
    for y in range(m):
        for x in range(n):
            o = (p // 2 + x * p, p // 2 + y * p)
            a[o[1]:o[1] + q, o[0]:o[0] + q] = cv2.aruco.generateImageMarker(d, y * n + x, q)
            for dx in (-s, q):  # Kalibr's small squares between the tags
                for dy in (-s, q):
                    a[o[1] + dy:o[1] + dy + s, o[0] + dx:o[0] + dx + s] = 20
    return a


def charuco(n, m, name="DICT_4X4_250", q=60, rim=.6):
    d = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    b = cv2.aruco.CharucoBoard((n, m), 1.0, .75, d)
    r = int(rim * q)
    # OpenCV rounds a marker's place to pixels: at four times the size, it's a whole number of them.
    drawn = cv2.resize(b.generateImage((4 * n * q, 4 * m * q)), (n * q, m * q), interpolation=cv2.INTER_AREA)
    a = cv2.copyMakeBorder(drawn, r, r, r, r, cv2.BORDER_CONSTANT, value=255)
    a = np.clip(a.astype(float) * 220 / 255 + 20, 0, 255).astype(np.uint8)
    g = np.array([[r + (x + 1) * q - .5, r + (y + 1) * q - .5] for y in range(m - 1) for x in range(n - 1)])
    return a, g


def disc(radius):
    """The blur of a lens out of focus."""
    half = int(np.ceil(radius)) + 1
    y, x = np.mgrid[-half:half + 1, -half:half + 1]
    k = np.clip(radius + .5 - np.hypot(x, y), 0, 1)
    return k / k.sum()


def line(length, angle):
    """The blur of a board in motion."""
    half = int(np.ceil(length / 2)) + 1
    along = np.linspace(-length / 2, length / 2, 200)
    y, x = np.mgrid[-half:half + 1, -half:half + 1]
    near = [np.clip(1 - np.abs(d[..., None] - along * f(angle)), 0, 1) for d, f in ((x, np.cos), (y, np.sin))]
    k = (near[0] * near[1]).sum(-1)
    return k / k.sum()


# ---- scenes -------------------------------------------------------------------------------------------------------------

class Scenes:
    def __init__(self, rng, backgrounds):
        self.rng, self.backgrounds = rng, backgrounds

    def photo(self, w, h):
        b = cv2.imread(self.backgrounds[self.rng.integers(len(self.backgrounds))], 0)
        s = max(w / b.shape[1], h / b.shape[0]) * 1.01
        return cv2.resize(b, None, fx=s, fy=s, interpolation=cv2.INTER_AREA)[:h, :w].astype(float)

    def pose(self, w, h, tex, fill, tilt, roll, off):
        th, tw = tex.shape
        f = 1.1 * w
        p = (np.array([[0, 0], [tw, 0], [tw, th], [0, th]], float) - [tw / 2, th / 2]) / tw
        ax = np.array([np.cos(off[2]), np.sin(off[2]), 0]) * np.radians(tilt)
        r = cv2.Rodrigues(ax)[0] @ cv2.Rodrigues(np.array([0, 0, np.radians(roll)]))[0]
        z = f / (fill * w)
        q = (r @ np.c_[p, np.zeros(4)].T).T + [off[0] * z, off[1] * z, z]
        uv = q[:, :2] / q[:, 2:] * f + [w / 2, h / 2]
        return cv2.getPerspectiveTransform(np.float32([[0, 0], [tw, 0], [tw, th], [0, th]]), np.float32(uv))

    def paste(self, img, tex, hom, over=3):
        h, w = img.shape
        s = np.array([[over, 0, (over - 1) / 2], [0, over, (over - 1) / 2], [0, 0, 1.]])
        size, down = (w * over, h * over), (w, h)
        t = cv2.resize(cv2.warpPerspective(tex, s @ hom, size, flags=cv2.INTER_AREA), down, interpolation=cv2.INTER_AREA)
        k = cv2.warpPerspective(np.full_like(tex, 255), s @ hom, size)
        k = cv2.resize(k, down, interpolation=cv2.INTER_AREA) / 255.
        return img * (1 - k) + t.astype(float) * k

    def finish(self, img, blur=(.5, 1.6), noise=(1, 5), light=None):
        rng = self.rng
        img = cv2.GaussianBlur(img, (0, 0), rng.uniform(*blur))
        lo, hi = light or (rng.uniform(5, 50), rng.uniform(150, 245))
        img = lo + (hi - lo) * img / 255 + rng.normal(0, rng.uniform(*noise), img.shape)
        return np.clip(img, 0, 255).astype(np.uint8)

    def size(self):
        return [(960, 720), (1280, 720), (1280, 960)][self.rng.integers(3)]

    def place(self, w, h, tex, fill, tilt, off=.2):
        rng = self.rng
        off = (rng.uniform(-off, off), rng.uniform(-off, off) * h / w, rng.uniform(0, 6.28))
        return self.pose(w, h, tex, fill, tilt, rng.choice([0, 90, 180, 270]) + rng.normal(0, 12), off)

    def cover(self, img, corners, side):
        rng = self.rng
        h, w = img.shape
        for _ in range(rng.integers(1, 4)):
            c, r, kind = corners[rng.integers(len(corners))], rng.uniform(.8, 3.5) * side, rng.integers(3)
            mask = np.zeros((h, w), np.uint8)
            if kind == 0:
                axes = (int(r), int(r * rng.uniform(.3, 1)))
                cv2.ellipse(mask, (int(c[0]), int(c[1])), axes, rng.uniform(0, 180), 0, 360, 255, -1)
            else:
                box = ((float(c[0]), float(c[1])), (float(r * 2), float(r * rng.uniform(.5, 3))), float(rng.uniform(0, 180)))
                cv2.fillPoly(mask, [cv2.boxPoints(box).astype(int)], 255)
            fill = [rng.uniform(60, 160), 250., None][kind]
            k = cv2.GaussianBlur(mask, (5, 5), 1) / 255.
            img = img * (1 - k) + (self.photo(w, h) if fill is None else fill + rng.normal(0, 4, (h, w))) * k
        return img

    def plain_scene(self, kind):
        rng = self.rng
        n, m = SIZES[rng.integers(6)]
        w, h = self.size()
        img = self.photo(w, h)
        tex, g = plain(n, m, rng.uniform(.2, 1.2))
        fill, tilt = rng.uniform(.45, .85), rng.uniform(0, 45)
        if kind == "cut":
            fill = rng.uniform(.9, 1.5)
        if kind == "tipped":
            tilt, fill = rng.uniform(58, 80), rng.uniform(.6, 1.0)
        if kind == "small":
            fill = rng.uniform(.05, .25)
        hom = self.place(w, h, tex, fill, tilt, .25 if kind == "cut" else .08)
        asked, other = (n, m), None
        sq = np.linalg.norm(g[1] - g[0])
        if kind == "two":
            h2 = self.pose(w, h, tex, fill * rng.uniform(.6, 1), rng.uniform(0, 30), rng.uniform(0, 360),
                           (rng.choice([-.45, .45]), rng.uniform(-.3, .3), rng.uniform(0, 6.28)))
            img, other = self.paste(img, tex, h2), cv2.perspectiveTransform(g[None], h2)[0]
        if kind == "adjacent":
            dx = (n + 1 + rng.integers(0, 3)) * sq * rng.choice([-1, 1])
            h2 = hom @ np.array([[1, 0, dx], [0, 1, 0], [0, 0, 1.]])
            img, other = self.paste(img, tex, h2), cv2.perspectiveTransform(g[None], h2)[0]
        img = self.paste(img, tex, hom)
        t = cv2.perspectiveTransform(g[None], hom)[0]
        side = np.median(np.linalg.norm(np.diff(t.reshape(m, n, 2), axis=1), axis=-1))
        if kind in ("covered", "cut", "two", "adjacent"):
            img = self.cover(img, t, side)
        if kind == "othersize":
            d = [(-1, 0), (0, -1), (-2, -2), (1, 1)][rng.integers(4)]
            asked = (n + d[0], m + d[1])
        if kind == "glare":
            c, r = t[rng.integers(n * m)], rng.uniform(1, 3) * side
            yy, xx = np.mgrid[0:h, 0:w]
            img = img + 500 * np.exp(-(((xx - c[0]) ** 2 + (yy - c[1]) ** 2) / r ** 2) ** 2)
        blur = {"blurred": (.25 * side, .6 * side), "soft": (1.5, .12 * side + 1.5)}.get(kind, (.5, 1.6))
        light = {"dark": (20, rng.uniform(24, 34)), "glare": (rng.uniform(5, 50), 255)}.get(kind)
        img = self.finish(np.minimum(img, 255), blur, (1, 2) if kind == "dark" else (1, 5), light)
        asked_board = f"{asked[0]}x{asked[1]}"
        truth = None if kind == "othersize" else t.tolist()
        return img, dict(board=asked_board, truth=truth, other=None if other is None else other.tolist())

    def pictured(self, kind):
        """A whole plain board as an optic, a sensor and a camera's program make it, by the words in `kind`."""
        rng, (w, h) = self.rng, (960, 720)
        n, m = SIZES[rng.integers(6)]
        tex, g = plain(n, m, rng.uniform(.4, 1.2), q=90)
        hom = self.place(w, h, tex, rng.uniform(.45, .8), rng.uniform(0, 45), .06)
        img = cv2.GaussianBlur(self.paste(self.photo(w, h), tex, hom, 4), (0, 0), .6)
        if "gauss" in kind:
            img = cv2.GaussianBlur(img, (0, 0), rng.uniform(1, 2.5))
        if "disc" in kind:
            img = cv2.filter2D(img, -1, disc(rng.uniform(1.5, 4)))
        if "motion" in kind:
            img = cv2.filter2D(img, -1, line(rng.uniform(1.5, 6), rng.uniform(0, np.pi)))
        dark, light = (20, rng.uniform(50, 80)) if "dim" in kind else (rng.uniform(20, 50), rng.uniform(150, 215))
        img = dark + (light - dark) * img / 255 + rng.normal(0, rng.uniform(1, 4), img.shape)
        if "sharpened" in kind:
            img = img + rng.uniform(.8, 2) * (img - cv2.GaussianBlur(img, (0, 0), 1.2))
        img = np.clip(np.round(img), 0, 255).astype(np.uint8)
        if "bayer" in kind:
            img = cv2.cvtColor(cv2.cvtColor(img, cv2.COLOR_BayerBG2BGR), cv2.COLOR_BGR2GRAY)
        if "jpeg" in kind:
            img = cv2.imdecode(cv2.imencode(".jpg", img, [cv2.IMWRITE_JPEG_QUALITY, int(kind[-2:])])[1], 0)
        return img, dict(board=f"{n}x{m}", truth=cv2.perspectiveTransform(g[None], hom)[0].tolist())

    def foreign(self, kind):
        rng = self.rng
        w, h = self.size()
        n, m = rng.integers(4, 11), rng.integers(4, 9)
        tex = {"circles": lambda: circles(n, m, False), "circles_asym": lambda: circles(n // 2 + 1, m + 2, True),
               "april": lambda: april(n // 2 + 2, m // 2 + 2), "charuco_as_plain": lambda: charuco(n, m)[0]}[kind]()
        img = self.paste(self.photo(w, h), tex, self.place(w, h, tex, rng.uniform(.4, .9), rng.uniform(0, 45), .1))
        size = (4, 3) if rng.random() < .4 else [(3, 3), (9, 6), (8, 6), (5, 4)][rng.integers(4)]
        return self.finish(img), dict(board=f"{size[0]}x{size[1]}", truth=None)

    def marked(self, kind):
        rng = self.rng
        w, h = self.size()
        n, m = [(5, 7), (8, 11), (7, 5), (10, 8)][rng.integers(4)]
        tex, g = charuco(n, m)
        if kind == "charuco_glued":
            n, m = [(14, 18), (19, 13)][rng.integers(2)]
            tex, g = charuco(n, m, q=40)
            extra, _ = plain(*[(6, 4), (7, 5), (8, 6)][rng.integers(3)], .3, q=24)
            y, x = (rng.integers(0, a - b) for a, b in zip(tex.shape, extra.shape))
            tex[y:y + extra.shape[0], x:x + extra.shape[1]] = extra
        hom = self.place(w, h, tex, rng.uniform(.6, 1.0), rng.uniform(0, 45), .08)
        t = cv2.perspectiveTransform(g[None], hom)[0]
        img = self.paste(self.photo(w, h), tex, hom)
        if kind == "charuco_covered":
            img = self.cover(img, t, np.linalg.norm(t[1] - t[0]))
        name = f"charuco:{n}x{m}:DICT_4X4_250"
        if kind == "charuco_none":
            img, t = self.photo(w, h), None
        if kind == "charuco_other":
            name, t = f"charuco:{n}x{m}:DICT_5X5_250", None
        return self.finish(img), dict(board=name, truth=None if t is None else t.tolist())

    def jump(self, way, missing):
        rng = self.rng
        n, m, q, w, h = 9, 6, 46, 640, 480
        back = self.photo(w, h)
        tex, g = plain(n, m, 1.0, 40)
        mid = np.array([tex.shape[1] / 2, tex.shape[0] / 2])

        def frame(x, y, covers, gone=False):
            s = q / 40
            a = np.array([[1, 0, x], [0, 1, y], [0, 0, 1.]]) @ np.array([[1, 0, 0], [0, 1, 0], [2e-4, 1e-4, 1.]])
            a = a @ np.array([[s, 0, -s * mid[0]], [0, s, -s * mid[1]], [0, 0, 1.]])
            img = back[:, ::-1].copy() if gone else self.paste(back, tex, a)
            for x0, y0, x1, y1 in covers:
                sl = np.s_[max(0, y0):max(0, y1), max(0, x0):max(0, x1)]
                img[sl] = back[::-1][sl] * .5 + 60
            img = cv2.GaussianBlur(img, (0, 0), .7) + rng.normal(0, 2, img.shape)
            return np.clip(img, 0, 255).astype(np.uint8), cv2.perspectiveTransform(g[None], a)[0].tolist()

        frames = [frame(310, 240, []) for _ in range(4)] + [frame(310, 240, [], True) for _ in range(missing)]
        x, y = 310 + way[0] * q, 240 + way[1] * q
        covers = [(0, 0, int(x - 2.3 * q), h), (int(x + 2.3 * q), 0, w, h)]
        if way[1]:
            covers += [(0, 0, w, int(y - 1.8 * q)), (0, int(y + 1.8 * q), w, h)]
        return frames + [frame(x, y, covers) for _ in range(4)]


# ---- make ---------------------------------------------------------------------------------------------------------------

def make(args):
    os.makedirs(args.folder, exist_ok=True)
    cases = []

    def add(kind, img, board, truth=None, at="-", **more):
        path = f"{args.folder}/{len(cases):05d}.pgm"
        cv2.imwrite(path, img)
        cases.append(dict(file=path, kind=kind, board=board, truth=truth, at=at, **more))

    backgrounds = []
    if args.boards:
        rows = list(csv.DictReader(open(f"{args.boards}/manifest.csv")))
        for r in rows:
            path = f"{args.boards}/{r['file']}"
            if r["has_board"] == "0":
                backgrounds.append(path)
                for board in ("9x6", "8x6", "4x3", "3x3"):
                    add("negative", cv2.imread(path, 0), board)
                add("negative_charuco", cv2.imread(path, 0), "charuco:8x11:DICT_4X4_50")
            else:
                board = f"{r['inner_cols']}x{r['inner_rows']}"
                # As stored: the truth of others is, too.
                img = cv2.imread(path, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
                add(f"real {r['set']} {r['visible']}", img, board, real=True)
        movie = [r for r in rows if r["set"] == "boof_movie"]
        for k, r in enumerate(movie):
            add("video boof_movie", cv2.imread(f"{args.boards}/{r['file']}", 0), f"{r['inner_cols']}x{r['inner_rows']}",
                at=k * 33333333 if k else "-", real=True)
    for name, board, most in (("calibration1", "9x6", 150), ("calibration2", "9x6", 150), ("SimpleAR", "8x6", 130),
                              ("Impact", "10x7", 400), ("soulgpark", "9x6", 90)):
        for path in glob.glob(f"{args.videos}/*{name}*") if args.videos else []:
            v = cv2.VideoCapture(path)
            fps = v.get(cv2.CAP_PROP_FPS) or 30
            step = max(1, int(v.get(cv2.CAP_PROP_FRAME_COUNT) // most)) if name != "Impact" else 1
            for k in range(most * step):
                ok, img = v.read()
                if not ok:
                    break
                add(f"video {name}", cv2.cvtColor(img, cv2.COLOR_BGR2GRAY), board, at=int(k * 1e9 / fps) if k else "-", real=True)
    for kind in ("whole", "covered", "cut", "two", "adjacent", "tipped", "small", "soft", "blurred", "dark", "glare", "othersize",
                 "circles", "circles_asym", "april", "charuco_as_plain", "charuco", "charuco_covered", "charuco_glued",
                 "charuco_none", "charuco_other", *PICTURED):
        scenes = Scenes(np.random.default_rng([args.seed, sum(map(ord, kind))]), backgrounds)
        for _ in range(args.count):
            make_one = scenes.foreign if kind in (*CIRCLES, "charuco_as_plain") else \
                scenes.marked if kind.startswith("charuco") else scenes.pictured if kind in PICTURED else scenes.plain_scene
            img, more = make_one(kind)
            add(kind, img, **more)
    for way in ((2, 0), (1, 1), (2.4, .3), (1, 0), (0, 2), (-2, 0)):
        for missing in (0, 2, 3):
            scenes = Scenes(np.random.default_rng([args.seed, missing]), backgrounds)
            for k, (img, truth) in enumerate(scenes.jump(way, missing)):
                at = (k + 1) * 33333333
                add("jump", img, "9x6", truth, at="-" if k == 0 else at)
    json.dump(cases, open(f"{args.folder}/cases.json", "w"))
    with open(f"{args.folder}/list", "w") as out:
        out.writelines(f"{c['board']}\t{c['at']}\t{c['file']}\n" for c in cases)
    print(len(cases), "pictures")


# ---- judge --------------------------------------------------------------------------------------------------------------

def read_table(path):
    rows = []
    for line in open(path):
        board, at, file, ms, said, *corners = line.rstrip("\n").split("\t")
        row = dict(ms=float(ms), said=said, px=None)
        if said == "found":
            row["px"] = np.array([[np.nan] * 3 if c == "-" else [float(x) for x in c.split(",")] for c in corners[0].split(" ")])
        rows.append(row)
    return rows


def verdict(case, row):
    """What was found: 'found' or 'part', 'WRONG', or None; and errors over stated sd."""
    if row["px"] is None:
        return None, None
    px = row["px"]
    seen = ~np.isnan(px[:, 0])
    what = "found" if seen.all() else "part"
    if case.get("real"):
        return what, None
    if case["truth"] is None:
        return "WRONG", None
    n, m = map(int, re.match(r"(?:charuco:)?(\d+)x(\d+)", case["board"]).groups())
    if case["board"].startswith("charuco"):
        n, m = n - 1, m - 1
    best = None
    for truth in (case["truth"], case.get("other")):
        if truth is None:
            continue
        t = np.array(truth)
        turns = [t]
        # Boards that look the same upside down may be numbered from either end; those seen as a part, by their track.
        if n % 2 == m % 2 and "charuco" not in case["board"]:
            turns.append(t[::-1])
        for turn in turns:
            off = (px[:, :2] - turn)[seen]
            worst = np.hypot(*off.T).max()
            if best is None or worst < best[0]:
                best = worst, off, px[seen, 2]
    if best[0] > WRONG_PX:
        return "WRONG", None
    return what, (best[1], best[2])


def shape(said):
    return "found" if said == "found" else re.sub(r"\{.*?cut_off_by: (None|Some\(\w+\)).*", r"\1", re.sub(r"(found|wanted): \d+, ", "", said)).split(" {")[0].strip() \
        if "cut_off_by" in said else said.split(" ")[0]


def judge(args):
    cases = json.load(open(f"{args.folder}/cases.json"))
    new = read_table(args.table)
    old = read_table(args.older) if args.older else None
    kinds = collections.OrderedDict()
    for index, (case, row) in enumerate(zip(cases, new)):
        kinds.setdefault(case["kind"], []).append((index, case, row))
    print(f"{'kind':26} {'all':>4} {'found':>5} {'part':>4} {'WRONG':>5} {'med px':>7} {'rms px':>7} {'z rms':>5} {'ms':>6}  reasons")
    total = collections.Counter()
    for kind, members in kinds.items():
        count, off, z, reasons = collections.Counter(), [], [], collections.Counter()
        for index, case, row in members:
            what, errors = verdict(case, row)
            count[what] += 1
            if what is None:
                reasons[shape(row["said"])] += 1
            if errors is not None:
                off.extend(np.hypot(*errors[0].T))
                z.extend((errors[0] / errors[1][:, None]).ravel())
            if what == "WRONG" and args.list:
                print("   wrong:", case["file"], case["board"])
        med, rms = (np.median(off), np.sqrt(np.mean(np.square(off)))) if off else (np.nan, np.nan)
        zr = np.sqrt(np.mean(np.square(np.clip(z, -5, 5)))) if z else np.nan
        ms = np.median([r["ms"] for _, _, r in members])
        why = ", ".join(f"{k} {v}" for k, v in reasons.most_common())
        print(f"{kind:26} {len(members):4} {count['found']:5} {count['part']:4} {count['WRONG']:5} {med:7.4f} {rms:7.4f} {zr:5.2f} {ms:6.2f}  {why}")
        total.update(count)
    print("total", {str(k): v for k, v in total.items()}, "ms", round(sum(r["ms"] for r in new), 1))
    if old:
        changed = collections.Counter()
        for case, a, b in zip(cases, old, new):
            before, after = verdict(case, a)[0] or shape(a["said"]), verdict(case, b)[0] or shape(b["said"])
            if before != after:
                changed[case["kind"], before, after] += 1
                if args.list:
                    print("   changed:", case["file"], case["board"], before, "->", after)
            elif a["px"] is not None and np.nanmax(np.abs(a["px"] - b["px"])) > .01:
                changed[case["kind"], "corners", "moved"] += 1
        for (kind, before, after), number in changed.items():
            print(f"changed {number:4}  {kind}: {before} -> {after}")
        print("ms", round(sum(r["ms"] for r in old), 1), "->", round(sum(r["ms"] for r in new), 1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sub = parser.add_subparsers(dest="do", required=True)
    p = sub.add_parser("make")
    p.add_argument("folder")
    p.add_argument("--boards")
    p.add_argument("--videos")
    p.add_argument("--count", type=int, default=40)
    p.add_argument("--seed", type=int, default=1)
    p = sub.add_parser("judge")
    p.add_argument("folder")
    p.add_argument("table")
    p.add_argument("older", nargs="?")
    p.add_argument("--list", action="store_true")
    args = parser.parse_args()
    make(args) if args.do == "make" else judge(args)


if __name__ == "__main__":
    main()
