"""Lines of a panel's row: sub-pixels a fixed distance apart, whose camera offsets are affine.

A lens repeats after some number of pixels that is nearly whole, a table after exactly that many. So sub-pixels of one
channel `period` pixels apart show nearly the same camera, which drifts slowly along the row and jumps where the phase
wraps: between two jumps they form a line, x = x0 + j·period, offset = o0 + j·drift up to a known misfit. In the plane
of x and offset a segment is bounded by two straight edges (mesh_raster), so what it covers of a line is an interval of
j, found by two divisions (DESIGN section 7, for lenses; here one case for tables, cells, slanted lenses, any period).
All lines are parallel, so those that a segment may meet follow each other where they are sorted by the place at which
they cross the middle offset. Lines only say where to look; whether a sample is covered is decided at its exact offset,
`row_offsets`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap, offset_at
from .jit import inlined, kernel
from .scalars import ZERO
from .view_rows import MapArgs, cell_of, map_args

MAX_PERIOD = 64
MOST_LEAN = 1e30  # what float32 holds, and products with it
NEAR_WRAP = 1e-6  # of a phase: rounding may put a sample on either side of a wrap, so both lines hold it
BUCKET = 4  # lines are sorted into buckets of 2⁴ pixels
PARALLAX = (-0.125, -0.0625, 0.0, 0.0625)  # panel widths: parallax between the outermost cameras to reckon with
SEGMENT = 5.0  # pixels: width of a segment to reckon with
LONG = 2  # panel widths: lines that take longer to the middle offset are hardly more than the residues of the period


class LinePlan(NamedTuple):
    """How the sub-pixels of a panel fall into lines.

    map: its view map; offsets (V,) float64; period in pixels, a multiple of that of the table or the cells; step:
    phase from sample to sample, in (−½, ½], 0 for a table; first, slope: offset ≈ first + slope·phase, at most
    `misfit` away; low, high: least and greatest offset of all; lean: pixels from sample to sample per unit of offset,
    and lead: pixels that a line takes at most to cross the middle offset; both 0 if that is far, then reach: length of
    the longest line in pixels, else 0; spacing, middle: offsets are (k − middle)·spacing to the bit, or spacing is 0.
    """

    map: MapArgs
    offsets: NDArray[np.float64]
    period: int
    step: float
    first: float
    slope: float
    misfit: float
    low: float
    high: float
    lean: float
    lead: float
    reach: float
    spacing: float
    middle: float


def plan_lines(viewmap: ViewMap, width: int, flip: bool, offsets: NDArray[np.float64]) -> LinePlan:
    """Choose the period that leaves a segment the fewest lines to look at, and fit offsets to phases."""
    offsets = np.ascontiguousarray(offsets, dtype=np.float64)
    m = map_args(viewmap)
    if viewmap.table is not None:
        period, low, high = viewmap.table.shape[1], offsets.min(), offsets.max()
        return LinePlan(m, offsets, period, 0.0, 0.0, 0.0, 0.0, low, high, 0.0, 0.0, float(width), 0.0, 0.0)
    first, slope, misfit, low, high = _fit(viewmap, offsets)
    period, step = _period(viewmap, width, -1.0 if (slope < 0.0) != flip else 1.0)
    step = -step if flip else step
    spacing, middle = _even(offsets)
    lean = period / (slope * step) if slope * step != 0.0 else np.inf
    lead, reach = (0.5 * (high - low) + misfit) * abs(lean), 0.0
    if not (lead <= LONG * width and abs(lean) <= MOST_LEAN):  # offsets that follow the phase hardly, too
        lean, lead, reach = 0.0, 0.0, min(float(width), period / max(abs(step), 1e-9)) + period
    return LinePlan(m, offsets, period, step, first, slope, misfit, low, high, lean, lead, reach, spacing, middle)


def _period(viewmap: ViewMap, width: int, sign: float) -> tuple[int, float]:
    """The period that leaves a segment the fewest lines to look at, and the phase from sample to sample.

    A line moves period/step pixels while it crosses all offsets, a segment its parallax; lines lie so densely that it
    meets |period − parallax·step| of each channel. What is seen is rather in front of the focal plane, where parallax
    runs against `sign`, that of offsets as functions of the phase.
    """
    cells = 2 if viewmap.cell_mode in (1, 2, 3) else 1
    periods = np.arange(cells, MAX_PERIOD + 1, cells)
    steps = viewmap.a * periods
    steps = steps - np.round(steps)
    parallax = sign * width * np.array(PARALLAX)
    met = np.abs(periods - parallax[:, None] * steps).mean(axis=0) + np.abs(steps) * SEGMENT
    best = np.argmin(met)
    return int(periods[best]), float(steps[best])


def _even(offsets: NDArray[np.float64]) -> tuple[float, float]:
    """Spacing and middle of evenly spaced offsets, so that they need not be looked up; (0, 0) if they are not."""
    middle = 0.5 * (len(offsets) - 1)
    spacing = float(offsets[-1] - offsets[0]) / max(len(offsets) - 1, 1)
    even = (np.arange(len(offsets)) - middle) * spacing
    same = np.array_equal(even.astype(np.float32), offsets.astype(np.float32))
    return (spacing, middle) if same else (0.0, 0.0)


def _fit(viewmap: ViewMap, offsets: NDArray[np.float64]) -> tuple[float, float, float, float, float]:
    """The straight line nearest to offsets as a function of the phase, its misfit, and the range of offsets."""
    views = viewmap.views
    if viewmap.continuous:
        phase = np.concatenate([[0.0], (np.arange(views) + 0.5) / views, [1.0]])
        shown = offset_at(offsets, phase * views - 0.5)
    else:
        phase = np.stack([np.arange(views), np.arange(views) + 1.0]).T.ravel() / views
        shown = np.repeat(offsets, 2)
    if viewmap.reverse:
        phase = 1.0 - phase
    slope, first = np.polyfit(phase, shown, 1) if len(offsets) > 1 else (0.0, offsets[0])
    error = shown - (first + slope * phase)
    first += 0.5 * (error.min() + error.max())
    misfit = 0.5 * float(np.ptp(error)) + 1e-5 * float(np.ptp(shown))
    return float(first), float(slope), misfit, float(shown.min()), float(shown.max())


def line_buckets(plan: LinePlan, columns: int) -> int:
    """Buckets of the lines in a row of so many pixels."""
    return (columns + 2 * int(np.ceil(plan.lead)) >> BUCKET) + 1


def line_capacity(plan: LinePlan, columns: int) -> int:
    """Most lines in a row of so many pixels."""
    if plan.step == 0.0 and plan.slope == 0.0:
        return 3 * min(plan.period, columns) + 16
    return int(3 * (3 * plan.period + 2 * columns * abs(plan.step))) + 64


@inlined
def start_phase(m, row, x):
    """Phase at pixel x of a physical row before its channel's constant is added, and its cell."""
    return m.a * np.float64(x) + m.b * np.float64(row), cell_of(m.cell_mode, x, m.height - 1 - row) % m.offsets.shape[0]


@inlined
def row_offsets(row, width, flip, columns, base, x0, plane, plan, u, out):
    """Camera offsets of pixels `columns` of a physical row, channel c's of pixel x at out[base + c·plane + x − x0].

    The phase is that of `view_rows.row_phase`, bit for bit; u (W,) float64 is scratch.
    """
    m, offsets = plan.map, plan.offsets
    a, b, views, reverse = m.a, m.b, np.float64(m.views), m.reverse
    count = np.uint64(columns[1] - columns[0])
    turn, sign = (width - 1 - columns[0], -1) if flip else (columns[0], 1)
    last, spacing, middle = offsets.shape[0] - 1, plan.spacing, plan.middle
    br = b * np.float64(row)
    for c in range(3):
        begin = np.uint64(base + c * plane + columns[0] - x0)
        if m.table.shape[0] > 0:
            line, period = m.table[row % m.table.shape[0]], m.table.shape[1]
            for i in range(count):
                view = np.int64(line[np.uint64(np.uint64(turn + sign * np.int64(i)) % np.uint64(period)), c])
                out[begin + i] = np.float32(offsets[np.uint64(last - view if reverse else view)])
            continue
        y = m.height - 1 - row
        even = m.offsets[cell_of(m.cell_mode, 0, y) % m.offsets.shape[0], c]
        odd = m.offsets[cell_of(m.cell_mode, 1, y) % m.offsets.shape[0], c]
        for i in range(count):
            x = turn + sign * np.int64(i)
            t = (a * np.float64(x) + br) + (odd if x & 1 else even)
            phi = t - np.floor(t)
            phi = 1.0 - phi if reverse and m.continuous else phi
            u[i] = (phi if phi < 1.0 else 0.0) * views
        if spacing != 0.0 and m.continuous:
            for i in range(count):
                out[begin + i] = np.float32(((u[i] - 0.5) - middle) * spacing)
        elif spacing != 0.0:
            for i in range(count):
                view = min(np.floor(u[i]), views - 1.0)
                out[begin + i] = np.float32(((views - 1.0 - view if reverse else view) - middle) * spacing)
        elif m.continuous:
            top, following = np.float64(max(last - 1, 0)), np.int64(min(last, 1))
            for i in range(count):
                at = u[i] - 0.5
                k = min(max(np.floor(at), 0.0), top)
                low, high = offsets[np.uint64(np.int64(k))], offsets[np.uint64(np.int64(k) + following)]
                out[begin + i] = np.float32(low + (at - k) * (high - low))
        else:
            for i in range(count):
                view = np.int64(min(np.floor(u[i]), views - 1.0))
                out[begin + i] = np.float32(offsets[np.uint64(last - view if reverse else view)])


@inlined
def middle_offset(plan):
    """The offset at which lines are sorted."""
    return np.float32(0.5 * (plan.low + plan.high))


@inlined
def bucket_at(x, plan, x0, buckets):
    """The bucket of lines that cross the middle offset at pixel x, the first or last where that is far away."""
    place = min(max((x - np.float32(x0)) + np.float32(plan.lead), ZERO), np.float32(buckets << BUCKET))
    return min(max(np.int64(place) >> BUCKET, 0), buckets - 1)


@inlined
def bucket_of(x, offset, plan, x0, buckets):
    """The bucket of a line through pixel x at a camera offset."""
    return bucket_at(x - (offset - middle_offset(plan)) * np.float32(plan.lean), plan, x0, buckets)


@inlined
def add_line(n, j0, j1, x, address, offset, drift, plan, x0, starts, found, found_ints):
    """Remember samples j0 … j1 of a line that begins at pixel x, and count it in its bucket."""
    found[0, n] = np.float32(x + j0 * plan.period)
    found[1, n] = np.float32(j1 - j0 + 1)
    found[2, n] = np.float32(offset + j0 * drift)
    found_ints[0, n] = address + j0 * plan.period
    bucket = bucket_of(found[0, n], found[2, n], plan, x0, starts.shape[0] - 1)
    found_ints[1, n] = bucket
    starts[bucket + 1] += 1
    return n + 1


@kernel
def make_lines(row, width, flip, columns, base, x0, plane, plan, starts, lines, addresses, found, found_ints):
    """Find the lines of pixels `columns` of a physical row, in buckets of where they cross the middle offset.

    lines (3, N) float32: pixel of the first sample, number of samples, offset of the first; addresses (N,) int32:
    place of the first sample, see row_offsets; starts: first line of each bucket from x0 − lead on, and after the last.
    found, and found_ints (2, N) of addresses and buckets: scratch.
    """
    m, period, step = plan.map, plan.period, plan.step
    n, per_step = 0, 1.0 / step if abs(step) > 1e-9 else 0.0
    starts[:] = 0
    for rho in range(min(period, columns[1] - columns[0])):
        x = columns[0] + rho
        shown = width - 1 - x if flip else x
        samples = (columns[1] - 1 - x) // period + 1
        for c in range(3):
            address = base + c * plane + x - x0
            if m.table.shape[0] > 0:
                view = m.table[row % m.table.shape[0], shown % period, c]
                offset = plan.offsets[m.views - 1 - view if m.reverse else view]
                n = add_line(n, 0, samples - 1, x, address, offset, 0.0, plan, x0, starts, found, found_ints)
                continue
            t, cell = start_phase(m, row, shown)
            t += m.offsets[cell, c]
            phi = t - np.floor(t)
            end = phi + (samples - 1) * step
            for wrap in range(
                np.int64(np.floor(min(phi, end) - NEAR_WRAP)), np.int64(np.floor(max(phi, end) + NEAR_WRAP)) + 1
            ):
                j0, j1 = 0, samples - 1
                if abs(step) > 1e-9:
                    first, last = (wrap - NEAR_WRAP - phi) * per_step, (wrap + 1 + NEAR_WRAP - phi) * per_step
                    first, last = min(first, last), max(first, last)
                    j0, j1 = max(np.int64(np.ceil(first)), 0), min(np.int64(np.floor(last)), samples - 1)
                if j0 <= j1:
                    offset = plan.first + plan.slope * (phi - wrap)
                    drift = plan.slope * step
                    n = add_line(n, j0, j1, x, address, offset, drift, plan, x0, starts, found, found_ints)
    for k in range(starts.shape[0] - 1):
        starts[k + 1] += starts[k]
    for k in range(n):
        bucket = found_ints[1, k]
        place = starts[bucket]
        starts[bucket] += 1
        lines[0, place], lines[1, place], lines[2, place] = found[0, k], found[1, k], found[2, k]
        addresses[place] = found_ints[0, k]
    for k in range(starts.shape[0] - 1, 0, -1):
        starts[k] = starts[k - 1]
    starts[0] = 0
