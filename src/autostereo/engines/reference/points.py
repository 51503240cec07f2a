"""Points, as a specification: which surfels a sample sees, and how they are blended.

A surfel is the disc |X − P| ≤ r in the plane through P with normal n. A sample's ray meets that plane at depth d_s
(Hübner 2007b, equation 2), in perspective and for the sample's own eye; there the surfel weighs w = 1 − |X − P|²/r².
The nearest d_s of all surfels at a sample is its depth z; all surfels with d_s ≤ z + r, r their own radius, are
blended to Σ w·c / Σ w: ε-z visibility and normalised blending (Hübner 2007b, section 3.5.2; Pfister et al. 2000).

Discs without a normal lie in the plane of constant depth. So do, for a view in which its projection is less than a
pixel wide, discs with one. Both are ellipses on the picture, with half axes of at least `LEAST_RADIUS` pixels, so that
samples, which are a pixel apart, do not miss them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Material
from ...scene.points import Points
from ...transforms import apply, apply_normals
from ..engine import Camera
from ..options import Options
from .mesh import Samples, project
from .rays import Rays
from .shading import illuminate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LEAST_RADIUS = 0.71  # pixels: every disc of it, just over √½, holds a pixel's centre
PAIRS = 2**19  # of surfel and sample that are tested at a time


@dataclass(frozen=True, eq=False)
class Surfels:
    """The surfels of one object, in world space or, from `in_eye_space`, in eye space.

    Attributes
    ----------
    positions, colors : ndarray of shape (N, 3), float64
    normals : ndarray of shape (N, 3), float64
        Unit length, of either sign; zero where there is none.
    radii : ndarray of shape (N,), float64
    material : Material
    """

    positions: Array
    normals: Array
    radii: Array
    colors: Array
    material: Material

    @staticmethod
    def of(points: Points) -> Surfels:
        """Return points in world space."""
        positions, normals = points.world_positions, points.world_normals
        return Surfels(
            positions,
            np.zeros_like(positions) if normals is None else normals,
            points.world_radii,
            points.colors.astype(np.float64),
            points.material,
        )

    def in_eye_space(self, camera: Camera) -> Surfels:
        """Return those surfels whose centres are not in front of the near plane, in eye space."""
        positions = apply(camera.eye_from_world, self.positions)
        normals = apply_normals(camera.eye_from_world, self.normals)
        moved = Surfels(positions, normals, self.radii, self.colors, self.material)
        return moved.take(np.nonzero(positions[:, 2] >= camera.near)[0])

    def take(self, index: NDArray[np.integer]) -> Surfels:
        """Some of the surfels."""
        return Surfels(
            self.positions[index], self.normals[index], self.radii[index], self.colors[index], self.material
        )


@dataclass(frozen=True, eq=False)
class Splats:
    """M pairs of a sample and a surfel that covers it.

    Attributes
    ----------
    sample, surfel : ndarray of shape (M,), int
        Flat index of the sample; index of the surfel.
    depth, weight : ndarray of shape (M,), float64
        d_s, and w in 0 < w ≤ 1.
    """

    sample: Indices
    surfel: Indices
    depth: Array
    weight: Array

    def take(self, mine: NDArray[np.bool_]) -> Splats:
        """Some of the pairs."""
        return Splats(self.sample[mine], self.surfel[mine], self.depth[mine], self.weight[mine])


def is_thin(centre: Array, normals: Array, radii: Array, camera: Camera) -> NDArray[np.bool_]:
    """Whether discs appear less than a pixel wide, (M,).

    The projection is taken as affine over the disc, as in Zwicker 2001: the disc becomes an ellipse whose half axes
    are the singular values of J·(the disc's two axes), J the derivative of the picture position at its centre.

    Parameters
    ----------
    centre, normals : ndarray of shape (M, 3)
        Centre relative to the eye that sees it, and unit normal.
    radii : ndarray of shape (M,)
    camera : Camera
    """
    X, Y, d = centre.T
    zero = np.zeros_like(d)
    jacobian = np.stack([np.column_stack([d, zero, -X]), np.column_stack([zero, -d, Y])], axis=1)
    jacobian *= (np.array([camera.fx, camera.fy])[:, None] * (radii / d**2)[:, None, None])
    along = jacobian - np.einsum("mij,mj,mk->mik", jacobian, normals, normals)  # within the disc's plane
    squares = np.sum(along**2, axis=(1, 2))
    area = camera.fx * camera.fy * radii**2 * np.abs(np.sum(normals * centre, axis=1)) / d**3
    longer = np.sqrt((squares + np.sqrt(np.maximum(squares**2 - 4 * area**2, 0.0))) / 2)
    return 2 * area < longer  # shorter half axis = area / longer


def intersect(surfels: Surfels, camera: Camera, x: Array, y: Array, v: Array) -> tuple[Array, Array]:
    """Depth d_s and weight (≤ 0: not covered), each (M,), where samples (M,) meet surfels (M,)."""
    rays = Rays.through(camera, Samples(x, y, v))
    centre = surfels.positions - rays.origin
    radii, d = surfels.radii, surfels.positions[:, 2]
    bare = ~surfels.normals.any(axis=1)
    thin = is_thin(centre, surfels.normals, radii, camera) & ~bare
    upright = bare | thin

    along = np.sum(surfels.normals * rays.direction, axis=1)
    meets = upright | (along != 0)
    depth = np.sum(surfels.normals * centre, axis=1) / np.where(meets & ~upright, along, 1.0)
    away = depth[:, None] * rays.direction - centre
    distance = np.sum((away / radii[:, None]) ** 2, axis=1)

    on_picture = (rays.direction - centre / d[:, None])[:, :2] * (camera.fx, camera.fy)
    half_axes = np.maximum(np.outer(radii / d, [camera.fx, camera.fy]), LEAST_RADIUS)
    distance = np.where(upright, np.sum((on_picture / half_axes) ** 2, axis=1), distance)
    depth = np.where(upright, d, depth)
    return depth, np.where(meets & (depth >= camera.near), 1.0 - distance, 0.0)


def pixel_boxes(surfels: Surfels, camera: Camera, samples: Samples) -> Indices:
    """Pixels that surfels may touch for any of the samples' offsets: (N, 4), first and last + 1 row, then column."""
    r = surfels.radii
    # picture positions are monotonic in X, Y, d and v: the extremes are at the corners of the ball's bounding box
    ends = []
    for side in (-1, 1):
        for depth in (np.maximum(surfels.positions[:, 2] - r, camera.near), surfels.positions[:, 2] + r):
            corner = surfels.positions + side * r[:, None]
            corner[:, 2] = depth
            ends += [project(camera, corner, v) for v in (samples.v.min(), samples.v.max())]
    x, y = np.moveaxis(np.array(ends), 1, 0)
    rows, columns = samples.x.shape[:2]
    box = [y.min(axis=0) - 2, y.max(axis=0) + 2, x.min(axis=0) - 2, x.max(axis=0) + 2]
    limits = (rows, rows, columns, columns)
    return np.stack([np.clip(np.floor(b), 0, n).astype(np.int64) for b, n in zip(box, limits, strict=True)], axis=1)


def candidates(surfels: Surfels, camera: Camera, samples: Samples) -> Iterator[tuple[Indices, Indices]]:
    """Pairs (surfel, sample) that may meet, `PAIRS` or those of one surfel at a time."""
    top, bottom, left, right = pixel_boxes(surfels, camera, samples).T
    columns = samples.x.shape[1]
    each = samples.x[0, 0].size  # samples of a pixel
    count = (bottom - top) * (right - left) * each
    start = 0
    while start < len(count):
        stop = max(start + 1, start + int(np.searchsorted(np.cumsum(count[start : start + PAIRS]), PAIRS, "right")))
        mine = np.arange(start, stop)
        surfel = np.repeat(mine, count[mine])
        k = np.arange(len(surfel)) - np.repeat(np.cumsum(count[mine]) - count[mine], count[mine])
        pixel, within = np.divmod(k, each)
        row, column = np.divmod(pixel, (right - left)[surfel])
        yield surfel, ((row + top[surfel]) * columns + column + left[surfel]) * each + within
        start = stop


def find_splats(surfels: Surfels, camera: Camera, samples: Samples) -> Splats:
    """All pairs of a sample and a surfel, in eye space, that covers it."""
    found = [Splats(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0))]
    x, y, v = samples.x.ravel(), samples.y.ravel(), samples.v.ravel()
    for surfel, sample in candidates(surfels, camera, samples):
        depth, weight = intersect(surfels.take(surfel), camera, x[sample], y[sample], v[sample])
        found.append(Splats(sample, surfel, depth, weight).take(weight > 0))
    return Splats(*(np.concatenate([getattr(s, name) for s in found]) for name in vars(found[0])))


def shade_surfels(
    surfels: Surfels, seen_from: Array, camera: Camera, lights: list[tuple[Array, Array]], options: Options
) -> Array:
    """Colours (N, 3) of surfels in eye space, lit at their centres for eyes at offsets (N,); not clamped.

    Surfels have two sides: the normal is turned to the eye that they are lit for.
    """
    centre = np.array([0.0, camera.offset_y, 0.0])
    eyes = np.tile(centre, (len(seen_from), 1))
    if options.shading != "center":
        eyes[:, 0] = seen_from
    normals = np.where(surfels.normals.any(axis=1, keepdims=True), surfels.normals, (0.0, 0.0, -1.0))
    away = np.sum(normals * (eyes - surfels.positions), axis=1, keepdims=True) < 0
    reflected, highlight = illuminate(
        surfels.positions, np.where(away, -normals, normals), eyes, surfels.material, lights
    )
    return surfels.colors * reflected + highlight


def splat(
    clouds: list[Surfels], stop: Array, camera: Camera, samples: Samples, lights: list[tuple[Array, Array]],
    options: Options,
) -> tuple[Indices, Array, Array]:
    """What samples see of all surfels together, in eye space, in front of opaque things at depths `stop` (M,).

    Returns
    -------
    where : ndarray of shape (K,), int
        Flat indices of the samples that see surfels.
    depth : ndarray of shape (K,), float64
    color : ndarray of shape (K, 3), float64
        Not clamped.
    """
    every = [find_splats(cloud, camera, samples) for cloud in clouds]
    every = [s.take(s.depth < stop[s.sample]) for s in every]
    depth = np.full(len(stop), np.inf)
    for splats in every:
        np.minimum.at(depth, splats.sample, splats.depth)
    color, total = np.zeros((len(stop), 3)), np.zeros(len(stop))
    for cloud, splats in zip(clouds, every, strict=True):
        splats = splats.take(splats.depth <= depth[splats.sample] + cloud.radii[splats.surfel])
        lit = shade_surfels(cloud.take(splats.surfel), samples.v.ravel()[splats.sample], camera, lights, options)
        np.add.at(color, splats.sample, splats.weight[:, None] * lit)
        np.add.at(total, splats.sample, splats.weight)
    where = np.nonzero(total > 0)[0]
    return where, depth[where], color[where] / total[where, None]
