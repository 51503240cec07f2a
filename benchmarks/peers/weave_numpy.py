"""Weaving a quilt with plain NumPy fancy indexing, as one writes it without a compiler.

`plan` makes the panel-sized index arrays once, `gather` is the indexing alone, `weave` is both. A benchmark can time
either: a program that keeps the arrays (225 MB at 1536×2048) pays for `gather` only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from autostereo import ViewMap

Index = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


def plan(quilt_size: tuple[int, int], grid: tuple[int, int], viewmap: ViewMap, size: tuple[int, int]) -> Index:
    """Row, column and channel of the quilt for each sub-pixel, each broadcastable to (H, W, 3).

    Parameters
    ----------
    quilt_size, size : (width, height)
        Pixels of the quilt and of the panel.
    grid : (columns, rows)
        Tiles of the quilt, the first at the bottom left.
    """
    (columns, rows), (width, height) = grid, size
    tile_w, tile_h = quilt_size[0] // columns, quilt_size[1] // rows
    r, x = np.arange(height), np.arange(width)
    view = np.clip(np.floor(viewmap.camera(r, x) + 0.5), 0, viewmap.views - 1).astype(np.int64)
    row = np.floor((r + 0.5) * tile_h / height).astype(np.int64)
    column = np.floor((x + 0.5) * tile_w / width).astype(np.int64)
    quilt_row = quilt_size[1] - (view // columns + 1) * tile_h + row[:, None, None]
    quilt_column = view % columns * tile_w + column[None, :, None]
    return quilt_row, quilt_column, np.arange(3)[None, None, :]


def gather(quilt: NDArray[np.uint8], index: Index) -> NDArray[np.uint8]:
    """The panel (H, W, 3)."""
    return quilt[index]


def weave(
    quilt: NDArray[np.uint8], grid: tuple[int, int], viewmap: ViewMap, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """The panel (H, W, 3), filter nearest, no flips; arguments as autostereo.engines.cpu.gather.weave."""
    return gather(quilt, plan((quilt.shape[1], quilt.shape[0]), grid, viewmap, size))
