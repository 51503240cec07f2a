"""Volumes straight to an interlaced panel: every sub-pixel its own camera, no stack of views in between.

Slabs are shared as in a stack of views, one position a pixel; every sub-pixel looks up its own two neighbours.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel, lean
from .panel_lines import row_offsets
from .scalars import exp2_fast, log2_fast
from .simd import adjacent
from .volume_rays import END, HALF, HIDDEN, LENGTH, ONE, ORIGIN, RAYS, ROW, TURN, ZERO, B, G, R, T, mix_pair
from .volume_sample import SLABS, hide_runs, keep_alive, mark_runs
from .volume_shared import LESS, LINE, SLAB_ROWS, SPAN, classify_slabs, shift_of
from .volume_views import PIXELS, mark_volumes, over, trace_rays

AT, MOVE, SHARE_R, CUT_R, A0, C0, SUM, THROUGH = (np.uint64(k * ROW) for k in range(8))
PIXEL_ROWS = 8
THIRD = np.float32(1.0 / 3.0)


@inlined
def fetch_pixels(n, base, slab, channel, last, values, pixels, index, pairs):
    """One channel and LESS of a slab at the places AT − MOVE·shift of sub-pixels; AT holds the place itself."""
    for i in range(n):
        at = min(max(pixels[base + CUT_R + i], ZERO), last)
        m = np.floor(at)
        pixels[base + SHARE_R + i] = at - m
        index[i] = np.int32(m)
    for i in range(n):
        k = slab + np.uint64(index[i])
        pairs[i], pairs[n + i] = adjacent(values, k + LESS), adjacent(values, k + channel)
    for i in range(n):
        part = pixels[base + SHARE_R + i]
        pixels[base + A0 + i] = mix_pair(pairs[i], part)
        pixels[base + C0 + i] = mix_pair(pairs[n + i], part)


@lean
def blend_pixels(blocks, averaged, camera, slices, first, last, shared, pixels, index, pairs):
    """Add slabs first … last to the sub-pixels of a row, in blocks of RAYS for each channel, each at its own place."""
    n = np.uint64(RAYS)
    stride = PIXEL_ROWS * ROW
    bound = np.float32(shared.length - 2)
    for b in range(blocks):
        low, high = pixels[3 * b * stride + MOVE], pixels[3 * b * stride + MOVE]
        left, right = pixels[3 * b * stride + AT], pixels[3 * b * stride + AT]
        for c in range(3):
            base = np.uint64((3 * b + c) * stride)
            for i in range(n):
                low, high = min(low, pixels[base + MOVE + i]), max(high, pixels[base + MOVE + i])
                left, right = min(left, pixels[base + AT + i]), max(right, pixels[base + AT + i])
        for k in range(first, last):
            shift = np.float32(shift_of(camera, slices, k))
            begin = left - max(low * shift, high * shift)
            end = right - min(low * shift, high * shift)
            seen = False
            for g in range(max(int(begin), 0) // SPAN, min((int(end) + 1) // SPAN, (shared.length - 1) // SPAN) + 1):
                seen = seen or shared.shown[k - first, g] != 0
            if not seen:
                continue
            slab = np.uint64((k - first) * SLAB_ROWS * LINE)
            for c in range(3):
                base = np.uint64((3 * b + c) * stride)
                for i in range(n):
                    pixels[base + CUT_R + i] = pixels[base + AT + i] - pixels[base + MOVE + i] * shift
                fetch_pixels(
                    n, base, slab, np.uint64(c) * np.uint64(LINE), bound, shared.values, pixels, index, pairs
                )
            if averaged:
                red, green, blue = (
                    np.uint64(3 * b * stride),
                    np.uint64((3 * b + 1) * stride),
                    np.uint64((3 * b + 2) * stride),
                )
                for i in range(n):
                    mean = THIRD * (pixels[red + A0 + i] + pixels[green + A0 + i] + pixels[blue + A0 + i])
                    pixels[red + A0 + i] = mean
                    pixels[green + A0 + i] = mean
                    pixels[blue + A0 + i] = mean
            for c in range(3):
                base = np.uint64((3 * b + c) * stride)
                for i in range(n):
                    through = pixels[base + THROUGH + i]
                    pixels[base + SUM + i] += through * pixels[base + C0 + i]
                    pixels[base + THROUGH + i] = through + through * pixels[base + A0 + i]


@inlined
def place_in_pixel(subpixel, c):
    """Where in its pixel a channel is sampled, from the pixel's centre."""
    return (c - 1) / 3.0 if subpixel else 0.0


@lean
def hide_behind_panel(width, offsets, camera, cut, slices, k, last, planes, pixels):
    """Leave out what all sub-pixels have seen enough before, in the slices of slabs k … last."""
    near, far = slices.first + k * slices.distance, slices.first + last * slices.distance
    planes.alive[:] = np.uint8(0)
    for c in range(3):
        for x in range(0, width, RAYS):
            low, high, dark = np.float32(np.inf), np.float32(-np.inf), True
            for i in range(x, min(x + RAYS, width)):
                through = pixels[np.uint64((3 * (i // RAYS) + c) * PIXEL_ROWS * ROW + i % RAYS) + THROUGH]
                if through >= HIDDEN:
                    o = offsets[c * width + i]
                    low, high, dark = min(low, o), max(high, o), False
            if not dark:
                keep_between(x, low, high, near, far, camera, cut, planes.alive)
    hide_runs(k, last, planes)


@inlined
def keep_between(x, low, high, near, far, camera, cut, alive):
    """Note that pixels x … x + RAYS are not yet opaque for any offset between two: the offset enters linearly."""
    left, right = (x - 1 - camera.centre_x) / camera.fx, (x + RAYS + 1 - camera.centre_x) / camera.fx
    near_part, far_part = 1.0 - near / camera.focal, 1.0 - far / camera.focal
    a, b = min(low * near_part, high * near_part), max(low * near_part, high * near_part)
    c, d = min(low * far_part, high * far_part), max(low * far_part, high * far_part)
    keep_alive(min(a + near * left, c + far * left), max(b + near * right, d + far * right), cut, alive)


@kernel
def draw_panel_rows(rows, cut, camera, slices, ways, panel, averaged, planes, shared, scratch, color):
    """Draw rows (first, end) of the picture from shared slabs over the panel color (H, W, 3).

    scratch = (offsets (3·W,) float32, u (W,) float64, rays, index, pixels).
    """
    offsets, u, rays, index, pixels = scratch
    height, width, _ = color.shape
    blocks = -(-width // RAYS)
    stride = PIXEL_ROWS * ROW
    middle = slices.first + 0.5 * slices.slabs * slices.distance
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        if mark_runs(cut, row, slices, planes.marks) == 0:
            continue
        shown = height - 1 - r if panel.flip_y else r
        row_offsets(shown, width, panel.flip_x, (0, width), 0, 0, width, panel.plan, u, offsets)
        for b in range(3 * blocks):
            base, c = np.uint64(b * stride), b % 3
            for i in range(RAYS):
                x = min((b // 3) * RAYS + i, width - 1)
                k = np.uint64(i)
                pixels[base + AT + k] = np.float32(x + place_in_pixel(panel.subpixel, c) - shared.begin)
                pixels[base + MOVE + k] = offsets[c * width + x]
                pixels[base + SUM + k] = ZERO
                pixels[base + THROUGH + k] = ONE
        for k in range(0, slices.slabs, SLABS):
            last = min(k + SLABS, slices.slabs)
            if k > 0:
                hide_behind_panel(width, offsets, camera, cut, slices, k, last, planes, pixels)
            classify_slabs(cut, camera, row, slices, k, last, ways, planes, shared, rays, index)
            blend_pixels(blocks, averaged, camera, slices, k, last, shared, pixels, index, planes.place)
        for c in range(3):
            for x in range(width):
                k = np.uint64((3 * (x // RAYS) + c) * stride + x % RAYS)
                total, through = pixels[k + SUM], pixels[k + THROUGH]
                if through < ONE:
                    at = x + place_in_pixel(panel.subpixel, c)
                    total, through = even_sub_pixel(at, offsets[c * width + x], middle, camera, row, total, through)
                    column = width - 1 - x if panel.flip_x else x
                    color[shown, column, c] = over(total, through, color[shown, column, c])


@inlined
def even_sub_pixel(x, offset, middle, camera, row, total, through):
    """volume_shared.even_out for one sub-pixel."""
    own = (x + 0.5 - camera.centre_x) / camera.fx - offset / camera.focal
    centre, slope = own + offset / middle, 1.0 + row[0] * row[0]
    ratio = np.sqrt((slope + own * own) / (slope + centre * centre))
    even = exp2_fast(np.float32(ratio) * log2_fast(max(through, np.float32(1e-30))))
    return total * ((ONE - even) / max(ONE - through, np.float32(1e-6))), even


@kernel
def draw_panel_rays(
    rows, cuts, camera, slices, ways, panel, averaged, joined, wants_depth, planes, scratch, color, depth
):
    """Draw rows (first, end) of the picture, every sub-pixel along its own ray, over the panel color (H, W, 3).

    cuts, ways, planes, depth (H, W, 3): see volume_views.draw_rows. A block of rays is one channel of RAYS pixels or,
    `averaged`, all three of fewer; `joined`, a pixel's three sub-pixels share their ray.
    """
    offsets, u, rays, index, _ = scratch
    height, width, _ = color.shape
    far = slices.first + slices.slabs * slices.distance
    opaque, pixels = depth.shape[0] > 0, PIXELS if averaged else RAYS
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        if mark_volumes(cuts, row, slices, planes) == 0:
            continue
        shown = height - 1 - r if panel.flip_y else r
        row_offsets(shown, width, panel.flip_x, (0, width), 0, 0, width, panel.plan, u, offsets)
        for block in range(1 if averaged or joined else 3):
            for first in range(0, width, pixels):
                for i in range(RAYS):
                    c, p = (min(i // PIXELS, 2), i % PIXELS) if averaged else (block, i)
                    x, k = min(first + p, width - 1), np.uint64(i)
                    o = np.float64(offsets[c * width + x])
                    at = x + place_in_pixel(panel.subpixel, c)
                    turn = (at + 0.5 - camera.centre_x) / camera.fx - o / camera.focal
                    rays[ORIGIN + k] = np.float32(o)
                    rays[TURN + k] = np.float32(turn)
                    rays[LENGTH + k] = np.float32(np.sqrt(1.0 + row[0] * row[0] + turn * turn))
                    rays[END + k] = np.float32(far)
                    if opaque:
                        column = width - 1 - x if panel.flip_x else x
                        rays[END + k] = min(np.float32(far), depth[shown, column, c])
                trace_rays(cuts, row, slices, ways, wants_depth, averaged, planes, rays, index)
                for i in range(3 * PIXELS if averaged else RAYS):
                    c, p = (i // PIXELS, i % PIXELS) if averaged else (block, i)
                    x, k = first + p, np.uint64(i)
                    if x >= width:
                        continue
                    column = width - 1 - x if panel.flip_x else x
                    for channel in range(c, 3 if joined else c + 1):
                        total = rays[k + R] if channel == 0 else (rays[k + G] if channel == 1 else rays[k + B])
                        color[shown, column, channel] = over(total, rays[k + T], color[shown, column, channel])
                        if wants_depth:
                            depth[shown, column, channel] = min(depth[shown, column, channel], rays[k + HALF])
