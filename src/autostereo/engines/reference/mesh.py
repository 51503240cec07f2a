"""Meshes, as a specification: which triangle a sample sees, and where on it.

A *sample* is a picture position (x, y) in pixels, rows from the top, and a camera offset v. In eye space
(X right, Y up, d depth) its ray starts at the eye (v, o_y, 0) and runs along (a, b, 1) with

    a = (x − W/2)/fx − v/focal,    b = (H/2 − y)/fy − o_y/focal,

which is DESIGN section 1 solved for (X − v)/d and (Y − o_y)/d. With Q_k the corners seen from that eye, the
homogeneous edge functions e_k = (a, b, 1)·(Q_i × Q_j), (i, j, k) cyclic (Olano and Greer 1997), answer everything:
they share one sign inside the triangle and e_k/Σe are the barycentric weights, perspective-correct, also where the
triangle reaches behind the eye. For a fixed row they are affine in (x, v): the exact form of the side faces
of a multi-view triangle, which PMR 2020 prints as planes (DESIGN section 2, erratum 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Material
from ...scene.mesh import Mesh
from ...transforms import apply, apply_normals
from ..engine import Camera
from .texture import mip_levels

Array = NDArray[np.float64]
Box = tuple[slice, slice]


@dataclass(frozen=True, eq=False)
class Surface:
    """One mesh, in world space or, from `in_eye_space`, in eye space.

    Attributes
    ----------
    faces : ndarray of shape (F, 3), int
    vertices, normals, colors : ndarray of shape (N, 3), float64
    uv : ndarray of shape (F, 3, 2), float64, optional
        Per corner, the integer part taken off per triangle.
    levels : list of ndarray of shape (h, w, 3), float32
        Mip levels of the texture; empty without one.
    material : Material
    two_sided : bool
    mirrored : bool
        The object's transform mirrors: its fronts appear clockwise.
    """

    faces: NDArray[np.int32]
    vertices: Array
    normals: Array
    colors: Array
    uv: Array | None
    levels: list[NDArray[np.float32]]
    material: Material
    two_sided: bool
    mirrored: bool

    @staticmethod
    def of(mesh: Mesh) -> Surface:
        """Return a mesh in world space, with what it leaves out filled in."""
        assert mesh.transform is not None and mesh.material is not None  # set by the constructor
        uv = None
        if mesh.uv is not None and mesh.texture is not None:
            uv = mesh.uv[mesh.faces]
            uv = uv - np.floor(uv.min(axis=1, keepdims=True))
        return Surface(
            faces=mesh.faces,
            vertices=apply(mesh.transform, mesh.vertices),
            normals=apply_normals(mesh.transform, mesh.shading_normals),
            colors=np.ones_like(mesh.vertices) if mesh.colors is None else mesh.colors.astype(np.float64),
            uv=uv,
            levels=[] if mesh.texture is None else mip_levels(mesh.texture),
            material=mesh.material,
            two_sided=mesh.two_sided,
            mirrored=bool(np.linalg.det(mesh.transform[:3, :3]) < 0),
        )

    def in_eye_space(self, camera: Camera) -> Surface:
        """Return the surface with positions and normals in eye space."""
        moved = {
            "vertices": apply(camera.eye_from_world, self.vertices),
            "normals": apply_normals(camera.eye_from_world, self.normals),
        }
        return Surface(**(vars(self) | moved))


@dataclass(frozen=True, eq=False)
class Samples:
    """Where to look: arrays of one shape (H, W, …), the first two axes being the pixel.

    Attributes
    ----------
    x, y : ndarray of shape (H, W, …), float64
        Picture position in pixels, y from the top.
    v : ndarray of shape (H, W, …), float64
        Camera offset, world units.
    """

    x: Array
    y: Array
    v: Array


@dataclass(frozen=True, eq=False)
class Hits:
    """What M of the samples see.

    Attributes
    ----------
    where : tuple of ndarrays of shape (M,), int
        Indices into the samples, as from `numpy.nonzero`.
    triangle : ndarray of shape (M,), int
    side : ndarray of shape (M,), int
        +1 where the corners appear counter-clockwise from the sample's own eye, −1 where clockwise.
    depth : ndarray of shape (M,), float64
    weights, weights_dx, weights_dy : ndarray of shape (M, 3), float64
        Barycentric weights of the corners, and their derivatives per pixel in x and y.
    """

    where: tuple[NDArray[np.intp], ...]
    triangle: NDArray[np.int64]
    side: NDArray[np.int64]
    depth: Array
    weights: Array
    weights_dx: Array
    weights_dy: Array

    def on(self, first: int, stop: int) -> Hits:
        """The hits on triangles first … stop − 1, counted from `first`."""
        mine = (self.triangle >= first) & (self.triangle < stop)
        return Hits(
            tuple(index[mine] for index in self.where),
            self.triangle[mine] - first,
            self.side[mine],
            self.depth[mine],
            self.weights[mine],
            self.weights_dx[mine],
            self.weights_dy[mine],
        )


def project(camera: Camera, points: Array, v: Array | float) -> tuple[Array, Array]:
    """Picture position (x, y) of eye-space points (…, 3) for camera offsets v: the formula of DESIGN section 1."""
    X, Y, d = points[..., 0], points[..., 1], points[..., 2]
    x = camera.width / 2 + camera.fx * X / d + camera.fx * v * (1 / camera.focal - 1 / d)
    y = camera.height / 2 - camera.fy * (Y - camera.offset_y) / d - camera.fy * camera.offset_y / camera.focal
    return x, y


def edge_functions(corners: Array, camera: Camera, x: Array, y: Array, v: Array) -> tuple[Array, Array, Array]:
    """Edge functions e and their slopes ∂e/∂x, ∂e/∂y, each (…, 3): entry k belongs to corner k.

    Parameters
    ----------
    corners : ndarray of shape (…, 3, 3)
        Corners in eye space, broadcast against the samples.
    camera : Camera
    x, y, v : ndarray of shape (…)
        Samples.

    Notes
    -----
    An edge that two triangles walk in opposite directions gives exactly opposite values: every product below
    appears in both, with the sign changed.
    """
    a = (x - camera.width / 2) / camera.fx - v / camera.focal
    b = (camera.height / 2 - y) / camera.fy - camera.offset_y / camera.focal
    X = corners[..., 0] - np.asarray(v)[..., None]
    Y = corners[..., 1] - camera.offset_y
    D = corners[..., 2]
    i, j = [1, 2, 0], [2, 0, 1]
    n_x = Y[..., i] * D[..., j] - D[..., i] * Y[..., j]
    n_y = D[..., i] * X[..., j] - X[..., i] * D[..., j]
    n_z = X[..., i] * Y[..., j] - Y[..., i] * X[..., j]
    e = n_x * a[..., None] + n_y * b[..., None] + n_z
    return e, np.broadcast_to(n_x / camera.fx, e.shape), np.broadcast_to(-n_y / camera.fy, e.shape)


def covers(side: int, e: Array, e_dx: Array, e_dy: Array) -> NDArray[np.bool_]:
    """Where a triangle seen from `side` (+1 counter-clockwise, −1 clockwise) covers samples, shape (…).

    Top-left rule: a sample exactly on an edge belongs to the triangle to the right of it, or below it if the
    edge is horizontal. So a row covers xL ≤ x < xR, and the rows are ytop ≤ y < ybottom.
    """
    is_left = side * e_dx > 0
    is_top = (e_dx == 0) & (side * e_dy > 0)
    return np.asarray(((side * e > 0) | ((e == 0) & (is_left | is_top))).all(axis=-1))


def clip_near(corners: Array, near: float) -> Array:
    """The part of a polygon (n, 3) in eye space with d ≥ near, shape (m, 3) (Sutherland and Hodgman 1974)."""
    if (corners[:, 2] >= near).all():
        return corners
    kept = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if p[2] >= near:
            kept.append(p)
        if (p[2] >= near) != (q[2] >= near):
            cut = p + (near - p[2]) / (q[2] - p[2]) * (q - p)
            kept.append(np.array([cut[0], cut[1], near]))  # of a huge triangle, cut's own depth may be rounded to 0
    return np.array(kept).reshape(-1, 3)


def pixel_box(corners: Array, camera: Camera, samples: Samples) -> Box | None:
    """Rows and columns that a triangle may touch for any of the samples' offsets; None if it is out of sight."""
    visible = clip_near(corners, camera.near)
    if len(visible) == 0:
        return None
    ends = np.array([[samples.v.min()], [samples.v.max()]])  # x is linear in v
    x, y = project(camera, visible, ends)
    box = []
    for position, size in ((y, samples.x.shape[0]), (x, samples.x.shape[1])):
        start = int(np.clip(np.floor(position.min()) - 1, 0, size))
        stop = int(np.clip(np.ceil(position.max()) + 1, 0, size))
        if start >= stop:
            return None
        box.append(slice(start, stop))
    return box[0], box[1]


def trace(corners: Array, sides: NDArray[np.int64], camera: Camera, samples: Samples) -> Hits:
    """Which triangle each sample sees: the nearest at d ≥ near, the earlier of equally near ones.

    Depths are compared as float32, as they are handed out: the last bits of float64 depend on the order of the corners.

    Parameters
    ----------
    corners : ndarray of shape (F, 3, 3)
        Triangles in eye space, in drawing order.
    sides : ndarray of shape (F,), int
        The side that is to be seen: +1 where the corners appear counter-clockwise, −1 clockwise, 0 both.
    camera : Camera
    samples : Samples
    """
    depth, nearest = np.full(samples.x.shape, np.inf), np.full(samples.x.shape, np.inf, np.float32)
    triangle = np.full(samples.x.shape, -1)
    side = np.zeros(samples.x.shape, dtype=np.int64)
    for index, corner in enumerate(corners):
        box = pixel_box(corner, camera, samples)
        if box is None:
            continue
        e, e_dx, e_dy = edge_functions(corner, camera, samples.x[box], samples.y[box], samples.v[box])
        for s in (1, -1) if sides[index] == 0 else (int(sides[index]),):
            inside = covers(s, e, e_dx, e_dy)
            e0, e1, e2 = np.moveaxis(e[inside], -1, 0)
            d = (e0 * corner[0, 2] + e1 * corner[1, 2] + e2 * corner[2, 2]) / (e0 + e1 + e2)
            wins = (d >= camera.near) & (d.astype(np.float32) < nearest[box][inside])
            inside[inside] = wins
            depth[box][inside] = nearest[box][inside] = d[wins]
            triangle[box][inside] = index
            side[box][inside] = s
    where = np.nonzero(triangle >= 0)
    x, y, v = samples.x[where], samples.y[where], samples.v[where]
    e, e_dx, e_dy = edge_functions(corners[triangle[where]], camera, x, y, v)
    total = e.sum(axis=-1, keepdims=True)
    weights = e / total
    return Hits(
        where,
        triangle[where],
        side[where],
        depth[where],
        weights,
        (e_dx - weights * e_dx.sum(axis=-1, keepdims=True)) / total,
        (e_dy - weights * e_dy.sum(axis=-1, keepdims=True)) / total,
    )
