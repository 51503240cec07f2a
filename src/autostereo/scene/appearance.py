"""How surfaces answer light: materials and lights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import FARTHEST, Vector, check_direction, check_number, check_vector, real_array, shown
from ..errors import InputError

ROUNDING = 1e-6  # of colours that were calculated in float32


@dataclass(frozen=True)
class Material:
    """Blinn–Phong reflection: C = kd·(ambient + diffuse·Σ L·max(N·L, 0)) + specular·Σ L·max(N·H, 0)^shininess.

    A light behind the surface, N·L ≤ 0, makes no highlight.

    Parameters
    ----------
    ambient, diffuse, specular : float
        Weights ≥ 0; kd is vertex colour × texture.
    shininess : float
        Exponent of the highlight, 0 … 10000.
    two_sided : bool, optional
        Draw back sides (lit with −N). None: only where the mesh is not watertight and consistently wound.
    """

    ambient: float = 0.2
    diffuse: float = 0.8
    specular: float = 0.0
    shininess: float = 32.0
    two_sided: bool | None = None

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular"):
            object.__setattr__(self, name, check_number(f"material {name}", getattr(self, name), 0.0, 1e6))
        object.__setattr__(self, "shininess", check_number("material shininess", self.shininess, 0.0, 1e4))
        if self.two_sided is not None and not isinstance(self.two_sided, (bool, np.bool_)):
            raise InputError(f"material two_sided: expected True, False or None, got {shown(self.two_sided)}")


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light; `direction` (world, any length) is the way it travels, `color` its RGB strength."""

    direction: Vector
    color: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", check_direction("light direction", self.direction))
        object.__setattr__(self, "color", check_vector("light color", self.color, 1e6))


@dataclass(frozen=True)
class PointLight:
    """Light from `position` (world) in all directions, without attenuation; `color` is its RGB strength."""

    position: Vector
    color: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", check_vector("light position", self.position, FARTHEST))
        object.__setattr__(self, "color", check_vector("light color", self.color, 1e6))


Light = DirectionalLight | PointLight


def check_color_values(name: str, array: NDArray) -> None:
    """Raise InputError unless integers of any type lie within 0…255, and floats, but for a rounding, within 0…1."""
    if array.size == 0 or array.dtype == np.uint8:
        return
    low, high = array.min(), array.max()
    if array.dtype.kind in "iu":
        if low < 0 or high > 255:
            found = low if low < 0 else high
            raise InputError(f"{name}: expected integers 0…255 (or floats 0…1), found {found} ({array.dtype})")
    elif not (np.isfinite(low) and np.isfinite(high)):
        raise InputError(f"{name}: expected finite numbers, found NaN or infinity")
    elif low < -ROUNDING or high > 1 + ROUNDING:
        found = low if low < -ROUNDING else high
        raise InputError(f"{name}: expected floats 0…1 (or integers 0…255), found {found:.7g}")


def check_image(name: str, image: object) -> NDArray[np.uint8]:
    """Return an image as (H, W, 3) uint8, of values as `check_color_values` has them. Grey is spread, alpha dropped."""
    try:
        # PIL has palettes, grey with alpha and more, which as arrays would not be colours; 16 bits it would cut
        palettes = hasattr(image, "convert") and str(getattr(image, "mode", ""))[:1] not in "IF"
        image = image.convert("RGB") if palettes else image  # type: ignore[attr-defined]
    except Exception as error:  # lazy PIL images decode here
        raise InputError(f"{name}: cannot be decoded ({error})") from error
    a = real_array(name, image, "an image")
    if a.ndim == 2:
        a = a[..., None]
    if a.ndim != 3 or a.shape[2] not in (1, 3, 4) or 0 in a.shape:
        raise InputError(f"{name}: expected an image (H, W), (H, W, 3) or (H, W, 4), got {a.shape}")
    check_color_values(name, a[..., :3])
    if a.dtype.kind not in "iu":
        a = np.floor(np.clip(a[..., :3], 0.0, 1.0) * 255.0 + 0.5)
    if a.shape[2] == 1:
        a = np.repeat(a, 3, axis=2)
    # an array that fits is kept as it is, so that objects can share one texture
    return np.ascontiguousarray(a if a.shape[2] == 3 else a[..., :3], dtype=np.uint8)
