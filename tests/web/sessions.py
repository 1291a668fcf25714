#!/usr/bin/env python3
"""Whole sessions by the page alone, in headless Chromium whose camera is a video, and what the program makes of them.

    tests/web/sessions.py --boresight PROGRAM --page PAGE.html [--keep FOLDER] [rendered] [VIDEO:BOARD:SQUARE_MM …]

"rendered", and no name at all, is a rendered video: a simulated session, recorded. Each session is begun, watched and ended
on the page as a person does it. Its downloads are then read by the program: decisions decided again must be the same, corners
found again in the same pictures, too, and the calibration must be the page's. So must the judgements of a wrong file: alone, by
its own corners, and with its pictures. The rendered session must be GOOD, for which the page must judge enough pictures:
nothing else may keep the computer busy. Prints what it measured, and "all well".
"""

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

# Times that a video may be shown until its session is ended.
ROUNDS = 3
LONGEST_SESSION_SECS = 240


def run(*arguments, code=0):
    ended = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if code is not None and ended.returncode != code:
        sys.exit(f"{arguments}: {ended.returncode}\n{ended.stdout}\n{ended.stderr}")
    return ended.stdout


def rendered(program, folder):
    """A simulated session as a camera's video."""
    session, video = folder / "recorded", folder / "simulated.y4m"
    run(program, "simulate", "--out", session, code=None)
    pictures = str(session / "frames" / "*.png")
    run("ffmpeg", "-v", "error", "-y", "-framerate", "30", "-pattern_type", "glob", "-i", pictures, "-pix_fmt", "yuv420p", video)
    return video


def named(text):
    """A video's file, board and square in millimetres."""
    file, board, square_mm = text.rsplit(":", 2)
    return Path(file), board, square_mm


def camera_video(video, folder):
    """The video as Chromium's fake camera reads it."""
    if video.suffix in (".y4m", ".mjpeg"):
        return video
    made = folder / (video.stem + ".y4m")
    run("ffmpeg", "-v", "error", "-y", "-i", video, "-pix_fmt", "yuv420p", made)
    return made


def seconds_of(video):
    probe = run("ffprobe", "-v", "error", "-count_packets", "-select_streams", "v", "-show_entries",
                "stream=nb_read_packets,r_frame_rate", "-of", "json", video)
    stream = json.loads(probe)["streams"][0]
    over, under = map(int, stream["r_frame_rate"].split("/"))
    return int(stream["nb_read_packets"]) * under / over


def size_of(video):
    probe = run("ffprobe", "-v", "error", "-select_streams", "v", "-show_entries", "stream=width,height", "-of", "csv=p=0", video)
    return "x".join(probe.strip().split(",")[:2])


class Page:
    def __init__(self, link, video, downloads, window=(1280, 900)):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for argument in ("--headless=new", "--no-sandbox", "--mute-audio", "--hide-scrollbars", "--use-fake-ui-for-media-stream",
                         "--use-fake-device-for-media-stream", f"--use-file-for-fake-video-capture={video}",
                         "--enable-precise-memory-info", f"--window-size={window[0]},{window[1]}"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.browser = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
        self.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)})
        self.browser.get(link)

    def run(self, script):
        return self.browser.execute_script(script)

    def until(self, condition, secs=60):
        began = time.monotonic()
        while not self.run(f"return !!({condition})"):
            if time.monotonic() - began > secs:
                sys.exit(f"never: {condition}; {self.run('return [shown, JSON.stringify(live)]')} {self.browser.get_log('browser')}")
            time.sleep(0.03)
        return time.monotonic() - began

    def tap(self, element):
        self.run(f"el('{element}').click()")

    def shoot(self, file):
        if file:
            self.browser.save_screenshot(str(file))


def download(page, label, downloads, name):
    found = page.run(f"const b = [...el('files').children].find(b => b.textContent === '{label}'); if (b) b.click(); return !!b;")
    if not found:
        sys.exit(f"no file {label!r}: {page.run('return [...el(`files`).children].map(b => b.textContent)')}")
    file, began = downloads / name, time.monotonic()
    while not file.exists():
        if time.monotonic() - began > 30:
            sys.exit(f"{name} wasn't downloaded")
        time.sleep(0.05)
    return file


def memory_mb(browser):
    """Memory of every process of this browser: what several share is counted once, and mapped files (its code) not at all."""
    parents = {int(pid): int(parent) for pid, parent in (line.split() for line in run("ps", "-e", "-o", "pid=,ppid=").splitlines())}
    def is_below(pid):
        while pid in parents and pid != browser.service.process.pid:
            pid = parents[pid]
        return pid in parents
    used_kb = 0
    for pid in filter(is_below, parents):
        try:
            said = Path(f"/proc/{pid}/smaps_rollup").read_text()
        except OSError:
            # It has ended meanwhile.
            continue
        used_kb += sum(int(kb) for kb in re.findall(r"^(?:Pss_Anon|Pss_Shmem): +(\d+) kB", said, flags=re.M))
    return used_kb / 1024


def percentile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))] if values else float("nan")


# Largest share by which a number may differ, and a bound: a library searches its quantile, with the system's logarithms.
SAME, SAME_BOUND = 1e-12, 1e-9


def differs(worst):
    return any(share > (SAME_BOUND if "bound" in path else SAME) for share, path in worst)


def differences(ours, theirs, path=""):
    """Numbers that differ, as (share of their size, path)."""
    if isinstance(ours, dict) and isinstance(theirs, dict):
        for key in sorted(set(ours) | set(theirs)):
            if key not in ("session", "decisions"):
                yield from differences(ours.get(key), theirs.get(key), f"{path}/{key}")
    elif isinstance(ours, list) and isinstance(theirs, list) and len(ours) == len(theirs):
        for at, (a, b) in enumerate(zip(ours, theirs)):
            yield from differences(a, b, f"{path}/{at}")
    elif isinstance(ours, float) and isinstance(theirs, (int, float)) or isinstance(theirs, float) and isinstance(ours, int):
        # Near zero, a number is small beside one.
        yield abs(ours - theirs) / max(abs(ours), abs(theirs), 1e-3), path
    elif ours != theirs:
        yield math.inf, f"{path}: {str(ours)[:60]} and {str(theirs)[:60]}"


def session(options, link, place, video, board, square_mm, must_be_good):
    """One session on the page, and the program beside it."""
    name = video.stem[:24]
    downloads = place / name
    downloads.mkdir()
    shot = lambda what: options.keep and options.keep / f"{name}-{what}.png"
    page = Page(link, camera_video(video, place), downloads)
    page.until("ready")
    ready_secs = page.run("return performance.now() / 1000")
    page.shoot(shot("ask"))
    blocked = page.run("""
        window.blocked = [];
        addEventListener('securitypolicyviolation', e => window.blocked.push(e.effectiveDirective));
        return fetch(location.href).then(() => 'open', () => 'shut');""")
    if blocked != "shut" or page.run("return window.blocked[0]") != "connect-src":
        sys.exit(f"the page can connect: {blocked}")
    page.tap("facing")
    page.until("shown === 'wait'")
    columns, rows = board.split("x")
    page.run(f"""el('columns').value = {columns}; el('rows').value = {rows}; el('square').value = {square_mm}; el('plan').value = 'adaptive';
        el('all').checked = {str(options.all).lower()};
        const size = '{size_of(video)}', known = [...el('size').options].some(o => o.value === size);
        if (!known) el('size').add(new Option(size, size)); el('size').value = size;""")
    page.shoot(shot("start"))
    page.tap("start")
    first_secs = page.until("stats.shown > 0", 20)
    judged_secs = first_secs + page.until("stats.judged > 0", 20)
    length, began, shots = seconds_of(video), time.monotonic(), 0
    peak_mb, views = 0.0, []
    while page.run("return live.stage") == "guiding":
        passed = time.monotonic() - began
        peak_mb = max(peak_mb, memory_mb(page.browser))
        if passed > shots * length / 3 and shots < 9:
            page.shoot(shot(f"guide{shots}"))
            shots += 1
        # The camera shows its video again and again; a person would have stopped.
        if passed > min(ROUNDS * length, LONGEST_SESSION_SECS):
            page.tap("end"), page.tap("end")
            break
        time.sleep(0.25)
    lasted = time.monotonic() - began
    page.until("live.stage === 'ended' && shown === 'result'", 120)
    page.shoot(shot("result"))
    stats = page.run("return stats")
    verdict = page.run("return [ended.what, ended.lines]")
    calibration = json.loads(download(page, "Calibration", downloads, "calibration.json").read_text())
    tar = download(page, "Session", downloads, "boresight-session.tar")
    download(page, "Report", downloads, "report.html")
    log = [entry for entry in page.browser.get_log("browser") if entry["level"] == "SEVERE" and entry["source"] not in ("security", "intervention") and "Fetch API" not in entry["message"]]
    if log:
        sys.exit(f"the page complained: {log}")
    page.browser.quit()
    run("tar", "-xf", tar, "-C", downloads)
    folder = downloads / "boresight-session"
    print(f"{video.name} {size_of(video)}: {verdict[0]}")
    print(f"  ready {ready_secs:.2f} s, first picture {first_secs:.2f} s, first judged {judged_secs:.2f} s after Start")
    print(f"  {stats['shown']} shown, {stats['judged']} judged in {lasted:.1f} s: {stats['shown'] / lasted:.1f} and {stats['judged'] / lasted:.1f} a second")
    print(f"  a look takes {percentile(stats['looks'], .5):.1f} ms, p95 {percentile(stats['looks'], .95):.1f} ms; browser {peak_mb:.0f} MB")
    for line in verdict[1][:4]:
        print(f"  {line[0]}: {line[1]}")
    if must_be_good and not verdict[0].startswith("Good"):
        print("  NOT GOOD: the page judged too few pictures, or its guidance is wrong")
        options.failed = True
    beside(options, folder, calibration)


def with_own_corners(options, recorded, board, file):
    """The session's calibration with its corners, 5 % too long, as OpenCV's sample writes it."""
    made = {format: file.with_suffix("." + format) for format in ("opencv-json", "vnl")}
    for format, out in made.items():
        run(options.boresight, "export", recorded, "--format", format, "--out", out)
    tree = json.loads(made["opencv-json"].read_text())
    matrix = tree["camera_matrix"]["data"]
    matrix[0], matrix[4] = 1.05 * matrix[0], 1.05 * matrix[4]
    rows = [line.split() for line in made["vnl"].read_text().splitlines() if not line.startswith("#")]
    # A corner that wasn't found has no place.
    numbers = [float(number) if number != "-" else -1.0 for row in rows for number in row[1:3]]
    width, height = map(int, board.split("x"))
    points = {"type_id": "opencv-matrix", "rows": len(rows) // (width * height), "cols": width * height, "dt": "2f", "data": numbers}
    tree.update(nframes=points["rows"], board_width=width, board_height=height, square_size=25.0, image_points=points)
    file.write_text(json.dumps(tree))


def judgements(options, link, place, video, board, square_mm):
    """A wrong calibration, chosen alone and with its pictures: the page's answer is the program's by the same views."""
    recorded, downloads, file, own = place / "recorded", place / "judged", place / "ost.yaml", place / "own.json"
    downloads.mkdir()
    run(options.boresight, "export", recorded, "--format", "ros-yaml", "--out", file)
    longer = lambda found: f"data: [{1.05 * float(found[1])!r}, 0.0, {found[2]}, 0.0, {1.05 * float(found[3])!r},"
    text, count = re.subn(r"data: \[(\S+), 0\.0, (\S+), 0\.0, (\S+),", longer, file.read_text(), count=1)
    if not count:
        sys.exit(f"no camera matrix: {text}")
    file.write_text(text)
    with_own_corners(options, recorded, board, own)
    page = Page(link, video, downloads)
    page.until("ready")
    page.tap("facing")
    page.until("shown === 'wait'")
    columns, rows = board.split("x")
    page.run(f"el('camera').value = FILES; el('columns').value = {columns}; el('rows').value = {rows}; el('square').value = {square_mm};")
    choose = lambda files: page.browser.find_element("id", "chosen").send_keys("\n".join(map(str, files)))
    for alone, code, what, begins in (file, 3, "alone", "CAN"), (own, 4, "corners", "OFF"):
        page.tap("start")
        choose([alone])
        page.until(f"el('trouble2').textContent.startsWith('{begins}')")
        page.shoot(options.keep and options.keep / f"judgement-{what}.png")
        told = json.loads(run(options.boresight, "judge", alone, "--json", code=code))
        same(options, f"{alone.name} alone", page.run("return el('trouble2').textContent"),
             ". ".join([told["message"], told["action"].removesuffix("."), *told["doubts"]]))
    page.tap("start")
    pictures = sorted((recorded / "frames").glob("*.png"))
    chosen = [file, *pictures[:: 1 + len(pictures) // 60]]
    choose(chosen)
    page.until("live && live.stage === 'ended' && shown === 'result'", 600)
    page.shoot(options.keep and options.keep / "judgement.png")
    said = page.run("return [ended.what, ended.action]")
    run("tar", "-xf", download(page, "Session", downloads, "boresight-session.tar"), "-C", downloads)
    download(page, "Judgement", downloads, "judgement.html")
    page.browser.quit()
    told = json.loads(run(options.boresight, "judge", file, downloads / "boresight-session", "--json", code=4))
    same(options, f"{file.name} with {len(chosen) - 1} pictures", said, [told["message"], told["action"]])


def same(options, what, page, program):
    print(f"{what}: {page}")
    if page != program:
        print(f"  DIFFERS: {program}")
        options.failed = True


def beside(options, folder, calibration):
    """What the program makes of the page's session."""
    run(options.boresight, "doctor", "--session", folder) if options.doctor else None
    replayed = json.loads(run(options.boresight, "replay", folder, "--json", code=None).strip().splitlines()[-1])
    decisions = replayed["decisions"]
    print(f"  the program replays it: {decisions['different_count']} of {decisions['count']} decisions differ, {decisions['rounded']} by rounding")
    worst = sorted(differences(calibration, replayed), reverse=True)
    print(f"  its calibration.json beside the page's: largest difference {worst[0][0]:.1e} at {worst[0][1]}" if worst else "  no numbers")
    problems = decisions["different_count"] or decisions["rounded"] or differs(worst)
    if options.all:
        again = json.loads(run(options.boresight, "replay", folder, "--redetect", "--json", code=None).strip().splitlines()[-1])
        found = again["decisions"]
        worst = sorted(differences(calibration, again), reverse=True)
        print(f"  corners found again in its pictures: {found['different_count']} of {found['count']} decisions differ, {found['rounded']} by rounding; calibration {worst[0][0]:.1e} at {worst[0][1]}")
        problems = problems or found["different_count"] or found["rounded"] or differs(worst)
    if problems:
        print(f"  DIFFERS: {worst[:3]}")
        options.failed = True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boresight", type=Path, required=True)
    parser.add_argument("--page", type=Path, required=True)
    parser.add_argument("--keep", type=Path, help="folder for screenshots")
    parser.add_argument("--all", action="store_true", help="the page keeps every picture, and the program searches them again")
    parser.add_argument("--doctor", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("videos", nargs="*", metavar="VIDEO:BOARD:SQUARE_MM")
    options = parser.parse_args()
    options.failed = False
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)
        videos = [(rendered(options.boresight, place), "9x6", "25", True) if text == "rendered" else (*named(text), False)
                  for text in options.videos or ["rendered"]]
        served = subprocess.Popen([options.boresight, "web", "127.0.0.1:0", "--page", options.page], stderr=subprocess.PIPE, text=True)
        try:
            link = re.search(r"http://\S+", served.stderr.readline()).group()
            for video in videos:
                session(options, link, place, *video)
                if video[-1]:
                    judgements(options, link, place, *video[:-1])
        finally:
            served.terminate()
            served.wait()
    sys.exit("not all well") if options.failed else print("all well")


if __name__ == "__main__":
    main()
