"""Boards to print, and reports."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, Mapping, cast

from . import _boresight
from ._board import Board, BoardLike
from ._calibration import Calibration, plain_settings
from ._errors import ArgumentError, number
from ._pictures import PathLike


def target(
    path: PathLike,
    board: BoardLike = "9x6",
    *,
    square_mm: float | None = None,
    paper: str = "a4",
    overwrite: bool = False,
) -> dict[str, Any]:
    """Writes a board to print to ``path``, *.pdf, *.svg or *.png, in its true size: ``boresight target``.

    Without ``square_mm`` the squares are as large as fits on ``paper``: "a4", "a3" or "letter". Returns what
    ``target --json`` prints; ``["board"]["square_mm"]`` is the side to measure on the print.
    """
    named = Board.of(board, square_mm)
    kind = os.path.splitext(os.fspath(path))[1].lstrip(".").lower()
    content, told = _boresight.sheet(named._named(), square_mm is not None, paper, kind, path)
    try:
        with open(path, "wb" if overwrite else "xb") as file:
            file.write(content)
    except FileExistsError:
        raise ArgumentError(f"there is already a file {os.fspath(path)!r}", "FILE-EXISTS", "overwrite=True replaces it.") from None
    return cast("dict[str, Any]", json.loads(told))


def plan_board(
    distance_m: float,
    board: BoardLike = "9x6",
    *,
    fov_deg: float | None = None,
    f_px: float | None = None,
    image_size: tuple[int, int] = (1280, 720),
) -> dict[str, Any]:
    """Which board to print for a camera, from the distance at which it's held and the field of view across the picture,
    or the focal length: ``boresight plan-board --json``."""
    if (fov_deg is None) == (f_px is None):
        raise ArgumentError("give the field of view, fov_deg, or the focal length, f_px")
    width, height = image_size
    if f_px is None:
        assert fov_deg is not None
        if not 1 <= fov_deg <= 150:
            raise ArgumentError("fov_deg is from 1 to 150; for a fisheye lens, give f_px")
        f_px = width / 2 / math.tan(math.radians(fov_deg) / 2)
    told = _boresight.board_plan(Board.of(board)._named(), (int(width), int(height)), number(f_px, "f_px"), number(distance_m, "distance_m"))
    return cast("dict[str, Any]", json.loads(told))


def report(result: Calibration | PathLike, *, settings: Mapping[str, Any] | None = None) -> str:
    """The certificate and report of a calibration, or of a session folder or calibration file, as one page of HTML.

    ``settings`` fill in the first sheet, such as ``{"certificate.customer": "Mill Ltd"}``.
    """
    said = plain_settings(settings)
    if isinstance(result, Calibration):
        return _boresight.report_page(Path("calibration.json"), result.to_json(), said)
    return _boresight.report_page(Path(result), None, said)
