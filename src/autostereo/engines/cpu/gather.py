"""Gather: from V pictures, or a quilt of them, to the panel.

A view map is evaluated row by row (`row_phase`, `row_camera`), so that no array but the pictures is as large as a
panel. Float64 throughout where a view is decided, in the order of operations of `ViewMap`: the chosen views are
bit-identical with NumPy's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap
from ..gathering import check_interlace, quilt_tiles
from .jit import kernel
from .threads import run_rows


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
def row_phase(r, width, table, a, b, offsets, cell_mode, height, views, continuous, reverse, out):
    """Fill out (W, 3) float64, C-contiguous, with the phases φ ∈ [0, 1) of row r; a table's phase is (view + ½)/V.

    `table … reverse` are those of `map_args`; equals `ViewMap.phase` bit for bit.
    """
    if table.shape[0] > 0:
        row = table[r % table.shape[0]]
        for x in range(width):
            entry = x % table.shape[1]
            for c in range(3):
                view = row[entry, c]
                out[x, c] = ((views - 1 - view if reverse else view) + 0.5) / views
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
        row = table[r % table.shape[0]]
        for x in range(width):
            entry = x % table.shape[1]
            for c in range(3):
                view = row[entry, c]
                out[x, c] = views - 1 - view if reverse else view
        return
    row_phase(r, width, table, a, b, offsets, cell_mode, height, views, continuous, reverse, out)
    flat = out.reshape(-1)
    if continuous:
        for i in range(3 * width):
            flat[i] = flat[i] * views - 0.5
    else:
        for i in range(3 * width):
            flat[i] = min(np.floor(flat[i] * views), views - 1.0)


@kernel
def steps_along(width, m):
    """Return a·x and the offset of every sub-pixel of a row, (3W,) float64: the same in all rows; for `row_views`."""
    along, offset = np.empty(3 * width), np.empty(3 * width)
    for x in range(width):
        for c in range(3):
            along[3 * x + c] = m.a * x
            offset[3 * x + c] = m.offsets[0, c]
    return along, offset


@kernel
def _phase_views(r, m, steps, out):
    """`row_views` of a plain phase map in one loop, in the order of operations of `row_camera`; vectorised."""
    along, offset = steps
    br, views, most, reverse = m.b * r, m.views, m.views - 1.0, m.reverse
    least = 0.5 if m.continuous else 0.0
    for i in range(out.shape[0]):
        t = along[i] + br + offset[i]
        phi = t - np.floor(t)
        if reverse:
            phi = 1.0 - phi
        phi = phi if phi < 1.0 else 0.0
        out[i] = np.int32(min(phi * views - least + least, most))


@kernel
def row_views(r, width, m, steps, u, out):
    """Fill out (3W,) int32 with the nearest view of each sub-pixel of row r; u (W, 3) is scratch."""
    if m.table.shape[0] == 0 and (m.offsets.shape[0] == 1 or m.cell_mode == 0):
        _phase_views(r, m, steps, out)
        return
    row_camera(
        r, width, m.table, m.a, m.b, m.offsets, m.cell_mode, m.height, m.views, m.continuous, m.reverse, u
    )
    flat = u.reshape(-1)
    for i in range(3 * width):
        out[i] = np.int32(min(flat[i] + 0.5, m.views - 1.0))  # u ≥ −½, so truncation rounds down


# --- interlace -----------------------------------------------------------------------------------------------


@kernel
def _interlace_rows(views, m, flip_x, flip_y, rows, out):
    height, width = out.shape[0], out.shape[1]
    u, view, steps = np.empty((width, 3)), np.empty(3 * width, np.int32), steps_along(width, m)
    for r in range(rows[0], rows[1]):
        row_views(r, width, m, steps, u, view)
        source, target = views[:, height - 1 - r if flip_y else r], out[r]
        for x in range(width):
            column = width - 1 - x if flip_x else x
            for c in range(3):
                target[x, c] = source[view[3 * x + c], column, c]


def interlace(
    views: NDArray[np.uint8], viewmap: ViewMap, flip_x: bool, flip_y: bool, out: NDArray[np.uint8]
) -> None:
    """Fill the panel `out` from V pictures: out[r, x, c] = views[view(r, x, c), r', x', c].

    The mask is evaluated at the physical pixel (r, x), which shows the picture's pixel
    x' = W−1−x if `flip_x` else x, r' = H−1−r if `flip_y` else r.

    Parameters
    ----------
    views : ndarray of shape (V, H, W, 4), uint8
    viewmap : ViewMap
        With V views. A continuous map's camera coordinate u is rounded to the nearest view, ⌊u + ½⌋ in 0…V−1.
    flip_x, flip_y : bool
    out : ndarray of shape (H, W, 3), uint8

    Raises
    ------
    InputError
        Shapes do not fit.
    """
    check_interlace(views, viewmap, out)
    views, m = np.ascontiguousarray(views), map_args(viewmap)
    run_rows(out.shape[0], lambda start, stop: _interlace_rows(views, m, flip_x, flip_y, (start, stop), out))


@kernel
def _merge_rows(picture, index, m, flips, rows, out):
    height, width = out.shape[0], out.shape[1]
    u, view, steps = np.empty((width, 3)), np.empty(3 * width, np.int32), steps_along(width, m)
    for r in range(rows[0], rows[1]):
        row_views(r, width, m, steps, u, view)
        source, target = picture[height - 1 - r if flips[1] else r], out[r]
        for x in range(width):
            column = width - 1 - x if flips[0] else x
            for c in range(3):
                if view[3 * x + c] == index:
                    target[x, c] = source[column, c]


def merge_view(
    picture: NDArray[np.uint8], index: int, viewmap: ViewMap, flips: tuple[bool, bool], out: NDArray[np.uint8]
) -> None:
    """Write those sub-pixels of the panel that show view `index`, from its picture (H, W, 4); see `interlace`."""
    m = map_args(viewmap)
    run_rows(out.shape[0], lambda start, stop: _merge_rows(picture, index, m, flips, (start, stop), out))


# --- weave ---------------------------------------------------------------------------------------------------


@kernel
def _tile_rows(tiles, j, out):
    """Fill out (V,) with the flat index of pixel (row j, column 0) of each tile; tile 0 is at the bottom left."""
    for k in range(out.shape[0]):
        top = tiles.quilt_height - (k // tiles.columns + 1) * tiles.height
        left = (k % tiles.columns) * tiles.width
        out[k] = ((top + j) * tiles.quilt_width + left) * tiles.channels


@kernel
def _taps(count, size, flip, low, high, weight):
    """Fill the two taps of the linear filter, and the weight of `high`, for `count` pixels over a tile of `size`."""
    for i in range(count):
        shown = count - 1 - i if flip else i
        position = (shown + 0.5) * size / count - 0.5
        base = np.floor(position)
        weight[i] = np.float32(position - base)
        low[i] = max(int(base), 0)
        high[i] = min(int(base) + 1, size - 1)


@kernel
def _nearest_tap(i, count, size, flip):
    """Pixel of a tile of `size` in which the centre of pixel i of `count` lies."""
    shown = count - 1 - i if flip else i
    return min(int((shown + 0.5) * size / count), size - 1)


@kernel
def _weave_nearest(quilt, tiles, m, flips, rows, out):
    height, width = out.shape[0], out.shape[1]
    u, view, steps = np.empty((width, 3)), np.empty(3 * width, np.int32), steps_along(width, m)
    start, column = np.empty(m.views, np.int64), np.empty(3 * width, np.int64)
    for x in range(width):
        for c in range(3):
            column[3 * x + c] = _nearest_tap(x, width, tiles.width, flips[0]) * tiles.channels + c
    for r in range(rows[0], rows[1]):
        row_views(r, width, m, steps, u, view)
        _tile_rows(tiles, _nearest_tap(r, height, tiles.height, flips[1]), start)
        target = out[r].reshape(-1)
        for i in range(3 * width):
            target[i] = quilt[np.uint64(start[view[i]] + column[i])]  # unsigned: no test for negative indices


@kernel
def _bilinear(quilt, upper, lower, left, right, wx, wy):
    """Value between four samples of one tile, float32: `upper` and `lower` are the flat indices of its rows."""
    one = np.float32(1)
    top = np.float32(quilt[upper + left]) * (one - wx) + np.float32(quilt[upper + right]) * wx
    bottom = np.float32(quilt[lower + left]) * (one - wx) + np.float32(quilt[lower + right]) * wx
    return top * (one - wy) + bottom * wy


@kernel
def _weave_linear(quilt, tiles, m, flips, rows, out):
    height, width = out.shape[0], out.shape[1]
    u = np.empty((width, 3))
    upper, lower = np.empty(m.views, np.int64), np.empty(m.views, np.int64)
    left, right, wx = np.empty(width, np.int64), np.empty(width, np.int64), np.empty(width, np.float32)
    above, below, wy = np.empty(height, np.int64), np.empty(height, np.int64), np.empty(height, np.float32)
    _taps(width, tiles.width, flips[0], left, right, wx)
    _taps(height, tiles.height, flips[1], above, below, wy)
    for r in range(rows[0], rows[1]):
        row_camera(
            r, width, m.table, m.a, m.b, m.offsets, m.cell_mode, m.height, m.views, m.continuous, m.reverse, u
        )
        _tile_rows(tiles, above[r], upper)
        _tile_rows(tiles, below[r], lower)
        for x in range(width):
            x0, x1 = left[x] * tiles.channels, right[x] * tiles.channels
            for c in range(3):
                camera = min(max(u[x, c], 0.0), m.views - 1.0)
                k = int(camera)
                value = _bilinear(quilt, upper[k], lower[k], x0 + c, x1 + c, wx[x], wy[r])
                if camera > k:
                    w = np.float32(camera - k)
                    k += 1
                    other = _bilinear(quilt, upper[k], lower[k], x0 + c, x1 + c, wx[x], wy[r])
                    value = value * (np.float32(1) - w) + other * w
                out[r, x, c] = np.uint8(value + np.float32(0.5))


def weave(
    quilt: NDArray[np.uint8],
    grid: tuple[int, int],
    viewmap: ViewMap,
    size: tuple[int, int],
    filter: str = "nearest",
    flips: tuple[bool, bool] = (False, False),
) -> NDArray[np.uint8]:
    """Weave a quilt into a panel, each sub-pixel from its own tile.

    A panel pixel's centre lies at ((x + ½)·w/W, (r + ½)·h/H) in every tile of w × h pixels, rows from the top.

    Parameters
    ----------
    quilt : ndarray of shape (H', W', 3 | 4), uint8
        Tile 0 at the bottom left; rows and columns left over at the right and top are padding (displays.md 3.1).
    grid : (C, R)
        Tiles across and up; tiles are ⌊W'/C⌋ × ⌊H'/R⌋ pixels.
    viewmap : ViewMap
        Its V views are the quilt's first V tiles, V ≤ C·R.
    size : (W, H)
        Panel pixels.
    filter : {"nearest", "linear"}
        Nearest pixel of the nearest view; or bilinear within the tile, clamped at its edges, and for continuous maps
        linear between the two nearest views as well.
    flips : (flip_x, flip_y)
        As in `interlace`.

    Returns
    -------
    ndarray of shape (H, W, 3), uint8

    Raises
    ------
    InputError
        The quilt cannot be cut so, or an argument has the wrong form.
    """
    quilt = np.ascontiguousarray(quilt)
    tiles = quilt_tiles(quilt, grid, viewmap, size, filter)
    out = np.empty((size[1], size[0], 3), np.uint8)
    rows_kernel = _weave_nearest if filter == "nearest" else _weave_linear
    flat, m, flips = quilt.reshape(-1), map_args(viewmap), (bool(flips[0]), bool(flips[1]))
    run_rows(size[1], lambda start, stop: rows_kernel(flat, tiles, m, flips, (start, stop), out))
    return out
