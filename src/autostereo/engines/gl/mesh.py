"""Meshes on the gl engine: into the tiles of views.

`n-pass` draws a view at a time and `instanced` all views of an atlas in one call, through the same shaders, so that
they cannot differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.mesh import Mesh
from ..reference.shading import lights_in_eye_space
from .atlas import enable_clipping
from .context import Device
from .job import Job, Stage
from .mesh_buffers import Part, upload_meshes
from .programs import Defines

IMAGE_UNIT = 0


class Meshes(Stage):
    """The meshes of a scene; a stage (engine.py)."""

    def __init__(self, device: Device, meshes: Sequence[Mesh], middle: NDArray[np.float64]) -> None:
        self._parts = upload_meshes(device, meshes, middle)

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of these tiles, each part in one call."""
        ctx = job.device.ctx
        job.atlas.target.use()
        enable_clipping(ctx, True)
        ctx.front_face = "cw"  # row 0 is the top
        for part in self._parts:
            set_sides(ctx, part)
            program = job.program("mesh.vert", "mesh.frag", defines=switches(job, part))
            set_material(program, job, part)
            program["first_view"] = tiles.start
            content = [(part.vertices, *_attributes(part))]
            job.vertex_array(program, content, part.indices).render(instances=len(tiles))
        enable_clipping(ctx, False)

    def draw_channels(self, job: Job) -> None:
        """Draw a covering quad per triangle and channel."""
        ctx = job.device.ctx
        assert job.columns is not None
        job.atlas.target.use()
        ctx.enable_only(ctx.DEPTH_TEST)
        for part in self._parts:
            program = job.masked_program("quad.vert", "quad.frag", defines=switches(job, part), version=430)
            set_material(program, job, part)
            part.vertices.bind_to_storage_buffer(0)
            part.indices.bind_to_storage_buffer(1)
            program["reach"] = job.draw.culling
            quads = job.vertex_array(program, [], job.kept.get("quads", self._most, lambda: self._quads(job.device)))
            for tile in range(job.count):
                channel = job.first + tile
                program["tile"], program["channel"] = tile, channel
                program["sample_at"] = job.columns[channel], job.row
                quads.render(vertices=6 * part.triangles)

    @property
    def _most(self) -> int:
        return max(part.triangles for part in self._parts)

    def _quads(self, device: Device) -> Any:
        """Indices of two triangles for each four vertices."""
        first = 4 * np.arange(self._most, dtype=np.uint32)[:, None]
        return device.ctx.buffer((first + np.array([0, 1, 2, 2, 1, 3], np.uint32)).tobytes())


def _attributes(part: Part) -> tuple[str, ...]:
    formats, names = part.layout
    return (formats, *names)


def set_sides(ctx: Any, part: Part) -> None:
    """Test depth, and cull back sides unless they are seen."""
    ctx.enable_only(ctx.DEPTH_TEST if part.two_sided else ctx.DEPTH_TEST | ctx.CULL_FACE)


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
    _set(program, "material", (material.ambient, material.diffuse, material.specular, material.shininess))
    lights = lights_in_eye_space(job.scene.lights, job.draw.camera)
    _set(program, "light_place", [place for place, _ in lights])
    _set(program, "light_color", [color for _, color in lights])
    if part.texture is not None:
        part.texture.use(IMAGE_UNIT)
        if "image" in program:
            program["image"] = IMAGE_UNIT


def _set(program: Any, name: str, values: Any) -> None:
    if name in program:  # drivers drop what a shader does not use
        program[name].write(np.array(values, dtype=np.float32).tobytes())
