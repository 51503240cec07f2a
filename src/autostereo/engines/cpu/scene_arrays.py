"""A scene as the kernels read it: all meshes in one set of arrays, in world space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import PointLight
from ...scene.mesh import Mesh
from ...scene.scene import Scene
from ...transforms import apply, apply_normals
from ..engine import Camera
from ..reference.texture import box_weights


class SceneArrays(NamedTuple):
    """Meshes one behind the other.

    positions (N, 3) float64, normals and colors (N, 3) float32, uv (N, 2) float64, or (0, 0) without textures,
    vertex_material (N,) int32, faces (F, 3) int32, face_material (F,) int32, materials (M, 8) float32: ambient,
    diffuse, specular, shininess, two-sided, texture or −1, plain (no texture, no highlight), 0; texels uint32 (RGBA);
    texture_levels (T, L, 3) int64: first texel, width, height; level_count (T,) int64.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float32]
    colors: NDArray[np.float32]
    uv: NDArray[np.float64]
    vertex_material: NDArray[np.int32]
    faces: NDArray[np.int32]
    face_material: NDArray[np.int32]
    materials: NDArray[np.float32]
    texels: NDArray[np.uint32]
    texture_levels: NDArray[np.int64]
    level_count: NDArray[np.int64]


def _pyramid(image: NDArray[np.uint8]) -> list[NDArray[np.uint32]]:
    """Mip levels of an image (h, w, 3) as RGBA words; means are taken in float and each level is rounded once."""
    level = image.astype(np.float32)
    levels = []
    while True:
        rgba = np.full((*level.shape[:2], 4), 255, dtype=np.uint8)
        rgba[..., :3] = np.floor(level + 0.5)
        levels.append(rgba.view(np.uint32)[..., 0])
        if level.shape[:2] == (1, 1):
            return levels
        level = _halve(_halve(level).swapaxes(0, 1)).swapaxes(0, 1)


def _halve(level: NDArray[np.float32]) -> NDArray[np.float32]:
    """Box filter along the first axis to half the size; odd sizes share texels (reference.texture.box_weights)."""
    size = len(level)
    if size == 1:
        return level
    if size % 2 == 0:
        return (level[0::2] + level[1::2]) * np.float32(0.5)
    return np.tensordot(box_weights(size).astype(np.float32), level, 1)


def _pack_textures(images: list[NDArray[np.uint8]]) -> tuple[NDArray, NDArray, NDArray]:
    pyramids = [_pyramid(image) for image in images]
    depth = max((len(p) for p in pyramids), default=1)
    table = np.zeros((max(len(pyramids), 1), depth, 3), dtype=np.int64)
    count = np.ones(max(len(pyramids), 1), dtype=np.int64)
    first = 0
    for t, pyramid in enumerate(pyramids):
        count[t] = len(pyramid)
        for k, level in enumerate(pyramid):
            table[t, k] = first, level.shape[1], level.shape[0]
            first += level.size
    flat = [level.ravel() for pyramid in pyramids for level in pyramid]
    return np.concatenate(flat) if flat else np.zeros(1, np.uint32), table, count


def scene_arrays(meshes: Sequence[Mesh]) -> SceneArrays:
    """Gather meshes; mirroring transforms flip the winding, equal textures are stored once."""
    materials = np.zeros((len(meshes), 8), dtype=np.float32)
    images: dict[int, tuple[int, NDArray[np.uint8]]] = {}
    parts: dict[str, list[NDArray]] = {name: [] for name in ("p", "n", "c", "t", "vm", "f", "fm")}
    textured = any(mesh.texture is not None for mesh in meshes)
    first = 0
    for m, mesh in enumerate(meshes):
        assert mesh.transform is not None and mesh.material is not None
        material, count = mesh.material, len(mesh.vertices)
        texture = -1
        if mesh.texture is not None:
            texture = images.setdefault(id(mesh.texture), (len(images), mesh.texture))[0]
        materials[m, :7] = (
            material.ambient,
            material.diffuse,
            material.specular,
            material.shininess,
            mesh.two_sided,
            texture,
            texture < 0 and material.specular == 0,
        )
        parts["p"].append(apply(mesh.transform, mesh.vertices))
        parts["n"].append(apply_normals(mesh.transform, mesh.shading_normals).astype(np.float32))
        parts["c"].append(np.ones((count, 3), np.float32) if mesh.colors is None else mesh.colors)
        if textured:
            parts["t"].append(np.zeros((count, 2)) if mesh.uv is None else mesh.uv)
        parts["vm"].append(np.full(count, m, np.int32))
        mirrored = np.linalg.det(mesh.transform[:3, :3]) < 0
        parts["f"].append((mesh.faces[:, [0, 2, 1]] if mirrored else mesh.faces) + np.int32(first))
        parts["fm"].append(np.full(len(mesh.faces), m, np.int32))
        first += count
    join: dict[str, Any] = {
        name: np.concatenate(arrays) if arrays else np.zeros((0, 0)) for name, arrays in parts.items()
    }
    packed = _pack_textures([image for _, image in images.values()])
    return SceneArrays(
        np.ascontiguousarray(join["p"]),
        np.ascontiguousarray(join["n"]),
        np.ascontiguousarray(join["c"]),
        join["t"],
        join["vm"],
        np.ascontiguousarray(join["f"], dtype=np.int32),
        join["fm"],
        materials,
        *packed,
    )


def light_array(scene: Scene, camera: Camera) -> NDArray[np.float32]:
    """Lights in the centre camera's eye space, (L, 8): 0 and the way to a directional one, or 1 and a position; RGB."""
    rotation, shift = camera.eye_from_world[:3, :3], camera.eye_from_world[:3, 3]
    if scene.lights is None:
        return np.array([[0, 0, 0, -1, 1, 1, 1, 0]], dtype=np.float32)
    lights = np.zeros((len(scene.lights), 8), dtype=np.float32)
    for k, light in enumerate(scene.lights):
        if isinstance(light, PointLight):
            lights[k, 0] = 1
            lights[k, 1:4] = rotation @ np.array(light.position) + shift
        else:
            way = -(rotation @ np.array(light.direction))
            lights[k, 1:4] = way / np.linalg.norm(way)
        lights[k, 4:7] = light.color
    return lights


def background_word(scene: Scene) -> np.int32:
    """The background as RGBA bytes, transparent."""
    rgba = np.zeros(4, dtype=np.uint8)
    rgba[:3] = np.floor(np.array(scene.background) * 255.0 + 0.5)
    return rgba.view(np.int32)[0]
