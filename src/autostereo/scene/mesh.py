"""Triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import check_reach, real_array
from ..errors import InputError
from ..transforms import apply, as_transform, check_world
from .appearance import Material, check_color_values, check_image


def _floats(name: str, value: ArrayLike, columns: tuple[int, ...], count: int | None = None) -> NDArray[np.float64]:
    """Return a finite float64 array of shape (count, one of columns), or raise an error that names the field."""
    a = np.array(real_array(name, value), dtype=np.float64, order="C")
    wanted = " or ".join(f"({'N' if count is None else count}, {c})" for c in columns)
    if a.ndim != 2 or a.shape[1] not in columns or (count is not None and a.shape[0] != count):
        raise InputError(f"{name}: expected shape {wanted}, got {a.shape}")
    bad = ~np.isfinite(a).all(axis=1)
    if bad.any():
        raise InputError(f"{name}: expected finite numbers, found NaN or infinity in {bad.sum()} of {len(a)} rows")
    check_reach(name, a)
    return a


def _colors(value: ArrayLike, count: int) -> NDArray[np.float32]:
    """Return colours as (N, 3) float32 in 0…1; integers count as 0…255, alpha is ignored."""
    given = real_array("colors", value)
    a = _floats("colors", given, (3, 4), count)[:, :3]
    check_color_values("colors", given[:, :3])
    if given.dtype.kind in "iu":
        a = a / 255.0
    return np.ascontiguousarray(np.clip(a, 0.0, 1.0), dtype=np.float32)


def _faces(value: ArrayLike, count: int) -> NDArray[np.int32]:
    raw = real_array("faces", value, "an array of integers")
    if raw.ndim != 2 or raw.shape[1] != 3:
        raise InputError(f"faces: expected shape (F, 3), got {raw.shape}")
    if len(raw) == 0:
        raise InputError("faces: expected at least one triangle, got none")
    if not np.issubdtype(raw.dtype, np.integer):
        raise InputError(f"faces: expected integers, got {raw.dtype}")
    if raw.min() < 0 or raw.max() >= count:
        raise InputError(f"faces: expected indices 0…{count - 1}, found {raw.min()}…{raw.max()}")
    return np.array(raw, dtype=np.int32, order="C")


def merge_positions(points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Group points (N, 3) of equal position, −0 and 0 being equal.

    Returns
    -------
    first : ndarray of shape (M,)
        Index of one point of each group.
    group : ndarray of shape (N,)
        Group of every point.
    """
    points = points + 0.0  # −0 becomes 0
    bits = points.view(np.uint64)
    key = np.zeros(len(points), dtype=np.uint64)
    for column in bits.T:  # the mixing steps of SplitMix64 (Steele, Lea and Flood 2014)
        key += column
        key ^= key >> np.uint64(30)
        key *= np.uint64(0xBF58476D1CE4E5B9)
        key ^= key >> np.uint64(27)
        key *= np.uint64(0x94D049BB133111EB)
        key ^= key >> np.uint64(31)
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    group = group.reshape(-1)
    if not np.array_equal(points[first[group]], points):  # two positions share a key
        _, first, group = np.unique(points, axis=0, return_index=True, return_inverse=True)
        group = group.reshape(-1)
    return first, group


def _unit_sums(index: NDArray[np.integer], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum vectors (C, 3) by `index` (C,) and scale the sums (max + 1, 3) to unit length; rounding noise becomes 0."""
    total = np.stack([np.bincount(index, weights=vectors[:, axis]) for axis in range(3)], axis=1)
    scale = np.bincount(index, weights=np.abs(vectors).sum(axis=1))
    length = np.linalg.norm(total, axis=1)
    real = length > 1e-9 * scale
    return np.where(real[:, None], total / np.where(real, length, 1.0)[:, None], 0.0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with shared vertices; counter-clockwise seen from the front.

    Parameters
    ----------
    vertices : array_like of shape (N, 3)
        Positions in object space, finite.
    faces : array_like of shape (F, 3), int
        Vertex indices; duplicate and zero-area faces are legal.
    normals : array_like of shape (N, 3), optional
        Missing normals are angle-weighted over vertices merged by position.
    colors : array_like of shape (N, 3 or 4), optional
        Display (sRGB) values: floats 0…1, or integers of any type 0…255, so that an integer 1 is nearly black and
        white is 255 or 1.0; alpha is ignored. Default white.
    uv : array_like of shape (N, 2), optional
        Texture coordinates, (0, 0) the bottom left of the texture; they repeat.
    texture : image of shape (h, w, 3 or 4), optional
        Values as of `colors`, or a PIL image; needs `uv`. Grey (h, w) is spread, alpha dropped. A uint8 RGB array is
        not copied: objects can share it.
    material : Material, optional
    transform : array_like of shape (4, 4), optional
        world_from_object.

    Raises
    ------
    InputError
        A field does not have the shape, type or range above; the message names it.
    """

    vertices: NDArray  # float64 once constructed; so are normals, uv and transform
    faces: NDArray  # int32
    normals: NDArray | None = None
    colors: NDArray | None = None  # (N, 3) float32, 0…1
    uv: NDArray | None = None
    texture: NDArray | None = None  # (h, w, 3) uint8, rows from the top
    material: Material = None  # type: ignore[assignment]  # None becomes Material()
    transform: NDArray = None  # type: ignore[assignment]  # None becomes the identity
    # set by readers where `normals` are those of the surface that this is a part of; `replace` forgets it
    normals_computed: bool = field(default=False, init=False, repr=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "vertices", _floats("vertices", self.vertices, (3,)))
        count = len(self.vertices)
        put(self, "faces", _faces(self.faces, count))
        if self.normals is not None:
            put(self, "normals", _floats("normals", self.normals, (3,), count))
        if self.colors is not None:
            put(self, "colors", _colors(self.colors, count))
        if self.uv is not None:
            put(self, "uv", _floats("uv", self.uv, (2,), count))
        if self.texture is not None:
            if self.uv is None:
                raise InputError("texture: needs uv (N, 2) to be given too")
            put(self, "texture", check_image("texture", self.texture))
        if self.material is None:
            put(self, "material", Material())
        elif not isinstance(self.material, Material):
            raise InputError(f"material: expected a Material, got {type(self.material).__name__}")
        put(self, "transform", as_transform(self.transform))
        check_world("vertices", self.transform, self.vertices)

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """Axis-aligned bounds in world space of the vertices that faces use, (2, 3): minimum and maximum."""
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.faces] = True
        points = apply(self.transform, self.vertices[used])
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @cached_property
    def _merged_faces(self) -> NDArray[np.int64]:
        """Faces (F, 3) over vertices merged by equal position."""
        return merge_positions(self.vertices)[1][self.faces]

    @cached_property
    def shading_normals(self) -> NDArray[np.float64]:
        """Unit normals (N, 3): those given, else angle-weighted over merged vertices (Thürmer and Wüthrich 1998).

        A given normal of zero length is computed too. Where the faces around a position cancel (a leaf with a
        front and a back), only those that share the vertex itself count.
        """
        if self.normals is not None:
            length = np.linalg.norm(self.normals, axis=1, keepdims=True)
            if (length > 0).all():
                return self.normals / length
            return np.where(length > 0, self.normals / np.where(length > 0, length, 1.0), self._smooth_normals)
        return self._smooth_normals

    @cached_property
    def _smooth_normals(self) -> NDArray[np.float64]:
        corner = self.vertices[self.faces]  # (F, 3 corners, 3)
        edge = np.roll(corner, -1, axis=1) - corner
        edge /= np.abs(edge).max(initial=0.0) or 1.0
        incoming = -np.roll(edge, 1, axis=1)
        normal = np.cross(edge[:, 0], edge[:, 1])
        double_area = np.linalg.norm(normal, axis=1)
        angle = np.arctan2(double_area[:, None], np.einsum("fkc,fkc->fk", edge, incoming))
        normal /= np.where(double_area > 0, double_area, 1.0)[:, None]
        weighted = (angle[:, :, None] * normal[:, None, :]).reshape(-1, 3)
        used = self.faces.ravel()
        result = np.zeros_like(self.vertices)
        result[used] = _unit_sums(self._merged_faces.ravel(), weighted)[self._merged_faces.ravel()]
        lost = ~result[used].any(axis=1)
        if lost.any():
            result[used[lost]] = _unit_sums(used, weighted)[used[lost]]
        return result

    @cached_property
    def is_closed(self) -> bool:
        """True when the surface is watertight, consistently wound and its front is the outside."""
        merged = self._merged_faces
        merged = merged[(merged != np.roll(merged, 1, axis=1)).all(axis=1)]
        if len(merged) == 0:
            return False
        start, end = merged.ravel(), np.roll(merged, -1, axis=1).ravel()
        count = int(merged.max()) + 1
        forward, backward = np.sort(start * count + end), np.sort(end * count + start)
        if not np.array_equal(forward, backward) or (forward[1:] == forward[:-1]).any():
            return False
        corner = self.vertices[self.faces] - self.vertices[self.faces[0, 0]]
        return bool(np.einsum("fc,fc->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) > 0)

    @property
    def two_sided(self) -> bool:
        """Whether back sides are drawn: as the material says, else unless the surface is closed."""
        chosen = self.material.two_sided
        return not self.is_closed if chosen is None else chosen
