"""N passes at sub-resolution: small views, scaled up while they are interlaced (Hübner 2007a, section 2.3).

Each view has about 1/V of the panel's pixels, so that all views together cost about one panel; the picture is blurred.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..engines.engine import Draw, Engine, Target
from ..errors import UnsupportedError
from ..frame import ViewStack
from . import n_pass
from .by_channel import by_channel, held_by_channel


def beside(engine: Engine, prepared: Any, draw: Draw) -> int:
    """Bytes of the pictures held beside the target: small views, and the quilt that they are woven from."""
    small = small_draw(draw)
    columns, rows = quilt_grid(len(draw.offsets))
    one = replace(small, offsets=draw.offsets[:1])
    pictures = 4 * small.pixels * (len(draw.offsets) + columns * rows)
    return held_by_channel(draw) + pictures + engine.beside(prepared, one)


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """There is no resolution to save in a stack of views."""
    raise UnsupportedError("method 'n-pass-subres': for panels only; a stack of views has n-pass and single-pass")


@by_channel
def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw V small views one after the other and weave them into the panel, bilinearly."""
    small = small_draw(draw)
    stack = Target(np.empty((len(draw.offsets), small.camera.height, small.camera.width, 4), np.uint8))
    n_pass.draw_views(engine, prepared, small, stack)
    columns, rows = quilt_grid(len(draw.offsets))
    quilt = ViewStack(stack.color).quilt(columns, rows)
    target.color[...] = engine.weave(quilt, (columns, rows), draw, (draw.camera.width, draw.camera.height))
    target.covered, target.reused = stack.covered, stack.reused


def small_draw(draw: Draw) -> Draw:
    """The draw of small views instead of a panel."""
    camera, share = draw.camera, len(draw.offsets) ** -0.5
    width, height = max(1, round(camera.width * share)), max(1, round(camera.height * share))
    small = replace(
        camera,
        width=width,
        height=height,
        fx=camera.fx * width / camera.width,
        fy=camera.fy * height / camera.height,
        shift=(camera.shift[0] * width / camera.width, 0.0),
        spread=1.0,
    )
    return replace(draw, camera=small, viewmap=None)


def quilt_grid(views: int) -> tuple[int, int]:
    """Columns and rows of a quilt of so many views."""
    columns = int(np.ceil(views**0.5))
    return columns, -(-views // columns)
