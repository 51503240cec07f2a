"""One picture of a scene that may mix everything: what each sample sees, in which order.

Opaque things come first: meshes, isosurfaces and points, each in front of what was nearest so far (of equally near
ones the earlier stays). What is nearest then ends the rays through composite volumes, whose light is put over it.
Maximum-intensity volumes have no depth order of their own: up to the nearest opaque thing, they are put over the rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Light
from ..engine import Camera
from ..options import Options
from . import volume
from .mesh import Hits, Samples, Surface, trace
from .points import Surfels, splat
from .rays import Rays
from .shading import lights_in_eye_space, shade
from .volume import Field

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PreparedScene:
    """A scene in world space, ready to be traced; objects of one kind keep their order."""

    surfaces: list[Surface]
    clouds: list[Surfels]
    fields: list[Field]
    lights: tuple[Light, ...] | None
    background: Array


class Picture:
    """Colours and depths of samples of any shape (…), flattened to M in C order.

    Attributes
    ----------
    color : ndarray of shape (M, 3), float64
        Light that is seen; that of opaque things is clamped to 0…1.
    through : ndarray of shape (M,), float64
        Share of the background that is seen.
    opaque, half : ndarray of shape (M,), float64
        Depths of the nearest opaque thing, and at which volumes first have an opacity of ½; inf where there is none.
    """

    def __init__(self, prepared: PreparedScene, samples: Samples, camera: Camera, options: Options) -> None:
        self.samples, self.camera, self.options = samples, camera, options
        self.lights = lights_in_eye_space(prepared.lights, camera)
        self.rays = Rays.through(camera, samples, options)
        self.color = np.zeros((len(self.rays), 3))
        self.through = np.ones(len(self.rays))
        self.opaque, self.half = np.full((2, len(self.rays)), np.inf)

    @property
    def depth(self) -> Array:
        """Depth (M,) of what is nearest to be seen."""
        return np.minimum(self.opaque, self.half)

    def put(self, where: NDArray[np.integer], depth: Array, color: Array) -> None:
        """Show opaque things at those of the samples `where` (K,) at which they are the nearest so far."""
        nearer = depth < self.opaque[where]
        where = where[nearer]
        self.opaque[where] = depth[nearer]
        self.color[where] = np.clip(color[nearer], 0.0, 1.0)
        self.through[where] = 0.0

    def add_surfaces(self, surfaces: list[Surface]) -> None:
        """Meshes, in eye space."""
        hits = visible_hits(surfaces, self.camera, self.samples)
        first = 0
        for surface in surfaces:
            mine = hits.on(first, first + len(surface.faces))
            rgb = shade(surface, mine, self.samples, self.camera, self.lights, self.options)
            where = np.ravel_multi_index(mine.where, self.samples.x.shape)
            self.put(where, mine.depth, rgb)
            first += len(surface.faces)

    def add_isosurface(self, field: Field, depths: Array) -> None:
        """A volume of mode "iso", in eye space."""
        for part in self._parts(depths):
            where, depth, rgb = volume.isosurface(field, self.rays.take(part), depths, self.opaque[part], self.lights)
            self.put(part[where], depth, rgb)

    def add_points(self, clouds: list[Surfels]) -> None:
        """Points, in eye space."""
        self.put(*splat(clouds, self.opaque, self.camera, self.samples, self.lights, self.options))

    def add_volumes(self, fields: list[Field], depths: Array, averaged: bool) -> None:
        """All volumes of mode "composite", in eye space; after what is opaque.

        averaged: samples (H, W, 3, …) of a panel are attenuated by the mean alpha of the sub-pixels of a pixel.
        """
        numbers = np.arange(len(self.rays)).reshape(self.samples.x.shape)
        order = np.moveaxis(numbers, 2, -1).ravel() if averaged else numbers.ravel()
        together = 3 if averaged else 1
        for positions in self._parts(depths, together):
            part = order[positions]
            rays, stop = self.rays.take(part), self.opaque[part]
            self._cover(part, *volume.composite(fields, rays, depths, stop, self.lights, together))

    def add_maximum(self, field: Field, depths: Array) -> None:
        """A volume of mode "mip", in eye space; after all else. It counts as seen at its greatest value."""
        for part in self._parts(depths):
            color, alpha, depth = volume.maximum(field, self.rays.take(part), depths, self.opaque[part])
            self._cover(part, alpha[:, None] * color, 1 - alpha, np.where(alpha >= 0.5, depth, np.inf))

    def _cover(self, part: NDArray[np.integer], emitted: Array, through: Array, half: Array) -> None:
        """Put premultiplied light (K, 3) over samples `part` (K,)."""
        self.color[part] = emitted + through[:, None] * self.color[part]
        self.through[part] *= through
        self.half[part] = np.minimum(half, self.half[part])

    def _parts(self, depths: Array, together: int = 1) -> Iterator[NDArray[np.integer]]:
        """Indices of all rays, so many at a time as memory shall hold; `together` are not parted."""
        count = max(1, volume.SAMPLES // (len(depths) * together)) * together
        for start in range(0, len(self.rays), count):
            yield np.arange(start, min(start + count, len(self.rays)))


def visible_hits(surfaces: list[Surface], camera: Camera, samples: Samples) -> Hits:
    """What the samples see of surfaces in eye space; triangles are counted through all of them."""
    corners = np.concatenate([s.vertices[s.faces] for s in surfaces])
    sides = [np.full(len(s.faces), 0 if s.two_sided else -1 if s.mirrored else 1) for s in surfaces]
    return trace(corners, np.concatenate(sides), camera, samples)


def look(
    prepared: PreparedScene, samples: Samples, camera: Camera, options: Options, averaged: bool = False
) -> Picture:
    """What samples see of the whole scene; `averaged` as in `Picture.add_volumes`."""
    result = Picture(prepared, samples, camera, options)
    fields = [field.in_eye_space(camera) for field in prepared.fields]
    depths = volume.planes(fields, camera, options.step) if fields else np.empty(0)
    visible = fields if len(depths) else []
    composites, maxima, isos = ([f for f in visible if f.volume.mode == m] for m in ("composite", "mip", "iso"))
    if prepared.surfaces:
        result.add_surfaces([surface.in_eye_space(camera) for surface in prepared.surfaces])
    for field in isos:
        result.add_isosurface(field, depths)
    if prepared.clouds:
        result.add_points([cloud.in_eye_space(camera) for cloud in prepared.clouds])
    if composites:
        result.add_volumes(composites, depths, averaged)
    for field in maxima:
        result.add_maximum(field, depths)
    result.color += result.through[:, None] * prepared.background
    return result


def picture(
    prepared: PreparedScene, samples: Samples, camera: Camera, options: Options, averaged: bool = False
) -> tuple[NDArray[np.uint8], NDArray[np.float32], int]:
    """Colour (…, 4) and depth (…) of samples (…), and how many were covered."""
    seen = look(prepared, samples, camera, options, averaged)
    color = quantize(np.column_stack([seen.color, 1 - seen.through])).reshape(*samples.x.shape, 4)
    depth = seen.depth.astype(np.float32).reshape(samples.x.shape)
    return color, depth, int(np.count_nonzero(seen.through < 1))


def quantize(values: Array) -> NDArray[np.uint8]:
    """uint8 = ⌊255·v + ½⌋ of values clamped to 0…1."""
    return np.floor(255.0 * np.clip(values, 0.0, 1.0) + 0.5).astype(np.uint8)


def mean_color(samples: NDArray[np.uint8], axis: int) -> NDArray[np.uint8]:
    """Mean of quantised samples over an axis, rounded half up."""
    n = samples.shape[axis]
    return ((samples.sum(axis=axis, dtype=np.int64) + n // 2) // n).astype(np.uint8)
