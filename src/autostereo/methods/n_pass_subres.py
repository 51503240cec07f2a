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


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """There is no resolution to save in a stack of views."""
    others = ", ".join(name for name in engine.methods if name != draw.method)
    raise UnsupportedError(f"method {draw.method!r}: for panels only; for views the {engine.name} engine has {others}")


def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw V small views one after the other and weave them into the panel, bilinearly."""
    assert draw.viewmap is not None
    height, width, _ = target.color.shape
    views = len(draw.offsets)
    small_width, small_height = max(1, round(width / views**0.5)), max(1, round(height / views**0.5))
    camera = replace(
        draw.camera,
        width=small_width,
        height=small_height,
        fx=draw.camera.fx * small_width / width,
        fy=draw.camera.fy * small_height / height,
    )
    stack = Target(np.empty((views, small_height, small_width, 4), np.uint8))
    n_pass.draw_views(engine, prepared, replace(draw, camera=camera, viewmap=None), stack)
    columns = int(np.ceil(views**0.5))
    rows = -(-views // columns)
    quilt = ViewStack(stack.color).quilt(columns, rows)
    target.color[...] = engine.weave(quilt, (columns, rows), draw, (width, height))
    target.covered, target.reused = stack.covered, stack.reused
