"""The triangles that meet one row of a block: what every draw of meshes does before it comes to samples.

Technique: edges are cut for LANES triangles at a time (SIMD over triangles), then segments are drawn one by one.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .mesh_raster import (
    P1,
    U1,
    X1,
    Z1,
    cut_triangles,
    fill_segment,
    fill_uv,
    row_geometry,
    uv_gradient,
)
from .mesh_shade import ANY, DIFFUSE, PLAIN
from .scalars import ZERO
from .simd import LANES, load, prefetch

AHEAD = 8  # triangles whose vertices are on their way while others are drawn


@inlined
def fetch_ahead(surface, entry, end):
    """Bring near what the triangles to come need: it lies scattered, and the cache is full of samples."""
    for k in range(entry + AHEAD, min(entry + AHEAD + LANES, end)):
        later = np.uint64(min(k + 2 * AHEAD, end - 1))
        prefetch(surface.triangles, np.uint64(surface.bins[later]) * np.uint64(8))
        index = np.uint64(surface.bins[np.uint64(k)]) * np.uint64(8)
        for c in range(np.uint64(3)):
            corner = np.uint64(surface.triangles[index + c])
            prefetch(surface.vertices, corner * np.uint64(3))
            prefetch(surface.attributes, corner * np.uint64(8 * surface.sides))


@inlined
def end_of(k, j, setup, ends):
    """Left (k = 0) or right end of segment j: (x, focal/depth, shift, perspective parameter, vertices of the edge)."""
    a, v = np.uint64(4 * LANES * k) + j, np.uint64(2 * LANES * k) + j
    return (
        setup[X1 + a], setup[Z1 + a], setup[P1 + a], setup[U1 + a],
        np.uint64(ends[v]), np.uint64(ends[np.uint64(LANES) + v]),
    )  # fmt: skip


@inlined
def only_plain(materials, m, shader):
    """What shades material m where all are PLAIN: known when kernels are compiled, so the rest is left out of them."""
    return PLAIN


@inlined
def only_diffuse(materials, m, shader):
    """What shades material m where all are DIFFUSE."""
    return DIFFUSE


@inlined
def any_kind(materials, m, shader):
    """What shades material m: PLAIN, DIFFUSE or ANY."""
    return shader.simple if materials[m, 6] != ZERO else ANY


@inlined
def draw_row(draw_segment, kind_of, place, span, row, bin_index, surface, camera, shader, sample, scratch):
    """Call draw_segment(place, ends, depths, kind, shader, shading, scratch) for every segment of a bin.

    kind_of: only_plain, only_diffuse or any_kind; span: least and greatest offset drawn; row: its number in the
    picture; sample = (x, y) of the sample in its pixel; ends, depths: see samples.hit; kind: PLAIN, DIFFUSE or ANY;
    shading: see mesh_shade.shade; attributes are in scratch.segment.
    """
    attributes, uv, lit, triangles = surface.attributes, surface.uv, surface.sides, surface.triangles
    materials, segment = surface.materials, scratch.segment
    setup, ends_of, detail = scratch.setup, scratch.ends, scratch.detail
    scale, sample_y = camera.fx / camera.focal, sample[1]
    end = surface.bin_start[bin_index + 1]
    for entry in range(surface.bin_start[bin_index], end, LANES):
        fetch_ahead(surface, entry, end)
        index, alive = load(surface.bins, entry), np.int32((1 << min(end - entry, LANES)) - 1)
        front, behind = cut_triangles(
            index, surface.vertices, triangles, row, sample_y, scale, span, setup, ends_of
        )
        front, behind = front & alive, behind & alive
        for j in range(np.uint64(LANES)):
            if ((front | behind) >> j) & 1 == 0:
                continue
            first = np.uint64(surface.bins[np.uint64(entry) + j]) * np.uint64(8)
            m = np.uint64(triangles[first + np.uint64(3)] >> 1)
            sides = 2 if materials[m, 4] != ZERO else 1
            material = (materials[m, 0], materials[m, 1], materials[m, 2], materials[m, 3], materials[m, 5])
            kind = kind_of(materials, m, shader)
            textured = kind == ANY and materials[m, 5] >= ZERO
            if kind == ANY:
                row_geometry(row + sample_y, camera, detail)
            corners = (
                np.uint64(triangles[first]),
                np.uint64(triangles[first + np.uint64(1)]),
                np.uint64(triangles[first + np.uint64(2)]),
            )
            if textured:
                uv_gradient(surface.vertices, uv, corners, camera, detail)
            for side in range(sides):
                if ((behind if side == 1 else front) >> j) & 1 == 0:
                    continue
                left, right = end_of(0, j, setup, ends_of), end_of(1, j, setup, ends_of)
                if side == 1:
                    left, right = right, left
                edges = ((left[3], left[4], left[5]), (right[3], right[4], right[5]))
                fill_segment(attributes, lit, side if lit == 2 else 0, edges[0], edges[1], segment)
                if textured:
                    fill_uv(uv, corners, edges[0], edges[1], segment)
                ends, depths = (left[0], left[2], right[0], right[2]), (left[1], right[1])
                draw_segment(place, ends, depths, kind, shader, (material, side, detail), scratch)
