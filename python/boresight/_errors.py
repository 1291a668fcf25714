"""What can't be done: one class of errors, with a stable code."""

from __future__ import annotations

from typing import Any


class BoresightError(Exception):
    """Something couldn't be done: ``message``, a stable ``code``, and ``next``, what to do about it, or None."""

    # Attributes, not properties: programs that wrap an error of another process pass them on.

    #: What happened.
    message: str
    #: Stable name.
    code: str
    #: What to do about it, or None.
    next: str | None

    def __init__(self, message: str, code: str = "FAILED", next: str | None = None) -> None:
        super().__init__(message, code, next)
        self.message, self.code, self.next = message, code, next

    def __str__(self) -> str:
        return self.message


class ArgumentError(BoresightError, ValueError):
    """An argument that can't be used: a :class:`BoresightError` with the code ``ARGUMENT``, and a ``ValueError``."""

    def __init__(self, message: str, code: str = "ARGUMENT", next: str | None = None) -> None:
        super().__init__(message, code, next)


def number(value: Any, name: str) -> float:
    """``value`` as a number, or an :class:`ArgumentError` that calls it ``name``."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ArgumentError(f"{name} is a number, not {value!r}") from None
