"""Meshes straight to an interlaced panel: every sub-pixel its own camera offset, no stack of views in between.

For each segment (mesh_raster) the samples that it may cover are listed (panel_list); coverage, depth and colour at
their exact offsets are those of every other draw, LANES samples at a time (SIMD over samples), and one scalar pass
keeps what is nearer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_block import any_kind, draw_row, only_diffuse, only_plain
from .mesh_reuse import shade_exact, shade_or_reuse
from .mesh_shade import ANY, DIFFUSE, PLAIN, to_levels
from .panel_lines import LinePlan, make_lines, row_offsets
from .panel_list import ADDRESS, Block, draw_stretch, samples_at
from .samples import WORD, clear_samples, depth_bits, hit, keep_nearer, store_words
from .scalars import BYTE, ZERO
from .simd import LANES, fused, gather, greater, lesser, load, mask_word, select, splat, to_int


class Panel(NamedTuple):
    """How a panel is sampled: its lines, flips, sub-pixel sampling."""

    plan: LinePlan
    flip_x: bool
    flip_y: bool
    subpixel: bool


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
def channel_color(u, green, blue, segment):
    """Interpolated colour of each sample's own channel of a segment of levels, as RGBA bytes."""
    start = select(blue, segment[2], select(green, segment[1], splat(segment[0])))
    step = select(blue, segment[10], select(green, segment[9], splat(segment[8])))
    value = to_int(lesser(greater(fused(u, step, start), ZERO), BYTE))
    return select(blue, value << np.int32(16), select(green, value << np.int32(8), value))


@inlined
def draw_listed(n, place, row, ends, what, scratch):
    """Draw the listed samples of a segment; what = (depths, kind, shader, shading)."""
    depths, kind, shader, shading = what
    ints, segment, band, halves = scratch.ints, scratch.segment, scratch.band, scratch.halves
    words, word_halves = scratch.words, scratch.word_halves
    reuse = shader.exact.shape[0] > 0 and kind != PLAIN
    for i in range(0, n, LANES):
        address = load(ints, ADDRESS + np.uint64(i))
        x, offset, green, blue = samples_at(address, row, place)
        covered, z, u = hit(x, offset, ends, depths)
        depth = depth_bits(covered, z)
        if kind == PLAIN:
            color = channel_color(u, green, blue, segment)
        else:
            seen = mask_word(depth > gather(halves, address * np.int32(2) + np.int32(1)))
            if seen == 0:
                continue
            color = shade_or_reuse(kind, reuse, seen, (x, z, offset), u, place.at[3], shader, shading, scratch)
        store_words(depth, color, word_halves)
        for j in range(LANES):
            keep_nearer(np.uint64(ints[ADDRESS + np.uint64(i + j)]), words[WORD[j]], band)


@inlined
def draw_segment(place, ends, depths, kind, shader, shading, scratch):
    """Draw one segment in every sub-pixel."""
    if kind == PLAIN:
        to_levels(scratch.segment)
    elif shader.exact.shape[0] > 0:
        shade_exact(ends, depths, place.at[3], place.width, shader, shading, scratch)
    draw_stretch(draw_listed, place, 0, ends, (depths, kind, shader, shading), scratch)


@inlined
def drawn_columns(bin_index, columns, surface):
    """The pixels (first, end) of a block that its triangles may cover from some camera."""
    first, last = columns[1], columns[0]
    for entry in range(surface.bin_start[bin_index], surface.bin_start[bin_index + 1]):
        index = np.uint64(surface.bins[entry]) * np.uint64(8)
        first = min(first, np.int64(surface.triangles[index + np.uint64(4)]))
        last = max(last, np.int64(surface.triangles[index + np.uint64(5)]))
    first = max(first, columns[0])
    return first, max(min(last + 1, columns[1]), first)


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


@inlined
def draw_bins(kind_of, bins, job, memory, out, depth):
    """Draw bins (first, end, blocks a row, columns per block); see draw_panel."""
    surface, camera, shader, panel, background, side = job
    block, scratch = memory
    height, width, _ = out.shape
    flat, plan, plane = out.reshape(-1), panel.plan, bins[3]
    step, span = -3 if panel.flip_x else 3, (np.float32(plan.low), np.float32(plan.high))
    starts, lines, addresses = block.starts[0], block.lines[0], block.addresses[0]
    found, found_ints = block.found, block.found_ints
    for k in range(bins[0], bins[1]):
        r, first = k // bins[2], k % bins[2] * bins[3]
        columns = (first, min(first + bins[3], width))
        row = height - 1 - r if panel.flip_y else r
        drawn = drawn_columns(k, columns, surface)
        base, count = drawn[0] - first, drawn[1] - drawn[0]
        if count > 0:
            row_offsets(row, width, panel.flip_x, drawn, 0, first, plane, plan, block.u, block.offsets)
            make_lines(
                row, width, panel.flip_x, drawn, 0, first, plane, plan, starts, lines, addresses, found, found_ints
            )
        for s in range(side * side) if count > 0 else range(0):
            x, y = (s % side + 0.5) / side, (s // side + 0.5) / side
            one, third = np.float32(x), np.float32(1.0 / 3.0)
            at = (one, one, one, one, one, ZERO)
            if panel.subpixel:
                red, green, blue = np.float32(x / 3.0), np.float32((1.0 + x) / 3.0), np.float32((2.0 + x) / 3.0)
                at = (red, green, blue, ZERO, green, third)
            place = Place(block, plan, first, plane, at, np.float32(width))
            for c in range(3):
                clear_samples(base + c * plane, count, background, scratch.halves)
            draw_row(draw_segment, kind_of, place, span, r, k, surface, camera, shader, (x, y), scratch)
            if side > 1:
                add_samples(count, base, plane, scratch.band, scratch.sums)
        if side > 1:
            take_means(count, base, plane, side * side, scratch.band, scratch.sums)
        if depth.size > 0:
            store_depth(row, columns, drawn, base, plane, np.float32(camera.focal), panel.flip_x, scratch.band, depth)
        start, end = row * width * 3, (row + 1) * width * 3 - 3
        begin = end if panel.flip_x else start
        store_background(begin + step * columns[0], step, drawn[0] - columns[0], background, flat)
        store_row(begin + step * drawn[0], step, base, count, plane, scratch.band, flat)
        store_background(begin + step * drawn[1], step, columns[1] - drawn[1], background, flat)


@kernel
def draw_panel(bins, job, memory, out, depth):
    """Draw bins (first, end, blocks a row, columns per block) into out (H, W, 3) uint8.

    job = (surface, camera, shader, panel, background, side), with side² samples a sub-pixel; memory = (block, scratch);
    depth (H, W, 3) float32 of the first sample, or of no size when it is not wanted.
    """
    draw_bins(any_kind, bins, job, memory, out, depth)


@kernel
def draw_plain_panel(bins, job, memory, out, depth):
    """draw_panel where all materials are PLAIN."""
    draw_bins(only_plain, bins, job, memory, out, depth)


@kernel
def draw_diffuse_panel(bins, job, memory, out, depth):
    """draw_panel where all materials are DIFFUSE."""
    draw_bins(only_diffuse, bins, job, memory, out, depth)


KERNELS = {PLAIN: draw_plain_panel, DIFFUSE: draw_diffuse_panel, ANY: draw_panel}
