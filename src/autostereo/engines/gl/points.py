"""Points on the gl engine: surfels into the tiles of views, or all sub-pixels of a panel in a single pass.

Technique. A surfel becomes a quad around what is seen of it, for all cameras at once on panels (Hübner 2007b, section
3.2); the fragment shader meets its disc with the ray of each sub-pixel (section 3.3.2). Which surfels a sample sees is
known once the nearest is (ε-z), so they are drawn twice: first the least depth is kept, then the shares of those
within their own radius of it are summed (the usual 2+1 passes; Botsch and Kobbelt 2003), per channel of a panel, as
both blendings have a value for each: "min", and "add". A last pass over the picture normalises.

The paper's own 1+1 pass draws once, in K groups that each keep their nearest surfel, and blends the K in the last
pass; of surfels in one group that overlap it loses all but one. Its reason, that float textures could not be blended
into, is gone: `single-pass` and `covering-quad` are exact. With `alpha="averaged"` or `"minimal"`, `covering-quad` is
what the paper has (points_groups.py), for comparison.

What is summed lies on a *sheet*: as many tiles, or rows of the panel, as memory shall hold, one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.points import Points
from .atlas import Layout
from .context import ADD, Device
from .job import Job, Stage
from .panel import Panel, write_only
from .points_buffers import CONSTANTS, SurfelBuffers, give_draw
from .points_groups import number_of_groups, sum_groups
from .programs import Defines

SHEET_PIXELS = 2**22  # of a sheet: with all its sums a third of a gigabyte for panels
OFFSETS, STOPS, NEAREST, SUMS, WEIGHTS = range(5)  # texture units
MIN = 0x8007  # GL_MIN


class Sheet:
    """Textures that surfels are summed in; `panel`: three values of each kind per pixel, else one view's."""

    def __init__(self, device: Device, size: tuple[int, int], panel: bool, stopped: bool) -> None:
        ctx = device.ctx
        self.size, self.panel, self.stopped = size, panel, stopped

        def texture(components: int) -> Any:
            made = ctx.texture(size, components, dtype="f4")
            made.filter = (ctx.NEAREST, ctx.NEAREST)
            return made

        each = 4 if panel else 1
        depth = ctx.depth_texture(size) if stopped else None
        self.nearest, self.sums = texture(each), texture(4)
        self.weights = texture(4) if panel else None
        self.offsets = texture(4) if panel else None
        self.stops = texture(each) if stopped else None
        self.nearest_target = ctx.framebuffer([self.nearest], depth)
        self.sums_target = ctx.framebuffer([self.sums, self.weights] if panel else [self.sums], depth)
        self.offsets_target: Any = ctx.framebuffer([self.offsets]) if panel else None
        self.all_target: Any = ctx.framebuffer([self.nearest, self.sums, self.weights]) if panel else None
        self.stops_target: Any = ctx.framebuffer([self.stops], depth) if stopped else None

    def give(self, program: Any) -> None:
        """Bind the textures that a program reads."""
        units = {"offsets": OFFSETS, "stops": STOPS, "nearest": NEAREST, "sums": SUMS, "weights": WEIGHTS}
        for name, unit in units.items():
            if name in program:
                getattr(self, name).use(unit)
                program[name] = unit


@dataclass(frozen=True, eq=False)
class Part:
    """What is drawn on a sheet at a time.

    Attributes
    ----------
    sheet : Sheet
    place : (float, float, float, float)
        `sheet` of the shaders: size, columns of tiles or first row of the panel, 0.
    first, count : int
        Tiles of the atlas; of a panel 0 and 1.
    """

    sheet: Sheet
    place: tuple[float, float, float, float]
    first: int = 0
    count: int = 1


class PointClouds(Stage):
    """The points of a scene; a stage (engine.py)."""

    def __init__(self, device: Device, clouds: Sequence[Points], middle: NDArray[np.float64]) -> None:
        self._buffers = SurfelBuffers(device, clouds, middle)

    def draws_over(self, job: Job) -> bool:
        """On panels a single pass needs no views."""
        return job.draw.method in ("single-pass", "covering-quad")

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of these tiles, as many at a time as a sheet holds."""
        self._buffers.make_ready(job)
        stopped = job.draw.method == "n-pass-masked" or has_others(job)
        size = job.atlas.layout.width, job.atlas.layout.height
        most = max(1, min(len(tiles), SHEET_PIXELS // (size[0] * size[1])))
        layout = Layout.fitting(most, size, job.device.limits)
        sheet = self._sheet(job, layout.size, False, stopped)
        for first in range(tiles.start, tiles.stop, layout.count):
            count = min(layout.count, tiles.stop - first)
            part = Part(sheet, (*layout.size, layout.columns, 0.0), first, count)
            if stopped:
                self._stop(job, part, job.atlas.depth)
            self._sum(job, part)
            program = job.masked_program if job.mask is not None else job.program
            resolve = program("tile.vert", "points_resolve.frag", defines=CONSTANTS)
            resolve["first_view"] = first
            sheet.give(resolve)
            resolve["sheet"] = part.place
            job.atlas.target.use()
            job.device.ctx.enable_only(job.device.ctx.DEPTH_TEST)
            job.vertex_array(resolve, []).render(job.device.ctx.TRIANGLE_STRIP, vertices=4, instances=count)

    def draw_panel(self, job: Job, panel: Panel) -> None:
        """Draw all sub-pixels of a panel, band after band."""
        self._buffers.make_ready(job)
        width, height = panel.size
        groups = number_of_groups(job, self._buffers)
        rows = max(1, min(height, SHEET_PIXELS // (width * max(groups, 1))))
        stopped = has_others(job)
        sheet = self._sheet(job, (width, rows), True, stopped)
        for first in range(0, height, rows):
            part = Part(sheet, (width, rows, float(first), 0.0))
            self._find_offsets(job, part)
            if stopped:
                self._stop(job, part, panel.depth)
            if groups:
                sum_groups(job, self._buffers, sheet, part.place, groups)
            else:
                self._sum(job, part)
            self._put(job, part, panel)

    def _sheet(self, job: Job, size: tuple[int, int], panel: bool, stopped: bool) -> Sheet:
        key = size, stopped
        name = "panel sheet" if panel else "sheet"
        return job.kept.get(name, key, lambda: Sheet(job.device, size, panel, stopped))

    def _find_offsets(self, job: Job, part: Part) -> None:
        """The cameras of the band's sub-pixels."""
        program = job.masked_program("screen.vert", "points_offsets.frag")
        program["first_row"] = int(part.place[2])
        part.sheet.offsets_target.use()
        job.device.ctx.enable_only(job.device.ctx.NOTHING)
        job.cover(program)

    def _stop(self, job: Job, part: Part, depths: Any) -> None:
        """Depths that surfels must be in front of, from a depth texture of the atlas or panel."""
        ctx = job.device.ctx
        defines = {**CONSTANTS, "PANEL": part.sheet.panel}
        program = (job.masked_program if part.sheet.panel else job.program)(
            "screen.vert", "points_stops.frag", defines=defines
        )
        depths.use(STOPS)
        program["depths"], program["sheet"] = STOPS, part.place
        if "held" in program:
            program["held"] = part.first, part.count
        part.sheet.stops_target.use()
        part.sheet.stops_target.clear(depth=0.0)
        ctx.enable_only(ctx.DEPTH_TEST)
        ctx.depth_func = "1"
        job.cover(program)
        ctx.depth_func = "<"

    def _sum(self, job: Job, part: Part) -> None:
        """Find the nearest of all surfels, then sum up those that are seen."""
        ctx, sheet = job.device.ctx, part.sheet
        ctx.enable_only(ctx.BLEND | ctx.DEPTH_TEST if sheet.stopped else ctx.BLEND)
        ctx.blend_func = ctx.ONE, ctx.ONE
        for nearest in (True, False):
            target = sheet.nearest_target if nearest else sheet.sums_target
            target.depth_mask = False
            target.use()
            clear(target, CONSTANTS["FAR"] if nearest else 0.0)
            ctx.blend_equation = MIN if nearest else ADD
            self._draw_quads(job, part, {"NEAREST": nearest})
        ctx.blend_equation = ADD

    def _draw_quads(self, job: Job, part: Part, defines: Defines) -> None:
        sheet = part.sheet
        defines = {**defines, **self._buffers.switches(job), "PANEL": sheet.panel, "STOPPED": sheet.stopped}
        program = job.program("points.vert", "points.frag", defines=defines, version=430)
        sheet.give(program)
        give_draw(program, job, part.place)
        if "first_view" in program:
            program["first_view"] = part.first
        quads = job.vertex_array(program, [], self._buffers.quads)
        quads.render(vertices=6 * self._buffers.count, instances=part.count)

    def _put(self, job: Job, part: Part, panel: Panel) -> None:
        """Normalise a band into the panel's colours and depths, a channel at a time: they may be seen apart."""
        ctx = job.device.ctx
        defines = {**CONSTANTS, "PANEL": True}
        program = job.masked_program("screen.vert", "points_resolve.frag", defines=defines)
        part.sheet.give(program)
        program["sheet"] = part.place
        ctx.enable_only(ctx.NOTHING)
        for channel in range(3):
            mask = tuple(k == channel for k in range(4))
            write_only(panel.both, mask)
            program["channel"] = channel
            job.cover(program)
        write_only(panel.both)


def has_others(job: Job) -> bool:
    """Whether something else in the scene may hide points."""
    return any(not isinstance(item, Points) for item in job.scene.objects)


def clear(target: Any, value: float) -> None:
    """Fill the colours of a framebuffer, not its depth."""
    target.clear(value, value, value, value)
