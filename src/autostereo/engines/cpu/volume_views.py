"""Volumes in a stack of views: rows of the pictures, all views of a row at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel, lean
from .simd import LANES, greater, lesser, load, mask_word, splat, store, to_float, to_int
from .view_rows import row_views, steps_along
from .volume_blend import blend_group, clear_line, even_out, load_sums
from .volume_modes import NONE, march_iso, march_mip, resolve_iso, resolve_mip
from .volume_rays import (
    BEFORE,
    BEGIN,
    DONE,
    END,
    FINISH,
    HALF,
    HALF_WAY,
    HIDDEN,
    KEPT,
    LENGTH,
    ONE,
    ORIGIN,
    RAYS,
    TOTAL,
    TURN,
    ZERO,
    B,
    G,
    R,
    T,
    add_optical,
    block_bounds,
    find_half,
    march,
    ray_stretch,
    seen,
)
from .volume_sample import SLABS, TINY, hide_runs, keep_alive, mark_runs
from .volume_shared import ALPHA, LINE, SLAB_ROWS, classify_slabs

COMPOSITE, MIP, ISO = 0, 1, 2
PIXELS = RAYS // 3  # of a block of sub-pixels that are averaged
THIRD = np.float32(1.0 / 3.0)
BYTE = np.float32(255.0)


class Ways(NamedTuple):
    """How volumes are drawn.

    mode: COMPOSITE, MIP or ISO; table, plain: pre-integrated slabs, see make_table, make_plain; material = (ambient,
    diffuse, specular); light = (channels, colours); colors: of all levels for MIP, in the first row that of an
    isosurface; level: of the surface, as a row of the table; shade; own_eyes: highlights for a ray's own eye, not the
    centre's.
    """

    mode: int
    table: np.ndarray
    plain: np.ndarray
    material: tuple
    light: tuple
    colors: np.ndarray
    level: float
    shade: bool
    own_eyes: bool


@inlined
def add_totals(n, base, cuts, row, slices, ways, k, planes, rays, packed):
    """Optical depth of slab k of all volumes into TOTAL; returns whether several are seen there."""
    bounds, together = block_bounds(n, base, rays), 0
    for v in range(len(cuts)):
        together += seen(bounds, cuts[v], slices, k, planes[v].marks)
    if together < 2:
        return False
    for i in range(n):
        rays[base + TOTAL + i] = ZERO
        rays[base + DONE + i] = ZERO
        rays[base + BEFORE + i] = rays[base + T + i]
        rays[base + BEGIN + i] = np.float32(np.inf)
        rays[base + FINISH + i] = ZERO
    for v in range(len(cuts)):
        if seen(bounds, cuts[v], slices, k, planes[v].marks):
            ray_stretch(n, base, cuts[v], row, slices.first, rays)
            add_optical(n, base, cuts[v], row, slices, k, ways[v], planes[v], rays, packed)
    return True


@inlined
def average_alphas(pixels, base, rays):
    """Attenuate the rays of a pixel's three sub-pixels, `pixels` apart, by their mean; KEPT: T before the slab."""
    for i in range(pixels):
        let = ZERO
        for c in range(3):
            ray = base + i + np.uint64(c) * pixels
            let += rays[ray + T] / max(rays[ray + KEPT], TINY)
        for c in range(3):
            ray = base + i + np.uint64(c) * pixels
            rays[ray + T] = rays[ray + KEPT] * let * THIRD


@lean
def trace_rays(cuts, row, slices, ways, wants_half, averaged, planes, rays, packed):
    """Take a block of rays, of which ORIGIN, TURN, LENGTH and END are set, through volumes: colours, T and HALF.

    Several volumes take turns slab by slab. averaged: the block is of PIXELS pixels, one channel after the other,
    that are attenuated by the mean alpha of the three.
    """
    n, base, mode = np.uint64(RAYS), np.uint64(0), ways[0].mode
    for i in range(n):
        rays[T + i] = ONE
        rays[R + i] = NONE if mode == MIP else ZERO
        rays[G + i] = ZERO
        rays[B + i] = ZERO
        rays[HALF + i] = np.float32(np.inf)
    averaged = averaged and mode == COMPOSITE
    step = slices.slabs if len(cuts) == 1 and not averaged else 1
    for k in range(0, slices.slabs, step):
        last, among = min(k + step, slices.slabs), False
        if averaged:
            for i in range(n):
                rays[KEPT + i] = rays[T + i]
        if len(cuts) > 1 and mode == COMPOSITE:
            among = add_totals(n, base, cuts, row, slices, ways, k, planes, rays, packed)
        for v in range(len(cuts)):
            cut, way = cuts[v], ways[v]
            ray_stretch(n, base, cut, row, slices.first, rays)
            if mode == MIP:
                march_mip(n, base, cut, row, slices, k, last, planes[v], rays)
            elif mode == ISO:
                march_iso(n, base, cut, row, slices, k, last, way.level, planes[v], rays)
            else:
                march(n, base, cut, row, slices, k, last, way, wants_half, among, planes[v], rays, packed)
        if among and wants_half:
            find_half(n, base, rays)
        if averaged:
            average_alphas(np.uint64(PIXELS), base, rays)
    way = ways[0]
    if mode == MIP:
        resolve_mip(n, base, way.colors, rays)
    elif mode == ISO:
        color = (np.float64(way.colors[0, 0]), np.float64(way.colors[0, 1]), np.float64(way.colors[0, 2]))
        resolve_iso(RAYS, base, cuts[0], row, slices, way.level, color, way.material, way.shade, way.own_eyes, rays)


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


@lean
def mark_volumes(cuts, row, slices, planes):
    """Mark the runs of all volumes; returns how many there are."""
    marked = 0
    for v in range(len(cuts)):
        marked += mark_runs(cuts[v], row, slices, planes[v].marks)
    return marked


@kernel
def draw_rows(rows, cuts, camera, slices, ways, offsets, wants_depth, planes, rays, packed, color, depth):
    """Draw rows (first, end) of every view, each along its own rays, over color (V, H, W, 4) and depth (V, H, W).

    cuts, ways, planes: of each volume; depth ends rays where it has a size, and takes part if wants_depth.
    """
    views, _, width, _ = color.shape
    far = slices.first + slices.slabs * slices.distance
    opaque, n, base = depth.shape[0] > 0, np.uint64(RAYS), np.uint64(0)
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        if mark_volumes(cuts, row, slices, planes) == 0:
            continue
        for v in range(views):
            for x in range(0, width, RAYS):
                end = min(x + RAYS, width)
                start_rays(n, base, x, offsets[v], camera, row, rays)
                for i in range(n):
                    rays[END + i] = np.float32(far)
                if opaque:
                    for i in range(np.uint64(end - x)):
                        rays[END + i] = min(np.float32(far), depth[v, r, x + i])
                trace_rays(cuts, row, slices, ways, wants_depth, False, planes, rays, packed)
                finish_rays(np.uint64(end - x), base, rays, color[v, r, x:end])
                if wants_depth:
                    for i in range(np.uint64(end - x)):
                        depth[v, r, x + i] = min(depth[v, r, x + i], rays[HALF + i])


@inlined
def over_lanes(front, through, behind, shift):
    """`over` for one byte of LANES pixels, shifted back to its place."""
    value = front * BYTE + through * to_float((behind >> shift) & np.int32(255)) + HALF_WAY
    return to_int(lesser(greater(value, ZERO), BYTE)) << shift


@inlined
def finish_line(width, t, line, first, words):
    """Put the sums of a view's pixels over words first … first + width, RGBA bytes of a pixel each."""
    whole = width // LANES * LANES
    for x in range(0, whole, LANES):
        i, place = np.uint64(t + x), np.uint64(first + x)
        (red, green, blue, through), behind = load_sums(i, line), load(words, place)
        red, green = over_lanes(red, through, behind, np.int32(0)), over_lanes(green, through, behind, np.int32(8))
        blue = over_lanes(blue, through, behind, np.int32(16))
        alpha = over_lanes(splat(ONE) - through, through, behind, np.int32(24))
        store(words, place, red | green | blue | alpha)
    for x in range(whole, width):
        i, place = np.uint64(t + x), np.uint64(first + x)
        through, behind, word = line[i + ALPHA], words[place], np.int32(0)
        for c in range(4):
            front = ONE - through if c == 3 else line[i + np.uint64(c * LINE)]
            value = over(front, through, (behind >> np.int32(8 * c)) & np.int32(255))
            word |= np.int32(value) << np.int32(8 * c)
        words[place] = word


@inlined
def keep_group(x, pixels, offset, near, far, camera, cut, alive):
    """Note that `pixels` pixels from x on of a view are not yet opaque, between two depths."""
    left = (x - camera.centre_x) / camera.fx - offset / camera.focal
    right = left + (pixels + 1) / camera.fx
    keep_alive(offset + min(near * left, far * left), offset + max(near * right, far * right), cut, alive)


@lean
def hide_behind_views(views, width, offsets, camera, cut, slices, k, last, planes, line):
    """Leave out what all views have seen enough before, in the slices of slabs k … last."""
    near, far = slices.first + k * slices.distance, slices.first + last * slices.distance
    planes.alive[:] = np.uint8(0)
    for v in range(views):
        t = np.uint64(v * SLAB_ROWS * LINE) + ALPHA
        for x in range(0, width, RAYS):
            pixels, lit = min(RAYS, width - x), np.int32(0)
            for i in range(x, x + pixels, LANES):  # a few beyond the picture are as good as those in it
                lit |= mask_word(load(line, t + np.uint64(i)) >= HIDDEN)
            if lit != 0:
                keep_group(x, pixels, offsets[v], near, far, camera, cut, planes.alive)
    hide_runs(k, last, planes)


@lean
def sum_views(cut, camera, row, slices, ways, width, offsets, groups, planes, slabs, rays, packed, line):
    """Sum the slabs of one row of the picture, that all views share, into a line of each view.

    groups = (slabs in a bundle, where groups of views begin); slabs = (shared, bundles).
    """
    shared, bundles = slabs
    size, begins = groups
    views = len(offsets)
    for v in range(views):
        clear_line(np.uint64(width), np.uint64(v * SLAB_ROWS * LINE), line)
    for k in range(0, slices.slabs, SLABS):
        last = min(k + SLABS, slices.slabs)
        if k > 0:
            hide_behind_views(views, width, offsets, camera, cut, slices, k, last, planes, line)
        classify_slabs(cut, camera, row, slices, k, last, ways, planes, shared, rays, packed)
        for g in range(len(begins) - 1):
            near, place = offsets[begins[g] : begins[g + 1]], begins[g] * SLAB_ROWS * LINE
            blend_group(near, width, camera, slices, k, last, size, shared, bundles, place, line)
    middle = slices.first + 0.5 * slices.slabs * slices.distance
    for v in range(views):
        even_out(width, offsets[v], middle, camera, row, np.uint64(v * SLAB_ROWS * LINE), line)


@kernel
def draw_shared_rows(rows, cut, camera, slices, ways, offsets, groups, planes, slabs, rays, packed, line, color):
    """Draw rows (first, end) of every view from slabs that they share, over color (V, H, W, 4); see sum_views."""
    views, height, width, _ = color.shape
    words = color.reshape(-1).view(np.int32)
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        if mark_runs(cut, row, slices, planes.marks) == 0:
            continue
        sum_views(cut, camera, row, slices, ways, width, offsets, groups, planes, slabs, rays, packed, line)
        for v in range(views):
            finish_line(width, np.uint64(v * SLAB_ROWS * LINE), line, (v * height + r) * width, words)


@kernel
def draw_woven_rows(rows, cut, camera, slices, ways, offsets, groups, planes, slabs, rays, packed, line, weave, color):
    """Draw rows (first, end) of a panel color (H, W, 3), each sub-pixel from the line of its view; see sum_views.

    weave = (view map, flip x, flip y, u (W, 3) float64, views (3·W,) int32): the last two scratch.
    """
    viewmap, flip_x, flip_y, u, shown_views = weave
    height, width, _ = color.shape
    steps = steps_along(width, viewmap)
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        if mark_runs(cut, row, slices, planes.marks) == 0:
            continue
        sum_views(cut, camera, row, slices, ways, width, offsets, groups, planes, slabs, rays, packed, line)
        shown = height - 1 - r if flip_y else r
        row_views(shown, width, viewmap, steps, u, shown_views)
        for x in range(width):
            i = width - 1 - x if flip_x else x
            for c in range(3):
                t = np.uint64(shown_views[3 * x + c] * SLAB_ROWS * LINE + i)
                front, through = line[t + np.uint64(c * LINE)], line[t + ALPHA]
                color[shown, x, c] = over(front, through, color[shown, x, c])
