"""Meshes straight to an interlaced panel: every sub-pixel its own camera offset, no stack of views in between.

For each segment (mesh_raster): the lines of sub-pixels (panel_lines) that it may meet, and the interval of each that
it may cover (SIMD over lines); these samples in one list; coverage, depth and colour at their exact offsets by the
expressions of every other draw (SIMD over samples); then one scalar pass that keeps what is nearer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_block import draw_block
from .mesh_reuse import finish_list, shade_exact
from .mesh_shade import (
    ADDRESS,
    BASE,
    CAPACITY,
    LANE_OFFSET,
    LANE_U,
    LANE_X,
    LANE_Z,
    OFFSET,
    ONE,
    RUN,
    ZERO,
    U,
    X,
    Z,
    quantize,
    whole_steps,
)
from .panel_lines import BUCKET, LinePlan, make_lines, row_offsets
from .samples import hit, nearer, word

LINES_AT_ONCE = 512
SLACK = np.float32(4e-3)  # rounding moves the end of a segment by less
FAR = np.float32(1e9)
LONG = 8  # samples in a line, from which a line is listed at once


class Panel(NamedTuple):
    """How a panel is sampled: its lines, flips, sub-pixel sampling."""

    plan: LinePlan
    flip_x: bool
    flip_y: bool
    subpixel: bool


class Block(NamedTuple):
    """Samples of a few rows of the panel, one thread's own memory.

    offsets (R·3·B,) float32: camera offset of each sample, at row·3·B + channel·B + pixel; lines, addresses, starts
    (R, …): see make_lines; found, found_ints, u: scratch.
    """

    offsets: np.ndarray
    lines: np.ndarray
    addresses: np.ndarray
    starts: np.ndarray
    found: np.ndarray
    found_ints: np.ndarray
    u: np.ndarray


class Place(NamedTuple):
    """What draw_segment reads of a block: its memory, first pixel and number of pixels.

    at: place of the sample in its pixel, by channel, that which they share (0 if none), their middle and how far they
    lie from it; width of the panel.
    """

    block: Block
    plan: LinePlan
    first: int
    columns: int
    at: tuple
    width: np.float32


@inlined
def interval(slope, misfit, period, drift, bounded_below):
    """How an edge that moves by `slope` pixels per unit of offset bounds a line's samples.

    The sample j with x = x0 + j·period and offset o0 + j·drift lies right of the edge where
    j·(period − drift·slope) ≥ gap. Returns what gap is to be multiplied by, and what is to be added for the first and
    for the last sample; both infinite where the edge is nearly parallel to the line.
    """
    across = period - drift * slope
    slack = misfit * abs(slope) + SLACK
    if abs(across) * np.float32(512.0) < slack:
        return ZERO, -FAR, FAR
    inverse = ONE / across
    slack = abs(slack * inverse)
    if (across > ZERO) == bounded_below:
        return inverse, -slack, FAR
    return inverse, -FAR, slack


@inlined
def find_intervals(first, count, row, ends, place, lists, ints):
    """Samples of each line that the segment may cover: place of the first and their number; returns the most."""
    listed = count
    x1, p1, x2, p2 = ends
    plan, lines, addresses = place.plan, place.block.lines, place.block.addresses
    at, spread = place.at[4], place.at[5]
    period = np.float32(plan.period)
    drift, misfit = np.float32(plan.slope * plan.step), np.float32(plan.misfit)
    by1, low1, high1 = interval(p1, misfit, period, drift, True)
    by2, low2, high2 = interval(p2, misfit, period, drift, False)
    low1, high1 = low1 - spread * abs(by1), high1 + spread * abs(by1)
    low2, high2 = low2 - spread * abs(by2), high2 + spread * abs(by2)
    x, samples, offset = lines[row, 0], lines[row, 1], lines[row, 2]
    address = addresses[row]
    count = whole_steps(count)
    for i in range(count):
        k = first + i
        gap1 = (x1 + offset[k] * p1 - x[k] - at) * by1
        gap2 = (x2 + offset[k] * p2 - x[k] - at) * by2
        start = min(max(max(np.ceil(gap1 + low1), np.ceil(gap2 + low2)), ZERO), samples[k])
        end = min(min(np.floor(gap1 + high1), np.floor(gap2 + high2)) + ONE, samples[k])
        lists[RUN + i] = end - start
        lists[LANE_X + i] = start
    for i in range(count):
        ints[BASE + i] = np.int32(address[first + i] + np.int32(lists[LANE_X + i] * period))
    most = np.int32(0)
    for i in range(listed):
        most = max(most, np.int32(lists[RUN + i]))
    return most


@inlined
def place_samples(n, row, place, lists, ints):
    """Pixel position and exact camera offset of the listed samples."""
    offsets, red, green, blue = place.block.offsets, place.at[0], place.at[1], place.at[2]
    begin, first, columns = np.int32(row * 3 * place.columns), np.float32(place.first), np.float32(place.columns)
    for i in range(n):
        lists[LANE_OFFSET + i] = offsets[np.uint64(ints[ADDRESS + i])]
    for i in range(n):
        k = np.float32(np.int32(ints[ADDRESS + i] - begin))
        at = red if k < columns else (green if k < columns + columns else blue)
        k = k if k < columns else (k - columns if k < columns + columns else k - columns - columns)
        lists[LANE_X + i] = (k + first) + at


@inlined
def make_words(n, row, columns, ends, depths, color, lists, ints, halves):
    """Words of the listed samples, the colour that of their own channel; 0 where the segment does not cover them."""
    r, g, b, dr, dg, db = color
    begin, green, blue = np.int32(row * 3 * columns), np.float32(columns), np.float32(2 * columns)
    for i in range(n):
        covered, z, u = hit(lists[LANE_X + i], lists[LANE_OFFSET + i], ends, depths)
        k = np.float32(np.int32(ints[ADDRESS + i] - begin))
        start = r if k < green else (g if k < blue else b)
        step = dr if k < green else (dg if k < blue else db)
        shift = np.int32(0) if k < green else (np.int32(8) if k < blue else np.int32(16))
        halves[np.uint64(2) * i] = quantize(start + u * step) << shift
        halves[np.uint64(2) * i + np.uint64(1)] = np.float32(z if covered else ZERO).view(np.int32)


@inlined
def keep_nearer(n, ints, words, band):
    """Depth test and store of the listed samples."""
    for i in range(n):
        a = np.uint64(ints[ADDRESS + i])
        old, new = band[a], words[i]
        band[a] = new if nearer(new, old) else old


@inlined
def keep_visible(n, ends, depths, lists, ints, band):
    """Depth test of the listed samples; the visible ones stay in the list, whose new length is returned."""
    for i in range(n):
        covered, z, u = hit(lists[LANE_X + i], lists[LANE_OFFSET + i], ends, depths)
        lists[LANE_U + i] = u
        lists[LANE_Z + i] = z if covered else ZERO
    kept = np.uint64(0)
    for i in range(n):
        a = np.uint64(ints[ADDRESS + i])
        old, z = band[a], lists[LANE_Z + i]
        new = word(z, np.int32(0))
        visible = nearer(new, old)
        band[a] = new if visible else old
        ints[ADDRESS + kept] = np.int32(a)
        lists[U + kept] = lists[LANE_U + i]
        lists[Z + kept] = z
        lists[X + kept] = lists[LANE_X + i]
        lists[OFFSET + kept] = lists[LANE_OFFSET + i]
        kept += np.uint64(visible)
    return kept


@inlined
def draw_listed(n, row, place, ends, depths, plain, shader, shading, scratch):
    """Draw the listed samples of a segment."""
    lists, ints, segment = scratch.lists, scratch.ints, scratch.segment
    for i in range(16):  # whole SIMD steps
        ints[ADDRESS + n + np.uint64(i)] = np.int32(row) * np.int32(3) * np.int32(place.columns)
    whole = whole_steps(n)
    place_samples(whole, row, place, lists, ints)
    if plain:
        color = (segment[0], segment[1], segment[2], segment[16], segment[17], segment[18])
        make_words(whole, row, place.columns, ends, depths, color, lists, ints, scratch.halves)
        keep_nearer(n, ints, scratch.words, scratch.band)
        return
    n = keep_visible(n, ends, depths, lists, ints, scratch.band)
    if n > np.uint64(0):
        colors, spans, counts = scratch.colors, scratch.spans, scratch.counts
        finish_list(n, place.at[3], shader, shading, segment, lists, ints, colors, spans, counts, scratch.band)


@inlined
def draw_segment(place, row, ends, depths, plain, shader, shading, scratch):
    """Draw one segment in every sub-pixel; shading = (material, side, row, gradient)."""
    lists, ints, segment = scratch.lists, scratch.ints, scratch.segment
    x1, p1, x2, p2 = ends
    plan = place.plan
    if shader.exact.shape[0] > 0 and not plain:
        shade_exact(
            ends, depths, place.at[3], place.width, shader, shading, segment, lists, ints, scratch.colors, scratch.spans
        )
    low, high = np.float32(plan.low), np.float32(plan.high)
    left = min(x1 + low * p1, x1 + high * p1) - np.float32(2.0)
    right = max(x2 + low * p2, x2 + high * p2) + np.float32(1.0)
    first, columns = np.float32(place.first), np.float32(place.columns)
    if right < first or left > first + columns:
        return
    starts = place.block.starts[row]
    left = max(left - first - np.float32(plan.reach), ZERO)
    right = min(right - first, columns - ONE)
    line, stop = starts[np.int64(left) >> BUCKET], starts[(np.int64(right) >> BUCKET) + 1]
    n = np.uint64(0)
    period = np.int32(plan.period)
    while line < stop:
        count = np.uint64(min(stop - line, LINES_AT_ONCE))
        most = find_intervals(np.uint64(line), count, row, ends, place, lists, ints)
        for k in range(min(most, np.int32(LONG))):
            if n > np.uint64(CAPACITY - LINES_AT_ONCE):
                draw_listed(n, row, place, ends, depths, plain, shader, shading, scratch)
                n = np.uint64(0)
            for i in range(count):
                ints[ADDRESS + n] = ints[BASE + i] + np.int32(k) * period
                n += np.uint64(lists[RUN + i] > np.float32(k))
        if most > np.int32(LONG):
            for i in range(count):
                for k in range(np.int32(LONG), np.int32(lists[RUN + i])):
                    if n >= np.uint64(CAPACITY - LINES_AT_ONCE):
                        draw_listed(n, row, place, ends, depths, plain, shader, shading, scratch)
                        n = np.uint64(0)
                    ints[ADDRESS + n] = ints[BASE + i] + np.int32(k) * period
                    n += np.uint64(1)
        line += np.int64(count)
    if n > np.uint64(0):
        draw_listed(n, row, place, ends, depths, plain, shader, shading, scratch)


@kernel
def drawn_columns(bin_index, columns, surface, camera, plan):
    """The pixels (first, end) of a block that its triangles may cover from some camera."""
    left, right = np.float64(columns[1]), np.float64(columns[0])
    scale = camera.fx / camera.focal
    for entry in range(surface.bin_start[bin_index], surface.bin_start[bin_index + 1]):
        for k in range(3):
            corner = np.uint64(surface.triangles[np.uint64(surface.bins[entry]), k])
            x, p = surface.vertices[corner, 0], scale * (1.0 - surface.vertices[corner, 2])
            left = min(left, x + plan.low * p, x + plan.high * p)
            right = max(right, x + plan.low * p, x + plan.high * p)
    first = max(np.int64(max(left - 2.0, 0.0)), columns[0])
    return first, max(min(np.int64(min(right, 1e9)) + 2, columns[1]), first)


@inlined
def clear_row(begin, count, plane, background, band):
    """Empty samples of a row: infinitely far, the background's colour."""
    empty = np.int64(background) & np.int64(0xFFFFFFFF)
    for c in range(3):
        first = np.uint64(begin + c * plane)
        for i in range(np.uint64(count)):
            band[first + i] = empty


@inlined
def store_row(target, step, begin, count, plane, band, out):
    """Copy `count` pixels to `out`, (H·W·3,) uint8, from place `target` on; step −3 mirrors them."""
    red, green, blue = np.uint64(begin), np.uint64(begin + plane), np.uint64(begin + 2 * plane)
    if step == 3:
        first = np.uint64(target)
        for i in range(np.uint64(count)):
            out[first + np.uint64(3) * i] = np.uint8(band[red + i])
            out[first + np.uint64(3) * i + np.uint64(1)] = np.uint8(band[green + i] >> np.int64(8))
            out[first + np.uint64(3) * i + np.uint64(2)] = np.uint8(band[blue + i] >> np.int64(16))
        return
    for i in range(count):
        a = np.uint64(target - 3 * i)
        out[a] = np.uint8(band[red + np.uint64(i)])
        out[a + np.uint64(1)] = np.uint8(band[green + np.uint64(i)] >> np.int64(8))
        out[a + np.uint64(2)] = np.uint8(band[blue + np.uint64(i)] >> np.int64(16))


@inlined
def add_samples(count, begin, plane, band, sums):
    """Add a row's values to the sums, which lie as the samples do."""
    for c in range(3):
        first = np.uint64(begin + c * plane)
        for i in range(np.uint64(count)):
            sums[first + i] += np.uint16((band[first + i] >> np.int64(8 * c)) & np.int64(255))


@inlined
def take_means(count, begin, plane, samples, band, sums):
    """Put the rounded means in the place of a row's values, and clear the sums."""
    for c in range(3):
        first = np.uint64(begin + c * plane)
        for i in range(np.uint64(count)):
            mean = (np.int64(sums[first + i]) + samples // 2) // samples
            band[first + i] = mean << np.int64(8 * c)
            sums[first + i] = np.uint16(0)


@inlined
def store_background(target, step, count, background, out):
    """Fill `count` pixels of `out` from place `target` on."""
    for i in range(count):
        a = np.uint64(target + step * i)
        out[a] = np.uint8(background & 255)
        out[a + np.uint64(1)] = np.uint8((background >> 8) & 255)
        out[a + np.uint64(2)] = np.uint8((background >> 16) & 255)


@inlined
def store_depth(row, columns, drawn, base, plane, focal, flip, band, depth):
    """Write eye depth of pixels `columns` of a row, inf where empty; depth is (H, W, 3)."""
    width = depth.shape[1]
    for x in range(columns[0], columns[1]):
        column = width - 1 - x if flip else x
        for c in range(3):
            if drawn[0] <= x < drawn[1]:
                a = np.uint64(base + c * plane + x - drawn[0])
                depth[row, column, c] = focal / np.int32(band[a] >> np.int64(32)).view(np.float32)
            else:
                depth[row, column, c] = np.float32(np.inf)


@kernel
def draw_panel(bins, surface, camera, shader, panel, block, background, side, scratch, out, depth):
    """Draw bins (first, end, rows per band, blocks a row, columns per block) into out (H, W, 3) uint8.

    side² samples a sub-pixel; depth (H, W, 3) float32 of the first, or of no size when it is not wanted.
    """
    height, width, _ = out.shape
    flat, plan, plane = out.reshape(-1), panel.plan, bins[4]
    step = -3 if panel.flip_x else 3
    for k in range(bins[0], bins[1]):
        first_row, first = k // bins[3] * bins[2], k % bins[3] * bins[4]
        rows, columns = (first_row, min(first_row + bins[2], height)), (first, min(first + bins[4], width))
        drawn = drawn_columns(k, columns, surface, camera, plan)
        count = drawn[1] - drawn[0]
        for r in range(rows[0], rows[1]) if count > 0 else range(0):
            row, base = height - 1 - r if panel.flip_y else r, (r - rows[0]) * 3 * plane
            row_offsets(row, width, panel.flip_x, drawn, base, first, plane, plan, block.u, block.offsets)
            i = r - rows[0]
            starts, lines, addresses = block.starts[i], block.lines[i], block.addresses[i]
            found = (block.found, block.found_ints)
            make_lines(row, width, panel.flip_x, drawn, base, first, plane, plan, starts, lines, addresses, *found)
        for s in range(side * side) if count > 0 else range(0):
            x, y = (s % side + 0.5) / side, (s // side + 0.5) / side
            one, third = np.float32(x), np.float32(1.0 / 3.0)
            at = (one, one, one, one, one, ZERO)
            if panel.subpixel:
                red, green, blue = np.float32(x / 3.0), np.float32((1.0 + x) / 3.0), np.float32((2.0 + x) / 3.0)
                at = (red, green, blue, ZERO, green, third)
            place = Place(block, plan, first, plane, at, np.float32(width))
            for r in range(rows[0], rows[1]):
                base = (r - rows[0]) * 3 * plane + drawn[0] - first
                clear_row(base, count, plane, background, scratch.band)
            draw_block(draw_segment, place, rows, k, surface, camera, shader, (x, y), scratch)
            for r in range(rows[0], rows[1]) if side > 1 else range(0):
                base = (r - rows[0]) * 3 * plane + drawn[0] - first
                add_samples(count, base, plane, scratch.band, scratch.sums)
        for r in range(rows[0], rows[1]):
            row = height - 1 - r if panel.flip_y else r
            base = (r - rows[0]) * 3 * plane + drawn[0] - first
            if side > 1:
                take_means(count, base, plane, side * side, scratch.band, scratch.sums)
            if depth.size > 0:
                store_depth(
                    row, columns, drawn, base, plane, np.float32(camera.focal), panel.flip_x, scratch.band, depth
                )
            start, end = row * width * 3, (row + 1) * width * 3 - 3
            begin = end if panel.flip_x else start
            store_background(begin + step * columns[0], step, drawn[0] - columns[0], background, flat)
            store_row(begin + step * drawn[0], step, base, count, plane, scratch.band, flat)
            store_background(begin + step * drawn[1], step, columns[1] - drawn[1], background, flat)
