"""Arrays as grey pictures, and files by name."""

from __future__ import annotations

import glob
import os
from pathlib import Path
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError, BoresightError

PathLike = Union[str, "os.PathLike[str]"]
Grey = npt.NDArray[np.uint8]

_PICTURES = {".png", ".jpg", ".jpeg"}


def is_path(view: Any) -> bool:
    return isinstance(view, (str, os.PathLike))


def is_session(path: PathLike) -> bool:
    """Whether a recorded session is in this folder."""
    return (Path(path) / "session.toml").is_file()


def files(named: PathLike) -> list[str]:
    """The pictures that a pattern, a folder or a file's name stands for, sorted."""
    name = os.fspath(named)
    if os.path.isdir(name):
        found = [str(path) for path in Path(name).iterdir() if path.suffix.lower() in _PICTURES]
    elif glob.has_magic(name) and not os.path.exists(name):
        found = glob.glob(name)
    else:
        return [name]
    if not found:
        raise BoresightError(f"no pictures: {name}", "NO-PICTURES", "Check the name.")
    return sorted(found)


def grey(image: Any) -> Grey:
    """``image`` in grey, 8 bits deep. Colours are weighed as OpenCV weighs them.

    uint16 keeps the 8 highest of the bits in use: of 8, 10, 12, 14 or 16, the fewest that hold the brightest pixel.
    Floating point is 0 to 1, or 0 to 255 if anything is above 1, as far as it's finite.
    """
    if is_path(image):
        raise ArgumentError(
            f"a picture is an array, not the name {os.fspath(image)!r}", "ARGUMENT", "Read the file: cv2.imread(name)."
        )
    array = np.asarray(image)
    if array.dtype == np.uint16:
        bits = int(array.max(initial=0)).bit_length()
        array = (array >> (min(depth for depth in (8, 10, 12, 14, 16) if depth >= bits) - 8)).astype(np.uint8)
    elif np.issubdtype(array.dtype, np.floating):
        if not np.isfinite(array).all():
            raise ArgumentError("a picture of floating point needs finite numbers")
        scale = 255.0 if array.max(initial=0) <= 1 else 1.0
        array = np.clip(np.rint(array * scale), 0, 255).astype(np.uint8)
    elif array.dtype != np.uint8:
        raise ArgumentError(
            f"a picture is an array of uint8, uint16 or floating point, not {array.dtype}",
            "ARGUMENT",
            "Convert it: image.astype(numpy.uint8).",
        )
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    elif array.ndim == 3 and array.shape[2] in (3, 4):
        blue, green, red = (array[:, :, i].astype(np.uint32) for i in range(3))
        array = ((blue * 1868 + green * 9617 + red * 4899 + 8192) >> 14).astype(np.uint8)
    if array.ndim != 2 or 0 in array.shape:
        raise ArgumentError(f"a picture has rows, columns and perhaps 3 colours, not the shape {array.shape}")
    return array
