"""One row of a panel: the camera offsets and places of its samples, and its finished values."""

from __future__ import annotations

import numpy as np

from .jit import inlined


@inlined
def row_offsets(row, width, m, flip, x, kind, shift, constants, offsets, u, out):
    """Camera offset (N,) float32 of a plan's samples in physical row `row`; the phase is that of `gather.row_phase`.

    u (N,) float64 is scratch. (Three short loops, for LLVM proves of each that its arrays do not overlap.)
    """
    count = np.uint64(out.shape[0])
    if m.table.shape[0] > 0:
        for i in range(count):
            out[i] = np.float32(offsets[np.uint64(kind[i])])
        return
    br = m.b * row
    turn, sign = (width - 1 - shift, -1) if flip else (shift, 1)
    if constants.shape[0] == 3:
        red, green, blue = constants[0], constants[1], constants[2]
        for i in range(count):
            constant = red if kind[i] == 0 else (green if kind[i] == 1 else blue)
            u[i] = (m.a * np.float64(turn + sign * x[i]) + br) + constant
    else:
        for i in range(count):
            u[i] = (m.a * np.float64(turn + sign * x[i]) + br) + constants[np.uint64(kind[i])]
    views, reverse, last = np.float64(m.views), m.reverse, offsets.shape[0] - 1
    for i in range(count):
        phi = u[i] - np.floor(u[i])
        phi = 1.0 - phi if reverse else phi
        u[i] = (phi if phi < 1.0 else 0.0) * views
    if m.continuous:
        top = np.float64(max(last - 1, 0))
        following = np.int64(min(last, 1))
        for i in range(count):
            at = u[i] - 0.5
            k = min(max(np.floor(at), 0.0), top)
            j = np.uint64(np.int64(k))
            low, high = offsets[j], offsets[np.uint64(np.int64(k) + following)]
            out[i] = np.float32(low + (at - k) * (high - low))
    else:
        for i in range(count):
            out[i] = np.float32(offsets[np.uint64(np.int64(min(np.floor(u[i]), views - 1.0)))])


@inlined
def set_places(shift, subpixel, part_x, x, slot, places):
    """Place of each sample of a plan, less the sample's place within its pixel if that is the same for all."""
    count = np.uint64(places.shape[0])
    move = np.int32(shift)
    for i in range(count):
        places[i] = np.float32(x[i] + move)
    if subpixel:
        for i in range(count):
            places[i] += np.float32(((slot[i] & 3) + part_x) / 3.0)


@inlined
def collect_row(count, slot, band, line):
    """Bring the row's values (each the channel of its own) into order: line[place] of every sample."""
    for i in range(np.uint64(count)):
        s = slot[i]
        line[np.uint64(s >> 2)] = np.uint8((band[i] >> np.int64(8 * (s & 3))) & np.int64(255))


@inlined
def store_row(line, begin, flip, row, height_width, out):
    """Copy the row's values, from line[begin] on, to a row of the panel, which is `out`, (H·W·3,) uint8."""
    width = height_width[1]
    target, source = np.uint64(row * width * 3), np.uint64(begin)
    if not flip:
        for i in range(np.uint64(3 * width)):
            out[target + i] = line[source + i]
        return
    for x in range(width):
        for c in range(3):
            out[target + np.uint64(3 * (width - 1 - x) + c)] = line[source + np.uint64(3 * x + c)]


@inlined
def store_background(row, empty, out):
    """Copy an empty row (3·W,) to where there is nothing to draw."""
    count = np.uint64(empty.shape[0])
    first = np.uint64(row) * count
    for i in range(count):
        out[first + i] = empty[i]


@inlined
def add_row(line, begin, width, s, samples, sums, out):
    """Add a row of sub-samples to the sums; with the last one, put the rounded means into `out`."""
    for k in range(3 * width):
        i = np.uint64(begin + k)
        total = np.uint16(line[i]) if s == 0 else sums[np.uint64(k)] + np.uint16(line[i])
        sums[np.uint64(k)] = total
        if s == samples - 1:
            out[i] = np.uint8((np.int64(total) + samples // 2) // samples)
