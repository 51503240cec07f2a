"""What the benchmarks draw: scenes, rigs and displays that every contender is given alike."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ...display.rig import Rig
from ...scene.appearance import Material
from ...scene.mesh import Mesh
from ...scene.scene import Scene
from ...scene.volume import Volume
from ...transforms import apply, apply_normals, as_transform

if TYPE_CHECKING:
    from ...display.display import Display
    from ...scene.transfer import TransferFunction

Size = tuple[int, int]

FILL = 0.65
"""Share of the focal-plane window that the scene's silhouette is given: "filling most of the view"."""

BASELINE_PER_DISTANCE = 0.3


def sphere_scene(subdivision: int, specular: float) -> Scene:
    """Displaced, coloured icosphere of 20·4^subdivision triangles (82k at 6, 1.3 million at 8)."""
    from ...scene.shapes import displaced_sphere

    mesh = displaced_sphere(subdivision)
    return Scene((replace(mesh, material=Material(specular=specular)),))


def bunny_scene(data: Path, specular: float) -> Scene:
    """The Stanford bunny, `data`/meshes/bun_zipper.ply; not watertight, hence drawn two-sided."""
    from ...io import load

    mesh = the_mesh(load(data / "meshes" / "bun_zipper.ply"))
    return Scene((replace(mesh, material=Material(specular=specular)),))


def shells_scene(size: int) -> Scene:
    """Nested semi-transparent shells, shaded, of size³ voxels (uint8)."""
    from ...scene.samples import shells

    return Scene((shells(size),))


def shells_transfer(dtype: DTypeLike) -> TransferFunction:
    """The shells' transfer function for values of this type, whose greatest is their greatest."""
    from ...scene.transfer import TransferFunction

    points = the_volume(shells_scene(16)).transfer.points
    return TransferFunction(points * (np.iinfo(dtype).max / 255, 1, 1, 1, 1))


def step_transfer() -> TransferFunction:
    """Sharp surfaces in the values of the shells: nothing, then a thin body, then an almost opaque one."""
    from ...scene.transfer import TransferFunction

    clear, thin, dense = (0.2, 0.5, 0.9, 0.0), (0.2, 0.5, 0.9, 1.0), (0.95, 0.6, 0.2, 20.0)
    return TransferFunction(np.array([(32, *clear), (32, *thin), (160, *thin), (160, *dense)]))


def surfel_scene(count: int) -> Scene:
    """A cloud of surfels as from a scanner."""
    from ...scene.samples import surfel_cloud

    return Scene((surfel_cloud(max(100, count)),))


def the_mesh(scene: Scene) -> Mesh:
    """The scene's only object."""
    (mesh,) = scene.objects
    assert isinstance(mesh, Mesh)
    return mesh


def the_volume(scene: Scene) -> Volume:
    """The scene's only object."""
    (volume,) = scene.objects
    assert isinstance(volume, Volume)
    return volume


def rig_for(scene: Scene, views: int, size: Size) -> Rig:
    """Rig in front of `scene` whose window the scene fills to `FILL`, at baseline/distance 0.3.

    The silhouette is taken as the ellipse in the bounding box, so every picture shape is filled alike; at 2:1
    the top and bottom of a sphere are cut off.
    """
    low, high = scene.bounds
    width, height = high[0] - low[0], high[1] - low[1]
    aspect = size[0] / size[1]
    half_height = math.sqrt(math.pi / 4 * width * height / (FILL * 4 * aspect))
    distance = 2.0 * math.hypot(width, height) / math.sqrt(2.0)
    x, y, z = (low + high) / 2
    return Rig(
        position=(x, y, z + distance),
        target=(x, y, z),
        fov_y=math.degrees(2 * math.atan(half_height / distance)),
        baseline=BASELINE_PER_DISTANCE * distance,
        views=views,
    )


def clip_from_world(rig: Rig, size: Size) -> NDArray[np.float64]:
    """OpenGL clip transforms of all cameras, (V, 4, 4): DESIGN section 1 with an infinite far plane.

    x_clip = fx·(2/W)·(X − vd + vd·d/fd), y_clip = fy·(2/H)·(Y − o_y + o_y·d/fd), z_clip = d − 2·near, w_clip = d.
    """
    return clip_from_centre(rig, size) @ rig.eye_from_world


def clip_from_centre(rig: Rig, size: Size) -> NDArray[np.float64]:
    """OpenGL clip transforms (V, 4, 4) from the centre camera's frame (x right, y up, z = depth)."""
    aspect = size[0] / size[1] if rig.aspect is None else rig.aspect
    scale_y = 1.0 / math.tan(math.radians(rig.fov_y) / 2)
    scale_x = scale_y / aspect
    offsets = rig.camera_offsets
    clip = np.zeros((len(offsets), 4, 4))
    clip[:, 0, 0] = scale_x
    clip[:, 0, 2] = scale_x * offsets / rig.focal
    clip[:, 0, 3] = -scale_x * offsets
    clip[:, 1, 1] = scale_y
    clip[:, 1, 2] = scale_y * rig.offset_y / rig.focal
    clip[:, 1, 3] = -scale_y * rig.offset_y
    clip[:, 2, 2] = clip[:, 3, 2] = 1.0
    clip[:, 2, 3] = -2.0 * rig.near_depth
    return clip


def eyes(rig: Rig) -> NDArray[np.float64]:
    """Positions of all cameras in world space, (V, 3)."""
    right, up = rig.eye_from_world[0, :3], rig.eye_from_world[1, :3]
    return np.asarray(rig.position) + rig.camera_offsets[:, None] * right + rig.offset_y * up


def world_arrays(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Positions, unit normals and colours of the scene's one mesh in world space, each (N, 3)."""
    mesh = the_mesh(scene)
    world_from_object = as_transform(mesh.transform)
    positions = apply(world_from_object, mesh.vertices)
    normals = apply_normals(world_from_object, mesh.shading_normals)
    colors = np.ones(positions.shape) if mesh.colors is None else mesh.colors.astype(np.float64)
    return positions, normals, colors


def portrait_display(size: Size) -> Display:
    """Continuous display with the lens of a Looking Glass Portrait template (pitch 52, slope −7, 324 DPI), 48 views."""
    return _looking_glass(size, views=48, pitch=52.0, slope=-7.0, dpi=324.0, continuous=True)


def panel_8k_display(size: Size) -> Display:
    """Display with the lens of an 8K template (pitch 42, slope −6, 280 DPI), 96 views."""
    return _looking_glass(size, views=96, pitch=42.0, slope=-6.0, dpi=280.0, continuous=False)


def _looking_glass(size: Size, *, views: int, pitch: float, slope: float, dpi: float, continuous: bool) -> Display:
    from ...display.display import Display

    return Display.slanted(
        *size,
        views,
        lens_pitch=25.4 / pitch,  # both in mm
        subpixel_pitch=25.4 / dpi / 3,
        slant_deg=math.degrees(math.atan(1.0 / slope)),
        continuous=continuous,
    )
