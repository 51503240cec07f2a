"""Scenes on which engines are compared, and where on a picture they have to agree."""

from __future__ import annotations

import importlib.util
from functools import cache, lru_cache

import numpy as np
import pytest

import autostereo as aus
from autostereo.engines.engine import ENGINES, Camera, Draw, get_engine
from autostereo.engines.reference.engine import ReferenceEngine, panel_samples, view_samples, visible_hits
from autostereo.engines.reference.mesh import Samples, Surface, trace
from gl_device import need_device

SIZE = (40, 30)
RIG = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=1.2, views=5, near=0.2)
OTHER_ENGINES = [name for name in ENGINES if name != "reference"]


def engines_for(*kinds: type) -> list[str]:
    """The engines that draw all these kinds of objects, beside the reference."""
    from autostereo.engines.gl.engine import METHODS

    return [name for name in OTHER_ENGINES if name != "gl" or set(kinds) <= set(METHODS)]


def need(engine: str) -> str:
    """The engine's name; skips, saying why, where it or the public door is not there."""
    if engine == "gl":
        need_device()
    if importlib.util.find_spec("autostereo.render") is None:
        pytest.skip("cannot be compared: there is no autostereo.render yet")
    try:
        get_engine(engine)
    except ImportError as error:
        pytest.skip(f"cannot be compared: {error}")
    return engine


def camera_of(rig: aus.Rig, size: tuple[int, int]) -> Camera:
    """Camera of a rig at a picture size (DESIGN section 1)."""
    width, height = size
    tangent = np.tan(np.radians(rig.fov_y) / 2)
    fx = width / 2 / (tangent * (rig.aspect or width / height))
    focal = height / 2 / tangent
    return Camera(rig.eye_from_world, fx, focal, width, height, rig.focal, rig.near_depth, rig.offset_y)


# --- scenes ------------------------------------------------------------------------------------------


def sphere(subdivisions: int = 2, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of an octahedron, subdivided and blown up."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    triangles = np.array(corners, float)[
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    ]
    for _ in range(subdivisions):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    vertices, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return radius * vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces.reshape(-1, 3)


@cache
def smooth() -> aus.Scene:
    """A glossy sphere in front of the focal plane's middle, under a directional and a point light."""
    vertices, faces = sphere()
    colors = np.random.default_rng(0).uniform(0.3, 1, (len(vertices), 3))
    ball = aus.Mesh(vertices, faces, colors=colors, material=aus.Material(0.2, 0.6, 0.5, 20))
    lights = [aus.DirectionalLight((0.5, -1, -1), (0.8, 0.7, 0.6)), aus.PointLight((1.5, 0.5, 2.5), (0.3, 0.4, 0.5))]
    return aus.Scene(ball, lights, (0.1, 0.2, 0.3))


@cache
def soup(seed: int = 1, count: int = 9) -> aus.Scene:
    """Large interpenetrating triangles over a wide range of depths, some through the near plane, two-sided."""
    rng = np.random.default_rng(seed)
    depth = np.exp(rng.uniform(np.log(0.1), np.log(30), (count, 3)))
    spread = rng.uniform(-0.6, 0.6, (count, 3, 2)) * np.maximum(depth, 2)[..., None]
    vertices = np.concatenate([spread, 4 - depth[..., None]], axis=2).reshape(-1, 3)
    colors = rng.uniform(0, 1, (3 * count, 3))
    material = aus.Material(0.5, 0.5, 0.2, 8, two_sided=True)
    return aus.Scene(aus.Mesh(vertices, np.arange(3 * count).reshape(-1, 3), colors=colors, material=material))


@cache
def floor(texture: tuple[int, int] = (32, 16), repeats: float = 5) -> aus.Scene:
    """A textured floor from behind the camera to the far distance: every mip level, and the near plane."""
    picture = np.random.default_rng(2).integers(0, 256, (*texture, 3)).astype(np.uint8)
    vertices = np.array([(-9, -0.8, 9), (9, -0.8, 9), (9, -0.8, -20), (-9, -0.8, -20)])
    uv = repeats * np.array([(0, 0), (1, 0), (1, 1.5), (0, 1.5)])
    mesh = aus.Mesh(vertices, [[0, 1, 2], [0, 2, 3]], uv=uv, texture=picture, material=aus.Material(0.3, 0.7, 0.1))
    return aus.Scene(mesh, aus.PointLight((0, 2, 1)), (0.5, 0.5, 0.5))


@cache
def mirrored() -> aus.Scene:
    """One-sided surfaces, one of them mirrored by its transform, and a glimpse of what they hide."""
    vertices, faces = sphere(1)
    stretch = np.diag([-1.2, 0.6, 0.8, 1.0])
    stretch[:3, 3] = 0.3, -0.1, 0.5
    one_sided = aus.Material(0.3, 0.7, two_sided=False)
    shell = aus.Mesh(vertices, faces, colors=np.abs(vertices), material=one_sided, transform=stretch)
    outside_in = aus.Mesh(1.6 * vertices, faces[:, ::-1], colors=1 - np.abs(vertices), material=one_sided)
    return aus.Scene([shell, outside_in], aus.DirectionalLight((1, -1, -2)))


SCENES = {  # name: (scene, whether colour jumps only between objects, or between any triangles)
    "smooth": (smooth(), "object"),
    "soup": (soup(), "triangle"),
    "floor": (floor(), "object"),
    "mirrored": (mirrored(), "object"),
}


def random_scene(draw_integers, texture: bool) -> aus.Scene:
    """A scene from whole numbers: few vertices on a coarse lattice, many faces.

    So that edges are shared, faces repeat, have no area, fall on pixel centres, cut each other and the near plane.
    `draw_integers(low, high, count)` returns an array.
    """
    n = int(draw_integers(3, 9, 1)[0])
    depth = np.array([0.0, 0.1, 0.2, 0.5, 1, 2, 3, 4, 4, 5, 8, 20, 100])[draw_integers(0, 12, n)]
    depth[0] = max(depth[0], 4.0)
    x, y = draw_integers(-12, 12, n) / 12, draw_integers(-9, 9, n) / 12
    vertices = np.stack([x * np.maximum(depth, 1), y * np.maximum(depth, 1), 4 - depth], axis=1)
    faces = draw_integers(0, n - 1, 3 * int(draw_integers(1, 12, 1)[0])).reshape(-1, 3)
    faces[0, 0] = 0  # a scene wholly behind the cameras is refused
    fields = {"colors": draw_integers(0, 255, 3 * n).reshape(n, 3).astype(np.uint8)}
    if texture:
        fields["uv"] = draw_integers(-16, 16, 2 * n).reshape(n, 2) / 4
        fields["texture"] = draw_integers(0, 255, 8 * 4 * 3).reshape(8, 4, 3).astype(np.uint8)
    two_sided = (None, True, False)[draw_integers(0, 2, 1)[0]]
    return aus.Scene(aus.Mesh(vertices, faces, material=aus.Material(0.3, 0.6, 0.3, 6, two_sided), **fields))


# --- where engines have to agree ---------------------------------------------------------------------


def labels(surfaces: list[Surface], camera: Camera, samples: Samples, by: str) -> np.ndarray:
    """What each sample sees: number of the triangle or of the object, −1 for nothing."""
    hits = visible_hits(surfaces, camera, samples)
    label = hits.triangle
    if by == "object":
        label = np.searchsorted(np.cumsum([len(s.faces) for s in surfaces]), label, side="right")
    result = np.full(samples.x.shape, -1)
    result[hits.where] = label
    return result


def contested(surfaces: list[Surface], camera: Camera, samples: Samples) -> np.ndarray:
    """Samples whose two nearest triangles are at about the same depth: rounding decides which one is seen."""
    corners = np.concatenate([s.vertices[s.faces] for s in surfaces])
    layers = np.full((len(corners) + 1, *samples.x.shape), np.inf)
    for layer, corner in zip(layers, corners, strict=False):
        hits = trace(corner[None], np.array([0]), camera, samples)
        layer[hits.where] = hits.depth
    nearest, second = np.partition(layers, 1, axis=0)[:2]
    return second < nearest * (1 + 1e-3)


def interior(scene: aus.Scene, camera: Camera, samples: Samples, by: str) -> np.ndarray:
    """Pixels (H, W) or sub-pixels (H, W, 3) that see one label all over the 3×3 pixels around them.

    Samples (…, n) are moved by −1, 0 and 1 pixels both ways, and by ½ to all corners; the rest are silhouette pixels,
    where engines of different precision may differ. With `by="triangle"` contested samples do not count either.
    """
    surfaces = [surface.in_eye_space(camera) for surface in ReferenceEngine().prepare(scene).surfaces]
    here = labels(surfaces, camera, samples, by)
    same = here == here[..., :1]
    ring = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]
    for dx, dy in ring + [(0.5 * dx, 0.5 * dy) for dx, dy in ring if dx and dy]:
        moved = Samples(samples.x + dx, samples.y + dy, samples.v)
        same &= labels(surfaces, camera, moved, by) == here
    if by == "triangle":
        same &= ~contested(surfaces, camera, samples)
    return same.all(axis=-1)


@lru_cache(8)
def interior_of_views(scene: aus.Scene, rig: aus.Rig, size: tuple[int, int], samples: int, by: str) -> np.ndarray:
    """`interior` (V, H, W) of a rig's views."""
    camera = camera_of(rig, size)
    return np.stack([interior(scene, camera, view_samples(camera, v, samples), by) for v in rig.camera_offsets])


def interior_of_panel(
    scene: aus.Scene, rig: aus.Rig, display: aus.Display, options: aus.Options, by: str
) -> np.ndarray:
    """`interior` (H, W, 3) of a panel."""
    camera = camera_of(rig, (display.width, display.height))
    draw = Draw(camera, rig.camera_offsets, (0, 0), display.viewmap, display.flip_x, display.flip_y, options)
    inside = interior(scene, camera, panel_samples(draw), by)
    return inside[:: -1 if display.flip_y else 1, :: -1 if display.flip_x else 1]


def levels_of(engine: str, textured: bool) -> int:
    """By how many of 255 levels an engine may differ inside: OpenGL promises little about how it filters textures."""
    return 3 if engine == "gl" and textured else 1


def assert_agree(found: np.ndarray, expected: np.ndarray, inside: np.ndarray, levels: int = 1) -> None:
    """Colours within `levels` inside, and outside on all but 2 % of the samples; prints both shares.

    More than one level is for 1 in 100 samples at most.
    """
    difference = np.abs(found.astype(int) - expected)
    difference = difference.reshape(*inside.shape, -1).max(axis=-1)
    outside = (difference[~inside] > 1).sum() / inside.size
    print(f"interior {inside.mean():.1%}, of all samples {outside:.2%} differ on silhouettes")
    assert inside.mean() > 0.25, "too little is compared"
    assert (inside & (difference > 1)).mean() <= 0.01
    worst = np.argwhere(inside & (difference > levels))
    assert len(worst) == 0, f"{len(worst)} interior samples differ by up to {difference[inside].max()}: {worst[:3]}"
    assert outside <= 0.02
