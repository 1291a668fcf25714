"""ChArUco boards: corners have their numbers, as OpenCV's have, and a part of a board is enough."""

import numpy as np
import pytest

import boresight
from conftest import REPOSITORY

cv2 = pytest.importorskip("cv2", reason="draws the boards of the tests")

#: Squares, dictionary, side of a marker in squares, whether the layout is the "legacy" one.
DRAWN = {
    "8x11-DICT_4X4_50-75": ((8, 11), "DICT_4X4_50", 0.75, False),
    "11x8-DICT_4X4_50-75-legacy": ((11, 8), "DICT_4X4_50", 0.75, True),
    "7x5-DICT_6X6_250-70": ((7, 5), "DICT_6X6_250", 0.7, False),
    "5x6-DICT_5X5_100-80-legacy": ((5, 6), "DICT_5X5_100", 0.8, True),
}
#: As `boresight` finds corners on its own drawings.
NEAR_PX = 0.1


@pytest.fixture(params=DRAWN)
def drawn(request):
    """A picture, our board, and OpenCV's."""
    squares, dictionary, marker, legacy = DRAWN[request.param]
    path = REPOSITORY / "fixtures/charuco" / f"{request.param}.png"
    theirs = cv2.aruco.CharucoBoard(
        squares, 1.0, marker, cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    )
    theirs.setLegacyPattern(legacy)
    ours = boresight.Board.charuco(squares, dictionary, square_mm=20, marker_mm=20 * marker)
    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), ours, theirs, path


def by_number(corners, ids):
    return dict(zip(ids.ravel().tolist(), corners.reshape(-1, 2), strict=True))


def test_the_drop_in_finds_what_opencv_finds(drawn):
    image, board, theirs, _ = drawn
    image = cv2.GaussianBlur(image, (0, 0), 0.8)
    corners, ids = boresight.detect_charuco_corners(image, board)
    assert corners.shape == (len(ids), 1, 2) and corners.dtype == np.float32
    assert ids.shape == (len(ids), 1) and ids.dtype == np.int32
    assert ids.ravel().tolist() == list(range(board.columns * board.rows))
    their_corners, their_ids, _, _ = cv2.aruco.CharucoDetector(theirs).detectBoard(image)
    ours, expected = by_number(corners, ids), by_number(their_corners, their_ids)
    assert len(expected) > 0.8 * len(ours)
    for number, at in expected.items():
        assert np.linalg.norm(ours[number] - at) < 0.5, number
    points, image_points = theirs.matchImagePoints(corners, ids)
    assert len(points) == len(image_points) == len(ids)


def test_the_command_line_finds_the_same(drawn, program):
    image, board, _, path = drawn
    name = f"charuco:{board.columns + 1}x{board.rows + 1}:{board.dictionary}:{board.marker_mm}mm"
    said = program("detect", "--board", name, "--square", "20mm", "--json", path)
    found = boresight.detect(image, boresight.Board.of(name, square_mm=20))
    assert found.ids.tolist() == [row * board.columns + column for column, row, *_ in said["corners"]]
    assert [list(at) for at in found.corners_px[found.seen]] == [[x, y] for _, _, x, y, _ in said["corners"]]


def test_a_part_has_the_numbers_of_the_whole(drawn):
    image, board, _, _ = drawn
    whole = boresight.detect(image, board)
    assert whole.seen.all() and whole.ids.tolist() == list(range(len(whole.seen)))
    left = int(image.shape[1] * 0.45)
    part = boresight.detect(np.ascontiguousarray(image[:, left:]), board)
    assert part and 4 <= part.seen.sum() < len(part.seen)
    assert np.isnan(part.corners_px[~part.seen]).all() and np.isinf(part.sigma_px[~part.seen]).all()
    apart = part.corners_px[part.seen] + [left, 0] - whole.corners_px[part.seen]
    assert np.abs(apart).max() < NEAR_PX
    upside_down = boresight.detect(np.ascontiguousarray(image[::-1, ::-1]), board)
    size = np.array(image.shape[::-1]) - 1
    assert np.abs(size - upside_down.corners_px - whole.corners_px).max() < NEAR_PX


def views(board, theirs):
    """Pictures of the board from all sides, some cut off by the edge, and the focal length."""
    texture = theirs.generateImage((40 * (board.columns + 1), 40 * (board.rows + 1)), marginSize=0)
    texture = cv2.copyMakeBorder(texture, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255)
    camera = np.array([[800.0, 0, 319.5], [0, 800.0, 239.5], [0, 0, 1]])
    height, width = texture.shape
    from_texture = np.array([[1, 0, -width / 2 + 0.5], [0, 1, -height / 2 + 0.5], [0, 0, 40.0]]) / 40
    for number in range(12):
        way = 2 * np.pi * number / 12
        rotation = cv2.Rodrigues(0.6 * np.array([np.cos(way), np.sin(way), 0.0]))[0]
        # The last four are cut off.
        aside = 4.5 * np.array([np.cos(way), np.sin(way)]) if number >= 8 else np.zeros(2)
        pose = np.column_stack([rotation[:, :2], [*aside, 20.0]])
        view = cv2.warpPerspective(texture, camera @ pose @ from_texture, (640, 480), borderValue=90)
        yield cv2.GaussianBlur(view, (0, 0), 0.8)


def test_parts_are_calibrated_with():
    squares, dictionary = (8, 11), "DICT_4X4_50"
    theirs = cv2.aruco.CharucoBoard(squares, 1.0, 0.75, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    board = boresight.Board.charuco(squares, dictionary, square_mm=20)
    found = [boresight.detect(image, board) for image in views(board, theirs)]
    assert all(found) and any(not part.seen.all() for part in found)
    result = boresight.calibrate(found, board)
    assert abs(result.camera_matrix[0, 0] - 800) < 2, result
    # Corners alone are enough; what isn't seen is NaN.
    corners = [part.corners_px for part in found]
    again = boresight.calibrate(corners, board, image_size=(640, 480))
    assert abs(again.camera_matrix[0, 0] - 800) < 2, again


def test_a_plain_board_has_no_markers_to_read():
    with pytest.raises(ValueError, match="dictionary"):
        boresight.detect_charuco_corners(np.zeros((30, 40), np.uint8), "7x5")
    board = "charuco:8x11:DICT_4X4_50:15mm"
    assert boresight.detect_charuco_corners(np.zeros((300, 400), np.uint8), board) == (None, None)
    assert boresight.Board.of(board, square_mm=20) == boresight.Board(7, 10, 20.0, "DICT_4X4_50", 15.0)


def test_a_part_of_a_plain_board_is_no_whole_one(pictures):
    image = cv2.imread(str(pictures[0]), cv2.IMREAD_GRAYSCALE)
    whole = boresight.detect(image, "7x5")
    # Through the middle of the first column of corners, the board is cut off.
    left = int(np.nanmin(whole.corners_px[:, 0])) + 3
    found, corners = boresight.find_chessboard_corners(np.ascontiguousarray(image[:, left:]), (7, 5))
    assert (found, corners) == (False, None)
