"""What a lens does, beside OpenCV; results that compare, hash and pickle; files of other programs."""

import json
import pickle
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import boresight

cv2 = pytest.importorskip("cv2", reason="the reference")

SIZE = (640, 480)
MATRIX = [[512.5, 0, 322.25], [0, 510.75, 241.5], [0, 0, 1]]
LENSES = {
    "brown": [-0.28, 0.09, 1e-3, -7e-4, -0.012],
    "rational": [0.2, -0.11, 4e-4, -3e-4, 0.01, 0.45, -0.09, 0.004],
    "fisheye": [0.02, -0.008, 0.003, -4e-4],
}


def calibration(name: str, folder: Path) -> boresight.Calibration:
    """A lens by OpenCV's hand."""
    path = str(folder / f"{name}.yaml")
    store = cv2.FileStorage(path, cv2.FILE_STORAGE_WRITE)
    store.write("image_width", SIZE[0])
    store.write("image_height", SIZE[1])
    store.write("camera_matrix", np.array(MATRIX, float))
    store.write("distortion_coefficients", np.array([LENSES[name]], float))
    if name == "fisheye":
        store.write("fisheye_model", 1)
    store.release()
    return boresight.Calibration.load(path)


@pytest.fixture(params=sorted(LENSES))
def lens(request, tmp_path):
    return request.param, calibration(request.param, tmp_path)


@pytest.fixture
def result(pictures):
    return boresight.calibrate(pictures, "7x5", square_mm=30)


def test_points_are_projected_as_opencv_does(lens):
    name, camera = lens
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-0.5, 0.5, (1000, 2)), np.ones(1000)]) * rng.uniform(0.3, 3, (1000, 1))
    matrix, coefficients = camera.to_cv2()
    assert camera.is_fisheye == (name == "fisheye")
    still = np.zeros(3)
    if camera.is_fisheye:
        theirs = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), still, still, matrix, coefficients)[0]
    else:
        theirs = cv2.projectPoints(points, still, still, matrix, coefficients)[0]
    ours = camera.project(points)
    assert np.abs(ours - theirs.reshape(-1, 2)).max() < 1e-9
    # There and back.
    rays = camera.unproject(ours.reshape(-1, 1, 2))
    assert np.abs(rays - points / np.linalg.norm(points, axis=1, keepdims=True)).max() < 1e-9
    assert np.isnan(camera.project([0, 0, -1])).all()


def test_points_are_undistorted_as_opencv_does(lens):
    _, camera = lens
    pixels = np.random.default_rng(2).uniform([0, 0], SIZE, (1000, 2))
    turn = cv2.Rodrigues(np.array([0.05, -0.03, 0.1]))[0]
    new = np.array([[400.0, 0, 300], [0, 410, 260], [0, 0, 1]])
    matrix, coefficients = camera.to_cv2()
    flat = camera.undistort_points(pixels)
    turned = camera.undistort_points(pixels, R=turn, P=new)
    # The inverse is exact; OpenCV's stops a little earlier.
    assert np.abs(camera.project(np.column_stack([flat, np.ones(len(flat))])) - pixels).max() < 1e-9
    undistort = cv2.fisheye.undistortPoints if camera.is_fisheye else cv2.undistortPoints
    theirs = undistort(pixels.reshape(-1, 1, 2), matrix, coefficients)
    assert np.abs(flat - theirs.reshape(-1, 2)).max() < 1e-3
    rays = np.column_stack([flat, np.ones(len(flat))]) @ turn.T
    by_hand = (rays / rays[:, 2:]) @ new.T
    assert np.abs(turned - by_hand[:, :2]).max() < 1e-9


def test_maps_are_those_of_opencv(lens):
    _, camera = lens
    matrix, coefficients = camera.to_cv2()
    turn = cv2.Rodrigues(np.array([0.02, -0.04, 0.01]))[0]
    new = np.array([[480.0, 0, 330], [0, 470, 250], [0, 0, 1]])
    make = cv2.fisheye.initUndistortRectifyMap if camera.is_fisheye else cv2.initUndistortRectifyMap
    for rotation, wanted, size in ((None, None, None), (turn, new, (300, 200))):
        theirs = make(
            matrix, coefficients, np.eye(3) if rotation is None else rotation, matrix if wanted is None else wanted,
            SIZE if size is None else size, cv2.CV_32FC1,
        )  # fmt: skip
        ours = camera.undistort_map(size, wanted, rotation)
        for one, other in zip(ours, theirs, strict=True):
            assert one.dtype == np.float32 and one.shape == other.shape
            # A float32 near 1000 has a step of 6e-5; both round once.
            assert np.abs(one - other).max() <= 6.2e-5


def test_poses_are_opencvs(result, pictures):
    board = result.board
    assert board == boresight.Board(7, 5, 30.0)
    used = [view["name"] for view in result.views if view["used"]]
    assert len(result.rvecs) == len(result.tvecs) == len(used)
    matrix, coefficients = result.to_cv2()
    for name, rvec, tvec in zip(used, result.rvecs, result.tvecs, strict=True):
        found = boresight.detect(cv2.imread(str(pictures[0].parent / name), 0), board)
        seen = cv2.projectPoints(board.points_mm, rvec, tvec, matrix, coefficients)[0].reshape(-1, 2)
        assert np.abs(seen - found.corners_px).max() < 1.0, name


def test_uncertainty_is_that_of_the_file_and_of_differences(result):
    grid = np.array(result.data["projection_sd_px"]["grid"])
    ours = result.uncertainty_at(grid[:, :2])
    named, covariance = result.covariance
    # The file's covers doubt about coefficients held at zero, too.
    assert np.abs(ours / grid[:, 2] - 1).max() < 1e-6
    pixel = np.array([[120.0, 90.0]])
    bearing = result.unproject(pixel)[0]
    spread = result.bearing_covariance(pixel)[0]
    assert np.abs(spread @ bearing).max() < 1e-12 * max(1.0, np.trace(spread))
    # A pixel's worth of bearing, by differences.
    step = 1e-4
    by_px = np.stack(
        [(result.unproject(pixel + step * axis) - result.unproject(pixel - step * axis))[0] / (2 * step) for axis in np.eye(2)], 1
    )
    assert np.allclose(spread, by_px @ result.covariance_at(pixel)[0] @ by_px.T, rtol=1e-5)
    assert named and covariance.shape[0] == len(named)


def test_a_lens_without_uncertainty_says_so(tmp_path):
    camera = calibration("brown", tmp_path)
    assert (camera.verdict, camera.ok) == ("care", True)
    assert [finding["code"] for finding in camera.findings] == ["IMPORTED"]
    for ask in (lambda: camera.uncertainty_at([1, 1]), lambda: camera.sigma, lambda: camera.covariance):
        with pytest.raises(boresight.BoresightError) as caught:
            ask()
        assert caught.value.code == "NO-UNCERTAINTY"


def test_every_format_goes_there_and_back(lens, tmp_path):
    name, camera = lens
    points = np.column_stack([np.random.default_rng(3).uniform(-0.5, 0.5, (1000, 2)), np.ones(1000)])
    expected = camera.project(points)
    held = set()
    for format in boresight.FORMATS:
        if format in ("matlab", "views-csv", "vnl"):
            continue
        path = tmp_path / f"camera-{format}"
        try:
            path.write_text(boresight.export(camera, format, name="front"))
        except boresight.BoresightError as refused:
            assert "can't hold this lens" in refused.message
            continue
        back = boresight.Calibration.load(path)
        assert back.image_size == SIZE and np.abs(back.project(points) - expected).max() < 1e-9, format
        held.add(format)
    everywhere = {"opencv-yaml", "opencv-xml", "opencv-json", "ros-yaml", "colmap", "basalt", "json"}
    more = {
        "brown": {"mrcal", "orb-slam3", "nerf", "metashape", "photonvision"},
        "rational": {"mrcal", "photonvision"},
        "fisheye": {"kalibr", "orb-slam3", "nerf", "instant-ngp", "metashape", "vins", "gyroflow"},
    }
    assert held == everywhere | more[name]


def test_results_compare_hash_pickle_and_say_what_they_are(result, pictures):
    again = boresight.calibrate(pictures, "7x5", square_mm=30)
    result.project([0, 0, 1])
    back = pickle.loads(pickle.dumps(result))
    assert result == again == back and hash(result) == hash(back) and result != 1
    assert np.array_equal(back.project([0.1, 0, 1]), result.project([0.1, 0, 1]))
    assert repr(result).startswith("<Calibration of 400x300: ")
    image = cv2.imread(str(pictures[0]), 0)
    found, same = boresight.detect(image, "7x5"), boresight.detect(image, "7x5")
    assert found == same == pickle.loads(pickle.dumps(found)) and hash(found) == hash(same)
    assert found != boresight.detect(np.zeros_like(image), "7x5")
    assert repr(found) == "<Detection of 7x5: 35 of 35 corners>"


def failing(path: str) -> None:
    boresight.calibrate([path], "7x5")


def test_errors_pickle_through_a_process_pool(tmp_path):
    with ProcessPoolExecutor(1) as pool, pytest.raises(boresight.BoresightError) as caught:
        pool.submit(failing, str(tmp_path / "no.png")).result()
    assert caught.value.code == "PICTURE-UNREADABLE" and caught.value.next and "no.png" in str(caught.value)
    for error in (boresight.BoresightError("a", "B", "c"), boresight.ArgumentError("a")):
        back = pickle.loads(pickle.dumps(error))
        assert type(back) is type(error) and (back.message, back.code, back.next) == (error.message, error.code, error.next)
    assert issubclass(boresight.ArgumentError, boresight.BoresightError) and issubclass(boresight.ArgumentError, ValueError)


def test_a_bad_view_is_left_out_and_said(result, pictures):
    views = [boresight.detect(cv2.imread(str(path), 0), "7x5").corners_px for path in pictures]
    wild = np.random.default_rng(4).uniform(0, 300, (35, 2))
    few = np.full((35, 2), np.nan)
    few[:5] = views[0][:5]
    bad = [np.full((35, 2), np.nan), few, wild, None, np.zeros((300, 400), np.uint8)]
    mixed = boresight.calibrate([*bad[:2], *views, *bad[2:]], "7x5", square_mm=30, image_size=(400, 300))
    plain = boresight.calibrate(views, "7x5", square_mm=30, image_size=(400, 300))
    assert mixed.ok and mixed.data["result"] == plain.data["result"]
    reasons = [view["reason"] for view in mixed.views if not view["used"]]
    assert len(reasons) == len(bad) and all(reasons)
    # A damaged file among good ones, as on the command line.
    assert len(mixed.views) == len(views) + len(bad)


def test_a_damaged_picture_is_left_out_and_said(program, pictures, tmp_path):
    for path in pictures:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "a-cut.png").write_bytes(pictures[0].read_bytes()[:2000])
    result = boresight.calibrate(tmp_path / "*.png", "7x5", square_mm=30)
    assert result.ok and [view["name"] for view in result.views if not view["used"]] == ["a-cut.png"]
    said = program("calibrate", "--board", "7x5", "--square", "30mm", "--json", *sorted(tmp_path.glob("*.png")))
    assert said == result.data
    assert boresight.calibrate(tmp_path, "7x5", square_mm=30) == result


def test_a_session_is_calibrated_from_its_journal(program, good):
    result = boresight.calibrate(good)
    assert result.data == program("calibrate", "--json", good)
    recorded = json.loads((good / "calibration.json").read_text())["result"]
    assert np.allclose(result.camera_matrix[0, 0], recorded["f_px"][0], rtol=1e-4)
    with pytest.raises(boresight.ArgumentError):
        boresight.calibrate(good, "7x5")


def test_pictures_of_other_depths_are_the_same_picture(pictures):
    image = cv2.imread(str(pictures[0]), 0)
    expected = boresight.detect(image, "7x5").corners_px
    brightest = int(image.max())
    assert brightest > 128
    deep = {bits: image.astype(np.uint16) << (bits - 8) for bits in (10, 12, 14, 16)}
    for same in (*deep.values(), image.astype(np.uint16), image / 255.0, image.astype(np.float32)):
        assert np.array_equal(boresight.detect(same, "7x5").corners_px, expected)


def test_arguments_are_read_as_python_writes_them(pictures):
    views = [cv2.imread(str(path), 0) for path in pictures]
    setting = {"calibration": {"varying_focal": np.bool_(False)}, "guidance.hold_secs": np.float32(0.5)}
    assert boresight.calibrate(views, "7×5", settings=setting).ok
    for wrong in ([], [views[0], views[0][:100]]):
        with pytest.raises(boresight.ArgumentError):
            boresight.calibrate(wrong, "7x5")
    with pytest.raises(boresight.ArgumentError):
        boresight.calibrate(views, "7x5", image_size=(10, 10))
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.calibrate("nowhere/*.png", "7x5")
    assert caught.value.code == "NO-PICTURES"


def test_a_check_takes_a_calibration(good, result, tmp_path):
    result.save(tmp_path / "old.json")
    of_file, of_object = boresight.check(good, tmp_path / "old.json"), boresight.check(good, result)
    assert of_file["verdict"] and {**of_file, "against": ""} == {**of_object, "against": ""}
    with pytest.raises(boresight.BoresightError, match="session folder"):
        boresight.export(result, "vnl")


def test_a_session_shows_what_it_wants_and_is_recorded(pictures, tmp_path, program):
    folder = tmp_path / "session"
    with boresight.Session("7x5", (400, 300), square_mm=30, record=folder) as session:
        blank = session.feed_still(np.zeros((300, 400), np.uint8), "blank")
        assert blank.corners_px is None and blank.said and blank.pose is not None
        assert blank.pose.corners_px.shape == (35, 2) and len(blank.pose.card_px) > 8
        assert session.pause().paused and not session.resume().paused
        for path in pictures:
            advice = session.feed_still(cv2.imread(str(path), 0), path.name)
            assert advice.corners_px.shape == (35, 2)
        result = session.calibration
        assert session.take_now().views == advice.views
    assert boresight.Calibration.load(folder) == result
    # The program reads it, replays it, and finds it whole.
    assert program("doctor", "--json", folder)["whole"]
    assert program("replay", "--json", folder)["decisions"]["different"] == []
    assert (folder / "corners.vnl").read_text().count("\n") > 35 * 4
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.Session("7x5", (400, 300), record=folder)
    assert caught.value.code == "NOT-NEW"


def test_whoever_leaves_out_the_square_is_warned(pictures):
    with pytest.warns(UserWarning, match="25 mm"):
        unsized = boresight.calibrate(pictures, "7x5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sized = boresight.calibrate(pictures, "7x5", square_mm=30)
        boresight.calibrate(pictures, boresight.Board(7, 5, 30))
    assert np.allclose(unsized.camera_matrix, sized.camera_matrix)


@pytest.mark.parametrize(
    "call",
    [
        lambda result: boresight.Board.of("7x5", "30mm"),
        lambda result: boresight.detect("picture.png", "7x5"),
        lambda result: result.project("abc"),
        lambda result: boresight.plan_board("3 m", f_px=900),
    ],
)
def test_wrong_arguments_are_errors_of_one_class(call, result):
    with pytest.raises(boresight.BoresightError) as caught:
        call(result)
    assert caught.value.code == "ARGUMENT"


def test_a_size_that_a_file_lacks_is_given(tmp_path):
    path = tmp_path / "tutorial.json"
    path.write_text('{"mtx": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "dist": [[0.1, -0.2, 0, 0, 0.01]]}')
    with pytest.raises(boresight.BoresightError) as caught:
        boresight.Calibration.load(path)
    assert "--image-size" in caught.value.next
    assert boresight.Calibration.load(path, image_size=(640, 480)).image_size == (640, 480)
