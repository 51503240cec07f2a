"""Meshes to a stack of views: a row of a block of columns of every view at a time, in cache.

For each triangle that meets the row, its segment (mesh_raster) is drawn into all views before the next, LANES views at
a time (SIMD over views): the pixels that it covers in each; then the first two covered samples of every view, the next
two, and so on: depth and colour, and one pass over views that keeps what is nearer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_block import any_kind, draw_row, only_diffuse, only_plain
from .mesh_reuse import shade_exact, shade_or_reuse
from .mesh_shade import ANY, DIFFUSE, PLAIN, diffuse_color, plain_color, to_levels
from .samples import (
    DEPTH_SHIFT,
    EMPTY,
    clear_samples,
    depth_bits,
    empty_samples,
    hit,
    keep_nearer_pairs,
    store_pairs,
)
from .simd import (
    LANES,
    ceil,
    even_lanes,
    fused,
    gather,
    greater,
    lane,
    lesser,
    load,
    mask_word,
    splat,
    store,
    stream,
    to_int,
)

PAST_CACHES = 1 << 24  # pixels, 64 MB


class Place(NamedTuple):
    """What draw_segment reads of a block.

    offsets (V + LANES − 1,) float32, places likewise int32: where each view's samples begin in the band, the last ones
    repeated; number of views; columns first … end; sample_x; width of the picture.
    """

    offsets: np.ndarray
    places: np.ndarray
    views: int
    first: int
    end: int
    sample_x: np.float32
    width: np.float32


@inlined
def make_samples(k, runs, sample_x, what, scratch):
    """The k-th sample that a segment covers in each of LANES views: depth (empty where it does not) and colour.

    runs = (offset, first pixel, number of pixels, place in the band); what: see draw_segment.
    """
    offset, start, run, address = runs
    ends, depths, kind, reuse, shader, shading = what
    step = np.float32(k)
    x = (start + step) + sample_x
    _, z, u = hit(x, offset, ends, depths)
    depth = depth_bits(run > step, z)
    if kind == PLAIN:
        color = plain_color(u, scratch.segment)
    elif kind == DIFFUSE:  # light is cheaper than looking what is hidden
        color = diffuse_color(u, shader, shading, scratch.segment)
    else:
        old = gather(scratch.halves, (address + k) * np.int32(2) + np.int32(1))
        seen = mask_word(depth > old)
        if seen == 0:
            return depth, splat(EMPTY)
        color = shade_or_reuse(kind, reuse, seen, (x, z, offset), u, sample_x, shader, shading, scratch)
    return depth, color


@inlined
def draw_segment(place, ends, depths, kind, shader, shading, scratch):
    """Draw one segment in every view."""
    offsets, places, sample_x = place.offsets, place.places, place.sample_x
    segment = scratch.segment
    x1, p1, x2, p2 = ends
    low, high = np.float32(place.first), np.float32(place.end)
    reuse = shader.exact.shape[0] > 0 and kind != PLAIN
    if kind == PLAIN:
        to_levels(segment)
    elif reuse:
        shade_exact(ends, depths, sample_x, place.width, shader, shading, scratch)
    what = (ends, depths, kind, reuse, shader, shading)
    for view in range(0, place.views, LANES):
        offset = load(offsets, view)
        start = lesser(greater(ceil(fused(offset, p1, x1) - sample_x), low), high)
        run = lesser(greater(ceil(fused(offset, p2, x2) - sample_x), low), high) - start
        address = load(places, view) + to_int(start - low)
        store(scratch.ints, 0, address)
        store(scratch.ints, LANES, address)
        runs, lanes, k = (offset, start, run, address), min(place.views - view, LANES), np.int32(0)
        while mask_word(run > np.float32(k)) != 0:
            first = make_samples(k, runs, sample_x, what, scratch)
            second = make_samples(np.int32(k + 1), runs, sample_x, what, scratch)
            store_pairs(first, second, scratch.word_halves)
            keep_nearer_pairs(k, lanes, scratch.ints, scratch.words, scratch.band)
            k = np.int32(k + 2)


@inlined
def take_colors(first, empty, halves):
    """Colours of LANES samples from `first` on, which are emptied while they are at hand."""
    k = np.uint64(2) * first
    low, high = load(halves, k), load(halves, k + np.uint64(LANES))
    store(halves, k, empty)
    store(halves, k + np.uint64(LANES), empty)
    return even_lanes(low, high)


@inlined
def store_views(row, columns, height, width, views, background, halves, line):
    """Move the band's colours to the pictures, which are `line`, (V·H·W,) int32.

    Past the caches where they could not hold the pictures; where they can, storing past them is the slower way.
    """
    empty = empty_samples(background)
    k, start = np.uint64(0), np.uint64(line.ctypes.data)
    count = np.uint64(columns[1] - columns[0])
    whole = count & ~np.uint64(LANES - 1)
    for view in range(views):
        target = np.uint64((view * height + row) * width + columns[0])
        if line.size > PAST_CACHES and (start + np.uint64(4) * target) % np.uint64(16) == 0:
            for x in range(np.uint64(0), whole, np.uint64(LANES)):
                stream(line, target + x, take_colors(k + x, empty, halves))
        else:
            for x in range(np.uint64(0), whole, np.uint64(LANES)):
                store(line, target + x, take_colors(k + x, empty, halves))
        for x in range(whole, count):
            line[target + x] = halves[np.uint64(2) * (k + x)]
            halves[np.uint64(2) * (k + x)] = lane(empty, 0)
            halves[np.uint64(2) * (k + x) + np.uint64(1)] = EMPTY
        k += count


@inlined
def store_background(row, columns, height, width, views, background, line):
    """Fill the pictures where there is nothing to draw."""
    count = np.uint64(columns[1] - columns[0])
    for view in range(views):
        first = np.uint64((view * height + row) * width + columns[0])
        for x in range(count):
            line[first + x] = background


@inlined
def store_depth(row, columns, focal, band, nearest, out):
    """Write eye depth (V, H, W), inf where empty; with `nearest`, keep what is nearer."""
    k = np.uint64(0)
    for view in range(out.shape[0]):
        for x in range(columns[0], columns[1]):
            depth = focal / np.int32(band[k] >> DEPTH_SHIFT).view(np.float32)
            out[view, row, x] = min(depth, out[view, row, x]) if nearest else depth
            k += np.uint64(1)


@inlined
def add_samples(count, band, sums):
    """Add the band's colours to the sums, four channels a pixel."""
    for k in range(count):
        for c in range(4):
            sums[4 * k + c] += np.uint16((band[k] >> np.int64(8 * c)) & np.int64(255))


@inlined
def store_means(row, columns, samples, sums, out):
    """Write the rounded means of the sums to the pictures, and clear the sums."""
    k = 0
    half = samples // 2
    for view in range(out.shape[0]):
        for x in range(columns[0], columns[1]):
            rgba = np.int32(0)
            for c in range(4):
                rgba |= np.int32((np.int64(sums[k + c]) + half) // samples) << np.int32(8 * c)
                sums[k + c] = np.uint16(0)
            out[view, row, x] = rgba
            k += 4


@inlined
def draw_bins(kind_of, bins, job, scratch, out, depth):
    """Draw bins (first, end, blocks a row, columns per block); see draw_views."""
    surface, camera, shader, offsets, places, background, side = job
    views, height, width = out.shape
    line = out.reshape(-1)
    span = (offsets[0], offsets[views - 1])
    clear_samples(0, views * min(bins[3], width), background, scratch.halves)
    for k in range(bins[0], bins[1]):
        row, first = k // bins[2], k % bins[2] * bins[3]
        columns = (first, min(first + bins[3], width))
        if surface.bin_start[k] == surface.bin_start[k + 1] and depth.size == 0:
            store_background(row, columns, height, width, views, background, line)
            continue
        count = columns[1] - columns[0]
        for v in range(places.shape[0]):
            places[v] = min(v, views - 1) * count
        for s in range(side * side):
            if s > 0:
                clear_samples(0, views * count, background, scratch.halves)
            sample = (0.5 + camera.spread * ((s % side + 0.5) / side - 0.5), (s // side + 0.5) / side)
            at, wide = np.float32(sample[0]), np.float32(width)
            place = Place(offsets, places, views, columns[0], columns[1], at, wide)
            draw_row(draw_segment, kind_of, place, span, row, k, surface, camera, shader, sample, scratch)
            if side > 1:
                add_samples(views * count, scratch.band, scratch.sums)
            if depth.size > 0:
                store_depth(row, columns, np.float32(camera.focal), scratch.band, s > 0, depth)
        if side > 1:
            store_means(row, columns, side * side, scratch.sums, out)
            clear_samples(0, views * count, background, scratch.halves)
        else:
            store_views(row, columns, height, width, views, background, scratch.halves, line)


@kernel
def draw_views(bins, job, scratch, out, depth):
    """Draw bins (first, end, blocks a row, columns per block) of every view into out (V, H, W) int32.

    job = (surface, camera, shader, offsets, places, background, side), with side² samples a pixel and scratch memory
    for Place.places; depth (V, H, W) float32, or of no size when it is not wanted.
    """
    draw_bins(any_kind, bins, job, scratch, out, depth)


@kernel
def draw_plain_views(bins, job, scratch, out, depth):
    """draw_views where all materials are PLAIN."""
    draw_bins(only_plain, bins, job, scratch, out, depth)


@kernel
def draw_diffuse_views(bins, job, scratch, out, depth):
    """draw_views where all materials are DIFFUSE."""
    draw_bins(only_diffuse, bins, job, scratch, out, depth)


KERNELS = {PLAIN: draw_plain_views, DIFFUSE: draw_diffuse_views, ANY: draw_views}
