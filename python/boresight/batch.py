"""Many sessions at once: one row a session, whoever runs them.

>>> from concurrent.futures import ProcessPoolExecutor
>>> with ProcessPoolExecutor() as pool:                                 # doctest: +SKIP
...     rows = list(pool.map(boresight.batch.work, boresight.batch.sessions("sessions")))

Dask and Ray map :func:`work` in the same way. A session that can't be worked on is a row with a ``code`` other than "OK".
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any, Mapping, cast

from . import _boresight
from ._calibration import plain_settings
from ._errors import ArgumentError
from ._pictures import PathLike

__all__ = ["ACTIONS", "plan", "rows", "sessions", "work"]

#: What :func:`work` does with a session.
ACTIONS = ("replay", "redetect", "calibrate", "check", "report", "export")


def plan(*roots: PathLike) -> list[dict[str, Any]]:
    """The sessions in and below folders, as ``boresight batch plan`` prints them: ``session``, its absolute path, and
    ``content``, the hash of what it holds."""
    return [json.loads(line) for line in _boresight.batch_plan(list(roots))]


def sessions(*roots: PathLike) -> list[str]:
    """The paths of the sessions in and below folders, in order."""
    return [str(item["session"]) for item in plan(*roots)]


def work(
    session: PathLike,
    action: str = "calibrate",
    *,
    settings: Mapping[str, Any] | None = None,
    against: PathLike | None = None,
    format: str | None = None,
    out: PathLike | None = None,
) -> dict[str, Any]:
    """Does one of :data:`ACTIONS` with a session, and returns its row, as ``batch run`` and ``batch gather`` do.

    ``against`` is the calibration that "check" compares with, by default the one that the session names. "report" and
    "export", in ``format``, write into the folder ``out``, which they need; the row's ``file`` names what was written.
    """
    if action not in ACTIONS:
        raise ArgumentError(f"there is no action {action!r}: {', '.join(ACTIONS)}")
    said = plain_settings(settings)
    if action == "export":
        format = format or "opencv-yaml"
    if out is not None:
        return _row(session, action, said, against, format, out)
    if action in ("report", "export"):
        raise ArgumentError(f"{action!r} writes files: out=FOLDER")
    with tempfile.TemporaryDirectory(prefix="boresight-") as nothing:
        return _row(session, action, said, against, format, nothing)


def _row(
    session: PathLike, action: str, settings: list[str], against: PathLike | None, format: str | None, out: PathLike
) -> dict[str, Any]:
    row = _boresight.batch_work(Path(session), action, (settings, against, format), Path(out))
    return cast("dict[str, Any]", json.loads(row))


def rows(out: PathLike) -> list[dict[str, Any]]:
    """The rows of a batch that ``boresight batch run`` made in the folder ``out``, as ``batch gather`` prints them."""
    return [json.loads(line) for line in _boresight.batch_rows(out)]
