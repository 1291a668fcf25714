"""What others build on: boards, reports, batches and histories from Python; a notebook; strict types."""

import json
import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import boresight
from conftest import RECORDINGS, REPOSITORY

cv2 = pytest.importorskip("cv2", reason="reads the pictures of the tests")


def test_a_board_is_written_to_print(program, tmp_path):
    told = boresight.target(tmp_path / "board.pdf", "9x6", paper="A3")
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF") and told["paper"] == "a3"
    said = program("target", "--board", "9x6", "--paper", "a3", "--json", "--out", tmp_path / "own.pdf")
    assert {**told, "file": "", "id": ""} == {**said, "file": "", "id": ""}
    exact = boresight.target(tmp_path / "b.png", "charuco:5x7:DICT_4X4_50:15mm", square_mm=20)
    assert exact["board"]["square_mm"] == 20 and exact["board"]["marker_mm"] == pytest.approx(15)
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.target(tmp_path / "board.pdf")
    assert caught.value.code == "FILE-EXISTS"
    for wrong in (lambda: boresight.target(tmp_path / "b.docx"), lambda: boresight.target(tmp_path / "c.pdf", paper="b5")):
        with pytest.raises(boresight.ArgumentError):
            wrong()
    with pytest.raises(boresight.BoresightError, match="not fit"):
        boresight.target(tmp_path / "d.pdf", "9x6", square_mm=100)


def test_a_printed_board_is_found_again(tmp_path):
    told = boresight.target(tmp_path / "board.png", "7x5")
    image = cv2.imread(str(tmp_path / "board.png"), 0)
    found = boresight.detect(cv2.resize(image, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA), "7x5")
    assert found
    # 300 pixels per inch, a quarter of them.
    side_px = np.linalg.norm(found.corners_px[1] - found.corners_px[0])
    assert side_px == pytest.approx(told["board"]["square_mm"] * 300 / 25.4 / 4, rel=1e-3)


def test_a_board_is_planned(program):
    plan = boresight.plan_board(0.5, fov_deg=60)
    assert plan == program("plan-board", "--distance", "50cm", "--fov", "60deg", "--json")
    assert plan["smallest"] in ("A4", "A3", "Letter")
    far = boresight.plan_board(8, fov_deg=60)
    assert far["smallest"] is None and far["filling"]["square_mm"] > plan["filling"]["square_mm"]
    assert plan["enough"]["square_mm"] < far["enough"]["square_mm"] < far["filling"]["square_mm"]
    for wrong in ({}, {"fov_deg": 60, "f_px": 900}, {"fov_deg": 170}, {"f_px": -1.0}):
        with pytest.raises(boresight.ArgumentError):
            boresight.plan_board(1, **wrong)


def test_a_report_is_a_page(good, tmp_path):
    result = boresight.Calibration.load(good)
    pages = [boresight.report(result), boresight.report(good / "calibration.json"), boresight.report(good)]
    for page in pages:
        assert page.startswith("<!DOCTYPE html>") and "GOOD" in page.upper()
    assert "Mill Ltd" in boresight.report(result, settings={"certificate.customer": "Mill Ltd"})
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.report(tmp_path / "none.json")
    assert caught.value.code == "FILE-MISSING"


def test_sessions_are_rows(program, tmp_path):
    for name in ("good", "focus-moved"):
        shutil.copytree(RECORDINGS / name, tmp_path / "sessions" / name)
    (tmp_path / "sessions/poison").mkdir()
    (tmp_path / "sessions/poison/session.toml").write_text("nonsense")
    sessions = boresight.batch.sessions(tmp_path / "sessions")
    assert [Path(session).name for session in sessions] == ["focus-moved", "good", "poison"]
    with ProcessPoolExecutor(2) as pool:
        rows = list(pool.map(boresight.batch.work, sessions))
    assert [row["code"] == "OK" for row in rows] == [True, True, False] and rows[2]["next"] is None or rows[2]["message"]
    again = boresight.replay(sessions[1])
    row = boresight.batch.work(sessions[1], "replay")
    assert row["verdict"] == again["verdict"] and row["decisions"]["crc32"] == again["decisions"]["crc32"]
    exported = boresight.batch.work(sessions[1], "export", format="ros-yaml", out=tmp_path / "out")
    assert exported["code"] == "OK" and list((tmp_path / "out").rglob("*ros.yaml"))
    checked = boresight.batch.work(sessions[1], "check", against=RECORDINGS / "good/calibration.json")
    assert checked["check"]["verdict"] == "ok"
    for wrong in (lambda: boresight.batch.work(sessions[0], "cook"), lambda: boresight.batch.work(sessions[0], "report")):
        with pytest.raises(boresight.ArgumentError):
            wrong()
    with pytest.raises(boresight.BoresightError):
        boresight.batch.work(sessions[0], settings={"nope": 1})


def test_cameras_have_a_history(program, good, tmp_path):
    for number in range(3):
        shutil.copytree(good, tmp_path / f"sessions/{number}")
    index = tmp_path / "history.jsonl"
    added = boresight.history.add(tmp_path / "sessions", index=index)
    assert (added["sessions"], added["added"], added["gone"]) == (3, 3, 0)
    (camera,) = boresight.history.cameras(index)
    assert camera["count"] == len(camera["calibrations"]) == 3
    said = program("history", "--index", index, "--json")
    assert {name: kept for name, kept in camera.items() if name != "calibrations"} == said
    # Nothing changed; so few views would hide a change that matters, too.
    assert camera["changed"] is False and camera["change"]["verdict"] == "cannot-tell"
    shutil.rmtree(tmp_path / "sessions/0")
    assert boresight.history.add(tmp_path / "sessions", index=index)["gone"] == 1
    assert "<html" in boresight.history.page(index)
    assert boresight.history.due(1, index)[0][0] == camera["camera"]
    index.write_text("not JSON\n")
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.history.cameras(index)
    assert caught.value.code == "INDEX" and "delete it" in caught.value.next


#: Stands in for OpenCV's camera in the notebook's kernel: each picture is held for seven seconds in front of a camera of ten
#: pictures per second, whose clock is the only one.
CAMERA = """
import glob, time, cv2
clock, frames = 0.0, iter([cv2.imread(path) for path in sorted(glob.glob({pattern!r})) for _ in range(70)])
class Camera:
    def __init__(self, source):
        assert source == 0
    def get(self, side):
        return {{cv2.CAP_PROP_FRAME_WIDTH: 400.0, cv2.CAP_PROP_FRAME_HEIGHT: 300.0}}[side]
    def isOpened(self):
        return True
    def read(self):
        global clock
        clock += 0.1
        frame = next(frames, None)
        return frame is not None, frame
cv2.VideoCapture, time.monotonic = Camera, lambda: clock
"""


def test_the_notebook_guides_with_the_callers_camera(good, tmp_path):
    """From the first cell to the last in a kernel of Jupyter's, without a display."""
    nbclient = pytest.importorskip("nbclient", reason="runs the notebook")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(REPOSITORY / "examples/guide_with_own_camera.ipynb", as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert sum(1 for line in cells[1].source.splitlines() if line.strip()) <= 20
    cells[0].source = cells[0].source.replace('"9x6", 25', '"7x5", 30')
    notebook.cells.insert(0, nbformat.v4.new_code_cell(CAMERA.format(pattern=str(good / "frames/*.png"))))
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown, said = cells[1].outputs, cells[2].outputs
    assert [list(output.data) for output in shown] == [["image/jpeg", "text/plain"]]
    result = boresight.Calibration.load(tmp_path / "session")
    assert result.ok and len(result.rvecs) >= 4 and said[0].text.splitlines()[0] == str(result)


def test_types_are_strict():
    pytest.importorskip("mypy", reason="checks the types")
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(REPOSITORY / "python/boresight")], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout
