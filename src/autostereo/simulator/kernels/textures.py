"""Texture memory: filtered reads whose texels all go through the texture cache.

Texture coordinates, filtering and level of detail are those of the package's conventions: (0, 0) is the bottom left,
textures repeat, texel i of n has its centre at (i + ½)/n, λ = log2 of the longer footprint axis (OpenGL 4.6, 8.14.1).
Where a level alone decides (magnification, or the last level) its four texels are read, else eight.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .compiling import inlined, kernel
from .lru import HIT, touch

ACCESSES, MISSES, LOOKUPS = range(3)


class TextureMemory(NamedTuple):
    """All textures with their mip levels, and the cache before them.

    Attributes
    ----------
    texels : ndarray of shape (T, 4), uint8
        Row after row from the top, level after level, texture after texture.
    levels : ndarray of shape (levels of all, 6), int64
        Per level: first texel, width, height, first line, lines per row of blocks, log2 of (block width · 256 + height).
    textures : ndarray of shape (textures, 2), int64
        First level, number of levels.
    cache : Lru
    counts : ndarray of shape (3,), int64
        Texels read, cache misses, filtered look-ups.
    """

    texels: Any
    levels: Any
    textures: Any
    cache: Any
    counts: Any


@inlined
def read_texel(memory, level, column, row):
    """Index of a texel, after its line went through the cache."""
    shifts = level[5]
    line = level[3] + (row >> (shifts & 255)) * level[4] + (column >> (shifts >> 8))
    counts = memory.counts
    counts[ACCESSES] += 1
    if touch(memory.cache, line) != HIT:
        counts[MISSES] += 1
    return level[0] + row * level[1] + column


@inlined
def _wrap(i, n):
    """Index i of −1 … n into 0 … n − 1."""
    if i < 0:
        return i + n
    if i >= n:
        return i - n
    return i


@inlined
def add_bilinear(memory, number, u, v, share, out):
    """Add `share` times the bilinear colour of a level at (u, v) to out (4,)."""
    level = memory.levels[number]
    w, h = level[1], level[2]
    x = (u - math.floor(u)) * w - 0.5
    y = (v - math.floor(v)) * h - 0.5
    left, low = math.floor(x), math.floor(y)
    s, t = x - left, y - low
    x0, y0 = _wrap(np.int64(left), w), _wrap(np.int64(low), h)
    x1, y1 = _wrap(x0 + 1, w), _wrap(y0 + 1, h)
    r0, r1 = h - 1 - y0, h - 1 - y1
    a = read_texel(memory, level, x0, r0)
    b = read_texel(memory, level, x1, r0)
    c = read_texel(memory, level, x0, r1)
    d = read_texel(memory, level, x1, r1)
    texels = memory.texels
    for k in range(4):
        below = (1.0 - s) * texels[a, k] + s * texels[b, k]
        above = (1.0 - s) * texels[c, k] + s * texels[d, k]
        out[k] += share * ((1.0 - t) * below + t * above)


@kernel
def trilinear(memory, texture, u, v, dudx, dvdx, dudy, dvdy, out):
    """Colour 0…1 into out (4,), trilinearly filtered; the derivatives are those of (u, v) per pixel."""
    first, count = memory.textures[texture]
    w, h = memory.levels[first, 1], memory.levels[first, 2]
    rx = (dudx * w) ** 2 + (dvdx * h) ** 2
    ry = (dudy * w) ** 2 + (dvdy * h) ** 2
    rho = max(rx, ry)
    detail = 0.0
    if rho > 1.0:
        detail = min(0.5 * math.log2(rho), count - 1.0)
    lower = np.int64(detail)
    fraction = detail - lower
    memory.counts[LOOKUPS] += 1
    out[:4] = 0.0
    add_bilinear(memory, first + lower, u, v, (1.0 - fraction) / 255.0, out)
    if fraction > 0.0:
        add_bilinear(memory, first + lower + 1, u, v, fraction / 255.0, out)


@kernel
def compare_depth(memory, texture, u, v, depth):
    """Share of the four texels around (u, v) whose 32-bit value is ≥ `depth` (percentage-closer filtering).

    Reeves et al. 1987; the edge is clamped: a shadow map does not repeat. Weighted bilinearly.
    """
    level = memory.levels[memory.textures[texture, 0]]
    w, h = level[1], level[2]
    x = min(max(u, 0.0), 1.0) * w - 0.5
    y = min(max(v, 0.0), 1.0) * h - 0.5
    left, low = math.floor(x), math.floor(y)
    s, t = x - left, y - low
    memory.counts[LOOKUPS] += 1
    lit = 0.0
    for j in range(2):
        row = h - 1 - min(max(np.int64(low) + j, 0), h - 1)
        for i in range(2):
            column = min(max(np.int64(left) + i, 0), w - 1)
            texel = memory.texels[read_texel(memory, level, column, row)]
            value = (
                np.int64(texel[0]) << 24 | np.int64(texel[1]) << 16 | np.int64(texel[2]) << 8 | np.int64(texel[3])
            )
            weight = (s if i else 1.0 - s) * (t if j else 1.0 - t)
            if value >= depth:
                lit += weight
    return lit
