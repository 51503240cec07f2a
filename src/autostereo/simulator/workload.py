"""What the simulated machine is given: draws of triangles with attributes, textures and a shader."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import check_choice
from ..errors import InputError, UnsupportedError
from ..scene.appearance import DirectionalLight, Light
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from ..transforms import apply, apply_normals
from .kernels import shaders
from .textures import Texture

Array = NDArray[np.float64]
SHADERS = {
    "surface": (shaders.SURFACE, 2), "level": (shaders.LEVEL, 4), "shadows": (shaders.SHADOWS, 2),
    "ocean": (shaders.OCEAN, 2), "plain": (shaders.PLAIN, 0), "relief": (shaders.RELIEF, 4),
}  # fmt: skip  # name: number, attributes whose changes per pixel it needs
BLENDS = ("replace", "alpha", "add", "multiply")
# attributes that are positions or directions in eye space, by their first column
POSITIONS = {"surface": (8,), "shadows": (8,), "ocean": (2,), "relief": (7,)}
DIRECTIONS = {"surface": (5,), "shadows": (2, 5), "relief": (4,)}


@dataclass(frozen=True, eq=False)
class Draw:
    """Triangles that are drawn alike.

    Parameters
    ----------
    corners : ndarray of shape (F, 3, 3)
        World space.
    attributes : ndarray of shape (F, 3, A)
        Per corner, what the shader gets; positions and normals in world space where a built-in shader knows of them.
    shader : str or callable
        A name of `SHADERS`, or a function as `kernels/shaders.py` describes, for Numba to compile.
    textures : tuple of int
        Numbers of the workload's textures: the shader's units.
    uniforms : tuple of float
    blend : {"replace", "alpha", "add", "multiply"}
    facing : int
        The side that is drawn: 1 counter-clockwise, −1 clockwise, 0 both.
    mirrored : bool
        The front is clockwise.
    depth_write : bool
    depth_output : bool
        The shader gives the depth ("relief", or one of your own). The depth test then follows shading, so everything
        covered is shaded, and Z-max and Z-min culling are off.
    approximate : bool
        False: shaded exactly on machines that approximate, as suits what depends on the view (section 4.3).
    derivatives : int, optional
        Own shaders: so many attributes, from the first, get changes per pixel; None: all.
    """

    corners: Array
    attributes: Array
    shader: str | Callable[..., Any] = "plain"
    textures: tuple[int, ...] = ()
    uniforms: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    blend: str = "replace"
    facing: int = 0
    mirrored: bool = False
    depth_write: bool = True
    depth_output: bool = False
    approximate: bool = True
    derivatives: int | None = None

    def __post_init__(self) -> None:
        corners = np.ascontiguousarray(self.corners, np.float64)
        attributes = np.ascontiguousarray(self.attributes, np.float64)
        if corners.ndim != 3 or corners.shape[1:] != (3, 3):
            raise InputError(f"draw corners: expected (F, 3, 3), got {corners.shape}")
        if attributes.ndim != 3 or attributes.shape[:2] != corners.shape[:2]:
            raise InputError(f"draw attributes: expected ({len(corners)}, 3, A), got {attributes.shape}")
        if isinstance(self.shader, str) and self.shader not in SHADERS:
            raise InputError(f"draw shader: expected one of {', '.join(SHADERS)} or a function, got {self.shader!r}")
        check_choice("draw blend", self.blend, BLENDS)
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "attributes", attributes)


@dataclass(frozen=True, eq=False)
class Workload:
    """A frame's draws, in order.

    Parameters
    ----------
    draws : tuple of Draw
    textures : tuple of Texture
    background : (3,) float
        RGB, 0…1.
    lights : tuple of lights, optional
        For "surface"; None: one along the centre camera's line of sight.
    name : str
    """

    draws: tuple[Draw, ...]
    textures: tuple[Texture, ...] = ()
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lights: tuple[Light, ...] | None = field(default=None)
    name: str = "scene"

    def __post_init__(self) -> None:
        for draw in self.draws:
            if any(not 0 <= number < len(self.textures) for number in draw.textures):
                raise InputError(f"draw textures: expected numbers below {len(self.textures)}, got {draw.textures}")

    @staticmethod
    def of(scene: Scene, name: str = "scene") -> Workload:
        """The meshes of a scene, each a draw with the shader "surface".

        Raises
        ------
        UnsupportedError
            The scene holds something other than meshes.
        """
        textures: list[Texture] = []
        number_of: dict[int, int] = {}
        draws = []
        for item in scene.objects:
            if not isinstance(item, Mesh):
                raise UnsupportedError(f"the simulator rasterises Mesh, the scene holds a {type(item).__name__}")
            units: tuple[int, ...] = ()
            if item.texture is not None:
                key = id(item.texture)  # meshes may share one image
                if key not in number_of:
                    number_of[key] = len(textures)
                    textures.append(Texture(item.texture))
                units = (number_of[key],)
            draws.append(_draw_of(item, units))
        return Workload(tuple(draws), tuple(textures), scene.background, scene.lights, name)


def _draw_of(mesh: Mesh, units: tuple[int, ...]) -> Draw:
    faces, material = mesh.faces, mesh.material
    corners = apply(mesh.transform, mesh.vertices)[faces]
    uv = np.zeros((len(faces), 3, 2))
    if mesh.uv is not None:
        uv = mesh.uv[faces]
        uv = uv - np.floor(uv.min(axis=1, keepdims=True))  # coordinates of real levels reach thousands
    colors = np.ones((len(mesh.vertices), 3)) if mesh.colors is None else mesh.colors.astype(np.float64)
    normals = apply_normals(mesh.transform, mesh.shading_normals)
    attributes = np.concatenate([uv, colors[faces], normals[faces], corners], axis=2)
    mirrored = bool(np.linalg.det(mesh.transform[:3, :3]) < 0)
    return Draw(
        corners,
        attributes,
        "surface",
        units,
        (material.ambient, material.diffuse, material.specular, material.shininess),
        facing=0 if mesh.two_sided else -1 if mirrored else 1,
        mirrored=mirrored,
    )


def lights_in_eye_space(lights: tuple[Light, ...] | None, eye_from_world: Array) -> Array:
    """Uniforms (7·n,) of lights: homogeneous position (w = 0: the direction towards the light), colour."""
    if lights is None:
        return np.array([0.0, 0.0, -1.0, 0.0, 1.0, 1.0, 1.0])
    rows: list[NDArray[np.float64]] = []
    for light in lights:
        if isinstance(light, DirectionalLight):
            towards = -eye_from_world[:3, :3] @ light.direction
            length = float(np.linalg.norm(towards))
            rows.append(np.concatenate([towards / (length or 1.0), [0.0], light.color]))
        else:
            rows.append(np.concatenate([apply(eye_from_world, np.array(light.position)), [1.0], light.color]))
    return np.concatenate([np.zeros(0), *rows])


def attributes_in_eye_space(draw: Draw, eye_from_world: Array) -> Array:
    """The draw's attributes with its positions and directions in eye space."""
    if not isinstance(draw.shader, str):
        return draw.attributes
    result = draw.attributes.copy()
    for i in POSITIONS.get(draw.shader, ()):
        result[..., i : i + 3] = apply(eye_from_world, draw.attributes[..., i : i + 3])
    for i in DIRECTIONS.get(draw.shader, ()):
        result[..., i : i + 3] = draw.attributes[..., i : i + 3] @ eye_from_world[:3, :3].T
    return result
