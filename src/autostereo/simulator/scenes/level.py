"""A game level of about 2000: rooms in a grid, two textures on every pixel, large walls beside finely cut columns.

Only rooms that can be seen through the doors are drawn, nearest first: the paper's potentially visible set.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...display.rig import Rig
from ..textures import Texture
from ..workload import Draw, Workload
from .building import Array, Builder, Points, light_map, masonry

ROOMS, SIDE, HEIGHT = 5, 8.0, 4.0
DOOR, LINTEL = 2.6, 3.0
MATERIALS = 12
EYE = 1.7
MARGIN = 0.6  # metres that a door is wider to the outer cameras


@cache
def _textures() -> tuple[Texture, ...]:
    stones = [masonry(256, 10 * k, (4, 8, 16, 6)[k % 4]) for k in range(MATERIALS)]
    return (*stones, *(light_map(256, 1000 + 50 * k) for k in range(ROOMS * ROOMS)))


@cache
def _room(column: int, row: int) -> tuple[Draw, ...]:
    """One room with its half of the walls."""
    number = row * ROOMS + column
    rng = np.random.default_rng(number)
    build = Builder(MATERIALS + number)
    floor, ceiling, wall, trim, metal = (int(k) for k in rng.permutation(MATERIALS)[:5])
    x0, z0, s, h = column * SIDE, row * SIDE, SIDE, HEIGHT
    build.quad(floor, (x0, 0, z0 + s), (s, 0, 0), (0, 0, -s), (2, 2))
    build.quad(ceiling, (x0, h, z0), (s, 0, 0), (0, 0, s), (2, 2))
    walls = [
        ((x0, z0), (s, 0), row > 0), ((x0 + s, z0), (0, s), column < ROOMS - 1),
        ((x0 + s, z0 + s), (-s, 0), row < ROOMS - 1), ((x0, z0 + s), (0, -s), column > 0),
    ]  # fmt: skip
    for (x, z), (dx, dz), has_door in walls:
        origin, along = np.array([x, 0.0, z]), np.array([dx, 0.0, dz])
        if not has_door:
            build.quad(wall, origin, along, (0, h, 0), (2, 1))
            continue
        side = (1 - DOOR / s) / 2
        build.quad(wall, origin, along * side, (0, h, 0))
        build.quad(wall, origin + along * (1 - side), along * side, (0, h, 0))
        build.quad(wall, origin + along * side + (0, LINTEL, 0), along * DOOR / s, (0, h - LINTEL, 0))
        inward = np.cross(along / s, (0.0, 1.0, 0.0))

        def arch(u: Array, v: Array, origin: Array = origin, along: Array = along, inward: Array = inward) -> Points:
            # a moulding around the door, finely cut
            angle = np.pi * u
            reach = DOOR / 2 + 0.12 + 0.12 * np.cos(2 * np.pi * v)
            across = 0.5 + reach * -np.cos(angle) / s
            p = origin + across[..., None] * along + (0.05 + 0.12 * np.sin(2 * np.pi * v))[..., None] * inward
            return p[..., 0], 0.3 + 2.6 * np.sin(angle) ** 0.6 + 0.1 * np.cos(2 * np.pi * v), p[..., 2]

        build.patch(trim, arch, (20, 6), (7.0, 0.8))
    for cx in (1.6, s - 1.6):
        for cz in (1.6, s - 1.6):
            build.column(trim, (x0 + cx, 0, z0 + cz), 0.28, h, (14, 10))
    for k in range(2):
        z = z0 + 0.5 + k * (s - 1.0)
        build.pipe(metal, (x0, h - 0.5, z), (x0 + s, h - 0.5, z), 0.12, (8, 20))
    for _ in range(3):
        size = rng.uniform(0.5, 1.1)
        x, z = rng.uniform(2.2, s - 2.2, 2)
        build.box(metal, (x0 + x, size / 2, z0 + z), size)
    return tuple(build.draws())


def _visible_rooms(eye: np.ndarray, forward: np.ndarray) -> list[tuple[int, int]]:
    """Rooms seen through doors from a place (x, z) that looks along `forward`, nearest first."""
    start = (int(np.clip(eye[0] // SIDE, 0, ROOMS - 1)), int(np.clip(eye[1] // SIDE, 0, ROOMS - 1)))
    heading = np.arctan2(forward[0], -forward[1])
    found: dict[tuple[int, int], None] = {}

    def visit(room: tuple[int, int], low: float, high: float, came: tuple[int, int]) -> None:
        found.setdefault(room)
        for step in ((0, -1), (1, 0), (0, 1), (-1, 0)):
            there = (room[0] + step[0], room[1] + step[1])
            if step == (-came[0], -came[1]) or not all(0 <= k < ROOMS for k in there):
                continue
            middle = (np.array(room) + 0.5 + 0.5 * np.array(step)) * SIDE
            half = (DOOR / 2 + MARGIN) * np.array([abs(step[1]), abs(step[0])])
            ends = []
            for corner in (middle - half, middle + half):
                d = corner - eye
                turn = np.arctan2(d[0], -d[1]) - heading
                ends.append((turn + np.pi) % (2 * np.pi) - np.pi)
            first, last = min(ends), max(ends)
            near = np.abs(middle - eye).max() < 1.5
            if last - first > np.pi and not near:
                continue  # behind the camera
            if near:
                first, last = low, high
            if max(low, first) < min(high, last):
                visit(there, max(low, first), min(high, last), step)

    visit(start, -0.85, 0.85, (0, 0))
    return sorted(found, key=lambda room: float(np.hypot(*((np.array(room) + 0.5) * SIDE - eye))))


def _path(t: float) -> np.ndarray:
    """Place (x, z) on a closed walk through the doors, t in 0…1."""
    corners = np.array([(0, 0), (0, 2), (2, 2), (2, 4), (4, 4), (4, 1), (2, 1), (2, 0), (0, 0)], float)
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    at = np.concatenate([[0], np.cumsum(steps)]) / steps.sum()
    return (np.stack([np.interp(t % 1, at, corners[:, k]) for k in range(2)]) + 0.5) * SIDE


def frame(number: int) -> tuple[Workload, Rig]:
    """Frame 0 … 199."""
    t = number / 200
    eye = np.mean([_path(t + 0.004 * k) for k in range(-4, 5)], axis=0)  # corners are cut
    ahead = np.mean([_path(t + 0.03 + 0.004 * k) for k in range(-4, 5)], axis=0)
    forward = (ahead - eye) / np.linalg.norm(ahead - eye)
    draws = [draw for room in _visible_rooms(eye, forward) for draw in _room(*room)]
    rig = Rig(
        (float(eye[0]), EYE, float(eye[1])), (float(eye[0] + forward[0]), EYE - 0.05, float(eye[1] + forward[1])),
        fov_y=60.0, focal_distance=5.0, near=0.1, views=1,
    )  # fmt: skip
    return Workload(tuple(draws), _textures(), (0.0, 0.0, 0.0), name="level"), rig
