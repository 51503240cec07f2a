"""Meshes on the gl engine: into the tiles of views.

`n-pass` draws a view at a time and `instanced` all views of an atlas in one call, through the same shaders, so that
they cannot differ. `geometry-shader` (de Sorbier 2008) makes copies of each triangle after its vertices were processed
once; `covering-quad` (Hübner 2007b) meets triangles from each sub-pixel's own camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...scene.mesh import Mesh
from ...transforms import apply
from ..reference.shading import lights_in_eye_space
from . import mesh_painter as painter
from .atlas import enable_clipping
from .context import COMPUTE_VERSION, Device
from .job import Job, Stage, put_lights
from .mesh_buffers import Part, upload_meshes
from .programs import Defines, put, put_textures

IMAGE_UNIT = 0
FEW = 500  # triangles that stand for all where costs are estimated
# seconds of a CPU, measured on llvmpipe: a triangle in one view; one with its covering quads, and a fragment of those
VIEW_TRIANGLE, QUAD_TRIANGLE, QUAD_FRAGMENT = 0.28e-6, 11e-6, 28e-9
ONE_MINUS_SRC1_COLOR = 0x88FA  # GL_ONE_MINUS_SRC1_COLOR: a channel is replaced where the second output is 1
GEOMETRY_NUMBERS = 1024  # that one geometry shader may put out: OpenGL promises no more
POSITION_NUMBERS = 9  # position, four clip distances, camera offset
QUAD_NUMBERS = 24  # what quad.vert hands on but for its three surfaces, and the position


class Meshes(Stage):
    """The meshes of a scene; a stage (engine.py)."""

    def __init__(self, device: Device, meshes: Sequence[Mesh], middle: NDArray[np.float64]) -> None:
        self._parts = upload_meshes(device, meshes, middle)
        self.triangles, self._few = some_triangles(meshes)

    def costs(self, job: Job) -> tuple[float, float]:
        """From the sizes of some triangles' covering quads; without compute shaders there are none."""
        width, height, slide = self.sizes(job)
        camera = job.draw.camera
        area = float(np.mean(np.minimum(width + 1 + slide, camera.width) * np.minimum(height + 1, camera.height)))
        views = VIEW_TRIANGLE * len(job.draw.offsets) * self.triangles
        if job.device.version < COMPUTE_VERSION:
            return views, float("inf")
        return views, self.triangles * (QUAD_TRIANGLE + 3 * QUAD_FRAGMENT * area)

    def sizes(self, job: Job) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Width and height in pixels of some triangles' boxes, and how far they slide over all views."""
        camera, (left, right) = job.draw.camera, job.draw.culling
        points = apply(camera.eye_from_world, self._few.reshape(-1, 3)).reshape(-1, 3, 3)
        depth = np.maximum(points[..., 2], camera.near)
        slide = camera.fx * (right - left) * np.abs(1 / camera.focal - 1 / depth).max(axis=1)
        sides = np.ptp(points[..., :2] / depth[..., None], axis=1) * (camera.fx, camera.fy)
        return sides[:, 0], sides[:, 1], slide

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of these tiles, each part in one call."""
        if job.draw.method == "geometry-shader-painter":
            self._paint(job, tiles)
            return
        ctx = job.device.ctx
        duplicate = job.draw.method == "geometry-shader"
        job.atlas.target.use()
        enable_clipping(ctx, True)
        ctx.front_face = "cw"  # row 0 is the top
        for part in self._parts:
            set_sides(ctx, part)
            if duplicate:
                self._duplicate(job, part, tiles)
                continue
            program = job.program("mesh.vert", "mesh.frag", defines=switches(job, part))
            set_material(program, job, part)
            program["first_view"] = tiles.start
            self._vertex_array(job, program, part).render(instances=len(tiles))
        enable_clipping(ctx, False)

    def _duplicate(self, job: Job, part: Part, tiles: range) -> None:
        """Every triangle becomes as many as there are views (de Sorbier 2008), in the geometry shader."""
        defines = switches(job, part)
        copies = copies_at_once(job, defines, len(tiles))
        files = "mesh_points.vert", "mesh.geom", "mesh.frag"
        program = job.program(*files, defines={**defines, "MAX_VERTICES": 3 * copies})
        set_material(program, job, part)
        for first in range(tiles.start, tiles.stop, copies):
            program["first_view"], program["copies"] = first, min(copies, tiles.stop - first)
            self._vertex_array(job, program, part).render()

    def _vertex_array(self, job: Job, program: Any, part: Part) -> Any:
        formats, names = part.layout
        return job.vertex_array(program, [(part.vertices, formats, *names)], part.indices)

    def _paint(self, job: Job, tiles: range) -> None:
        """A render target per view, from back to front, as the paper has it: mesh_painter.py."""
        ctx = job.device.ctx
        targets = painter.begin(job, tiles)
        ctx.front_face = "cw"
        ctx.blend_func = ctx.ONE, ctx.ONE_MINUS_SRC_ALPHA
        for part in painter.sorted_parts(job, self._parts):
            ctx.enable_only(ctx.BLEND if part.two_sided else ctx.BLEND | ctx.CULL_FACE)
            copies = {"PAINTER": True, "TARGETS": len(tiles), "MAX_VERTICES": 3 * len(tiles)}
            files = "mesh_points.vert", "mesh.geom", "mesh_targets.frag"
            program = job.program(*files, defines={**switches(job, part), **copies})
            set_material(program, job, part)
            program["first_view"], program["copies"] = 0, len(tiles)
            self._vertex_array(job, program, part).render()
        painter.finish(job, tiles, targets)

    def draw_channels(self, job: Job) -> None:
        """Draw a covering quad per triangle and channel."""
        method = f"method {job.draw.method!r} of meshes for this display"
        job.device.require(COMPUTE_VERSION, method, "method 'n-pass' or engine='cpu'")
        ctx = job.device.ctx
        assert job.columns is not None
        job.atlas.target.use()
        ctx.enable_only(ctx.DEPTH_TEST | ctx.BLEND if job.one_depth else ctx.DEPTH_TEST)
        ctx.blend_func = ctx.ONE, ONE_MINUS_SRC1_COLOR
        depth = {"ONE_DEPTH": job.one_depth, "MEAN_DEPTH": job.draw.options.alpha == "averaged"}
        for part in self._parts:
            defines = {**switches(job, part), **depth}
            check_outputs(job, defines)
            program = job.masked_program("quad.vert", "quad.frag", defines=defines, version=COMPUTE_VERSION)
            set_material(program, job, part)
            job.device.bind_storage(part.vertices, 0)
            job.device.bind_storage(part.indices, 1)
            program["reach"] = job.draw.culling
            quads = job.vertex_array(program, [], job.kept.get("quads", self._most, lambda: self._quads(job.device)))
            for tile in range(job.count):
                channel = job.first + tile
                put(program, tile=tile, channel=channel, sample_at=[(column, job.row) for column in job.columns])
                quads.render(vertices=6 * part.triangles)

    @property
    def _most(self) -> int:
        return max(part.triangles for part in self._parts)

    def _quads(self, device: Device) -> Any:
        """Indices of two triangles for each four vertices."""
        first = 4 * np.arange(self._most, dtype=np.uint32)[:, None]
        return device.ctx.buffer((first + np.array([0, 1, 2, 2, 1, 3], np.uint32)).tobytes())


def some_triangles(meshes: Sequence[Mesh]) -> tuple[int, NDArray[np.float64]]:
    """The number of triangles, and corners (n, 3, 3) in world space of a few of them, evenly picked."""
    count = sum(len(mesh.faces) for mesh in meshes)
    few = []
    for mesh in meshes:
        assert mesh.transform is not None
        faces = mesh.faces[:: max(1, count // FEW)]
        few.append(apply(mesh.transform, mesh.vertices[faces.ravel()]).reshape(-1, 3, 3))
    return count, np.concatenate(few)


def set_sides(ctx: Any, part: Part) -> None:
    """Test depth, and cull back sides unless they are seen."""
    ctx.enable_only(ctx.DEPTH_TEST if part.two_sided else ctx.DEPTH_TEST | ctx.CULL_FACE)


def copies_at_once(job: Job, defines: Defines, views: int) -> int:
    """How many copies of a triangle a geometry shader makes, `views` at most."""
    numbers = POSITION_NUMBERS + numbers_of_surface(defines)
    return min(views, min(GEOMETRY_NUMBERS // numbers, job.device.limits.geometry_vertices) // 3)


def numbers_of_surface(defines: Defines) -> int:
    """How many numbers a vertex hands on of its Surface (lib/surface.glsl), at most."""
    return (10 if defines["VERTEX_LIGHTING"] else 6) + 3 * bool(defines["PLACED"]) + 2 * bool(defines["TEXTURED"])


def check_outputs(job: Job, defines: Defines) -> None:
    """Raise UnsupportedError when covering quads have more to hand on to samples than the device can."""
    numbers, most = QUAD_NUMBERS + 3 * numbers_of_surface(defines), job.device.limits.vertex_outputs
    if numbers > most:
        raise UnsupportedError(
            f"method {job.draw.method!r}: vertices of such a mesh hand on {numbers} numbers, {most} at most on this "
            f"device ({job.device.renderer}): choose lighting='sample', another method or engine='cpu'"
        )


def switches(job: Job, part: Part) -> Defines:
    """The switches of lib/surface.glsl and lib/shading.glsl for a part."""
    options, lights = job.draw.options, lights_in_eye_space(job.scene.lights, job.draw.camera)
    lit = bool(lights)
    shiny = lit and part.material.specular > 0
    return {
        "LIGHTS": len(lights),
        "VERTEX_LIGHTING": options.lighting == "vertex",
        "CENTER_EYE": options.shading == "center",
        "TEXTURED": part.texture is not None,
        "TWO_SIDED": part.two_sided,
        "SHINY": shiny,
        "PLACED": shiny or any(place[3] != 0 for place, _ in lights),
    }


def set_material(program: Any, job: Job, part: Part) -> None:
    """Give a part's material and texture, and the scene's lights, to a program that shades."""
    material = part.material
    put(program, material=(material.ambient, material.diffuse, material.specular, material.shininess))
    put_lights(program, job)
    if part.texture is not None:
        put_textures(program, image=(part.texture, IMAGE_UNIT))
