"""Pictures to corners."""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass
from typing import Any, Mapping

import numpy as np
import numpy.typing as npt

from . import _boresight
from ._board import Board, BoardLike, Floats
from ._errors import ArgumentError
from ._pictures import grey


@dataclass(frozen=True, eq=False)
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
    corners_px: Floats | None
    #: Covariance of the error of each corner, N x 2 x 2, in px squared, infinite where it isn't seen; None without a
    #: board.
    covariances_px2: Floats | None
    #: Blur in px, contrast, glare and motion in px; None without a board.
    quality: Mapping[str, Any] | None
    #: Width and height of the picture.
    image_size: tuple[int, int]

    def __bool__(self) -> bool:
        return self.found

    @property
    def seen(self) -> npt.NDArray[np.bool_] | None:
        """Whether each corner is seen, N: those that are covered, or outside of the picture, aren't."""
        return None if self.corners_px is None else np.isfinite(self.corners_px[:, 0])

    @property
    def ids(self) -> npt.NDArray[np.int32] | None:
        """Numbers of the corners that are seen, int32, counted row by row from 0: OpenCV's on ChArUco boards."""
        seen = self.seen
        return None if seen is None else np.flatnonzero(seen).astype(np.int32)

    @property
    def sigma_px(self) -> Floats | None:
        """Standard deviation of each corner, N: the root of the mean variance of both axes."""
        if self.covariances_px2 is None:
            return None
        sigma: Floats = np.sqrt(np.trace(self.covariances_px2, axis1=1, axis2=2) / 2)
        return sigma

    def _key(self) -> tuple[Any, ...]:
        arrays = (self.corners_px, self.covariances_px2)
        # Adding zero makes -0.0 equal to 0.0.
        held = tuple(None if array is None else (array + 0.0).tobytes() for array in arrays)
        quality = None if self.quality is None else tuple(sorted(self.quality.items()))
        return (self.found, self.reason, self.board, *held, quality, self.image_size)

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Detection) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        said = self.reason if self.seen is None else f"{self.seen.sum()} of {self.seen.size} corners"
        return f"<Detection of {self.board.columns}x{self.board.rows}: {said}>"


# A detector keeps buffers as large as its pictures, and works on one picture at a time.
_own = threading.local()


def _detector() -> _boresight.Detector:
    detector: _boresight.Detector | None = getattr(_own, "detector", None)
    if detector is None:
        detector = _own.detector = _boresight.Detector()
    return detector


def detect(image: Any, board: BoardLike) -> Detection:
    """Searches ``image`` for ``board``.

    Corners come in rows of ``board.columns``, with the covariance of their error. Of a board that is cut off or covered,
    those that are seen are found if it's certain which they are: on a ChArUco board the markers tell. Otherwise
    ``reason`` says why there are none. Other threads run meanwhile.
    """
    board = Board.of(board)
    picture = grey(image)
    text, corners, covariances = _detector().detect(picture, board._named())
    if corners is not None and covariances is not None:
        corners[np.isinf(covariances[:, 0, 0])] = np.nan
    said = json.loads(text)
    size = (picture.shape[1], picture.shape[0])
    return Detection(said["found"], said["reason"], board, corners, covariances, said["quality"], size)


def find_chessboard_corners(
    image: Any, pattern_size: tuple[int, int], corners: Any = None, flags: int = 0
) -> tuple[bool, npt.NDArray[np.float32] | None]:
    """Like ``cv2.findChessboardCorners`` of OpenCV 4: (found, N x 1 x 2 float32) if all corners are seen, or (False, None).

    ``corners`` and ``flags`` are there for the sake of old calls and change nothing. The corners need no
    ``cv2.cornerSubPix``: that would make them worse.
    """
    columns, rows = pattern_size
    found = detect(image, (columns, rows))
    if found.corners_px is None or not np.isfinite(found.corners_px).all():
        return False, None
    return True, found.corners_px.astype(np.float32).reshape(-1, 1, 2)


def detect_charuco_corners(
    image: Any, board: BoardLike
) -> tuple[npt.NDArray[np.float32] | None, npt.NDArray[np.int32] | None]:
    """The first two results of ``cv2.aruco.CharucoDetector.detectBoard``: corners and their numbers.

    Corners are N x 1 x 2 float32 and ids N x 1 int32, of the N corners that are seen; (None, None) without a board.
    ``board`` is a ChArUco board; whether it has OpenCV's present or "legacy" layout shows in the picture. For object
    points: ``cv2.aruco.CharucoBoard.matchImagePoints(corners, ids)``. The corners need no ``cv2.cornerSubPix``: that
    would make them worse.
    """
    board = Board.of(board)
    if board.dictionary is None:
        raise ArgumentError('a ChArUco board has a dictionary, for example "charuco:8x11:DICT_4X4_50:15mm"')
    found = detect(image, board)
    if found.corners_px is None or found.ids is None:
        return None, None
    corners = found.corners_px[found.seen].astype(np.float32)
    return corners.reshape(-1, 1, 2), found.ids.reshape(-1, 1)
