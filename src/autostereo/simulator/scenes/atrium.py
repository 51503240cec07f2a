"""A court with two storeys of arcades, decals and light maps on every pixel, for depth of field."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ...display.rig import Rig
from ..textures import Texture
from ..workload import Draw, Workload
from .building import Array, Builder, Points, light_map, masonry

LENGTH, WIDTH, STOREY, AISLE, BAYS = 24.0, 7.0, 4.0, 2.5, 8


@cache
def _textures() -> tuple[Texture, ...]:
    stones = [masonry(256, 300 + 10 * k, (6, 12, 4, 20, 8)[k % 5]) for k in range(5)]
    return (*stones, light_map(256, 777))


@cache
def _draws() -> tuple[Draw, ...]:
    build = Builder(5)
    outer = WIDTH / 2 + AISLE
    height = 2 * STOREY
    build.quad(0, (-outer, 0, 0), (2 * outer, 0, 0), (0, 0, -LENGTH), (2, 6))
    for side in (-1.0, 1.0):
        build.quad(1, (side * outer, 0, 0), (0, 0, -LENGTH), (0, height, 0), (6, 2))
        inner = WIDTH / 2
        for storey in range(2):
            y = storey * STOREY
            for bay in range(BAYS):
                z = -(bay + 0.5) * LENGTH / BAYS
                build.column(2, (side * inner, y, z), 0.22 if storey else 0.3, STOREY * 0.7, (16, 8))
                _arch(build, side * inner, y + STOREY * 0.7, z, LENGTH / BAYS)
            low, high = sorted((side * inner, side * outer))
            build.quad(4, (low, y + STOREY, -LENGTH), (high - low, 0, 0), (0, 0, LENGTH), (1, 6))
    build.quad(3, (-outer, 0, -LENGTH), (2 * outer, 0, 0), (0, height, 0), (2, 2))
    build.quad(3, (outer, 0, 0), (-2 * outer, 0, 0), (0, height, 0), (2, 2))
    return tuple(replace(draw, facing=0) for draw in build.draws())


def _arch(build: Builder, x: float, y: float, z: float, span: float) -> None:
    """A round arch from this column to the next, as thick as a column."""
    rise = STOREY * 0.3 - 0.1

    def shape(s: Array, t: Array) -> Points:
        angle = np.pi * s
        lift = np.where(t < 0.5, np.sin(angle) * rise * 0.95, rise + 0.1)
        thick = 0.25 * np.cos(2 * np.pi * t)
        return x + thick, y + lift, z - span / 2 * (1 - np.cos(angle))

    build.patch(3, shape, (16, 8), (span, 1.0))


def frame(number: int) -> tuple[Workload, Rig]:
    """Frame 0 … 199: a slow walk through the court."""
    t = number / 200
    position = (1.2 * np.sin(2 * np.pi * t), 1.7 + 1.5 * t, -1.0 - 7.0 * t)
    target = (0.3 * np.sin(5 * t), 2.4, -20.0)
    rig = Rig(position, target, fov_y=60.0, focal_distance=7.0, near=0.1, views=1)
    return Workload(_draws(), _textures(), (0.5, 0.65, 0.9), name="atrium"), rig
