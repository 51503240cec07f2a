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


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """There is no resolution to save in a stack of views."""
    raise UnsupportedError("method 'n-pass-subres': for panels only; a stack of views has n-pass and single-pass")


def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw V small views one after the other and weave them into the panel, bilinearly."""
    assert draw.viewmap is not None
    height, width, _ = target.color.shape
    views = len(draw.offsets)
    camera = small_camera(draw)
    stack = Target(np.empty((views, camera.height, camera.width, 4), np.uint8))
    n_pass.draw_views(engine, prepared, replace(draw, camera=camera, viewmap=None), stack)
    columns = int(np.ceil(views**0.5))
    rows = -(-views // columns)
    quilt = ViewStack(stack.color).quilt(columns, rows)
    target.color[...] = engine.weave(quilt, (columns, rows), draw, (width, height))
    target.covered, target.reused = stack.covered, stack.reused
