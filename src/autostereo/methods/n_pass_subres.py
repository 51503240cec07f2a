"""N passes at sub-resolution: small views, scaled up while they are interlaced (Hübner 2007a, section 2.3).

Each view has about 1/V of the panel's pixels, so that all views together cost about one panel, or the size that
`Options.small_size` says; the picture is blurred.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..engines.engine import Draw, Engine, Target, small_camera
from ..errors import UnsupportedError
from ..frame import ViewStack
from . import n_pass
from .by_channel import by_channel, held_by_channel


def beside(engine: Engine, prepared: Any, draw: Draw) -> int:
    """Bytes of the pictures held beside the target: small views, and the quilt that they are woven from."""
    small = replace(draw, camera=small_camera(draw), viewmap=None)
    columns, rows = quilt_grid(len(draw.offsets))
    one = replace(small, offsets=draw.offsets[:1])
    pictures = 4 * small.pixels * (len(draw.offsets) + columns * rows)
    return held_by_channel(draw) + pictures + engine.beside(prepared, one)


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """There is no resolution to save in a stack of views."""
    others = ", ".join(name for name in engine.methods if name != draw.method)
    raise UnsupportedError(f"method {draw.method!r}: for panels only; for views the {engine.name} engine has {others}")


@by_channel
def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw V small views one after the other and weave them into the panel, bilinearly."""
    small = replace(draw, camera=small_camera(draw), viewmap=None)
    stack = Target(np.empty((len(draw.offsets), small.camera.height, small.camera.width, 4), np.uint8))
    n_pass.draw_views(engine, prepared, small, stack)
    columns, rows = quilt_grid(len(draw.offsets))
    quilt = ViewStack(stack.color).quilt(columns, rows)
    target.color[...] = engine.weave(quilt, (columns, rows), draw, (draw.camera.width, draw.camera.height))
    target.covered, target.reused = stack.covered, stack.reused


def quilt_grid(views: int) -> tuple[int, int]:
    """Columns and rows of a quilt of so many views."""
    columns = int(np.ceil(views**0.5))
    return columns, -(-views // columns)
