"""Surfels straight to an interlaced panel: every sub-pixel its own camera offset, no stack of views in between.

As points_views, but for each chord (points_chord) it is the lines of sub-pixels that it may meet, and the interval of
each, that are found (panel_lines); these samples make one list, at whose exact offsets depths and weights are those
of every other draw (SIMD over samples), and one scalar pass keeps what is nearest, or adds what is seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .panel_lines import LinePlan, make_lines, row_offsets
from .panel_list import ADDRESS, COLOR, LANE_OFFSET, LANE_U, LANE_X, LANE_Z, Block, draw_stretch, place_samples
from .points_block import BLEND, draw_surfels, middle_depth, swath
from .points_chord import depth_of, is_small, light_at, sees_front, shine_of, weight_of
from .points_setup import BLUE, DEPTH, FRONT, GREEN, ND, NX, NY, REACH, RED, SIDES, SMALL, A, B
from .scalars import ONE, ZERO, quantize, whole_steps

PLANE = np.uint64(12288 + 5 * 16)  # samples of a block; planes must not fall onto the same cache sets
NEAREST, STOP, WEIGHT, SUM, LAST, FARTHEST = (PLANE * np.uint64(k) for k in range(6))
PLANES = 6
CELL = 5  # there is a farthest depth for every 2⁵ pixels
FAR = np.float32(np.inf)
NOBODY = np.int32(-1).view(np.float32)


class Place(NamedTuple):
    """What draw_chord reads of a block: its memory, first pixel and number of pixels, 3·columns samples a row.

    at: see mesh_panel.Place; offset of the lens; see Splats for the rest.
    """

    block: Block
    plan: LinePlan
    first: int
    columns: int
    at: tuple
    lens_offset: np.float32
    backs: np.ndarray
    materials: np.ndarray
    lights: np.ndarray
    own_eye: bool


@inlined
def list_depths(n, chord, depth, lists):
    """Depths of the listed samples, infinite where the chord does not cover them."""
    x1, p1, x2, p2 = chord[0], chord[1], chord[2], chord[3]
    for i in range(n):
        x, offset = lists[LANE_X + i], lists[LANE_OFFSET + i]
        left, right = x1 + offset * p1, x2 + offset * p2
        n_, m_ = x - left, right - x
        at, _ = depth_of(n_, m_, (right - left) * depth, chord)
        lists[LANE_Z + i] = at if (n_ > ZERO) & (m_ > ZERO) else FAR


@inlined
def list_weights(n, chord, depth, lists):
    """Depths and weights of the listed samples."""
    x1, p1, x2, p2 = chord[0], chord[1], chord[2], chord[3]
    for i in range(n):
        x, offset = lists[LANE_X + i], lists[LANE_OFFSET + i]
        left, right = x1 + offset * p1, x2 + offset * p2
        n_, m_ = x - left, right - x
        at, inverse = depth_of(n_, m_, (right - left) * depth, chord)
        lists[LANE_Z + i] = at if (n_ > ZERO) & (m_ > ZERO) else FAR
        lists[LANE_U + i] = weight_of(n_, m_, inverse, chord)


@inlined
def mask_small(n, wanted, record, lens, lists):
    """Put those of the listed samples out of reach that see a disc less than a pixel wide, or that do not."""
    for i in range(n):
        small = is_small(lists[LANE_OFFSET + i], record, lens)
        lists[LANE_Z + i] = lists[LANE_Z + i] if small == wanted else FAR


@inlined
def list_colors(n, row, place, surfel, lists, ints):
    """Colour of a surfel at the listed samples, each that of its own channel and of the side which it sees."""
    record, number, _, parts, material, _ = surfel
    begin = np.int32(row) * np.int32(3) * np.int32(place.columns)
    green, blue = np.int32(place.columns), np.int32(2 * place.columns)
    r, g, b = record[RED], record[GREEN], record[BLUE]
    for i in range(n):
        k = np.int32(ints[ADDRESS + i] - begin)
        lists[COLOR + i] = r if k < green else (g if k < blue else b)
    both = parts & SIDES != 0
    if both:
        i = np.uint64(number)
        r, g, b = place.backs[i, 0], place.backs[i, 1], place.backs[i, 2]
        for i in range(n):
            k = np.int32(ints[ADDRESS + i] - begin)
            back = r if k < green else (g if k < blue else b)
            lists[COLOR + i] = lists[COLOR + i] if sees_front(lists[LANE_OFFSET + i], record) else back
    specular, shininess, lights = place.materials[material, 2], place.materials[material, 3], place.lights
    if specular == ZERO or not place.own_eye:
        return
    d = record[DEPTH]
    centre = (record[A] * d, record[B] * d, d)
    for q in range(lights.shape[0]):
        light, side = light_at(q, record, place.lens_offset, lights)
        if side == ZERO or (side < ZERO and not both):
            continue
        sign = ONE if side > ZERO else -ONE
        normal = (sign * record[NX], sign * record[NY], sign * record[ND])
        r, g, b = specular * lights[q, 4], specular * lights[q, 5], specular * lights[q, 6]
        for i in range(n):
            offset = lists[LANE_OFFSET + i]
            shine = shine_of(offset, centre, normal, light, shininess)
            shine = shine if not both or sees_front(offset, record) == (side > ZERO) else ZERO
            k = np.int32(ints[ADDRESS + i] - begin)
            lists[COLOR + i] += shine * (r if k < green else (g if k < blue else b))


@inlined
def keep_nearest(n, lists, ints, planes):
    """Keep the nearest depth of the listed samples."""
    for i in range(n):
        a = np.uint64(ints[ADDRESS + i])
        depth, nearest = lists[LANE_Z + i], planes[NEAREST + a]
        planes[NEAREST + a] = depth if depth < nearest else nearest


@inlined
def add_weights(n, number, reach, lists, ints, planes):
    """Add weights and weighted colours to the listed samples where a surfel is seen.

    Two lines may hold a sample that lies where the phase wraps: what a sample has of this surfel it gets once.
    """
    mark = np.int32(number).view(np.float32)
    for i in range(n):
        a = np.uint64(ints[ADDRESS + i])
        depth, last = lists[LANE_Z + i], planes[LAST + a]
        seen = (depth - reach <= planes[NEAREST + a]) & (depth < planes[STOP + a])
        seen &= np.float32(last).view(np.int32) != number
        weight = lists[LANE_U + i] if seen else ZERO
        planes[WEIGHT + a] += weight
        planes[SUM + a] += weight * lists[COLOR + i]
        planes[LAST + a] = mark if seen else last


@inlined
def draw_listed(n, place, row, ends, what, scratch):
    """Draw a chord at the listed samples; what = (blending, surfel, chord)."""
    blending, surfel, chord = what
    record, number, part, parts, _, lens = surfel
    lists, ints, planes = scratch.lists, scratch.ints, scratch.planes
    whole = whole_steps(n)
    place_samples(whole, row, place, lists, ints)
    if blending:
        list_weights(whole, chord, record[DEPTH], lists)
    else:
        list_depths(whole, chord, record[DEPTH], lists)
    if parts & SMALL and parts & FRONT:
        mask_small(whole, part == SMALL, record, lens, lists)
    if blending:
        list_colors(whole, row, place, surfel, lists, ints)
        add_weights(n, number, record[REACH] * record[DEPTH], lists, ints, planes)
    else:
        keep_nearest(n, lists, ints, planes)


@inlined
def is_hidden(place, nearest, record, lens, rows, scratch):
    """Whether all that a surfel may touch sees something nearer."""
    low, high = np.float32(place.plan.low), np.float32(place.plan.high)
    left, right = swath(record, lens, low, high)
    first, columns, planes = np.float32(place.first), np.float32(place.columns), scratch.planes
    left, right = max(left - first, ZERO), min(right - first, columns - ONE)
    if left > right:
        return True
    for row in range(rows[0], rows[1]):
        begin = FARTHEST + np.uint64(row * (place.columns >> CELL))
        for c in range(np.uint64(np.int64(left) >> CELL), np.uint64(np.int64(right) >> CELL) + np.uint64(1)):
            if nearest <= planes[begin + c]:
                return False
    return True


@inlined
def draw_chord(place, blending, row, surfel, chord, done, scratch):
    """Draw one chord in every sub-pixel: its depths or, `blending`, its colours where it is seen. See draw_surfels."""
    draw_stretch(draw_listed, place, row, (chord[0], chord[1], chord[2], chord[3]), (blending, surfel, chord), scratch)
    return 0


@inlined
def load_depths(line, base, columns, flip, count, depth, planes):
    """Clear the sums of a row's samples, and take the depths of what is drawn already from `line` of depth."""
    width = depth.shape[1]
    for c in range(3):
        begin = np.uint64(base + c * count)
        for x in range(columns[1] - columns[0]):
            column = width - 1 - columns[0] - x if flip else columns[0] + x
            at = depth[line, column, c]
            a = begin + np.uint64(x)
            planes[NEAREST + a], planes[STOP + a] = at, at
            planes[WEIGHT + a], planes[SUM + a], planes[LAST + a] = ZERO, ZERO, NOBODY


@inlined
def store_samples(line, base, columns, flip, count, planes, color, depth):
    """Write values and depths of a row's samples that see surfels."""
    width = depth.shape[1]
    for c in range(3):
        begin = np.uint64(base + c * count)
        for x in range(columns[1] - columns[0]):
            a = begin + np.uint64(x)
            weight = planes[WEIGHT + a]
            if weight > ZERO:
                column = width - 1 - columns[0] - x if flip else columns[0] + x
                color[line, column, c] = np.uint8(quantize(planes[SUM + a] * (ONE / weight)))
                depth[line, column, c] = planes[NEAREST + a]


@inlined
def find_farthest(rows, columns, planes):
    """The farthest depth of every few pixels of a row."""
    for row in range(rows):
        for c in range(columns >> CELL):
            farthest = ZERO
            for channel in range(3):
                begin = NEAREST + np.uint64((row * 3 + channel) * columns + (c << CELL))
                for k in range(np.uint64(1 << CELL)):
                    farthest = max(farthest, planes[begin + k])
            planes[FARTHEST + np.uint64(row * (columns >> CELL) + c)] = farthest


@kernel
def splat_panel(span, grid, splats, camera, panel, block, scratch, color, depth):
    """Draw the surfels of blocks span[0] … span[1] over color (H, W, 3) uint8 and depth (H, W, 3) float32."""
    height, width, _ = depth.shape
    plan, flip, plane = panel.plan, panel.flip_x, grid.columns
    half, third = np.float32(0.5), np.float32(1.0 / 3.0)
    at = (half, half, half, half, half, ZERO)
    if panel.subpixel:
        at = (np.float32(1.0 / 6.0), half, np.float32(5.0 / 6.0), ZERO, half, third)
    lens_offset = np.float32(camera.offset_y)
    for k in range(span[0], span[1]):
        start, end = splats.bin_start[k], splats.bin_start[k + 1]
        if start == end:
            continue
        first_row, first = k // grid.blocks * grid.rows, k % grid.blocks * grid.columns
        rows, columns = (first_row, min(first_row + grid.rows, height)), (first, min(first + plane, width))
        for r in range(rows[0], rows[1]):
            i, line = r - rows[0], height - 1 - r if panel.flip_y else r
            base = i * 3 * plane
            row_offsets(line, width, flip, columns, base, first, plane, plan, block.u, block.offsets)
            starts, lines, addresses = block.starts[i], block.lines[i], block.addresses[i]
            found = (block.found, block.found_ints)
            make_lines(line, width, flip, columns, base, first, plane, plan, starts, lines, addresses, *found)
            load_depths(line, base, columns, flip, plane, depth, scratch.planes)
        materials, lights, own_eye = splats.materials, splats.lights, splats.own_eye
        place = Place(block, plan, first, plane, at, lens_offset, splats.backs, materials, lights, own_eye)
        bounds = (rows[0], rows[1], start, end, middle_depth(start, end, splats))
        for stage in range(BLEND):
            draw_surfels(draw_chord, is_hidden, place, stage, bounds, splats, camera, scratch)
            find_farthest(rows[1] - rows[0], plane, scratch.planes)
        draw_surfels(draw_chord, is_hidden, place, BLEND, bounds, splats, camera, scratch)
        for r in range(rows[0], rows[1]):
            line = height - 1 - r if panel.flip_y else r
            store_samples(line, (r - rows[0]) * 3 * plane, columns, flip, plane, scratch.planes, color, depth)
