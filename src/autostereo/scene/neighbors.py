"""What the neighbours of a point tell about the surface it was sampled from: surfel radii and normals."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .mesh import merge_positions

Floats = NDArray[np.float64]
Indices = NDArray[np.integer]

RADIUS_NEIGHBORS = 8  # the ring around a point of a square grid
NORMAL_NEIGHBORS = 12
_LINKS = 6  # of them, those along which orientation spreads
_CHUNK = 65536  # points whose neighbours are in memory at a time


def estimate_radii(positions: Floats) -> Floats:
    """Return a radius for every point (N,), so that discs of an evenly sampled surface overlap without holes.

    The radius is the median distance to the 8 nearest other positions (1.21 grid steps on a square grid, where 0.71
    would do), at most 1.5 times the median of these positions' own: an outlier does not become a large disc. Points
    at one position count once.

    Raises
    ------
    InputError
        There are fewer than two different positions.
    """
    first, group = merge_positions(positions)
    if len(first) < 2:
        what = "one point" if len(positions) == 1 else f"{len(positions)} points that are all at one position"
        raise InputError(f"radii: cannot be estimated from {what}; give radii")
    unique = positions[first]
    radii, near = np.empty(len(unique)), np.empty((len(unique), min(RADIUS_NEIGHBORS, len(unique) - 1)), np.int32)
    for part, distance, index in _nearest(unique, RADIUS_NEIGHBORS):
        radii[part], near[part] = np.median(distance, axis=1), index
    limit = np.empty(len(unique))
    for at in range(0, len(unique), _CHUNK):
        limit[at : at + _CHUNK] = 1.5 * np.median(radii[near[at : at + _CHUNK]], axis=1)
    smallest = np.finfo(np.float64).tiny  # squares of tiny distances underflow
    return np.maximum(np.minimum(radii, limit), smallest)[group]


def estimate_normals(positions: Floats) -> Floats:
    """Return a unit normal for every point (N, 3): the direction in which its 12 nearest neighbours spread least.

    Signs agree between neighbours (Hoppe et al. 1992, section 3.3: they spread along a minimum spanning tree whose
    edges cost 1 − |n·n'|). They point out of a closed surface, and upwards along the axis that is nearest to the
    normal of an open, flat one. A single position has the normal (0, 0, 1).
    """
    first, group = merge_positions(positions)
    unique = positions[first]
    if len(unique) < 2:
        return np.tile((0.0, 0.0, 1.0), (len(positions), 1))
    normals, near = np.empty_like(unique), np.empty((len(unique), min(_LINKS, len(unique) - 1)), np.int32)
    for part, distance, index in _nearest(unique, NORMAL_NEIGHBORS):
        members = np.concatenate([np.arange(len(unique))[part, None], index], axis=1)
        offset = unique[members] - unique[part, None]
        offset /= np.maximum(distance[:, -1], np.finfo(np.float64).tiny)[:, None, None]
        offset -= offset.mean(axis=1, keepdims=True)
        spread = np.einsum("nka,nkb->nab", offset, offset)
        normals[part] = np.linalg.eigh(spread)[1][:, :, 0]
        near[part] = index[:, :_LINKS]
    return _oriented(unique, normals, near)[group]


def _nearest(unique: Floats, count: int) -> Iterator[tuple[slice, Floats, Indices]]:
    """Chunks of points, the distances (n, k) to their k ≤ `count` nearest others, and which these are (n, k)."""
    from scipy.spatial import cKDTree

    tree = cKDTree(unique)
    count = min(count, len(unique) - 1)
    for at in range(0, len(unique), _CHUNK):
        part = slice(at, at + _CHUNK)
        distance, index = tree.query(unique[part], k=count + 1, workers=-1)
        yield part, distance[:, 1:], index[:, 1:]  # the first is the point itself


def _oriented(positions: Floats, normals: Floats, near: Indices) -> Floats:
    """Turn unit normals (N, 3) so that those of neighbours `near` (N, k) agree."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

    count, links = near.shape
    cost = 1.0 - np.abs(np.einsum("nc,nkc->nk", normals, normals[near])) + 1e-6  # an edge of cost 0 is no edge
    start = np.arange(0, count * links + 1, links)
    tree = minimum_spanning_tree(csr_matrix((cost.ravel(), near.ravel(), start), shape=(count, count))).tocoo()
    parts, label = connected_components(tree, directed=False)
    # one more node, linked to one point of every part, makes it one tree
    seed = np.unique(label, return_index=True)[1]
    row, column = np.concatenate([tree.row, np.full(parts, count)]), np.concatenate([tree.col, seed])
    whole = csr_matrix((np.ones(len(row)), (row, column)), shape=(count + 1, count + 1))
    above = breadth_first_order(whole, count, directed=False)[1]
    above[count] = count
    padded = np.concatenate([normals, np.zeros((1, 3))])
    sign = np.where(np.einsum("nc,nc->n", padded, padded[above]) < 0, -1.0, 1.0)
    while (above != count).any():  # products along ever longer paths to the root
        sign *= sign[above]
        above = above[above]
    normals = normals * sign[:count, None]
    return normals * _outward(positions, normals, label, parts)[label, None]


def _outward(positions: Floats, normals: Floats, label: Indices, parts: int) -> Floats:
    """Sign (parts,) that makes the normals of each part point outwards: the volume within must be positive."""

    def total(values: Floats) -> Floats:
        return np.stack([np.bincount(label, weights=column, minlength=parts) for column in values.T], axis=1)

    offset = positions - (total(positions) / np.bincount(label, minlength=parts)[:, None])[label]
    volume = total((offset * normals).sum(axis=1, keepdims=True))[:, 0]
    reach = total(np.linalg.norm(offset, axis=1, keepdims=True))[:, 0]
    mean = total(normals)
    axis = np.abs(mean).argmax(axis=1)
    upward = mean[np.arange(parts), axis]
    return np.where(np.where(np.abs(volume) > 0.1 * reach, volume, upward) < 0, -1.0, 1.0)
