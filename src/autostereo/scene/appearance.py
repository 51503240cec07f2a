"""How surfaces answer light: materials and lights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import FARTHEST, Vector, check_direction, check_number, check_vector
from ..errors import InputError


@dataclass(frozen=True)
class Material:
    """Blinn–Phong reflection: C = kd·(ambient + diffuse·Σ L·max(N·L, 0)) + specular·Σ L·max(N·H, 0)^shininess.

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
        if self.two_sided not in (None, True, False):
            raise InputError(f"material two_sided: expected True, False or None, got {self.two_sided!r}")


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


def check_image(name: str, image: object) -> NDArray[np.uint8]:
    """Return an image as (H, W, 3) uint8. Grey is spread, alpha dropped, floats in 0…1 scaled."""
    try:
        a = np.asarray(image)
    except Exception as error:  # lazy PIL images decode here
        raise InputError(f"{name}: cannot be decoded ({error})") from error
    if a.ndim == 2:
        a = np.repeat(a[..., None], 3, axis=2)
    if a.ndim == 3 and a.shape[2] in (1, 2):  # grey, grey + alpha
        a = np.repeat(a[..., :1], 3, axis=2)
    if a.ndim != 3 or a.shape[2] not in (3, 4) or 0 in a.shape:
        raise InputError(f"{name}: expected an image (H, W), (H, W, 3) or (H, W, 4), got {a.shape}")
    if np.issubdtype(a.dtype, np.floating):
        if not np.isfinite(a).all():
            raise InputError(f"{name}: expected finite values, found NaN or infinity")
        a = np.floor(np.clip(a, 0.0, 1.0) * 255.0 + 0.5)
    elif a.dtype != np.uint8:
        raise InputError(f"{name}: expected uint8 or float in 0…1, got {a.dtype}")
    # an array that fits is kept as it is, so that objects can share one texture
    return np.ascontiguousarray(a if a.shape[2] == 3 else a[..., :3], dtype=np.uint8)
