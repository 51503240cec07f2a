"""Small workloads for the tests of the simulator."""

from __future__ import annotations

import numpy as np

import autostereo as aus
from autostereo.simulator import Draw, Machine, Texture, Workload

SIZE = (72, 56)
RIG = aus.Rig(position=(0, 0, 4), fov_y=50, baseline=0.8, views=5, near=0.2)
MULTI = Machine.load("multi-view")


def layers(seed: int = 3, count: int = 12, blend: str = "replace") -> Workload:
    """Large textured triangles at many depths, in random order, some through the near plane and beside the picture."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.1, 9, (count, 3))
    spread = rng.uniform(-1.5, 1.5, (count, 3, 2)) * depth[..., None]
    corners = np.concatenate([spread, 4 - depth[..., None]], axis=2)
    attributes = np.concatenate([rng.uniform(0, 6, (count, 3, 2)), rng.uniform(0, 1, (count, 3, 2))], axis=2)
    smooth = np.kron(rng.integers(0, 256, (16, 16, 3)), np.ones((8, 8, 1))).astype(np.uint8)
    textures = (Texture(smooth), Texture(rng.integers(60, 200, (32, 32, 3)).astype(np.uint8)))
    return Workload((Draw(corners, attributes, "level", (0, 1), (0.6,), blend),), textures, (0.2, 0.3, 0.4))


def wall(slope: float = 0.0, cells: int = 1) -> Workload:
    """A wall that fills every view, textured; it recedes to the right by `slope`."""
    s, t = np.meshgrid(np.linspace(-6, 6, cells + 1), np.linspace(-6, 6, cells + 1))
    points = np.stack([s, t, -slope * (s + 6)], axis=-1).reshape(-1, 3)
    grid = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=-1).reshape(-1, 3)
    uv = points[:, :2] / 12  # 43 texels a unit
    y, x = np.mgrid[:512, :512] * 2 * np.pi / 32
    waves = np.stack([0.5 + 0.3 * np.sin(x), 0.5 + 0.3 * np.sin(y), 0.5 + 0.3 * np.sin(x + y)], -1)
    image = np.floor(255 * waves).astype(np.uint8)
    attributes = np.concatenate([uv, 0.5 + 0 * uv], axis=1)[faces]
    white = Texture(np.full((1, 1, 3), 128, np.uint8))
    return Workload((Draw(points[faces], attributes, "level", (0, 1), (1.0,)),), (Texture(image), white))
