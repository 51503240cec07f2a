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

from .jit import inlined, kernel
from .mesh_shade import (
    KB,
    KG,
    KR,
    NX,
    NY,
    NZ,
    ONE,
    SB,
    SG,
    SR,
    TS,
    TT,
    ZERO,
    add_light,
    clear_sums,
    interpolate,
    locate,
    modulate,
    normalize_normals,
    pack,
    whole_steps,
)
from .mesh_texture import level_of_detail, modulate_by_texture

K = [np.uint64(k) for k in range(14)]
K0, K1, K2, K3, K4, K5, K12, K13 = K[0], K[1], K[2], K[3], K[4], K[5], K[12], K[13]


class Surface(NamedTuple):
    """Everything a raster kernel reads of the scene at one camera.

    vertices (N, 3) float64: x at the centre camera, y, focal/depth; attributes (N, 6 or 12) float32; uv (N, 2) float64;
    triangles (T, 6) int32: see mesh_setup.cull_and_count; bin_start (B + 1,), bins: triangles of each bin, in the order
    of faces; face_material (F,) int32; columns: attributes that a segment needs; materials (M, 8) float32: ambient,
    diffuse, specular, shininess, two-sided, texture or −1, plain (needs no list of samples), 0.
    """

    vertices: np.ndarray
    attributes: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    bin_start: np.ndarray
    bins: np.ndarray
    face_material: np.ndarray
    materials: np.ndarray
    columns: int


class Scratch(NamedTuple):
    """One thread's own memory: band of samples, segment ends, lists (mesh_shade), words of lanes, and as halves,
    sums of sub-samples; colours and spans of exact views, numbers of listed and reused samples (mesh_reuse)."""

    band: np.ndarray
    segment: np.ndarray
    lists: np.ndarray
    ints: np.ndarray
    words: np.ndarray
    halves: np.ndarray
    sums: np.ndarray
    colors: np.ndarray
    spans: np.ndarray
    counts: np.ndarray


class Shader(NamedTuple):
    """What `shade` reads besides the segment. (Arrays are taken out of tuples once per band: each time counts a
    reference, atomically.)

    lights (L, 8) float32 (scene_arrays.light_array); texels, texture_levels, level_count as in SceneArrays; own_eye
    1 or 0; point_lights: any; exact (E,) float32: offsets of exact views, none without reuse; slide: fx/focal.
    """

    lights: np.ndarray
    texels: np.ndarray
    texture_levels: np.ndarray
    level_count: np.ndarray
    per_sample: bool
    own_eye: np.float32
    point_lights: bool
    exact: np.ndarray
    slide: np.float32


@inlined
def edge_through(vertices, top, bottom):
    """An edge as `cut_edge` needs it.

    Always from the upper to the lower vertex, so that triangles sharing the edge cut it at the same bits.
    """
    x, y, z = vertices[top, 0], vertices[top, 1], vertices[top, 2]
    below = vertices[bottom, 2]
    per_row = 1.0 / (vertices[bottom, 1] - y)
    return x, y, z, (vertices[bottom, 0] - x) * per_row, (below - z) * per_row, per_row * below, top, bottom


@inlined
def cut_edge(edge, y, scale):
    """Where row y crosses an edge: x at the centre, focal/depth, shift per unit of offset, perspective parameter, ends.

    scale = fx/focal.
    """
    x, top, z, slope_x, slope_z, slope_u, a, b = edge
    down = y - top
    z = z + down * slope_z
    u = np.float32(down * slope_u) / np.float32(z)
    return np.float32(x + down * slope_x), np.float32(z), np.float32(scale * (1.0 - z)), u, a, b


@inlined
def fill_segment(attributes, left, right, first, columns, segment):
    """Attributes first … first + columns: at the left end in segment[:16], the difference to the right in [16:]."""
    u, a, b = left[3], left[4], left[5]
    w, c, d = right[3], right[4], right[5]
    for k in range(columns):
        start = attributes[a, first + k] + u * (attributes[b, first + k] - attributes[a, first + k])
        end = attributes[c, first + k] + w * (attributes[d, first + k] - attributes[c, first + k])
        segment[k] = start
        segment[16 + k] = end - start


@inlined
def fill_uv(uv, corners, left, right, segment):
    """Texture coordinates at both ends, less the triangle's own whole part (levels repeat up to ±4096 times)."""
    u, a, b = left[3], left[4], left[5]
    w, c, d = right[3], right[4], right[5]
    for k in range(2):
        base = np.floor(min(uv[corners[0], k], uv[corners[1], k], uv[corners[2], k]))
        start = uv[a, k] - base + u * (uv[b, k] - uv[a, k])
        end = uv[c, k] - base + w * (uv[d, k] - uv[c, k])
        segment[12 + k] = np.float32(start)
        segment[28 + k] = np.float32(end - start)


@inlined
def uv_gradient(v, uv, corners, camera):
    """Derivatives of 1/depth and uv/depth over the picture as functions of the offset; see level_of_detail."""
    a, b, c = corners[0], corners[1], corners[2]
    scale = camera.fx / camera.focal
    xb, xc = v[b, 0] - v[a, 0], v[c, 0] - v[a, 0]
    pb, pc = scale * (v[a, 2] - v[b, 2]), scale * (v[a, 2] - v[c, 2])
    yb, yc = v[b, 1] - v[a, 1], v[c, 1] - v[a, 1]
    s0 = np.floor(min(uv[a, 0], uv[b, 0], uv[c, 0]))
    t0 = np.floor(min(uv[a, 1], uv[b, 1], uv[c, 1]))
    zb, zc = v[b, 2] - v[a, 2], v[c, 2] - v[a, 2]
    sa, ta = (uv[a, 0] - s0) * v[a, 2], (uv[a, 1] - t0) * v[a, 2]
    sb, tb = (uv[b, 0] - s0) * v[b, 2] - sa, (uv[b, 1] - t0) * v[b, 2] - ta
    sc, tc = (uv[c, 0] - s0) * v[c, 2] - sa, (uv[c, 1] - t0) * v[c, 2] - ta
    return (
        np.float32(zb * yc - zc * yb),
        np.float32(sb * yc - sc * yb),
        np.float32(tb * yc - tc * yb),
        np.float32(zc * xb - zb * xc),
        np.float32(sc * xb - sb * xc),
        np.float32(tc * xb - tb * xc),
        np.float32(zc * pb - zb * pc),
        np.float32(sc * pb - sb * pc),
        np.float32(tc * pb - tb * pc),
        np.float32(xb * yc - xc * yb),
        np.float32(pb * yc - pc * yb),
    )


@kernel
def shade(n, shader, material, side, row, gradient, segment, lists, ints):
    """Colours of a list of samples of one segment, as RGBA bytes.

    material = (ambient, diffuse, specular, shininess, texture); row = what `locate` needs; gradient = uv_gradient.
    """
    ambient, diffuse, specular, shininess, texture = material
    listed = n
    n = whole_steps(n)
    interpolate(n, segment, K0, KR, lists)
    interpolate(n, segment, K1, KG, lists)
    interpolate(n, segment, K2, KB, lists)
    if texture >= ZERO:
        interpolate(n, segment, K12, TS, lists)
        interpolate(n, segment, K13, TT, lists)
        t = np.int64(texture)
        levels = shader.texture_levels
        level_of_detail(n, gradient, (np.float32(levels[t, 0, 1]), np.float32(levels[t, 0, 2])), lists)
        modulate_by_texture(listed, shader.texels, t, levels, shader.level_count[t] - 1, lists)
    if shader.per_sample:
        interpolate(n, segment, K3, NX, lists)
        interpolate(n, segment, K4, NY, lists)
        interpolate(n, segment, K5, NZ, lists)
        normalize_normals(n, ONE - np.float32(2 * side), lists)
        clear_sums(n, lists)
        if specular > ZERO or shader.point_lights:
            locate(n, row, lists)
        for k in range(shader.lights.shape[0]):
            add_light(n, k, shader.lights, (specular, shininess), (shader.own_eye, row[4]), lists)
        modulate(n, ambient, diffuse, specular, lists)
    else:
        interpolate(n, segment, K3, SR, lists)
        interpolate(n, segment, K4, SG, lists)
        interpolate(n, segment, K5, SB, lists)
    pack(n, lists, ints)


@inlined
def row_geometry(y, camera):
    """What `locate` needs to know of row y."""
    slope = (camera.centre_y - y) / camera.fy - camera.offset_y / camera.focal
    return (
        np.float32(1.0 / camera.fx),
        np.float32(camera.centre_x),
        np.float32(1.0 / camera.focal),
        np.float32(slope),
        np.float32(camera.offset_y),
        np.float32(camera.focal),
    )


@inlined
def rows_of(vertices, corners, sample_y, first_row, end_row):
    """Rows of first_row … end_row whose sample lies in top ≤ y < bottom of the triangle."""
    top = max(vertices[corners[0], 1] - sample_y, first_row - 1.0)
    bottom = min(vertices[corners[2], 1] - sample_y, end_row + 1.0)
    return max(int(np.ceil(top)), first_row), min(int(np.ceil(bottom)), end_row)
