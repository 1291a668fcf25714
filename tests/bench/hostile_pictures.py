#!/usr/bin/env python3
"""Writes pictures without the board: noise, blinds, bricks, tiles, lattices of up to 100x100 squares, text, and
scraps of photographs if there are any.

usage: hostile_pictures.py OUT [--count 2000] [--size 1920x1080] [--photographs DIR] [--seed 1]

For compare_detectors.py, which takes a folder of pictures as pictures without a board. Needs numpy and
opencv-python-headless.
"""
import argparse, glob, os

import cv2
import numpy as np


def turned(rng, texture, w, h):
    """The texture in perspective, filling the picture."""
    s = max(texture.shape)
    angle, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(-0.25, 0.25, 2) / s
    c, n = np.cos(angle), np.sin(angle)
    zoom = rng.uniform(0.7, 1.6) * max(w, h) / s
    m = np.array([[1, 0, w / 2], [0, 1, h / 2], [0, 0, 1]]) @ np.array([[c * zoom, -n * zoom, 0], [n * zoom, c * zoom, 0], [*tilt, 1]])
    m = m @ np.array([[1, 0, -texture.shape[1] / 2], [0, 1, -texture.shape[0] / 2], [0, 0, 1]])
    return cv2.warpPerspective(texture, m, (w, h), flags=cv2.INTER_AREA, borderMode=cv2.BORDER_WRAP)


def noise(rng, w, h, _):
    sigma, k = rng.uniform(10, 90), int(rng.integers(1, 9))
    small = rng.normal(128, sigma, (h // k + 1, w // k + 1))
    return cv2.resize(small, (w, h), interpolation=rng.choice([cv2.INTER_NEAREST, cv2.INTER_LINEAR]))


def blinds(rng, w, h, _):
    period, duty = rng.uniform(4, 60), rng.uniform(0.2, 0.8)
    x = np.arange(1200) / period % 1 < duty
    return turned(rng, np.where(x[None, :], 210.0, 50.0) * np.ones((1200, 1)), w, h)


def bricks(rng, w, h, _):
    bw, bh, joint = rng.integers(20, 90), rng.integers(10, 45), rng.integers(1, 6)
    y, x = np.mgrid[0:1200, 0:1200]
    row = y // bh
    return turned(rng, np.where((y % bh < joint) | ((x + row % 2 * bw // 2) % bw < joint), 210.0, 110.0 + rng.normal(0, 20)), w, h)


def tiles(rng, w, h, _):
    side = rng.integers(8, 60)
    y, x = np.mgrid[0:1200, 0:1200]
    shades = rng.uniform(30, 230, (200, 200))
    return turned(rng, shades[y // side, x // side], w, h)


def lattice(rng, w, h, _):
    n = int(rng.integers(12, 101))
    side = max(4, 1600 // n)
    y, x = np.mgrid[0 : n * side, 0 : n * side]
    return turned(rng, np.where((x // side + y // side) % 2 == 0, 40.0, 215.0), w, h)


def text(rng, w, h, _):
    page = np.full((1000, 1000), 230, np.uint8)
    for y in range(20, 1000, 26):
        letters = "".join(chr(c) for c in rng.integers(33, 127, 70))
        cv2.putText(page, letters, (5, y), int(rng.integers(0, 8)), rng.uniform(0.5, 1.0), 20, int(rng.integers(1, 3)))
    return turned(rng, page.astype(float), w, h)


def scraps(rng, w, h, photographs):
    if not photographs:
        return tiles(rng, w, h, photographs)
    out, n = np.zeros((h, w)), int(rng.integers(1, 5))
    for j in range(n):
        for i in range(n):
            picture = photographs[rng.integers(len(photographs))]
            x0, x1, y0, y1 = i * w // n, (i + 1) * w // n, j * h // n, (j + 1) * h // n
            share = rng.uniform(0.3, 1.0)
            ch, cw = int(picture.shape[0] * share), int(picture.shape[1] * share)
            oy, ox = rng.integers(0, picture.shape[0] - ch + 1), rng.integers(0, picture.shape[1] - cw + 1)
            piece = np.rot90(picture[oy : oy + ch, ox : ox + cw], rng.integers(0, 4))[:, :: rng.choice([-1, 1])]
            out[y0:y1, x0:x1] = cv2.resize(np.ascontiguousarray(piece), (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)
    return (out - 128) * rng.uniform(0.6, 1.5) + 128


KINDS = [scraps, noise, blinds, bricks, tiles, lattice, text, scraps]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--photographs", help="folder of pictures without a board, searched recursively")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    w, h = map(int, arguments.size.split("x"))
    found = sorted(glob.glob(f"{arguments.photographs}/**/*.*", recursive=True)) if arguments.photographs else []
    photographs = [p for p in (cv2.imread(f, cv2.IMREAD_GRAYSCALE) for f in found if f.lower().endswith((".jpg", ".jpeg", ".png"))) if p is not None]
    os.makedirs(arguments.out, exist_ok=True)
    for k in range(arguments.count):
        rng = np.random.default_rng([arguments.seed, k])
        kind = KINDS[k % len(KINDS)]
        picture = kind(rng, w, h, photographs).astype(float)
        blur = rng.choice([0, 0, 0.8, 2.0])
        picture = cv2.GaussianBlur(picture, (0, 0), blur) if blur else picture
        picture += rng.normal(0, rng.choice([0.0, 2.0, 8.0]), picture.shape)
        name = f"{arguments.out}/{kind.__name__}_{k:05}.png"
        cv2.imwrite(name, np.clip(np.rint(picture), 0, 255).astype(np.uint8), [cv2.IMWRITE_PNG_COMPRESSION, 1])


if __name__ == "__main__":
    main()
