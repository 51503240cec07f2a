"""Volumes in eye space: what the shaders of volumes are told about a frame (shaders/lib/volume.glsl)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scene.volume import Volume
from ...transforms import apply
from ..engine import Camera
from ..reference.volume import MAX_PLANES

Array = NDArray[np.float64]
NOTHING = (0.0, 0.0, 0.0, 1.0)  # a half-space that is everywhere


@dataclass(frozen=True)
class Slices:
    """Planes of constant depth, the same for all views: engines/reference/volume.py, `planes`."""

    first: float
    distance: float
    slabs: int

    @staticmethod
    def through(volumes: list[Volume], camera: Camera, step: float) -> Slices | None:
        """Those through all volumes of a scene; None when nothing lies behind the near plane."""
        depth = np.concatenate([apply(camera.eye_from_world, v.corners)[:, 2] for v in volumes])
        first, last = max(float(depth.min()), camera.near), float(depth.max())
        if last <= first:
            return None
        count = (last - first) / (step * min(float(v.voxel_size.min()) for v in volumes))
        if count > MAX_PLANES:
            raise InputError(
                f"options step: {step:g} voxels make {count:.3g} slabs of the volumes, at most {MAX_PLANES}"
            )
        slabs = max(1, int(np.ceil(count)))
        return Slices(first, (last - first) / slabs, slabs)


def half_spaces(volume: Volume) -> Array:
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


def placing(volumes: list[Volume], camera: Camera) -> dict[str, Any]:
    """Uniforms that place volumes in eye space."""
    inverses = [np.linalg.inv(camera.eye_from_world @ v.world_from_index) for v in volumes]
    rows = [half_spaces(v) @ inverse for v, inverse in zip(volumes, inverses, strict=True)]
    most = max(len(r) for r in rows)
    padded = [np.vstack([r, np.tile(NOTHING, (most - len(r), 1))]) for r in rows]
    return {
        "index_from_eye": [inverse.T for inverse in inverses],  # column by column
        # −∇s in eye space is −(∂index/∂eye)ᵀ·∂s/∂index, whatever its length; as columns, the matrix itself
        "normal_from_gradient": [-inverse[:3, :3] / np.abs(inverse[:3, :3]).max() for inverse in inverses],
        "voxel_count": [v.shape for v in volumes],
        "half_spaces": padded,
        "corners": [apply(camera.eye_from_world, v.corners) for v in volumes],
        "along": max(float(np.linalg.norm(inverse[:3, 0])) for inverse in inverses),
    }


def most_half_spaces(volumes: list[Volume]) -> int:
    """Half-spaces of the volume that has most."""
    return max(len(half_spaces(v)) for v in volumes)


def put(program: Any, **uniforms: Any) -> None:
    """Set uniforms of float32, those that the program has."""
    for name, values in uniforms.items():
        if name in program:
            program[name].write(np.ascontiguousarray(values, dtype=np.float32).tobytes())


def put_units(program: Any, **units: Any) -> None:
    """Set the texture units of samplers, those that the program has."""
    for name, values in units.items():
        if name in program:
            program[name].write(np.ascontiguousarray(values, dtype=np.int32).tobytes())
