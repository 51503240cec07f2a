"""A Scene: what is to be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Vector, check_vector
from ..errors import InputError
from .appearance import DirectionalLight, Light, PointLight
from .mesh import Mesh
from .points import Points
from .volume import Volume

PRIMITIVES = (Mesh, Points, Volume)
SceneObject = Mesh | Points | Volume


@dataclass(frozen=True, eq=False)
class Scene:
    """Objects, lights and a background.

    Parameters
    ----------
    objects : object or sequence of objects
        Any mix of primitives.
    lights : sequence of DirectionalLight and PointLight, optional
        None: one white directional light along the centre camera's line of sight.
    background : (3,) float
        Display RGB, 0…1.
    """

    objects: tuple[SceneObject, ...]
    lights: tuple[Light, ...] | None = None
    background: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        objects = _listed("objects", self.objects, PRIMITIVES, "an object or a sequence of them")
        if not objects:
            raise InputError("objects: expected at least one, got none")
        for item in objects:
            if not isinstance(item, PRIMITIVES):
                names = ", ".join(kind.__name__ for kind in PRIMITIVES)
                raise InputError(f"objects: expected {names}, got {type(item).__name__}")
        object.__setattr__(self, "objects", objects)
        if self.lights is not None:
            lights = _listed("lights", self.lights, (DirectionalLight, PointLight), "lights")
            for light in lights:
                if not isinstance(light, (DirectionalLight, PointLight)):
                    raise InputError(f"lights: expected lights, got {type(light).__name__}")
            object.__setattr__(self, "lights", lights)
        background = check_vector("background", self.background)
        if min(background) < 0 or max(background) > 1:
            raise InputError(f"background: expected values 0…1, got {background}")
        object.__setattr__(self, "background", background)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """World bounds (2, 3) of all objects."""
        every = np.stack([item.bounds for item in self.objects])
        return np.stack([every[:, 0].min(axis=0), every[:, 1].max(axis=0)])

    @staticmethod
    def of(thing: Scene | SceneObject | Sequence[SceneObject]) -> Scene:
        """Return `thing` as a Scene; a single object or a sequence of objects will do."""
        return thing if isinstance(thing, Scene) else Scene(thing)  # type: ignore[arg-type]


def _listed(name: str, given: Any, kinds: tuple[type, ...], expected: str) -> tuple[Any, ...]:
    """One of `kinds`, or what a sequence holds, as a tuple."""
    if isinstance(given, kinds):
        return (given,)
    try:
        return tuple(given)
    except TypeError:  # arrays without axes say that they can be iterated over
        raise InputError(f"{name}: expected {expected}, got {type(given).__name__}") from None
