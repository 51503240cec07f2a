"""Transfer functions: from scalar values to colour and opacity."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import LARGEST, check_number, check_reach, real_array
from ..errors import FileError, InputError
from ..image import as_path, write_atomic

if TYPE_CHECKING:
    from .volume import Volume

Array = NDArray[np.float64]

KIND = "autostereo transfer function"  # in files
FAINT = 1e-280  # optical depths below this lose digits to underflow, and colour is no longer weighted by them


def _check_points(points: ArrayLike) -> Array:
    """Return control points as a checked (K, 5) float64 array, or raise an error that names what is wrong."""
    rows = "rows of five numbers (value, r, g, b, opacity)"
    p = np.array(real_array("transfer points", points, rows), dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 5 or len(p) == 0:
        raise InputError(f"transfer points: expected rows (value, r, g, b, opacity), got shape {p.shape}")
    if not np.isfinite(p).all():
        raise InputError("transfer points: expected finite numbers, found NaN or infinity")
    check_reach("transfer points", p)
    if (np.diff(p[:, 0]) < 0).any():
        k = int(np.argmax(np.diff(p[:, 0]) < 0))
        raise InputError(f"transfer points: expected ascending values, found {p[k, 0]:g} before {p[k + 1, 0]:g}")
    if len(p) > 2 and (p[2:, 0] == p[:-2, 0]).any():
        value = p[2:, 0][p[2:, 0] == p[:-2, 0]][0]
        raise InputError(f"transfer points: expected at most two points of one value (a step), found more at {value:g}")
    if p[:, 1:4].min() < 0 or p[:, 1:4].max() > 1:
        raise InputError(f"transfer points: expected colours 0…1, found {p[:, 1:4].min():g}…{p[:, 1:4].max():g}")
    if p[:, 4].min() < 0:
        raise InputError(f"transfer points: expected opacities ≥ 0, found {p[:, 4].min():g}")
    return p


def _integrals(width: Array, start: Array, end: Array) -> Array:
    """Exact integrals (7, n) of τ, τ·colour and colour over `width` (n,) where (r, g, b, τ) (4, n) is linear."""
    (c0, t0), (c1, t1) = (start[:3], start[3]), (end[:3], end[3])
    result = np.empty((7, len(width)))
    result[0] = (t0 + t1) * (width / 2)
    result[1:4] = (c0 * (2 * t0 + t1) + c1 * (t0 + 2 * t1)) * (width / 6)
    result[4:] = (c0 + c1) * (width / 2)
    return result


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """Colour and extinction, piecewise linear over scalar values and constant beyond the ends.

    Parameters
    ----------
    points : array_like of shape (K, 5)
        Rows (value, r, g, b, opacity), values ascending; two rows of equal value make a step (the second holds at
        the value itself). Colours are display values 0…1. Opacity is extinction per scene unit, ≥ 0: a path of
        length L through constant extinction τ lets exp(−τ·L) of the light through, whatever the sampling rate.

    Raises
    ------
    InputError
        The points do not have this form; the message says what was found.
    """

    points: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _check_points(self.points))

    @property
    def max_opacity(self) -> float:
        """The greatest extinction of all values, per scene unit."""
        return float(self.points[:, 4].max())

    def scaled(self, factor: float) -> TransferFunction:
        """Return the same function with all opacities times `factor` ≥ 0."""
        return TransferFunction(self.points * (1, 1, 1, 1, check_number("transfer factor", factor, 0.0, LARGEST)))

    # --- values ----------------------------------------------------------------------------------------------------
    def evaluate(self, s: ArrayLike) -> Array:
        """Return (r, g, b, extinction) at scalar values `s` of any shape, as shape (*s.shape, 4)."""
        return self.limit(s, "right")

    def limit(self, s: ArrayLike, side: Literal["left", "right"]) -> Array:
        """Return the limit (*s.shape, 4) at `s` from one side; the two differ at steps only, where "right" holds."""
        s = np.asarray(s, dtype=np.float64)
        flat = self._within(s.ravel(), np.searchsorted(self.points[:, 0], s.ravel(), side=side))
        return np.ascontiguousarray(flat.T).reshape(*s.shape, 4)

    def _within(self, s: Array, piece: NDArray[np.intp]) -> Array:
        """(4, n) at `s` (n,) of the linear function of a piece: k lies between points k − 1 and k, 0 below all."""
        value, rows = self.points[:, 0], self._rows
        first, second = np.maximum(piece - 1, 0), np.minimum(piece, len(value) - 1)
        start = value[first]
        width = value[second] - start
        width[first == second] = 1.0  # constant beyond the ends
        part = (s - start) / width
        return rows[:, first] * (1 - part) + rows[:, second] * part

    @cached_property
    def _rows(self) -> Array:
        """(r, g, b, opacity) of the points, (4, K): long inner loops are fast in NumPy."""
        return np.ascontiguousarray(self.points[:, 1:].T)

    @cached_property
    def _cumulative(self) -> Array:
        """`_integrals` from the first point to every point, (7, K)."""
        parts = _integrals(np.diff(self.points[:, 0]), self._rows[:, :-1], self._rows[:, 1:])
        return np.concatenate([np.zeros((7, 1)), np.cumsum(parts, axis=1)], axis=1)

    def mean(self, s_front: ArrayLike, s_back: ArrayLike) -> Array:
        """Exact means over a path on which the scalar runs linearly from `s_front` to `s_back`.

        Extinction is averaged as it is, colour weighted by extinction (where that is 0 all along: as it is). This
        is the pre-integration of Engel, Kraus and Ertl 2001 with the attenuation within the segment neglected
        (their equation 10), in closed form: products of two linear functions are integrated exactly.

        Parameters
        ----------
        s_front, s_back : array_like
            Scalars at the two ends; they are broadcast.

        Returns
        -------
        ndarray of shape (..., 4)
            Mean (r, g, b, extinction).
        """
        front, back = np.broadcast_arrays(np.asarray(s_front, np.float64), np.asarray(s_back, np.float64))
        low, high = np.minimum(front, back).ravel(), np.maximum(front, back).ravel()
        value, rows = self.points[:, 0], self._rows
        first, last = np.searchsorted(value, low, side="right"), np.searchsorted(value, high, side="right")
        at_low, at_high = self._within(low, first), self._within(high, last)
        total = _integrals(high - low, at_low, at_high)
        cut = np.nonzero(first != last)[0]  # these lead through points: rest of the first piece, whole ones, the last
        i, j = first[cut], last[cut] - 1
        head = _integrals(value[i] - low[cut], at_low[:, cut], rows[:, i])
        tail = _integrals(high[cut] - value[j], rows[:, j], at_high[:, cut])
        total[:, cut] = head + (self._cumulative[:, j] - self._cumulative[:, i]) + tail
        tau, length = total[0], high - low
        point, dark = length == 0, tau < FAINT
        color = np.where(dark, total[4:], total[1:4]) / np.where(dark, np.where(point, 1.0, length), tau)
        result = np.where(point, at_low, np.concatenate([color, tau[None] / np.where(point, 1.0, length)]))
        np.clip(result[:3], 0.0, 1.0, out=result[:3])
        return np.ascontiguousarray(result.T).reshape(*front.shape, 4)

    def table(self, low: float, high: float, size: int = 256, length: float = 1.0) -> NDArray[np.float32]:
        """2-D pre-integration table (Engel, Kraus and Ertl 2001, equations 8 and 9) over a grid of scalars.

        A slab whose scalar runs linearly from `front` to `back` has alpha = 1 − exp(−extinction·L) for any length L.
        Its emission is colour·alpha; the colour accounts for the attenuation within a slab of the given `length`.

        Parameters
        ----------
        low, high : float
            Scalars of the first and last row and column.
        size : int
            Rows and columns, ≥ 2.
        length : float
            Length of the slab in scene units, ≥ 0; 0 neglects the attenuation within.

        Returns
        -------
        ndarray of shape (size, size, 4), float32
            [front, back] → (r, g, b, mean extinction).
        """
        from .preintegration import preintegrate

        return preintegrate(self, low, high, size, length)

    # --- making ----------------------------------------------------------------------------------------------------
    @staticmethod
    def presets() -> tuple[str, ...]:
        """Names for `preset`."""
        from .transfer_presets import PRESETS

        return tuple(PRESETS)

    @staticmethod
    def preset(
        name: str, low: float | None = None, high: float | None = None, scale: float = 1.0
    ) -> TransferFunction:
        """Return a named transfer function.

        Parameters
        ----------
        name : str
            One of `presets()`.
        low, high : float, optional
            Values on which the range of the preset is mapped. None: its own, Hounsfield units for those of CT
            (−1000…2000), else 0…1.
        scale : float
            Extinction per scene unit that the preset's opacity 1 stands for. Presets are made to look right at
            1 / (diagonal of the volume).
        """
        from .transfer_presets import make_preset

        return TransferFunction(make_preset(name, low, high, scale))

    @staticmethod
    def colormap(
        name: str, low: float = 0.0, high: float = 1.0, opacity: float | Sequence[float] = 1.0
    ) -> TransferFunction:
        """Return a colour map over low…high.

        Parameters
        ----------
        name : str
            A built-in one (viridis, gray, hot, …), or any name that matplotlib knows, when it is installed.
        low, high : float
            Values of the first and the last colour.
        opacity : float or sequence of float
            Extinction per scene unit: a number is reached at `high`, in a ramp from 0 at `low`; numbers are spread
            evenly over low…high.

        Raises
        ------
        DependencyError
            The map is not built in and matplotlib is not installed.
        """
        from .transfer_presets import make_colormap

        return TransferFunction(make_colormap(name, low, high, opacity))

    @staticmethod
    def fitted(name: str, volume: Volume) -> TransferFunction:
        """Return a preset or a colour map, fitted to a volume's range of values and the diagonal of its bounds.

        Presets of CT keep their Hounsfield units where the volume seems to be in them (it holds values below −500).
        """
        from .transfer_presets import fit

        return TransferFunction(fit(name, volume.value_range, volume.diagonal))

    @staticmethod
    def suggest(volume: Volume | ArrayLike, diagonal: float | None = None) -> TransferFunction:
        """Return a transfer function that shows something of any data: neither empty nor opaque.

        Parameters
        ----------
        volume : Volume or array_like of shape (nz, ny, nx)
        diagonal : float, optional
            Length of the diagonal of the bounds in scene units. None: the volume's, or voxels of size 1.
        """
        from .transfer_suggest import suggest_points
        from .volume import Volume

        if isinstance(volume, Volume):
            values = volume.values
            diagonal = volume.diagonal if diagonal is None else diagonal
        else:
            values = real_array("values", volume)
        return TransferFunction(suggest_points(values, diagonal))

    # --- files -----------------------------------------------------------------------------------------------------
    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write JSON: {"points": [[value, r, g, b, opacity], …]}."""
        rows = ",\n    ".join(json.dumps(row) for row in self.points.tolist())
        text = f'{{\n  "type": "{KIND}",\n  "points": [\n    {rows}\n  ]\n}}\n'
        return write_atomic(path, lambda file: file.write(text.encode()))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> TransferFunction:
        """Read what `save` wrote.

        Raises
        ------
        FileError
            The file is missing or not a transfer function; the message names it.
        """
        path = as_path(path)
        try:
            data = json.loads(path.read_text(encoding="utf-8-sig"))
        except FileNotFoundError:
            raise FileError(f"{path}: no such file") from None
        except OSError as error:
            raise FileError(f"{path}: cannot be read ({error.strerror or error})") from None
        except (ValueError, RecursionError) as error:
            raise FileError(f"{path}: is not JSON ({error})") from None
        fields = data if isinstance(data, dict) else {"points": data}
        points = fields.get("points")
        if not isinstance(points, list):
            raise FileError(f'{path}: expected {{"points": [[value, r, g, b, opacity], …]}}')
        if unknown := sorted(set(fields) - {"type", "points"}):
            raise FileError(f"{path}: unknown fields {', '.join(unknown)}")
        if (kind := fields.get("type", KIND)) != KIND:
            raise FileError(f"{path}: expected the type {KIND!r}, found {str(kind)[:60]!r}")
        for row in points:
            for number in row if isinstance(row, list) else [row]:
                if isinstance(number, bool) or not isinstance(number, int | float):
                    raise FileError(f"{path}: transfer points: expected five numbers a row, found {str(number)[:60]!r}")
        try:
            return TransferFunction(points)  # type: ignore[arg-type]
        except InputError as error:
            raise FileError(f"{path}: {error}") from None
