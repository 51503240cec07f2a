"""Gather: from V pictures, or a quilt of them, to the panel.

A view map is evaluated row by row (`view_rows`), so that no array but the pictures is as large as a panel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap
from ..gathering import check_interlace, quilt_tiles
from .jit import kernel
from .threads import run_rows
from .view_rows import map_args, row_camera, row_views, steps_along

CACHE_LINE = 64  # bytes


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
def _touch(quilt, start, count):
    """Read a byte of each cache line of one row of every tile: in order they come many times as fast as one by one."""
    total = np.uint64(0)
    for k in range(start.shape[0]):
        for i in range(0, count, CACHE_LINE):
            total += np.uint64(quilt[np.uint64(start[k] + i)])
    return total


@kernel
def _weave_nearest(quilt, tiles, m, flips, rows, out):
    height, width = out.shape[0], out.shape[1]
    u, view, steps = np.empty((width, 3)), np.empty(3 * width, np.int32), steps_along(width, m)
    start, column = np.empty(m.views, np.uint64), np.empty(width, np.uint64)
    for x in range(width):
        column[x] = _nearest_tap(x, width, tiles.width, flips[0]) * tiles.channels
    shown, touched = -1, np.uint64(0)
    for r in range(rows[0], rows[1]):
        row_views(r, width, m, steps, u, view)
        j = _nearest_tap(r, height, tiles.height, flips[1])
        if j != shown:
            _tile_rows(tiles, j, start)
            touched |= _touch(quilt, start, tiles.width * tiles.channels)
            shown = j
        target = out[r].reshape(-1)
        for x in range(np.uint64(width)):
            i = np.uint64(3) * x
            for c in range(np.uint64(3)):
                target[i + c] = quilt[start[np.uint64(view[i + c])] + column[x] + c]
    return touched


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
