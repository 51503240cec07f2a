"""Surfels to a stack of views: a block of rows and columns of every view at a time, in cache.

Twice over the surfels of a block, nearest first: the nearest depth of each sample, then the sums of weights and
weighted colours of those within ε of it (the 1+1 passes of Hübner 2007b, section 3.5.2, each of all views). A chord
(points_chord) covers a short run of neighbouring samples of each view: where it lies is found for all views at once
(SIMD over views), then the samples of a run are drawn together (SIMD over x). What is nowhere seen in the first pass
is left out of the second.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_shade import ALPHA, ONE, STRIDE, ZERO, quantize, whole_steps
from .points_chord import cut, depth_of, is_small, lens_of, light_at, shine_of, weight_of
from .points_setup import A, B, BLUE, DEPTH, FRONT, GREEN, MATERIAL, ND, NX, NY, PARTS, REACH, RED
from .points_setup import ROW0, ROW1, SMALL

VIEWS_AT_ONCE = 256
PLANE = np.uint64(16384 + 5 * 16)  # samples of a block; planes must not fall onto the same cache sets
NEAREST, STOP, WEIGHT, SUM_R, SUM_G, SUM_B = (PLANE * np.uint64(k) for k in range(6))
PLANES = 6
PAD = 16  # samples beyond a row's end that whole steps may touch
STEP = np.int32(4)  # samples of a run that are drawn together

# rows of the float32 scratch, one value per view
LEFT, RIGHT, ACROSS, FIRST, SMALL_HERE, CR, CG, CB = (np.uint64(k * STRIDE) for k in range(8))
FLOAT_ROWS = 8
# rows of the int32 scratch
BASE, COUNT = (np.uint64(k * STRIDE) for k in range(2))
INT_ROWS = 2


class Splats(NamedTuple):
    """The surfels in sight. records, words: see points_setup; bin_start (B + 1,), bins: numbers of each block's
    surfels, nearest first; seen: scratch for each; materials (M, 4), lights (L, 8) float32; own_eye."""

    records: np.ndarray
    words: np.ndarray
    bin_start: np.ndarray
    bins: np.ndarray
    seen: np.ndarray
    materials: np.ndarray
    lights: np.ndarray
    own_eye: bool


class Scratch(NamedTuple):
    """One thread's own memory."""

    planes: np.ndarray
    lists: np.ndarray
    ints: np.ndarray


@inlined
def record_of(records, i):
    """The numbers of surfel i."""
    return (
        records[i, 0], records[i, 1], records[i, 2], records[i, 3], records[i, 4], records[i, 5], records[i, 6],
        records[i, 7], records[i, 8], records[i, 9], records[i, 10], records[i, 11], records[i, 12],
    )  # fmt: skip


@inlined
def find_small(views, first_view, record, lens, offsets, lists):
    """Mark the views in which a disc appears less than a pixel wide."""
    for v in range(whole_steps(views)):
        lists[SMALL_HERE + v] = ONE if is_small(offsets[first_view + v], record, lens) else ZERO


@inlined
def find_colors(views, first_view, record, number, lens_offset, splats, offsets, lists):
    """Colour of a surfel in each view."""
    steps = whole_steps(views)
    red, green, blue = record[RED], record[GREEN], record[BLUE]
    for v in range(steps):
        lists[CR + v] = red
        lists[CG + v] = green
        lists[CB + v] = blue
    materials, lights = splats.materials, splats.lights
    specular, shininess = materials[number, 2], materials[number, 3]
    if specular == ZERO or not splats.own_eye:
        return
    d = record[DEPTH]
    place = (record[A] * d, record[B] * d, d)
    normal = (record[NX], record[NY], record[ND])
    for k in range(lights.shape[0]):
        light, faces = light_at(k, record, lens_offset, lights)
        if not faces:
            continue
        red, green, blue = specular * lights[k, 4], specular * lights[k, 5], specular * lights[k, 6]
        for v in range(steps):
            shine = shine_of(offsets[first_view + v], place, normal, light, shininess)
            lists[CR + v] += shine * red
            lists[CG + v] += shine * green
            lists[CB + v] += shine * blue


@inlined
def find_runs(views, first_view, chord, depth, block, small, offsets, lists, ints):
    """Where a chord lies in each view: its ends, the first sample of its run, its place and the number of steps.

    block = (first column, end column, sample_x, place of the row, samples from view to view); small: 1 or 0, only
    in views that are marked so; 2 in all.
    """
    x1, p1, x2, p2 = chord[0], chord[1], chord[2], chord[3]
    low, high, sample_x, row, stride = block
    steps = whole_steps(views)
    for v in range(steps):
        offset = offsets[first_view + v]
        left, right = x1 + offset * p1, x2 + offset * p2
        lists[LEFT + v] = left
        lists[RIGHT + v] = right
        lists[ACROSS + v] = (right - left) * depth
        lists[FIRST + v] = min(max(np.ceil(left - sample_x), low), high)
    for v in range(steps):
        ints[BASE + v] = np.int32(np.int32(np.int32(v) * stride) + np.int32(row + np.int32(lists[FIRST + v] - low)))
    for v in range(steps):
        end = min(max(np.ceil(lists[RIGHT + v] - sample_x), low), high)
        run = np.int32(end - lists[FIRST + v])
        run = run if (small == np.float32(2.0)) | (lists[SMALL_HERE + v] == small) else np.int32(0)
        ints[COUNT + v] = np.int32(np.int32(max(run, np.int32(0)) + np.int32(3)) & np.int32(-4))
        lists[FIRST + v] += sample_x


@inlined
def draw_nearest(views, chord, reach, lists, ints, planes):
    """Keep the nearest depth of each sample; returns whether any sample may be seen, now or when all is drawn."""
    seen = False
    for v in range(views):
        place = np.uint64(ints[BASE + v])
        left, right, across, first = lists[LEFT + v], lists[RIGHT + v], lists[ACROSS + v], lists[FIRST + v]
        for k in range(np.uint64(ints[COUNT + v])):
            x = first + np.float32(np.int32(k))
            n, m = x - left, right - x
            depth, _ = depth_of(n, m, across, chord)
            nearest = planes[NEAREST + place + k]
            covered = (n > ZERO) & (m > ZERO)
            seen |= covered & (depth - reach <= nearest)
            planes[NEAREST + place + k] = depth if covered & (depth < nearest) else nearest
    return seen


@inlined
def add_weights(views, chord, reach, lists, ints, planes):
    """Add weights and weighted colours to the samples where a surfel is seen."""
    for v in range(views):
        place = np.uint64(ints[BASE + v])
        left, right, across, first = lists[LEFT + v], lists[RIGHT + v], lists[ACROSS + v], lists[FIRST + v]
        red, green, blue = lists[CR + v], lists[CG + v], lists[CB + v]
        for k in range(np.uint64(ints[COUNT + v])):
            x = first + np.float32(np.int32(k))
            n, m = x - left, right - x
            depth, inverse = depth_of(n, m, across, chord)
            a = place + k
            seen = (n > ZERO) & (m > ZERO) & (depth - reach <= planes[NEAREST + a]) & (depth < planes[STOP + a])
            weight = weight_of(n, m, inverse, chord) if seen else ZERO
            planes[WEIGHT + a] += weight
            planes[SUM_R + a] += weight * red
            planes[SUM_G + a] += weight * green
            planes[SUM_B + a] += weight * blue


@inlined
def draw_surfels(blending, views, first_view, bounds, block, splats, camera, offsets, scratch):
    """Draw the surfels of a block: their depths or, `blending`, their colours where they are seen.

    bounds = (first row, end row, first entry, end entry); block = (first column, end column, samples from view to
    view).
    """
    records, words, bins, seen = splats.records, splats.words, splats.bins, splats.seen
    planes, lists, ints = scratch.planes, scratch.lists, scratch.ints
    lens = lens_of(camera)
    sample = np.float32(0.5)
    stride = np.int32(block[2])
    for entry in range(np.uint64(bounds[2]), np.uint64(bounds[3])):
        if blending and not seen[entry]:
            continue
        i = np.uint64(bins[entry])
        record = record_of(records, i)
        parts = words[i, PARTS]
        reach = record[REACH] * record[DEPTH]
        mixed = (parts & SMALL) != 0 and (parts & FRONT) != 0
        if mixed:
            find_small(views, first_view, record, lens, offsets, lists)
        if blending:
            number = np.uint64(parts >> MATERIAL)
            find_colors(views, first_view, record, number, np.float32(camera.offset_y), splats, offsets, lists)
        visible = False
        for r in range(max(words[i, ROW0], bounds[0]), min(words[i, ROW1], bounds[1])):
            y = np.float32(r) + sample
            row = np.int32(r - bounds[0]) * np.int32(views) * stride
            here = (np.float32(block[0]), np.float32(block[1]), sample, row, stride)
            for bit in range(4):
                part = 1 << bit
                if parts & part == 0:
                    continue
                found, chord = cut(record, part, y, lens)
                if not found:
                    continue
                small = (ONE if part == SMALL else ZERO) if mixed else np.float32(2.0)
                find_runs(views, first_view, chord, record[DEPTH], here, small, offsets, lists, ints)
                if blending:
                    add_weights(views, chord, reach, lists, ints, planes)
                else:
                    visible |= draw_nearest(views, chord, reach, lists, ints, planes)
        if not blending:
            seen[entry] = visible


@inlined
def load_depths(rows, columns, views, stride, size, first_view, depth, planes):
    """Clear the block's sums, and take the depths of what is drawn already; size = (H, W) of depth (V·H·W,)."""
    count = np.uint64(columns[1] - columns[0])
    samples = np.uint64((rows[1] - rows[0]) * np.int64(views) * stride)
    for plane in range(WEIGHT, SUM_B + np.uint64(1), PLANE):
        for k in range(samples):
            planes[plane + k] = ZERO
    a = np.uint64(0)
    for r in range(rows[0], rows[1]):
        for v in range(views):
            first = np.uint64((np.int64(first_view + v) * size[0] + r) * size[1] + columns[0])
            for x in range(count):
                planes[NEAREST + a + x] = depth[first + x]
            for x in range(count):
                planes[STOP + a + x] = depth[first + x]
            for x in range(np.uint64(PAD)):
                planes[NEAREST + a + count + x] = ZERO
            a += np.uint64(stride)


@inlined
def store_samples(rows, columns, views, stride, size, first_view, planes, color, depth):
    """Write colours and depths of the samples that see surfels; color (V·H·W,) int32, depth alike."""
    count = np.uint64(columns[1] - columns[0])
    a = np.uint64(0)
    for r in range(rows[0], rows[1]):
        for v in range(views):
            first = np.uint64((np.int64(first_view + v) * size[0] + r) * size[1] + columns[0])
            for x in range(count):
                weight = planes[WEIGHT + a + x]
                inverse = ONE / weight
                rgba = (
                    quantize(planes[SUM_R + a + x] * inverse)
                    | (quantize(planes[SUM_G + a + x] * inverse) << np.int32(8))
                    | (quantize(planes[SUM_B + a + x] * inverse) << np.int32(16))
                    | ALPHA
                )
                color[first + x] = rgba if weight > ZERO else color[first + x]
            for x in range(count):
                depth[first + x] = planes[NEAREST + a + x]
            a += np.uint64(stride)


@kernel
def splat_views(span, grid, splats, camera, offsets, scratch, color, depth):
    """Draw the surfels of blocks span[0] … span[1] over color (V, H, W) int32 and depth (V, H, W) float32.

    offsets (V + 15,) float32, the last one repeated, so that SIMD works in whole steps.
    """
    views, height, width = depth.shape
    colors, depths = color.reshape(-1), depth.reshape(-1)
    stride = grid.columns + PAD
    for k in range(span[0], span[1]):
        start, end = splats.bin_start[k], splats.bin_start[k + 1]
        if start == end:
            continue
        first_row, first_column = k // grid.blocks * grid.rows, k % grid.blocks * grid.columns
        rows = (first_row, min(first_row + grid.rows, height))
        columns = (first_column, min(first_column + grid.columns, width))
        bounds, block = (rows[0], rows[1], start, end), (columns[0], columns[1], stride)
        for first in range(0, views, VIEWS_AT_ONCE):
            view, count = np.uint64(first), np.uint64(min(VIEWS_AT_ONCE, views - first))
            load_depths(rows, columns, count, stride, (height, width), view, depths, scratch.planes)
            draw_surfels(False, count, view, bounds, block, splats, camera, offsets, scratch)
            draw_surfels(True, count, view, bounds, block, splats, camera, offsets, scratch)
            store_samples(rows, columns, count, stride, (height, width), view, scratch.planes, colors, depths)
