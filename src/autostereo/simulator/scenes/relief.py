"""The atrium under water, from which the stones of its floor stand out: a shader that gives depths.

The floor is one plane with heights in its texture's alpha; where stones are higher than the water, it ends at them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ...display.rig import Rig
from ..textures import Texture
from ..workload import Draw, Workload
from . import atrium
from .building import Builder, image, noise

FLOOR = 0  # its texture in the atrium
HEIGHT, WATER = 0.2, 0.01  # metres from the lowest stone to the highest; level of the water


@cache
def _workload() -> Workload:
    workload, _ = atrium.frame(0)
    stones = workload.textures[FLOOR].image
    height = np.broadcast_to(image(noise(stones.shape[0], 77, 1.6))[..., None], (*stones.shape[:2], 1))
    textures = (Texture(np.concatenate([stones[..., :3], height], axis=2)), *workload.textures[1:])
    dry = [_raised(draw) if draw.textures[0] == FLOOR else draw for draw in workload.draws]
    outer = atrium.WIDTH / 2 + atrium.AISLE
    build = Builder(len(textures) - 1)
    build.quad(FLOOR, (-outer, WATER, 0), (2 * outer, 0, 0), (0, 0, -atrium.LENGTH), (2, 6))
    water = [replace(draw, shader="plain", uniforms=(0.1, 0.25, 0.3, 0.7), blend="alpha") for draw in build.draws()]
    return Workload((*dry, *water), textures, workload.background, name="relief")


def _raised(draw: Draw) -> Draw:
    up = np.broadcast_to([0.0, 1.0, 0.0], draw.corners.shape)
    attributes = np.concatenate([draw.attributes, up, draw.corners], axis=2)
    return replace(draw, attributes=attributes, shader="relief", uniforms=(1.0, HEIGHT), depth_output=True)


def frame(number: int) -> tuple[Workload, Rig]:
    """Frame 0 … 199: the atrium's walk."""
    return _workload(), atrium.frame(number)[1]
