"""Shading reuse: Hasselgren 2006, section 4.3, in software (`shading="reuse"`).

The cameras are divided into sets of neighbours. Of each set one view is exact: it shades its samples of a segment, all
of them, and remembers the colours. A sample of another view is looked up at its place in the exact view of its set:
between two remembered colours it is interpolated, beside one it takes that one, and where there is none (the triangle
is not seen there) it is shaded afresh. Coverage and depth stay exact everywhere.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_shade import DIFFUSE, diffuse_color, shade
from .samples import hit
from .scalars import ONE, ZERO
from .simd import LANES, fused, iota, lane, load, splat, store, to_float

VIEWS_PER_SET = 8
ALL = np.int32(-1)  # every sample is seen


def exact_offsets(offsets):
    """Camera offsets (E,) float32 of the exact views: the middle one of every set of neighbours among (V,)."""
    sets = np.array_split(np.asarray(offsets), max(1, -(-len(offsets) // VIEWS_PER_SET)))
    return np.array([part[len(part) // 2] for part in sets], dtype=np.float32)


@inlined
def shade_exact(ends, depths, at, width, shader, shading, scratch):
    """Shade the segment in every exact view; scratch.colors[place + k] is that of pixel start + k.

    spans (3, E) int32 become start, number and place of each view's pixels.
    """
    spans, colors = scratch.spans, scratch.colors
    x1, p1, x2, p2 = ends
    filled = np.int32(0)
    for e in range(shader.exact.shape[0]):
        offset = shader.exact[e]
        left, right = lane(fused(splat(offset), p1, x1), 0), lane(fused(splat(offset), p2, x2), 0)  # as in `hit`
        start = np.int32(np.ceil(min(max(left - at, ZERO), width)))
        end = np.int32(np.ceil(min(max(right - at, ZERO), width)))
        spans[0, e], spans[1, e], spans[2, e] = start, max(end - start, np.int32(0)), filled
        for k in range(0, spans[1, e], LANES):
            x = (to_float(iota()) + np.float32(start + np.int32(k))) + at
            offsets = splat(offset)
            _, z, u = hit(x, offsets, ends, depths)
            color = shade(ALL, (x, z, offsets), u, shader, shading, scratch.segment, scratch.lanes)
            store(colors, filled + np.int32(k), color)
        filled += spans[1, e]


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
def take_reused(seen, at, shader, lanes, chosen, colors, spans, counts):
    """Give those samples whose bit is seen remembered colours; returns the bits of those without one.

    lanes: x, 1/depth and offset of the samples.
    """
    left = np.int32(0)
    sets = shader.exact.shape[0]
    for i in range(LANES):
        if not seen >> i & 1:
            continue
        x, z, offset = lanes[i], lanes[LANES + i], lanes[2 * LANES + i]
        counts[0] += 1
        e = 0
        while e + 1 < sets and abs(shader.exact[e + 1] - offset) < abs(shader.exact[e] - offset):
            e += 1
        moved = (shader.exact[e] - offset) * shader.slide * (ONE - z)
        place = x + moved - at - np.float32(spans[0, e])
        first = np.floor(place)
        k, run = np.int64(first), np.int64(spans[1, e])
        if k < -1 or k >= run or run == 0:
            left |= np.int32(1 << i)
            continue
        low, high = max(k, 0), min(k + 1, run - 1)
        base = np.int64(spans[2, e])
        chosen[i] = mix(colors[base + low], colors[base + high], place - first)
        counts[1] += np.int64(offset != shader.exact[e])
    return left


@inlined
def shade_or_reuse(kind, reuse, seen, sample, u, at, shader, shading, scratch):
    """Colours of those samples whose bit is seen: remembered where there are, else shaded."""
    if not reuse:
        if kind == DIFFUSE:
            return diffuse_color(u, shader, shading, scratch.segment)
        return shade(seen, sample, u, shader, shading, scratch.segment, scratch.lanes)
    x, z, offset = sample
    store(scratch.lanes, 0, x)
    store(scratch.lanes, LANES, z)
    store(scratch.lanes, 2 * LANES, offset)
    chosen = scratch.chosen
    left = take_reused(seen, at, shader, scratch.lanes, chosen, scratch.colors, scratch.spans, scratch.counts)
    if left != 0:
        color = shade(left, sample, u, shader, shading, scratch.segment, scratch.lanes)
        for i in range(LANES):
            if left >> i & 1:
                chosen[i] = lane(color, i)
    return load(chosen, 0)
