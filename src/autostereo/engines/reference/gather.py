"""Interlace, weave and observe in plain NumPy: the specification of engines/cpu/gather.py and observe.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...frame import ViewStack
from ...viewmap import ViewMap
from ..gathering import TIE, check_interlace, check_observe, lens_size, quilt_tiles

Pixels = NDArray[np.uint8]
Floats = NDArray[np.float64]


def shown(count: int, flip: bool) -> NDArray[np.int64]:
    """Pixel of the picture that each of `count` physical pixels shows."""
    return np.arange(count)[::-1] if flip else np.arange(count)


def nearest_view(u: Floats, views: int) -> NDArray[np.int64]:
    """Round camera coordinates to view indices, ⌊u + ½⌋ within 0…V−1."""
    return np.clip(np.floor(u + 0.5), 0, views - 1).astype(np.int64)


def interlace(views: Pixels, viewmap: ViewMap, flip_x: bool, flip_y: bool, out: Pixels) -> None:
    """Fill the panel `out` (H, W, 3) from views (V, H, W, 4): out[r, x, c] = views[view(r, x, c), r', x', c].

    r', x' are r, x mirrored by the flips; a continuous map's u is rounded to the nearest view. Raises InputError when
    shapes do not fit.
    """
    check_interlace(views, viewmap, out)
    height, width = out.shape[:2]
    view = nearest_view(viewmap.camera(np.arange(height), np.arange(width)), viewmap.views)
    row, column = shown(height, flip_y)[:, None, None], shown(width, flip_x)[None, :, None]
    out[...] = views[view, row, column, np.arange(3)]


def weave(
    quilt: Pixels,
    grid: tuple[int, int],
    viewmap: ViewMap,
    size: tuple[int, int],
    filter: str = "nearest",
    flips: tuple[bool, bool] = (False, False),
) -> Pixels:
    """Weave a quilt (H', W', 3 | 4) of grid = (C, R) tiles into a panel (H, W, 3), size = (W, H).

    A panel pixel's centre lies at ((x + ½)·w/W, (r + ½)·h/H) in every tile of w × h pixels. "nearest" takes the
    pixel there of the nearest view; "linear" is bilinear within the tile and, for continuous maps, between views.
    Raises InputError when an argument has the wrong form.
    """
    tiles = quilt_tiles(quilt, grid, viewmap, size, filter)
    views = ViewStack.from_quilt(quilt, *grid, views=viewmap.views).color
    width, height = size
    u = viewmap.camera(np.arange(height), np.arange(width))
    y = (shown(height, flips[1]) + 0.5) * tiles.height / height
    x = (shown(width, flips[0]) + 0.5) * tiles.width / width
    if filter == "nearest":
        row = np.minimum(y.astype(int), tiles.height - 1)[:, None, None]
        column = np.minimum(x.astype(int), tiles.width - 1)[None, :, None]
        return views[nearest_view(u, viewmap.views), row, column, np.arange(3)]
    u = np.clip(u, 0, viewmap.views - 1)
    lower = np.floor(u).astype(int)
    upper = np.minimum(lower + 1, viewmap.views - 1)
    mixed = _mix(_bilinear(views, lower, y, x), _bilinear(views, upper, y, x), (u - lower).astype(np.float32))
    return (mixed + np.float32(0.5)).astype(np.uint8)


def _mix(a: NDArray[np.float32], b: NDArray[np.float32], w: NDArray[np.float32]) -> NDArray[np.float32]:
    return a * (np.float32(1) - w) + b * w


def _bilinear(views: Pixels, k: NDArray[np.int64], y: Floats, x: Floats) -> NDArray[np.float32]:
    """Sample view k (H, W, 3) at positions y (H,), x (W,), pixel centres at half-integers, clamped at the edges."""
    y0, x0 = np.floor(y - 0.5), np.floor(x - 0.5)
    wy, wx = (y - 0.5 - y0).astype(np.float32)[:, None, None], (x - 0.5 - x0).astype(np.float32)[None, :, None]

    def tap(dy: int, dx: int) -> NDArray[np.float32]:
        row = np.clip(y0 + dy, 0, views.shape[1] - 1).astype(int)[:, None, None]
        column = np.clip(x0 + dx, 0, views.shape[2] - 1).astype(int)[None, :, None]
        return views[k, row, column, np.arange(3)].astype(np.float32)

    return _mix(_mix(tap(0, 0), tap(0, 1), wx), _mix(tap(1, 0), tap(1, 1), wx), wy)


def observe(
    panel: Pixels,
    viewmap: ViewMap,
    wanted: Floats,
    period: float | None = None,
    crosstalk: float = 0.0,
    flips: tuple[bool, bool] = (False, False),
) -> Pixels:
    """Return what an eye sees of a panel (H, W, 3): each pixel's lens shows it the sub-pixel nearest in phase.

    wanted (W, 3) is the phase seen at each physical column and channel. Of the sub-pixels of that channel within the
    lens (`lens_size`) take the one circularly nearest in phase; of equals the nearest row, then column, then the
    upper, then the left one. With crosstalk χ: (1 − χ)·it + χ/2·(its two neighbours in phase). One pixel at a time,
    over all candidates. Raises InputError when an argument has the wrong form.
    """
    check_observe(panel, wanted, crosstalk)
    height, width = panel.shape[:2]
    tall, wide = lens_size(viewmap, (width, height), period)
    if viewmap.table is None:
        phases = viewmap.phase(np.arange(height), np.arange(width))
    else:
        phases = (viewmap.view(np.arange(height), np.arange(width)) + 0.5) / viewmap.views
    out = np.empty_like(panel)
    for r, x, c in np.ndindex(*panel.shape):
        top = max(min(r - tall // 2, height - tall), 0)
        left = max(min(x - wide // 2, width - wide), 0)
        lens = np.s_[top : top + tall, left : left + wide, c]
        rows, columns = np.mgrid[top : top + tall, left : left + wide]
        order = np.lexsort([columns.ravel(), abs(columns - x).ravel(), rows.ravel(), abs(rows - r).ravel()])
        phase, value = phases[lens].ravel()[order], panel[lens].ravel()[order].astype(float)
        seen = _first_least(np.minimum((phase - wanted[x, c]) % 1, (wanted[x, c] - phase) % 1))
        leaked = [_next(phase, value, seen, +1), _next(phase, value, seen, -1)]
        out[height - 1 - r if flips[1] else r, width - 1 - x if flips[0] else x, c] = np.floor(
            (1 - crosstalk) * value[seen] + crosstalk * (leaked[0] + leaked[1]) / 2 + 0.5
        )
    return out


def _first_least(values: Floats) -> int:
    """Index of the first of the least values, where values within TIE are the same."""
    return int(np.argmax(values <= values.min() + TIE))


def _next(phase: Floats, value: Floats, seen: int, direction: int) -> float:
    """Value of the sub-pixel next in phase to `seen` in one direction round the circle; its own if there is none."""
    ahead = (direction * (phase - phase[seen])) % 1
    ahead[(ahead <= TIE) | (ahead >= 1 - TIE)] = 2.0
    return float(value[seen] if ahead.min() == 2.0 else value[_first_least(ahead)])
