#!/usr/bin/env python3
"""Counts boards whose points the detector numbers wrongly, on pictures that are made, looked at and forgotten one by one.

usage: cargo build --release -p boresight-detect --example look
       board_identities.py LOOK --boards DIR [--count 100] [--seed 1] [--only WORD] [--keep FOLDER]

LOOK is the program that was built, DIR has a manifest.csv as detector_table.py takes it. Of each kind of picture below it makes
COUNT times the kind's share: AprilGrids, circle grids, ChArUco boards and plain boards with the code that the program prints, whole,
covered, cut off, far, blurred, noisy and tipped up to 70 degrees, turned by any angle; two of them in a picture; boards of another
size or with other markers than asked for; and plain boards without a code that jump while their ends are covered.

A board's identity is wrong if its points are, in the median, more than half the way to a neighbour from where they should be, whichever
way round the board may be held without a difference that can be seen. Of each kind it prints the pictures, boards found whole and
in part, wrong identities, boards with a right identity but a corner more than 1.5 px off, and boards found where none is as asked:
most of these are larger boards of which as much is hidden as makes them look like the one that is asked for. Pictures of the last
three are kept in FOLDER (target/wrong-identities). Needs numpy and opencv-contrib-python-headless.
"""
import argparse, collections, csv, itertools, os, shutil, subprocess, zlib

import cv2
import numpy as np

import detector_table as table
from made_boards import Pictures, Q, aprilgrid, charuco, circle_grid, coded, half_turn, plain


# ---- kinds ---------------------------------------------------------------------------------------------------------------
# Each makes a picture, the board that is asked for, and true points with their board; without any, nothing should be found.

def some_aprilgrid(rng, first=None):
    across, down = int(rng.integers(3, 9)), int(rng.integers(3, 7))
    first = [0, 0, int(rng.integers(1, 500))][rng.integers(3)] if first is None else first
    return aprilgrid(across, down, rng.choice([.3, .3, .2, .4]), first, rng.random() < .4, rng.random() < .6)


def some_circles(rng):
    diameter = rng.uniform(.4, .65)
    if rng.random() < .5:
        return circle_grid(int(rng.integers(4, 11)), int(rng.integers(4, 9)), False, diameter)
    return circle_grid(int(rng.integers(3, 7)), int(rng.integers(4, 12)), True, rng.uniform(.5, .9))


DICTIONARIES = ["DICT_4X4_50", "DICT_4X4_250", "DICT_5X5_100", "DICT_6X6_250", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"]


def some_charuco(rng, dictionary=None):
    across, down = int(rng.integers(4, 11)), int(rng.integers(4, 10))
    name = dictionary or DICTIONARIES[rng.integers(len(DICTIONARIES))]
    return charuco(across, down, name, rng.random() < .5)


def some_coded(rng):
    n, m = table.SIZES[rng.integers(6)]
    edges = [("top", "bottom"), ("top",), ("bottom",), ("left", "right")][rng.integers(4)]
    return coded(n, m, int(rng.integers(1 << 20)), edges)


def some_plain(rng):
    n, m = table.SIZES[rng.integers(6)]
    return plain(n, m, rng.uniform(.3, 1.2))


SOME = {"aprilgrid": some_aprilgrid, "circles": some_circles, "charuco": some_charuco, "coded": some_coded, "plain": some_plain}


def seen_as(family, how):
    return lambda scenes: one(scenes, SOME[family](scenes.rng), how)


def one(scenes, board, how, second=None):
    img, truths = scenes.picture(board, how, second)
    return img, board.name, truths


def mirrored_circles(scenes):
    """In a mirror, a grid looks like itself held otherwise, or like no grid: whichever points are found are circles of it."""
    board = some_circles(scenes.rng)
    img, [(t, _)] = scenes.picture(board, "plain")
    img, t = img[:, ::-1].copy(), np.stack([img.shape[1] - 1 - t[:, 0], t[:, 1]], -1)
    place = np.round((board.points - board.points.min(0)) / Q).astype(int)
    index = {tuple(p): k for k, p in enumerate(place)}
    width, height = place.max(0)
    mirrors = [lambda x, y: (width - x, y), lambda x, y: (x, height - y), lambda x, y: (y, x), lambda x, y: (width - y, height - x)]
    orders = ([index.get(mirror(*p)) for p in place] for mirror in mirrors)
    return img, board.name, [(t[order], board) for order in orders if None not in order]


def asked_otherwise(family, how="plain"):
    """Another board of the kind is asked for than is seen."""
    def make(scenes):
        rng = scenes.rng
        board = SOME[family](rng)
        kind, *rest = board.name.split(":") if ":" in board.name else ("", board.name)
        across, down = map(int, rest[0].split("x"))
        by = int(rng.choice([-1, 1]))
        if family in ("aprilgrid", "charuco"):
            across += by  # With more rows, a part would have the same markers.
        else:
            across, down = [(across + by, down), (across, down + by), (across + by, down + by)][rng.integers(3)]
        least = 4 if family == "charuco" else 3  # Squares there, points elsewhere.
        across, down = max(across, least), max(down, least)
        if {across, down} == set(map(int, rest[0].split("x"))):
            across, down = across + 1, down
        if family == "aprilgrid" and rng.random() < .5:
            across = int(rest[0].split("x")[0])
            first = int(rest[2])
            # Not by whole rows: they'd be a part of the other.
            rest[2] = str(first + int(rng.integers(1, across)))
            down = int(rest[0].split("x")[1])
        name = ":".join(([kind] if kind else []) + [f"{across}x{down}", *rest[1:]])
        img, _ = scenes.picture(board, how)
        return img, name, []
    return make


def other_kind(scenes):
    """A board of another kind than asked for, with the same markers where there are some."""
    rng = scenes.rng
    seen, asked = [(some_aprilgrid(rng, 0), some_charuco(rng, "DICT_APRILTAG_36h11")),
                   (some_charuco(rng, "DICT_APRILTAG_36h11"), some_aprilgrid(rng, 0)),
                   (some_circles(rng), some_plain(rng)), (some_plain(rng), some_circles(rng)), (some_circles(rng), some_circles(rng)),
                   (some_charuco(rng), some_plain(rng)), (some_aprilgrid(rng), some_plain(rng)),
                   (some_aprilgrid(rng), some_circles(rng))][rng.integers(8)]
    img, truths = scenes.picture(seen, "plain")
    return img, asked.name, truths if asked.name == seen.name else []


def without_its_columns(board, make):
    """Another board: one with as many columns may have the same markers in the same places."""
    while (other := make()).grid[0] == board.grid[0]:
        pass
    return other


def two_of(family, same):
    """Two boards in a picture: the same one twice, or another one of the kind."""
    def make(scenes):
        board = SOME[family](scenes.rng)
        other = board if same else without_its_columns(board, lambda: SOME[family](scenes.rng))
        return one(scenes, board, "plain", other)
    return make


def beside(family):
    """A second board of the kind beside the first, as if its pattern went on."""
    def make(scenes):
        rng = scenes.rng
        board = SOME[family](rng)
        w, h = scenes.size()
        img = scenes.photo(w, h)
        hom = scenes.pose(w, h, board.tex, rng.uniform(.3, .5), rng.uniform(0, 45), rng.uniform(0, 360),
                          (rng.uniform(-.1, .1), 0, rng.uniform(0, 6.28)))
        shift = np.eye(3)
        axis = rng.integers(2)
        extent = np.ptp(board.points[:, axis])
        shift[axis, 2] = extent + rng.integers(1, 4) * Q * rng.choice([1, 1, rng.uniform(.8, 1.2)])
        truths = []
        for at in (hom @ shift, hom):
            img = scenes.paste(img, board.tex, at)
            truths.append((cv2.perspectiveTransform(board.points[None], at)[0], board))
        return scenes.finish(img), board.name, truths
    return make


def glued(scenes):
    """A ChArUco board with a piece of another one glued onto it, or of a second copy, whose numbers count as well."""
    rng = scenes.rng
    board = some_charuco(rng)
    extra = board if rng.random() < .5 else without_its_columns(board, lambda: some_charuco(rng, board.name.split(":")[2]))
    h, w = (int(side * rng.uniform(.3, .6)) for side in np.minimum(board.tex.shape, extra.tex.shape))
    place_in = lambda tex: np.array([rng.integers(tex.shape[1] - w), rng.integers(tex.shape[0] - h)])
    (x0, y0), (x, y) = place_in(extra.tex), place_in(board.tex)
    while np.hypot(x - x0, y - y0) < 1.5 * Q:  # Nearer to its place, a copy's corners could be the board's.
        (x0, y0), (x, y) = place_in(extra.tex), place_in(board.tex)
    piece = extra.tex[y0:y0 + h, x0:x0 + w].copy()
    board.tex[y:y + h, x:x + w] = piece
    w0, h0 = scenes.size()
    img = scenes.photo(w0, h0)
    hom = scenes.place(w0, h0, board.tex, rng.uniform(.4, .9), rng.uniform(0, 50))
    truths = [(cv2.perspectiveTransform(board.points[None], hom)[0], board)]
    if extra is board:
        moved = board.points + [x - x0, y - y0]
        truths.append((cv2.perspectiveTransform(moved[None], hom)[0], board))
    return scenes.finish(scenes.paste(img, board.tex, hom)), board.name, truths


HOWS = {"aprilgrid": ["plain", "cut", "covered", "cut and covered", "tipped", "far", "blurred", "noisy", "light on dark"],
        "circles": ["plain", "cut", "covered", "row hidden", "tipped", "far", "blurred", "noisy", "light on dark"],
        "charuco": ["plain", "cut", "covered", "tipped", "far", "blurred", "noisy", "light on dark"],
        "coded": ["plain", "cut", "covered", "row hidden", "tipped"],
        "plain": ["plain", "cut", "covered", "tipped", "blurred"]}
SHARES = {"aprilgrid": 3, "circles": 3, "charuco": 1, "coded": 2, "plain": 1}


def kinds():
    """By name: share and maker."""
    for family, hows in HOWS.items():
        for how in hows:
            yield f"{family}, {how}", SHARES[family], seen_as(family, how)
        yield f"{family}, two", 1, two_of(family, True)
        yield f"{family}, another beside", 1, two_of(family, False)
        yield f"{family}, in line", 1, beside(family)
        yield f"{family}, other asked", 2, asked_otherwise(family)
        if family in ("circles", "coded", "plain"):
            yield f"{family}, other asked, covered", 1, asked_otherwise(family, "covered")
            yield f"{family}, other asked, row hidden", 1, asked_otherwise(family, "row hidden")
            yield f"{family}, other asked, cut", 1, asked_otherwise(family, "cut")
    yield "circles, mirrored", 2, mirrored_circles
    yield "charuco, glued", 2, glued
    yield "other kind", 2, other_kind


# ---- judging -------------------------------------------------------------------------------------------------------------

def judge(px, truths):
    """'right', 'corners' or 'wrong' of found points."""
    seen = ~np.isnan(px[:, 0])
    columns, rows = truths[0][1].grid
    lines = seen.reshape(rows, columns)
    has_all_ends = lines[[0, -1]].any(1).all() and lines[:, [0, -1]].any(0).all()
    # A plain board of which all ends are seen may be held either way round, whatever its code says.
    may_turn = truths[0][1].is_plain and columns % 2 == rows % 2 and has_all_ends
    turns = [half_turn(len(px))] if may_turn else []
    best = ("wrong", np.inf)
    for t, board in truths:
        if len(px) != len(t):
            continue
        apart = np.linalg.norm(t[:, None] - t[None], axis=2) + np.where(np.eye(len(t)), np.inf, 0)
        step = apart.min(1)
        for order in board.orders + turns:
            off = np.linalg.norm(px[:, :2] - t[order], axis=1)
            share = np.median((off / step[order])[seen])
            if share < best[1]:
                what = "wrong" if share > .5 else "corners" if off[seen].max() > table.WRONG_PX else "right"
                best = what, share
    return best[0]


class Look:
    """The detector's example as a process that answers line by line."""

    def __init__(self, program):
        self.process = subprocess.Popen([program, "1"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def at(self, path, board, time="-"):
        self.process.stdin.write(f"{board}\t{time}\t{path}\n")
        self.process.stdin.flush()
        said = self.process.stdout.readline().rstrip("\n").split("\t")
        assert len(said) > 4, (board, path, said)
        if said[4] != "found":
            return None, said[4]
        return np.array([[np.nan] * 3 if c == "-" else [float(v) for v in c.split(",")] for c in said[5].split(" ")]), said[4]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("look")
    parser.add_argument("--boards", required=True)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--keep", default="target/wrong-identities")
    args = parser.parse_args()
    os.makedirs(args.keep, exist_ok=True)
    path = f"/dev/shm/board-identities-{os.getpid()}.pgm"
    backgrounds = []
    for r in csv.DictReader(open(f"{args.boards}/manifest.csv")):
        if r["has_board"] == "0":
            b = cv2.imread(f"{args.boards}/{r['file']}", 0)
            s = min(1, 1300 / b.shape[1])
            backgrounds.append(cv2.resize(b, None, fx=s, fy=s, interpolation=cv2.INTER_AREA))
    look = Look(args.look)
    cv2.setNumThreads(1)
    total = collections.Counter()
    columns = ("pictures", "whole", "part", "wrong", "corners", "not there")
    print(f"{'kind':36}" + "".join(f"{name:>10}" for name in columns), flush=True)

    def line(name, count):
        print(f"{name:36}" + "".join(f"{count[column]:10}" for column in columns), flush=True)

    def tell(what, count, name, index, asked, path):
        count[what] += 1
        if what in ("wrong", "not there", "corners"):
            kept = f"{args.keep}/{name.replace(', ', '-').replace(' ', '_')}-{args.seed}-{index}.pgm"
            shutil.copy(path, kept)
            print(f"   {what}: {asked} in {kept}", flush=True)

    for name, share, make in kinds():
        if args.only not in name:
            continue
        count = collections.Counter()
        for index in range(args.count * share):
            scenes = Pictures(np.random.default_rng([args.seed, index, zlib.crc32(name.encode())]), backgrounds)
            img, asked, truths = make(scenes)
            cv2.imwrite(path, img)
            px, _ = look.at(path, asked)
            count["pictures"] += 1
            if px is None:
                continue
            count["part" if np.isnan(px[:, 0]).any() else "whole"] += 1
            tell(judge(px, truths) if truths else "not there", count, name, index, asked, path)
        line(name, count)
        total.update(count)
    if args.only in "jumps":
        count = collections.Counter()
        ways = list(itertools.product(((2, 0), (1, 1), (2.4, .3), (1, 0), (0, 2), (-2, 0), (3, 0), (0, -1)), (0, 1, 2, 3)))
        for index in range(args.count * 2):
            scenes = Pictures(np.random.default_rng([args.seed, index]), backgrounds)
            for k, (img, truth) in enumerate(scenes.jump(*ways[index % len(ways)])):
                cv2.imwrite(path, img)
                px, _ = look.at(path, "9x6", "-" if k == 0 else (k + 1) * 33333333)
                count["pictures"] += 1
                if px is None:
                    continue
                count["part" if np.isnan(px[:, 0]).any() else "whole"] += 1
                tell(judge(px, [(np.array(truth), plain(9, 6))]), count, f"jumps-{k}", index, "9x6", path)
        line("jumps", count)
        total.update(count)
    line("all", total)
    look.process.stdin.close()
    if os.path.exists(path):
        os.remove(path)


if __name__ == "__main__":
    main()
