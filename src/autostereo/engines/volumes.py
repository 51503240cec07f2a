"""What engines make of volumes before they draw them: slices, half-spaces, and what may show anything."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene.volume import Volume
from ..transforms import apply
from .engine import Camera

MAX_PLANES = 2**20
LEVELS = 4096  # at which a transfer function is asked whether it shows anything


class Slices(NamedTuple):
    """All slices: depth of the first, distance, number of slabs between them."""

    first: float
    distance: float
    slabs: int


def depth_range(volumes: list[Volume], camera: Camera) -> tuple[float, float]:
    """Least and greatest eye depth of the boxes, from the near plane on."""
    depth = np.concatenate([apply(camera.eye_from_world, v.corners)[:, 2] for v in volumes])
    return max(float(depth.min()), camera.near), float(depth.max())


def make_slices(volumes: list[Volume], camera: Camera, step: float) -> Slices | None:
    """Slices through all volumes (see reference.volume.planes); None when nothing lies behind the near plane.

    Raises
    ------
    InputError
        There would be more than MAX_PLANES.
    """
    first, last = depth_range(volumes, camera)
    if last <= first:
        return None
    count = (last - first) / (step * min(float(v.voxel_size.min()) for v in volumes))
    if count > MAX_PLANES:
        raise InputError(f"options step: {step:g} voxels make {count:.3g} slabs of the volumes, at most {MAX_PLANES}")
    slabs = max(1, int(np.ceil(count)))
    return Slices(first, (last - first) / slabs, slabs)


def half_spaces(volume: Volume) -> NDArray[np.float64]:
    """Rows h (K, 4) such that h·(i, j, k, 1) ≥ 0 for all of them where something is seen: box, clipping box, plane."""
    last = np.asarray(volume.shape) - 1.0
    rows = [np.eye(4)[:3], np.column_stack([-np.eye(3), last])]
    if volume.clip_box is not None:
        low, high = volume.clip_box
        box = np.vstack([np.column_stack([np.eye(3), -low]), np.column_stack([-np.eye(3), high])])
        rows.append(box[np.isfinite(box).all(axis=1)] @ volume.object_from_index)
    if volume.clip_plane is not None:
        rows.append(np.asarray(volume.clip_plane)[None] @ volume.object_from_index)
    return np.vstack(rows)


def may_show(volume: Volume, least: NDArray, most: NDArray, tolerance: float = 0.0) -> NDArray[np.bool_]:
    """Whether a volume may show anything of scalars least … most, arrays of any shape.

    An isosurface is in doubt by `tolerance`.
    """
    if volume.mode == "iso":
        assert volume.iso is not None
        return np.asarray((least <= volume.iso + tolerance) & (most >= volume.iso - tolerance))
    low, high = volume.value_range
    values = np.union1d(np.linspace(low, high, LEVELS), np.clip(volume.transfer.points[:, 0], low, high))
    sides = [volume.transfer.limit(values, side)[..., 3] > 0 for side in ("left", "right")]
    total = np.concatenate([[0], np.cumsum(sides[0] | sides[1])])
    first = np.maximum(np.searchsorted(values, least, "right") - 1, 0)
    last = np.minimum(np.searchsorted(values, most, "left") + 1, len(values))
    if volume.mode == "mip":  # what shows nothing but is greater than what does hides it
        first[...] = 0
    return np.asarray(total[last] > total[first])
