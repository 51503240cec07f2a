"""Weaving a quilt with plain NumPy fancy indexing, as one writes it without a compiler.

`plan` makes the panel-sized index arrays once, `gather` is the indexing alone, `weave` is both. A benchmark can time
either: a program that keeps the arrays (225 MB at 1536×2048) pays for `gather` only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from autostereo import ViewMap
from autostereo.cli.benchmarks.peers_numpy import Index
from autostereo.cli.benchmarks.peers_numpy import weave_index as plan


def gather(quilt: NDArray[np.uint8], index: Index) -> NDArray[np.uint8]:
    """The panel (H, W, 3)."""
    return quilt[index]


def weave(
    quilt: NDArray[np.uint8], grid: tuple[int, int], viewmap: ViewMap, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """The panel (H, W, 3), filter nearest, no flips; arguments as autostereo.engines.cpu.gather.weave."""
    return gather(quilt, plan((quilt.shape[1], quilt.shape[0]), grid, viewmap, size))
