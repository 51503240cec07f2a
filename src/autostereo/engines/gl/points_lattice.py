"""Where a panel's sub-pixels of neighbouring cameras lie: on lattices, if phases grow by the same step along each row.

They do under a slanted lens, and in most tables. The sub-pixels of a range of phases, a *slot*, are then found by
arithmetic instead of looking at all that some camera sees (as the lines of engines/cpu/panel_lines.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...viewmap import ViewMap, offset_at

MOST_SLOTS = 64
SLACK = 1e-3  # of a phase: what rounding may change, and more
APART = 1e-5  # of the greatest offset: slots' cameras that are nearer than this are too near for float32
UNEVEN = 1e-4  # steps between channels may differ by so much of a phase


@dataclass(frozen=True, eq=False)
class Lattice:
    """Phases start[r] + step·u of the units u of row r of a panel, counted from its left end.

    Attributes
    ----------
    units : int
        In a pixel: 3 if a unit is a sub-pixel, 1 if the sub-pixels of a pixel show the same camera.
    step : float
        > 0.
    starts : ndarray of shape (H,), float32
    slots : ndarray of shape (S, 4), float32
        Least and greatest camera offset, ascending; between which phases. A camera belongs to the last slot that begins
        at it or before.
    exact : bool
        Each slot is one camera, and all units found in it are its.
    """

    units: int
    step: float
    starts: NDArray[np.float32]
    slots: NDArray[np.float32]
    exact: bool


def find_lattice(viewmap: ViewMap, size: tuple[int, int], offsets: NDArray[np.float64]) -> Lattice | None:
    """The lattice of a panel (width, height) with these camera offsets, or None if it has none worth the looking."""
    found = _phases(viewmap, size[1])
    if found is None:
        return None
    units, along, starts = found
    if viewmap.reverse and viewmap.table is None:
        along, starts = -along, -starts
    step = along - round(along)
    slots = min(MOST_SLOTS, round(1 / abs(step))) if abs(step) > 1e-6 else 1
    slots = slots if viewmap.continuous else min(slots, viewmap.views)
    if slots < 2:
        return None
    cameras, phases = _slots(viewmap, slots, offsets)
    least = APART * np.abs(cameras).max() + np.finfo(np.float32).tiny
    if np.diff(cameras[:, 0]).min() < least:
        return None  # a camera does not tell its slot
    slack = SLACK + 4e-7 * abs(step) * units * size[0]
    phases += slack * np.array([-1, 1])
    if step < 0:
        step, starts, phases = -step, -starts, 1 - phases[:, ::-1]
    starts = starts - np.floor(starts)
    exact = viewmap.table is not None and slots == viewmap.views  # phases of tables lie between those of slots' ends
    return Lattice(units, step, starts.astype(np.float32), np.hstack([cameras, phases]).astype(np.float32), exact)


def _phases(viewmap: ViewMap, height: int) -> tuple[int, float, NDArray[np.float64]] | None:
    """Units of a pixel, the step from one to the next, the phase of each row's first."""
    rows = np.arange(height)
    if viewmap.table is not None:
        views = viewmap.views
        table = (views - 1 - viewmap.table if viewmap.reverse else viewmap.table).astype(np.int64)
        units = 1 if viewmap.per_pixel else 3
        line = table[..., :1] if units == 1 else table
        line = line.reshape(len(table), -1)
        count = line.shape[1]
        step = int(line[0, 1] - line[0, 0]) if count > 1 else 0
        if ((line[:, :1] + step * np.arange(count) - line) % views).any() or step * count % views:
            return None
        return units, step / views, (line[rows % len(line), 0] + 0.5) / views
    assert viewmap.offsets is not None
    if len(viewmap.offsets) > 1 and viewmap.cell_mode != 0:
        return None
    channels = viewmap.offsets[0]
    for units, between in ((1, 0.0), (3, viewmap.a / 3)):
        error = channels - channels[0] - between * np.arange(3)
        if np.abs(error - np.round(error)).max() < UNEVEN:
            return units, viewmap.a / units, viewmap.b * rows + channels[0]
    return None


def _slots(
    viewmap: ViewMap, count: int, offsets: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of so many slots the least and greatest camera offset, and the phases between which they lie."""
    views = viewmap.views
    if viewmap.continuous:
        phases = np.arange(count + 1) / count
        edges = offset_at(offsets, phases * views - 0.5)
        return np.stack([edges[:-1], edges[1:]]).T, np.stack([phases[:-1], phases[1:]]).T
    edge = np.round(np.arange(count + 1) * views / count).astype(np.int64)
    first, last = edge[:-1], edge[1:] - 1
    return np.stack([offsets[first], offsets[last]]).T, np.stack([first, last + 1]).T / views
