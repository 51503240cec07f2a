"""Plain NumPy peers: writing memory as fast as it goes, and weaving by fancy indexing."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap

Index = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


def memory_writer(size: int, threads: int) -> tuple[Callable[[], object], Callable[[], object]]:
    """A function that fills `size` bytes of warm memory from `threads` threads, and one that ends these threads.

    NumPy fills bytes by memset, so this is as fast as memory takes them.
    """
    memory = np.ones(size, dtype=np.uint8)  # ones, not zeros: every page exists
    parts = np.array_split(memory, threads)
    pool = ThreadPoolExecutor(threads)
    return lambda: list(pool.map(lambda part: part.fill(3), parts)), pool.shutdown


def weave_index(
    quilt_size: tuple[int, int], grid: tuple[int, int], viewmap: ViewMap, size: tuple[int, int]
) -> Index:
    """Row, column and channel of the quilt for each sub-pixel of the panel, each broadcastable to (H, W, 3).

    Sizes are (width, height), the grid (columns, rows) with view 0 at the bottom left; nearest view and pixel.
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
