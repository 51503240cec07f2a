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
MAX_VIEWS = 4096


def check_arguments(rig: Any, options: Any) -> None:
    """Raise InputError unless these are a Rig of a sane number of views and Options, or None."""
    if rig is not None and not isinstance(rig, Rig):
        raise InputError(f"rig: expected a Rig, got {type(rig).__name__}")
    if rig is not None and rig.views > MAX_VIEWS:
        raise InputError(f"rig views: expected at most {MAX_VIEWS}, got {rig.views}")
    if options is not None and not isinstance(options, Options):
        raise InputError(f"options: expected Options(…), got {type(options).__name__}")


def make_camera(rig: Rig, size: tuple[int, int]) -> Camera:
    """The centre camera of a rig for pictures of `size` = (width, height)."""
    width, height = check_size(size)
    half = np.tan(np.deg2rad(rig.fov_y) / 2)
    fy = height / 2 / half
    aspect = rig.aspect if rig.aspect is not None else width / height
    fx = width / 2 / (aspect * half)
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
