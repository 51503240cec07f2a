"""Depth of field: each view is the mean of a grid of cameras over a square lens; the focal plane is in focus.

The cameras of one row of the grid are drawn as views of one another, in whatever order the method has: the groups of
Hasselgren 2006, section 4.4. From row to row the vertical lens offset changes.
"""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from ..engines.engine import Draw, Engine, Target


def draw_views(schedule: ModuleType, engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw all views by `schedule`, through the lens that the options give. The target has no depth."""
    columns, rows = draw.options.lens
    across, up = (draw.options.aperture * ((np.arange(n) + 0.5) / n - 0.5) for n in (columns, rows))
    low, high = draw.culling
    culling = (low + across[0], high + across[-1])
    _, height, width, _ = target.color.shape
    group = Target(np.empty((columns, height, width, 4), np.uint8))
    count = columns * rows
    for i, offset in enumerate(draw.offsets):
        total = np.zeros((height, width, 4), np.uint32)
        for y in up:
            camera = replace(draw.camera, offset_y=draw.camera.offset_y + float(y))
            lens_draw = replace(draw, camera=camera, offsets=offset + across, culling=culling)
            schedule.draw_views(engine, prepared, lens_draw, group)
            total += group.color.sum(axis=0, dtype=np.uint32)
        target.color[i] = (total + count // 2) // count
    target.covered, target.reused = group.covered, group.reused
