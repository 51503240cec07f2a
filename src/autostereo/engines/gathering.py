"""What the gather functions of every engine accept: checks, the tiles of a quilt, the extent of a lens."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..checks import check_choice
from ..errors import InputError
from ..viewmap import ViewMap
from ..wording import counted

Pixels = NDArray[np.uint8]

FILTERS = ("nearest", "linear")
TIE = 1e-9  # phases closer than this are the same
MAX_ROWS = 32  # rows that observe searches when a table is taller


class Tiles(NamedTuple):
    """Where the tiles of a quilt lie: C tiles a row, tile size, quilt size and channels per pixel."""

    columns: int
    width: int
    height: int
    quilt_width: int
    quilt_height: int
    channels: int


def check_interlace(views: Pixels, viewmap: ViewMap, out: Pixels) -> None:
    """Raise InputError unless V pictures (V, H, W, 4) and a panel (H, W, 3) fit each other and the view map."""
    if views.ndim != 4 or views.shape[3] not in (3, 4) or views.dtype != np.uint8 or 0 in views.shape:
        raise InputError(f"interlace: expected views (V, H, W, 4) uint8, got {views.shape} {views.dtype}")
    if views.shape[0] != viewmap.views:
        raise InputError(f"interlace: the display has {counted(viewmap.views, 'view')}, got {len(views)} pictures")
    if out.shape != (*views.shape[1:3], 3) or out.dtype != np.uint8:
        raise InputError(f"interlace: expected a panel {(*views.shape[1:3], 3)} uint8, got {out.shape} {out.dtype}")


def quilt_tiles(
    quilt: Pixels, grid: tuple[int, int], viewmap: ViewMap, size: tuple[int, int], filter: str
) -> Tiles:
    """Cut a quilt (H', W', 3 | 4) into C × R tiles, or raise InputError; see `weave` for the arguments."""
    if quilt.ndim != 3 or quilt.shape[2] not in (3, 4) or quilt.dtype != np.uint8:
        raise InputError(f"quilt: expected (H, W, 3 or 4) uint8, got {quilt.shape} {quilt.dtype}")
    (columns, rows), (width, height) = grid, size
    if columns < 1 or rows < 1 or quilt.shape[1] < columns or quilt.shape[0] < rows:
        raise InputError(f"quilt: {quilt.shape[1]}×{quilt.shape[0]} pixels cannot be {columns}×{rows} tiles")
    if columns * rows < viewmap.views:
        needed = counted(viewmap.views, "view")
        raise InputError(f"quilt: {columns}×{rows} tiles cannot hold the {needed} of the display")
    if width < 1 or height < 1:
        raise InputError(f"size: expected a panel of at least 1×1 pixels, got {width}×{height}")
    check_choice("filter", filter, FILTERS)
    return Tiles(
        columns, quilt.shape[1] // columns, quilt.shape[0] // rows, quilt.shape[1], quilt.shape[0], quilt.shape[2]
    )


def lens_size(viewmap: ViewMap, size: tuple[int, int], period: float | None = None) -> tuple[int, int]:
    """Rows and columns of the window in which `observe` looks for the sub-pixels of one lens.

    Phase maps: one row, and one lens period about the pixel. Tables: one period of the table both ways (at most
    32 rows), as slanted tables spread the views and colours of one lens over several rows.

    Parameters
    ----------
    size : (W, H)
        Panel pixels.
    period : float, optional
        Lens period in pixels along x; None: 1/|a|, or the width of the table.

    Raises
    ------
    InputError
        The period is not a number > 0.
    """
    if period is None:
        period = viewmap.table.shape[1] if viewmap.table is not None else 1 / abs(viewmap.a) if viewmap.a else 1.0
    if not period > 0:
        raise InputError(f"period: expected a number of pixels > 0, got {period!r}")
    wide = 2 * int(min(period, size[0]) / 2 + 0.5) + 1
    tall = 1 if viewmap.table is None else min(viewmap.table.shape[0], MAX_ROWS)
    return min(tall, size[1]), min(wide, size[0])


def check_observe(panel: Pixels, wanted: NDArray[np.float64], crosstalk: float) -> None:
    """Raise InputError unless the panel is (H, W, 3), the wanted phases (W, 3) and the crosstalk in [0, 1)."""
    if panel.ndim != 3 or panel.shape[2] != 3 or panel.dtype != np.uint8 or 0 in panel.shape:
        raise InputError(f"panel: expected (H, W, 3) uint8, got {panel.shape} {panel.dtype}")
    if wanted.shape != panel.shape[1:] or not np.isfinite(wanted).all():
        raise InputError(f"wanted: expected finite phases of shape {panel.shape[1:]}, got {wanted.shape}")
    if not isinstance(crosstalk, (int, float, np.number)) or not 0 <= crosstalk < 1:
        raise InputError(f"crosstalk: expected a number in [0, 1), got {crosstalk!r}")
