"""Volumes in a stack of views: rows of the pictures, all views of a row at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_shade import exp2_fast, log2_fast
from .volume_rays import (
    B, BLOCK_ROWS, G, HALF, HALF_WAY, LEAVE, LENGTH, ONE, ORIGIN, R, RAYS, ROW, T, TURN, ZERO, march, ray_stretch,
)  # fmt: skip
from .volume_sample import SLABS, mark_runs, sample_slice
from .volume_shared import ALPHA, BLUE, GREEN, LINE, RED, SLAB_ROWS, blend_view, classify_slabs, clear_line

VIEWS_AT_ONCE = 8  # whose rays stay in cache
BYTE = np.float32(255.0)


class Ways(NamedTuple):
    """How a volume is drawn: table of slabs; material = (ambient, diffuse, specular); light = (channels, colours)."""

    table: tuple
    material: tuple
    light: tuple


@inlined
def start_rays(n, base, first, offset, camera, row, rays):
    """Rays through pixels first … of a view at a camera offset; LEAVE is set by the caller."""
    o = np.float32(offset)
    inverse, half = np.float32(1.0 / camera.fx), np.float32(camera.centre_x - 0.5 - first)
    turn, slope = np.float32(offset / camera.focal), np.float32(row[0] * row[0] + 1.0)
    for i in range(n):
        t = (np.float32(i) - half) * inverse - turn
        rays[base + ORIGIN + i] = o
        rays[base + TURN + i] = t
        rays[base + LENGTH + i] = np.sqrt(slope + t * t)
        rays[base + T + i] = ONE
        rays[base + R + i] = ZERO
        rays[base + G + i] = ZERO
        rays[base + B + i] = ZERO
        rays[base + HALF + i] = np.float32(np.inf)


@inlined
def over(front, through, behind):
    """A colour in front of a byte behind it, as a byte."""
    return np.uint8(min(max(front * BYTE + through * np.float32(behind) + HALF_WAY, ZERO), BYTE))


@inlined
def finish_rays(n, base, rays, color, depth):
    """Put what rays saw over the pixels color (n, 4), and the depth where they are half opaque before depth (n,)."""
    for i in range(n):
        through = rays[base + T + i]
        color[i, 0] = over(rays[base + R + i], through, color[i, 0])
        color[i, 1] = over(rays[base + G + i], through, color[i, 1])
        color[i, 2] = over(rays[base + B + i], through, color[i, 2])
        color[i, 3] = over(ONE - through, through, color[i, 3])
    for i in range(np.uint64(depth.shape[0])):
        depth[i] = min(depth[i], rays[base + HALF + i])


@kernel
def next_slices(cut, eye, row, slices, first, last, planes):
    """Sample the slices of slabs first … last; that of the slabs before is at hand unless first is 0."""
    begin = first
    if first > 0:
        planes.values[0] = planes.values[SLABS]
        begin = first + 1
    for k in range(begin, last + 1):
        sample_slice(cut, eye, row, slices, k, planes, k - first)


@kernel
def draw_rows(rows, cut, camera, slices, ways, offsets, together, own_eyes, wants_depth, planes, rays, packed, color, depth):
    """Draw rows (first, end) of every view, each along its own rays, over color (V, H, W, 4) and depth (V, H, W).

    So many views together use the same slices, lit for the eye of the first (own_eyes) or of the centre.
    """
    views, height, width, _ = color.shape
    blocks = -(-width // RAYS)
    far = slices.first + slices.slabs * slices.distance
    opaque = depth.shape[0] > 0
    for r in range(rows[0], rows[1]):
        slope = (camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal
        row = (slope, camera.offset_y)
        if mark_runs(cut, row, slices, planes.marks, planes.wanted) == 0:
            continue
        for v0 in range(0, views, together):
            v1, eye = min(v0 + together, views), offsets[v0] if own_eyes else 0.0
            for v in range(v0, v1):
                for b in range(blocks):
                    x, n = b * RAYS, np.uint64(min(RAYS, width - b * RAYS))
                    base = np.uint64(((v - v0) * blocks + b) * BLOCK_ROWS * ROW)
                    start_rays(np.uint64(RAYS), base, x, offsets[v], camera, row, rays)
                    for i in range(np.uint64(RAYS)):
                        rays[base + LEAVE + i] = np.float32(far)
                    if opaque:
                        for i in range(n):
                            rays[base + LEAVE + i] = min(np.float32(far), depth[v, r, x + i])
                    ray_stretch(np.uint64(RAYS), base, cut, row, slices.first, rays)
            for k in range(0, slices.slabs, SLABS):
                last = min(k + SLABS, slices.slabs)
                next_slices(cut, eye, row, slices, k, last, planes)
                for b in range((v1 - v0) * blocks):
                    base = np.uint64(b * BLOCK_ROWS * ROW)
                    n = np.uint64(RAYS)
                    args = (ways.table, ways.material, ways.light, wants_depth)
                    march(n, base, cut, slices, k, last, *args, planes, rays, packed)
            for v in range(v0, v1):
                for b in range(blocks):
                    x, n = b * RAYS, min(RAYS, width - b * RAYS)
                    base = np.uint64(((v - v0) * blocks + b) * BLOCK_ROWS * ROW)
                    line = depth[v, r, x : x + n] if wants_depth else depth[0, 0, :0] if opaque else np.empty(0, np.float32)
                    finish_rays(np.uint64(n), base, rays, color[v, r, x : x + n], line)


@inlined
def finish_line(width, offset, camera, row, t, line, color):
    """Put the sums of a view's pixels over color (W, 4), transmittance raised to the power of each ray's length."""
    inverse, half = np.float32(1.0 / camera.fx), np.float32(camera.centre_x - 0.5)
    turn, slope = np.float32(offset / camera.focal), np.float32(row[0] * row[0] + 1.0)
    for i in range(np.uint64(width)):
        a = (np.float32(i) - half) * inverse - turn
        through = line[t + ALPHA + i]
        oblique = exp2_fast(np.sqrt(slope + a * a) * log2_fast(max(through, np.float32(1e-30))))
        scale = (ONE - oblique) / max(ONE - through, np.float32(1e-6))
        line[t + RED + i] *= scale
        line[t + GREEN + i] *= scale
        line[t + BLUE + i] *= scale
        line[t + ALPHA + i] = oblique
    for i in range(width):
        k = np.uint64(i)
        through = line[t + ALPHA + k]
        color[i, 0] = over(line[t + RED + k], through, color[i, 0])
        color[i, 1] = over(line[t + GREEN + k], through, color[i, 1])
        color[i, 2] = over(line[t + BLUE + k], through, color[i, 2])
        color[i, 3] = over(ONE - through, through, color[i, 3])


@kernel
def draw_shared_rows(rows, cut, camera, slices, ways, offsets, planes, shared, rays, packed, line, color):
    """Draw rows (first, end) of every view from slabs that they share, over color (V, H, W, 4)."""
    views, height, width, _ = color.shape
    for r in range(rows[0], rows[1]):
        slope = (camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal
        row = (slope, camera.offset_y)
        if mark_runs(cut, row, slices, planes.marks, planes.wanted) == 0:
            continue
        for v in range(views):
            clear_line(np.uint64(width), np.uint64(v * SLAB_ROWS * LINE), line)
        for k in range(0, slices.slabs, SLABS):
            last = min(k + SLABS, slices.slabs)
            next_slices(cut, 0.0, row, slices, k, last, planes)
            args = (ways.table, ways.material, ways.light, planes, shared, rays, packed)
            classify_slabs(cut, camera, row, slices, k, last, *args)
            for v in range(views):
                blend_view(offsets[v], width, camera, slices, k, last, shared, v * SLAB_ROWS * LINE, line)
        for v in range(views):
            finish_line(width, offsets[v], camera, row, np.uint64(v * SLAB_ROWS * LINE), line, color[v, r])
