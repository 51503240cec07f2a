"""4×4 transforms, named destination_from_source, acting on column vectors: p_dest = M @ p_source."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checks import FARTHEST, SMALLEST, check_reach, real_array
from .errors import InputError

Array = NDArray[np.float64]


def as_transform(matrix: ArrayLike | None, name: str = "transform") -> Array:
    """Return `matrix` as a checked (4, 4) float64 affine transform; None means the identity."""
    if matrix is None:
        return np.eye(4)
    m = real_array(name, matrix, "a 4×4 matrix of numbers").astype(np.float64)
    if m.shape != (4, 4):
        raise InputError(f"{name}: expected shape (4, 4), got {m.shape}")
    if not np.isfinite(m).all():
        raise InputError(f"{name}: expected finite numbers, found NaN or infinity")
    check_reach(name, m)
    if not np.array_equal(m[3], (0.0, 0.0, 0.0, 1.0)):
        raise InputError(f"{name}: expected an affine matrix with last row (0, 0, 0, 1), got {m[3].tolist()}")
    return m


def check_world(name: str, transform: Array, points: Array) -> None:
    """Raise InputError when `transform` may take one of points (N, 3) beyond ±FARTHEST."""
    farthest = np.maximum(-points.min(axis=0, initial=0.0), points.max(axis=0, initial=0.0))
    reach = np.abs(transform[:3, :3]) @ farthest + np.abs(transform[:3, 3])
    if reach.max() > FARTHEST:
        raise InputError(f"{name}: expected places in the world within ±{FARTHEST:g}, found up to ±{reach.max():g}")


def translation(x: float, y: float, z: float) -> Array:
    """Transform that moves points by (x, y, z)."""
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def scaling(x: float, y: float | None = None, z: float | None = None) -> Array:
    """Transform that scales by (x, y, z); one number scales all axes alike."""
    return np.diag([x, x if y is None else y, x if z is None else z, 1.0])


def rotation(axis: ArrayLike, degrees: float) -> Array:
    """Transform that turns by `degrees` about `axis` (3,), right-handed (Rodrigues' formula)."""
    a = np.asarray(axis, dtype=np.float64)
    a = a / np.linalg.norm(a)
    angle = np.deg2rad(degrees)
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    m = np.eye(4)
    m[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
    return m


def apply(dest_from_source: Array, points: ArrayLike) -> Array:
    """Transform points of shape (N, 3)."""
    return np.asarray(points) @ dest_from_source[:3, :3].T + dest_from_source[:3, 3]


def apply_normals(dest_from_source: Array, normals: ArrayLike) -> Array:
    """Transform normals of shape (N, 3) by the inverse transpose; the result is of unit length."""
    linear = dest_from_source[:3, :3]
    # the cofactor matrix is det · inverse transpose, and exists for singular matrices too
    cofactor = np.stack(
        [np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])]
    )
    sign = -1.0 if np.linalg.det(linear) < 0 else 1.0
    turned = np.asarray(normals) @ (sign * cofactor).T
    length = np.linalg.norm(turned, axis=-1, keepdims=True)
    return turned / np.where(length > 0, length, 1.0)


def eye_from_world(position: ArrayLike, target: ArrayLike, up: ArrayLike) -> Array:
    """Camera transform: eye x to the right, y up, z = depth in front of the camera (left-handed on purpose).

    With d = z > 0 in front, DESIGN section 1's formulas hold without a sign change.
    """
    position = np.asarray(position, dtype=np.float64)
    forward = np.asarray(target, dtype=np.float64) - position
    distance = np.linalg.norm(forward)
    if distance < SMALLEST:
        raise InputError("rig: position and target must differ")
    forward = forward / distance
    up = np.asarray(up, dtype=np.float64)
    right = np.cross(forward, up / np.linalg.norm(up))
    length = np.linalg.norm(right)
    if length < 1e-12:
        raise InputError("rig: up must not be parallel to the line of sight")
    right = right / length
    rows = np.stack([right, np.cross(right, forward), forward])
    m = np.eye(4)
    m[:3, :3] = rows
    m[:3, 3] = -rows @ position
    return m
