"""Volumes, as a specification: emission and absorption, maximum intensity, isosurfaces.

Depths are cut by planes of constant eye depth d_k, the same for all views (Hübner 2007a, section 3.2). A ray's part
within a volume is one stretch of depth, for its box, the clipping box and the clipping plane are all half-spaces; the
planes clamped to that stretch are where the ray samples the volume, trilinearly. Between two samples lies a slab of
length L in which the scalar is taken to run linearly from s_a to s_b. Then, front to back,

    C += T·c·(1 − exp(−τL)),    T *= exp(−τL),

with τ the exact mean extinction of the transfer function over s_a … s_b (pre-integration, Engel 2001) and c the
slab's colour including the attenuation within it: the slab is cut in pieces, each with its own exact means. So the
sum converges to the emission–absorption integral when slabs get thin; where the scalar is linear along the ray it is
that integral with slabs of any thickness, T exactly and C up to the error of the pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scene.transfer import TransferFunction
from ...scene.volume import Volume
from ...transforms import apply
from ..engine import Camera
from .rays import Rays
from .shading import illuminate, unit

Array = NDArray[np.float64]
Lights = list[tuple[Array, Array]]

THIN = 1 / 16  # optical depth of a slab
PIECES = (2, 16)  # of thin and other slabs: with τL = 1, a colour that runs from 0 to 1 within it is right to 0.0003
SAMPLES = 2**17  # of rays × planes that are held at a time
BISECTIONS = 60  # of a slab, in search of an isosurface
MAX_PLANES = 2**20


def voxel_gradients(values: NDArray, kind: str) -> Array:
    """∂s/∂(i, j, k) at the voxels, shape (nz, ny, nx, 3).

    Central differences, one-sided at the borders; for "sobel" each is smoothed by (¼, ½, ¼) along both other axes,
    border voxels repeated.
    """
    gradients = np.empty((*values.shape, 3))
    for axis in range(3):
        slope = np.gradient(values.astype(np.float64), axis=axis)
        if kind == "sobel":
            for other in {0, 1, 2} - {axis}:
                padded = np.pad(slope, [(int(a == other),) * 2 for a in range(3)], mode="edge")
                before, after = (np.take(padded, np.arange(n, n + slope.shape[other]), other) for n in (0, 2))
                slope = (before + 2 * slope + after) / 4
        gradients[..., 2 - axis] = slope
    return gradients


def trilinear(grid: NDArray, index: Array) -> Array:
    """Interpolate (nz, ny, nx, …) at (i, j, k) (M, 3), clamped to the grid; exact where the neighbours are equal."""
    last = np.array(grid.shape[2::-1]) - 1
    index = np.clip(index, 0, last)
    first = np.minimum(np.floor(index).astype(np.int64), last - 1)
    i, j, k = first.T
    u, v, w = (index - first).T.reshape(3, -1, *(1,) * (grid.ndim - 3))

    def along_x(dj: int, dk: int) -> Array:
        a, b = (grid[k + dk, j + dj, i + di].astype(np.float64) for di in (0, 1))
        return a + u * (b - a)

    def along_y(dk: int) -> Array:
        a, b = along_x(0, dk), along_x(1, dk)
        return a + v * (b - a)

    near, far = along_y(0), along_y(1)
    return near + w * (far - near)


@dataclass(frozen=True, eq=False)
class Field:
    """One volume, in world space or, from `in_eye_space`, in eye space.

    Attributes
    ----------
    volume : Volume
        Values, transfer function and all that does not depend on space.
    gradients : ndarray of shape (nz, ny, nx, 3), float64, optional
        ∂s/∂(i, j, k) at the voxels, where the volume is shaded.
    index_from_space : ndarray of shape (4, 4), float64
    half_spaces : ndarray of shape (K, 4), float64
        What is seen of it is where h·(x, y, z, 1) ≥ 0 for all rows h.
    """

    volume: Volume
    gradients: Array | None
    index_from_space: Array
    half_spaces: Array

    @staticmethod
    def of(volume: Volume) -> Field:
        """Return a volume in world space."""
        index_from_world = np.linalg.inv(volume.world_from_index).astype(np.float64)
        last = np.asarray(volume.shape) - 1.0
        box = np.vstack([np.eye(4)[:3], np.column_stack([-np.eye(3), last])]) @ index_from_world
        rows: NDArray = np.empty((0, 4))
        if volume.clip_box is not None:
            low, high = volume.clip_box
            rows = np.vstack([np.column_stack([np.eye(3), -low]), np.column_stack([-np.eye(3), high])])
            rows = rows[np.isfinite(rows).all(axis=1)]
        if volume.clip_plane is not None:
            rows = np.vstack([rows, volume.clip_plane])
        half_spaces = np.vstack([box, rows @ np.linalg.inv(volume.transform)])
        gradients = None
        if volume.shade and volume.mode != "mip":
            gradients = voxel_gradients(volume.values, volume.gradient)
        return Field(volume, gradients, index_from_world, half_spaces)

    def in_eye_space(self, camera: Camera) -> Field:
        """Return the volume in eye space."""
        world_from_eye = np.linalg.inv(camera.eye_from_world)
        return Field(
            self.volume, self.gradients, self.index_from_space @ world_from_eye, self.half_spaces @ world_from_eye
        )

    def stretch(self, rays: Rays, near: float, stop: Array) -> tuple[Array, Array]:
        """Depths (M,), (M,) at which rays enter and leave what is seen of it; leave < enter where they miss it.

        Nothing is seen before depth `near` nor behind `stop` (M,).
        """
        enter, leave = np.full(len(rays), near), stop.copy()
        for row in self.half_spaces:
            at_eye, slope = rays.origin @ row[:3] + row[3], rays.direction @ row[:3]
            crossing = -at_eye / np.where(slope == 0, 1.0, slope)
            enter = np.where(slope > 0, np.maximum(enter, crossing), enter)
            leave = np.where(slope < 0, np.minimum(leave, crossing), leave)
            leave = np.where((slope == 0) & (at_eye < 0), -np.inf, leave)
        return enter, leave

    def scalars(self, points: Array) -> Array:
        """Scalars (…) at points (…, 3)."""
        index = apply(self.index_from_space, points.reshape(-1, 3))
        return trilinear(self.volume.values, index).reshape(points.shape[:-1])

    def normals(self, points: Array) -> Array:
        """Unit normals −∇s/|∇s| at points (M, 3), from interpolated voxel gradients; zero where ∇s is."""
        assert self.gradients is not None
        slope = trilinear(self.gradients, apply(self.index_from_space, points))
        return -unit(slope @ self.index_from_space[:3, :3])


def planes(fields: list[Field], camera: Camera, step: float) -> Array:
    """Depths d_0 … d_N of the planes between the slabs; without any when nothing lies behind the near plane.

    They divide evenly the depths that the volumes' boxes span together, from the near plane on, so that they are at
    most `step` times the smallest voxel of any of the volumes apart.
    """
    depth = np.concatenate([apply(camera.eye_from_world, f.volume.corners)[:, 2] for f in fields])
    first, last = max(depth.min(), camera.near), depth.max()
    if last <= first:
        return np.empty(0)
    count = (last - first) / (step * min(f.volume.voxel_size.min() for f in fields))
    if count > MAX_PLANES:
        raise InputError(f"options step: {step:g} voxels make {count:.3g} slabs of the volumes, at most {MAX_PLANES}")
    slabs = max(1, int(np.ceil(count)))
    return np.append(first + np.arange(slabs) * ((last - first) / slabs), last)


def lit(field: Field, color: Array, rays: Rays, depth: Array, lights: Lights, surface: bool = False) -> Array:
    """Colours (M, 3) under light, not clamped: Blinn–Phong on the gradient; `color` itself where there is none.

    Parameters
    ----------
    field : Field
    color : ndarray of shape (M, 3)
    rays : Rays
    depth : ndarray of shape (M,)
        The place on each ray.
    lights : list of (homogeneous position (4,), colour (3,))
    surface : bool
        A surface is lit on the side that is seen. Else both sides are: |N·L| and |N·H|.
    """
    if field.gradients is None:
        return color
    points = rays.at(depth)
    normals = field.normals(points)
    if surface:
        away = np.sum(normals * rays.direction, axis=1, keepdims=True) > 0
        normals = np.where(away, -normals, normals)
    reflected, highlight = illuminate(points, normals, rays.viewer, field.volume.material, lights, not surface)
    plain = ~normals.any(axis=1, keepdims=True)
    return np.where(plain, color, color * reflected + highlight)


def slab_color(transfer: TransferFunction, s_front: Array, s_back: Array, length: Array, pieces: int) -> Array:
    """Colour c (M, 3) of slabs with attenuation within: c·(1 − exp(−τL)) is what they emit, τ > 0 their mean."""
    emitted, total, through = np.zeros((len(length), 3)), np.zeros(len(length)), np.ones(len(length))
    for k in range(pieces):
        a, b = (s_front + (s_back - s_front) * ((k + end) / pieces) for end in (0, 1))
        mean = transfer.mean(a, b)
        alpha = -np.expm1(-mean[:, 3] * length / pieces)
        emitted += (through * alpha)[:, None] * mean[:, :3]
        total += through * alpha
        through *= 1 - alpha
    return emitted / np.where(total > 0, total, 1.0)[:, None]


def slabs(field: Field, rays: Rays, depths: Array, stop: Array, lights: Lights) -> tuple[Array, Array, Array]:
    """One volume's slabs along M rays: where they end (M, N+1), optical depths τL (M, N) and colours (M, N, 3)."""
    enter, leave = field.stretch(rays, depths[0], stop)
    t = np.where((leave > enter)[:, None], np.clip(depths, enter[:, None], leave[:, None]), enter[:, None])
    length = np.diff(t, axis=1) * rays.length_per_depth[:, None]
    optical, color = np.zeros(length.shape), np.zeros((*length.shape, 3))
    ray, k = np.nonzero(length)
    if len(ray) == 0:
        return t, optical, color
    s = np.zeros(t.shape)
    met = np.unique(ray)
    s[met] = field.scalars(rays.take(met).at(t[met]))
    transfer, length = field.volume.transfer, length[ray, k]
    optical[ray, k] = transfer.mean(s[ray, k], s[ray, k + 1])[:, 3] * length
    thin = optical[ray, k] <= THIN
    for pieces, shown in zip(PIECES, (thin & (optical[ray, k] > 0), ~thin), strict=True):
        at = ray[shown], k[shown]
        own = slab_color(transfer, s[at], s[:, 1:][at], length[shown], pieces)
        color[at] = lit(field, own, rays.take(at[0]), (t[at] + t[:, 1:][at]) / 2, lights)
    return t, optical, color


def composite(
    fields: list[Field], rays: Rays, depths: Array, stop: Array, lights: Lights, together: int = 1
) -> tuple[Array, Array, Array]:
    """Emission and absorption of volumes along M rays, which end at depths `stop` (M,).

    Volumes that share a slab add their optical depths there, and mix their colours by them.

    Parameters
    ----------
    together : int
        So many rays each, one after the other, are attenuated by the mean of their alphas in each slab: 3, the
        sub-pixels of a pixel, for `alpha="averaged"` (Hübner 2007b, section 3.6). What they emit stays their own.

    Returns
    -------
    color : ndarray of shape (M, 3), float64
        Emitted light, premultiplied, not clamped.
    through : ndarray of shape (M,), float64
        Transmittance T.
    half : ndarray of shape (M,), float64
        Depth where T falls to ½, inf where it does not (and with averaged alphas).
    """
    each = [slabs(field, rays, depths, stop, lights) for field in fields]
    optical = np.sum([o for _, o, _ in each], axis=0)
    color = np.sum([o[..., None] * c for _, o, c in each], axis=0) / np.where(optical > 0, optical, 1.0)[..., None]
    alpha = -np.expm1(-optical)
    mean = np.repeat(alpha.reshape(-1, together, alpha.shape[1]).mean(axis=1), together, axis=0)
    before = np.cumprod(np.column_stack([np.ones(len(rays)), 1 - mean]), axis=1)
    emitted = np.sum((before[:, :-1] * alpha)[..., None] * color, axis=1)

    half = np.full(len(rays), np.inf)
    if together == 1:
        ray = np.nonzero(before[:, -1] <= 0.5)[0]
        k = np.argmax(before[ray, 1:] <= 0.5, axis=1)
        # optical depth is taken to grow linearly through the part of the slab that volumes fill
        first, last = np.full(len(ray), np.inf), np.full(len(ray), -np.inf)
        for t, own, _ in each:
            fills = own[ray, k] > 0
            first = np.where(fills, np.minimum(first, t[ray, k]), first)
            last = np.where(fills, np.maximum(last, t[ray, k + 1]), last)
        half[ray] = first + np.log(2 * before[ray, k]) / optical[ray, k] * (last - first)
    return emitted, before[:, -1], half


def maximum(field: Field, rays: Rays, depths: Array, stop: Array) -> tuple[Array, Array, Array]:
    """Greatest of the samples along M rays that end at depths `stop` (M,).

    Returns
    -------
    color : ndarray of shape (M, 3), float64
        The transfer function's colour of it.
    alpha : ndarray of shape (M,), float64
        Its opacity as a share of the greatest opacity of the transfer function; 0 where the volume is missed.
    depth : ndarray of shape (M,), float64
        Where it is first reached.
    """
    enter, leave = field.stretch(rays, depths[0], stop)
    color, alpha, depth = np.zeros((len(rays), 3)), np.zeros(len(rays)), np.full(len(rays), np.inf)
    hit = np.nonzero(leave > enter)[0]
    t = np.clip(depths, enter[hit, None], leave[hit, None])
    s = field.scalars(rays.take(hit).at(t))
    depth[hit] = t[np.arange(len(hit)), s.argmax(axis=1)]
    value = field.volume.transfer.evaluate(s.max(axis=1))
    color[hit] = value[:, :3]
    greatest = field.volume.transfer.max_opacity
    alpha[hit] = value[:, 3] / greatest if greatest > 0 else 0.0
    return color, alpha, depth


def isosurface(
    field: Field, rays: Rays, depths: Array, stop: Array, lights: Lights
) -> tuple[NDArray[np.intp], Array, Array]:
    """Where M rays first cross the isosurface before depths `stop` (M,): between samples on different sides of it.

    Returns
    -------
    where : ndarray of shape (K,), int
        The rays that meet it.
    depth : ndarray of shape (K,), float64
        To the precision of the numbers: the crossing of the trilinear field is bisected.
    color : ndarray of shape (K, 3), float64
        Not clamped.
    """
    assert field.volume.iso is not None
    enter, leave = field.stretch(rays, depths[0], stop)
    hit = np.nonzero(leave > enter)[0]
    t = np.clip(depths, enter[hit, None], leave[hit, None])
    inside = field.scalars(rays.take(hit).at(t)) >= field.volume.iso
    crosses = inside[:, 1:] != inside[:, :-1]
    met = crosses.any(axis=1)
    where, k = hit[met], crosses[met].argmax(axis=1)
    row = np.nonzero(met)[0]
    low, high, starts_inside = t[row, k], t[row, k + 1], inside[row, k]
    through = rays.take(where)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        before = (field.scalars(through.at(middle)) >= field.volume.iso) == starts_inside
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    own = np.broadcast_to(field.volume.transfer.evaluate(field.volume.iso)[:3], (len(where), 3))
    return where, high, lit(field, own, through, high, lights, surface=True)
