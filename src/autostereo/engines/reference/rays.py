"""Rays through samples, in eye space. Along each of them eye depth d is the parameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..engine import Camera
from ..options import Options
from .mesh import Samples

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rays:
    """M rays: the point at depth d is origin + d·direction, d-component of the direction 1 (see mesh.py).

    Attributes
    ----------
    origin, direction : ndarray of shape (M, 3), float64
    viewer : ndarray of shape (M, 3), float64
        The eyes that things are lit for.
    """

    origin: Array
    direction: Array
    viewer: Array

    @staticmethod
    def through(camera: Camera, samples: Samples, options: Options | None = None) -> Rays:
        """Rays of samples of any shape, flattened to M in C order; they are lit as the options' `shading` says."""
        x, y, v = samples.x.ravel(), samples.y.ravel(), samples.v.ravel()
        a = (x - camera.width / 2) / camera.fx - v / camera.focal
        b = (camera.height / 2 - y) / camera.fy - camera.offset_y / camera.focal
        origin = np.column_stack([v, np.full_like(v, camera.offset_y), np.zeros_like(v)])
        center = options is not None and options.shading == "center"
        return Rays(origin, np.column_stack([a, b, np.ones_like(a)]), origin * (0.0, 1.0, 1.0) if center else origin)

    def __len__(self) -> int:
        return len(self.origin)

    def take(self, index: NDArray[np.integer]) -> Rays:
        """Some of the rays."""
        return Rays(self.origin[index], self.direction[index], self.viewer[index])

    def at(self, depth: Array) -> Array:
        """Points (M, …, 3) at depths (M, …)."""
        shape = (len(self), *(1,) * (depth.ndim - 1), 3)
        return self.origin.reshape(shape) + depth[..., None] * self.direction.reshape(shape)

    @property
    def length_per_depth(self) -> Array:
        """Length of a ray per unit of depth, (M,)."""
        return np.linalg.norm(self.direction, axis=1)
