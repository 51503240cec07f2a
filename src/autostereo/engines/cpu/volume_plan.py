"""Where a volume's slices lie, and whether views may share the slabs between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..engine import Camera
from ..volumes import MAX_PLANES, Slices
from .volume_shared import MAX_LENGTH, PAIRS

STEEPEST = 0.5  # greatest offset of a camera over the nearest depth, up to which views may share slabs
BUNDLES = (2, 4, 8)  # slabs blended once for a group of views; whole parts of SLABS
SLIP = (0.25, 0.1)  # most pixels, and voxels, by which slabs of a bundle are off in a view
SLIDE = (1.0, 2.0)  # pixels by which front and back of a shared slab slide apart, at most; panels are coarser by nature


def share_slices(slices: Slices, camera: Camera, offsets: NDArray[np.float64], most: float) -> Slices:
    """The same slices, or ones closer by a whole factor.

    A slab moves as one, though its front and its back part in views aside: by `most` pixels, no more.
    """
    after = slices.first + slices.distance  # the nearest slab is the one that moves most
    slide = float(np.abs(offsets).max()) * camera.fx * (1 / slices.first - 1 / after)
    parts = int(np.clip(np.ceil(slide / most), 1, MAX_PLANES // slices.slabs))
    return Slices(slices.first, slices.distance / parts, slices.slabs * parts)


def shared_reach(camera: Camera, slices: Slices, offsets: NDArray[np.float64]) -> tuple[float, int]:
    """Where shared slabs begin, in pixels, and their length, in pixels, so that they reach as far as views see."""
    ends = np.array([slices.first, slices.first + slices.slabs * slices.distance])
    shifts = np.outer(offsets, camera.fx / camera.focal - camera.fx / ends)
    begin = float(np.floor(-shifts.max())) - 2.0
    length = int(np.ceil(camera.width - float(shifts.min()) + 4.0 - begin))
    return begin, -(-length // (2 * PAIRS)) * (2 * PAIRS)


def can_share(camera: Camera, slices: Slices, offsets: NDArray[np.float64]) -> bool:
    """Whether slabs may be shared: not by cameras amid the volume, which see a slab from all sides."""
    flat = float(np.abs(offsets).max()) <= STEEPEST * slices.first
    return flat and shared_reach(camera, slices, offsets)[1] <= MAX_LENGTH


def view_groups(offsets: NDArray[np.float64], most: float) -> NDArray[np.int64]:
    """Where groups of neighbouring cameras begin, evenly, none wider than `most`; last: the number of views."""
    reach = float(offsets[-1] - offsets[0])
    count = max(int(np.ceil(reach / most)), 1)
    group = np.minimum((offsets - offsets[0]) * count / max(reach, 1e-300), count - 1).astype(np.int64)
    return np.array([*np.flatnonzero(np.diff(group, prepend=-1)), len(offsets)])


def plan_bundles(
    camera: Camera, slices: Slices, offsets: NDArray[np.float64], fine: int, pixel: float
) -> tuple[int, NDArray[np.int64]]:
    """Slabs in a bundle and groups of views that share bundles, so that a slab is blended least often.

    pixel: width of the nearest pixel, in voxels. Slabs lie one after the other at equal distances, so that the two
    nearest ones part most from view to view.
    """
    after = slices.first + slices.distance
    apart = camera.fx * (1 / slices.first - 1 / after)  # pixels between the two, per unit of offset
    slip = min(SLIP[0], SLIP[1] / pixel)
    _, length = shared_reach(camera, slices, offsets)
    wider = length / camera.width * fine
    plans = [(1, view_groups(offsets, np.inf))]
    for size in BUNDLES:
        plans.append((size, view_groups(offsets, 4 * slip / ((size - 1) * apart))))
    costs = [len(offsets) / size + (wider * (len(begins) - 1) if size > 1 else 0) for size, begins in plans]
    return plans[int(np.argmin(costs))]
