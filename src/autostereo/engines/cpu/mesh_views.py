"""Meshes to a stack of views: a block of rows and columns of every view at a time, in cache.

For each triangle and row, its segment (mesh_raster) is drawn into all views before the next: the pixels that it covers
in each view (SIMD over views), then the first covered sample of every view, the second, and so on: depth, colour
(SIMD over views), then one scalar pass that keeps what is nearer. Dearer shading collects the visible samples of the
segment in lists first, so that it is SIMD over visible samples only.
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
    LANE_U,
    LANE_Z,
    OFFSET,
    RUN,
    START,
    ZERO,
    U,
    X,
    Z,
    whole_steps,
)
from .samples import COLOR_MASK, DEPTH_SHIFT, clear_samples, hit, nearer, plain_color, word

VIEWS_AT_ONCE = 512  # leaves the lists room for the samples of two steps


@inlined
def find_runs(views, first_view, ends, block, offsets, lists, ints):
    """First covered pixel, number of covered pixels and its place in the band for each view; returns the longest run.

    block = (first column, end column, sample_x, place of the row in the band, words from view to view).
    """
    x1, p1, x2, p2 = ends
    low, high, sample_x, row, stride = block
    lanes = whole_steps(views)
    for v in range(lanes):
        offset = offsets[first_view + v]
        start = min(max(np.ceil(x1 + offset * p1 - sample_x), low), high)
        end = min(max(np.ceil(x2 + offset * p2 - sample_x), low), high)
        lists[START + v] = start
        lists[RUN + v] = end - start
    for v in range(lanes):  # in 32 bits: SIMD has no quick product of 64
        ints[BASE + v] = np.int32(np.int32(np.int32(v) * stride) + np.int32(row + np.int32(lists[START + v] - low)))
    longest = np.int32(0)
    for v in range(lanes):
        longest = max(longest, np.int32(lists[RUN + v]))
    return longest


@inlined
def make_words(views, first_view, k, sample_x, ends, depths, color, offsets, lists, words):
    """The k-th covered sample of each view, with its interpolated colour; 0 beyond a view's run."""
    step = np.float32(k)
    at = step + sample_x
    for v in range(whole_steps(views)):
        _, z, u = hit(lists[START + v] + at, offsets[first_view + v], ends, depths)
        words[np.uint64(2) * v] = plain_color(u, color)
        words[np.uint64(2) * v + np.uint64(1)] = np.float32(z if step < lists[RUN + v] else ZERO).view(np.int32)


@inlined
def keep_nearer(views, k, ints, words, band):
    """Depth test and store of one sample per view."""
    for v in range(views):
        a = np.uint64(ints[BASE + v] + k)
        old, new = band[a], words[v]
        band[a] = new if nearer(new, old) else old


@inlined
def list_visible(views, first_view, k, n, at, offsets, lists, ints, band):
    """Depth test of one sample per view; the visible ones join the list, whose new length is returned."""
    for v in range(views):
        a = np.uint64(ints[BASE + v] + k)
        old = band[a]
        z = lists[LANE_Z + v]
        new = word(z, np.int32(0))
        visible = nearer(new, old)
        band[a] = new if visible else old
        ints[ADDRESS + n] = np.int32(a)
        lists[U + n] = lists[LANE_U + v]
        lists[Z + n] = z
        lists[X + n] = lists[START + v] + at
        lists[OFFSET + n] = offsets[first_view + v]
        n += np.uint64(visible)
    return n


@inlined
def test_lanes(views, first_view, k, sample_x, ends, depths, offsets, lists):
    """Inverse depth (0 beyond a view's run) and perspective parameter of the k-th covered sample of each view."""
    step = np.float32(k)
    at = step + sample_x
    for v in range(whole_steps(views)):
        _, z, u = hit(lists[START + v] + at, offsets[first_view + v], ends, depths)
        lists[LANE_U + v] = u
        lists[LANE_Z + v] = z if step < lists[RUN + v] else ZERO


class Place(NamedTuple):
    """What draw_segment reads of a block.

    offsets (V + 15,) float32, the last one repeated, so that SIMD works in whole steps; number of views; columns
    first … end; sample_x; width of the picture.
    """

    offsets: np.ndarray
    views: int
    first: int
    end: int
    sample_x: np.float32
    width: np.float32


@inlined
def draw_segment(place, row, ends, depths, plain, shader, shading, scratch):
    """Draw one segment in every view; shading = (material, side, row, gradient)."""
    offsets, sample_x = place.offsets, place.sample_x
    lists, ints, segment, band = scratch.lists, scratch.ints, scratch.segment, scratch.band
    colors, spans, counts = scratch.colors, scratch.spans, scratch.counts
    low, high = np.float32(place.first), np.float32(place.end)
    stride = np.int32(place.end - place.first)
    base = np.int32(row) * stride * np.int32(place.views)
    color = (segment[0], segment[1], segment[2], segment[16], segment[17], segment[18])
    if shader.exact.shape[0] > 0 and not plain:
        shade_exact(ends, depths, sample_x, place.width, shader, shading, segment, lists, ints, colors, spans)
    n = np.uint64(0)
    for first in range(0, place.views, VIEWS_AT_ONCE):
        first_view = np.uint64(first)
        views = np.uint64(min(VIEWS_AT_ONCE, place.views - first))
        here = (low, high, sample_x, base + np.int32(first) * stride, stride)
        longest = find_runs(views, first_view, ends, here, offsets, lists, ints)
        for k in range(longest):
            if plain:
                make_words(views, first_view, k, sample_x, ends, depths, color, offsets, lists, scratch.halves)
                keep_nearer(views, k, ints, scratch.words, band)
                continue
            test_lanes(views, first_view, k, sample_x, ends, depths, offsets, lists)
            n = list_visible(views, first_view, k, n, np.float32(k) + sample_x, offsets, lists, ints, band)
            if n > np.uint64(CAPACITY) - views:
                finish_list(n, sample_x, shader, shading, segment, lists, ints, colors, spans, counts, band)
                n = np.uint64(0)
    if n > np.uint64(0):
        finish_list(n, sample_x, shader, shading, segment, lists, ints, colors, spans, counts, band)


@inlined
def store_views(rows, columns, height, width, views, band, line):
    """Copy the band's colours to the pictures, which are `line`, (V·H·W,) int32."""
    k = np.uint64(0)
    count = np.uint64(columns[1] - columns[0])
    for r in range(rows[0], rows[1]):
        for view in range(views):
            first = np.uint64((view * height + r) * width + columns[0])
            for x in range(count):
                line[first + x] = np.int32(band[k + x] & COLOR_MASK)
            k += count


@inlined
def store_background(rows, columns, height, width, views, background, line):
    """Fill the pictures where there is nothing to draw."""
    count = np.uint64(columns[1] - columns[0])
    for r in range(rows[0], rows[1]):
        for view in range(views):
            first = np.uint64((view * height + r) * width + columns[0])
            for x in range(count):
                line[first + x] = background


@inlined
def store_depth(rows, columns, focal, band, nearest, out):
    """Write eye depth (V, H, W), inf where empty; with `nearest`, keep what is nearer."""
    k = np.uint64(0)
    for r in range(rows[0], rows[1]):
        for view in range(out.shape[0]):
            for x in range(columns[0], columns[1]):
                depth = focal / np.int32(band[k] >> DEPTH_SHIFT).view(np.float32)
                out[view, r, x] = min(depth, out[view, r, x]) if nearest else depth
                k += np.uint64(1)


@inlined
def add_samples(count, band, sums):
    """Add the band's colours to the sums, four channels a pixel."""
    for k in range(count):
        for c in range(4):
            sums[4 * k + c] += np.uint16((band[k] >> np.int64(8 * c)) & np.int64(255))


@inlined
def store_means(rows, columns, samples, sums, out):
    """Write the rounded means of the sums to the pictures, and clear the sums."""
    k = 0
    half = samples // 2
    for r in range(rows[0], rows[1]):
        for view in range(out.shape[0]):
            for x in range(columns[0], columns[1]):
                rgba = np.int32(0)
                for c in range(4):
                    rgba |= np.int32((np.int64(sums[k + c]) + half) // samples) << np.int32(8 * c)
                    sums[k + c] = np.uint16(0)
                out[view, r, x] = rgba
                k += 4


@kernel
def draw_views(bins, surface, camera, shader, offsets, background, side, scratch, out, depth):
    """Draw bins (first, end, rows per band, blocks a row, columns per block) of every view into out (V, H, W) int32.

    side² samples a pixel; depth (V, H, W) float32, or of no size when it is not wanted.
    """
    views, height, width = out.shape
    line = out.reshape(-1)
    for k in range(bins[0], bins[1]):
        first_row, first_column = k // bins[3] * bins[2], k % bins[3] * bins[4]
        rows = (first_row, min(first_row + bins[2], height))
        columns = (first_column, min(first_column + bins[4], width))
        if surface.bin_start[k] == surface.bin_start[k + 1] and depth.size == 0:
            store_background(rows, columns, height, width, views, background, line)
            continue
        count = (rows[1] - rows[0]) * views * (columns[1] - columns[0])
        for s in range(side * side):
            clear_samples(count, background, scratch.band)
            sample = ((s % side + 0.5) / side, (s // side + 0.5) / side)
            place = Place(offsets, views, columns[0], columns[1], np.float32(sample[0]), np.float32(width))
            draw_block(draw_segment, place, rows, k, surface, camera, shader, sample, scratch)
            if side > 1:
                add_samples(count, scratch.band, scratch.sums)
            if depth.size > 0:
                store_depth(rows, columns, np.float32(camera.focal), scratch.band, s > 0, depth)
        if side > 1:
            store_means(rows, columns, side * side, scratch.sums, out)
        else:
            store_views(rows, columns, height, width, views, scratch.band, line)
