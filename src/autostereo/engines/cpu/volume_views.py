"""Volumes in a stack of views: rows of the pictures, all views of a row at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .volume_modes import NONE, march_iso, march_mip, resolve_iso, resolve_mip
from .volume_rays import (
    B, BLOCK_ROWS, END, G, HALF, HALF_WAY, LENGTH, ONE, OPAQUE, ORIGIN, R, RAYS, ROW, T, TURN, ZERO,
    block_bounds, march, ray_stretch,
)  # fmt: skip
from .volume_sample import SLABS, hide_runs, keep_alive, mark_runs, sample_slice
from .volume_shared import ALPHA, BLUE, GREEN, LINE, RED, SLAB_ROWS, blend_view, classify_slabs, clear_line, even_out

COMPOSITE, MIP, ISO = 0, 1, 2
VIEWS_AT_ONCE = 8  # whose rays stay in cache
BYTE = np.float32(255.0)


class Ways(NamedTuple):
    """How volumes are drawn.

    mode: COMPOSITE, MIP or ISO; table: pre-integrated slabs; material = (ambient, diffuse, specular); light =
    (channels, colours); colors: of all levels for MIP, in the first row that of an isosurface; level: of the surface,
    as a row of the table; shade; own_eyes: highlights for a ray's own eye, not the centre's.
    """

    mode: int
    table: tuple
    material: tuple
    light: tuple
    colors: np.ndarray
    level: float
    shade: bool
    own_eyes: bool


@inlined
def clear_rays(n, base, mode, rays):
    """Rays that have seen nothing yet."""
    for i in range(n):
        rays[base + T + i] = ONE
        rays[base + R + i] = NONE if mode == MIP else ZERO
        rays[base + G + i] = ZERO
        rays[base + B + i] = ZERO
        rays[base + HALF + i] = np.float32(np.inf)


@kernel
def march_volumes(blocks, cuts, row, slices, k, last, ways, wants_half, planes, rays, packed):
    """Take blocks of rays through slabs k … last of all volumes, whose slices are at hand; see draw_rows."""
    n = np.uint64(RAYS)
    for v in range(len(cuts)):
        cut, way = cuts[v], ways[v]
        for b in range(blocks):
            base = np.uint64(b * BLOCK_ROWS * ROW)
            if k == 0 or len(cuts) > 1:
                ray_stretch(n, base, cut, row, slices.first, rays)
            if way.mode == MIP:
                march_mip(n, base, cut, slices, k, last, planes[v], rays, packed)
            elif way.mode == ISO:
                march_iso(n, base, cut, slices, k, last, way.level, planes[v], rays, packed)
            else:
                args = (way.table, way.material, way.light, wants_half)
                march(n, base, cut, slices, k, last, *args, planes[v], rays, packed)


@kernel
def hide_behind_rays(blocks, cut, slices, k, last, mode, planes, rays):
    """Leave out what all rays have seen enough before, in the slices of slabs k … last."""
    n, near, far = np.uint64(RAYS), slices.first + k * slices.distance, slices.first + last * slices.distance
    planes.alive[:] = np.uint8(0)
    for b in range(blocks):
        base = np.uint64(b * BLOCK_ROWS * ROW)
        most = ZERO
        for i in range(n):
            through = rays[base + T + i] if mode == COMPOSITE else (ONE if rays[base + HALF + i] > far else ZERO)
            most = max(most, through)
        if most >= OPAQUE:
            low, high, least, steepest = block_bounds(n, base, rays)
            left, right = low + min(near * least, far * least), high + max(near * steepest, far * steepest)
            keep_alive(left, right, cut, planes.alive)
    hide_runs(k, last, planes)


@kernel
def resolve_rays(blocks, cut, row, slices, way, rays):
    """Turn what rays found into colours, where that is not done on the way."""
    for b in range(blocks):
        base = np.uint64(b * BLOCK_ROWS * ROW)
        if way.mode == MIP:
            resolve_mip(np.uint64(RAYS), base, way.colors, rays)
        elif way.mode == ISO:
            color = (np.float64(way.colors[0, 0]), np.float64(way.colors[0, 1]), np.float64(way.colors[0, 2]))
            args = (way.level, color, way.material, way.shade, way.own_eyes)
            resolve_iso(RAYS, base, cut, row, slices, *args, rays)


@inlined
def start_rays(n, base, first, offset, camera, row, rays):
    """Rays through pixels first … of a view at a camera offset."""
    o = np.float32(offset)
    inverse, half = np.float32(1.0 / camera.fx), np.float32(camera.centre_x - 0.5 - first)
    turn, slope = np.float32(offset / camera.focal), np.float32(row[0] * row[0] + 1.0)
    for i in range(n):
        t = (np.float32(i) - half) * inverse - turn
        rays[base + ORIGIN + i] = o
        rays[base + TURN + i] = t
        rays[base + LENGTH + i] = np.sqrt(slope + t * t)


@inlined
def over(front, through, behind):
    """A colour in front of a byte behind it, as a byte."""
    return np.uint8(min(max(front * BYTE + through * np.float32(behind) + HALF_WAY, ZERO), BYTE))


@inlined
def finish_rays(n, base, rays, color):
    """Put what rays saw over the pixels color (n, 4)."""
    for i in range(n):
        through = rays[base + T + i]
        color[i, 0] = over(rays[base + R + i], through, color[i, 0])
        color[i, 1] = over(rays[base + G + i], through, color[i, 1])
        color[i, 2] = over(rays[base + B + i], through, color[i, 2])
        color[i, 3] = over(ONE - through, through, color[i, 3])


@kernel
def next_slices(cut, eye, row, slices, first, last, chunk, planes):
    """Sample the slices of slabs first … last; that of the slabs before is at hand unless first is 0."""
    begin = first
    if first > 0:
        planes.values[0] = planes.values[chunk]
        begin = first + 1
    for k in range(begin, last + 1):
        sample_slice(cut, eye, row, slices, k, planes, k - first)


@kernel
def mark_volumes(cuts, row, slices, planes):
    """Mark the runs of all volumes; returns how many there are."""
    marked = 0
    for v in range(len(cuts)):
        marked += mark_runs(cuts[v], row, slices, planes[v].marks, planes[v].wanted)
    return marked


@kernel
def draw_rows(rows, cuts, camera, slices, ways, offsets, together, wants_depth, planes, rays, packed, color, depth):
    """Draw rows (first, end) of every view, each along its own rays, over color (V, H, W, 4) and depth (V, H, W).

    cuts, ways, planes: of each volume; several take turns slab by slab. So many views together use the same slices,
    lit for the eye of the first (own_eyes) or of the centre.
    """
    views, height, width, _ = color.shape
    blocks = -(-width // RAYS)
    far = slices.first + slices.slabs * slices.distance
    opaque, n = depth.shape[0] > 0, np.uint64(RAYS)
    chunk = SLABS if len(cuts) == 1 else 1
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        if mark_volumes(cuts, row, slices, planes) == 0:
            continue
        for v0 in range(0, views, together):
            v1, eye = min(v0 + together, views), offsets[v0] if ways[0].own_eyes else 0.0
            for v in range(v0, v1):
                for b in range(blocks):
                    x = b * RAYS
                    base = np.uint64(((v - v0) * blocks + b) * BLOCK_ROWS * ROW)
                    start_rays(n, base, x, offsets[v], camera, row, rays)
                    clear_rays(n, base, ways[0].mode, rays)
                    for i in range(n):
                        rays[base + END + i] = np.float32(far)
                    if opaque:
                        for i in range(np.uint64(min(RAYS, width - x))):
                            rays[base + END + i] = min(np.float32(far), depth[v, r, x + i])
            for k in range(0, slices.slabs, chunk):
                last = min(k + chunk, slices.slabs)
                if k > 0 and len(cuts) == 1 and ways[0].mode != MIP:
                    args = (slices, k, last, ways[0].mode, planes[0], rays)
                    hide_behind_rays((v1 - v0) * blocks, cuts[0], *args)
                for v in range(len(cuts)):
                    next_slices(cuts[v], eye, row, slices, k, last, chunk, planes[v])
                march_volumes((v1 - v0) * blocks, cuts, row, slices, k, last, ways, wants_depth, planes, rays, packed)
            resolve_rays((v1 - v0) * blocks, cuts[0], row, slices, ways[0], rays)
            for v in range(v0, v1):
                for b in range(blocks):
                    x = b * RAYS
                    end = min(x + RAYS, width)
                    base = np.uint64(((v - v0) * blocks + b) * BLOCK_ROWS * ROW)
                    finish_rays(np.uint64(end - x), base, rays, color[v, r, x:end])
                    if wants_depth:
                        for i in range(np.uint64(end - x)):
                            depth[v, r, x + i] = min(depth[v, r, x + i], rays[base + HALF + i])


@inlined
def finish_line(width, t, line, color):
    """Put the sums of a view's pixels over color (W, 4)."""
    for i in range(width):
        k = np.uint64(i)
        through = line[t + ALPHA + k]
        color[i, 0] = over(line[t + RED + k], through, color[i, 0])
        color[i, 1] = over(line[t + GREEN + k], through, color[i, 1])
        color[i, 2] = over(line[t + BLUE + k], through, color[i, 2])
        color[i, 3] = over(ONE - through, through, color[i, 3])


@inlined
def keep_group(x, pixels, offset, near, far, camera, cut, alive):
    """Note that `pixels` pixels from x on of a view are not yet opaque, between two depths."""
    left = (x - camera.centre_x) / camera.fx - offset / camera.focal
    right = left + (pixels + 1) / camera.fx
    keep_alive(offset + min(near * left, far * left), offset + max(near * right, far * right), cut, alive)


@kernel
def hide_behind_views(views, width, offsets, camera, cut, slices, k, last, planes, line):
    """Leave out what all views have seen enough before, in the slices of slabs k … last."""
    near, far = slices.first + k * slices.distance, slices.first + last * slices.distance
    planes.alive[:] = np.uint8(0)
    for v in range(views):
        t = np.uint64(v * SLAB_ROWS * LINE) + ALPHA
        for x in range(0, width, RAYS):
            pixels, dark = min(RAYS, width - x), True
            for i in range(x, x + pixels):
                dark = dark and line[t + np.uint64(i)] < OPAQUE
            if not dark:
                keep_group(x, pixels, offsets[v], near, far, camera, cut, planes.alive)
    hide_runs(k, last, planes)


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
            if k > 0:
                hide_behind_views(views, width, offsets, camera, cut, slices, k, last, planes, line)
            next_slices(cut, 0.0, row, slices, k, last, SLABS, planes)
            args = (ways.table, ways.material, ways.light, planes, shared, rays, packed)
            classify_slabs(cut, camera, row, slices, k, last, *args)
            for v in range(views):
                blend_view(offsets[v], width, camera, slices, k, last, shared, v * SLAB_ROWS * LINE, line)
        for v in range(views):
            t, middle = np.uint64(v * SLAB_ROWS * LINE), slices.first + 0.5 * slices.slabs * slices.distance
            even_out(width, offsets[v], middle, camera, row, t, line)
            finish_line(width, t, line, color[v, r])
