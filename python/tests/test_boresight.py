"""The wheel gives what the command line gives, bit for bit, and speaks Python."""

import json
import re
import threading
from pathlib import Path

import numpy as np
import pytest

import boresight
from conftest import RECORDINGS, REPOSITORY

png = pytest.importorskip("cv2", reason="reads the pictures of the tests")


def grey(path: Path) -> np.ndarray:
    return png.imread(str(path), png.IMREAD_GRAYSCALE)


def without(value: dict, *names: str) -> dict:
    return {name: kept for name, kept in value.items() if name not in names}


def test_corners_are_those_of_the_command_line(program, pictures):
    for path in pictures:
        said = program("detect", "--board", "7x5", "--json", path)
        found = boresight.detect(grey(path), "7x5")
        assert found and found.reason is None
        for [column, row, x, y, sigma], ours, own in zip(
            said["corners"], found.corners_px, found.sigma_px, strict=True
        ):
            assert [x, y] == list(ours)
            assert np.isclose(own, sigma, rtol=1e-12)
        assert found.quality == said["quality"]
        assert np.all(np.linalg.eigvalsh(found.covariances_px2) > 0)


def test_a_calibration_is_that_of_the_command_line(program, pictures):
    options = ["--board", "7x5", "--square", "30mm", "--json"]
    said = program("calibrate", *options, *pictures)
    result = boresight.calibrate(pictures, "7x5", square_mm=30)
    assert result.data == said
    # From pictures and from what was found in them: the same numbers, other names.
    images = [grey(path) for path in pictures]
    found = [boresight.detect(image, "7x5") for image in images]
    for views in (images, found):
        again = boresight.calibrate(views, "7x5", square_mm=30)
        assert again.data["result"] == said["result"]
        assert again.data["findings"] == said["findings"]
    truth = json.loads((RECORDINGS / "good/truth.json").read_text())
    sigma = result.sigma["f_px"][0]
    assert abs(result.camera_matrix[0, 0] - truth["f_px"][0]) < 5 * sigma
    order, covariance = result.covariance
    assert covariance.shape == (len(order), len(order))


def test_a_replay_is_that_of_the_command_line(program):
    for name in ("good", "focus-moved", "focus-moved-unseen", "installed-camera-changed"):
        session = RECORDINGS / name
        setting = ["--set", "guidance.hold_secs=0.5"]
        assert boresight.replay(session, settings={"guidance.hold_secs": 0.5}) == program(
            "replay", session, "--json", *setting
        )
        again = boresight.replay(session, redetect=True)
        assert again == program("replay", session, "--redetect", "--json")
        assert boresight.read(session)["calibration"]["verdict"]


def test_a_check_is_that_of_the_recording(good):
    changed = RECORDINGS / "installed-camera-changed"
    said = json.loads((changed / "check.json").read_text())
    found = boresight.check(changed, good / "calibration.json")
    assert found["verdict"] == said["verdict"] == "recalibrate"
    # The recording is of an older version.
    assert np.isclose(found["change"]["f_px"], said["change"]["f_px"], rtol=1e-5)


def test_a_check_of_pictures(good, pictures):
    found = boresight.check([grey(path) for path in pictures], good / "calibration.json", "7x5", square_mm=30)
    assert found["verdict"] == "ok"
    other = boresight.check([np.zeros((10, 10), np.uint8)], good / "calibration.json", "7x5")
    assert (other["verdict"], other["reason"]) == (None, "OTHER-SIZE")


def test_a_judgement_is_that_of_the_command_line(program, good, tmp_path):
    file = tmp_path / "ost.yaml"
    file.write_text(boresight.export(good, "ros-yaml"))
    assert boresight.judge(file, good) == program("judge", "--json", file, good)
    assert boresight.judge(file)["reason"] == "NO-PICTURES"
    assert boresight.check(good, file)["reason"] == "NOT-JUDGED"


def test_a_judgement_of_pictures(good, pictures):
    found = boresight.judge(good / "calibration.json", [grey(path) for path in pictures], "7x5", square_mm=30)
    assert found["answer"] == "true"
    assert found["off_interval_px"][0] <= found["off_px"] <= found["off_interval_px"][1]
    tight = boresight.judge(good / "calibration.json", good, accept="0.0001px")
    assert tight["answer"] == "cannot-tell"
    with pytest.raises(boresight.ArgumentError):
        boresight.judge(good / "calibration.json", [grey(pictures[0])])


def test_every_format_is_written_and_read_back(good, tmp_path):
    result = json.loads((good / "calibration.json").read_text())["result"]
    for name in boresight.FORMATS:
        try:
            text = boresight.export(good, name)
        except boresight.BoresightError as refused:
            assert "can't hold this lens" in refused.message and name in ("kalibr", "vins", "gyroflow", "open3d")
            continue
        assert text
        if name not in ("matlab", "views-csv", "vnl"):
            path = tmp_path / name
            path.write_text(text)
            read = boresight.read_calibration(path)
            assert np.allclose(read["f_px"], result["f_px"], rtol=1e-9)
            assert np.allclose(read["pp_px"], result["pp_px"], rtol=1e-9)


def test_a_session_is_fed_and_advises(pictures):
    session = boresight.Session("7x5", (400, 300), square_mm=30)
    advices = [session.feed_still(grey(path), path.name) for path in pictures]
    assert sum(advice.taken for advice in advices) == advices[-1].views >= 4
    assert all(advice.text for advice in advices)
    before = session.calibration
    assert before.ok and before.camera_matrix[0, 0] > 100
    assert session.undo().views == advices[-1].views - 1
    assert session.restore().views == advices[-1].views
    assert session.calibration.data == before.data


def test_the_drop_in_finds_what_opencv_finds(pictures):
    for path in pictures:
        image = png.imread(str(path))
        found, ours = boresight.find_chessboard_corners(image, (7, 5))
        assert found and ours.shape == (35, 1, 2) and ours.dtype == np.float32
        theirs_found, theirs = png.findChessboardCorners(image, (7, 5))
        if not theirs_found:
            continue
        theirs = png.cornerSubPix(
            png.cvtColor(image, png.COLOR_BGR2GRAY), theirs, (3, 3), (-1, -1),
            (png.TERM_CRITERIA_EPS + png.TERM_CRITERIA_MAX_ITER, 40, 0.001),
        )  # fmt: skip
        # OpenCV 5 leaves out the dimension of one; it takes the corners with it, too.
        ours, theirs = ours.reshape(-1, 2), theirs.reshape(-1, 2)
        # A board of odd by odd corners looks the same turned by half a turn.
        apart = min(np.abs(ours - theirs).max(), np.abs(ours - theirs[::-1]).max())
        assert apart < 0.5, path
    assert boresight.find_chessboard_corners(np.zeros((300, 400), np.uint8), (7, 5)) == (False, None)


def test_what_is_not_found_has_a_reason():
    nothing = boresight.detect(np.full((300, 400), 128, np.uint8), "7x5")
    assert not nothing and nothing.reason and nothing.corners_px is None
    result = boresight.calibrate([np.zeros((300, 400), np.uint8)], "7x5")
    assert not result.ok and result.data["result"] is None
    with pytest.raises(boresight.BoresightError) as caught:
        result.camera_matrix
    assert caught.value.code == "NO-CALIBRATION"


def test_errors_have_the_codes_of_the_command_line(tmp_path, good):
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.replay(tmp_path / "nowhere")
    assert caught.value.code == "FILE-MISSING"
    assert "nowhere" in str(caught.value) and caught.value.next
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.replay(good, settings={"guidance.nonsense": 1})
    assert caught.value.code == "SETTINGS"
    broken = tmp_path / "broken.json"
    broken.write_text("{")
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.read_calibration(broken)
    assert caught.value.code == "OLD-CALIBRATION"
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.calibrate([tmp_path / "no.png"], "7x5")
    assert caught.value.code == "PICTURE-UNREADABLE"


@pytest.mark.parametrize(
    "image",
    [np.full((3, 4), np.nan), np.zeros((3, 4, 2), np.uint8), np.zeros((0, 4), np.uint8), [[1]], np.zeros((3, 4), bool)],
)
def test_what_is_no_picture_is_refused(image):
    with pytest.raises(boresight.ArgumentError):
        boresight.detect(image, "7x5")


@pytest.mark.parametrize(
    "board",
    [
        "7", "7x", "axb", (1, 1), (7, 5, 3), (9.7, 6), (-1, 5), "0x5", "charuco:8x11", "charuco:8x11:9X9_50", "aruco:8x11:4X4_50",
        "charuco:8x11:4X4_50:15", "charuco:20x20:4X4_50", "charuco:8x11:4X4_50:26mm",
    ],
)  # fmt: skip
def test_what_is_no_board_is_refused(board):
    with pytest.raises(boresight.BoresightError):
        boresight.detect(np.zeros((30, 40), np.uint8), board)
    with pytest.raises(boresight.BoresightError):
        boresight.calibrate([np.zeros((30, 40), np.uint8)], board)


def test_corners_that_are_none_are_refused():
    corners = np.zeros((35, 2))
    corners[0, 0] = np.nan
    with pytest.raises(ValueError):
        boresight.calibrate([corners], "7x5", image_size=(400, 300))
    with pytest.raises(boresight.BoresightError):
        boresight.calibrate([np.zeros((34, 2))], "7x5", image_size=(400, 300))
    with pytest.raises(ValueError, match="image_size"):
        boresight.calibrate([np.zeros((35, 2))], "7x5")


def test_pictures_in_any_layout_are_the_same_picture(pictures):
    image = grey(pictures[0])
    expected = boresight.detect(image, "7x5").corners_px
    large = np.zeros((image.shape[0] * 2, image.shape[1] * 2), np.uint8)
    large[::2, ::2] = image
    for same in (np.asfortranarray(image), large[::2, ::2], np.repeat(image[:, :, None], 3, 2)):
        assert np.array_equal(boresight.detect(same, "7x5").corners_px, expected)


def test_other_threads_run_while_one_searches(pictures):
    image = np.kron(grey(pictures[0]), np.ones((8, 8), np.uint8))
    counted, stop = 0, threading.Event()

    def count():
        nonlocal counted
        while not stop.is_set():
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    try:
        before = counted
        boresight.detect(image, "7x5")
        after = counted
    finally:
        stop.set()
        thread.join()
    # Between two calls a thread has a few milliseconds at most; during one, all of its time.
    assert after - before > 1000


def test_a_file_is_not_replaced_unasked(good, tmp_path):
    result = boresight.calibrate(sorted((good / "frames").glob("*.png")), "7x5", square_mm=30)
    path = tmp_path / "camera.json"
    result.save(path)
    assert json.loads(path.read_text()) == result.data
    with pytest.raises(boresight.BoresightError) as caught:
        result.save(path)
    assert caught.value.code == "FILE-EXISTS"
    result.save(path, overwrite=True)
    assert [entry.name for entry in tmp_path.iterdir()] == ["camera.json"]


def test_the_examples_of_the_readme_run(good, tmp_path, monkeypatch, capsys):
    (tmp_path / "pictures").symlink_to(good / "frames")
    monkeypatch.chdir(tmp_path)
    readme = (REPOSITORY / "python/README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert len(blocks) == 4
    names: list[dict] = [{} for _ in blocks]
    for block, named in zip(blocks, names, strict=True):
        exec(compile(block, "README.md", "exec"), named)
    said = capsys.readouterr().out
    # Before and after are the same camera, and the same picture without its distortion.
    before, after = names[1:3]
    assert np.abs(before["mtx"] - after["mtx"]).max() < 3
    assert before["flat"].shape == after["flat"].shape and len(before["rvecs"]) <= len(after["rvecs"])
    assert np.median(np.abs(before["flat"].astype(int) - after["flat"])) <= 2
    assert "camera_matrix" in said and ("good" in said or "care" in said)
