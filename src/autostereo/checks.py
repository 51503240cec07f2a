"""Checks of what a user hands over: one number in a range, arrays of real numbers.

One rule of size. Engines calculate in float32, so every number of a scene lies within ±LARGEST, which float32 holds;
places and lengths in the world, which are multiplied with each other, within ±FARTHEST, whose square it holds; and a
length of rigs and voxels that has to be > 0 is at least SMALLEST.
"""

from __future__ import annotations

import numbers
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

LARGEST = 1e30
FARTHEST = 1e15
SMALLEST = 1e-30
MAX_VIEWS = 4096
FOV_RANGE = (0.001, 179.0)  # degrees
ASPECT_RANGE = (1e-6, 1e6)
KINDS = {"c": "complex numbers", "U": "text", "S": "bytes", "M": "dates", "m": "spans of time", "V": "records"}

Vector = tuple[float, float, float]


def shown(value: object) -> str:
    """A value as errors quote it, shortened."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def check_number(name: str, value: object, low: float = -np.inf, high: float = np.inf) -> float:
    """Return one finite real number of [low, high] as a float, or raise InputError."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise InputError(f"{name}: expected a number, got {shown(value)}")
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        number = np.inf
    if not np.isfinite(number) or not low <= number <= high:
        if low == -np.inf and high == np.inf:
            wanted = "a finite number"
        else:
            wanted = f"a finite number ≥ {low:g}" if high == np.inf else f"a number from {low:g} to {high:g}"
        raise InputError(f"{name}: expected {wanted}, got {shown(value)}")
    return number


def check_choice(name: str, value: object, choices: Iterable[str]) -> str:
    """Return a word of `choices`, or raise InputError; arrays and lists are none."""
    if not isinstance(value, str) or value not in choices:
        raise InputError(f"{name}: expected one of {', '.join(choices)}, got {shown(value)}")
    return value


def check_pair(name: str, value: object, expected: str) -> tuple[object, object]:
    """Return the two items of a sequence or an array, whatever they are, or raise InputError."""
    row = isinstance(value, Sequence) and not isinstance(value, (str, bytes))
    if not (row or (isinstance(value, np.ndarray) and value.ndim == 1)) or len(value) != 2:  # type: ignore[arg-type]
        raise InputError(f"{name}: expected {expected}, got {shown(value)}")
    return value[0], value[1]  # type: ignore[index]


def check_vector(name: str, value: object, high: float = LARGEST) -> Vector:
    """Return three numbers within ±high as a tuple, or raise InputError."""
    v = plain_numbers(name, value, "three numbers").astype(np.float64)
    if v.shape != (3,) or not np.isfinite(v).all():
        raise InputError(f"{name}: expected three finite numbers, got {shown(value)}")
    if np.abs(v).max() > high:
        raise InputError(f"{name}: expected three numbers within ±{high:g}, got {shown(value)}")
    return (float(v[0]), float(v[1]), float(v[2]))


def check_direction(name: str, value: object) -> Vector:
    """Return three numbers within ±LARGEST that are no vector of length 0, or raise InputError."""
    v = check_vector(name, value)
    if max(map(abs, v)) < SMALLEST:
        raise InputError(f"{name}: expected a vector of some length (≥ {SMALLEST:g}), got {shown(value)}")
    return v


def check_views(value: object, name: str = "views") -> int:
    """Return a number of views 1…MAX_VIEWS, or raise InputError."""
    return check_count(name, value, MAX_VIEWS)


def check_count(name: str, value: object, high: int | None = None) -> int:
    """Return a whole number ≥ 1, and ≤ high if there is one, as an int, or raise InputError."""
    if not _is_count(value, high):
        wanted = "≥ 1" if high is None else f"1…{high}"
        raise InputError(f"{name}: expected a whole number {wanted}, got {shown(value)}")
    return int(value)  # type: ignore[call-overload]


def check_counts(name: str, value: object, high: int | None = None) -> tuple[int, int]:
    """Return two such numbers, of a tuple, a list or an array, or raise InputError."""
    pair = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(pair, (tuple, list)) or len(pair) != 2 or not all(_is_count(number, high) for number in pair):
        wanted = "≥ 1" if high is None else f"from 1 to {high}"
        raise InputError(f"{name}: expected two whole numbers {wanted}, got {shown(value)}")
    return (int(pair[0]), int(pair[1]))


def _is_count(value: object, high: int | None) -> bool:
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    return whole and 1 <= value and (high is None or value <= high)  # type: ignore[operator]


def real_array(name: str, value: object, expected: str = "an array of numbers") -> NDArray[Any]:
    """Return an array of booleans, integers or floats as NumPy makes it of `value`, or raise InputError.

    NumPy would take the real part of complex numbers, read text as numbers, count dates and uncover what is masked.
    """
    check_unmasked(name, value, expected)
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O" and all(isinstance(item, numbers.Real) for item in array.flat):
            array = array.astype(np.float64)  # whole numbers of more than 64 bits, fractions
    except OverflowError:
        raise InputError(f"{name}: expected {expected} within ±{LARGEST:g}, got {shown(value)}") from None
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected {expected}, got {type(value).__name__} of uneven rows") from None
    if array.dtype.kind not in "biuf":
        found = KINDS.get(array.dtype.kind) if isinstance(value, (np.ndarray, list, tuple)) else None
        raise InputError(f"{name}: expected {expected}, got {found or type(value).__name__}")
    return array


def check_unmasked(name: str, value: object, expected: str = "an array of numbers") -> None:
    """Raise InputError where entries of an array are masked: NumPy would uncover them."""
    hidden = int(np.ma.count_masked(value)) if isinstance(value, np.ma.MaskedArray) else 0
    if hidden:
        raise InputError(f"{name}: expected {expected}, none of them masked, found {hidden} masked entries")


def plain_numbers(name: str, value: object, expected: str = "numbers") -> NDArray[Any]:
    """`real_array` without booleans, which `check_number` refuses too, alone or among numbers."""
    array = real_array(name, value, expected)
    mixed = isinstance(value, (list, tuple)) and any(isinstance(item, (bool, np.bool_)) for item in value)
    if array.dtype.kind == "b" or mixed:
        raise InputError(f"{name}: expected {expected}, got {shown(value)}")
    return array


def check_reach(name: str, array: NDArray[Any], high: float = LARGEST) -> None:
    """Raise InputError unless all of an array's finite numbers lie within ±high."""
    reach = max(-float(array.min(initial=0)), float(array.max(initial=0)))
    if reach > high:
        raise InputError(f"{name}: expected numbers within ±{high:g}, found ±{reach:g}")
