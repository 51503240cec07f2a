"""Volumes in eye space: what the shaders of volumes are told about a frame (shaders/lib/volume.glsl)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...scene.volume import Volume
from ...transforms import apply
from ..engine import Camera
from ..volumes import half_spaces

NOTHING = (0.0, 0.0, 0.0, 1.0)  # a half-space that is everywhere


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


def pixel_in(places: dict[str, Any], camera: Camera) -> float:
    """Voxels that a pixel is wide in the middle of the volumes that were placed."""
    depth = max(float(np.mean([corners[:, 2] for corners in places["corners"]])), camera.near)
    return float(places["along"]) * depth / camera.fx


def most_half_spaces(volumes: list[Volume]) -> int:
    """Half-spaces of the volume that has most."""
    return max(len(half_spaces(v)) for v in volumes)
