"""Point clouds as surfels: small discs that together cover a surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..checks import FARTHEST, real_array
from ..errors import InputError
from ..transforms import apply, apply_normals, as_transform, check_world
from .appearance import Material
from .mesh import _colors, _floats
from .neighbors import estimate_normals, estimate_radii

GREY = 0.8


@dataclass(frozen=True, eq=False)
class Points:
    """Surfels (Pfister et al. 2000): the disc |X − P| ≤ r in the plane through P with normal n.

    A surfel without a normal lies in the plane of constant eye depth, whatever the view.

    Parameters
    ----------
    positions : array_like of shape (N, 3)
        Centres P in object space, finite.
    normals : array_like of shape (N, 3), optional
        Any length; scaled to unit length. Those of zero length are estimated from neighbours. The sign does not
        matter: surfels are lit from the side that is seen. None: none, see `with_normals`.
    radii : array_like of shape (N,) or float, optional
        In object space, > 0. None: estimated from neighbours, such that evenly sampled surfaces have no holes.
    colors : array_like of shape (N, 3 or 4), optional
        Display (sRGB) values: floats 0…1, or integers of any type 0…255; alpha is ignored. Default light grey (0.8).
    transform : array_like of shape (4, 4), optional
        world_from_object.
    material : Material, optional

    Raises
    ------
    InputError
        A field does not have the shape, type or range above, or radii cannot be estimated because all points are at
        one position; the message names the field.
    """

    positions: NDArray  # float64 once constructed; so are normals, radii and transform
    normals: NDArray | None = None  # unit length
    radii: NDArray = None  # type: ignore[assignment]  # None becomes an estimate; (N,)
    colors: NDArray = None  # type: ignore[assignment]  # None becomes grey; (N, 3) float32, 0…1
    transform: NDArray = None  # type: ignore[assignment]  # None becomes the identity
    material: Material = None  # type: ignore[assignment]  # None becomes Material()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "positions", _floats("positions", self.positions, (3,)))
        count = len(self.positions)
        if count == 0:
            raise InputError("positions: expected at least one point, got none")
        put(self, "radii", estimate_radii(self.positions) if self.radii is None else _radii(self.radii, count))
        if self.normals is not None:
            put(self, "normals", _unit_normals(_floats("normals", self.normals, (3,), count), self.positions))
        if self.colors is None:
            put(self, "colors", np.full((count, 3), GREY, np.float32))
        else:
            put(self, "colors", _colors(self.colors, count))
        if self.material is None:
            put(self, "material", Material())
        elif not isinstance(self.material, Material):
            raise InputError(f"material: expected a Material, got {type(self.material).__name__}")
        put(self, "transform", as_transform(self.transform))
        check_world("positions", self.transform, self.positions)
        widest = self.radii.max() * np.linalg.norm(self.transform[:3, :3], 2)
        if widest > FARTHEST:
            raise InputError(f"radii: expected radii up to {FARTHEST:g} in the world, found up to {widest:g}")

    def __len__(self) -> int:
        return len(self.positions)

    def with_normals(self) -> Points:
        """Return these points with normals: those they have, else estimated from neighbours."""
        return self if self.normals is not None else replace(self, normals=estimate_normals(self.positions))

    @property
    def world_positions(self) -> NDArray[np.float64]:
        """Centres in world space (N, 3)."""
        return apply(self.transform, self.positions)

    @property
    def world_normals(self) -> NDArray[np.float64] | None:
        """Unit normals in world space (N, 3), or None."""
        return None if self.normals is None else apply_normals(self.transform, self.normals)

    @property
    def world_radii(self) -> NDArray[np.float64]:
        """Radii in world space (N,).

        A transform that stretches makes an ellipse of a disc; the disc that stands for it has the same area. Without
        normals, radii are scaled by the cube root of the change of volume.
        """
        linear = self.transform[:3, :3]
        if self.normals is None:
            return self.radii * abs(np.linalg.det(linear)) ** (1 / 3)
        cofactor = np.stack([np.cross(linear[a - 2], linear[a - 1]) for a in range(3)])
        return self.radii * np.sqrt(np.linalg.norm(self.normals @ cofactor.T, axis=1))

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """Axis-aligned bounds of the discs in world space, (2, 3): minimum and maximum; of balls without normals."""
        centre, extent, normals = self.world_positions, self.world_radii[:, None], self.world_normals
        if normals is not None:
            extent = extent * np.sqrt(np.clip(1.0 - normals**2, 0.0, 1.0))
        return np.stack([(centre - extent).min(axis=0), (centre + extent).max(axis=0)])


def _radii(value: object, count: int) -> NDArray[np.float64]:
    """Return radii (count,) > 0; one number serves all."""
    radii = np.array(real_array("radii", value, "numbers"), dtype=np.float64)
    if radii.shape not in ((), (1,), (count,), (count, 1)):
        raise InputError(f"radii: expected one number or shape ({count},), got {radii.shape}")
    bad = ~(np.isfinite(radii) & (radii > 0))
    if bad.any():
        raise InputError(f"radii: expected finite numbers > 0, found {bad.sum()} of {bad.size} that are not")
    return np.array(np.broadcast_to(radii.reshape(-1), (count,)))


def _unit_normals(normals: NDArray[np.float64], positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale normals (N, 3) to unit length; estimate those of zero length."""
    normals = normals / (np.abs(normals).max(axis=1, keepdims=True) + np.finfo(np.float64).tiny)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    missing = length[:, 0] == 0
    normals = normals / np.where(length > 0, length, 1.0)
    if missing.any():
        normals[missing] = estimate_normals(positions)[missing]
    return normals
