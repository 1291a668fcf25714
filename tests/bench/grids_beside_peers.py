#!/usr/bin/env python3
"""Compares the detector with its peers on AprilGrids and circle grids that this script renders: OpenCV's findCirclesGrid and
ArUco detector, and the package `aprilgrid`.

usage: grids_beside_peers.py make FOLDER [--each 60] [--seed 1]
       cargo run --release -p boresight-detect --example look < FOLDER/list > table
       grids_beside_peers.py judge FOLDER table

Circles are rendered from their equations, tags from OpenCV's pictures of them, each pixel by 12 × 12 samples; tilts of 0 to 75
degrees, blur, noise, a lens that bends lines, half of the circle grids light on dark. Of each kind and tilt it prints how many
boards were found and points seen, wrong ones (more than WRONG_PX from the truth), the median error, the mean error (bias) in
pixels, and for boresight error over stated standard deviation. Needs numpy, opencv-contrib-python-headless and aprilgrid.
"""
import argparse, collections, json, os, re

import cv2
import numpy as np

WRONG_PX = 1.5
SIZE = (960, 720)
# Samples of a pixel, along each side. An edge along the pixels' rows is off by up to half a sample.
FINE = 12
BOARDS = ["circles:7x5", "circles:9x6", "acircles:4x11", "acircles:5x8", "aprilgrid:6x6", "aprilgrid:4x3"]
TILTS = [0, 15, 30, 45, 60, 70, 75]
SPACING = 0.3


def points_of(board):
    """Points in steps, row by row."""
    kind, columns, rows = re.match(r"(\w+):(\d+)x(\d+)", board).groups()
    columns, rows = int(columns), int(rows)
    if kind == "circles":
        return np.array([[x, y] for y in range(rows) for x in range(columns)], float)
    if kind == "acircles":
        return np.array([[2 * x + y % 2, y] for y in range(rows) for x in range(columns)], float)
    line = lambda k: (k // 2) * (1 + SPACING) + k % 2
    return np.array([[line(x), line(y)] for y in range(2 * rows) for x in range(2 * columns)], float)


def ink_of(board, diameter):
    """A function that says how dark places on the board are, 1 or 0."""
    if not board.startswith("aprilgrid"):
        points, step = points_of(board), 1 if board.startswith("circles") else 2
        columns, rows = int(points[:, 0].max()), int(points[:, 1].max())

        def circles(x, y):
            row = np.clip(np.round(y), 0, rows)
            shift = row % 2 if step == 2 else 0
            dark = np.zeros(x.shape, bool)
            # The nearest circle may be in the next row where rows are shifted.
            for off in (-1, 0, 1) if step == 2 else (0,):
                r = np.clip(row + off, 0, rows)
                shift = r % 2 if step == 2 else 0
                c = np.clip(np.round((x - shift) / step) * step + shift, shift, columns - (columns - shift) % step)
                dark |= (x - c) ** 2 + (y - r) ** 2 < diameter ** 2 / 4
            return dark

        return circles
    across, down = map(int, re.findall(r"\d+", board)[:2])
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    # Kalibr numbers tags from the lower left.
    cells = {(c, r): cv2.aruco.generateImageMarker(tags, (down - 1 - r) * across + c, 10, borderBits=2) < 128
             for c in range(across) for r in range(down)}
    table = np.zeros((down, across, 10, 10), bool)
    for (c, r), tag in cells.items():
        table[r, c] = tag

    def april(x, y):
        pitch = 1 + SPACING
        # The dark squares begin before the first tag.
        u, v = (x + SPACING) / pitch, (y + SPACING) / pitch
        c, r = np.floor(u).astype(int), np.floor(v).astype(int)
        du, dv = x + SPACING - c * pitch, y + SPACING - r * pitch
        in_tag = (du >= SPACING) & (dv >= SPACING) & (c >= 0) & (c < across) & (r >= 0) & (r < down)
        at = lambda d: np.clip(((d - SPACING) * 10).astype(int), 0, 9)
        tag = table[np.clip(r, 0, down - 1), np.clip(c, 0, across - 1), at(dv), at(du)]
        small = (du < SPACING) & (dv < SPACING) & (c >= 0) & (c <= across) & (r >= 0) & (r <= down)
        return np.where(in_tag, tag, small)

    return april


def picture(rng, board, tilt):
    width, height = SIZE
    points = points_of(board)
    low, high = points.min(0), points.max(0)
    middle = (low + high) / 2
    f, k1 = rng.uniform(800, 1200), rng.choice([0, -0.1, -0.25])
    centre = np.array([(width - 1) / 2, (height - 1) / 2]) + rng.uniform(-10, 10, 2)
    way, roll = rng.uniform(0, 2 * np.pi), rng.uniform(-0.6, 0.6)
    turn = cv2.Rodrigues(np.radians(tilt) * np.array([np.cos(way), np.sin(way), 0]))[0] @ cv2.Rodrigues(np.array([0, 0, roll]))[0]
    across = np.linalg.norm(high - low) + 2
    depth = f * across / (rng.uniform(0.75, 0.95) * height)
    at = np.array([rng.uniform(-0.03, 0.03) * depth, rng.uniform(-0.03, 0.03) * depth, depth])

    def px(places):
        seen = np.c_[places - middle, np.zeros(len(places))] @ turn.T + at
        n = seen[:, :2] / seen[:, 2:]
        return f * n * (1 + k1 * (n ** 2).sum(1, keepdims=True)) + centre

    diameter = rng.uniform(0.4, 0.65)
    ink = ink_of(board, diameter)
    rim = 1.0
    # Only where the board is: the corners of its sheet, with room for what the lens bends.
    sheet = px(np.array([[x, y] for x in (low[0] - rim, high[0] + rim) for y in (low[1] - rim, high[1] + rim)]))
    (left, top), (right, bottom) = (np.clip(v, 0, SIZE).astype(int) for v in (sheet.min(0) - 40, sheet.max(0) + 40))
    seen = np.full((height, width), 0.45)
    acc = np.zeros((bottom - top, right - left))
    within = (np.arange(FINE) + 0.5) / FINE - 0.5
    yy, xx = np.mgrid[top:bottom, left:right].astype(float)
    for dy in within:
        for dx in within:
            bent = np.stack([(xx + dx - centre[0]) / f, (yy + dy - centre[1]) / f], -1)
            n = bent.copy()
            for _ in range(5 if k1 else 0):
                n = bent / (1 + k1 * (n ** 2).sum(-1, keepdims=True))
            rays = np.concatenate([n, np.ones(n.shape[:2] + (1,))], -1) @ turn
            origin = -turn.T @ at
            along = -origin[2] / np.where(np.abs(rays[..., 2]) < 1e-9, 1e-9, rays[..., 2])
            x, y = (origin[k] + along * rays[..., k] + middle[k] for k in range(2))
            on = (along > 0) & (x > low[0] - rim) & (x < high[0] + rim) & (y > low[1] - rim) & (y < high[1] + rim)
            acc += np.where(on, np.where(ink(x, y), 0.1, 0.9), 0.45)
    seen[top:bottom, left:right] = acc / FINE ** 2
    if not board.startswith("aprilgrid") and rng.random() < 0.5:
        seen = 1 - seen
    seen = cv2.GaussianBlur(seen, (0, 0), rng.uniform(0.5, 1.5))
    dark, light = rng.uniform(5, 40), rng.uniform(150, 240)
    seen = dark + (light - dark) * seen + rng.normal(0, rng.uniform(1, 6), seen.shape)
    truth = px(points)
    inside = (truth > 4).all(1) & (truth < np.array(SIZE) - 5).all(1)
    return np.clip(np.round(seen), 0, 255).astype(np.uint8), truth, inside


def make(args):
    os.makedirs(args.folder, exist_ok=True)
    cases = []
    for b, board in enumerate(BOARDS):
        for t, tilt in enumerate(TILTS):
            for k in range(-(-args.each // len(TILTS))):
                image, truth, inside = picture(np.random.default_rng([args.seed, b, t, k]), board, tilt)
                path = f"{args.folder}/{len(cases):05d}.pgm"
                cv2.imwrite(path, image)
                cases.append(dict(file=path, board=board, tilt=tilt, truth=truth.tolist(), inside=inside.tolist()))
    json.dump(cases, open(f"{args.folder}/cases.json", "w"))
    with open(f"{args.folder}/list", "w") as out:
        out.writelines(f"{c['board']}\t-\t{c['file']}\n" for c in cases)
    print(len(cases), "pictures")


def turns(board, truth):
    """The numberings of the points that look the same."""
    columns, rows = map(int, re.findall(r"\d+", board)[:2])
    same = board.startswith("circles") or board.startswith("aprilgrid") or rows % 2 == 0
    return [truth, truth[::-1]] if same else [truth]


def circles_by_opencv(image, board):
    columns, rows = map(int, re.findall(r"\d+", board)[:2])
    params = cv2.SimpleBlobDetector_Params()
    params.minArea, params.maxArea, params.minDistBetweenBlobs = 20, 20000, 5
    params.filterByConvexity, params.filterByInertia = False, False
    flag = cv2.CALIB_CB_SYMMETRIC_GRID if board.startswith("circles") else cv2.CALIB_CB_ASYMMETRIC_GRID
    # The blob detector looks for dark ones.
    for picture in (image, 255 - image):
        for more in (0, cv2.CALIB_CB_CLUSTERING):
            found, centres = cv2.findCirclesGrid(picture, (columns, rows), flags=flag | more,
                                                 blobDetector=cv2.SimpleBlobDetector_create(params))
            if found:
                return centres.reshape(-1, 2)
    return None


def nearest(points, truth):
    """Offsets of points from the true ones nearest to them: numbering is forgiven."""
    return points - truth[np.linalg.norm(points[:, None] - truth[None], axis=2).argmin(1)]


def tags_by_peers(image, board, truth, tools):
    """Of each peer, the offsets of its corners from the nearest corner of the tag that it names."""
    across, down = map(int, re.findall(r"\d+", board)[:2])
    grid = truth.reshape(2 * down, 2 * across, 2)
    package, aruco = tools
    said = {"aprilgrid": [(t.tag_id, t.corners.reshape(4, 2)) for t in package.detect(image)]}
    corners, ids, _ = aruco.detectMarkers(image)
    said["cv2.aruco"] = list(zip([] if ids is None else ids.ravel(), [c.reshape(4, 2) for c in corners]))
    for name, tags in said.items():
        off = []
        for tag, quad in tags:
            if tag >= across * down:
                off.extend([[99.0, 99.0]] * 4)
                continue
            column, row = tag % across, down - 1 - tag // across
            off.extend(nearest(quad, grid[2 * row:2 * row + 2, 2 * column:2 * column + 2].reshape(4, 2)))
        yield name, np.array(off).reshape(-1, 2)


def judge(args):
    import aprilgrid

    settings = cv2.aruco.DetectorParameters()
    settings.markerBorderBits, settings.cornerRefinementMethod = 2, cv2.aruco.CORNER_REFINE_SUBPIX
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    tools = aprilgrid.Detector("t36h11"), cv2.aruco.ArucoDetector(tags, settings)
    cases = json.load(open(f"{args.folder}/cases.json"))
    rows = collections.defaultdict(list)
    for case, line in zip(cases, open(args.table)):
        said = line.rstrip("\n").split("\t")
        truth, inside = np.array(case["truth"]), np.array(case["inside"])
        kind = case["board"].split(":")[0]
        key = lambda name: (kind, case["tilt"], name)
        visible = int(inside.sum())
        off, z = np.zeros((0, 2)), np.zeros(0)
        if said[4] == "found":
            px = np.array([[np.nan] * 3 if c == "-" else [float(v) for v in c.split(",")] for c in said[5].split(" ")])
            seen = ~np.isnan(px[:, 0])
            off = min((px[seen, :2] - turn[seen] for turn in turns(case["board"], truth)), key=lambda off: np.abs(off).max())
            z = (off / px[seen, 2:]).ravel()
        rows[key("boresight")].append((off, z, visible))
        image = cv2.imread(case["file"], 0)
        if kind == "aprilgrid":
            for name, off in tags_by_peers(image, case["board"], truth, tools):
                rows[key(name)].append((off, [], visible))
        else:
            centres = circles_by_opencv(image, case["board"])
            off = np.zeros((0, 2)) if centres is None else nearest(centres, truth)
            rows[key("OpenCV")].append((off, [], visible))
    print(f"{'kind':10} {'tilt':>4} {'by':10} {'boards':>9} {'points':>13} {'wrong':>5} {'median':>7} {'rms':>7} {'bias':>6} {'z':>5}")
    totals = collections.defaultdict(list)
    for (kind, tilt, name), members in rows.items():
        totals[kind, "all", name].extend(members)
    for (kind, tilt, name), members in sorted([*rows.items(), *totals.items()], key=lambda it: (it[0][0], str(it[0][2]), str(it[0][1]))):
        off = np.concatenate([m[0] for m in members])
        far = np.linalg.norm(off, axis=1)
        good = off[far <= WRONG_PX]
        z = np.concatenate([np.asarray(m[1], float) for m in members])
        # Each picture's mean offset, whose directions differ.
        means = [np.linalg.norm(m[0].mean(0)) for m in members if len(m[0])]
        found = sum(len(m[0]) > 0 for m in members)
        print(f"{kind:10} {tilt!s:>4} {name:10} {found:4} /{len(members):4} {len(off):6} /{sum(m[2] for m in members):6} {(far > WRONG_PX).sum():5} "
              f"{np.median(far) if len(far) else np.nan:7.4f} {np.sqrt((good ** 2).sum(1).mean()) if len(good) else np.nan:7.4f} "
              f"{np.median(means) if means else np.nan:6.3f} {np.sqrt((np.clip(z, -5, 5) ** 2).mean()) if len(z) else np.nan:5.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sub = parser.add_subparsers(dest="do", required=True)
    p = sub.add_parser("make")
    p.add_argument("folder")
    p.add_argument("--each", type=int, default=60)
    p.add_argument("--seed", type=int, default=1)
    p = sub.add_parser("judge")
    p.add_argument("folder")
    p.add_argument("table")
    args = parser.parse_args()
    make(args) if args.do == "make" else judge(args)


if __name__ == "__main__":
    main()
