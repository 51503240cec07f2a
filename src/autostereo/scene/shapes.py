"""Procedural meshes, textures and a sample scene. Every call gives the same arrays.

Closed shapes are watertight with their front outside; seams repeat positions bit for bit, so that they stay smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Vector, check_number
from ..errors import InputError
from ..transforms import rotation, scaling, translation
from .appearance import DirectionalLight, Material, PointLight
from .mesh import Mesh
from .scene import Scene

Floats = NDArray[Any]


def icosphere(subdivisions: int = 3, radius: float = 1.0) -> Mesh:
    """Sphere of 20·4^subdivisions almost equal triangles around the origin, with exact normals."""
    direction, faces = _icosahedron(_count("subdivisions", subdivisions, 0, 10))
    return Mesh(direction * _length("radius", radius), faces, normals=direction)


def displaced_sphere(subdivisions: int = 6, radius: float = 1.0, amplitude: float = 0.15) -> Mesh:
    """Icosphere with hills and valleys of ±`amplitude` of its radius and RGB vertex colours.

    With 6 subdivisions (40,962 vertices, 81,920 triangles) this is the benchmark mesh.
    """
    direction, faces = _icosahedron(_count("subdivisions", subdivisions, 0, 10))
    amplitude = check_number("amplitude", amplitude, 0.0, 0.9)
    height, colors = hills(direction)
    points = direction * (_length("radius", radius) * (1.0 + amplitude * height))[:, None]
    return Mesh(points, faces, colors=colors)


def hills(direction: Floats) -> tuple[Floats, Floats]:
    """Height (N,) of the displaced sphere, about −1…1, and its colours (N, 3) in `direction` (N, 3), unit vectors."""
    x, y, z = direction.T
    height = (
        0.56 * np.sin(5.0 * x + 1.0) * np.cos(4.0 * y) * np.cos(3.0 * z)
        + 0.37 * np.sin(9.0 * y + 2.0 * z) * np.cos(7.0 * x)
        + 0.31 * np.cos(13.0 * z - 3.0 * x) * np.sin(11.0 * y + 0.5)
    )
    phase = np.array([0.0, 2.1, 4.2])
    colors = 0.5 + 0.35 * np.cos(2.5 * (x + y - z)[:, None] + phase) + 0.15 * height[:, None]
    return height, np.clip(colors, 0.0, 1.0)


def uv_sphere(columns: int = 64, rows: int = 32, radius: float = 1.0) -> Mesh:
    """Sphere of longitudes and latitudes, y up, with exact normals and a map's texture coordinates."""
    columns, rows = _count("columns", columns, 3, 10_000), _count("rows", rows, 2, 10_000)

    def point(c: Floats, r: Floats) -> Floats:
        longitude = 2 * np.pi / columns * (c % columns)
        latitude = np.pi * (r / rows - 0.5)
        ring = np.where((r == 0) | (r == rows), 0.0, np.cos(latitude))  # the poles are single points
        return np.stack([ring * np.sin(longitude), np.sin(latitude), ring * np.cos(longitude)], axis=-1)

    mesh = _surface(columns, rows, point)
    uv = mesh.uv.copy() if mesh.uv is not None else np.empty((0, 2))
    at_pole = (uv[:, 1] == 0) | (uv[:, 1] == 1)
    uv[at_pole, 0] += 0.5 / columns
    corner = mesh.vertices[mesh.faces]
    real = (corner != np.roll(corner, 1, axis=1)).any(axis=2).all(axis=1)
    return Mesh(mesh.vertices * _length("radius", radius), mesh.faces[real], normals=mesh.vertices, uv=uv)


def plane(size: tuple[float, float] = (2.0, 2.0), cells: tuple[int, int] = (1, 1)) -> Mesh:
    """Rectangle in the x–y plane around the origin, facing +z, of cells[0] × cells[1] squares of two triangles."""
    width, height = _length("size", size[0]), _length("size", size[1])
    columns, rows = _count("cells", cells[0], 1, 10_000), _count("cells", cells[1], 1, 10_000)

    def point(c: Floats, r: Floats) -> Floats:
        return np.stack([width * (c / columns - 0.5), height * (r / rows - 0.5), np.zeros_like(c)], axis=-1)

    mesh = _surface(columns, rows, point)
    return replace(mesh, normals=np.broadcast_to((0.0, 0.0, 1.0), mesh.vertices.shape))


def box(size: Vector = (1.0, 1.0, 1.0)) -> Mesh:
    """Box around the origin with flat sides; each side shows the whole texture."""
    half = np.array([_length("size", s) for s in size]) / 2
    right = np.array([(1, 0, 0), (-1, 0, 0), (0, 0, -1), (0, 0, 1), (1, 0, 0), (1, 0, 0)], dtype=np.float64)
    up = np.array([(0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)], dtype=np.float64)
    front = np.cross(right, up)
    corner = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)
    sides = front[:, None] + corner[None, :, :1] * right[:, None] + corner[None, :, 1:] * up[:, None]
    faces = 4 * np.arange(6)[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])
    return Mesh(
        (sides * half).reshape(-1, 3),
        faces.reshape(-1, 3),
        normals=np.repeat(front, 4, axis=0),
        uv=np.tile((corner + 1) / 2, (6, 1)),
    )


def torus(radius: float = 1.0, tube: float = 0.35, columns: int = 96, rows: int = 32) -> Mesh:
    """Ring around the y axis: `radius` to the centre of the tube, `tube` the radius of the tube."""
    radius, tube = _length("radius", radius), _length("tube", tube)

    def curve(turn: Floats) -> Floats:
        return radius * np.stack([np.sin(turn), np.zeros_like(turn), np.cos(turn)], axis=-1)

    return _tube(curve, tube, columns, rows)


def torus_knot(
    turns: tuple[int, int] = (2, 3), radius: float = 1.0, tube: float = 0.15, columns: int = 384, rows: int = 24
) -> Mesh:
    """Knot on a torus, in the x–y plane: turns[0] times around the axis, turns[1] times through the hole."""
    p, q = _count("turns", turns[0], 1, 50), _count("turns", turns[1], 1, 50)
    radius, tube = _length("radius", radius), _length("tube", tube)

    def curve(turn: Floats) -> Floats:
        ring = radius * (2.0 + np.cos(q * turn)) / 3.0
        return np.stack([ring * np.cos(p * turn), ring * np.sin(p * turn), -radius / 3.0 * np.sin(q * turn)], axis=-1)

    return _tube(curve, tube, columns, rows)


def checker(
    squares: int = 8, pixels: int = 256, light: Vector = (0.9, 0.9, 0.88), dark: Vector = (0.25, 0.3, 0.36)
) -> NDArray[np.uint8]:
    """Chessboard texture (pixels, pixels, 3) uint8 of squares × squares fields."""
    squares, pixels = _count("squares", squares, 1, 4096), _count("pixels", pixels, 1, 16384)
    field = np.arange(pixels) * squares // pixels
    odd = (field[:, None] + field) % 2
    return _quantised(np.where(odd[..., None] == 1, light, dark))


def demo_scene() -> Scene:
    """Objects at several depths over a chequered floor: textures, vertex colours, highlights and two lights.

    All lean towards the viewer, so that cameras which look along −z, as those of `Rig.frame`, see the floor from above.
    """
    floor = replace(
        plane((6.0, 4.5), (8, 6)),
        texture=checker(8, 512, (0.82, 0.80, 0.76), (0.30, 0.34, 0.42)),
        transform=translation(0.0, -1.05, -0.75) @ rotation((1, 0, 0), -90),
    )
    floor = replace(floor, uv=floor.uv * np.array((1.25, 0.9375)))
    rock = replace(
        displaced_sphere(5, 0.95),
        material=Material(specular=0.25, shininess=24.0),
        transform=translation(-0.1, 0.05, -0.35) @ rotation((0, 1, 0), 20),
    )
    knot = replace(
        _painted(torus_knot((2, 3), 0.85, 0.17), (0.95, 0.66, 0.20)),
        material=Material(specular=0.7, shininess=60.0),
        transform=translation(1.95, 0.15, -1.5) @ rotation((0, 1, 0), -25),
    )
    globe = replace(
        uv_sphere(96, 48, 0.5),
        texture=_bands(),
        material=Material(specular=0.45, shininess=80.0),
        transform=translation(-1.35, -0.55, 0.95) @ rotation((0, 0, 1), 18),
    )
    crate = replace(
        box((0.75, 0.75, 0.75)),
        texture=checker(4, 256, (0.86, 0.36, 0.28), (0.98, 0.90, 0.78)),
        transform=translation(1.25, -0.675, 0.75) @ rotation((0, 1, 0), 32),
    )
    ring = replace(
        _painted(torus(0.75, 0.22), (0.25, 0.62, 0.68)),
        material=Material(specular=0.5, shininess=40.0),
        transform=translation(-2.1, 0.25, -1.9) @ rotation((0.3, 0, 1), 60) @ scaling(1.1),
    )
    sun = DirectionalLight((-0.45, -1.0, -0.75), (0.85, 0.83, 0.80))
    lamp = PointLight((-3.0, 2.5, 3.0), (0.30, 0.33, 0.40))
    lean = rotation((1, 0, 0), 17)
    objects = (floor, rock, knot, globe, crate, ring)
    leaning = tuple(replace(mesh, transform=lean @ mesh.transform) for mesh in objects)
    return Scene(leaning, (sun, lamp), background=(0.10, 0.13, 0.20))


def _bands() -> NDArray[np.uint8]:
    """Texture (256, 512, 3) of wavy bands that closes at its left and right edge."""
    v, u = np.mgrid[0:256, 0:512] / (256.0, 512.0)[0]
    angle = np.pi * u  # u runs over 0…2 here
    wave = np.cos(14.0 * v + 1.6 * np.sin(3 * angle) * np.sin(np.pi * v))[..., None]
    return _quantised(0.5 + 0.5 * wave * np.array((0.5, 0.75, 0.9)) + (1 - wave) * np.array((0.2, 0.05, 0.0)))


def _quantised(rgb: Floats) -> NDArray[np.uint8]:
    return np.floor(255.0 * np.clip(rgb, 0.0, 1.0) + 0.5).astype(np.uint8)


def _painted(mesh: Mesh, rgb: Vector) -> Mesh:
    return replace(mesh, colors=np.broadcast_to(np.array(rgb), mesh.vertices.shape))


def _count(name: str, value: int, low: int, high: int) -> int:
    """Return a whole number within [low, high], or raise an error that names the field."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise InputError(f"{name}: expected a whole number in {low}…{high}, got {value!r}")
    return int(value)


def _length(name: str, value: float) -> float:
    return check_number(name, value, 1e-12, 1e12)


def _icosahedron(subdivisions: int) -> tuple[Floats, NDArray[np.int64]]:
    """Unit vectors (10·4^n + 2, 3) and faces (20·4^n, 3) of an icosahedron whose triangles are cut in four n times."""
    g = (1 + 5**0.5) / 2
    points = np.array(
        [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
         (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    )  # fmt: skip
    faces = np.array(
        [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
         (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
         (8, 6, 7), (9, 8, 1)]
    )  # fmt: skip
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for _ in range(subdivisions):
        ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        key, side = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_inverse=True)
        middle = points[key // len(points)] + points[key % len(points)]
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        (a, b, c), (ab, bc, ca) = faces.T, len(points) + side.reshape(-1, 3).T
        faces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
        points = np.concatenate([points, middle])
    return points, faces


def _surface(columns: int, rows: int, point: Callable[[Floats, Floats], Floats]) -> Mesh:
    """Mesh over a grid of (columns + 1) × (rows + 1) points; its front is where column × row direction points."""
    r, c = (a.ravel() for a in np.mgrid[0 : rows + 1, 0 : columns + 1].astype(np.float64))
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    above = first + columns + 1
    faces = np.stack([first, first + 1, above + 1, first, above + 1, above], axis=1).reshape(-1, 3)
    return Mesh(point(c, r), faces, uv=np.stack([c / columns, r / rows], axis=1))


def _tube(curve: Callable[[Floats], Floats], tube: float, columns: int, rows: int) -> Mesh:
    """Tube around a closed curve over 0…2π, which keeps clear of the origin; exact normals."""
    columns, rows = _count("columns", columns, 3, 100_000), _count("rows", rows, 3, 10_000)
    turn = 2 * np.pi / columns * np.arange(columns)
    step = 1e-4
    centre = curve(turn)
    tangent = curve(turn + step) - curve(turn - step)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    outward = centre - np.einsum("cx,cx->c", centre, tangent)[:, None] * tangent
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    side = np.cross(outward, tangent)

    def normal(c: Floats, r: Floats) -> Floats:
        along, angle = (c % columns).astype(np.intp), 2 * np.pi / rows * (r % rows)
        return np.cos(angle)[..., None] * outward[along] + np.sin(angle)[..., None] * side[along]

    mesh = _surface(columns, rows, lambda c, r: centre[(c % columns).astype(np.intp)] + tube * normal(c, r))
    r, c = (a.ravel() for a in np.mgrid[0 : rows + 1, 0 : columns + 1].astype(np.float64))
    return replace(mesh, normals=normal(c, r))
