"""Samples of a volume where rays cross a slice: scalars, gradients, light; and which stretches show anything.

All rays of all views of an image row lie in one plane, cut by slices of constant eye depth d_k, the same for all views
(Hübner 2007a, section 3.2). On a slice rows of the volume are straight, so a sample is found from its X alone. Runs
of 16 half voxels in which no block of voxels shows anything are left out; gradients are lit where something is seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, lean
from .scalars import exp2_fast, log2_fast
from .simd import adjacent
from .volume_setup import BLOCK, TABLE

CHUNK = 4  # log2 of samples in a run
SLABS = 16  # slabs between slices that are handled together
LIST = 272  # room for the samples that are handled at once
AT, EYE, PX, PY, PZ, VALUE, NX, NY, NZ, DIFFUSE, SHINE, LIGHT = (np.uint64(k * LIST) for k in range(12))
LIST_ROWS = 18
W0, W1, W2, W3, W4, W5, W6, W7 = (np.uint64(k * LIST) for k in range(8))
LAST_ROW = np.float32(TABLE - 1)
ZERO, ONE, TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-20)


class Cut(NamedTuple):
    """How a volume is cut by the slices.

    scalars, words, shape: see volume_setup; from_eye (3, 4) float64: index coordinates of (X, Y, depth, 1); halves (K,
    4): half-spaces in index space; shown: blocks; first, step: X where runs begin, and a sixteenth of a run; low,
    scale: what makes a scalar a row of the table; turn (3, 3) float32: of gradients, from object to eye space; lights:
    see scene_arrays.light_array; channels of light that samples get, and colours among them: diffuse, one or for each
    colour one, then as many for the highlight if there is one; neutral: diffuse light that leaves a colour as it is;
    shininess; lens: Y of the eyes; sobel: how gradients of isosurfaces are smoothed, see volume_setup.gradient_at.
    """

    scalars: np.ndarray
    words: np.ndarray
    shape: np.ndarray
    from_eye: np.ndarray
    halves: np.ndarray
    shown: np.ndarray
    first: float
    step: float
    low: float
    scale: float
    turn: np.ndarray
    lights: np.ndarray
    channels: int
    colors: int
    neutral: float
    shininess: float
    lens: float
    sobel: bool


class Planes(NamedTuple):
    """One thread's memory for the slices at hand.

    marks (slices, N) uint8: runs in which something shows; alive (N,) uint8: runs that are not yet hidden; chosen
    (LIST,) int32: rays that are lit; place (LIST,) int64, words int32, lists float32: scratch for samples.
    """

    marks: np.ndarray
    alive: np.ndarray
    chosen: np.ndarray
    place: np.ndarray
    words: np.ndarray
    lists: np.ndarray


@inlined
def on_slice(cut, row, depth):
    """Index coordinates of X = 0 on a slice; row = (slope of Y over depth, Y at the eyes)."""
    y = row[1] + depth * row[0]
    m = cut.from_eye
    return (
        m[0, 1] * y + m[0, 2] * depth + m[0, 3],
        m[1, 1] * y + m[1, 2] * depth + m[1, 3],
        m[2, 1] * y + m[2, 2] * depth + m[2, 3],
    )


@lean
def mark_runs(cut, row, slices, marks):
    """Mark the runs of every slice in which a block shows something.

    Returns how many are marked.
    """
    marked = 0
    runs = marks.shape[1]
    half = 0.5 * (1 << CHUNK) * cut.step
    m = cut.from_eye
    margin = (abs(m[0, 0]) * half + 1.0, abs(m[1, 0]) * half + 1.0, abs(m[2, 0]) * half + 1.0)
    nx, ny, nz = cut.shape[0], cut.shape[1], cut.shape[2]
    for k in range(slices.slabs + 1):
        x0, y0, z0 = on_slice(cut, row, slices.first + k * slices.distance)
        for c in range(runs):
            x = cut.first + (2 * c + 1) * half
            i, j, h = x0 + x * m[0, 0], y0 + x * m[1, 0], z0 + x * m[2, 0]
            inside = (
                (i > -margin[0])
                & (i < nx - 1 + margin[0])
                & (j > -margin[1])
                & (j < ny - 1 + margin[1])
                & (h > -margin[2])
                & (h < nz - 1 + margin[2])
            )
            shows = False
            if inside:
                i = min(max(i, 0.0), nx - 1.0001)
                j = min(max(j, 0.0), ny - 1.0001)
                h = min(max(h, 0.0), nz - 1.0001)
                shows = cut.shown[int(h) >> BLOCK, int(j) >> BLOCK, int(i) >> BLOCK] != 0
            marks[k, c] = np.uint8(shows)
            if shows:
                marked += 1
    return marked


@inlined
def locate(n, start, direction, shape, place, lists):
    """First of the eight voxels around n samples at start + AT·direction, clamped to the grid, and the parts beyond."""
    x, y, z = np.float32(start[0]), np.float32(start[1]), np.float32(start[2])
    dx, dy, dz = np.float32(direction[0]), np.float32(direction[1]), np.float32(direction[2])
    nx, ny = np.int64(np.int32(shape[0])), np.int32(shape[1])  # numbers of lines fit 32 bits, those of voxels may not
    ex, ey, ez = np.float32(shape[0] - 1), np.float32(shape[1] - 1), np.float32(shape[2] - 1)
    for i in range(n):
        t = lists[AT + i]
        u, v, w = min(max(x + t * dx, ZERO), ex), min(max(y + t * dy, ZERO), ey), min(max(z + t * dz, ZERO), ez)
        a, b, c = min(np.floor(u), ex - ONE), min(np.floor(v), ey - ONE), min(np.floor(w), ez - ONE)
        lists[PX + i], lists[PY + i], lists[PZ + i] = u - a, v - b, w - c
        line = np.int32(np.int32(c) * ny + np.int32(b))
        place[i] = np.int64(line) * nx + np.int64(np.int32(a))


@inlined
def bring(n, source, shape, place, words):
    """The eight voxels around n located samples, into rows of words: so that what follows is SIMD."""
    down, deep = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    for i in range(n):
        k = np.uint64(place[i])
        words[W0 + i], words[W1 + i] = source[k], source[k + np.uint64(1)]
        words[W2 + i], words[W3 + i] = source[k + down], source[k + down + np.uint64(1)]
        k += deep
        words[W4 + i], words[W5 + i] = source[k], source[k + np.uint64(1)]
        words[W6 + i], words[W7 + i] = source[k + down], source[k + down + np.uint64(1)]


@inlined
def trilinear(u, v, w, a, b, c, d, e, f, g, h):
    """Trilinear interpolation."""
    a, c, e, g = a + u * (b - a), c + u * (d - c), e + u * (f - e), g + u * (h - g)
    a, e = a + v * (c - a), e + v * (g - e)
    return a + w * (e - a)


@inlined
def part_of(word, shift, mask):
    """Some bits of a word. (Masked, so that SIMD stays in 32 bits.)"""
    return np.float32(np.int32((word >> shift) & mask))


@inlined
def interpolate_parts(n, shift, mask, row, words, lists):
    """Trilinear interpolation of some bits, with sign, of the words that were brought, into a row of lists."""
    middle = np.float32((mask + np.int32(1)) >> np.int32(1))
    for i in range(n):
        a, b = part_of(words[W0 + i], shift, mask), part_of(words[W1 + i], shift, mask)
        c, d = part_of(words[W2 + i], shift, mask), part_of(words[W3 + i], shift, mask)
        e, f = part_of(words[W4 + i], shift, mask), part_of(words[W5 + i], shift, mask)
        g, h = part_of(words[W6 + i], shift, mask), part_of(words[W7 + i], shift, mask)
        value = trilinear(lists[PX + i], lists[PY + i], lists[PZ + i], a, b, c, d, e, f, g, h)
        lists[row + i] = value - middle


@inlined
def interpolate_gradients(n, shifts, mask, words, lists):
    """Trilinear interpolation of the gradients in words that were brought."""
    interpolate_parts(n, np.int32(0), mask, NX, words, lists)
    interpolate_parts(n, shifts[0], mask, NY, words, lists)
    interpolate_parts(n, shifts[1], mask, NZ, words, lists)


@inlined
def bring_pairs(n, source, shape, place, words):
    """The eight scalars around n located samples, two neighbours in a word."""
    down, deep = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    for i in range(n):
        k = np.uint64(place[i])
        words[W0 + i], words[W1 + i] = np.int32(adjacent(source, k)), np.int32(adjacent(source, k + down))
        k += deep
        words[W2 + i], words[W3 + i] = np.int32(adjacent(source, k)), np.int32(adjacent(source, k + down))


@inlined
def interpolate_pairs(n, bits, mask, row, words, lists):
    """Trilinear interpolation of scalars brought in pairs, the second `bits` above the first, into a row of lists."""
    for i in range(n):
        first, second, third, fourth = words[W0 + i], words[W1 + i], words[W2 + i], words[W3 + i]
        a, b = part_of(first, np.int32(0), mask), part_of(first, bits, mask)
        c, d = part_of(second, np.int32(0), mask), part_of(second, bits, mask)
        e, f = part_of(third, np.int32(0), mask), part_of(third, bits, mask)
        g, h = part_of(fourth, np.int32(0), mask), part_of(fourth, bits, mask)
        lists[row + i] = trilinear(lists[PX + i], lists[PY + i], lists[PZ + i], a, b, c, d, e, f, g, h)


@inlined
def light_samples(n, cut, y, depth, lists):
    """Light on n samples at X = AT, of which lists hold the gradients in object space, into LIGHT and on.

    Both sides of a normal are lit alike: |N·L|, |N·H|; EYE: X of the eye that highlights are for.
    """
    m, row = cut.turn, np.uint64(LIST)
    py, pz = np.float32(y), np.float32(depth)
    for i in range(n):
        a, b, c = lists[NX + i], lists[NY + i], lists[NZ + i]
        u = m[0, 0] * a + m[0, 1] * b + m[0, 2] * c
        v = m[1, 0] * a + m[1, 1] * b + m[1, 2] * c
        w = m[2, 0] * a + m[2, 1] * b + m[2, 2] * c
        scale = ONE / np.sqrt(max(u * u + v * v + w * w, TINY))
        lists[NX + i], lists[NY + i], lists[NZ + i] = u * scale, v * scale, w * scale
    for f in range(cut.channels):
        first = LIGHT + np.uint64(f) * row
        for i in range(n):
            lists[first + i] = ZERO
    specular = cut.channels > cut.colors
    vy, vz, shininess = np.float32(cut.lens) - py, -pz, np.float32(cut.shininess)
    for k in range(cut.lights.shape[0]):
        lx, ly, lz = cut.lights[k, 1], cut.lights[k, 2], cut.lights[k, 3]
        p = cut.lights[k, 0]
        for i in range(n):
            at = lists[AT + i]
            tx, ty, tz = lx - p * at, ly - p * py, lz - p * pz
            scale = ONE / np.sqrt(max(tx * tx + ty * ty + tz * tz, TINY))
            lists[PX + i], lists[PY + i], lists[PZ + i] = tx * scale, ty * scale, tz * scale
        for i in range(n):
            lists[DIFFUSE + i] = abs(
                lists[NX + i] * lists[PX + i] + lists[NY + i] * lists[PY + i] + lists[NZ + i] * lists[PZ + i]
            )
        if specular:
            for i in range(n):
                vx = lists[EYE + i] - lists[AT + i]
                scale = ONE / np.sqrt(max(vx * vx + vy * vy + vz * vz, TINY))
                hx, hy, hz = lists[PX + i] + vx * scale, lists[PY + i] + vy * scale, lists[PZ + i] + vz * scale
                scale = ONE / np.sqrt(max(hx * hx + hy * hy + hz * hz, TINY))
                shine = abs(lists[NX + i] * hx + lists[NY + i] * hy + lists[NZ + i] * hz) * scale
                shine = exp2_fast(shininess * log2_fast(min(max(shine, TINY), ONE)))
                lists[SHINE + i] = shine if lists[DIFFUSE + i] > ZERO else ZERO
        for f in range(cut.colors):
            color, first = cut.lights[k, 4 + f], LIGHT + np.uint64(f) * row
            for i in range(n):
                lists[first + i] += color * lists[DIFFUSE + i]
            if specular:
                first += np.uint64(cut.colors) * row
                for i in range(n):
                    lists[first + i] += color * lists[SHINE + i]
    neutral = np.float32(cut.neutral)
    for f in range(cut.colors):
        first = LIGHT + np.uint64(f) * row
        for i in range(n):
            a, b, c = lists[NX + i], lists[NY + i], lists[NZ + i]
            lists[first + i] = lists[first + i] if a * a + b * b + c * c > np.float32(0.5) else neutral


@inlined
def scalar_points(n, cut, start, place, words, lists):
    """Scalars, as rows of the table, into VALUE, of n ≤ 256 samples at X = AT; start: see light_points."""
    m = cut.from_eye
    locate(n, start, (m[0, 0], m[1, 0], m[2, 0]), cut.shape, place, lists)
    bring_pairs(n, cut.scalars, cut.shape, place, words)
    if cut.scalars.itemsize == 1:  # as constants, for SIMD of 32 bits
        interpolate_pairs(n, np.int32(8), np.int32(255), VALUE, words, lists)
    else:
        interpolate_pairs(n, np.int32(16), np.int32(65535), VALUE, words, lists)
    low, scale = np.float32(cut.low), np.float32(cut.scale)
    for i in range(n):
        lists[VALUE + i] = min(max((lists[VALUE + i] - low) * scale, ZERO), LAST_ROW)


@inlined
def light_points(n, cut, y, depth, start, place, words, lists):
    """Light into LIGHT and on, of n ≤ 256 samples at X = AT, highlights for the eyes at EYE.

    start: index coordinates of X = 0 at this Y and depth (on_slice).
    """
    m = cut.from_eye
    locate(n, start, (m[0, 0], m[1, 0], m[2, 0]), cut.shape, place, lists)
    bring(n, cut.words, cut.shape, place, words)
    if cut.scalars.itemsize == 1:  # as constants, for SIMD of 32 bits
        interpolate_gradients(n, (np.int32(8), np.int32(16)), np.int32(255), words, lists)
    else:
        interpolate_gradients(n, (np.int32(10), np.int32(20)), np.int32(1023), words, lists)
    light_samples(n, cut, y, depth, lists)


@inlined
def any_marked(marks, k, first, last):
    """Whether a run of slice k between samples first … last is marked."""
    found = np.uint8(0)
    for c in range(max(first, 0) >> CHUNK, min(last >> CHUNK, marks.shape[1] - 1) + 1):
        found |= marks[k, c]
    return found != 0


@inlined
def keep_alive(low, high, cut, alive):
    """Note that something between X = low and high is not yet hidden."""
    runs, inverse = np.float64(alive.shape[0] << CHUNK), 1.0 / cut.step
    first = np.int64(min(max((low - cut.first) * inverse, 0.0), runs)) >> CHUNK
    last = np.int64(min(max((high - cut.first) * inverse, -16.0), runs)) >> CHUNK
    for c in range(max(first - 1, 0), min(last + 2, alive.shape[0])):
        alive[c] = np.uint8(1)


@lean
def hide_runs(first, last, planes):
    """Leave out runs of slices first … last that are hidden: those that are not alive."""
    for k in range(first, last + 1):
        for c in range(planes.alive.shape[0]):
            planes.marks[k, c] &= planes.alive[c]
