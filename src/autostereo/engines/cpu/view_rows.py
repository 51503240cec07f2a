"""A view map row by row: phases, camera coordinates and nearest views of a panel's sub-pixels.

Float64 throughout where a view is decided, in the order of operations of `ViewMap`, or fixed point where that cannot
decide otherwise: the chosen views are bit-identical with NumPy's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap
from .jit import kernel

TURN = 4294967296.0  # one turn of the phase in fixed point
WHOLE_TURN, LOW_HALF = np.uint64(1 << 32), np.uint64((1 << 32) - 1)
MOST_DOUBT = 1 << 30  # of a turn: beyond, fixed point decides nothing


class MapArgs(NamedTuple):
    """A ViewMap as kernels take it; a phase map has an empty table (0, 0, 3)."""

    table: NDArray[np.int32]
    a: float
    b: float
    offsets: NDArray[np.float64]
    cell_mode: int
    height: int
    views: int
    continuous: bool
    reverse: bool


def map_args(viewmap: ViewMap) -> MapArgs:
    """Return the arguments `table … reverse` of `row_phase` and `row_camera`, of one type for every map."""
    table = np.zeros((0, 0, 3), np.int32) if viewmap.table is None else viewmap.table
    offsets = np.zeros((1, 3)) if viewmap.offsets is None else viewmap.offsets
    return MapArgs(
        table,
        float(viewmap.a),
        float(viewmap.b),
        offsets,
        int(viewmap.cell_mode),
        int(viewmap.height),
        int(viewmap.views),
        bool(viewmap.continuous),
        bool(viewmap.reverse),
    )


@kernel
def cell_of(mode, x, y):
    """`viewmap.cell_index` of one pixel, y counted from the bottom."""
    if mode == 1:
        return (x + y) % 2
    if mode == 2:
        return x % 2
    if mode == 3:
        return (y + 2 * (x % 2)) % 4
    if mode == 4:
        return y % 2
    return 0


@kernel
def _wrap(flat, reverse):
    """Replace each t by its fraction in [0, 1), mirrored if `reverse` (0 stays 0). Alone, this loop is vectorised."""
    for i in range(flat.shape[0]):
        phi = flat[i] - np.floor(flat[i])
        if reverse:
            phi = 1.0 - phi
        flat[i] = phi if phi < 1.0 else 0.0  # 1 − 1e-17 rounds to 1


@kernel
def _table_views(row, views, reverse, out):
    """Fill out (W, 3) with the views of a table's row (w, 3), which repeats."""
    for x in range(out.shape[0]):
        entry = x % row.shape[0]
        for c in range(3):
            view = row[entry, c]
            out[x, c] = views - 1 - view if reverse else view


@kernel
def row_phase(r, width, table, a, b, offsets, cell_mode, height, views, continuous, reverse, out):
    """Fill out (W, 3) float64, C-contiguous, with the phases φ ∈ [0, 1) of row r; a table's phase is (view + ½)/V.

    `table … reverse` are those of `map_args`; equals `ViewMap.phase` bit for bit.
    """
    if table.shape[0] > 0:
        _table_views(table[r % table.shape[0]], views, reverse, out)
        flat = out.reshape(-1)
        for i in range(3 * width):
            flat[i] = (flat[i] + 0.5) / views
        return
    br = b * r
    if offsets.shape[0] == 1 or cell_mode == 0:
        o0, o1, o2 = offsets[0, 0], offsets[0, 1], offsets[0, 2]
        for x in range(width):
            t = a * x + br
            out[x, 0] = t + o0
            out[x, 1] = t + o1
            out[x, 2] = t + o2
    else:
        y = height - 1 - r
        for x in range(width):
            t = a * x + br
            cell = cell_of(cell_mode, x, y) % offsets.shape[0]
            for c in range(3):
                out[x, c] = t + offsets[cell, c]
    _wrap(out.reshape(-1), reverse)


@kernel
def row_camera(r, width, table, a, b, offsets, cell_mode, height, views, continuous, reverse, out):
    """Fill out (W, 3) float64, C-contiguous, with the camera coordinates u of row r; whole if the map is discrete.

    `table … reverse` are those of `map_args`; equals `ViewMap.camera` bit for bit.
    """
    if table.shape[0] > 0:
        _table_views(table[r % table.shape[0]], views, reverse, out)
        return
    turned = reverse and continuous  # views are counted before they are reversed: phases on their borders, too
    row_phase(r, width, table, a, b, offsets, cell_mode, height, views, continuous, turned, out)
    flat = out.reshape(-1)
    if continuous:
        for i in range(3 * width):
            flat[i] = flat[i] * views - 0.5
    else:
        for i in range(3 * width):
            view = min(np.floor(flat[i] * views), views - 1.0)
            flat[i] = views - 1.0 - view if reverse else view


class Steps(NamedTuple):
    """What the sub-pixels of every row of a plain phase map share.

    along, offset (3W,) float64: a·x and the channel's offset; turns (3W,) uint64: the fraction of their sum in fixed
    point; far: the greatest |a·x| + |offset|.
    """

    along: NDArray[np.float64]
    offset: NDArray[np.float64]
    turns: NDArray[np.uint64]
    far: float


@kernel
def to_turns(t):
    """The fraction of t in fixed point, one turn being 2³²."""
    return np.uint64((t - np.floor(t)) * TURN + 0.5)


@kernel
def steps_along(width, m):
    """Return the Steps of a row of so many pixels, for `row_views`."""
    along, offset, turns = np.empty(3 * width), np.empty(3 * width), np.empty(3 * width, np.uint64)
    for x in range(width):
        for c in range(3):
            along[3 * x + c] = m.a * x
            offset[3 * x + c] = m.offsets[0, c]
            turns[3 * x + c] = to_turns(m.a * x + m.offsets[0, c])
    return Steps(along, offset, turns, abs(m.a) * width + np.abs(m.offsets).max())


@kernel
def _certain_views(r, m, steps, out):
    """`row_views` of a plain phase map in fixed point; False if a phase is so near a border that this may be wrong.

    Rounding moves a phase by a unit, and in float64 by 4·2⁻⁵³ of its terms.
    """
    br, views = m.b * r, np.uint64(m.views)
    doubt = (2.0 + (abs(br) + steps.far) * (TURN * 2.0**-50)) * m.views
    if not doubt < MOST_DOUBT:
        return False
    turned, mirrored, last = m.reverse and m.continuous, m.reverse and not m.continuous, np.int32(m.views - 1)
    turns, near, start, doubtful = steps.turns, np.uint64(2 * int(doubt)), to_turns(br), np.uint64(0)
    for i in range(out.shape[0]):
        turn = (turns[i] + start) & LOW_HALF
        place = ((WHOLE_TURN - turn) & LOW_HALF if turned else turn) * views
        view = np.int32(place >> np.uint64(32))
        out[i] = last - view if mirrored else view
        doubtful |= np.uint64(((place + np.uint64(int(doubt))) & LOW_HALF) < near)
    return doubtful == np.uint64(0)


@kernel
def _phase_views(r, m, steps, out):
    """`row_views` of a plain phase map in one loop, in the order of operations of `row_camera`; vectorised."""
    along, offset = steps.along, steps.offset
    br, views, most = m.b * r, m.views, m.views - 1.0
    turned, mirrored, last = m.reverse and m.continuous, m.reverse and not m.continuous, np.int32(m.views - 1)
    least = 0.5 if m.continuous else 0.0
    for i in range(out.shape[0]):
        t = along[i] + br + offset[i]
        phi = t - np.floor(t)
        if turned:
            phi = 1.0 - phi
        phi = phi if phi < 1.0 else 0.0
        view = np.int32(min(phi * views - least + least, most))
        out[i] = last - view if mirrored else view


@kernel
def row_views(r, width, m, steps, u, out):
    """Fill out (3W,) int32 with the nearest view of each sub-pixel of row r; u (W, 3) is scratch."""
    if m.table.shape[0] == 0 and (m.offsets.shape[0] == 1 or m.cell_mode == 0):
        if not _certain_views(r, m, steps, out):
            _phase_views(r, m, steps, out)
        return
    row_camera(
        r, width, m.table, m.a, m.b, m.offsets, m.cell_mode, m.height, m.views, m.continuous, m.reverse, u
    )
    flat = u.reshape(-1)
    for i in range(3 * width):
        out[i] = np.int32(min(flat[i] + 0.5, m.views - 1.0))  # u ≥ −½, so truncation rounds down
