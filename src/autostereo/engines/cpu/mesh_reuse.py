"""Shading reuse: Hasselgren 2006, section 4.3, in software (`shading="reuse"`).

The cameras are divided into sets of neighbours. Of each set one view is exact: it shades its samples of a segment, all
of them, and remembers the colours. A sample of another view is looked up at its place in the exact view of its set:
between two remembered colours it is interpolated, beside one it takes that one, and where there is none (the triangle
is not seen there) it is shaded afresh. Coverage and depth stay exact everywhere.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_raster import shade
from .mesh_shade import ADDRESS, CAPACITY, COLOR, OFFSET, ONE, ZERO, U, X, Z
from .samples import COLOR_MASK, hit, scatter

VIEWS_PER_SET = 8


def exact_offsets(offsets):
    """Camera offsets (E,) float32 of the exact views: the middle one of every set of neighbours among (V,)."""
    sets = np.array_split(np.asarray(offsets), max(1, -(-len(offsets) // VIEWS_PER_SET)))
    return np.array([part[len(part) // 2] for part in sets], dtype=np.float32)


@kernel
def shade_exact(ends, depths, at, width, shader, shading, segment, lists, ints, colors, spans):
    """Shade the segment in every exact view; colors[place + k] is that of pixel start + k.

    spans (3, E) int32 become start, number and place of each view's pixels.
    """
    material, side, geometry, gradient = shading
    x1, p1, x2, p2 = ends
    filled = 0
    for e in range(shader.exact.shape[0]):
        offset = shader.exact[e]
        start = np.int32(np.ceil(min(max(x1 + offset * p1 - at, ZERO), width)))
        end = np.int32(np.ceil(min(max(x2 + offset * p2 - at, ZERO), width)))
        spans[0, e], spans[1, e], spans[2, e] = start, max(end - start, np.int32(0)), filled
        k = start
        while k < end:
            n = np.uint64(0)
            while k < end and n < np.uint64(CAPACITY):
                x = np.float32(k) + at
                _, z, u = hit(x, offset, ends, depths)
                lists[U + n], lists[Z + n], lists[X + n], lists[OFFSET + n] = u, z, x, offset
                n += np.uint64(1)
                k += np.int32(1)
            shade(n, shader, material, side, geometry, gradient, segment, lists, ints)
            for i in range(n):
                colors[filled] = ints[COLOR + i]
                filled += 1


@inlined
def mix(a, b, part):
    """Colour between two, channel by channel, rounded."""
    color = np.int32(-0x1000000)
    for c in range(3):
        low = np.float32((a >> np.int32(8 * c)) & np.int32(255))
        high = np.float32((b >> np.int32(8 * c)) & np.int32(255))
        color |= np.int32(low + part * (high - low) + np.float32(0.5)) << np.int32(8 * c)
    return color


@kernel
def take_reused(n, at, shader, lists, ints, colors, spans, counts, band):
    """Give the listed samples remembered colours; those without one stay in the list, whose length is returned."""
    left = np.uint64(0)
    counts[0] += np.int64(n)
    sets = shader.exact.shape[0]
    for i in range(n):
        x, z, offset = lists[X + i], lists[Z + i], lists[OFFSET + i]
        e = 0
        while e + 1 < sets and abs(shader.exact[e + 1] - offset) < abs(shader.exact[e] - offset):
            e += 1
        moved = (shader.exact[e] - offset) * shader.slide * (ONE - z)
        place = x + moved - at - np.float32(spans[0, e])
        first = np.floor(place)
        k, run = np.int64(first), np.int64(spans[1, e])
        a = np.uint64(ints[ADDRESS + i])
        if k < -1 or k >= run or run == 0:
            lists[U + left], lists[Z + left], lists[X + left] = lists[U + i], z, x
            lists[OFFSET + left], ints[ADDRESS + left] = offset, ints[ADDRESS + i]
            left += np.uint64(1)
            continue
        low, high = max(k, 0), min(k + 1, run - 1)
        base = np.int64(spans[2, e])
        color = mix(colors[base + low], colors[base + high], place - first)
        band[a] = (band[a] & ~COLOR_MASK) | (np.int64(color) & COLOR_MASK)
        counts[1] += np.int64(offset != shader.exact[e])
    return left


@kernel
def finish_list(n, at, shader, shading, segment, lists, ints, colors, spans, counts, band):
    """Colour the listed samples, reusing what can be reused."""
    material, side, geometry, gradient = shading
    if shader.exact.shape[0] > 0:
        n = take_reused(n, at, shader, lists, ints, colors, spans, counts, band)
    if n > np.uint64(0):
        shade(n, shader, material, side, geometry, gradient, segment, lists, ints)
        scatter(n, band, ints)
