"""What the neighbours of a point tell about the surface it was sampled from: surfel radii and normals."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .mesh import merge_positions

Floats = NDArray[np.float64]

RADIUS_NEIGHBORS = 8  # the ring around a point of a square grid
NORMAL_NEIGHBORS = 12
_CHUNK = 65536  # points whose neighbours are in memory at a time


def estimate_radii(positions: Floats) -> Floats:
    """Return a radius for every point (N,), so that discs of an evenly sampled surface overlap without holes.

    The radius is the median distance to the 8 nearest other positions (1.21 grid steps on a square grid, where 0.71
    would do), at most 1.5 times the median of these positions' own: an outlier does not become a large disc.

    Raises
    ------
    InputError
        There are fewer than two different positions.
    """
    first, group = merge_positions(positions)
    if len(first) < 2:
        what = "one point" if len(positions) == 1 else f"{len(positions)} points at one position"
        raise InputError(f"radii: cannot be estimated from {what}; give radii")
    unique = positions[first]
    radii, near = np.empty(len(unique)), np.empty((len(unique), min(RADIUS_NEIGHBORS, len(unique) - 1)), np.int32)
    for part, distance, index in _nearest(unique, RADIUS_NEIGHBORS):
        radii[part], near[part] = np.median(distance, axis=1), index
    limit = np.empty(len(unique))
    for at in range(0, len(unique), _CHUNK):
        limit[at : at + _CHUNK] = 1.5 * np.median(radii[near[at : at + _CHUNK]], axis=1)
    return np.minimum(radii, limit)[group]


def estimate_normals(positions: Floats) -> Floats:
    """Return a unit normal for every point (N, 3): the direction in which its neighbours spread least."""
    first, group = merge_positions(positions)
    unique = positions[first]
    normals = np.zeros_like(unique)
    normals[:, 2] = 1.0
    if len(unique) > 1:
        for part, _, index in _nearest(unique, NORMAL_NEIGHBORS):
            offset = unique[index] - unique[part, None]
            offset -= offset.sum(axis=1, keepdims=True) / (offset.shape[1] + 1)
            normals[part] = np.linalg.eigh(np.einsum("nka,nkb->nab", offset, offset))[1][:, :, 0]
    return normals[group]


def _nearest(unique: Floats, count: int) -> Iterator[tuple[slice, Floats, NDArray[np.int64]]]:
    """Chunks of points, the distances (n, k) to their k ≤ `count` nearest others, and which these are (n, k)."""
    from scipy.spatial import cKDTree

    tree = cKDTree(unique)
    count = min(count, len(unique) - 1)
    for at in range(0, len(unique), _CHUNK):
        part = slice(at, at + _CHUNK)
        distance, index = tree.query(unique[part], k=count + 1, workers=-1)
        yield part, distance[:, 1:], index[:, 1:]  # the first is the point itself
