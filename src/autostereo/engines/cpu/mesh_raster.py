"""Segments: where a triangle meets an image row, in every view at once.

Technique. All cameras lie in the plane of an image row, so a triangle meets a row in one segment that is the same
3-D line in every view. Its ends lie at x1 + o·p1 and x2 + o·p2 for camera offset o, and inverse depth and
attributes at the ends do not depend on the view (Halle 1998 draws such lines as epipolar-plane images).

What decides coverage and depth is evaluated directly from (row, x, offset) in float32, never accumulated:
covered when x1 + o·p1 ≤ x < x2 + o·p2; t = (x − x1 − o·p1)/(x2 − x1 + o·(p2 − p1)); 1/depth = z1 + t·(z2 − z1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined
from .scalars import ZERO
from .simd import LANES, gather, load_eight, mask_word, select, splat, store, to_float

X1, Z1, P1, U1, X2, Z2, P2, U2 = (np.uint64(LANES * k) for k in range(8))
TEXTURE = 6  # attributes: the first lane of texture coordinates
APART = np.float32(1e-2)  # pixels: rounding moves the ends of a segment by less


class Surface(NamedTuple):
    """Everything a raster kernel reads of the scene at one camera.

    vertices (N·3,) float64: x at the centre camera, y, focal/depth; attributes (N·S·8,) float32: of each of the S sides
    lit, see mesh_setup; uv (N, 2) float64; triangles (T·8,) int32: see mesh_setup.cull_and_count; bin_start (B + 1,),
    bins: triangles of each row and block of columns, in the
    order of faces; sides: S; materials (M, 8) float32:
    ambient, diffuse, specular, shininess, two-sided, texture or −1, plain (only colours), 0.
    """

    vertices: np.ndarray
    attributes: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    bin_start: np.ndarray
    bins: np.ndarray
    materials: np.ndarray
    sides: int


class Scratch(NamedTuple):
    """One thread's own memory.

    band: samples, and the same as 32-bit halves; segment (16,) float32: attributes at the left end, then differences;
    ints: addresses of samples at hand; words (2·LANES,), and as halves: samples at hand; lanes (3·LANES,) float32 and
    chosen (LANES,) int32: of samples; detail (17,) float32: row_geometry, then uv_gradient; setup, ends: see
    cut_triangles; sums of sub-samples; colours and spans of exact views, numbers of listed and reused samples
    (mesh_reuse).
    """

    band: np.ndarray
    halves: np.ndarray
    segment: np.ndarray
    ints: np.ndarray
    words: np.ndarray
    word_halves: np.ndarray
    lanes: np.ndarray
    chosen: np.ndarray
    detail: np.ndarray
    setup: np.ndarray
    ends: np.ndarray
    sums: np.ndarray
    colors: np.ndarray
    spans: np.ndarray
    counts: np.ndarray


class Shader(NamedTuple):
    """What shading reads besides the segment. (Arrays are taken out of tuples once per band: each time counts a
    reference, atomically.)

    lights (L, 8) float32 (scene_arrays.light_array); texels, texture_levels, level_count as in SceneArrays; own_eye
    1 or 0; simple: what shades plain materials, DIFFUSE where there are but directional lights, and no reuse; exact
    (E,) float32: offsets of exact views, none without reuse; slide: fx/focal.
    """

    lights: np.ndarray
    texels: np.ndarray
    texture_levels: np.ndarray
    level_count: np.ndarray
    per_sample: bool
    own_eye: np.float32
    simple: int
    exact: np.ndarray
    slide: np.float32


@inlined
def cut_edge(top, bottom, y, scale):
    """Where row y crosses LANES edges: x at the centre, focal/depth, shift per unit of offset, perspective parameter.

    top, bottom: (x, y, focal/depth) of the vertices, float64; scale = fx/focal. Always from the upper to the lower
    vertex, so that triangles sharing the edge cut it at the same bits.
    """
    (x, y0, z), (below_x, below_y, below_z) = top, bottom
    per_row = splat(1.0) / (below_y - y0)
    down = splat(y) - y0
    z_here = z + down * ((below_z - z) * per_row)
    u = to_float(down * (per_row * below_z)) / to_float(z_here)
    here = x + down * ((below_x - x) * per_row)
    return to_float(here), to_float(z_here), to_float((splat(1.0) - z_here) * scale), u


@inlined
def corner_of(vertices, corner):
    """(x, y, focal/depth) of LANES vertices; `vertices` is flat."""
    first = corner * np.int32(3)
    return gather(vertices, first), gather(vertices, first + np.int32(1)), gather(vertices, first + np.int32(2))


@inlined
def choose(mask, a, b):
    """Vertices of `a` where the mask holds, else of `b`."""
    return select(mask, a[0], b[0]), select(mask, a[1], b[1]), select(mask, a[2], b[2])


@inlined
def cut_triangles(index, vertices, triangles, row, sample_y, scale, span, setup, ends):
    """The segments of LANES triangles in one row; returns the bits of those seen from the front, and from behind.

    setup (8·LANES,) float32: X1, Z1, P1, U1 of the left ends, then of the right ends, in rows of LANES; ends
    (4·LANES,) int32: upper and lower vertex of the left, then of the right edge. A triangle that all offsets in `span`
    see from the other side, or whose rows do not hold the sample, has no bit.
    """
    first = index * np.int32(8)
    a, b, c = gather(triangles, first), gather(triangles, first + np.int32(1)), gather(triangles, first + np.int32(2))
    mirrored = (gather(triangles, first + np.int32(3)) & np.int32(1)) == np.int32(0)
    top, middle, bottom = corner_of(vertices, a), corner_of(vertices, b), corner_of(vertices, c)
    y, at = row + sample_y, np.float64(row)
    inside = (splat(at) >= top[1] - sample_y) & (splat(at) < bottom[1] - sample_y)
    upper = splat(y) < middle[1]
    xl, zl, pl, ul = cut_edge(top, bottom, y, scale)
    xr, zr, pr, ur = cut_edge(choose(upper, top, middle), choose(upper, middle, bottom), y, scale)
    d, e = select(upper, a, b), select(upper, b, c)
    store(setup, X1, select(mirrored, xr, xl))
    store(setup, Z1, select(mirrored, zr, zl))
    store(setup, P1, select(mirrored, pr, pl))
    store(setup, U1, select(mirrored, ur, ul))
    store(setup, X2, select(mirrored, xl, xr))
    store(setup, Z2, select(mirrored, zl, zr))
    store(setup, P2, select(mirrored, pl, pr))
    store(setup, U2, select(mirrored, ul, ur))
    store(ends, 0, select(mirrored, d, a))
    store(ends, LANES, select(mirrored, e, c))
    store(ends, 2 * LANES, select(mirrored, a, d))
    store(ends, 3 * LANES, select(mirrored, c, e))
    wide, shift = xr - xl, pr - pl
    wide, shift = select(mirrored, splat(ZERO) - wide, wide), select(mirrored, splat(ZERO) - shift, shift)
    low, high = wide + shift * span[0], wide + shift * span[1]
    front = inside & ((low >= -APART) | (high >= -APART))
    behind = inside & ((low <= APART) | (high <= APART))
    return mask_word(front), mask_word(behind)


@inlined
def fill_segment(attributes, sides, side, left, right, segment):
    """Attributes at the left end in segment[:8], the difference to the right in [8:]; left, right: (u, vertices)."""
    step, first = np.uint64(8 * sides), np.uint64(8 * side)
    start = load_eight(attributes, left[1] * step + first)
    start = start + (load_eight(attributes, left[2] * step + first) - start) * left[0]
    end = load_eight(attributes, right[1] * step + first)
    end = end + (load_eight(attributes, right[2] * step + first) - end) * right[0]
    store(segment, 0, start)
    store(segment, 8, end - start)


@inlined
def fill_uv(uv, corners, left, right, segment):
    """Texture coordinates at both ends, less the triangle's own whole part (levels repeat up to ±4096 times)."""
    (u, a, b), (w, c, d) = left, right
    for k in range(2):
        base = np.floor(min(uv[corners[0], k], uv[corners[1], k], uv[corners[2], k]))
        start = uv[a, k] - base + u * (uv[b, k] - uv[a, k])
        end = uv[c, k] - base + w * (uv[d, k] - uv[c, k])
        segment[TEXTURE + k] = np.float32(start)
        segment[8 + TEXTURE + k] = np.float32(end - start)


@inlined
def uv_gradient(vertices, uv, corners, camera, detail):
    """Derivatives of 1/depth and uv/depth over the picture as functions of the offset into detail[6:17].

    See level_of_detail.
    """
    a, b, c = corners[0], corners[1], corners[2]
    v, scale = vertices.reshape(-1, 3), camera.fx / camera.focal
    xb, xc = v[b, 0] - v[a, 0], v[c, 0] - v[a, 0]
    pb, pc = scale * (v[a, 2] - v[b, 2]), scale * (v[a, 2] - v[c, 2])
    yb, yc = v[b, 1] - v[a, 1], v[c, 1] - v[a, 1]
    s0 = np.floor(min(uv[a, 0], uv[b, 0], uv[c, 0]))
    t0 = np.floor(min(uv[a, 1], uv[b, 1], uv[c, 1]))
    zb, zc = v[b, 2] - v[a, 2], v[c, 2] - v[a, 2]
    sa, ta = (uv[a, 0] - s0) * v[a, 2], (uv[a, 1] - t0) * v[a, 2]
    sb, tb = (uv[b, 0] - s0) * v[b, 2] - sa, (uv[b, 1] - t0) * v[b, 2] - ta
    sc, tc = (uv[c, 0] - s0) * v[c, 2] - sa, (uv[c, 1] - t0) * v[c, 2] - ta
    detail[6], detail[7], detail[8] = zb * yc - zc * yb, sb * yc - sc * yb, tb * yc - tc * yb
    detail[9], detail[10], detail[11] = zc * xb - zb * xc, sc * xb - sb * xc, tc * xb - tb * xc
    detail[12], detail[13], detail[14] = zc * pb - zb * pc, sc * pb - sb * pc, tc * pb - tb * pc
    detail[15], detail[16] = xb * yc - xc * yb, pb * yc - pc * yb


@inlined
def row_geometry(y, camera, detail):
    """What `locate` needs to know of row y into detail[:6]."""
    detail[0] = 1.0 / camera.fx
    detail[1] = camera.centre_x
    detail[2] = 1.0 / camera.focal
    detail[3] = (camera.centre_y - y) / camera.fy - camera.offset_y / camera.focal
    detail[4] = camera.offset_y
    detail[5] = camera.focal
