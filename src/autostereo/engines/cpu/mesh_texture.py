"""Textures: mipmap pyramids and trilinear look-up (Williams 1983), levels of detail from exact derivatives."""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_light import log2_lanes
from .scalars import HALF, ONE, TINY, ZERO
from .simd import LANES, floor, greater, lesser, store

BYTE_SCALE = np.float32(1.0 / 255.0)


@inlined
def level_of_detail(offset, z, place, detail, size):
    """λ = log2 ρ of every sample, ρ the larger of the lengths of ∂(s, t)/∂x and ∂(s, t)/∂y in texels.

    detail[6:]: of 1/depth, s/depth and t/depth: numerators along x (3), along y at offset 0 (3) and per unit of
    offset (3), and the triangle's doubled area at offset 0 and per unit of offset.
    """
    zx, sx, tx, zy, sy, ty = detail[6], detail[7], detail[8], detail[9], detail[10], detail[11]
    zo, so, to, area, area_o = detail[12], detail[13], detail[14], detail[15], detail[16]
    (s, t), (width, height) = place, size
    scale = ONE / ((offset * area_o + area) * z)
    z_y, s_y, t_y = offset * zo + zy, offset * so + sy, offset * to + ty
    ax, bx = (s * -zx + sx) * scale * width, (t * -zx + tx) * scale * height
    ay, by = (s_y - s * z_y) * scale * width, (t_y - t * z_y) * scale * height
    square = greater(ax * ax + bx * bx, ay * ay + by * by)
    return log2_lanes(lesser(greater(square, TINY), np.float32(1e20))) * HALF


@inlined
def bilinear(texels, first, width, height, s, t):
    """Colour at (s, t) ∈ one period, (0, 0) the bottom left; texel centres at (i + ½)/size, wrapping round."""
    x = s * np.float32(width) - HALF
    y = (ONE - t) * np.float32(height) - HALF
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    i0, j0 = np.int64(x0), np.int64(y0)  # -1 … size - 1; of NaN far below 0
    i0, j0 = i0 if i0 >= 0 else width - 1, j0 if j0 >= 0 else height - 1
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
def texture_color(s, t, lod, texels, levels, top, lanes, k):
    """Trilinear colour of one sample into lanes[k], lanes[LANES + k], lanes[2·LANES + k].

    levels (L, 3): first texel, width, height; top: the last level.
    """
    lod = lod if lod > ZERO else ZERO  # NaN too, where a triangle is seen edge-on
    lod = min(lod, np.float32(top))
    fine = min(np.int64(lod), top)
    part = lod - np.float32(fine)
    r, g, b = bilinear(texels, levels[fine, 0], levels[fine, 1], levels[fine, 2], s, t)
    if part > ZERO:
        fine += 1
        r1, g1, b1 = bilinear(texels, levels[fine, 0], levels[fine, 1], levels[fine, 2], s, t)
        r, g, b = r + part * (r1 - r), g + part * (g1 - g), b + part * (b1 - b)
    k = np.uint64(k)
    lanes[k], lanes[k + np.uint64(LANES)], lanes[k + np.uint64(2 * LANES)] = r, g, b


@inlined
def texture_colors(seen, place, lod, texels, levels, top, lanes):
    """Trilinear colours of samples at (s, t) into lanes[:3·LANES], red, green, blue; of those whose bit is seen."""
    s, t = place
    store(lanes, 0, s - floor(s))
    store(lanes, LANES, t - floor(t))
    store(lanes, 2 * LANES, lod)
    for k in range(LANES):
        if seen >> k & 1:
            texture_color(lanes[k], lanes[LANES + k], lanes[2 * LANES + k], texels, levels, top, lanes, k)
