"""Observe: what an eye sees of a panel through its lenses (DESIGN section 5, optics of `observe`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap
from ..gathering import TIE, check_observe, lens_size
from .jit import kernel
from .threads import run_rows
from .view_rows import map_args, row_phase


@kernel
def _first(at, count, length):
    """First index of a window of `count` about `at`, kept inside 0…length−1."""
    return max(min(at - count // 2, length - count), 0)


@kernel
def _step(k):
    """0, −1, 1, −2, 2, …"""
    return -((k + 1) // 2) if k % 2 else k // 2


@kernel
def _circular(p, q):
    """Distance of two phases on the circle, 0…½."""
    d = abs(p - q)
    return min(d, 1.0 - d)


@kernel
def _select(ring, at, window, wanted, goal):
    """Return the (row, column) of the sub-pixel nearest in phase to `wanted` within the window, then nearest to `at`.

    ring (n, W, 3) holds row q at q mod n; at = (row, column, channel); window = (first row, rows, first column,
    columns). A distance of `goal` cannot be beaten.
    """
    (r, x, c), (top, rows, left, columns) = at, window
    best, row, column = 2.0, r, x
    for i in range(2 * rows + 1):
        q = r + _step(i)
        if q < top or q >= top + rows:
            continue
        phases = ring[q % ring.shape[0]]
        for k in range(2 * columns + 1):
            p = x + _step(k)
            if p < left or p >= left + columns:
                continue
            d = _circular(phases[p, c], wanted)
            if d < best - TIE:
                best, row, column = d, q, p
                if best <= goal + TIE:
                    return row, column
    return row, column


@kernel
def _neighbour(ring, at, window, phase, direction):
    """Return the (row, column) of the sub-pixel next to `phase` on the circle, upwards (1) or downwards (−1)."""
    (r, x, c), (top, rows, left, columns) = at, window
    best, row, column = 2.0, r, x
    for i in range(2 * rows + 1):
        q = r + _step(i)
        if q < top or q >= top + rows:
            continue
        phases = ring[q % ring.shape[0]]
        for k in range(2 * columns + 1):
            p = x + _step(k)
            if p < left or p >= left + columns:
                continue
            ahead = direction * (phases[p, c] - phase)
            ahead -= np.floor(ahead)
            if TIE < ahead < 1.0 - TIE and ahead < best - TIE:
                best, row, column = ahead, q, p
    return (row, column) if best < 2.0 else (-1, -1)


@kernel
def _observe_rows(panel, m, wanted, lens, crosstalk, flips, rows, out):
    height, width = panel.shape[0], panel.shape[1]
    tall, wide = lens
    ring = np.empty((tall, width, 3))
    filled = 0
    for r in range(rows[0], rows[1]):
        top = _first(r, tall, height)
        for q in range(max(top, filled), top + tall):
            row_phase(
                q, width, m.table, m.a, m.b, m.offsets, m.cell_mode, m.height, m.views, m.continuous, m.reverse,
                ring[q % tall],
            )  # fmt: skip
        filled = top + tall
        target = out[height - 1 - r if flips[1] else r]
        for x in range(width):
            window = (top, tall, _first(x, wide, width), wide)
            for c in range(3):
                w = wanted[x, c] - np.floor(wanted[x, c])
                zone = (np.floor(w * m.views) + 0.5) / m.views
                goal = abs(w - zone) if m.table.shape[0] > 0 else 0.0
                row, column = _select(ring, (r, x, c), window, w, goal)
                value = float(panel[row, column, c])
                if crosstalk > 0.0:
                    phase = ring[row % tall, column, c]
                    leaked = 0.0
                    for direction in (1.0, -1.0):
                        i, k = _neighbour(ring, (r, x, c), window, phase, direction)
                        leaked += 0.5 * (float(panel[i, k, c]) if i >= 0 else value)
                    value = (1.0 - crosstalk) * value + crosstalk * leaked
                target[width - 1 - x if flips[0] else x, c] = np.uint8(value + 0.5)


def observe(
    panel: NDArray[np.uint8],
    viewmap: ViewMap,
    wanted: NDArray[np.float64],
    period: float | None = None,
    crosstalk: float = 0.0,
    flips: tuple[bool, bool] = (False, False),
) -> NDArray[np.uint8]:
    """Return what an eye sees: for each pixel and channel the sub-pixel that the lens there shows to it.

    Of the sub-pixels of the same channel within one lens about the pixel (`lens_size`; at the panel's edges the
    window is moved inside), the one whose phase is circularly nearest to the wanted one; of equals, the nearest row,
    then column. A lens has fewer sub-pixels than a quilt has views: the view seen is the nearest one present.

    Parameters
    ----------
    panel : ndarray of shape (H, W, 3), uint8
    viewmap : ViewMap
    wanted : ndarray of shape (W, 3), float64
        Phase that the eye sees at physical column x and channel c; view i is centred at (i + ½)/V.
    period : float, optional
        Lens period in pixels along x; None: that of the view map.
    crosstalk : float in [0, 1)
        Share of light from the two sub-pixels of the lens next in phase, half from each side.
    flips : (flip_x, flip_y)
        The panel shows the picture mirrored, as in `interlace`; the result is the picture.

    Returns
    -------
    ndarray of shape (H, W, 3), uint8

    Raises
    ------
    InputError
        An argument has the wrong form.
    """
    panel = np.ascontiguousarray(panel)
    wanted = np.ascontiguousarray(wanted, dtype=np.float64)
    check_observe(panel, wanted, crosstalk)
    lens = lens_size(viewmap, (panel.shape[1], panel.shape[0]), period)
    out, m, flips = np.empty_like(panel), map_args(viewmap), (bool(flips[0]), bool(flips[1]))
    share = float(crosstalk)
    run_rows(
        panel.shape[0], lambda start, stop: _observe_rows(panel, m, wanted, lens, share, flips, (start, stop), out)
    )
    return out
