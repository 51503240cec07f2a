"""Shading of LANES samples of one segment (one triangle in one row) at a time.

Every colour is a direct function of (sample, camera offset): the same in single-pass, n-pass and panel draws.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_light import diffuse_light, full_light, locate, unit
from .mesh_texture import level_of_detail, texture_colors
from .scalars import BYTE, HALF, ONE, ZERO
from .simd import LANES, fused, lesser, load, load_eight, pack_bytes, splat, store, to_int

PLAIN, DIFFUSE, ANY = 0, 1, 2  # colours only; normals and directional lights; whatever a material may have


@inlined
def attribute(segment, k, u):
    """Attribute k at perspective parameter u; a segment is 8 attributes at its left end, then 8 differences."""
    return fused(u, segment[np.uint64(k + 8)], segment[np.uint64(k)])


@inlined
def to_byte(value):
    """⌊255·v + ½⌋ of values clamped to at most 1; of negative ones, something not above 0."""
    return to_int(fused(lesser(value, ONE), BYTE, splat(HALF)))


@inlined
def pack(r, g, b):
    """RGBA bytes."""
    return pack_bytes(to_byte(r), to_byte(g), to_byte(b))


@inlined
def to_levels(segment):
    """Turn a segment's attributes into levels of 0…255, with ½ added, so that a sample need not."""
    start, step = load_eight(segment, 0), load_eight(segment, 8)
    store(segment, 0, start * BYTE + HALF)
    store(segment, 8, step * BYTE)


@inlined
def level(segment, k, u):
    """Attribute k of a segment of levels, clamped to at most 255."""
    return to_int(lesser(attribute(segment, k, u), BYTE))


@inlined
def plain_color(u, segment):
    """Interpolated colour of a segment of levels as RGBA bytes."""
    return pack_bytes(level(segment, 0, u), level(segment, 1, u), level(segment, 2, u))


@inlined
def diffuse_color(u, shader, shading, segment):
    """Colour under directional lights without highlights, as RGBA bytes; see `shade`."""
    (ambient, diffuse, _, _, _), side, _ = shading
    lights, sign = shader.lights, ONE - np.float32(2 * side)
    x, y, z = unit(attribute(segment, 3, u), attribute(segment, 4, u), attribute(segment, 5, u))
    dr, dg, db = splat(ZERO), splat(ZERO), splat(ZERO)
    for k in range(lights.shape[0]):
        r, g, b = diffuse_light((x * sign, y * sign, z * sign), lights, k)
        dr, dg, db = dr + r, dg + g, db + b
    r, g, b = attribute(segment, 0, u), attribute(segment, 1, u), attribute(segment, 2, u)
    return pack(r * (dr * diffuse + ambient), g * (dg * diffuse + ambient), b * (db * diffuse + ambient))


@inlined
def lit(sample, normal, shader, highlight, row):
    """Sums of diffuse and of specular light; sample = (x, 1/depth, offset), highlight = (specular, shininess)."""
    (x, z, offset), lights = sample, shader.lights
    specular, shininess = highlight
    dr, dg, db = splat(ZERO), splat(ZERO), splat(ZERO)
    sr, sg, sb = splat(ZERO), splat(ZERO), splat(ZERO)
    place = locate(x, z, offset, row)
    eye = (offset * shader.own_eye, splat(row[4]))
    for k in range(lights.shape[0]):
        r, g, b, hr, hg, hb = full_light(normal, place, eye, lights, k, shininess)
        dr, dg, db = dr + r, dg + g, db + b
        sr, sg, sb = sr + hr, sg + hg, sb + hb
    return dr, dg, db, sr * specular, sg * specular, sb * specular


@kernel
def shade(seen, sample, u, shader, shading, segment, lanes):
    """Colours of samples as RGBA bytes, of those whose bit is seen.

    sample = (x, focal/depth, offset); u: perspective parameter in the segment; shading = (material, side, detail);
    material = (ambient, diffuse, specular, shininess, texture); detail: row_geometry, then uv_gradient; lanes: scratch.
    """
    (ambient, diffuse, specular, shininess, texture), side, detail = shading
    x, z, offset = sample
    r, g, b = attribute(segment, 0, u), attribute(segment, 1, u), attribute(segment, 2, u)
    if texture >= ZERO:
        t, levels = np.int64(texture), shader.texture_levels
        place = (attribute(segment, 6, u), attribute(segment, 7, u))
        size = (np.float32(levels[t, 0, 1]), np.float32(levels[t, 0, 2]))
        lod = level_of_detail(offset, z, place, detail, size)
        top = shader.level_count[t] - 1
        texture_colors(seen, place, lod, shader.texels, levels[t], top, lanes)
        r, g, b = r * load(lanes, 0), g * load(lanes, LANES), b * load(lanes, 2 * LANES)
    nx, ny, nz = attribute(segment, 3, u), attribute(segment, 4, u), attribute(segment, 5, u)
    if not shader.per_sample:
        return pack(r + nx, g + ny, b + nz)  # lit at the vertices: the other three are highlights
    nx, ny, nz = unit(nx, ny, nz)
    sign = ONE - np.float32(2 * side)
    row = (detail[0], detail[1], detail[2], detail[3], detail[4], detail[5])
    normal = (nx * sign, ny * sign, nz * sign)
    dr, dg, db, sr, sg, sb = lit((x, z, offset), normal, shader, (specular, shininess), row)
    r, g, b = r * (dr * diffuse + ambient), g * (dg * diffuse + ambient), b * (db * diffuse + ambient)
    return pack(r + sr, g + sg, b + sb)
