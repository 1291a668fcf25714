"""Corners to lenses, and what a lens does."""

from __future__ import annotations

import json
import warnings
from dataclasses import dataclass, field
from typing import Any, Iterable, Mapping, Sequence, cast

import numpy as np
import numpy.typing as npt

from . import _boresight
from ._board import Board, BoardLike, Floats
from ._detection import Detection, detect
from ._errors import ArgumentError, BoresightError
from ._pictures import PathLike, files, is_path, is_session


def _floats(values: Any, name: str) -> Floats:
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError(f"{name} are numbers, not {type(values).__name__}") from None


def _points(points: Any, dimensions: int) -> Floats:
    """N x ``dimensions`` numbers; OpenCV's N x 1 x ``dimensions`` and a single point are taken, too."""
    array = np.ascontiguousarray(_floats(points, "points"))
    if array.ndim == 0 or array.shape[-1] != dimensions:
        raise ArgumentError(f"points are an array of N x {dimensions}, not of the shape {array.shape}")
    return array.reshape(-1, dimensions)


def _matrix(matrix: Any, name: str) -> Floats:
    array = _floats(matrix, name)
    if array.shape not in ((3, 3), (3, 4)) or not np.isfinite(array).all():
        raise ArgumentError(f"{name} is a matrix of 3 x 3 finite numbers")
    return array[:, :3]


@dataclass(frozen=True, repr=False, eq=False)
class Calibration:
    """A calibration, or the reason why there is none. ``data`` is ``calibration.json`` as a dict.

    Where a method takes pixels or points, they may have OpenCV's shapes; what it returns has one row for each. A row is
    NaN where the lens sees nothing: behind the camera, or outside its field.
    """

    data: Mapping[str, Any] = field(repr=False)

    @classmethod
    def load(cls, path: PathLike, *, image_size: tuple[int, int] | None = None) -> Calibration:
        """The calibration in a file of boresight or another program, recognised by its content, or in a session folder.

        Another program's file has the lens alone: ``verdict`` is "care", because nothing says how certain it is.
        ``image_size`` (width, height) is for a file that doesn't state it.
        """
        return cls(json.loads(_boresight.load(path, image_size)))

    def save(self, path: PathLike, *, overwrite: bool = False) -> None:
        """Writes ``calibration.json`` to ``path``, as a whole or not at all."""
        _boresight.save_text(path, self.to_json(), overwrite)

    def to_json(self) -> str:
        """``boresight.calibration/1``."""
        return json.dumps(self.data)

    @property
    def verdict(self) -> str:
        """"good", "care" or "untrustworthy"."""
        return str(self.data["verdict"])

    @property
    def findings(self) -> Sequence[Mapping[str, str]]:
        """What speaks for or against it: code, severity, message, and what to do."""
        return cast("Sequence[Mapping[str, str]]", self.data["findings"])

    @property
    def ok(self) -> bool:
        """Whether there is a lens that can be used."""
        return self.data["result"] is not None and self.verdict != "untrustworthy"

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = self.data["image_size"]
        return width, height

    @property
    def board(self) -> Board | None:
        """The board, if the file states one."""
        board = self.data.get("board")
        return None if board is None else Board.from_data(board)

    @property
    def points_mm(self) -> Floats | None:
        """The board's inner corners as the views show them, N x 3, row by row: :attr:`Board.points_mm`, unless it's bent or
        its squares aren't square. Residuals are from these; with :attr:`rvecs` and :attr:`tvecs`, ``cv2.projectPoints``
        places them in the pictures."""
        found = (self.data.get("board") or {}).get("points_mm")
        if found is not None:
            return np.array(found, dtype=np.float64)
        return None if self.board is None else self.board.points_mm

    def _result(self) -> Mapping[str, Any]:
        if self.data["result"] is None:
            said = "; ".join(finding["message"] for finding in self.findings)
            action = next((finding["action"] for finding in self.findings), None)
            raise BoresightError(f"there is no calibration: {said}", "NO-CALIBRATION", action)
        return cast("Mapping[str, Any]", self.data["result"])

    def _lens(self) -> _boresight.Lens:
        held: _boresight.Lens | None = self.__dict__.get("_held")
        if held is None:
            self._result()
            held = _boresight.Lens(self.to_json())
            self.__dict__["_held"] = held
        return held

    @property
    def camera_matrix(self) -> Floats:
        """OpenCV's camera matrix, 3 x 3, in pixels."""
        (fx, fy), (cx, cy) = self._result()["f_px"], self._result()["pp_px"]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> Floats:
        """OpenCV's coefficients: k1, k2, p1, p2, k3; for a rational lens k4, k5, k6 follow.

        For a fisheye lens, the k1, k2, k3, k4 of ``cv2.fisheye``.
        """
        lens = self._result()["distortion"]
        if self.is_fisheye:
            names = ["k1", "k2", "k3", "k4"]
        elif any(name in lens for name in ("k4", "k5", "k6")):
            names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]
        else:
            names = ["k1", "k2", "p1", "p2", "k3"]
        return np.array([lens.get(name, 0.0) for name in names], dtype=np.float64)

    @property
    def K(self) -> Floats:
        """:attr:`camera_matrix`."""
        return self.camera_matrix

    @property
    def dist(self) -> Floats:
        """:attr:`distortion`."""
        return self.distortion

    def to_cv2(self) -> tuple[Floats, Floats]:
        """Camera matrix and coefficients, as functions of ``cv2`` take them; those of ``cv2.fisheye`` if
        :attr:`is_fisheye`."""
        return self.K, self.dist

    @property
    def is_fisheye(self) -> bool:
        """Whether the coefficients are those of ``cv2.fisheye``."""
        return bool(self._result()["distortion"].get("fisheye", False))

    @property
    def rms_px(self) -> float | None:
        """Root mean square reprojection residual per coordinate, if it's known. ``cv2.calibrateCamera`` returns √2 times it."""
        rms_px = self._result().get("rms_px")
        return None if rms_px is None else float(rms_px)

    @property
    def sigma(self) -> Mapping[str, Any]:
        """Standard deviations: f_px and pp_px as pairs, and k1, k2, p1, p2, k3."""
        return cast("Mapping[str, Any]", self._stated("sigma"))

    @property
    def covariance(self) -> tuple[list[str], Floats]:
        """Names of the free parameters, and their covariance."""
        named = self._stated("covariance")
        return list(named["order"]), np.array(named["matrix"], dtype=float)

    def _stated(self, name: str) -> Any:
        stated = self._result().get(name)
        if stated is None:
            raise BoresightError("this calibration doesn't say how certain it is", "NO-UNCERTAINTY")
        return stated

    @property
    def views(self) -> Sequence[Mapping[str, Any]]:
        """Every picture: name, whether it's used and why not, pose, residual."""
        return cast("Sequence[Mapping[str, Any]]", self.data.get("views", []))

    def _poses(self) -> list[Mapping[str, Any]]:
        return [view["cam_from_board"] for view in self.views if view["used"]]

    @property
    def rvecs(self) -> Floats:
        """Rotations from board to camera of the used views, N x 3, as ``cv2.Rodrigues`` takes them, in radians."""
        vectors = np.empty((len(self._poses()), 3))
        for vector, pose in zip(vectors, self._poses()):
            w, *xyz = pose["rotation_wxyz"]
            axis = np.array(xyz) * (1.0 if w >= 0 else -1.0)
            sine = float(np.linalg.norm(axis))
            angle = 2 * np.arctan2(sine, abs(w))
            vector[:] = axis * (angle / sine if sine > 0 else 2.0)
        return vectors

    @property
    def tvecs(self) -> Floats:
        """Positions of the board's middle in the camera's frame of the used views, N x 3, in millimetres, as
        :attr:`points_mm`."""
        return np.array([pose["translation_m"] for pose in self._poses()]).reshape(-1, 3) * 1000.0

    def project(self, points: Any) -> Floats:
        """Pixels, N x 2, of N points in the camera's frame: x right, y down, z forward, in any unit."""
        return self._lens().project(_points(points, 3))

    def unproject(self, pixels: Any) -> Floats:
        """Unit vectors, N x 3, in the camera's frame towards what is seen at N pixels."""
        return self._lens().unproject(_points(pixels, 2))

    def undistort_points(self, pixels: Any, R: Any = None, P: Any = None) -> Floats:
        """``cv2.undistortPoints``: where a camera without distortion sees what is seen at N pixels, N x 2.

        ``P`` is that camera's matrix and ``R`` its rotation. Without ``P`` the result is X/Z, Y/Z: ``P=calibration.K``
        gives pixels. NaN for rays at 90 degrees and more from its axis.
        """
        rays = self.unproject(pixels)
        if R is not None:
            rays = rays @ _matrix(R, "R").T
        ahead = np.where(rays[:, 2:] > 0, rays[:, 2:], np.nan)
        flat = rays / ahead
        if P is not None:
            flat = flat @ _matrix(P, "P").T
        return np.ascontiguousarray(flat[:, :2])

    def undistort_map(
        self, size: tuple[int, int] | None = None, new_camera_matrix: Any = None, R: Any = None
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """``cv2.initUndistortRectifyMap``: two maps of float32 for ``cv2.remap``.

        ``size`` is the new picture's width and height, its own by default; ``new_camera_matrix`` the new camera's matrix,
        its own by default, ``R`` its rotation.
        """
        width, height = self.image_size if size is None else size
        matrix = self.K if new_camera_matrix is None else _matrix(new_camera_matrix, "new_camera_matrix")
        if R is not None:
            matrix = matrix @ _matrix(R, "R")
        try:
            ray_from_px = np.linalg.inv(matrix)
        except np.linalg.LinAlgError:
            raise ArgumentError("new_camera_matrix and R have no inverse") from None
        return self._lens().undistort_map(ray_from_px.tolist(), (int(width), int(height)))

    def _certain(self) -> _boresight.Lens:
        lens = self._lens()
        if not lens.is_certain:
            self._stated("covariance_all")
        return lens

    def covariance_at(self, pixels: Any) -> Floats:
        """Covariance of projection at N pixels, N x 2 x 2, in px²: of the image of the ray that is seen there.

        As in mrcal, a turn of the whole camera is no error: it's compensated, as well as it can be, over the picture.
        """
        return self._certain().covariance_at(_points(pixels, 2))

    def uncertainty_at(self, pixels: Any) -> Floats:
        """Standard deviation of projection at N pixels, N, in pixels: the root of the mean variance of both axes of
        :meth:`covariance_at`."""
        sigma: Floats = np.sqrt(np.trace(self.covariance_at(pixels), axis1=1, axis2=2) / 2)
        return sigma

    def bearing_covariance(self, pixels: Any) -> Floats:
        """Covariance of the unit vectors of :meth:`unproject`, N x 3 x 3, in rad²; its null space is the vector."""
        return self._certain().bearing_covariance(_points(pixels, 2))

    def __eq__(self, other: object) -> bool:
        return self.data == other.data if isinstance(other, Calibration) else NotImplemented

    def __hash__(self) -> int:
        return hash(json.dumps(self.data, sort_keys=True))

    def __getstate__(self) -> dict[str, Any]:
        return {"data": self.data}

    def __repr__(self) -> str:
        width, height = self.image_size
        if self.data["result"] is None:
            return f"<Calibration of {width}x{height}: none, {self.verdict}>"
        (fx, fy), (cx, cy) = self._result()["f_px"], self._result()["pp_px"]
        return f"<Calibration of {width}x{height}: {self.verdict}, f {fx:.2f} {fy:.2f}, pp {cx:.2f} {cy:.2f}>"


def plain_settings(settings: Mapping[str, Any] | None, within: str = "") -> list[str]:
    """KEY=VALUE of settings, which may be nested, with numpy's numbers among them."""
    said = []
    for key, value in (settings or {}).items():
        if isinstance(value, Mapping):
            said += plain_settings(value, f"{within}{key}.")
            continue
        plain = value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value
        said.append(f"{within}{key}={json.dumps(plain)}")
    return said


def _given(view: Any, board: Board) -> tuple[tuple[Floats, Floats] | None, str, tuple[int, int] | None]:
    """Corners with covariances, or why there are none; and the size of the picture."""
    if view is None:
        return None, "no view", None
    if not isinstance(view, Detection):
        array = np.asarray(view)
        if array.shape[-1:] == (2,) and array.dtype not in (np.uint8, np.uint16):
            points = np.ascontiguousarray(array, dtype=np.float64).reshape(-1, 2)
            if len(points) != board.columns * board.rows:
                raise ArgumentError(
                    f"each view needs the board's {board.columns * board.rows} corners, row by row, not {len(points)}"
                )
            # A tenth of a pixel, as long as nothing says otherwise: the fit finds the true factor.
            covariances = np.broadcast_to(np.eye(2) * 0.01, (len(points), 2, 2)).copy()
            return (points, covariances), "", None
        view = detect(array, board)
    if view.corners_px is None or view.covariances_px2 is None:
        return None, view.reason or "no board", view.image_size
    return (view.corners_px, view.covariances_px2), "", view.image_size


def given_views(
    views: Iterable[Any], board: Board, image_size: tuple[int, int] | None
) -> tuple[list[tuple[str, tuple[Floats, Floats] | None, str]], tuple[int, int]]:
    """Every view with its corners or why it has none, and the size of the pictures."""
    given = []
    size = None if image_size is None else (int(image_size[0]), int(image_size[1]))
    for number, view in enumerate(views):
        corners, reason, seen_size = _given(view, board)
        if seen_size is not None:
            if size is not None and seen_size != size:
                raise ArgumentError(f"pictures of one calibration have one size: {size} and {seen_size}")
            size = seen_size
        given.append((str(number), corners, reason))
    if not given:
        raise ArgumentError("there are no views")
    if size is None:
        raise ArgumentError("corners don't tell the size of their pictures: image_size=(width, height)")
    return given, size


def calibrate(
    views: Iterable[Any] | PathLike,
    board: BoardLike | None = None,
    *,
    square_mm: float | None = None,
    image_size: tuple[int, int] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Calibration:
    """Calibrates a camera from views of ``board``.

    ``views`` are names of picture files, pictures, :class:`Detection` s, or arrays of N x 2 corners row by row over the
    board, NaN where a corner is missing; the last need ``image_size``, width and height in pixels. Instead of a list,
    it may be a pattern such as "pictures/*.png", a folder of pictures, or a session folder, which needs no ``board``:
    its journal has the corners.

    Views without the board, None, and views whose corners can't be the board's are left out: :attr:`Calibration.views`
    says why. Without ``square_mm``, and without a :class:`Board` that states it, squares are taken to have 25 mm, with a
    warning: ``tvecs`` and other distances are wrong if they haven't. ``settings`` are those of ``config/default.toml``, such as ``{"calibration.varying_focal": True}``.

    With names of files the result is what ``boresight calibrate --json`` prints, bit for bit.
    """
    said = plain_settings(settings)
    if is_path(views):
        path = cast("PathLike", views)
        if is_session(path):
            if board is not None:
                raise ArgumentError("a session knows its board: leave it out")
            return Calibration(json.loads(_boresight.calibrate_session(path, said)))
        views = files(path)
    if board is None:
        raise ArgumentError("views need their board, for example \"9x6\"")
    board = Board.sized(board, square_mm)
    views = list(cast("Iterable[Any]", views))
    if views and all(map(is_path, views)):
        text = _boresight.calibrate_files(views, board._named(), said)
        return Calibration(json.loads(text))
    if any(map(is_path, views)):
        raise ArgumentError("views are all names of files, or none is")
    given, size = given_views(views, board, image_size)
    return Calibration(json.loads(_boresight.calibrate_corners(given, board._named(), size, said)))


def _older(against: PathLike | Calibration) -> tuple[PathLike, str | None]:
    return ("", against.to_json()) if isinstance(against, Calibration) else (against, None)


def check(
    views: Any,
    against: PathLike | Calibration,
    board: BoardLike | None = None,
    *,
    square_mm: float | None = None,
    image_size: tuple[int, int] | None = None,
    limit_px: float | None = None,
) -> dict[str, Any]:
    """Has the camera changed since ``against``, a calibration or the file that holds one?

    ``views`` is a session folder, or views of ``board`` as for :func:`calibrate`. Returns ``check.json`` as a dict:
    ``verdict`` is "ok" if any change is surely within ``limit_px`` (by default .08 % of the width) anywhere in the
    picture, "recalibrate" if it's surely beyond, else "cannot-tell", or None with a ``reason``; ``visible`` is the
    smallest change that would have been found. A file of another program states no uncertainty and has no verdict
    ("NOT-JUDGED"): :func:`judge` it first.
    """
    file, old = _older(against)
    if is_path(views):
        return cast("dict[str, Any]", json.loads(_boresight.check_session(views, file, old, limit_px)))
    if board is None:
        raise ArgumentError("views without a session need their board")
    board = Board.of(board, square_mm)
    given, size = given_views(views, board, image_size)
    text = _boresight.check_corners((given, board._named(), size), file, old, limit_px)
    return cast("dict[str, Any]", json.loads(text))


def judge(
    file: PathLike | Calibration,
    views: Any = None,
    board: BoardLike | None = None,
    *,
    square_mm: float | None = None,
    image_size: tuple[int, int] | None = None,
    accept: str | None = None,
) -> dict[str, Any]:
    """Is the calibration in ``file``, of any program, true?

    ``views`` is a session folder, or views of ``board`` as for :func:`calibrate` but no names of files. Without them, the
    file's own corners are used, which OpenCV's sample and PhotonVision write; else only what the file alone shows is
    said. Returns ``boresight.judgement/1`` as a dict: ``answer`` is "true" if the error is surely within ``accept``
    ("1px", or "length 800mm at 2m <= 0.5mm"; by default .2 % of the picture's longer side), "off" if it's surely beyond,
    else "cannot-tell"; ``off_px`` is the error with
    ``off_interval_px``, ``wrong`` the part of the lens that explains it, ``doubts`` the reasons in words.
    """
    name, old = _older(file)
    given: tuple[Any, Any, tuple[int, int]] | None = None
    session: PathLike | None = None
    if views is not None and is_path(views):
        session = cast("PathLike", views)
    elif views is not None:
        if board is None:
            raise ArgumentError("views without a session need their board")
        board = Board.of(board, square_mm)
        seen, size = given_views(views, board, image_size)
        given = (seen, board._named(), size)
    return cast("dict[str, Any]", json.loads(_boresight.judge(name, old, given, session, accept)))


def export(result: Calibration | PathLike, format: str, *, name: str | None = None) -> str:
    """The text of ``result`` in the format of another program, one of :data:`FORMATS`.

    ``result`` is a :class:`Calibration`, a session folder, or a calibration file of any program. A format that can't
    hold the lens raises :class:`BoresightError`. If the board was bent or uneven, a warning says so: the lens belongs to
    :attr:`Calibration.points_mm`.
    """
    file, text = _older(result)
    written, note = _boresight.export(file, text, format, name)
    if note is not None:
        warnings.warn(note, stacklevel=2)
    return written
