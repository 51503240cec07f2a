"""Texture memory: filtered reads whose texels all go through the texture cache.

Texture coordinates, filtering and level of detail are those of the package's conventions: (0, 0) is the bottom left,
textures repeat, texel i of n has its centre at (i + ½)/n, λ = log2 of the longer footprint axis (OpenGL 4.6, 8.14.1).
Where a level alone decides (magnification, or the last level) its four texels are read, else eight.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .channels import filtered
from .compiling import inlined
from .lru import HIT, touch

ACCESSES, MISSES, LOOKUPS = range(3)


class TextureMemory(NamedTuple):
    """All textures with their mip levels, and the cache before them.

    Attributes
    ----------
    texels : ndarray of shape (T, 4), uint8
        Row after row from the top, level after level, texture after texture.
    levels : ndarray of shape (levels of all, 6), int64
        Per level: first texel, width, height, first line, lines per row of blocks, log2 of (block width · 256 +
        height).
    textures : ndarray of shape (textures, 2), int64
        First level, number of levels.
    cache : Lru
    counts : ndarray of shape (3,), int64
        Texels read, cache misses, filtered look-ups.
    colors : ndarray of shape (4, 4), float64
        For shaders: where look-ups may put what they find.
    """

    texels: Any
    levels: Any
    textures: Any
    cache: Any
    counts: Any
    colors: Any


@inlined
def _use_line(memory, line):
    if touch(memory.cache, line) != HIT:
        memory.counts[MISSES] += 1


@inlined
def _use_four(memory, number, x0, x1, r0, r1):
    """Four texels of a level go through the cache: row by row if both columns lie in one block, else column by column.

    So a line that is used twice in a row is looked up once, which no cache can tell apart from twice.
    """
    levels = memory.levels
    shifts = levels[number, 5]
    across, down = shifts >> 8, shifts & 255
    first, pitch = levels[number, 3], levels[number, 4]
    upper, lower = first + (r0 >> down) * pitch, first + (r1 >> down) * pitch
    left, right = x0 >> across, x1 >> across
    memory.counts[ACCESSES] += 4
    _use_line(memory, upper + left)
    if left == right:
        if upper != lower:
            _use_line(memory, lower + left)
    elif upper == lower:
        _use_line(memory, upper + right)
    else:
        _use_line(memory, lower + left)
        _use_line(memory, upper + right)
        _use_line(memory, lower + right)


@inlined
def _wrap(i, n):
    """Index i of −1 … n into 0 … n − 1."""
    if i < 0:
        return i + n
    if i >= n:
        return i - n
    return i


@inlined
def _bilinear(memory, number, u, v):
    """The four channels 0…255 of a level at (u, v)."""
    w, h = memory.levels[number, 1], memory.levels[number, 2]
    x = (u - math.floor(u)) * w - 0.5
    y = (v - math.floor(v)) * h - 0.5
    left, low = math.floor(x), math.floor(y)
    s, t = x - left, y - low
    x0, y0 = _wrap(np.int64(left), w), _wrap(np.int64(low), h)
    x1, y1 = _wrap(x0 + 1, w), _wrap(y0 + 1, h)
    r0, r1 = h - 1 - y0, h - 1 - y1
    _use_four(memory, number, x0, x1, r0, r1)
    texels, start = memory.texels, memory.levels[number, 0]
    a, b = start + r0 * w + x0, start + r0 * w + x1
    c, d = start + r1 * w + x0, start + r1 * w + x1
    return filtered(texels, a, b, c, d, s, t)


@inlined
def trilinear(memory, texture, u, v, dudx, dvdx, dudy, dvdy, out):
    """Colour 0…1 into out (4,), trilinearly filtered; the derivatives are those of (u, v) per pixel."""
    first, count = memory.textures[texture, 0], memory.textures[texture, 1]
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
    red, green, blue, alpha = _bilinear(memory, first + lower, u, v)
    if fraction > 0.0:
        near = 1.0 - fraction
        r, g, b, a = _bilinear(memory, first + lower + 1, u, v)
        red, green = near * red + fraction * r, near * green + fraction * g
        blue, alpha = near * blue + fraction * b, near * alpha + fraction * a
    out[0], out[1], out[2], out[3] = red / 255.0, green / 255.0, blue / 255.0, alpha / 255.0


@inlined
def compare_depth(memory, texture, u, v, depth):
    """Share of the four texels around (u, v) whose 32-bit value is ≤ `depth` (percentage-closer filtering).

    Reeves et al. 1987; the edge is clamped: a shadow map does not repeat. Weighted bilinearly.
    """
    number = memory.textures[texture, 0]
    w, h = memory.levels[number, 1], memory.levels[number, 2]
    x = min(max(u, 0.0), 1.0) * w - 0.5
    y = min(max(v, 0.0), 1.0) * h - 0.5
    left, low = math.floor(x), math.floor(y)
    s, t = x - left, y - low
    memory.counts[LOOKUPS] += 1
    x0, x1 = min(max(np.int64(left), 0), w - 1), min(max(np.int64(left) + 1, 0), w - 1)
    r0, r1 = h - 1 - min(max(np.int64(low), 0), h - 1), h - 1 - min(max(np.int64(low) + 1, 0), h - 1)
    _use_four(memory, number, x0, x1, r0, r1)
    lit = 0.0
    for corner in range(4):
        row, column = r0 if corner < 2 else r1, x0 if corner % 2 == 0 else x1
        texel = memory.levels[number, 0] + row * w + column
        value = np.int64(0)
        for k in range(4):
            value = value << 8 | np.int64(memory.texels[texel, k])
        if value <= depth:
            lit += (1.0 - s if corner % 2 == 0 else s) * (1.0 - t if corner < 2 else t)
    return lit
