"""Camera calibration that says whether to believe it.

Pixel (0, 0) is the centre of the top-left pixel, x points right, y down. Lengths are in pixels unless a name says
otherwise; the lens is OpenCV's. A board is named by its inner corners, columns x rows: "9x6" is a
board of 10 by 7 squares. A ChArUco board is named by its squares, as other programs do, with the dictionary and the
side of a marker: "charuco:8x11:DICT_4X4_50:15mm".

Pictures are arrays of uint8: rows x columns, or rows x columns x 3 in OpenCV's order, blue, green, red.

>>> import boresight
>>> found = boresight.detect(image, "9x6")              # doctest: +SKIP
>>> result = boresight.calibrate(images, "9x6", square_mm=25)    # doctest: +SKIP
>>> result.verdict, result.camera_matrix                # doctest: +SKIP

Whatever can't be done raises :class:`BoresightError`, with a stable ``code`` and ``next``, what to do about it. A board
that isn't found is no error: ``found.reason`` says why.
"""

from __future__ import annotations

import json
import os
import re
import threading
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Iterable, Mapping, Sequence, Union

import numpy as np

from . import _boresight
from ._boresight import BoresightError, __version__

__all__ = [
    "Advice",
    "Board",
    "BoresightError",
    "Calibration",
    "Detection",
    "FORMATS",
    "Session",
    "calibrate",
    "check",
    "detect",
    "detect_charuco_corners",
    "export",
    "find_chessboard_corners",
    "read",
    "read_calibration",
    "replay",
    "__version__",
]

#: Names of the formats that :func:`export` writes.
FORMATS: tuple[str, ...] = tuple(_boresight.formats())

BoresightError.__str__ = lambda self: str(self.args[0]) if self.args else ""
BoresightError.message = property(lambda self: self.args[0], doc="What happened.")
BoresightError.code = property(lambda self: self.args[1], doc="Stable name.")
BoresightError.next = property(lambda self: self.args[2], doc="What to do about it, or None.")

PathLike = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Board:
    """A checkerboard by its inner corners: a plain one, or a ChArUco board with a marker in each light square.

    The size of the squares only scales distances: the lens doesn't depend on it. On a ChArUco board, the markers are
    found by their size as a share of a square's, so give both in the same unit.
    """

    #: Inner corners in a row.
    columns: int
    #: Inner corners in a column.
    rows: int
    #: Side of a square in millimetres.
    square_mm: float = 25.0
    #: Dictionary of a ChArUco board's markers, by OpenCV's name, such as "DICT_4X4_50"; None on a plain board.
    dictionary: str | None = None
    #: Side of a marker with its black frame in millimetres; None for 0.75 of a square.
    marker_mm: float | None = None

    @classmethod
    def of(cls, board: BoardLike, square_mm: float | None = None) -> Board:
        """The board that ``board`` names: a Board, "9x6", (9, 6), or "charuco:8x11:DICT_4X4_50:15mm".

        The last is a ChArUco board of 8 by 11 *squares*, so 7 by 10 inner corners, with markers of 15 mm. The size of
        the markers can be left out if it's 0.75 of a square.
        """
        if isinstance(board, str):
            board = _charuco(board) if ":" in board else _counts(board)
        if not isinstance(board, Board):
            columns, rows = board
            board = Board(int(columns), int(rows))
        return board if square_mm is None else replace(board, square_mm=float(square_mm))

    @classmethod
    def charuco(
        cls, squares: tuple[int, int], dictionary: str, square_mm: float = 25.0, marker_mm: float | None = None
    ) -> Board:
        """A ChArUco board of so many *squares* in a row and in a column, as ``cv2.aruco.CharucoBoard`` counts them."""
        across, down = squares
        return cls(int(across) - 1, int(down) - 1, square_mm, dictionary, marker_mm)

    @property
    def points_mm(self) -> np.ndarray:
        """The inner corners on the board, N x 3, row by row, in millimetres.

        The origin is the centre of the grid, as in the poses ``cam_from_board`` of a calibration; z is 0.
        """
        y, x = np.mgrid[0 : self.rows, 0 : self.columns]
        points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
        return (points - points.mean(axis=0)) * self.square_mm

    def _named(self) -> tuple[int, int, float, str | None, float | None]:
        return (self.columns, self.rows, float(self.square_mm), self.dictionary, self.marker_mm)


def _counts(text: str) -> tuple[int, int]:
    columns, cross, rows = text.lower().partition("x")
    if not (cross and columns.strip().isdigit() and rows.strip().isdigit()):
        raise ValueError(f'a board is named by its inner corners, for example "9x6", not {text!r}')
    return int(columns), int(rows)


_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


def _charuco(text: str) -> Board:
    named = re.fullmatch(r"charuco:(\d+)[x×](\d+):(\w+)(?::([\d.]+) ?(mm|cm|m|in))?", text.strip(), re.IGNORECASE)
    if not named:
        raise ValueError(
            "a ChArUco board is named by its squares, dictionary and marker size, for example "
            f'"charuco:8x11:DICT_4X4_50:15mm", not {text!r}'
        )
    across, down, dictionary, side, unit = named.groups()
    marker_mm = None if side is None else float(side) * _MILLIMETRES[unit.lower()]
    return Board.charuco((int(across), int(down)), dictionary, marker_mm=marker_mm)


BoardLike = Union[Board, str, "tuple[int, int]"]


def _grey(image: Any) -> np.ndarray:
    """``image`` in grey; colours are weighed as OpenCV weighs them."""
    array = np.asarray(image)
    if array.dtype != np.uint8:
        raise TypeError(f"a picture is an array of uint8, not {array.dtype}")
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    elif array.ndim == 3 and array.shape[2] in (3, 4):
        blue, green, red = (array[:, :, i].astype(np.uint32) for i in range(3))
        array = ((blue * 1868 + green * 9617 + red * 4899 + 8192) >> 14).astype(np.uint8)
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"a picture has rows, columns and perhaps 3 colours, not the shape {array.shape}")
    return array


@dataclass(frozen=True)
class Detection:
    """What was found in one picture."""

    #: Whether the board was found, whole or in part.
    found: bool
    #: Why not, in words; None if it was.
    reason: str | None
    #: The board that was searched.
    board: Board
    #: Positions of all inner corners of the board, N x 2 float64, row by row; NaN where one isn't seen. None without a
    #: board.
    corners_px: np.ndarray | None
    #: Covariance of the error of each corner, N x 2 x 2, in px squared, infinite where it isn't seen; None without a
    #: board.
    covariances_px2: np.ndarray | None
    #: Blur in px, contrast, glare and motion in px; None without a board.
    quality: Mapping[str, Any] | None
    #: Width and height of the picture.
    image_size: tuple[int, int]

    def __bool__(self) -> bool:
        return self.found

    @property
    def seen(self) -> np.ndarray | None:
        """Whether each corner is seen, N: those that are covered, or outside of the picture, aren't."""
        return None if self.corners_px is None else np.isfinite(self.corners_px[:, 0])

    @property
    def ids(self) -> np.ndarray | None:
        """Numbers of the corners that are seen, int32, counted row by row from 0: OpenCV's on ChArUco boards."""
        return None if self.seen is None else np.flatnonzero(self.seen).astype(np.int32)

    @property
    def sigma_px(self) -> np.ndarray | None:
        """Standard deviation of each corner, N: the root of the mean variance of both axes."""
        if self.covariances_px2 is None:
            return None
        return np.sqrt(np.trace(self.covariances_px2, axis1=1, axis2=2) / 2)


# A detector keeps buffers as large as its pictures, and works on one picture at a time.
_own = threading.local()


def _detector() -> _boresight.Detector:
    if not hasattr(_own, "detector"):
        _own.detector = _boresight.Detector()
    return _own.detector


def detect(image: Any, board: BoardLike) -> Detection:
    """Searches ``image`` for ``board``.

    Corners come in rows of ``board.columns``, with the covariance of their error. Of a board that is cut off or covered,
    those that are seen are found if it's certain which they are: on a ChArUco board the markers tell. Otherwise
    ``reason`` says why there are none. Other threads run meanwhile.
    """
    board = Board.of(board)
    grey = _grey(image)
    text, corners, covariances = _detector().detect(grey, board._named())
    if corners is not None:
        corners[np.isinf(covariances[:, 0, 0])] = np.nan
    said = json.loads(text)
    size = (grey.shape[1], grey.shape[0])
    return Detection(said["found"], said["reason"], board, corners, covariances, said["quality"], size)


def find_chessboard_corners(
    image: Any, pattern_size: tuple[int, int], corners: Any = None, flags: int = 0
) -> tuple[bool, np.ndarray | None]:
    """Like ``cv2.findChessboardCorners``: (found, N x 1 x 2 float32) if all corners are seen, or (False, None).

    ``corners`` and ``flags`` are there for the sake of old calls and change nothing. The corners need no
    ``cv2.cornerSubPix``: that would make them worse.
    """
    found = detect(image, tuple(pattern_size))
    if found.corners_px is None or not found.seen.all():
        return False, None
    return True, found.corners_px.astype(np.float32).reshape(-1, 1, 2)


def detect_charuco_corners(image: Any, board: BoardLike) -> tuple[np.ndarray | None, np.ndarray | None]:
    """The first two results of ``cv2.aruco.CharucoDetector.detectBoard``: corners and their numbers.

    Corners are N x 1 x 2 float32 and ids N x 1 int32, of the N corners that are seen; (None, None) without a board.
    ``board`` is a ChArUco board; whether it has OpenCV's present or "legacy" layout shows in the picture. For object
    points: ``cv2.aruco.CharucoBoard.matchImagePoints(corners, ids)``. The corners need no ``cv2.cornerSubPix``: that
    would make them worse.
    """
    board = Board.of(board)
    if board.dictionary is None:
        raise ValueError('a ChArUco board has a dictionary, for example "charuco:8x11:DICT_4X4_50:15mm"')
    found = detect(image, board)
    if found.corners_px is None:
        return None, None
    corners = found.corners_px[found.seen].astype(np.float32)
    return corners.reshape(-1, 1, 2), found.ids.reshape(-1, 1)


@dataclass(frozen=True)
class Calibration:
    """A calibration, or the reason why there is none. ``data`` is ``calibration.json`` as a dict."""

    data: Mapping[str, Any] = field(repr=False)

    @property
    def verdict(self) -> str:
        """"good", "care" or "untrustworthy"."""
        return self.data["verdict"]

    @property
    def findings(self) -> Sequence[Mapping[str, str]]:
        """What speaks for or against it: code, severity, message, and what to do."""
        return self.data["findings"]

    @property
    def ok(self) -> bool:
        """Whether there is a lens that can be used."""
        return self.data["result"] is not None and self.verdict != "untrustworthy"

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = self.data["image_size"]
        return width, height

    def _lens(self) -> Mapping[str, Any]:
        if self.data["result"] is None:
            said = "; ".join(finding["message"] for finding in self.findings)
            raise BoresightError(f"there is no calibration: {said}", "NO-CALIBRATION", None)
        return self.data["result"]

    @property
    def camera_matrix(self) -> np.ndarray:
        """OpenCV's camera matrix, 3 x 3, in pixels."""
        (fx, fy), (cx, cy) = self._lens()["f_px"], self._lens()["pp_px"]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> np.ndarray:
        """OpenCV's coefficients: k1, k2, p1, p2, k3; for a rational lens k4, k5, k6 follow.

        For a fisheye lens, the k1, k2, k3, k4 of ``cv2.fisheye``.
        """
        lens = self._lens()["distortion"]
        if self.is_fisheye:
            names = ["k1", "k2", "k3", "k4"]
        elif any(name in lens for name in ("k4", "k5", "k6")):
            names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]
        else:
            names = ["k1", "k2", "p1", "p2", "k3"]
        return np.array([lens.get(name, 0.0) for name in names])

    @property
    def is_fisheye(self) -> bool:
        """Whether the coefficients are those of ``cv2.fisheye``."""
        return bool(self._lens()["distortion"].get("fisheye", False))

    @property
    def sigma(self) -> Mapping[str, Any]:
        """Standard deviations: f_px and pp_px as pairs, and k1, k2, p1, p2, k3."""
        return self._lens()["sigma"]

    @property
    def covariance(self) -> tuple[list[str], np.ndarray]:
        """Names of the free parameters, and their covariance."""
        named = self._lens()["covariance"]
        return list(named["order"]), np.array(named["matrix"], dtype=float)

    def to_json(self) -> str:
        """``boresight.calibration/1``."""
        return json.dumps(self.data)

    def save(self, path: PathLike, *, overwrite: bool = False) -> None:
        """Writes ``calibration.json`` to ``path``, as a whole."""
        _save(Path(path), self.to_json(), overwrite)


def _save(path: Path, text: str, overwrite: bool) -> None:
    if not overwrite and path.exists():
        raise FileExistsError(f"there is already a file {path}; to replace it: overwrite=True")
    beside = path.with_name(f".boresight-{os.getpid()}-{path.name}")
    try:
        beside.write_text(text, encoding="utf-8")
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def _settings(settings: Mapping[str, Any] | None) -> list[str]:
    return [f"{key}={json.dumps(value)}" for key, value in (settings or {}).items()]


def _is_path(view: Any) -> bool:
    return isinstance(view, (str, os.PathLike))


def _views(views: Iterable[Any], board: Board) -> tuple[list[Any], list[str], tuple[int, int] | None]:
    """Corners with covariances, names, and the size of the pictures. What has no board is left out."""
    corners, names, size = [], [], None
    for number, view in enumerate(views):
        if not isinstance(view, Detection):
            array = np.asarray(view)
            if array.dtype == np.uint8:
                view = detect(array, board)
            else:
                points = np.ascontiguousarray(array, dtype=np.float64).reshape(-1, 2)
                # A tenth of a pixel, as long as nothing says otherwise: the fit finds the true factor.
                covariances = np.broadcast_to(np.eye(2) * 0.01, (len(points), 2, 2)).copy()
                corners.append((points, covariances))
                names.append(str(number))
                continue
        if size is not None and view.image_size != size:
            raise ValueError(f"pictures of one calibration have one size: {size} and {view.image_size}")
        size = view.image_size
        if view.corners_px is not None:
            corners.append((view.corners_px, view.covariances_px2))
            names.append(str(number))
    return corners, names, size


def calibrate(
    views: Iterable[Any],
    board: BoardLike,
    *,
    square_mm: float | None = None,
    image_size: tuple[int, int] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Calibration:
    """Calibrates a camera from views of ``board``.

    ``views`` are names of picture files, pictures, :class:`Detection` s, or arrays of N x 2 corners row by row over the
    board, NaN where a corner is missing; the last need ``image_size``, width and height in pixels. Pictures without the board are left out.
    ``settings`` are those of ``config/default.toml``, such as ``{"calibration.varying_focal": True}``.

    With names of files the result is what ``boresight calibrate --json`` prints, bit for bit.
    """
    board = Board.of(board, square_mm)
    views = list(views)
    if views and all(map(_is_path, views)):
        files = [os.fspath(view) for view in views]
        text = _boresight.calibrate_files(files, board._named(), _settings(settings))
        return Calibration(json.loads(text))
    if any(map(_is_path, views)):
        raise TypeError("views are all names of files, or none is")
    corners, names, size = _views(views, board)
    size = size or image_size
    if size is None:
        raise ValueError("corners don't tell the size of their pictures: image_size=(width, height)")
    text = _boresight.calibrate_corners(corners, names, board._named(), size, _settings(settings))
    return Calibration(json.loads(text))


def check(
    views: Any,
    against: PathLike,
    board: BoardLike | None = None,
    *,
    square_mm: float | None = None,
    image_size: tuple[int, int] | None = None,
) -> dict[str, Any]:
    """Has the camera changed since the calibration in the file ``against``?

    ``views`` is a session folder, or views of ``board`` as for :func:`calibrate`. Returns ``check.json`` as a dict:
    ``verdict`` is "ok", "watch" or "recalibrate", or None with a ``reason``; ``visible`` is the smallest change that
    would have been found.
    """
    if _is_path(views):
        return json.loads(_boresight.check_session(os.fspath(views), os.fspath(against)))
    if board is None:
        raise TypeError("views without a session need their board")
    board = Board.of(board, square_mm)
    corners, _, size = _views(views, board)
    size = size or image_size
    if size is None:
        raise ValueError("corners don't tell the size of their pictures: image_size=(width, height)")
    return json.loads(_boresight.check_corners(corners, os.fspath(against), board._named(), size))


def read(session: PathLike) -> dict[str, Any]:
    """What a session folder records: header, and under "calibration" that of its recorded views by this version."""
    return json.loads(_boresight.read_session(os.fspath(session)))


def replay(
    session: PathLike,
    *,
    settings: Mapping[str, Any] | None = None,
    redetect: bool = False,
    threads: int = 1,
) -> dict[str, Any]:
    """Makes every decision of a recorded session again, as ``boresight replay --json``.

    With ``settings``, such as ``{"guidance.hold_secs": 0.5}``, other limits are tried; with ``redetect``, the board
    is found again in the stored pictures. The session isn't changed. ``["decisions"]`` says what differs.
    """
    return json.loads(_boresight.replay(os.fspath(session), _settings(settings), redetect, threads))


def read_calibration(path: PathLike) -> dict[str, Any]:
    """Reads a calibration of boresight, OpenCV (YAML, JSON), ROS, Kalibr or mrcal, recognised by its content.

    Returns image_size, f_px, pp_px, distortion (k1, k2, p1, p2, k3, k4, k5, k6), whether these are of the fisheye model,
    the 12 x 12 covariance in the order fx, fy, cx, cy and then that of the coefficients if the file states one, rms_px
    and source.
    """
    return json.loads(_boresight.read_calibration(os.fspath(path)))


def export(result: Any, format: str, *, name: str | None = None) -> str:
    """The text of ``result`` in the format of another program, one of :data:`FORMATS`.

    ``result`` is a :class:`Calibration`, a session folder, or a ``calibration.json``. A format that can't hold the lens
    raises :class:`BoresightError`.
    """
    if not isinstance(result, Calibration):
        return _boresight.export(os.fspath(result), format, name)
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "camera.json"
        result.save(path)
        return _boresight.export(str(path), format, name)


@dataclass(frozen=True)
class Advice:
    """What a session says after a frame."""

    #: One short sentence for the person who holds the board.
    text: str
    #: The decision as the journal records it: ``["outcome"]["outcome"]`` is "accepted" if a view was taken.
    decision: Mapping[str, Any]
    #: Views taken so far.
    views: int
    #: Forecast of the views still to take; None once the session is over.
    views_to_go: int | None
    #: "collecting", "complete" or "exhausted".
    progress: str
    #: Verdict on the calibration so far; None before there is one.
    verdict: str | None
    #: Principal point as known so far.
    pp_px: tuple[float, float]
    #: Focal lengths as known so far.
    f_px: tuple[float, float]

    @property
    def taken(self) -> bool:
        """Whether a view was taken from this frame's hold."""
        return self.decision["outcome"]["outcome"] == "accepted"

    @property
    def done(self) -> bool:
        """Whether no more views are needed."""
        return self.progress == "complete"

    @classmethod
    def _of(cls, text: str) -> Advice:
        said = json.loads(text)
        return cls(
            said["advice"],
            said["decision"],
            said["views"],
            said["views_to_go"],
            said["progress"],
            said["verdict"],
            tuple(said["pp_px"]),
            tuple(said["f_px"]),
        )


class Session:
    """A guided session that you feed with frames; it tells what to show next, and takes views by itself.

    It decides exactly as the program does. Nothing is stored: to record a session, use ``boresight guide``.
    """

    def __init__(
        self,
        board: BoardLike,
        image_size: tuple[int, int],
        *,
        square_mm: float | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        """``image_size`` is the width and height of the frames in pixels; ``settings`` as for :func:`calibrate`, such
        as ``{"guidance.plan": "quick"}``."""
        self.board = Board.of(board, square_mm)
        width, height = image_size
        self._session = _boresight.Session(self.board._named(), (width, height), _settings(settings))

    def feed(self, image: Any, time_s: float) -> Advice:
        """Decides about one frame of a stream, captured at ``time_s`` seconds of any clock that doesn't jump."""
        nanos = round(time_s * 1e9)
        return Advice._of(self._session.feed(_grey(image), nanos, False, ""))

    def feed_still(self, image: Any, name: str = "") -> Advice:
        """Decides about a picture by itself, which needs no hold."""
        return Advice._of(self._session.feed(_grey(image), 0, True, name))

    def undo(self) -> Advice:
        """Removes the newest view."""
        return Advice._of(self._session.command("undo"))

    def restore(self) -> Advice:
        """Restores the view that was removed last."""
        return Advice._of(self._session.command("restore"))

    @property
    def calibration(self) -> Calibration:
        """The calibration of the views so far."""
        return Calibration(json.loads(self._session.calibration()))
