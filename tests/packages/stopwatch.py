#!/usr/bin/env python3
"""From nothing to the first report, by the stopwatch: a table of bytes fetched, seconds until it's installed, and seconds until
the report is there. Give what you have:

    tests/packages/stopwatch.py --page target/web/boresight.html --wheel python/dist/boresight-*.whl \\
        --deb target/packages/boresight_*_amd64.deb --source .

The page gets the eight pictures of fixtures/recordings/v1/good in Chromium (needs Debian's chromium-driver and
python3-selenium); the others run `boresight demo --fast`. The wheel goes into a fresh virtual environment, the .deb onto a bare
root of Debian 12 (tests/packages/bare_roots.sh: needs root and mmdebstrap), and the source is cloned, with an empty folder of
crates, and run by `make run`. A browser, Python, Debian and a Rust toolchain are there before. Packages of Python and crates
come from wherever pip and cargo get them here.
"""

import argparse
import gzip
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PICTURES = sorted((ROOT / "fixtures/recordings/v1/good/frames").glob("*.png"))
DEMO = ["demo", "--fast", "--no-open", "--out", "shown"]


def run(*arguments, **options):
    ended = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, **options)
    if ended.returncode:
        sys.exit(f"{arguments}: {ended.returncode}\n{ended.stdout}\n{ended.stderr}")
    return ended.stdout + ended.stderr


def bytes_in(folder):
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file() and not file.is_symlink())


def is_good(place, said):
    if "Good (SIMULATED)" not in said or not (place / "shown/report.html").stat().st_size:
        sys.exit(f"no good end:\n{said}")


def page(file, place):
    """The page from a disk, with pictures; its report is downloaded."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.wait import WebDriverWait

    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for argument in ("--headless=new", "--no-sandbox", "--mute-audio"):
        options.add_argument(argument)
    began = time.monotonic()
    browser = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
    try:
        browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(place)})
        browser.get(file.resolve().as_uri())
        until = lambda what: WebDriverWait(browser, 120, 0.02).until(lambda b: b.execute_script(f"return !!({what})"))
        until("ready")
        installed = time.monotonic()
        browser.execute_script("el('facing').click()")
        until("shown === 'wait'")
        browser.execute_script("""el('camera').value = 'files';
            el('columns').value = 7; el('rows').value = 5; el('square').value = 30; el('plan').value = 'adaptive'; el('start').click()""")
        browser.find_element("id", "chosen").send_keys("\n".join(map(str, PICTURES)))
        until("live.stage === 'ended' && shown === 'result'")
        if "Good" not in browser.execute_script("return ended.what"):
            sys.exit(browser.execute_script("return JSON.stringify(ended)"))
        browser.execute_script("[...el('files').children].find(button => button.textContent === 'Report').click()")
        while not (place / "report.html").exists():
            time.sleep(0.02)
        return len(gzip.compress(file.read_bytes(), 9)), installed - began, time.monotonic() - began
    finally:
        browser.quit()


def wheel(file, place):
    began = time.monotonic()
    run(sys.executable, "-m", "venv", place / "fresh")
    run(place / "fresh/bin/pip", "install", "--quiet", "--no-cache-dir", file)
    installed = time.monotonic()
    is_good(place, run(place / "fresh/bin/boresight", *DEMO, cwd=place))
    report = time.monotonic()
    run(place / "fresh/bin/pip", "download", "--quiet", "--no-cache-dir", "--dest", place / "fetched", file)
    return bytes_in(place / "fetched"), installed - began, report - began


def deb(file, _):
    said = run(ROOT / "tests/packages/bare_roots.sh", file, env=os.environ | {"SUITES": "bookworm", "DEMO": "--fast --no-open"})
    fetched, installed, report = map(int, re.search(r"(\d+) bytes fetched, installed in (\d+) s, report after (\d+) s", said).groups())
    return fetched, installed, installed + report


def source(repository, place):
    """Cargo's settings stay, but no crate that it has. Another CARGO_TARGET_DIR must be empty."""
    crates = place / "cargo"
    crates.mkdir()
    home = pathlib.Path(os.environ.get("CARGO_HOME", pathlib.Path.home() / ".cargo"))
    for settings in ("config.toml", "config"):
        if (home / settings).exists():
            (crates / settings).write_text((home / settings).read_text())
    built = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", place / "clone/target"))
    if built.exists() and any(built.iterdir()):
        sys.exit(f"{built} isn't empty")
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    began = time.monotonic()
    run("git", "clone", "--quiet", "--depth", "1", pathlib.Path(repository).resolve().as_uri(), place / "clone")
    cloned = bytes_in(place / "clone/.git/objects")
    arguments = " ".join(DEMO[:-1] + [str(place / "shown")])
    is_good(place, run("make", "run", f"ARGS={arguments}", cwd=place / "clone", env=environment | {"CARGO_HOME": str(crates)}))
    report = time.monotonic() - began
    program = built / "release/boresight"
    installed = program.stat().st_mtime - time.time() + time.monotonic() - began
    return cloned + bytes_in(crates / "registry/cache") + bytes_in(crates / "registry/index"), installed, report


WAYS = {
    "page": (page, "a browser"),
    "wheel": (wheel, "Python"),
    "deb": (deb, "Debian 12"),
    "source": (source, "git, Rust, a C compiler"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for way in WAYS:
        parser.add_argument(f"--{way}", type=pathlib.Path)
    options = vars(parser.parse_args())
    print("| way | needs | MB fetched | ready after | report after | of the processor |\n|---|---|---|---|---|---|")
    for way, (measure, needs) in WAYS.items():
        if options[way]:
            with tempfile.TemporaryDirectory() as place:
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                fetched, installed, report = measure(options[way], pathlib.Path(place))
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
            busy = f"{after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.0f} s"
            # Most of the .deb's would be the making of its root.
            busy = "–" if way == "deb" else busy
            print(f"| {way} | {needs} | {fetched / 1e6:.1f} | {installed:.1f} s | {report:.1f} s | {busy} |", flush=True)
    print(f"load {os.getloadavg()[0]:.1f} on {len(os.sched_getaffinity(0))} cores")


if __name__ == "__main__":
    main()
