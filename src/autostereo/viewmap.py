"""ViewMap: which camera each sub-pixel of a panel shows.

Two forms (DESIGN section 3): a periodic integer table, or a phase that is affine in the pixel,
φ = frac(a·x + b·r + o[cell(x, r), c]), in float64 and in exactly this order of operations, so that
NumPy, Numba and GLSL agree. A ViewMap is evaluated row by row and never stored for a whole panel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .checks import check_views, real_array, shown
from .errors import InputError

CELL_MODES = (0, 1, 2, 3, 4)


def cell_index(mode: int, x: NDArray[np.int64] | int, y: NDArray[np.int64] | int) -> NDArray[np.int64]:
    """Sub-pixel cell of pixel (x, y), y counted from the bottom (displays.md 3.3, CellPatternMode)."""
    x, y = np.asarray(x), np.asarray(y)
    if mode == 0:
        return np.zeros(np.broadcast(x, y).shape, dtype=np.int64)
    if mode == 1:
        return (x + y) % 2
    if mode == 2:
        return (x + 0 * y) % 2
    if mode == 3:
        return (y + 2 * (x % 2)) % 4
    return (y + 0 * x) % 2


@dataclass(frozen=True, eq=False)
class ViewMap:
    """Which camera each sub-pixel shows.

    Parameters
    ----------
    views : int
        V, the number of views.
    table : ndarray of shape (h, w, 3), int, optional
        Periodic form: view index of (row from the top mod h, x mod w, channel).
    a, b : float
        Phase form: phase step per pixel in x and per row (rows from the top).
    offsets : ndarray of shape (cells, 3), float64, optional
        Phase form: phase offset o of each cell and channel.
    cell_mode : int
        Pattern that assigns cells to pixels (displays.md 3.3); 0 when there is one cell.
    height : int
        Panel height H, needed for cells only (their parity counts rows from the bottom).
    continuous : bool
        Phase form: show camera coordinate u = φ·V − ½ instead of view ⌊φ·V⌋.
    reverse : bool
        Zones run the other way: view V−1−i; phase 1−φ (0 stays 0), and what is continuous follows the phase.

    Notes
    -----
    With a table, `continuous` has no meaning and must be False.
    """

    views: int
    table: NDArray[np.int32] | None = None
    a: float = 0.0
    b: float = 0.0
    offsets: NDArray[np.float64] | None = None
    cell_mode: int = 0
    height: int = 0
    continuous: bool = False
    reverse: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "views", check_views(self.views))
        if (self.table is None) == (self.offsets is None):
            raise InputError("view map: give either a table or a phase (a, b, offsets)")
        if self.table is not None:
            self._check_table()
        else:
            self._check_phase()

    def _check_table(self) -> None:
        table = real_array("table", self.table, "an array of integers")
        if table.ndim != 3 or table.shape[2] != 3 or 0 in table.shape:
            raise InputError(f"table: expected shape (h, w, 3), got {table.shape}")
        if not np.issubdtype(table.dtype, np.integer):
            raise InputError(f"table: expected integers, got {table.dtype}")
        if table.min() < 0 or table.max() >= self.views:
            raise InputError(
                f"table: expected view indices 0…{self.views - 1}, found {table.min()}…{table.max()}"
            )
        if self.continuous:
            raise InputError("continuous: a table has discrete views only")
        object.__setattr__(self, "table", np.ascontiguousarray(table, dtype=np.int32))

    def _check_phase(self) -> None:
        offsets = np.ascontiguousarray(real_array("offsets", self.offsets), dtype=np.float64)
        if offsets.ndim != 2 or offsets.shape[1] != 3 or offsets.shape[0] == 0:
            raise InputError(f"offsets: expected shape (cells, 3), got {offsets.shape}")
        if not (np.isfinite(offsets).all() and np.isfinite([self.a, self.b]).all()):
            raise InputError("view map: expected finite phase coefficients")
        if not isinstance(self.cell_mode, (int, np.integer)) or self.cell_mode not in CELL_MODES:
            raise InputError(f"cell_mode: expected one of {CELL_MODES}, got {shown(self.cell_mode)}")
        if self.cell_mode != 0 and self.height < 1:
            raise InputError(f"height: cells need the panel's number of rows, got {self.height}")
        object.__setattr__(self, "offsets", offsets)

    @property
    def per_pixel(self) -> bool:
        """Whether all three sub-pixels of every pixel show the same camera."""
        channels = self.offsets if self.table is None else self.table
        assert channels is not None
        return bool((channels == channels[..., :1]).all())

    def phase(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Phase φ ∈ [0, 1) of pixels, reversed if the map is; shape (R, C, 3) for rows (R,) and columns (C,)."""
        if self.offsets is None:
            raise InputError("view map: a table has no phase")
        phi = self._forward_phase(rows, columns)
        if self.reverse:
            phi = np.where(phi == 0.0, 0.0, 1.0 - phi)
        return np.where(phi >= 1.0, 0.0, phi)  # 1 − 1e-17 rounds to 1

    def _forward_phase(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Phase before it is reversed, shape (R, C, 3)."""
        assert self.offsets is not None
        r = np.asarray(rows)[:, None]
        x = np.asarray(columns)[None, :]
        cell = cell_index(self.cell_mode, x, self.height - 1 - r) % len(self.offsets)
        t = (self.a * x + self.b * r)[..., None] + self.offsets[cell]
        phi = t - np.floor(t)
        return np.where(phi >= 1.0, 0.0, phi)

    def view(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.int32]:
        """View index of each sub-pixel, shape (R, C, 3), int32."""
        if self.table is not None:
            h, w, _ = self.table.shape
            view = self.table[np.asarray(rows)[:, None] % h, np.asarray(columns)[None, :] % w]
        else:
            view = np.minimum(np.floor(self._forward_phase(rows, columns) * self.views), self.views - 1)
        return (self.views - 1 - view if self.reverse else view).astype(np.int32)

    def camera(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Camera coordinate u of each sub-pixel, shape (R, C, 3), float64: u = i at camera i."""
        if self.continuous:
            return self.phase(rows, columns) * self.views - 0.5
        return self.view(rows, columns).astype(np.float64)


def offset_at(offsets: NDArray[np.float64], u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Camera offset at camera coordinates u: piecewise linear through `offsets` (V,), continued beyond the ends."""
    u = np.asarray(u, dtype=np.float64)
    if len(offsets) == 1:
        return np.full(u.shape, offsets[0])
    k = np.minimum(np.maximum(np.floor(u), 0.0), len(offsets) - 2.0).astype(np.int64)
    return offsets[k] + (u - k) * (offsets[k + 1] - offsets[k])
