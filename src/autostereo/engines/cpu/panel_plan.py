"""Panel plans: the sub-pixels of a panel's row, sorted so that a segment finds those it may cover.

In a row of the panel every sub-pixel has a place x and a camera offset o. Sub-pixels of similar offset form a group,
in order of x, so that what a segment may cover is one stretch of each group. This asks nothing of the mask but the
offset of every sub-pixel: tables, slanted lenses, cells and continuous phases are one case, and nothing depends on V.

Sorting is dear, rows are many, and their masks are alike: row r's phases are those of another row, moved by some
pixels. So a few plans (`classes`) are made once per panel, a little wider than it, and every row takes the one that
fits best, moved by `shift` pixels. How the samples are sorted decides speed only: offsets are evaluated afresh and
exactly for every row, and bounds allow for the misfit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap, cell_index, offset_at
from .gather import map_args
from .jit import kernel

PHASE_CLASSES = 4  # starting phases for which plans are made
MARGIN = 16  # steps by which a plan can be moved
LANES, MAX_LANES = 16, 8  # groups come in whole SIMD registers, but not too many
PAD = 16  # samples read beyond a plan's end
NOWHERE = np.int32(-(2**23))
CELL_PERIODS = {0: (1, 1), 1: (2, 2), 2: (2, 1), 3: (2, 4), 4: (1, 2)}  # of CellPatternMode, in x and y


class Plans(NamedTuple):
    """Sorted samples of a few kinds of rows, N a row.

    x, kind, slot (C, N) int32: pixel; which constant of the map gives its phase (cell·3 + channel), or its view for
    tables; 4 × place in the finished row + channel. first (C, W' + 1, G) and begin (C, G + 1) int32: first sample of
    each group at or right of a pixel, and of all. bounds (2, G) float32: least and greatest offset in a group.
    row_class, row_shift (H,) int32. constants: the map's phase constants in one line; offsets (V,) float64 of the
    views; margin: pixels by which a plan is wider than the panel on either side.
    """

    x: NDArray[np.int32]
    kind: NDArray[np.int32]
    slot: NDArray[np.int32]
    first: NDArray[np.int32]
    begin: NDArray[np.int32]
    bounds: NDArray[np.float32]
    row_class: NDArray[np.int32]
    row_shift: NDArray[np.int32]
    constants: NDArray[np.float64]
    offsets: NDArray[np.float64]
    margin: int


@kernel
def sort_row(group, kind, margin, groups, x, kinds, slot, first, begin):
    """Sort the samples of a row, whose groups and kinds are (W', 3) int32, into one class's arrays."""
    width = group.shape[0]
    for g in range(groups + 1):
        begin[g] = 0
    for i in range(width):
        for c in range(3):
            begin[group[i, c] + 1] += 1
    for g in range(groups):
        begin[g + 1] += begin[g]
    cursor = begin[:groups].copy()
    for i in range(width):
        for g in range(groups):
            first[i, g] = cursor[g]
        for c in range(3):
            k = cursor[group[i, c]]
            cursor[group[i, c]] += 1
            x[k], kinds[k], slot[k] = i - margin, kind[i, c], 4 * (3 * i + c) + c
    for g in range(groups):
        first[width, g] = begin[g + 1]
    for k in range(begin[groups], x.shape[0]):
        x[k], kinds[k], slot[k] = NOWHERE, 0, 4 * 3 * width


def make_plans(viewmap: ViewMap, size: tuple[int, int], flips: tuple[bool, bool], offsets: NDArray) -> Plans:
    """Make the plans of a panel of size (W, H) for camera offsets (V,).

    There are about as many groups as sub-pixels behind a lens, or as views of a table, and one for misfits.
    """
    width, height = size
    behind_lens = viewmap.views if viewmap.table is not None else 3.0 / max(abs(viewmap.a), 1e-6)
    groups = LANES * int(np.clip(round(behind_lens / LANES), 1, MAX_LANES))
    rows = np.arange(height)
    physical = height - 1 - rows if flips[1] else rows
    if viewmap.table is not None:
        phases, kinds, row_class, row_shift, margin, misfit = _table_rows(viewmap, width, flips[0], physical)
    else:
        phases, kinds, row_class, row_shift, margin, misfit = _phase_rows(viewmap, width, flips[0], physical)
    group = np.minimum((phases * groups).astype(np.int32), groups - 1)
    if misfit > 0:  # near the wrap of the phase an offset may jump from one end to the other
        group[(phases < misfit) | (phases >= 1 - misfit)] = groups
    count = groups + 1  # the last one is that of the misfits
    total = 3 * (width + 2 * margin) + PAD
    classes = len(phases)
    constants = map_args(viewmap).offsets.ravel()
    plans = Plans(
        np.empty((classes, total), np.int32),
        np.empty((classes, total), np.int32),
        np.empty((classes, total), np.int32),
        np.empty((classes, width + 2 * margin + 1, count), np.int32),
        np.empty((classes, count + 1), np.int32),
        _bounds(viewmap, offsets, groups, misfit),
        row_class.astype(np.int32),
        row_shift.astype(np.int32),
        constants,
        np.ascontiguousarray(offsets, dtype=np.float64),
        margin,
    )
    for k in range(classes):
        sorted_row = (plans.x[k], plans.kind[k], plans.slot[k], plans.first[k], plans.begin[k])
        sort_row(group[k].astype(np.int32), kinds[k].astype(np.int32), margin, count, *sorted_row)
    return plans


def _table_rows(viewmap: ViewMap, width: int, flip: bool, physical: NDArray) -> tuple:
    """Classes of a table's rows: one for each of its rows; kinds are views."""
    assert viewmap.table is not None
    used, row_class = np.unique(physical % viewmap.table.shape[0], return_inverse=True)
    columns = np.arange(width)
    views = viewmap.view(used, width - 1 - columns if flip else columns)
    return (views + 0.5) / viewmap.views, views, row_class, np.zeros(len(physical), int), 0, 0.0


def _phase_rows(viewmap: ViewMap, width: int, flip: bool, physical: NDArray) -> tuple:
    """Classes of a phase map's rows: starting phases × kinds of rows of its cells; kinds are cell·3 + channel."""
    assert viewmap.offsets is not None
    period_x, period_y = CELL_PERIODS[viewmap.cell_mode]
    margin = MARGIN * period_x
    x = np.arange(-margin, width + margin)
    x = width - 1 - x if flip else x
    parity = (viewmap.height - 1 - physical) % period_y
    start = np.arange(PHASE_CLASSES) / PHASE_CLASSES
    phases, kinds = [], []
    for y in range(period_y):
        cell = cell_index(viewmap.cell_mode, x, y) % len(viewmap.offsets)
        t = (viewmap.a * x)[:, None] + viewmap.offsets[cell]
        kind = 3 * cell[:, None] + np.arange(3)
        for phase in start:
            phases.append((t + phase) % 1.0)
            kinds.append(kind)
    # moving the plan by s pixels adds a·s (−a·s if mirrored) to the phase of what stands at a pixel of the plan
    steps = np.arange(-MARGIN, MARGIN + 1) * period_x
    moved = (-viewmap.a if flip else viewmap.a) * steps
    misfit = (viewmap.b * physical[:, None, None] + moved[:, None] - start) % 1.0  # (H, steps, classes)
    misfit = np.minimum(misfit, 1.0 - misfit).reshape(len(physical), -1)
    best = misfit.argmin(axis=1)
    row_shift, row_class = steps[best // PHASE_CLASSES], parity * PHASE_CLASSES + best % PHASE_CLASSES
    worst = float(misfit[np.arange(len(physical)), best].max()) + 1e-6
    return np.array(phases), np.array(kinds), row_class, row_shift, margin, worst


def _bounds(viewmap: ViewMap, offsets: NDArray, groups: int, misfit: float) -> NDArray[np.float32]:
    """Least and greatest camera offset of each group, and of the last: any."""
    edges = np.arange(groups + 1) / groups
    phase = np.stack([edges[:-1] - misfit, edges[1:] + misfit])
    phase = np.concatenate([phase, [[0.0], [1.0]]], axis=1)
    if viewmap.table is None and viewmap.reverse:
        phase = 1.0 - phase[::-1]
    if viewmap.continuous:
        bounds = offset_at(offsets, phase * viewmap.views - 0.5)
    else:
        views = np.clip(np.floor(phase * viewmap.views + np.array([[-1e-6], [1e-6]])), 0, viewmap.views - 1)
        bounds = offsets[views.astype(int)]
    slack = 1e-6 * np.abs(offsets).max()
    return (bounds + np.array([[-slack], [slack]])).astype(np.float32)
