"""N passes: the scene is drawn once per view, and a panel is gathered from the views: what is done elsewhere."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..engines.engine import Draw, Engine, Target
from .by_channel import by_channel, held_by_channel


def beside(engine: Engine, prepared: Any, draw: Draw) -> int:
    """Bytes of the pictures held beside the target."""
    one = replace(draw, offsets=draw.offsets[:1], viewmap=None)
    own = 0 if draw.viewmap is None else held_by_channel(draw) + 4 * draw.pixels
    return own + engine.beside(prepared, one)


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw view after view."""
    for i in range(len(draw.offsets)):
        depth = None if target.depth is None else target.depth[i : i + 1]
        one = Target(target.color[i : i + 1], depth)
        engine.draw(prepared, replace(draw, offsets=draw.offsets[i : i + 1]), one)
        target.covered += one.covered
        target.reused += one.reused


@by_channel
def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw view after view at the panel's size, and keep of each the sub-pixels that show it.

    Only one view is held at a time. A continuous map's camera coordinate is rounded to the nearest view.
    """
    height, width, _ = target.color.shape
    one = Target(np.empty((1, height, width, 4), np.uint8))
    for i in range(len(draw.offsets)):
        engine.draw(prepared, replace(draw, offsets=draw.offsets[i : i + 1], viewmap=None), one)
        engine.merge_view(one.color[0], i, draw, target.color)
    target.covered, target.reused = one.covered, one.reused
