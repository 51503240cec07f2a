"""Lists of a panel's samples that a segment or chord may cover: what meshes and points share.

Of each line of sub-pixels (panel_lines) a stretch between two straight edges is an interval, found by two
multiplications, LANES lines at a time (SIMD over lines); the samples of all intervals make one list of addresses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined
from .panel_lines import bucket_at, middle_offset
from .scalars import ONE, ZERO
from .simd import (
    LANES,
    append,
    ceil,
    floor,
    gather,
    greater,
    iota,
    lesser,
    load,
    mask_word,
    select,
    splat,
    store,
    to_float,
    to_int,
)

STRIDE = 1072  # room of a list: CAPACITY, what a step more adds, and what fills it up; no multiple of a page
CAPACITY = 1000
SLACK = np.float32(4e-3)  # rounding moves the end of a segment by less
FAR = np.float32(1e9)

# rows of the float32 lists of points, and the place of the int32 list of all
LANE_U, LANE_Z, LANE_X, LANE_OFFSET, COLOR = (np.uint64(k * STRIDE) for k in range(5))
ADDRESS = np.uint64(0)


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


@inlined
def edge_bound(x, slope, at, plan, spread, bounded_below):
    """How an edge at x + o·slope bounds a line's samples: (of x, of offset, constant) and whether from below.

    The sample j with x = x0 + j·period and offset o0 + j·drift lies right of the edge where
    j·(period − drift·slope) ≥ gap; the bound on j is c − x0·a + o0·b, widened by what may be in doubt. Where the edge
    is nearly parallel to the line nothing is bounded: both numbers are 0, and the constant is far away.
    """
    period, drift = np.float32(plan.period), np.float32(plan.slope * plan.step)
    across = period - drift * slope
    slack = np.float32(plan.misfit) * abs(slope) + SLACK
    below = (across > ZERO) == bounded_below
    if abs(across) * np.float32(512.0) < slack:
        return (ZERO, ZERO, -FAR if bounded_below else FAR), bounded_below
    inverse = ONE / across
    slack = (slack + spread) * abs(inverse)
    return (inverse, slope * inverse, (x - at) * inverse + (-slack if below else slack)), below


@inlined
def bound_of(edge, xs, offsets):
    """The bound that an edge_bound sets to lines."""
    of_x, of_offset, constant = edge
    return (offsets * of_offset - xs * of_x) + constant


@inlined
def intervals(xs, offsets, numbers, first, second, both):
    """Of lines the first sample that the stretch may cover, and the number of samples, as whole float32.

    first bounds from below, second from above; both = 0, or 1 (−1) where both bound from below (above).
    """
    low, high = bound_of(first, xs, offsets), bound_of(second, xs, offsets)
    start, end = greater(ceil(low), ZERO), lesser(floor(high) + ONE, numbers)
    if both > 0:
        start, end = greater(start, ceil(high)), numbers
    elif both < 0:
        start, end = splat(ZERO), lesser(end, floor(low) + ONE)
    start = lesser(start, numbers)
    return start, end - start


@inlined
def swept(ends, place):
    """The pixels from `place.first` on that a stretch may sweep from all cameras, first and last; first > last if none.

    Two more than that: rounding, and samples that do not lie in the middle of their pixel.
    """
    x1, p1, x2, p2 = ends
    low, high = np.float32(place.plan.low), np.float32(place.plan.high)
    left = min(x1 + low * p1, x1 + high * p1) - np.float32(2.0)
    right = max(x2 + low * p2, x2 + high * p2) + np.float32(1.0)
    first = np.float32(place.first)
    return max(left - first, ZERO), min(right - first, np.float32(place.columns) - ONE)


@inlined
def lines_met(ends, place, starts):
    """The lines that a stretch may meet, first and behind the last."""
    x1, p1, x2, p2 = ends
    plan, buckets = place.plan, starts.shape[0] - 1
    lean, middle, misfit = np.float32(plan.lean), middle_offset(plan), np.float32(plan.misfit)
    half = np.float32(0.5 * (plan.high - plan.low)) + misfit
    left = x1 + middle * p1 - half * abs(p1 - lean) - misfit * abs(p1) - np.float32(plan.reach)
    right = x2 + middle * p2 + half * abs(p2 - lean) + misfit * abs(p2)
    if not left <= right:  # too large for float32
        left, right = -FAR, FAR
    first = bucket_at(left - np.float32(2.0), plan, place.first, buckets)
    last = bucket_at(right + ONE, plan, place.first, buckets)
    return np.int64(starts[first]), np.int64(starts[last + 1])


@inlined
def draw_stretch(draw_listed, place, row, ends, what, scratch):
    """List the samples of a row that a stretch x1 + o·p1 ≤ x < x2 + o·p2 may cover; ends = (x1, p1, x2, p2).

    Calls draw_listed(n, place, row, ends, what, scratch) for at most CAPACITY samples at a time, whose addresses are in
    scratch.ints; the list is filled up with the row's first samples to whole SIMD steps.
    """
    left, right = swept(ends, place)
    if left > right:
        return
    ints, plan = scratch.ints, place.plan
    xs, numbers, offsets = place.block.lines[row, 0], place.block.lines[row, 1], place.block.lines[row, 2]
    addresses, starts = place.block.addresses[row], place.block.starts[row]
    period, step = np.float32(plan.period), np.int32(plan.period)
    first, below1 = edge_bound(ends[0], ends[1], place.at[4], plan, place.at[5], True)
    second, below2 = edge_bound(ends[2], ends[3], place.at[4], plan, place.at[5], False)
    both = np.int32(below1) + np.int32(below2) - np.int32(1)
    if below2 and not below1:
        first, second = second, first
    line, stop = lines_met(ends, place, starts)
    n, word, k = np.uint64(0), np.int32(0), np.int32(0)
    run, address = splat(np.int32(0)), splat(np.int32(0))
    last = iota() + np.int32(row * 3 * place.columns)  # not one again and again: its depth would be waited for
    while line < stop or word != 0:
        while n <= np.uint64(CAPACITY):
            if word == 0:
                if line >= stop:
                    break
                i = np.uint64(line)
                start, length = intervals(load(xs, i), load(offsets, i), load(numbers, i), first, second, both)
                run = select(iota() < np.int32(stop - line), to_int(length), np.int32(0))
                address = load(addresses, i) + to_int(start * period)
                n = append(ints, ADDRESS + n, address, run > np.int32(0)) - ADDRESS
                n = append(ints, ADDRESS + n, address + step, run > np.int32(1)) - ADDRESS
                line += LANES
                k = np.int32(2)
            else:  # few stretches are as long
                n = append(ints, ADDRESS + n, address + np.int32(k * step), run > k) - ADDRESS
                k = np.int32(k + 1)
            word = mask_word(run > k)
        if n > np.uint64(0):
            store(ints, ADDRESS + n, last)
            store(ints, ADDRESS + n + np.uint64(LANES), last)
            draw_listed(n, place, row, ends, what, scratch)
            n = np.uint64(0)


@inlined
def samples_at(address, row, place):
    """Pixel position and camera offset of samples, and which of them are green or blue, and blue."""
    columns, two = np.int32(place.columns), np.int32(2 * place.columns)
    k = address - np.int32(row * 3 * place.columns)
    green, blue = k >= columns, k >= two
    k = k - select(blue, two, select(green, splat(columns), np.int32(0)))
    at = select(blue, place.at[2], select(green, place.at[1], splat(place.at[0])))
    return (to_float(k) + np.float32(place.first)) + at, gather(place.block.offsets, address), green, blue


@inlined
def place_samples(n, row, place, lists, ints):
    """Pixel position and exact camera offset of the listed samples, whole SIMD steps of them."""
    for i in range(np.uint64(0), n, np.uint64(LANES)):
        x, offset, _, _ = samples_at(load(ints, ADDRESS + i), row, place)
        store(lists, LANE_X + i, x)
        store(lists, LANE_OFFSET + i, offset)
