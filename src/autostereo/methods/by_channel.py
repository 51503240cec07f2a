"""Panels whose sub-pixels are sampled at their own centres, made of whole pictures: a picture a channel.

Channel c of a pixel lies in its c-th third: drawn by a camera whose picture is moved by (1 − c)/3 of a pixel, the
centres of its pixels are those of the channel. What a method makes of pictures stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any

import numpy as np

from ..engines.engine import Draw, Engine, Target, channel_camera

DrawPanel = Callable[[Engine, Any, Draw, Target], None]


def by_channel(draw_panel: DrawPanel) -> DrawPanel:
    """Let a method that samples pixels at their centres draw panels with `sampling="subpixel"`, too."""

    @wraps(draw_panel)
    def draw(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
        if draw.options.sampling == "pixel":
            draw_panel(engine, prepared, draw, target)
            return
        pixels = np.empty_like(target.color)
        for c in range(3):
            one = Target(pixels)
            draw_panel(engine, prepared, of_channel(draw, c), one)
            target.color[..., c] = pixels[..., c]
            target.covered, target.reused = target.covered + one.covered, target.reused + one.reused

    return draw


def held_by_channel(draw: Draw) -> int:
    """Bytes of the panel that `by_channel` holds beside the target."""
    return 0 if draw.options.sampling == "pixel" else 3 * draw.pixels


def of_channel(draw: Draw, channel: int) -> Draw:
    """The draw whose pixels are sampled where channel 0, 1 or 2 of a panel's pixels lies."""
    camera = channel_camera(draw.camera, channel)
    return replace(draw, camera=camera, options=replace(draw.options, sampling="pixel"))
