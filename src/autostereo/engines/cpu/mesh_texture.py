"""Textures: mipmap pyramids and trilinear look-up (Williams 1983), levels of detail from exact derivatives."""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_shade import HALF, KB, KG, KR, LOD, OFFSET, ONE, TINY, TS, TT, ZERO, Z, log2_fast

BYTE_SCALE = np.float32(1.0 / 255.0)


@kernel
def level_of_detail(n, gradient, size, lists):
    """λ = log2 ρ of every sample, ρ the larger of the lengths of ∂(s, t)/∂x and ∂(s, t)/∂y in texels.

    `gradient`: of 1/depth, s/depth and t/depth: numerators along x (3), along y at offset 0 (3) and per unit of
    offset (3), and the triangle's doubled area at offset 0 and per unit of offset.
    """
    zx, sx, tx, zy, sy, ty, zo, so, to, area, area_o = gradient
    width, height = size
    for i in range(n):
        offset, s, t = lists[OFFSET + i], lists[TS + i], lists[TT + i]
        scale = ONE / ((area + offset * area_o) * lists[Z + i])
        z_y, s_y, t_y = zy + offset * zo, sy + offset * so, ty + offset * to
        ax, bx = (sx - s * zx) * scale * width, (tx - t * zx) * scale * height
        ay, by = (s_y - s * z_y) * scale * width, (t_y - t * z_y) * scale * height
        square = max(ax * ax + bx * bx, ay * ay + by * by)
        lists[LOD + i] = HALF * log2_fast(min(max(square, TINY), np.float32(1e20)))


@inlined
def bilinear(texels, first, width, height, s, t):
    """Colour at (s, t) ∈ one period, (0, 0) the bottom left; texel centres at (i + ½)/size, wrapping round."""
    x = s * np.float32(width) - HALF
    y = (ONE - t) * np.float32(height) - HALF
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    i0, j0 = np.int64(x0) % width, np.int64(y0) % height
    i1, j1 = i0 + 1 if i0 + 1 < width else 0, j0 + 1 if j0 + 1 < height else 0
    row0, row1 = first + j0 * width, first + j1 * width
    a, b = texels[np.uint64(row0 + i0)], texels[np.uint64(row0 + i1)]
    c, d = texels[np.uint64(row1 + i0)], texels[np.uint64(row1 + i1)]
    wa, wb = (ONE - fx) * (ONE - fy), fx * (ONE - fy)
    wc, wd = (ONE - fx) * fy, fx * fy
    m = np.uint32(255)
    e, f = np.uint32(8), np.uint32(16)
    red = wa * np.float32(a & m) + wb * np.float32(b & m) + wc * np.float32(c & m) + wd * np.float32(d & m)
    green = (
        wa * np.float32(a >> e & m)
        + wb * np.float32(b >> e & m)
        + wc * np.float32(c >> e & m)
        + wd * np.float32(d >> e & m)
    )
    blue = (
        wa * np.float32(a >> f & m)
        + wb * np.float32(b >> f & m)
        + wc * np.float32(c >> f & m)
        + wd * np.float32(d >> f & m)
    )
    return red * BYTE_SCALE, green * BYTE_SCALE, blue * BYTE_SCALE


@kernel
def modulate_by_texture(n, texels, texture, levels, top, lists):
    """Multiply the colour lists by the trilinear texture colour; levels (T, L, 3): first texel, width, height."""
    for i in range(n):
        s, t, lod = lists[TS + i], lists[TT + i], lists[LOD + i]
        s, t = s - np.floor(s), t - np.floor(t)
        lod = lod if lod > ZERO else ZERO  # NaN too, where a triangle is seen edge-on
        lod = min(lod, np.float32(top))
        fine = min(np.int64(lod), top)
        part = lod - np.float32(fine)
        r, g, b = bilinear(texels, levels[texture, fine, 0], levels[texture, fine, 1], levels[texture, fine, 2], s, t)
        if part > ZERO:
            k = fine + 1
            r1, g1, b1 = bilinear(texels, levels[texture, k, 0], levels[texture, k, 1], levels[texture, k, 2], s, t)
            r, g, b = r + part * (r1 - r), g + part * (g1 - g), b + part * (b1 - b)
        lists[KR + i] *= r
        lists[KG + i] *= g
        lists[KB + i] *= b
