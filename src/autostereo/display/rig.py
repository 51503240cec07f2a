"""Rig: a row of parallel cameras that share one window in the focal plane (DESIGN section 1)."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks import (
    ASPECT_RANGE,
    FARTHEST,
    FOV_RANGE,
    SMALLEST,
    Vector,
    check_choice,
    check_direction,
    check_number,
    check_reach,
    check_vector,
    check_views,
    plain_numbers,
)
from ..errors import FileError, InputError
from ..image import as_path, write_atomic
from ..transforms import eye_from_world
from ..viewmap import offset_at
from ..wording import counted

if TYPE_CHECKING:
    from .display import Display

LENGTHS = {"focal_distance": SMALLEST, "near": SMALLEST, "baseline": 0.0, "offset_y": -FARTHEST}  # from … to FARTHEST
OPTIONAL = ("focal_distance", "near")  # lengths that are None until something says them
SPACINGS = ("linear", "equal-angle", "cell-centred")


@dataclass(frozen=True)
class Rig:
    """V cameras on one horizontal line, parallel, with off-axis frusta through one window.

    Parameters
    ----------
    position, target, up : (3,) float
        Centre of the line of cameras, a point straight ahead, and the upward direction, in world units. Lengths and
        places lie within ±1e15.
    fov_y : float
        Vertical field of view in degrees of the focal-plane window, 0.001…179.
    focal_distance : float, optional
        Distance of the plane without parallax; None: |target − position|.
    baseline : float
        Distance between the outermost cameras, world units.
    views : int
        V, 1…4096; with V = 1 the camera stands at offset 0.
    spacing : {"linear", "equal-angle", "cell-centred"}
        Equal steps; equal angles seen from the focal point, ends included; equal angles, centres of V equal cells
        (displays.md 3.4). With "cell-centred" the baseline spans the cells' outer edges.
    offsets : sequence of V floats, optional
        Explicit camera offsets, ascending, instead of baseline and spacing.
    aspect : float, optional
        Width/height of the window, 1e-6…1e6; None: that of the picture.
    near : float, optional
        Depth of the near plane; None: 0.01·focal_distance. There is no far plane.
    offset_y : float
        Vertical lens offset o_y, for depth of field.
    """

    position: Vector = (0.0, 0.0, 4.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    fov_y: float = 36.0
    focal_distance: float | None = None
    baseline: float = 1.2
    views: int = 8
    spacing: str = "linear"
    offsets: tuple[float, ...] | None = None
    aspect: float | None = None
    near: float | None = None
    offset_y: float = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("position", "target"):
            put(self, name, check_vector(f"rig {name}", getattr(self, name), FARTHEST))
        put(self, "up", check_direction("rig up", self.up))
        _ = self.eye_from_world  # raises if degenerate
        put(self, "fov_y", check_number("rig fov_y", self.fov_y, *FOV_RANGE))
        for name, low in LENGTHS.items():
            if name not in OPTIONAL or getattr(self, name) is not None:
                put(self, name, check_number(f"rig {name}", getattr(self, name), low, FARTHEST))
        if self.aspect is not None:
            put(self, "aspect", check_number("rig aspect", self.aspect, *ASPECT_RANGE))
        put(self, "views", check_views(self.views, "rig views"))
        check_choice("rig spacing", self.spacing, SPACINGS)
        if self.offsets is not None:
            self._check_offsets()

    def _check_offsets(self) -> None:
        given = plain_numbers("rig offsets", self.offsets).astype(np.float64)
        if given.ndim != 1 or given.size == 0 or not np.isfinite(given).all() or (np.diff(given) <= 0).any():
            raise InputError("rig offsets: expected finite numbers, strictly ascending (view 0 is the leftmost)")
        check_reach("rig offsets", given, FARTHEST)
        check_views(given.size, "rig views")
        if self.views not in (given.size, Rig.views):
            raise InputError(f"rig offsets: expected {self.views} numbers (views), got {given.size}")
        object.__setattr__(self, "offsets", tuple(float(o) for o in given))
        object.__setattr__(self, "views", int(given.size))
        object.__setattr__(self, "baseline", float(given[-1] - given[0]))

    @property
    def focal(self) -> float:
        """Focal distance fd in world units."""
        if self.focal_distance is not None:
            return self.focal_distance
        return float(np.linalg.norm(np.subtract(self.target, self.position)))

    @property
    def near_depth(self) -> float:
        """Depth of the near plane in world units."""
        return 0.01 * self.focal if self.near is None else self.near

    @property
    def camera_offsets(self) -> NDArray[np.float64]:
        """Camera offsets vd_i (V,), ascending, world units; view 0 is the leftmost."""
        if self.offsets is not None:
            return np.array(self.offsets)
        if self.views == 1:
            return np.zeros(1)
        i = np.arange(self.views, dtype=np.float64)
        if self.spacing == "linear":
            return (i - (self.views - 1) / 2) * (self.baseline / (self.views - 1))
        half = float(np.arctan(self.baseline / 2 / self.focal))
        step = i / (self.views - 1) if self.spacing == "equal-angle" else (i + 0.5) / self.views
        return np.asarray(self.focal * np.tan((2 * step - 1) * half), dtype=np.float64)

    def offset_at(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Camera offset at camera coordinates u: piecewise linear through the cameras, continued beyond the ends."""
        places = plain_numbers("u", u)
        if not np.isfinite(places).all():
            raise InputError("u: expected finite numbers, found infinite ones or NaN")
        return offset_at(self.camera_offsets, places)

    @cached_property
    def eye_from_world(self) -> NDArray[np.float64]:
        """Centre camera's transform, (4, 4): x right, y up, z = depth."""
        transform = eye_from_world(self.position, self.target, self.up)
        transform.flags.writeable = False
        return transform

    def with_views(self, views: int) -> Rig:
        """The same rig with `views` cameras over its baseline; explicit offsets must already be that many."""
        if self.offsets is not None:
            if len(self.offsets) != views:
                given = counted(len(self.offsets), "offset")
                raise InputError(f"rig offsets: the display has {counted(views, 'view')}, the rig gives {given}")
            return self
        return replace(self, views=views)

    @classmethod
    def frame(cls, scene: Any, display: Display, side: str = "front") -> Rig:
        """Choose a rig that shows the whole of `scene` in every view of `display`, comfortably.

        The whole bounding box is in view in every view, and the disparity between adjacent views stays within
        the display's comfort limit (displays.md 3.4). Cameras stand at `side`: front, back, left, right, top or bottom;
        of a patient if a volume is `anatomical`.
        """
        from .framing import frame_rig

        return frame_rig(scene, display, side)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the fields as JSON."""
        text = json.dumps({k: v for k, v in asdict(self).items() if v is not None}, indent=2)
        return write_atomic(path, lambda file: file.write(text.encode() + b"\n"))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Rig:
        """Read a JSON file of rig fields; unknown fields are errors."""
        path = as_path(path)
        try:
            fields: Any = json.loads(path.read_text(encoding="utf-8-sig"))
        except OSError as error:
            raise FileError(f"{path}: cannot be read ({error.strerror})") from error
        except (ValueError, RecursionError) as error:
            raise FileError(f"{path}: expected a rig as JSON ({error})") from error
        if not isinstance(fields, dict):
            raise FileError(f"{path}: expected a JSON object of rig fields, got {type(fields).__name__}")
        unknown = set(fields) - set(cls.__dataclass_fields__)
        if unknown:
            raise FileError(f"{path}: unknown rig fields {', '.join(sorted(unknown))}")
        try:
            checked: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
            return cls(**checked)
        except InputError as error:
            raise FileError(f"{path}: {error}") from error
