"""Depths of a picture: NumPy arrays, and grey pictures of 16 bits or of floats, as depth cameras write."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import FARTHEST, LARGEST, SMALLEST, check_number
from ..errors import FileError
from .files import PathLike, read_bytes
from .image import decode
from .npy import read_arrays


def read_depth(path: PathLike, unit: float = 1.0) -> NDArray[np.float32]:
    """Read depths (H, W) along the camera's axis, rows from the top.

    Parameters
    ----------
    path : path
        A .npy file, or a grey picture of 16 bits or of floats (PNG, TIFF).
    unit : float
        What its numbers are multiplied by: 0.001 for millimetres where metres are wanted.

    Returns
    -------
    ndarray of shape (H, W), float32
        inf where there is none: where the file has 0, NaN or inf.

    Raises
    ------
    FileError
        The file is missing, damaged, of another shape or kind, holds depths below 0, or none from 1e-30 to 1e15.
    """
    unit = check_number("unit", unit, SMALLEST, LARGEST)
    if Path(path).suffix.lower() == ".npy":
        found = read_arrays(path)
    else:
        found = decode(read_bytes(path), f"{path}", _as_depth)
    if not isinstance(found, np.ndarray) or found.ndim != 2 or found.size == 0 or found.dtype.kind not in "iuf":
        what = f"shape {found.shape} {found.dtype}" if isinstance(found, np.ndarray) else "several arrays"
        raise FileError(f"{path}: expected depths (H, W), found {what}")
    if (found < 0).any():
        raise FileError(f"{path}: expected depths ≥ 0 (0: none), found {found.min():g}")
    with np.errstate(over="ignore", under="ignore"):
        depth = (found * np.float64(unit)).astype(np.float32)
    low, high = SMALLEST / unit, FARTHEST / unit
    depth[~(depth > 0)] = np.inf
    known = (found > 0) & (found < np.inf)
    if known.any() and not (known & (found >= low) & (found <= high)).any():
        first = found[known].flat[0]
        raise FileError(f"{path}: expected depths from {low:g} to {high:g} (0: none), found {first:g} and the like")
    return depth


def _as_depth(image: Any, name: str) -> NDArray[Any]:
    """Pixels of a PIL image of depths."""
    if not image.mode.startswith("I") and image.mode != "F":
        kinds = {"L": "8 bits", "1": "1 bit", "P": "8 bits"}
        raise FileError(
            f"{name}: expected a grey picture of 16 bits or of floats, found {kinds.get(image.mode, image.mode)}"
        )
    return np.asarray(image)
