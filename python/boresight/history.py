"""Every calibration of every camera over time: ``boresight history``."""

from __future__ import annotations

import json
from typing import Any, cast

from . import _boresight
from ._pictures import PathLike

__all__ = ["add", "cameras", "due", "page"]

#: The index that functions use if no other is named.
INDEX = "history.jsonl"


def add(*roots: PathLike, index: PathLike = INDEX) -> dict[str, Any]:
    """Reads the results of the sessions in and below ``roots`` into the index. Sessions that are gone or damaged leave it.

    Returns how many ``sessions`` there are, how many were ``added``, are ``without`` a result, and are ``gone``.
    """
    return cast("dict[str, Any]", json.loads(_boresight.history_add(index, list(roots))))


def cameras(index: PathLike = INDEX) -> list[dict[str, Any]]:
    """Every camera with its ``calibrations`` by time, whether it has ``changed``, and by how much."""
    return [json.loads(line) for line in _boresight.history_cameras(index)]


def due(older_days: float = 180.0, index: PathLike = INDEX) -> list[tuple[str, str | None]]:
    """Cameras without a usable calibration of the last ``older_days`` days, each with the time of its newest."""
    return _boresight.history_due(index, older_days)


def page(index: PathLike = INDEX, *, older_days: float = 180.0) -> str:
    """One page of HTML with every camera's curves."""
    return _boresight.history_page(index, older_days)
