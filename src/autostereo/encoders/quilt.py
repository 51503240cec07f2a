"""Quilts: all views tiled into one picture, view 0 at the bottom left (displays.md 3.1)."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..display.quilt import Quilt
from ..errors import InputError
from ..frame import ViewStack
from ..image import as_path, write_image
from ..wording import counted

MAX_TILES = 32  # tiles a side, and pixels a side, that Looking Glass software takes
MAX_PIXELS = 16384

_NAME = re.compile(r"_qs(\d+)x(\d+)a(\d+\.?\d*|\.\d+)(\.[A-Za-z][A-Za-z0-9]*)?$")


class QuiltName(NamedTuple):
    """What a quilt's file name says: C × R tiles, and width/height of the display (not of a tile)."""

    columns: int
    rows: int
    aspect: float


def quilt_name(stem: str, columns: int, rows: int, aspect: float, suffix: str = ".png") -> str:
    """File name of a quilt, <stem>_qs<C>x<R>a<aspect><suffix>, aspect as %.4g.

    >>> quilt_name("bunny", 8, 6, 0.75)
    'bunny_qs8x6a0.75.png'
    """
    check_grid(columns, rows)
    if not (math.isfinite(aspect) and 1e-3 <= aspect <= 1e3):
        raise InputError(f"quilt aspect: expected width/height between 0.001 and 1000, got {aspect!r}")
    return f"{stem}_qs{columns}x{rows}a{aspect:.4g}{suffix}"


def quilt_path(path: str | os.PathLike[str], layout: Quilt) -> Path:
    """Insert a quilt's layout before the suffix of `path` (.png if it has none), instead of one that is there.

    bunny.webp becomes bunny_qs8x6a0.75.webp.
    """
    path = as_path(path)
    match = _NAME.search(path.name)
    suffix = match[4] or ".png" if match else path.suffix or ".png"
    stem = path.name[: match.start()] if match else path.stem
    return path.with_name(quilt_name(stem, layout.columns, layout.rows, layout.aspect, suffix))


def parse_quilt_name(path: str | os.PathLike[str]) -> QuiltName | None:
    """Read columns, rows and aspect from a quilt's file name; None if it does not end in _qs<C>x<R>a<aspect>.<suffix>.

    Raises
    ------
    InputError
        The name has that form, but no or too many tiles, or the aspect 0.
    """
    match = _NAME.search(as_path(path).name)
    if match is None:
        return None
    columns, rows, aspect = int(match[1]), int(match[2]), float(match[3])
    check_grid(columns, rows)
    if aspect <= 0:
        raise InputError(f"{Path(path).name}: expected an aspect > 0, got {match[3]}")
    return QuiltName(columns, rows, aspect)


def check_grid(columns: int, rows: int) -> None:
    """Raise InputError unless both numbers of tiles are 1…32."""
    for name, count in (("columns", columns), ("rows", rows)):
        whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
        if not whole or not 1 <= count <= MAX_TILES:
            raise InputError(f"quilt {name}: expected a whole number from 1 to {MAX_TILES}, got {count!r}")


def choose_grid(views: int, width: int, height: int) -> tuple[int, int]:
    """Choose (columns, rows) for `views` tiles of width × height pixels.

    The fewest unused tiles, as readers take a quilt of C × R to have C·R views; of those the smallest longest side.

    Raises
    ------
    InputError
        No quilt within the limits (32 tiles and 16384 pixels a side) holds them.
    """
    best = None
    for columns in range(1, MAX_TILES + 1):
        rows = -(-views // columns)
        if rows > MAX_TILES or max(columns * width, rows * height) > MAX_PIXELS:
            continue
        cost = (columns * rows - views, max(columns * width, rows * height), columns * width)
        if best is None or cost < best[0]:
            best = cost, (columns, rows)
    if views < 1 or best is None:
        raise InputError(
            f"quilt: no grid of at most {MAX_TILES}×{MAX_TILES} tiles and {MAX_PIXELS}×{MAX_PIXELS} pixels holds "
            f"{counted(views, 'view')} of {width}×{height}"
        )
    return best[1]


def tile_size(size: tuple[int, int], columns: int, rows: int) -> tuple[int, int]:
    """Width and height of the tiles that a reader cuts from a quilt of size = (width, height): ⌊W'/C⌋ × ⌊H'/R⌋."""
    check_grid(columns, rows)
    width, height = size[0] // columns, size[1] // rows
    if width < 1 or height < 1:
        raise InputError(f"quilt: {size[0]}×{size[1]} pixels cannot be {columns}×{rows} tiles")
    return width, height


def pack_quilt(
    views: ViewStack, columns: int, rows: int, size: tuple[int, int] | None = None
) -> NDArray[np.uint8]:
    """Tile views into a quilt, padded to the size that a device wants.

    Parameters
    ----------
    views : ViewStack
        V ≤ C·R views; tiles without one stay black.
    columns, rows : int
        C and R, 1…32.
    size : (width, height), optional
        Pixels of the quilt; what its tiles leave over at the right and top is black padding. None: no padding.

    Returns
    -------
    ndarray of shape (height, width, 3), uint8

    Raises
    ------
    InputError
        Too many views or pixels, or a reader of a quilt of that size would cut tiles of another size.
    """
    check_grid(columns, rows)
    if columns * rows < views.views:
        raise InputError(f"quilt: {columns}×{rows} tiles cannot hold {counted(views.views, 'view')}")
    used = (columns * views.width, rows * views.height)
    size = used if size is None else size
    if max(*size, *used) > MAX_PIXELS:
        wide, tall = (max(pair) for pair in zip(size, used, strict=True))
        raise InputError(f"quilt: expected at most {MAX_PIXELS} pixels a side, got {wide}×{tall}")
    tile = tile_size(size, columns, rows)
    if tile != (views.width, views.height):
        raise InputError(
            f"quilt: {columns}×{rows} tiles of a {size[0]}×{size[1]} quilt are {tile[0]}×{tile[1]} pixels, "
            f"got views of {views.width}×{views.height}"
        )
    quilt = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    for k in range(views.views):
        top, left = size[1] - (k // columns + 1) * tile[1], k % columns * tile[0]
        quilt[top : top + tile[1], left : left + tile[0]] = views.color[k, ..., :3]
    return quilt


def save_quilt(path: str | os.PathLike[str], views: ViewStack, layout: Quilt) -> Path:
    """Write views as the quilt that `layout` describes, padding included; `quilt_path` makes its name."""
    return write_image(path, pack_quilt(views, layout.columns, layout.rows, (layout.width, layout.height)))
