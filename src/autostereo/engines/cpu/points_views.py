"""Surfels to a stack of views: a block of rows and columns of every view at a time, in cache.

Twice over the surfels of a block: the nearest depth of each sample, then the sums of weights and
weighted colours of those within ε of it (the 1+1 passes of Hübner 2007b, section 3.5.2, each of all views). A chord
(points_chord) covers a short run of neighbouring samples of each view: where it lies is found for all views at once
(SIMD over views), then the samples of a run are drawn together (SIMD over x). Between the passes the farthest depth
of every few samples is taken, so that the second can leave out what is hidden in a view.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .panel_list import STRIDE
from .points_block import BLEND, CLOSER, TWO, draw_surfels, middle_depth, swath
from .points_chord import depth_of, is_small, light_at, sees_front, shine_of, weight_of
from .points_setup import BLUE, DEPTH, FRONT, GREEN, ND, NX, NY, REACH, RED, SIDES, SMALL, A, B
from .scalars import ALPHA, HALF, ONE, ZERO, quantize, whole_steps

VIEWS_AT_ONCE = 256
SMALL_MADE, COLORS_MADE = 1, 2
PLANE = np.uint64(16384 + 5 * 16)  # samples of a block; planes must not fall onto the same cache sets
NEAREST, STOP, WEIGHT, SUM_R, SUM_G, SUM_B, FARTHEST = (PLANE * np.uint64(k) for k in range(7))
PLANES = 7 + 4  # in the last four, lanes beyond the last view look for farthest depths
CELL = 2  # there is a farthest depth for every 2² samples: of them …
CELL_REACH = 12  # … and of those after them
COARSE = FARTHEST + PLANE // np.uint64(2)  # and one for every 2³ samples of 2³ views
GROUP = 3
PAD = 16  # samples beyond a row's end that whole steps may touch

# rows of the float32 scratch, one value per view
LEFT, RIGHT, ACROSS, FIRST, SMALL_HERE, CR, CG, CB = (np.uint64(k * STRIDE) for k in range(8))
# rows of the int32 scratch
BASE, COUNT = (np.uint64(k * STRIDE) for k in range(2))


@kernel
def row_samples(columns):
    """Samples from view to view: those of a block's row, and as many more as whole steps may touch."""
    return (columns + PAD + 7) & ~7


class Scratch(NamedTuple):
    """One thread's own memory."""

    planes: np.ndarray
    lists: np.ndarray
    ints: np.ndarray


class Place(NamedTuple):
    """What draw_chord reads of a block.

    offsets (V + 15,) float32, the last one repeated, so that SIMD works in whole steps; first view and number of
    views; columns first … end; samples from view to view; offset of the lens; see Splats for the rest.
    """

    offsets: np.ndarray
    first_view: np.uint64
    views: np.uint64
    first: np.float32
    end: np.float32
    stride: np.int32
    lens_offset: np.float32
    backs: np.ndarray
    materials: np.ndarray
    lights: np.ndarray
    own_eye: bool


@inlined
def find_small(views, first_view, record, lens, offsets, lists):
    """Mark the views in which a disc appears less than a pixel wide."""
    for v in range(whole_steps(views)):
        lists[SMALL_HERE + v] = ONE if is_small(offsets[first_view + v], record, lens) else ZERO


@inlined
def find_colors(place, number, parts, record, material, lists):
    """Colour of a surfel in each view: that of the side which it sees."""
    offsets, first_view, lights = place.offsets, place.first_view, place.lights
    steps = whole_steps(place.views)
    red, green, blue = record[RED], record[GREEN], record[BLUE]
    for v in range(steps):
        lists[CR + v] = red
        lists[CG + v] = green
        lists[CB + v] = blue
    both = parts & SIDES != 0
    if both:
        i = np.uint64(number)
        r, g, b = place.backs[i, 0], place.backs[i, 1], place.backs[i, 2]
        for v in range(steps):
            front = sees_front(offsets[first_view + v], record)
            lists[CR + v] = red if front else r
            lists[CG + v] = green if front else g
            lists[CB + v] = blue if front else b
    specular, shininess = place.materials[material, 2], place.materials[material, 3]
    if specular == ZERO or not place.own_eye:
        return
    d = record[DEPTH]
    centre = (record[A] * d, record[B] * d, d)
    for k in range(lights.shape[0]):
        light, side = light_at(k, record, place.lens_offset, lights)
        if side == ZERO or (side < ZERO and not both):
            continue
        sign = ONE if side > ZERO else -ONE
        normal = (sign * record[NX], sign * record[NY], sign * record[ND])
        red, green, blue = specular * lights[k, 4], specular * lights[k, 5], specular * lights[k, 6]
        for v in range(steps):
            offset = offsets[first_view + v]
            shine = shine_of(offset, centre, normal, light, shininess)
            shine = shine if not both or sees_front(offset, record) == (side > ZERO) else ZERO
            lists[CR + v] += shine * red
            lists[CG + v] += shine * green
            lists[CB + v] += shine * blue


@inlined
def find_runs(views, first_view, chord, depth, block, small, offsets, lists, ints):
    """Where a chord lies in each view: its ends, the first sample of its run, its place and length.

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
        run = run if (small == TWO) | (lists[SMALL_HERE + v] == small) else np.int32(0)
        ints[COUNT + v] = np.int32(np.int32(max(run, np.int32(0)) + np.int32(3)) & np.int32(-4))
        lists[FIRST + v] += sample_x


@inlined
def draw_nearest(views, chord, lists, ints, planes):
    """Keep the nearest depth of each sample."""
    for v in range(views):
        place = np.uint64(ints[BASE + v])
        left, right, across, first = lists[LEFT + v], lists[RIGHT + v], lists[ACROSS + v], lists[FIRST + v]
        for k in range(np.uint64(ints[COUNT + v])):
            x = first + np.float32(np.int32(k))
            n, m = x - left, right - x
            depth, _ = depth_of(n, m, across, chord)
            nearest = planes[NEAREST + place + k]
            planes[NEAREST + place + k] = depth if (n > ZERO) & (m > ZERO) & (depth < nearest) else nearest


@inlined
def find_farthest(rows, views, stride, planes):
    """The farthest depth of every few samples of a view, and of a few views."""
    for c in range(np.uint64((rows * np.int64(views) * stride) >> CELL)):
        farthest = planes[NEAREST + (c << np.uint64(CELL))]
        for k in range(1, CELL_REACH):
            farthest = max(farthest, planes[NEAREST + (c << np.uint64(CELL)) + np.uint64(k)])
        planes[FARTHEST + c] = farthest
    cells, to = np.uint64(stride >> GROUP), COARSE
    for row in range(rows):
        for first in range(0, np.int64(views), 1 << GROUP):
            for c in range(cells):
                farthest = ZERO
                for v in range(first, min(first + (1 << GROUP), np.int64(views))):
                    begin = np.uint64(((row * np.int64(views) + v) * stride) >> CELL)
                    farthest = max(farthest, planes[FARTHEST + begin + (c << np.uint64(GROUP - CELL))])
                planes[to + c] = farthest
            to += cells


@inlined
def is_hidden(place, nearest, record, lens, rows, scratch):
    """Whether all that a surfel may touch sees something nearer, in every view."""
    planes, views = scratch.planes, np.int64(place.views)
    groups, cells = (views + (1 << GROUP) - 1) >> GROUP, np.int64(place.stride) >> GROUP
    for g in range(groups):
        first = place.first_view + np.uint64(g << GROUP)
        last = place.first_view + np.uint64(min((g + 1) << GROUP, views) - 1)
        left, right = swath(record, lens, place.offsets[first], place.offsets[last])
        left, right = max(left - place.first, ZERO), min(right, place.end) - place.first
        if left > right:
            continue
        cell0, cell1 = np.int64(left) >> GROUP, np.int64(right) >> GROUP
        for row in range(rows[0], rows[1]):
            begin = COARSE + np.uint64((row * groups + g) * cells)
            for c in range(np.uint64(cell0), np.uint64(cell1) + np.uint64(1)):
                if nearest <= planes[begin + c]:
                    return False
    return True


@inlined
def drop_hidden(views, nearest, ints, planes):
    """Leave out the views in which nothing as near as `nearest` is seen; returns whether there are others."""
    for v in range(whole_steps(views)):
        farthest = planes[FARTHEST + np.uint64(ints[BASE + v] >> np.int32(CELL))]
        hidden = (nearest > farthest) & (ints[COUNT + v] <= np.int32(8))
        ints[COUNT + v] = np.int32(0) if hidden else ints[COUNT + v]
    most = np.int32(0)
    for v in range(views):
        most = max(most, ints[COUNT + v])
    return most > 0


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
def draw_chord(place, blending, row, surfel, chord, done, scratch):
    """Draw one chord in every view: its depths or, `blending`, its colours where they are seen. See draw_surfels.

    Returns which lists of the surfel are made.
    """
    record, number, part, parts, material, lens = surfel
    planes, lists, ints, offsets = scratch.planes, scratch.lists, scratch.ints, place.offsets
    first_view, views = place.first_view, place.views
    small = TWO
    if parts & SMALL and parts & FRONT:
        if not done & SMALL_MADE:
            find_small(views, first_view, record, lens, offsets, lists)
            done |= SMALL_MADE
        small = ONE if part == SMALL else ZERO
    begin = np.int32(row) * np.int32(views) * place.stride
    block = (place.first, place.end, HALF, begin, place.stride)
    find_runs(views, first_view, chord, record[DEPTH], block, small, offsets, lists, ints)
    if not blending:
        draw_nearest(views, chord, lists, ints, planes)
        return done
    reach = record[REACH] * record[DEPTH]
    if drop_hidden(views, CLOSER * record[DEPTH] / max(chord[4], chord[5]) - reach, ints, planes):
        if not done & COLORS_MADE:
            find_colors(place, number, parts, record, material, lists)
            done |= COLORS_MADE
        add_weights(views, chord, reach, lists, ints, planes)
    return done


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
    stride = row_samples(grid.columns)
    for k in range(span[0], span[1]):
        start, end = splats.bin_start[k], splats.bin_start[k + 1]
        if start == end:
            continue
        first_row, first_column = k // grid.blocks * grid.rows, k % grid.blocks * grid.columns
        rows = (first_row, min(first_row + grid.rows, height))
        columns = (first_column, min(first_column + grid.columns, width))
        bounds = (rows[0], rows[1], start, end, middle_depth(start, end, splats))
        for first in range(0, views, VIEWS_AT_ONCE):
            view, count = np.uint64(first), np.uint64(min(VIEWS_AT_ONCE, views - first))
            low, high, lens_offset = np.float32(columns[0]), np.float32(columns[1]), np.float32(camera.offset_y)
            materials, lights, own_eye = splats.materials, splats.lights, splats.own_eye
            lit = (splats.backs, materials, lights, own_eye)
            place = Place(offsets, view, count, low, high, np.int32(stride), lens_offset, *lit)
            load_depths(rows, columns, count, stride, (height, width), view, depths, scratch.planes)
            for stage in range(BLEND):
                draw_surfels(draw_chord, is_hidden, place, stage, bounds, splats, camera, scratch)
                find_farthest(rows[1] - rows[0], count, stride, scratch.planes)
            draw_surfels(draw_chord, is_hidden, place, BLEND, bounds, splats, camera, scratch)
            store_samples(rows, columns, count, stride, (height, width), view, scratch.planes, colors, depths)
