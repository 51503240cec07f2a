"""Meshes on the device: vertices, indices and textures, sent once per scene.

Meshes one after the other that share material, texture and sides are one `Part`, drawn by one call; the order of the
scene is kept, as of equally near triangles the earlier is seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Material
from ...scene.mesh import Mesh
from ...transforms import apply, apply_normals
from ..constants import LEVELS
from ..reference.texture import mip_levels
from .context import Device


@dataclass(frozen=True, eq=False)
class Part:
    """What one call draws.

    Attributes
    ----------
    material : Material
    two_sided : bool
    texture : moderngl.Texture, optional
    vertices, indices : moderngl.Buffer
        Position, normal, colour and, with a texture, uv per vertex, float32; three indices per triangle, uint32.
    triangles : int
    corners : int
        Vertices in `vertices`.
    """

    material: Material
    two_sided: bool
    texture: Any
    vertices: Any
    indices: Any
    triangles: int
    corners: int

    @property
    def layout(self) -> tuple[str, list[str]]:
        """Format and names of the vertex attributes."""
        names = ["position", "normal", "color"]
        return ("3f4 3f4 3f4 2f4", [*names, "uv"]) if self.texture is not None else ("3f4 3f4 3f4", names)


def upload_meshes(device: Device, meshes: Sequence[Mesh], middle: NDArray[np.float64]) -> list[Part]:
    """Send meshes; positions are relative to `middle` (3,)."""
    textures: dict[int, Any] = {}
    parts = []
    for key, group in groupby(meshes, key=lambda m: (m.material, m.two_sided, id(m.texture))):
        members = list(group)
        image = members[0].texture
        if image is not None and id(image) not in textures:
            textures[id(image)] = upload_texture(device, image)
        vertices, indices, first = [], [], 0
        for mesh in members:
            own, faces = _arrays(mesh, middle)
            vertices.append(own)
            indices.append(faces + first)
            first += len(own)
        joined = np.concatenate(indices).astype(np.uint32)
        parts.append(
            Part(
                key[0], key[1], textures.get(id(image)), device.upload(np.concatenate(vertices)),
                device.upload(joined), len(joined), first,
            )
        )
    return parts


def _arrays(mesh: Mesh, middle: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Vertex attributes (n, 9 or 11) in world space and faces (F, 3); mirroring transforms flip the winding."""
    assert mesh.transform is not None
    columns = [
        apply(mesh.transform, mesh.vertices) - middle,
        apply_normals(mesh.transform, mesh.shading_normals),
        np.ones_like(mesh.vertices) if mesh.colors is None else mesh.colors,
    ]
    faces = mesh.faces.astype(np.int64)
    if mesh.texture is not None:
        assert mesh.uv is not None
        vertex, uv, faces = split_by_repeat(mesh.uv, faces)
        columns = [column[vertex] for column in columns] + [uv]
    if np.linalg.det(mesh.transform[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return np.hstack(columns).astype(np.float32), faces


def split_by_repeat(
    uv: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Take the whole part off texture coordinates triangle by triangle, as float32 has no digits to spare.

    A vertex is doubled where triangles with different whole parts meet.

    Returns
    -------
    vertex : ndarray of shape (n,)
        Which vertex each corner was.
    uv : ndarray of shape (n, 2)
    faces : ndarray of shape (F, 3)
    """
    whole = np.floor(uv[faces].min(axis=1))  # (F, 2)
    corner = np.column_stack([faces.ravel(), np.repeat(whole, 3, axis=0)])
    unique, index = np.unique(corner, axis=0, return_inverse=True)
    vertex = unique[:, 0].astype(np.int64)
    return vertex, uv[vertex] - unique[:, 1:], index.reshape(-1, 3)


def upload_texture(device: Device, image: NDArray[np.uint8]) -> Any:
    """A texture (h, w, 3) with its mip levels, which are the reference's, each rounded once; row 0 at the bottom."""
    device.check_texture((image.shape[1], image.shape[0]), "a texture")
    texture = device.ctx.texture((image.shape[1], image.shape[0]), 4)
    texture.build_mipmaps()  # makes room for the levels
    for k, level in enumerate(mip_levels(image)):
        rgba = np.full((*level.shape[:2], 4), 255, np.uint8)
        rgba[..., :3] = np.floor(LEVELS * level[::-1] + 0.5)
        texture.write(rgba.tobytes(), level=k)
        device.uploaded += rgba.nbytes
    texture.filter = (device.ctx.LINEAR_MIPMAP_NEAREST, device.ctx.LINEAR)
    return texture
