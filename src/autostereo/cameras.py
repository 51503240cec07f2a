"""From a rig to what engines draw: its centre camera, the extent of its offsets, and what is checked before."""

from __future__ import annotations

from typing import Any

import numpy as np

from .display.display import Display
from .display.rig import Rig
from .engines.engine import Camera
from .engines.options import Options
from .errors import InputError
from .scene.scene import Scene

MAX_SIDE = 65536
MAX_SHIFT = 1e9  # pixels: what engines still count in 32 bits


def check_arguments(rig: Any, options: Any) -> None:
    """Raise InputError unless these are a Rig and Options, or None."""
    if rig is not None and not isinstance(rig, Rig):
        raise InputError(f"rig: expected a Rig, got {type(rig).__name__}")
    if options is not None and not isinstance(options, Options):
        raise InputError(f"options: expected Options(…), got {type(options).__name__}")


def make_camera(rig: Rig, size: tuple[int, int], aperture: float = 0.0) -> Camera:
    """The centre camera of a rig for pictures of `size` = (width, height), seen through lenses of that `aperture`."""
    width, height = check_size(size)
    half = np.tan(np.deg2rad(rig.fov_y) / 2)
    fy = height / 2 / half
    aspect = rig.aspect if rig.aspect is not None else width / height
    fx = width / 2 / (aspect * half)
    across, up = float(np.abs(rig.camera_offsets).max()) + aperture / 2, abs(rig.offset_y) + aperture / 2
    reach = max(fx * across, fy * up) / rig.focal
    if reach > MAX_SHIFT:
        raise InputError(
            f"rig: expected its outermost cameras to see a far point up to {MAX_SHIFT:g} pixels apart from the middle "
            f"one, found {reach:g}; compare baseline (or aperture) and focal_distance"
        )
    return Camera(rig.eye_from_world, float(fx), float(fy), width, height, rig.focal, rig.near_depth, rig.offset_y)


def check_size(size: Any) -> tuple[int, int]:
    """Return (width, height) as whole numbers within limits, or raise InputError."""
    try:
        width, height = size
    except (TypeError, ValueError):
        raise InputError(f"size: expected (width, height), got {size!r}") from None
    for number in (width, height):
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or not 1 <= number <= MAX_SIDE:
            raise InputError(f"size: expected whole numbers 1…{MAX_SIDE}, got {width!r}×{height!r}")
    return int(width), int(height)


def culling_range(rig: Rig, display: Display | None = None) -> tuple[float, float]:
    """Least and greatest camera offset that a draw may use; a continuous panel reaches half a view beyond the ends."""
    if display is not None and display.continuous:
        low, high = rig.offset_at(np.array([-0.5, rig.views - 0.5]))
        return float(low), float(high)
    offsets = rig.camera_offsets
    return float(offsets[0]), float(offsets[-1])


def check_in_view(scene: Scene, rig: Rig) -> None:
    """Raise InputError when the whole scene lies behind the cameras."""
    bounds = scene.bounds
    corners = np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    depth = corners @ rig.eye_from_world[2, :3] + rig.eye_from_world[2, 3]
    if depth.max() < rig.near_depth:
        raise InputError(
            f"rig: the scene lies behind the cameras (its farthest point is at depth {depth.max():.4g}, "
            f"the near plane at {rig.near_depth:.4g}); move `position` or turn `target`"
        )
