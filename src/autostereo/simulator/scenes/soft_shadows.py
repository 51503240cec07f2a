"""Adaptive soft shadows with bump and gloss maps (Uralsky 2005), as the paper's model of a next generation's engine."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...display.rig import Rig
from ...scene.mesh import Mesh
from ...scene.shapes import plane, torus_knot, uv_sphere
from ...transforms import apply, apply_normals, eye_from_world, rotation, translation
from ..machine import Machine
from ..pipeline import Pass, Pictures, Setting, make_view
from ..textures import Texture
from ..workload import Draw, Workload
from .building import colored, image, masonry, noise

LIGHT = Rig((5.0, 9.0, 4.0), (0.0, 0.5, 0.0), fov_y=55.0, near=1.0, views=1)
MAP = 512
RADIUS, BIAS = 0.006, -0.002  # of the penumbra, in widths of the map; relative
UP = np.array([0.0, 1.0, 0.0])


def _normal_map(size: int, seed: int) -> Texture:
    height = noise(size, seed, 1.4) * size * 0.06
    dx = np.roll(height, -1, 1) - np.roll(height, 1, 1)
    dy = np.roll(height, 1, 0) - np.roll(height, -1, 0)
    normal = np.stack([-dx / 2, -dy / 2, np.ones_like(dx)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return Texture(image(normal / 2 + 0.5))


def _objects() -> list[tuple[Mesh, float]]:
    """Meshes in place, and how often their textures repeat."""
    floor = plane((14.0, 14.0), (8, 8))
    flat = np.eye(4)
    flat[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # the plane's z becomes up
    made = [(_placed(floor, flat), 6.0)]
    made.append((_placed(torus_knot(), translation(0.0, 1.3, 0.0) @ rotation((0, 1, 0), 30)), 4.0))
    for k in range(6):
        angle = k * np.pi / 3
        place = translation(3.2 * np.cos(angle), 0.7 + 0.3 * (k % 2), 3.2 * np.sin(angle))
        made.append((_placed(uv_sphere(48, 24, 0.7), place), 2.0))
    return made


def _placed(mesh: Mesh, world_from_object: NDArray[np.float64]) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces, mesh.shading_normals, uv=mesh.uv, transform=world_from_object)


def _uv(mesh: Mesh) -> NDArray[np.float64]:
    if mesh.uv is not None:
        return mesh.uv
    x, y, z = mesh.vertices.T
    return np.stack([np.arctan2(x, z) / (2 * np.pi), y], axis=1)


@cache
def _scene() -> tuple[Workload, Rig]:
    half = np.tan(np.deg2rad(LIGHT.fov_y) / 2)
    light_from_world = eye_from_world(LIGHT.position, LIGHT.target, LIGHT.up)
    towards = -light_from_world[2, :3]
    blockers, draws = [], []
    for mesh, repeats in _objects():
        assert mesh.transform is not None
        world = apply(mesh.transform, mesh.vertices)
        normals = apply_normals(mesh.transform, mesh.shading_normals)
        tangents = np.cross(UP, normals)
        flat = np.linalg.norm(tangents, axis=1) < 1e-3
        tangents[flat] = 1.0, 0.0, 0.0
        light = apply(light_from_world, world)
        uv = repeats * _uv(mesh)[mesh.faces]
        uv = np.where(np.ptp(uv, axis=1, keepdims=True) > repeats / 2, np.mod(uv + repeats / 2, repeats), uv)
        uv = uv - np.floor(uv.min(axis=1, keepdims=True))
        light[:, :2] /= 2 * half
        per_vertex = np.concatenate([normals, tangents, world, light], axis=1)[mesh.faces]
        attributes = np.concatenate([uv, per_vertex], axis=2)
        corners = world[mesh.faces]
        draws.append(
            Draw(corners, attributes, "shadows", (0, 1, 2, 3), (*towards, RADIUS, BIAS, LIGHT.near_depth), facing=1)
        )
        blockers.append(Draw(corners, np.zeros((len(corners), 3, 1)), "plain"))
    grain = Texture(image(colored(noise(256, 5, 1.2), (0.1, 0.1, 0.1), (0.7, 0.7, 0.7))))
    textures = (masonry(512, 3, 10), _normal_map(256, 4), grain, Texture(_shadow_map(blockers), mipmaps=False))
    return Workload(tuple(draws), textures, (0.05, 0.05, 0.08), name="soft-shadows"), LIGHT


def _shadow_map(blockers: list[Draw]) -> NDArray[np.uint8]:
    """Depths from the light (MAP, MAP, 4): 32-bit words, the high byte first; drawn by the machine itself."""
    size = (MAP, MAP)
    pictures = Pictures.empty((1, MAP, MAP), (0, 0, 0), False)
    state = Pass(Workload(tuple(blockers)), Machine(), LIGHT, make_view(LIGHT, size), (0, 1), pictures)
    state.draw_all(Setting(color=False))
    return state.depth.values[0].astype(">u4").view(np.uint8).reshape(MAP, MAP, 4)


def frame(number: int) -> tuple[Workload, Rig]:
    """Frame 0 … 199: the camera goes round, up and down."""
    workload, _ = _scene()
    angle = 2 * np.pi * number / 200
    distance = 7.0 + 1.5 * np.cos(2 * angle)
    position = (distance * np.sin(angle), 3.0 + 1.2 * np.sin(angle), distance * np.cos(angle))
    return workload, Rig(position, (0.0, 0.6, 0.0), fov_y=45.0, near=0.1, views=1)
