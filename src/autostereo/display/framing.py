"""Framing: a rig that shows a whole scene in every view, at a disparity the display can carry (displays.md 3.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import FARTHEST, SMALLEST, check_choice, real_array
from ..errors import InputError
from .display import Display
from .rig import Rig

MARGIN = 0.05  # share of the half-window left free at every side
CLOSEST = 1.25  # least distance from the bounds' centre, in half-depths of the bounds: near ≥ a fifth of it
# where cameras may stand, and which way is up: (towards them, up)
SIDES = {
    "front": ((0, 0, 1), (0, 1, 0)),
    "back": ((0, 0, -1), (0, 1, 0)),
    "left": ((-1, 0, 0), (0, 1, 0)),
    "right": ((1, 0, 0), (0, 1, 0)),
    "top": ((0, 1, 0), (0, 0, -1)),
    "bottom": ((0, -1, 0), (0, 0, 1)),
}
# the same of a patient whose x runs to the left, y to the back, z to the head
PATIENT_SIDES = {
    "front": ((0, -1, 0), (0, 0, 1)),
    "back": ((0, 1, 0), (0, 0, 1)),
    "left": ((1, 0, 0), (0, 0, 1)),
    "right": ((-1, 0, 0), (0, 0, 1)),
    "top": ((0, 0, 1), (0, -1, 0)),
    "bottom": ((0, 0, -1), (0, -1, 0)),
}


@dataclass(frozen=True)
class DepthBudget:
    """What depth a scene asks for, and what a display can carry.

    Attributes
    ----------
    nearest, farthest : float
        Depth range of the scene's bounds before the rig, world units (nearest not in front of the near plane).
    focal_distance, baseline : float
        Of the rig, world units.
    disparity_near, disparity_far : float
        Largest disparity between adjacent views at those depths, in pixels of `Display.comfort_size`; < 0 pops out of
        the panel, > 0 lies behind it.
    comfort : float
        The display's limit, px.
    comfortable : (float, float)
        Depths between which |disparity| ≤ comfort; inf where everything behind the panel is.
    """

    nearest: float
    farthest: float
    focal_distance: float
    baseline: float
    disparity_near: float
    disparity_far: float
    comfort: float
    comfortable: tuple[float, float]

    @property
    def fits(self) -> bool:
        """Whether the whole scene is comfortable."""
        return max(abs(self.disparity_near), abs(self.disparity_far)) <= self.comfort


def frame_rig(scene: Any, display: Display, side: str = "front") -> Rig:
    """Choose a rig for `scene`, anything with world bounds `.bounds` (2, 3), on `display`.

    The cameras look at the bounds' centre from `side` with the display's `fov_y`: from the front along −z, y up, or,
    if some object of the scene is `anatomical`, along y, z up. The focal plane is balanced,
    1/F = (1/near + 1/far)/2, so that the nearest and farthest depth have opposite disparities of one size. The baseline
    is the smaller of what the display's cone spans at the focal plane, 2·F·tan(cone/2), and what keeps the disparity
    between adjacent views within `comfort` pixels of `comfort_size`. The distance is the least from which the whole box
    lies inside the window of every view, with a margin.

    Spacing is linear: a lens maps phase to tan of the angle (DESIGN, "Optics of observe"), and adjacent disparities are
    then all alike. The baseline joins the outermost cameras (ends included); for a continuous mask, whose camera
    coordinate runs half a step beyond them, the fit covers that.
    """
    if not isinstance(display, Display):
        raise InputError(f"display: expected a Display, such as Display.preset('…'), got {type(display).__name__}")
    center, half = _box(scene)
    check_choice("side", side, SIDES)
    anatomical = any(getattr(item, "anatomical", False) for item in getattr(scene, "objects", (scene,)))
    towards, up = (PATIENT_SIDES if anatomical else SIDES)[side]
    hx, hy, hz = (float(np.abs(axis) @ half) for axis in (np.cross(up, towards), up, towards))
    steps = max(display.views - 1, 1)
    tan_y = math.tan(math.radians(display.fov_y) / 2)
    tan_x = tan_y * display.aspect
    room = 1 - MARGIN
    reach = (steps + 1) / steps if display.continuous else 1.0

    # half the baseline, as a share of F: min(by_cone, by_comfort/δ), where δ = hz/D is |1 − F/d| at both ends
    by_cone, by_comfort = _limits(display)

    # inside at the near face, the tightest: hx/(D − hz) + reach·min(by_cone·hz/D, by_comfort) ≤ room·tan_x
    t, k = room * tan_x, reach * by_cone
    sum_ = t * hz + hx + k * hz
    distance_x = (sum_ + math.sqrt(max(sum_ * sum_ - 4 * t * k * hz * hz, 0.0))) / (2 * t)
    if reach * by_comfort < t:
        distance_x = min(distance_x, hz + hx / (t - reach * by_comfort))
    distance = max(distance_x, hz + hy / (room * tan_y), CLOSEST * hz)

    focal = distance - hz * hz / distance  # = 2·near·far/(near + far)
    delta = hz / distance
    share = by_cone if by_cone * delta <= by_comfort else by_comfort / delta
    return Rig(
        position=tuple(c + distance * t for c, t in zip(center, towards, strict=True)),  # type: ignore[arg-type]
        target=center,
        up=up,
        fov_y=display.fov_y,
        focal_distance=focal,
        baseline=2 * focal * share,
        views=display.views,
        spacing="linear",
        aspect=display.aspect,
    )


def frame_depths(depth: NDArray[np.float32], display: Display, fov_y: float) -> Rig:
    """Choose a rig for a picture with depths (H, W), taken with `fov_y` degrees from (0, 0, 0) along −z.

    Focal plane and baseline as in `frame_rig`, for depths from the first to the ninety-ninth per cent: depth cameras
    have outliers.

    Raises
    ------
    InputError
        Nothing has a finite depth.
    """
    finite = depth[np.isfinite(depth)].astype(np.float64)
    if not finite.size:
        raise InputError("depth: expected some finite depths, found none")
    near, far = np.percentile(finite, (1, 99)).tolist()
    focal = 2 / (1 / near + 1 / far)
    rig = Rig((0, 0, 0), (0, 0, -1), fov_y=fov_y, focal_distance=focal, views=display.views, aspect=display.aspect)
    by_cone, by_comfort = _limits(display, rig)
    delta = focal / near - 1
    return replace(rig, baseline=2 * focal * (by_cone if by_cone * delta <= by_comfort else by_comfort / delta))


def depth_budget(scene: Any, display: Display, rig: Rig | None = None) -> DepthBudget:
    """What depth `scene` (with `.bounds`, or the bounds (2, 3) themselves) asks for on `display`, seen by `rig`.

    None: the rig of `frame_rig`.

    Raises
    ------
    InputError
        The scene lies behind the camera.
    """
    bounds = _bounds(scene)
    rig = frame_rig(scene, display) if rig is None else rig.with_views(display.views)
    corners = np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    depths = corners @ rig.eye_from_world[2, :3] + rig.eye_from_world[2, 3]
    farthest = float(depths.max())
    if farthest <= rig.near_depth:
        raise InputError("rig: the whole scene lies behind the camera")
    nearest = max(float(depths.min()), rig.near_depth)

    offsets = rig.camera_offsets
    step = float(np.diff(offsets).max()) if len(offsets) > 1 else rig.baseline
    per_ratio = step * _focal_px(display, rig) / rig.focal  # px per unit of 1 − F/d
    limit = display.comfort / per_ratio if per_ratio > 0 else math.inf
    return DepthBudget(
        nearest=nearest,
        farthest=farthest,
        focal_distance=rig.focal,
        baseline=rig.baseline,
        disparity_near=per_ratio * (1 - rig.focal / nearest),
        disparity_far=per_ratio * (1 - rig.focal / farthest),
        comfort=display.comfort,
        comfortable=(rig.focal / (1 + limit), rig.focal / (1 - limit) if limit < 1 else math.inf),
    )


def _focal_px(display: Display, rig: Rig | None = None) -> float:
    """f_x in pixels of `display.comfort_size` (DESIGN section 1)."""
    fov_y = display.fov_y if rig is None else rig.fov_y
    aspect = display.aspect if rig is None or rig.aspect is None else rig.aspect
    return display.comfort_size[0] / 2 / (aspect * math.tan(math.radians(fov_y) / 2))


def _limits(display: Display, rig: Rig | None = None) -> tuple[float, float]:
    """What half the baseline, as a share of the focal distance, is limited by: the cone; comfort, times |1 − F/d|."""
    steps = max(display.views - 1, 1)
    by_comfort = (1 - 1e-9) * display.comfort * steps / (2 * _focal_px(display, rig))  # rounding stays inside the limit
    return math.tan(math.radians(display.cone_deg) / 2), by_comfort


def _bounds(scene: Any) -> NDArray[np.float64]:
    """Checked bounds (2, 3): finite, ordered, of a size that float64 can place cameras around."""
    given = real_array("bounds", getattr(scene, "bounds", scene), "numbers of shape (2, 3)")
    bounds = np.array(given, dtype=np.float64)
    if bounds.shape != (2, 3):
        raise InputError(f"bounds: expected shape (2, 3), got {bounds.shape}")
    if not np.isfinite(bounds).all() or np.abs(bounds).max() > FARTHEST:
        raise InputError(f"bounds: expected finite coordinates up to {FARTHEST:g}, got {bounds.tolist()}")
    if (bounds[0] > bounds[1]).any():
        raise InputError(f"bounds: expected the lower corner first, got {bounds.tolist()}")
    return bounds


def _box(scene: Any) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Centre and half-extents of the bounds; a box too small to be looked at (a point) is given a size."""
    bounds = _bounds(scene)
    center = (bounds[0] + bounds[1]) / 2
    half = (bounds[1] - bounds[0]) / 2
    least = 1e-6 * float(np.abs(center).max())
    if half.max() <= least or half.max() < SMALLEST:
        half = np.maximum(half, least if least >= SMALLEST else 0.5)
    x, y, z = center.tolist()
    hx, hy, hz = half.tolist()
    return (x, y, z), (hx, hy, hz)
