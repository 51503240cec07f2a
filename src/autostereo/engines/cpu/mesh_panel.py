"""Meshes straight to an interlaced panel: every sub-pixel its own camera offset, no stack of views in between.

A segment visits, group by group of a row's plan (panel_plan), the stretch of sub-pixels that it may cover, SIMD over
sub-pixels; whether it does cover one is decided by the expression of every other draw (samples.hit).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_raster import cut_triangle, fill_segment, fill_uv, row_geometry, rows_of, uv_gradient
from .mesh_reuse import finish_list, shade_exact
from .mesh_shade import (
    ADDRESS,
    BASE,
    CAPACITY,
    END,
    LANE_OFFSET,
    LANE_U,
    LANE_X,
    LANE_Z,
    OFFSET,
    ONE,
    PLACE,
    RUN,
    START,
    ZERO,
    U,
    X,
    Z,
)
from .mesh_views import NO_GRADIENT
from .panel_plan import PAD
from .panel_row import add_row, collect_row, row_offsets, set_places, store_background, store_row
from .samples import clear_samples, hit, nearer, plain_color, word

STRETCH = np.uint64(512)  # samples handled at once
SLACK = np.float32(4e-3)
ACROSS = 400  # samples, up to which a segment's short stretches are drawn together


class PanelNumbers(NamedTuple):
    """How the panel is sampled: its map (gather.map_args), flips, sub-pixel sampling."""

    map: tuple
    flip_x: bool
    flip_y: bool
    subpixel: bool


@inlined
def make_words(count, k, at, ends, depths, color, x, offset, halves):
    """Words of the samples from k on; 0 where the segment does not cover them."""
    for i in range(count):
        covered, z, u = hit(x[k + i] + at, offset[k + i], ends, depths)
        halves[np.uint64(2) * i] = plain_color(u, color)
        halves[np.uint64(2) * i + np.uint64(1)] = np.float32(z if covered else ZERO).view(np.int32)


@inlined
def keep_nearer(count, k, words, band):
    """Depth test and store of the samples from k on."""
    for i in range(count):
        old, new = band[k + i], words[i]
        band[k + i] = new if nearer(new, old) else old


@inlined
def test_stretch(count, k, at, ends, depths, x, offset, lists):
    """Inverse depth (0 where not covered) and perspective parameter of the samples from k on."""
    for i in range(count):
        covered, z, u = hit(x[k + i] + at, offset[k + i], ends, depths)
        lists[LANE_U + i] = u
        lists[LANE_Z + i] = z if covered else ZERO


@inlined
def list_visible(count, k, n, at, x, offset, lists, ints, band):
    """Depth test of the samples from k on; the visible ones join the list, whose new length is returned."""
    for i in range(count):
        old = band[k + i]
        z = lists[LANE_Z + i]
        new = word(z, np.int32(0))
        visible = nearer(new, old)
        band[k + i] = new if visible else old
        ints[ADDRESS + n] = np.int32(k + i)
        lists[U + n] = lists[LANE_U + i]
        lists[Z + n] = z
        lists[X + n] = x[k + i] + at
        lists[OFFSET + n] = offset[k + i]
        n += np.uint64(visible)
    return n


@inlined
def find_stretches(ends, at, width, shift, margin, first, bounds, lists, ints):
    """Stretch of every group that the segment may cover; returns the number of samples in all."""
    x1, p1, x2, p2 = ends
    groups = np.uint64(bounds.shape[1])
    limit = np.float32(width)
    before, after = at[0], at[1]
    for g in range(groups):
        low, high = bounds[0, g], bounds[1, g]
        left = min(x1 + low * p1, x1 + high * p1) - before
        right = max(x2 + low * p2, x2 + high * p2) - after
        lists[START + g] = np.ceil(min(max(left, ZERO), limit))
        lists[RUN + g] = np.ceil(min(max(right, ZERO), limit))
    total = np.int32(0)
    move = np.int32(margin) - np.int32(shift)
    for g in range(groups):
        k = first[np.uint64(np.int32(lists[START + g]) + move), g]
        stop = first[np.uint64(np.int32(lists[RUN + g]) + move), g]
        ints[BASE + g], ints[END + g] = k, stop
        total += max(stop - k, np.int32(0))
    return total


@inlined
def take_lanes(groups, nothing, x, offset, lists, ints):
    """Bring the stretches of all groups together, four samples at a time without a branch; returns their number.

    It is rounded up to whole SIMD steps with `nothing`, a sample that nothing covers. All are brought before any is
    used: a SIMD load right after the single stores would have to wait for them.
    """
    n = np.uint64(0)
    for g in range(groups):
        k, end = ints[BASE + g], ints[END + g]
        while k < end:
            for i in range(4):
                m, j = n + np.uint64(i), np.uint64(k + np.int32(i))
                ints[PLACE + m] = np.int32(j)
                lists[LANE_X + m] = x[j]
                lists[LANE_OFFSET + m] = offset[j]
            n += np.uint64(min(end - k, np.int32(4)))
            k += np.int32(4)
    count = (n + np.uint64(15)) & ~np.uint64(15)
    for m in range(n, count):
        ints[PLACE + m] = nothing
        lists[LANE_X + m] = x[np.uint64(nothing)]
        lists[LANE_OFFSET + m] = offset[np.uint64(nothing)]
    return count


@inlined
def make_lane_words(groups, at, ends, depths, color, lists, halves):
    """Words of the lanes; 0 where the segment does not cover them."""
    for g in range(groups):
        covered, z, u = hit(lists[LANE_X + g] + at, lists[LANE_OFFSET + g], ends, depths)
        halves[np.uint64(2) * g] = plain_color(u, color)
        halves[np.uint64(2) * g + np.uint64(1)] = np.float32(z if covered else ZERO).view(np.int32)


@inlined
def keep_nearer_lanes(groups, ints, words, band):
    """Depth test and store of the lanes."""
    for g in range(groups):
        a = np.uint64(ints[PLACE + g])
        old, new = band[a], words[g]
        band[a] = new if nearer(new, old) else old


@inlined
def list_visible_lanes(groups, n, at, ends, depths, lists, ints, band):
    """Depth test of the lanes; the visible ones join the list, whose new length is returned."""
    for g in range(groups):
        covered, z, u = hit(lists[LANE_X + g] + at, lists[LANE_OFFSET + g], ends, depths)
        lists[LANE_U + g] = u
        lists[LANE_Z + g] = z if covered else ZERO
    for g in range(groups):
        a = np.uint64(ints[PLACE + g])
        old = band[a]
        z = lists[LANE_Z + g]
        new = word(z, np.int32(0))
        visible = nearer(new, old)
        band[a] = new if visible else old
        ints[ADDRESS + n] = np.int32(a)
        lists[U + n] = lists[LANE_U + g]
        lists[Z + n] = z
        lists[X + n] = lists[LANE_X + g] + at
        lists[OFFSET + n] = lists[LANE_OFFSET + g]
        n += np.uint64(visible)
    return n


@inlined
def draw_segment(
    width,
    shift,
    margin,
    ends,
    depths,
    plain,
    shader,
    shading,
    first,
    bounds,
    at,
    x,
    offset,
    band,
    segment,
    lists,
    ints,
    words,
    halves,
    colors,
    spans,
    counts,
):
    """Draw one segment in every sub-pixel; shading = (material, side, row, gradient).

    Short stretches are drawn together, long ones group by group.
    """
    color = (segment[0], segment[1], segment[2], segment[16], segment[17], segment[18])
    if shader.exact.shape[0] > 0 and not plain:
        shade_exact(ends, depths, at, np.float32(width), shader, shading, segment, lists, ints, colors, spans)
    n = np.uint64(0)
    groups = np.uint64(bounds.shape[1])
    # rounding moves an end by less than SLACK; samples at sub-pixels lie anywhere in their pixel
    reach = (at + SLACK, at - SLACK) if at > ZERO else (ONE, ZERO)
    total = find_stretches(ends, reach, width, shift, margin, first, bounds, lists, ints)
    across = total <= ACROSS
    if across:
        count = take_lanes(groups, np.int32(x.shape[0] - 1), x, offset, lists, ints)
        if plain:
            make_lane_words(count, at, ends, depths, color, lists, halves)
            keep_nearer_lanes(count, ints, words, band)
        else:
            n = list_visible_lanes(count, n, at, ends, depths, lists, ints, band)
    for g in range(groups if across else np.uint64(0), groups):
        k, stop = np.uint64(ints[BASE + g]), np.uint64(ints[END + g])
        while k < stop:
            count = min((stop - k + np.uint64(15)) & ~np.uint64(15), STRETCH)
            if plain:
                make_words(count, k, at, ends, depths, color, x, offset, halves)
                keep_nearer(count, k, words, band)
            else:
                test_stretch(count, k, at, ends, depths, x, offset, lists)
                n = list_visible(count, k, n, at, x, offset, lists, ints, band)
                if n > np.uint64(CAPACITY) - STRETCH:
                    finish_list(n, at, shader, shading, segment, lists, ints, colors, spans, counts, band)
                    n = np.uint64(0)
            k += count
    if n > np.uint64(0):
        finish_list(n, at, shader, shading, segment, lists, ints, colors, spans, counts, band)


@inlined
def draw_row(r, bin_index, surface, camera, shader, sample_y, at, shift, margin, first, bounds, x, offset, scratch):
    """Draw row r of the picture into its samples."""
    vertices, attributes, uv, wanted = surface.vertices, surface.attributes, surface.uv, surface.columns
    triangles, bins, face_material, materials = (
        surface.triangles,
        surface.bins,
        surface.face_material,
        surface.materials,
    )
    band, segment, lists, ints = scratch.band, scratch.segment, scratch.lists, scratch.ints
    words, halves = scratch.words, scratch.halves
    colors, spans, counts = scratch.colors, scratch.spans, scratch.counts
    width, y = int(camera.width), r + sample_y
    for entry in range(surface.bin_start[bin_index], surface.bin_start[bin_index + 1]):
        index = np.uint64(bins[entry])
        code = triangles[index, 3]
        corners = (np.uint64(triangles[index, 0]), np.uint64(triangles[index, 1]), np.uint64(triangles[index, 2]))
        row0, row1 = rows_of(vertices, corners, sample_y, r, r + 1)
        if row0 >= row1:
            continue
        m = np.uint64(face_material[code >> 1])
        material = (materials[m, 0], materials[m, 1], materials[m, 2], materials[m, 3], materials[m, 5])
        textured, plain = materials[m, 5] >= ZERO, not shader.per_sample and materials[m, 6] != ZERO
        gradient = uv_gradient(vertices, uv, corners, camera) if textured else NO_GRADIENT
        left, right = cut_triangle(vertices, corners, code & 1, y, camera)
        for side in range(2 if materials[m, 4] != ZERO else 1):
            if side == 1:
                left, right = right, left
            ends, depths = (left[0], left[2], right[0], right[2]), (left[1], right[1])
            begin = 6 if side == 1 and not shader.per_sample else 0
            fill_segment(attributes, left, right, begin, wanted, segment)
            if textured:
                fill_uv(uv, corners, left, right, segment)
            shading = (material, side, row_geometry(y, camera), gradient)
            draw_segment(
                width,
                shift,
                margin,
                ends,
                depths,
                plain,
                shader,
                shading,
                first,
                bounds,
                at,
                x,
                offset,
                band,
                segment,
                lists,
                ints,
                words,
                halves,
                colors,
                spans,
                counts,
            )


@kernel
def draw_panel(bands, surface, camera, shader, panel, plans, background, empty_row, side, row_memory, scratch, out):
    """Draw bands (first, end, rows per band) of the panel into out (H, W, 3) uint8, side² samples a sub-pixel.

    row_memory = (offset (N,) and place (N,) float32 of the row's samples, scratch (N,) float64, line (N + 3,) uint8).
    """
    height, width, _ = out.shape
    offset, places, u, line = row_memory
    flat = out.reshape(-1)
    samples = side * side
    for band in range(bands[0], bands[1]):
        empty = surface.bin_start[band] == surface.bin_start[band + 1]
        for r in range(band * bands[2], min((band + 1) * bands[2], height)):
            row = height - 1 - r if panel.flip_y else r
            if empty:
                store_background(row, empty_row, flat)
                continue
            c, shift = plans.row_class[r], plans.row_shift[r]
            x, kind, slot, first = plans.x[c], plans.kind[c], plans.slot[c], plans.first[c]
            begin = 3 * (plans.margin - shift)
            count = x.shape[0] - PAD
            row_offsets(row, width, panel.map, panel.flip_x, x, kind, shift, plans.constants, plans.offsets, u, offset)
            for s in range(samples):
                part_x, part_y = (s % side + 0.5) / side, (s // side + 0.5) / side
                set_places(shift, panel.subpixel, part_x, x, slot, places)
                clear_samples(count + PAD, background, scratch.band)
                at = ZERO if panel.subpixel else np.float32(part_x)
                draw_row(
                    r,
                    band,
                    surface,
                    camera,
                    shader,
                    part_y,
                    at,
                    shift,
                    plans.margin,
                    first,
                    plans.bounds,
                    places,
                    offset,
                    scratch,
                )
                collect_row(count, slot, scratch.band, line)
                if samples > 1:
                    add_row(line, begin, width, s, samples, scratch.sums, line)
            store_row(line, begin, panel.flip_x, row, (height, width), flat)
