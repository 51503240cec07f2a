"""Points by covering quads: a quad around what all cameras see of a surfel (Hübner 2007b, sections 3.2 and 3.3.2).

They are blended twice, per channel of a panel, as both blendings have a value for each: "min", and "add". The paper's
own 1+1 pass draws once, in K groups that each keep their nearest surfel, and blends the K in the last pass; of surfels
in one group that overlap it loses all but one. Its reason, that float textures could not be blended into, is gone.
With `alpha="averaged"` or `"minimal"` it is drawn for comparison (points_groups.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .context import ADD, COMPUTE_VERSION, Device
from .job import Job
from .points_buffers import CONSTANTS, RECORDS, SurfelBuffers, give_draw
from .points_groups import number_of_groups, sum_groups
from .programs import Defines, put_textures

if TYPE_CHECKING:
    from .points import Part, Sheet

NEAREST, SUMS, WEIGHTS = 2, 3, 4  # texture units, after those of points.py
MIN = 0x8007  # GL_MIN


class Blended:
    """Textures that quads are blended into: three values of each kind per pixel."""

    def __init__(self, device: Device, sheet: Sheet) -> None:
        ctx = device.ctx
        self.nearest, self.sums, self.weights = (ctx.texture(sheet.size, 4, dtype="f4") for _ in range(3))
        for texture in (self.nearest, self.sums, self.weights):
            texture.filter = (ctx.NEAREST, ctx.NEAREST)
        self.nearest_target = ctx.framebuffer([self.nearest], sheet.depth)
        self.sums_target = ctx.framebuffer([self.sums, self.weights], sheet.depth)
        self.all_target = ctx.framebuffer([self.nearest, self.sums, self.weights])

    def give(self, program: Any) -> None:
        """Bind the textures that a program reads."""
        held = {"nearest": (self.nearest, NEAREST), "sums": (self.sums, SUMS), "weights": (self.weights, WEIGHTS)}
        put_textures(program, **held)


class Quads:
    """The quads of a scene's surfels.

    Attributes
    ----------
    surfels : SurfelBuffers
    indices : moderngl.Buffer
        Of two triangles for each four vertices; made when first used.
    """

    def __init__(self, device: Device, surfels: SurfelBuffers) -> None:
        self.surfels = surfels
        self._device, self._indices = device, None

    @property
    def indices(self) -> Any:
        if self._indices is None:
            first = 4 * np.arange(self.surfels.count, dtype=np.uint32)[:, None]
            self._indices = self._device.ctx.buffer((first + np.array([0, 1, 2, 2, 1, 3], np.uint32)).tobytes())
        return self._indices

    def groups(self, job: Job) -> int:
        """K, or 0 where a method is exact and has no groups."""
        return number_of_groups(job, self.surfels)

    def give(self, job: Job, part: Part, program: Any) -> None:
        """Bind what has been blended."""
        self._blended(job, part).give(program)

    def draw(self, job: Job, part: Part) -> None:
        """Blend all surfels: their least depth, then those that are seen; or, in groups, what these keep."""
        blended, groups = self._blended(job, part), self.groups(job)
        if groups:
            sum_groups(job, self, part, blended.all_target, groups)
            return
        ctx, stopped = job.device.ctx, part.sheet.stops is not None
        ctx.enable_only(ctx.BLEND | ctx.DEPTH_TEST if stopped else ctx.BLEND)
        ctx.blend_func = ctx.ONE, ctx.ONE
        for nearest in (True, False):
            target = blended.nearest_target if nearest else blended.sums_target
            target.depth_mask = False
            target.use()
            value = CONSTANTS["FAR"] if nearest else 0.0
            target.clear(value, value, value, value)
            ctx.blend_equation = MIN if nearest else ADD
            program = self.program(job, part, "points.frag", part.place, {"NEAREST": nearest})
            blended.give(program)
            self.render(job, program)
        ctx.blend_equation = ADD

    def program(self, job: Job, part: Part, fragments: str, place: tuple[float, ...], defines: Defines) -> Any:
        """The program that draws quads with these fragments, told all but where the fragments read."""
        stopped = part.sheet.stops is not None
        switches: Defines = {**self.surfels.switches(job), "THREE_RAYS": True, "STOPPED": stopped, **defines}
        program = job.program("points.vert", fragments, defines=switches, version=COMPUTE_VERSION)
        part.sheet.give(program)
        self.surfels.ready.texture.use(RECORDS)
        program["surfels"] = RECORDS
        give_draw(program, job, place)
        return program

    def render(self, job: Job, program: Any) -> None:
        """Draw all quads."""
        job.vertex_array(program, [], self.indices).render(vertices=6 * self.surfels.count)

    def _blended(self, job: Job, part: Part) -> Blended:
        made: Blended = job.kept.get("blended", part.sheet, lambda: Blended(job.device, part.sheet))
        return made
