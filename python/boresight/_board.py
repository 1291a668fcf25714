"""Boards, and how they're named."""

from __future__ import annotations

import operator
import re
from dataclasses import dataclass, replace
from typing import Any, Mapping, Tuple, Union

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError

Floats = npt.NDArray[np.float64]


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
            try:
                columns, rows = (operator.index(count) for count in board)
            except (TypeError, ValueError):
                raise ArgumentError(f"a board is named by two whole numbers, not {board!r}") from None
            board = Board(columns, rows)
        for count in (board.columns, board.rows):
            if not 0 <= count < 65536:
                raise ArgumentError(f"a board's side can't have {count} corners")
        return board if square_mm is None else replace(board, square_mm=float(square_mm))

    @classmethod
    def charuco(
        cls, squares: tuple[int, int], dictionary: str, square_mm: float = 25.0, marker_mm: float | None = None
    ) -> Board:
        """A ChArUco board of so many *squares* in a row and in a column, as ``cv2.aruco.CharucoBoard`` counts them."""
        across, down = squares
        return cls(int(across) - 1, int(down) - 1, square_mm, dictionary, marker_mm)

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Board:
        """The board as ``calibration.json`` states it."""
        markers = data.get("markers") or {}
        return cls(
            data["columns"], data["rows"], data["square_mm"], markers.get("dictionary"), markers.get("side_mm")
        )

    @property
    def points_mm(self) -> Floats:
        """The inner corners on the board, N x 3, row by row, in millimetres.

        The origin is the centre of the grid, as in the poses ``cam_from_board`` of a calibration; z is 0.
        """
        y, x = np.mgrid[0 : self.rows, 0 : self.columns]
        points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
        centred: Floats = (points - points.mean(axis=0)) * self.square_mm
        return centred

    def _named(self) -> tuple[int, int, float, str | None, float | None]:
        return (self.columns, self.rows, float(self.square_mm), self.dictionary, self.marker_mm)


def _counts(text: str) -> tuple[int, int]:
    named = re.fullmatch(r"\s*(\d+)\s*[x×]\s*(\d+)\s*", text, re.IGNORECASE)
    if not named:
        raise ArgumentError(f'a board is named by its inner corners, for example "9x6", not {text!r}')
    return int(named.group(1)), int(named.group(2))


_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


def _charuco(text: str) -> Board:
    named = re.fullmatch(r"charuco:(\d+)[x×](\d+):(\w+)(?::([\d.]+) ?(mm|cm|m|in))?", text.strip(), re.IGNORECASE)
    if not named:
        raise ArgumentError(
            "a ChArUco board is named by its squares, dictionary and marker size, for example "
            f'"charuco:8x11:DICT_4X4_50:15mm", not {text!r}'
        )
    across, down, dictionary, side, unit = named.groups()
    marker_mm = None if side is None else float(side) * _MILLIMETRES[unit.lower()]
    return Board.charuco((int(across), int(down)), dictionary, marker_mm=marker_mm)


BoardLike = Union[Board, str, Tuple[int, int]]
