"""What can't be done: one class of errors, with a stable code."""

from __future__ import annotations

from typing import Optional


class BoresightError(Exception):
    """Something couldn't be done: ``message``, a stable ``code``, and ``next``, what to do about it, or None."""

    def __init__(self, message: str, code: str = "FAILED", next: Optional[str] = None) -> None:
        super().__init__(message, code, next)

    def __str__(self) -> str:
        return self.message

    @property
    def message(self) -> str:
        """What happened."""
        return str(self.args[0])

    @property
    def code(self) -> str:
        """Stable name."""
        return str(self.args[1])

    @property
    def next(self) -> str | None:
        """What to do about it, or None."""
        said = self.args[2]
        return None if said is None else str(said)


class ArgumentError(BoresightError, ValueError):
    """An argument that can't be used: a :class:`BoresightError` with the code ``ARGUMENT``, and a ``ValueError``."""

    def __init__(self, message: str, code: str = "ARGUMENT", next: Optional[str] = None) -> None:
        super().__init__(message, code, next)
