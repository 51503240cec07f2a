"""Depth-image-based rendering: a few views are drawn, the others are warped from their pictures and depths.

What PMR 2020, figure 15, compares with as MDIBR, multiple reference views (Guan et al. 2019). Its cost hardly depends
on the scene; what no reference sees is guessed, and what is translucent or shines moves as if painted on. Warping is
work on pictures: it is done on the CPU, whichever engine draws the references.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..engines.engine import Draw, Engine, Target
from .by_channel import by_channel, held_by_channel


def reference_views(views: int, count: int) -> NDArray[np.int64]:
    """Indices (R,) of the views to draw, R = min(count, views), evenly spread; one alone is that in the middle."""
    if count == 1:
        return np.array([(views - 1) // 2])
    return np.unique(np.rint(np.linspace(0, views - 1, min(count, views))).astype(np.int64))


def beside(engine: Engine, prepared: Any, draw: Draw) -> int:
    """Bytes of the pictures held beside the target."""
    wanted = reference_draw(draw)
    own = 0 if draw.viewmap is None else held_by_channel(draw) + 4 * draw.pixels
    return own + 8 * draw.pixels * len(wanted.offsets) + engine.beside(prepared, wanted)


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw the references, and warp each view from them."""
    from ..engines.cpu.dibr import warp

    references, offsets = draw_references(engine, prepared, draw)
    warp(references, offsets, draw.camera, draw.offsets, target)
    target.covered, target.reused = references.covered, references.reused


@by_channel
def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Warp view after view at the panel's size, and keep of each the sub-pixels that show it, as n_pass does."""
    from ..engines.cpu.dibr import warp

    references, offsets = draw_references(engine, prepared, draw)
    one = Target(np.empty((1, *target.color.shape[:2], 4), np.uint8))
    for i in range(len(draw.offsets)):
        warp(references, offsets, draw.camera, draw.offsets[i : i + 1], one)
        engine.merge_view(one.color[0], i, draw, target.color)
    target.covered, target.reused = references.covered, references.reused


def draw_references(engine: Engine, prepared: Any, draw: Draw) -> tuple[Target, NDArray[np.float64]]:
    """Pictures with depths of the reference views, in one pass, and their offsets (R,)."""
    wanted = reference_draw(draw)
    shape = len(wanted.offsets), draw.camera.height, draw.camera.width
    references = Target(np.empty((*shape, 4), np.uint8), np.empty(shape, np.float32))
    engine.draw(prepared, wanted, references)
    return references, wanted.offsets


def reference_draw(draw: Draw) -> Draw:
    """The draw of the reference views, with depths."""
    offsets = draw.offsets[reference_views(len(draw.offsets), draw.options.references)]
    options = replace(draw.options, aperture=0.0, depth=True)  # the samples of a lens are views by now
    return replace(draw, offsets=offsets, viewmap=None, options=options, method="single-pass")
