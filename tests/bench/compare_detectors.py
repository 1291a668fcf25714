#!/usr/bin/env python3
"""Compares `boresight detect` with OpenCV's detectors on the same pictures, in one run.

usage: compare_detectors.py --boresight target/release/boresight SET... [--opencv cbc_half,sb_ea] [--limit N] [--list-misses]

A SET is a folder with truth.json (pictures with known corners: a list of {file, cols, rows, uv, noise, blur, motion}),
a manifest.csv (real pictures: file, set, inner_cols, inner_rows, has_board, visible), or a folder of pictures
without a board. Needs numpy and opencv-python-headless.
"""
import argparse, collections, csv, json, os, resource, statistics, subprocess, sys, time

import cv2
import numpy as np

FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
# A corner this far from the truth makes the board a wrong one.
WRONG_PX = 3.0
# Over so many looks at a picture the processor's time is taken. For all contestants it includes reading the file.
REPEATS = 4


def refine(image, corners, cols, rows):
    grid = corners.reshape(rows, cols, 2)
    side = min(np.linalg.norm(np.diff(grid, axis=a), axis=-1).min() for a in (0, 1))
    half = int(np.clip(round(side * 0.35), 2, 11))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.001)
    return cv2.cornerSubPix(image, corners, (half, half), (-1, -1), stop)


def opencv(variant, image, cols, rows):
    size = (cols, rows)
    if variant == "cbc":
        ok, corners = cv2.findChessboardCorners(image, size, None, FLAGS)
        return refine(image, corners, cols, rows) if ok else None
    if variant == "cbc_half":
        k = max(1, round(max(image.shape) / 960))
        small = image
        if k > 1:
            small = cv2.resize(image, (image.shape[1] // k, image.shape[0] // k), interpolation=cv2.INTER_AREA)
        ok, corners = cv2.findChessboardCorners(small, size, None, FLAGS)
        return refine(image, ((corners + 0.5) * k - 0.5).astype(np.float32), cols, rows) if ok else None
    if variant == "sb_ea":
        ok, corners = cv2.findChessboardCornersSB(image, size, None, cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY)
        return corners if ok else None
    sys.exit(f"no OpenCV variant {variant!r}")


def read_and_find(variant, path, cols, rows):
    return opencv(variant, cv2.imread(path, cv2.IMREAD_GRAYSCALE), cols, rows)


def run_opencv(variant, p):
    """Corners, None, milliseconds of the processor, reason."""
    times = []
    for _ in range(REPEATS):
        began = time.process_time()
        corners = read_and_find(variant, p["path"], p["cols"], p["rows"])
        times.append((time.process_time() - began) * 1e3)
    return None if corners is None else corners.reshape(-1, 2).astype(float), None, statistics.mean(times), ""


def run_program(program, p, times):
    """What it prints when given the picture so often, and its milliseconds of the processor."""
    command = [program, "detect", "--json", "--board", f"{p['cols']}x{p['rows']}", *[p["path"]] * times]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = subprocess.run(command, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return output, (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) * 1e3


def run_boresight(program, p):
    """Corners, their standard deviations, milliseconds of the processor, reason. The program's start isn't counted."""
    _, once = run_program(program, p, 1)
    output, often = run_program(program, p, 1 + REPEATS)
    if not output.strip():
        sys.exit(f"{program} finds nothing to read in {p['path']}")
    d = json.loads(output.splitlines()[0])
    corners = sigma = None
    if d["found"]:
        # Corners that aren't seen are NaN.
        corners, sigma = np.full((p["rows"] * p["cols"], 2), np.nan), np.full(p["rows"] * p["cols"], np.nan)
        for column, row, x, y, sd in d["corners"]:
            corners[row * p["cols"] + column], sigma[row * p["cols"] + column] = (x, y), sd
    return corners, sigma, max(often - once, 0.0) / REPEATS, d["reason"] or ""


def run_all(program, variants, pictures):
    """Contestant -> path -> result. One picture after the other, so that whatever else the machine does hits all alike."""
    cv2.setNumThreads(1)
    results = {who: {} for who in ["boresight", *variants]}
    for p in pictures:
        for who in results:
            results[who][p["path"]] = run_boresight(program, p) if who == "boresight" else run_opencv(who, p)
    return results


def align(corners, truth, cols, rows):
    """Corners in the order of the truth that fits best: detectors may number from another end, but never mirrored."""
    grid = np.asarray(corners).reshape(rows, cols, 2)
    choices = [grid, grid[::-1, ::-1]]
    if cols == rows:
        choices += [np.rot90(grid, k) for k in (1, 3)]
    flat = [c.reshape(-1, 2) for c in choices]
    return min(flat, key=lambda c: np.nanmax(np.abs(c - truth)))


def disagreements(pictures, all_results):
    """Boards on which another detector puts a corner more than WRONG_PX from boresight's. Somebody is wrong."""
    for who, results in all_results.items():
        if who == "boresight":
            continue
        both = odd = 0
        lines = []
        for p in pictures:
            ours, theirs = all_results["boresight"][p["path"]][0], results[p["path"]][0]
            if ours is None or theirs is None:
                continue
            both += 1
            off = np.abs(align(theirs, ours, p["cols"], p["rows"]) - ours).max(axis=1)
            if np.nanmax(off) > WRONG_PX:
                odd += 1
                lines.append(f"     DISAGREE {p['path']}: {(off > WRONG_PX).sum()} corners, {np.nanmax(off):.1f} px at most")
        print(f"  {who:10} disagrees with boresight by more than {WRONG_PX:g} px on {odd} of {both} boards")
        print("\n".join(lines), end="\n" if lines else "")


def load(name):
    """Kind of the set, and its pictures."""
    if name.endswith(".csv"):
        root = os.path.dirname(name)
        rows = [r for r in csv.DictReader(open(name))]
        return "real", [
            dict(path=os.path.join(root, r["file"]), set=r["set"], cols=int(r["inner_cols"] or 0) or 9, rows=int(r["inner_rows"] or 0) or 6,
                 board=r["has_board"] == "1", visible=r["visible"])
            for r in rows
        ]
    if os.path.exists(os.path.join(name, "truth.json")):
        root = os.path.dirname(os.path.abspath(name))
        return "truth", [dict(p, path=os.path.join(root, os.path.basename(name.rstrip("/")), os.path.basename(p["file"])))
                         for p in json.load(open(os.path.join(name, "truth.json")))]
    files = sorted(f for f in os.listdir(name) if f.lower().endswith((".png", ".jpg", ".jpeg")))
    return "none", [dict(path=os.path.join(name, f), cols=9, rows=6, board=False) for f in files]


def times(results, pictures):
    by_size = collections.defaultdict(list)
    for p in pictures:
        width = p.get("w") or cv2.imread(p["path"], cv2.IMREAD_GRAYSCALE).shape[1]
        by_size[width].append(results[p["path"]][2])
    return "  ".join(f"{w}: {np.median(t):.1f} ({max(t):.1f})" for w, t in sorted(by_size.items()))


def report_truth(name, pictures, all_results, list_misses):
    print(f"\n{name}: {len(pictures)} pictures with a known board")
    errors = {}
    for who, results in all_results.items():
        errors[who] = {}
        wrong = []
        for p in pictures:
            corners = results[p["path"]][0]
            if corners is None:
                continue
            truth = np.array(p["uv"])
            aligned = align(corners, truth, p["cols"], p["rows"])
            worst = np.nanmax(np.abs(aligned - truth))
            if worst > WRONG_PX:
                wrong.append((p["path"], worst))
            else:
                errors[who][p["path"]] = aligned - truth
        parts = sum(np.isnan(e).any() for e in errors[who].values())
        print(f"  {who:10} found {len(errors[who]) / len(pictures):6.1%}, {parts} of them in part  wrong {len(wrong)}  ms by width, median (max): {times(results, pictures)}")
        for path, worst in wrong:
            print(f"     WRONG {path}: {worst:.1f} px")
        if list_misses and who == "boresight":
            for p in pictures:
                if p["path"] not in errors[who] and results[p["path"]][0] is None:
                    print(f"     miss {p['path']} {p['cols']}x{p['rows']} noise {p['noise']} blur {p['blur']} motion {p['motion']:.1f} light {p['illum']} square {p['mind']:.0f} tilt {p['tilt']:.0f}: {results[p['path']][3]}")
    rest = [set(e) for who, e in errors.items() if who != "boresight"]
    if rest:
        print(f"  {'any OpenCV':10} found {len(set.union(*rest)) / len(pictures):6.1%}")
    common = set.intersection(*(set(e) for e in errors.values()))
    for who, e in errors.items():
        off = np.concatenate([e[path] for path in common]) if common else np.zeros((1, 2))
        length = np.linalg.norm(off[~np.isnan(off).any(axis=1)], axis=1)
        print(f"  {who:10} corner error on {len(common)} common: median {np.median(length):.4f}  rms {np.sqrt(np.mean(length**2)):.4f} px")
    ours = all_results["boresight"]
    classes = collections.defaultdict(list)
    for p in pictures:
        if p["path"] in errors["boresight"]:
            sigma = ours[p["path"]][1]
            ratio = (errors["boresight"][p["path"]] / sigma[:, None]) ** 2
            for label in (f"noise {p['noise']:g}", f"blur {p['blur']:g}", "motion" if p["motion"] > 0.5 else "no motion", f"width {p['w']}"):
                classes[label].append(ratio.mean(axis=1))
    print("  normalised error variance, mean (robust: by the median):")
    for label in sorted(classes):
        r = np.concatenate(classes[label])
        r = r[~np.isnan(r)]
        print(f"     {label:12} {r.mean():6.2f} ({np.median(r) / 0.693:5.2f})  {len(r)} corners")


def is_whole(result):
    return result[0] is not None and not np.isnan(result[0]).any()


def report_real(name, pictures, all_results, list_misses):
    full = [p for p in pictures if p["board"] and p["visible"] == "full"]
    print(f"\n{name}: {len(full)} fully visible boards")
    sets = sorted({p["set"] for p in full})
    for s in sets:
        mine = [p for p in full if p["set"] == s]
        print(f"  {s:16} " + "  ".join(f"{who} {sum(r[p['path']][0] is not None for p in mine)}/{len(mine)}" for who, r in all_results.items()))
    if list_misses:
        for p in full:
            if all_results["boresight"][p["path"]][0] is None:
                print(f"     miss {p['path']} {p['cols']}x{p['rows']}: {all_results['boresight'][p['path']][3]}")
    for who, results in all_results.items():
        print(f"  {who:10} all {sum(results[p['path']][0] is not None for p in full)}/{len(full)}  ms by width: {times(results, full)}")
    disagreements(full, all_results)
    # Reprojection with OpenCV's own solver, on the frames that all found.
    ratios = []
    for s in sets:
        mine = [p for p in full if p["set"] == s and all(is_whole(r[p["path"]]) for r in all_results.values())]
        if len(mine) < 6:
            continue
        rms = {}
        for who, results in all_results.items():
            board, seen = [], []
            for p in mine:
                gx, gy = np.meshgrid(np.arange(p["cols"]), np.arange(p["rows"]))
                board.append(np.stack([gx, gy, 0 * gx], -1).reshape(-1, 3).astype(np.float32))
                seen.append(results[p["path"]][0].astype(np.float32).reshape(-1, 1, 2))
            shape = cv2.imread(mine[0]["path"], cv2.IMREAD_GRAYSCALE).shape[::-1]
            # Five coefficients describe no fisheye lens; their misfit would hide the corners' own errors.
            flags = cv2.CALIB_RATIONAL_MODEL if "fisheye" in s else 0
            rms[who] = cv2.calibrateCamera(board, seen, shape, None, None, flags=flags)[0]
        print(f"  {s:16} {len(mine):3} frames, reprojection rms " + "  ".join(f"{who} {v:.4f}" for who, v in rms.items()))
        ratios.append({who: v / rms["boresight"] for who, v in rms.items()})
    for who in all_results:
        if ratios and who != "boresight":
            print(f"  boresight's rms is {np.exp(-np.mean([np.log(r[who]) for r in ratios])):.3f} of {who}'s (geometric mean of {len(ratios)} sets)")
    report_none(name, [p for p in pictures if not p["board"]], all_results)
    cut = [p for p in pictures if p["board"] and p["visible"] != "full"]
    if cut:
        print("  partly visible: " + "  ".join(f"{who} returned {sum(r[p['path']][0] is not None for p in cut)}/{len(cut)}" for who, r in all_results.items()))


def report_none(name, pictures, all_results):
    if not pictures:
        return
    print(f"\n{name}: {len(pictures)} pictures without a board")
    for who, results in all_results.items():
        false = [p["path"] for p in pictures if results[p["path"]][0] is not None]
        print(f"  {who:10} false finds {len(false)}  ms by width: {times(results, pictures)}")
        for path in false:
            print(f"     FALSE {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+")
    parser.add_argument("--boresight", default="target/release/boresight")
    parser.add_argument("--opencv", default="")
    parser.add_argument("--limit", type=int)
    parser.add_argument("--list-misses", action="store_true")
    arguments = parser.parse_args()
    for name in arguments.sets:
        kind, pictures = load(name)
        pictures = pictures[: arguments.limit]
        variants = [variant for variant in arguments.opencv.split(",") if variant]
        all_results = run_all(arguments.boresight, variants, pictures)
        if kind == "truth":
            report_truth(name, pictures, all_results, arguments.list_misses)
        elif kind == "real":
            report_real(name, pictures, all_results, arguments.list_misses)
        else:
            report_none(name, pictures, all_results)


if __name__ == "__main__":
    main()
