"""Camera calibration that says whether to believe it.

Pixel (0, 0) is the centre of the top-left pixel, x points right, y down. Lengths are in pixels unless a name says
otherwise; the lens is OpenCV's. A board is named by its inner corners, columns x rows: "9x6" is a
board of 10 by 7 squares. A ChArUco board is named by its squares, as other programs do, with the dictionary and the
side of a marker: "charuco:8x11:DICT_4X4_50:15mm".

Pictures are arrays: rows x columns, or rows x columns x 3 in OpenCV's order, blue, green, red. They're uint8; uint16
keeps its 8 highest bits in use, floating point is 0 to 1 or 0 to 255.

>>> import boresight
>>> found = boresight.detect(image, "9x6")              # doctest: +SKIP
>>> result = boresight.calibrate(images, "9x6", square_mm=25)    # doctest: +SKIP
>>> result.verdict, result.camera_matrix                # doctest: +SKIP

Whatever can't be done raises :class:`BoresightError`, with a stable ``code`` and ``next``, what to do about it; it
pickles. :class:`ArgumentError`, for an argument that can't be used, is one of them and a ``ValueError``. A board
that isn't found is no error: ``found.reason`` says why.
"""

from __future__ import annotations

import json
from typing import Any, Mapping, cast

from . import _boresight, batch, history
from ._board import Board, BoardLike
from ._boresight import __version__
from ._calibration import Calibration, calibrate, check, export, judge, plain_settings
from ._detection import Detection, detect, detect_charuco_corners, find_chessboard_corners
from ._errors import ArgumentError, BoresightError
from ._pictures import PathLike
from ._session import Advice, Pose, Session
from ._tools import plan_board, report, target

__all__ = [
    "Advice",
    "ArgumentError",
    "Board",
    "BoardLike",
    "BoresightError",
    "Calibration",
    "Detection",
    "FORMATS",
    "PathLike",
    "Pose",
    "Session",
    "batch",
    "calibrate",
    "check",
    "detect",
    "detect_charuco_corners",
    "export",
    "find_chessboard_corners",
    "history",
    "judge",
    "plan_board",
    "read",
    "read_calibration",
    "replay",
    "report",
    "target",
    "__version__",
]

#: Names of the formats that :func:`export` writes.
FORMATS: tuple[str, ...] = tuple(_boresight.formats())

for _public in (
    Advice, ArgumentError, Board, BoresightError, Calibration, Detection, Pose, Session, calibrate, check, detect,
    detect_charuco_corners, export, find_chessboard_corners, judge, plan_board, report, target,
):  # fmt: skip
    # What users see, and pickles name, is the package; where the source lies may change.
    _public.__module__ = __name__
del _public


def read(session: PathLike) -> dict[str, Any]:
    """What a session folder records: header, and under "calibration" that of its recorded views by this version."""
    return cast("dict[str, Any]", json.loads(_boresight.read_session(session)))


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
    text = _boresight.replay(session, plain_settings(settings), redetect, threads)
    return cast("dict[str, Any]", json.loads(text))


def read_calibration(path: PathLike) -> dict[str, Any]:
    """Reads a calibration of boresight or another program, recognised by its content, as numbers. As a
    :class:`Calibration`: :meth:`Calibration.load`.

    Returns image_size, f_px, pp_px, distortion (k1, k2, p1, p2, k3, k4, k5, k6), whether these are of the fisheye model,
    the 12 x 12 covariance in the order fx, fy, cx, cy and then that of the coefficients if the file states one, rms_px
    and source.
    """
    return cast("dict[str, Any]", json.loads(_boresight.read_calibration(path)))
