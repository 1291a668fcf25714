"""A guided session that the caller feeds with frames."""

from __future__ import annotations

import json
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Mapping

import numpy as np

from . import _boresight
from ._board import Board, BoardLike, Floats
from ._calibration import Calibration, plain_settings
from ._pictures import PathLike, grey


@dataclass(frozen=True, eq=False)
class Pose:
    """How the board should be held next. Draw it over the picture."""

    #: Where its inner corners should be seen, N x 2, row by row; they may lie outside the picture.
    corners_px: Floats
    #: The edge of the card that carries the board, N x 2, around it.
    card_px: Floats
    #: A curved arrow to the edge that should go away from the camera, N x 2; empty if the board should face it.
    arrow_px: Floats
    #: Angle between the board and the picture.
    tilt_deg: float
    #: Direction in the picture in which the board should recede, clockwise from the right.
    direction_deg: float
    #: Whether a part of the board is wanted beyond the picture's edge.
    leaves_picture: bool


@dataclass(frozen=True, eq=False)
class Advice:
    """What a session says after a frame."""

    #: One short sentence for the person who holds the board.
    text: str
    #: What became of this frame in words: the view it gave, or why it wasn't taken. None if there's nothing to say.
    said: str | None
    #: The pose asked for; None if none is.
    pose: Pose | None
    #: Corners found in this frame, N x 2, NaN where one isn't seen; None without a board.
    corners_px: Floats | None
    #: Whether the session is paused.
    paused: bool
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
        return bool(self.decision["outcome"]["outcome"] == "accepted")

    @property
    def done(self) -> bool:
        """Whether the session is over: no more views are needed, or none that it could ask for would help."""
        return self.progress != "collecting"


def _advice(text: str) -> Advice:
    said = json.loads(text)

    def points(px: Any) -> Floats:
        return np.array(px, dtype=np.float64).reshape(-1, 2)

    target, corners = said["target"], said["corners_px"]
    drawn = ("corners_px", "card_px", "arrow_px")
    return Advice(
        text=said["advice"],
        said=said["said"],
        pose=None if target is None else Pose(**{**target, **{name: points(target[name]) for name in drawn}}),
        corners_px=None if corners is None else points(corners),
        paused=said["paused"],
        decision=said["decision"],
        views=said["views"],
        views_to_go=said["views_to_go"],
        progress=said["progress"],
        verdict=said["verdict"],
        pp_px=(said["pp_px"][0], said["pp_px"][1]),
        f_px=(said["f_px"][0], said["f_px"][1]),
    )


class Session:
    """A guided session that you feed with frames; it tells what to show next, and takes views by itself.

    It decides exactly as the program does. With ``record``, the new folder that it names becomes a session folder: each
    view is on the disk before :meth:`feed` returns, and the program resumes, replays and reports it. End it with
    :meth:`close`, or use it in a ``with`` block.
    """

    def __init__(
        self,
        board: BoardLike,
        image_size: tuple[int, int],
        *,
        square_mm: float | None = None,
        settings: Mapping[str, Any] | None = None,
        record: PathLike | None = None,
        source: str = "python",
    ) -> None:
        """``image_size`` is the width and height of the frames in pixels; ``settings`` as for :func:`calibrate`, such
        as ``{"guidance.plan": "quick"}``; ``source`` is the camera's name in the recording."""
        self.board = Board.sized(board, square_mm)
        width, height = image_size
        self._session = _boresight.Session(
            self.board._named(), (width, height), plain_settings(settings), record, source
        )

    def feed(self, image: Any, time_s: float) -> Advice:
        """Decides about one frame of a stream, captured at ``time_s`` seconds of any clock that doesn't jump."""
        nanos = round(time_s * 1e9)
        return _advice(self._session.feed(grey(image), nanos, False, ""))

    def feed_still(self, image: Any, name: str = "") -> Advice:
        """Decides about a picture by itself, which needs no hold."""
        return _advice(self._session.feed(grey(image), 0, True, name))

    def undo(self) -> Advice:
        """Removes the newest view."""
        return _advice(self._session.command("undo"))

    def restore(self) -> Advice:
        """Restores the view that was removed last."""
        return _advice(self._session.command("restore"))

    def pause(self) -> Advice:
        """Takes no views until :meth:`resume`."""
        return _advice(self._session.command("pause"))

    def resume(self) -> Advice:
        """Goes on after :meth:`pause`."""
        return _advice(self._session.command("resume"))

    def take_now(self) -> Advice:
        """Takes the next frame with a usable board as a view, whatever it adds."""
        return _advice(self._session.command("force"))

    @property
    def calibration(self) -> Calibration:
        """The calibration of the views so far."""
        return Calibration(json.loads(self._session.calibration()))

    def close(self) -> None:
        """Ends a recording: writes its ``calibration.json`` and the corners as ``corners.vnl``. Nothing more may be fed."""
        self._session.close()

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
