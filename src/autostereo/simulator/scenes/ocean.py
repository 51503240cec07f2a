"""Animated water with bump-mapped reflection and refraction (after Pelzer 2004): the paper's nightmare case.

What is read of sky and sea floor depends on the view and diverges from pixel to pixel.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...display.rig import Rig
from ..textures import Texture
from ..workload import Draw, Workload
from .building import colored, image, noise
from .soft_shadows import _normal_map

CELLS, EXTENT = 64, 60.0
WAVES = ((0.22, 0.31, 0.35), (-0.4, 0.17, 0.2), (0.61, -0.43, 0.11), (-0.3, -0.95, 0.06))  # (kx, kz, height)


@cache
def _textures() -> tuple[Texture, ...]:
    sky = colored(noise(512, 21, 1.5) ** 1.5, (0.25, 0.45, 0.8), (1.0, 0.97, 0.92))
    floor = colored(noise(512, 22, 1.1), (0.05, 0.2, 0.2), (0.5, 0.65, 0.45))
    foam = colored(noise(256, 23, 0.9) ** 2, (0, 0, 0), (1, 1, 1))
    return _normal_map(256, 20), Texture(image(sky)), Texture(image(floor)), Texture(image(foam))


def frame(number: int) -> tuple[Workload, Rig]:
    """Frame 0 … 199: a flight over the waves."""
    time = number / 25
    position = np.array([6 * np.sin(number / 60), 3.2 + 0.8 * np.sin(number / 35), -number * 0.1])
    axis = np.linspace(-EXTENT / 2, EXTENT / 2, CELLS + 1)
    x, z = np.meshgrid(axis, axis - EXTENT * 0.4)
    z = z + position[2]
    height = sum(a * np.sin(2 * (kx * x + kz * z) + 1.6 * time * np.hypot(kx, kz)) for kx, kz, a in WAVES)
    points = np.stack([x, height, z], axis=-1).reshape(-1, 3)
    grid = np.arange((CELLS + 1) ** 2).reshape(CELLS + 1, CELLS + 1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=-1).reshape(-1, 3)
    per_vertex = np.concatenate([points[:, [0, 2]], points, points[:, 1:2]], axis=1)
    corners = points[faces]
    draw = Draw(corners, per_vertex[faces], "ocean", (0, 1, 2, 3), (time, float(position[1])), facing=0)
    target = position + np.array([0.0, -0.35, -1.0])
    rig = Rig(tuple(position), tuple(target), fov_y=50.0, focal_distance=9.0, near=0.1, views=1)
    return Workload((draw,), _textures(), (0.4, 0.6, 0.85), name="ocean"), rig
