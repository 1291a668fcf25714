#!/usr/bin/env python3
"""500 sessions, one in 20 broken: one program alone, two that share one folder of results, one that's killed twice, and a
byte that flips. The table is the same bytes each time, and each session is worked on once.

usage: two_runners.py --boresight target/release/boresight [--sessions 500] [--action replay]
"""
import argparse, json, os, pathlib, shutil, subprocess, sys, tempfile, time

RECORDINGS = pathlib.Path(__file__).resolve().parents[2] / "fixtures/recordings/v1"
KINDS = ("good", "focus-moved")
EACH_BROKEN = 20
# Lines of each journal: as a session that a power cut ended soon, so that all of it takes minutes.
LINES = 40


def made(root, count):
    for number in range(count):
        session = root / f"s{number:04}"
        shutil.copytree(RECORDINGS / KINDS[number % len(KINDS)], session)
        journal = session / "journal.jsonl"
        text = b"".join(journal.read_bytes().splitlines(keepends=True)[:LINES])
        journal.write_bytes(text)
        # A picture without its line would tell that lines are missing.
        shutil.rmtree(session / "frames")
        (session / "frames").mkdir()
        if number % EACH_BROKEN == 0:
            (session / "session.toml").write_text("nonsense")


class Runner:
    """`batch run` with one job; the sessions that it worked on are read from its log."""

    def __init__(self, program, manifest, action, out):
        words = [program, "batch", "run", manifest, "--action", action, "--out", out, "--jobs", "1", "--log", "json"]
        self.log = tempfile.TemporaryFile("w+")
        self.began = time.monotonic()
        self.child = subprocess.Popen(list(map(str, words)), stdout=subprocess.DEVNULL, stderr=self.log)

    def sessions(self):
        self.log.seek(0)
        lines = [line for line in self.log.read().split("\n")[:-1] if line.startswith("{")]
        return [event["session"] for event in map(json.loads, lines) if event["event"] == "row"]

    def ended(self):
        """Exit code, wall time, and the processor's time of it and of its workers, in seconds."""
        _, status, used = os.wait4(self.child.pid, 0)
        self.child.returncode = os.waitstatus_to_exitcode(status)
        return self.child.returncode, time.monotonic() - self.began, used.ru_utime + used.ru_stime

    def killed_after(self, count):
        while len(self.sessions()) < count:
            assert os.waitid(os.P_PID, self.child.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None, "it has ended before"
            time.sleep(0.05)
        self.child.kill()
        self.ended()
        return self.sessions()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boresight", default="target/release/boresight")
    parser.add_argument("--sessions", type=int, default=500)
    parser.add_argument("--action", default="replay")
    arguments = parser.parse_args()
    program, count = pathlib.Path(arguments.boresight).resolve(), arguments.sessions
    place = tempfile.TemporaryDirectory()
    root = pathlib.Path(place.name)
    made(root / "sessions", count)

    def said(*words, codes=(0,)):
        ended = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
        assert ended.returncode in codes, ended.stderr
        return ended.stdout

    def planned(name):
        (root / name).write_text(said("batch", "plan", root / "sessions"))
        return root / name

    manifest = planned("manifest.jsonl")
    gathered = lambda out: said("batch", "gather", root / out)
    told = lambda what, *numbers: print(f"{what:34}", *numbers, flush=True)

    runner = lambda out, listed=manifest: Runner(program, listed, arguments.action, root / out)
    alone = runner("alone")
    code, wall_alone, processor = alone.ended()
    table = gathered("alone")
    codes = [json.loads(row)["code"] for row in table.splitlines()]
    assert code == 0 and len(codes) == len(set(alone.sessions())) == count
    assert codes.count("OK") == count - len(range(0, count, EACH_BROKEN)), {code: codes.count(code) for code in codes}
    told("one runner", f"{count} sessions, {wall_alone:.1f} s, processor {processor:.1f} s;", {code: codes.count(code) for code in sorted(set(codes))})

    pair = [runner("shared") for _ in range(2)]
    ends = [one.ended() for one in pair]
    worked = [one.sessions() for one in pair]
    assert all(code == 0 for code, _, _ in ends)
    assert len(worked[0]) + len(worked[1]) == count == len(set(worked[0] + worked[1])), "a session was worked on twice, or never"
    assert gathered("shared") == table, "another table"
    wall = max(wall for _, wall, _ in ends)
    told("two runners", f"{len(worked[0])} + {len(worked[1])} sessions, none twice, {wall:.1f} s = {wall / wall_alone:.2f} of one; processor {ends[0][2]:.1f} + {ends[1][2]:.1f} s; same table")

    before = []
    for part in (count // 5, count // 3):
        before += runner("killed").killed_after(part)
    last = runner("killed")
    assert last.ended()[0] == 0
    all_worked = before + last.sessions()
    assert set(all_worked) == {json.loads(line)["session"] for line in manifest.read_text().splitlines()}
    # What was stored, but not said any more, isn't in a log; nothing is there twice but what a kill interrupted.
    assert len(all_worked) - len(set(all_worked)) <= 2 and gathered("killed") == table
    told("killed twice by SIGKILL", f"{len(before)} before, {len(last.sessions())} after, {len(all_worked) - len(set(all_worked))} twice; same table")

    flipped = root / "sessions/s0007/journal.jsonl"
    content = bytearray(flipped.read_bytes())
    content[len(content) // 2] ^= 1
    flipped.write_bytes(content)
    again = planned("again.jsonl")
    old, new = (set(path.read_text().splitlines()) for path in (manifest, again))
    assert len(new - old) == 1 and "s0007" in next(iter(new - old))
    assert said("batch", "plan", root / "sessions") == again.read_text()
    rerun = runner("shared", again)
    assert rerun.ended()[0] == 0
    (session,) = rerun.sessions()
    assert session.endswith("s0007")
    told("a byte flipped in a journal", f"1 other item of {count}, only that worked on again")


sys.exit(main())
