"""Depth of field: each view is the mean of a grid of cameras over a square lens; the focal plane is in focus.

The cameras of one row of the grid are drawn as views of one another, in whatever order the method has: the groups of
Hasselgren 2006, section 4.4. From row to row the vertical lens offset changes.
"""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..engines.engine import Draw, Engine, Target


def beside(schedule: ModuleType, engine: Engine, prepared: Any, draw: Draw) -> int:
    """Bytes of the pictures held beside the target: a row of the lens, its sum and that of all rows."""
    group = 4 * draw.options.lens[0] * draw.pixels
    return group + 2 * 16 * draw.pixels + int(schedule.beside(engine, prepared, lens_draw(draw, 0, 0.0)))


def draw_views(schedule: ModuleType, engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw all views by `schedule`, through the lens that the options give. The target has no depth."""
    columns, rows = draw.options.lens
    _, height, width, _ = target.color.shape
    group = Target(np.empty((columns, height, width, 4), np.uint8))
    total, count = np.empty((height, width, 4), np.uint32), columns * rows
    for i in range(len(draw.offsets)):
        total[...] = 0
        for y in places(draw, rows):
            schedule.draw_views(engine, prepared, lens_draw(draw, i, float(y)), group)
            total += group.color.sum(axis=0, dtype=np.uint32)
        total += count // 2
        total //= count
        target.color[i] = total
    target.covered, target.reused = group.covered, group.reused


def lens_draw(draw: Draw, view: int, y: float) -> Draw:
    """The draw of a row of the lens of a view, at height y."""
    across, (low, high) = places(draw, draw.options.lens[0]), draw.culling
    return replace(
        draw,
        camera=replace(draw.camera, offset_y=draw.camera.offset_y + y),
        offsets=draw.offsets[view] + across,
        culling=(low + across[0], high + across[-1]),
    )


def places(draw: Draw, count: int) -> NDArray[np.float64]:
    """Offsets (count,) of a row or column of cameras from the lens's middle."""
    return np.asarray(draw.options.aperture * ((np.arange(count) + 0.5) / count - 0.5))
