"""Polygons to triangles, and corners to shared vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def triangulate(counts: Ints, corners: Ints, vertices: NDArray[np.float64]) -> Ints:
    """Cut polygons into triangles of the same winding.

    Parameters
    ----------
    counts : ndarray of shape (P,), int
        Corners of each polygon; those with fewer than three give no triangle.
    corners : ndarray of shape (C,), int
        Vertex index of every corner, polygon after polygon; C = counts.sum().
    vertices : ndarray of shape (N, 3)
        Positions, to cut concave polygons rightly.

    Returns
    -------
    ndarray of shape (F, 3), int64
        Positions in `corners`, in the order of the polygons.

    Notes
    -----
    A convex polygon becomes the fan of its first corner. One with a reflex corner is cut by ear clipping
    (Meisters 1975) in the plane of its Newell normal.
    """
    first = np.cumsum(counts) - counts
    if (counts == 3).all():
        return first[:, None] + np.arange(3)
    fans = np.maximum(counts - 2, 0)
    polygon = np.repeat(np.arange(len(counts)), fans)
    step = np.arange(len(polygon)) - np.repeat(np.cumsum(fans) - fans, fans)
    start = first[polygon]
    triangles = np.stack([start, start + step + 1, start + step + 2], axis=1)
    for p in np.flatnonzero(_concave(counts, corners, vertices)):
        rows = slice(*np.searchsorted(polygon, (p, p + 1)))
        ring = vertices[corners[first[p] : first[p] + counts[p]]]
        triangles[rows] = first[p] + _clip_ears(ring)
    return triangles


def unroll_strips(counts: Ints, corners: Ints) -> Ints:
    """Triangles of strips: of each three corners in a row, every second one turned.

    Parameters
    ----------
    counts : ndarray of shape (P,), int
        Entries of each list; a strip ends with its list, and before every entry −1.
    corners : ndarray of shape (C,), int
        Vertex indices and −1, list after list; C = counts.sum().

    Returns
    -------
    ndarray of shape (F, 3), int64
        Vertex indices, without triangles that name a vertex twice: they lead from one strip to the next.
    """
    cut = corners == -1
    first = cut.copy()  # of a strip, or −1
    first[1:] |= cut[:-1]
    ends = np.cumsum(counts)
    first[(ends - counts)[counts > 0]] = True
    strip, at = np.cumsum(first), np.arange(len(corners))
    step = at - np.maximum.accumulate(np.where(first, at, 0))
    k = at[2:][strip[2:] == strip[:-2]] - 2  # −1 is a strip of its own, of one entry
    turned = step[k] % 2
    a, b, c = faces = corners[k], corners[k + 1 + turned], corners[k + 2 - turned]
    return np.stack(faces, axis=1)[(a != b) & (b != c) & (c != a)]


def _concave(counts: Ints, corners: Ints, vertices: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which polygons (P,) turn the other way at some corner."""
    concave = np.zeros(len(counts), dtype=bool)
    first = np.cumsum(counts) - counts
    for size in np.unique(counts[counts > 3]):
        which = np.flatnonzero(counts == size)
        ring = vertices[corners[first[which, None] + np.arange(size)]]  # (K, size, 3)
        edge = np.roll(ring, -1, axis=1) - ring
        turn = np.cross(np.roll(edge, 1, axis=1), edge)
        concave[which] = (np.einsum("kcx,kx->kc", turn, _newell(ring)) < 0).any(axis=1)
    return concave


def _newell(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the vector area (K, 3) of polygons (K, n, 3)."""
    ring = ring - ring[:, :1]
    return np.cross(ring, np.roll(ring, -1, axis=1)).sum(axis=1)


def _clip_ears(ring: NDArray[np.float64]) -> Ints:
    """Triangles (n − 2, 3) of one simple polygon (n, 3)."""
    normal = _newell(ring[None])[0]
    drop = int(np.abs(normal).argmax())
    keep = [(1, 2), (2, 0), (0, 1)][drop]
    flat = ring[:, keep] * (1.0, 1.0 if normal[drop] >= 0 else -1.0)

    def area(a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = flat[a], flat[b], flat[c]
        return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))

    left, result = list(range(len(ring))), []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            if area(a, b, c) > 0 and not any(
                area(a, b, p) >= 0 and area(b, c, p) >= 0 and area(c, a, p) >= 0 for p in left if p not in (a, b, c)
            ):
                break
        else:
            k = 0  # not a simple polygon: any cut is as good
            a, b, c = left[-1], left[0], left[1]
        result.append((a, b, c))
        del left[k]
    return np.array([*result, tuple(left)], dtype=np.int64)


def weld(*columns: NDArray) -> tuple[Ints, Ints]:
    """Find the distinct rows of some columns, each of shape (C,).

    Returns
    -------
    first : ndarray of shape (N,)
        Row at which each distinct combination appears first, ascending.
    group : ndarray of shape (C,)
        For every row, which of them it is.
    """
    rows = len(columns[0])
    key, size = np.zeros(rows, dtype=np.int64), 1
    for column in columns:
        ids, width = _ids(column)
        if size * width > 2**62:
            _, key = np.unique(key, return_inverse=True)
            size = int(key.max(initial=0)) + 1
        key, size = key * width + ids, size * width
    if size <= 8 * rows:  # a table is faster than sorting
        at = np.full(size, rows)
        at[key[::-1]] = np.arange(rows)[::-1]
        first = np.sort(at[at < rows])
        number = np.empty(size, dtype=np.int64)
        number[key[first]] = np.arange(len(first))
        return first, number[key]
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[group.reshape(-1)]


def _ids(column: NDArray) -> tuple[Ints, int]:
    """Numbers (C,) from 0 that are equal where the column is, and their count."""
    if column.dtype.kind in "iub" and len(column):
        low, high = int(column.min()), int(column.max())
        if high - low < 4 * len(column) + 1024:
            return column.astype(np.int64) - low, high - low + 1
    _, ids = np.unique(column, return_inverse=True)
    return ids.reshape(-1), int(ids.max(initial=0)) + 1
