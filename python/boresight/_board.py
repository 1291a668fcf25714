"""Boards, and how they're named."""

from __future__ import annotations

import operator
import re
import warnings
from dataclasses import dataclass, replace
from typing import Any, Mapping, Tuple, Union

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError, number

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Board:
    """A checkerboard by its inner corners: a plain one, or a ChArUco board with a marker in each light square; or an
    AprilGrid by the corners of its tags; or a grid of circles by their centres.

    The size of the squares, 25 mm by default, only scales distances: the lens doesn't depend on it. On a ChArUco board,
    the markers are found by their size as a share of a square's, so give both in the same unit.
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
    #: White between the tags of an AprilGrid, as a share of their side, which is ``square_mm``; None on other boards.
    tag_spacing: float | None = None
    #: Number of an AprilGrid's first tag.
    first_tag: int = 0
    #: "symmetric" or "asymmetric" for a grid of circles, whose rows are ``square_mm`` apart; None on other boards.
    circles: str | None = None

    @classmethod
    def of(cls, board: BoardLike, square_mm: float | None = None) -> Board:
        """The board that ``board`` names: a Board, "9x6", (9, 6), "charuco:8x11:DICT_4X4_50:15mm", "aprilgrid:6x6",
        "circles:7x5" or "acircles:4x11".

        "charuco:8x11:DICT_4X4_50:15mm" is a ChArUco board of 8 by 11 *squares*, so 7 by 10 inner corners, with markers
        of 15 mm. The size of the markers can be left out if it's 0.75 of a square. "aprilgrid:6x6" is an AprilGrid of 6
        by 6 *tags*, so 12 by 12 points; if they aren't 0.3 of a tag apart or the first isn't 0, these follow:
        "aprilgrid:6x6:0.25:100". "circles:7x5" has 7 circles in a row, and 5 rows; in "acircles:4x11", every second row is
        shifted, and rows are ``square_mm`` apart, as with OpenCV.
        """
        if isinstance(board, str):
            board = _marked(board) if ":" in board else _counts(board)
        if not isinstance(board, Board):
            try:
                columns, rows = (operator.index(count) for count in board)
            except (TypeError, ValueError):
                raise ArgumentError(f"a board is named by two whole numbers, not {board!r}") from None
            board = Board(columns, rows)
        for count in (board.columns, board.rows):
            if not 0 <= count < 65536:
                raise ArgumentError(f"a board's side can't have {count} corners")
        return board if square_mm is None else replace(board, square_mm=number(square_mm, "square_mm"))

    @classmethod
    def sized(cls, board: BoardLike, square_mm: float | None) -> Board:
        """The board of :meth:`of`, with a ``UserWarning`` if nobody says how large its squares are."""
        if square_mm is None and not isinstance(board, Board):
            warnings.warn(
                f"square_mm isn't given: distances are those of squares of {cls.square_mm:g} mm; the lens is right all the same",
                stacklevel=3,
            )
        return cls.of(board, square_mm)

    @classmethod
    def charuco(
        cls, squares: tuple[int, int], dictionary: str, square_mm: float = 25.0, marker_mm: float | None = None
    ) -> Board:
        """A ChArUco board of so many *squares* in a row and in a column, as ``cv2.aruco.CharucoBoard`` counts them."""
        across, down = squares
        return cls(int(across) - 1, int(down) - 1, square_mm, dictionary, marker_mm)

    @classmethod
    def aprilgrid(
        cls, tags: tuple[int, int], tag_mm: float = 25.0, spacing: float = 0.3, first: int = 0
    ) -> Board:
        """Kalibr's AprilGrid of so many *tags* in a row and in a column; ``spacing`` is its ``tagSpacing``.

        Points are numbered row by row from the upper left; Kalibr numbers them from the lower left.
        """
        across, down = tags
        return cls(2 * int(across), 2 * int(down), tag_mm, tag_spacing=float(spacing), first_tag=int(first))

    @classmethod
    def circle_grid(
        cls, circles: tuple[int, int], square_mm: float = 25.0, asymmetric: bool = False
    ) -> Board:
        """A grid of so many *circles* in a row and rows, as ``cv2.findCirclesGrid`` counts them."""
        across, down = circles
        return cls(int(across), int(down), square_mm, circles="asymmetric" if asymmetric else "symmetric")

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Board:
        """The board as ``calibration.json`` states it."""
        if data.get("circles"):
            counts = (data["columns"], data["rows"])
            return cls.circle_grid(counts, data["square_mm"], data["circles"] == "asymmetric")
        markers = data.get("markers") or {}
        if "tag_spacing" in markers:
            tags = (data["columns"] // 2, data["rows"] // 2)
            return cls.aprilgrid(tags, data["square_mm"], markers["tag_spacing"], markers.get("first_tag", 0))
        return cls(
            data["columns"], data["rows"], data["square_mm"], markers.get("dictionary"), markers.get("side_mm")
        )

    @property
    def points_mm(self) -> Floats:
        """The inner corners, corners of tags, or centres of circles, on the board, N x 3, row by row, in millimetres.

        The origin is midway between the outermost ones, as in the poses ``cam_from_board`` of a calibration; z is 0.
        """
        y, x = np.mgrid[0 : self.rows, 0 : self.columns]
        if self.tag_spacing is not None:
            x, y = (line // 2 * (1 + self.tag_spacing) + line % 2 for line in (x, y))
        if self.circles == "asymmetric":
            x = 2 * x + y % 2
        points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
        centred: Floats = (points - (points.min(axis=0) + points.max(axis=0)) / 2) * self.square_mm
        return centred

    def _named(self) -> tuple[int, int, float, str | None, float | None, tuple[float, int] | None, str | None]:
        tags = None if self.tag_spacing is None else (self.tag_spacing, self.first_tag)
        return (self.columns, self.rows, float(self.square_mm), self.dictionary, self.marker_mm, tags, self.circles)


def _counts(text: str) -> tuple[int, int]:
    named = re.fullmatch(r"\s*(\d+)\s*[x×]\s*(\d+)\s*", text, re.IGNORECASE)
    if not named:
        raise ArgumentError(f'a board is named by its inner corners, for example "9x6", not {text!r}')
    return int(named.group(1)), int(named.group(2))


_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


def _marked(text: str) -> Board:
    kind = text.split(":")[0].strip().lower()
    if kind in ("circles", "acircles"):
        return Board.circle_grid(_counts(text.split(":", 1)[1]), asymmetric=kind == "acircles")
    return _aprilgrid(text) if kind == "aprilgrid" else _charuco(text)


def _aprilgrid(text: str) -> Board:
    named = re.fullmatch(r"aprilgrid:(\d+)[x×](\d+)(?::([\d.]+)(?::(\d+))?)?", text.strip(), re.IGNORECASE)
    if not named:
        raise ArgumentError(
            "an AprilGrid is named by its tags, and by their spacing and the first one's number if they aren't 0.3 and "
            f'0, for example "aprilgrid:6x6" or "aprilgrid:6x6:0.25:100", not {text!r}'
        )
    across, down, spacing, first = named.groups()
    return Board.aprilgrid((int(across), int(down)), spacing=float(spacing or 0.3), first=int(first or 0))


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
