"""Points on the gl engine: surfels into the tiles of views, or all sub-pixels of a panel in a single pass.

Which surfels a sample sees is known once the nearest is (ε-z): the least depth is found first, then the shares of those
within their own radius of it are summed (the usual 2+1 passes; Botsch and Kobbelt 2003), per channel of a panel. A last
pass over the picture normalises. Both by a compute shader (points_splat.py), or by covering quads (points_quads.py).

What is summed belongs to a *sheet*: as many tiles, or rows of the panel, as memory shall hold, one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.points import Points
from .atlas import Layout
from .context import COMPUTE_VERSION, Device
from .job import Job, Stage
from .panel import Panel, write_only
from .points_buffers import CONSTANTS, SurfelBuffers
from .points_quads import Quads
from .points_splat import splat
from .programs import put, put_textures

SHEET_PIXELS = 2**22  # of a sheet: with all its sums a quarter of a gigabyte for panels
OFFSETS, STOPS = 0, 1  # texture units


class Sheet:
    """What is known of samples before points are drawn: cameras of a panel's sub-pixels, depths that may hide points.

    Attributes
    ----------
    size : (int, int)
    panel : bool
        Three samples a pixel, else one.
    offsets, stops : moderngl.Texture, optional
        Camera offsets of sub-pixels; depths of what is opaque.
    depth : moderngl.Texture, optional
        Depth buffer: the farthest that points may lie at, for each pixel.
    """

    def __init__(self, device: Device, size: tuple[int, int], panel: bool, stopped: bool) -> None:
        ctx = device.ctx
        self.size, self.panel = size, panel
        each = 4 if panel else 1
        self.offsets = ctx.texture(size, each, dtype="f4") if panel else None
        self.stops = ctx.texture(size, each, dtype="f4") if stopped else None
        self.depth = ctx.depth_texture(size) if stopped else None
        for texture in (self.offsets, self.stops):
            if texture is not None:
                texture.filter = (ctx.NEAREST, ctx.NEAREST)
        self.offsets_target: Any = ctx.framebuffer([self.offsets]) if panel else None
        self.stops_target: Any = ctx.framebuffer([self.stops], self.depth) if stopped else None

    def give(self, program: Any) -> None:
        """Bind the textures that a program reads."""
        put_textures(program, offsets=(self.offsets, OFFSETS), stops=(self.stops, STOPS))


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
        device.require(COMPUTE_VERSION, "drawing points by engine gl", "engine='cpu'")
        self._buffers = SurfelBuffers(device, clouds, middle)
        self._quads = Quads(device, self._buffers)

    def draws_over(self, job: Job) -> bool:
        """On panels a single pass needs no views."""
        return job.draw.method in ("single-pass", "covering-quad")

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of these tiles, as many at a time as a sheet holds."""
        self._buffers.make_ready(job)
        size = job.atlas.layout.width, job.atlas.layout.height
        most = max(1, min(len(tiles), SHEET_PIXELS // (size[0] * size[1])))
        layout = Layout.fitting(most, size, job.device.limits)
        stopped = job.draw.method == "n-pass-masked" or has_others(job)
        sheet = self._sheet(job, layout.size, False, stopped)
        for first in range(tiles.start, tiles.stop, layout.count):
            count = min(layout.count, tiles.stop - first)
            part = Part(sheet, (*layout.size, layout.columns, 0.0), first, count)
            if stopped:
                self._stop(job, part, job.atlas.depth)
            splat(job, self._buffers, part)
            program = job.masked_program if job.mask is not None else job.program
            resolve = program("tile.vert", "points_resolve.frag", defines=CONSTANTS, version=COMPUTE_VERSION)
            resolve["first_view"] = first
            job.atlas.target.use()
            job.device.ctx.enable_only(job.device.ctx.DEPTH_TEST)
            job.vertex_array(resolve, []).render(job.device.ctx.TRIANGLE_STRIP, vertices=4, instances=count)

    def draw_panel(self, job: Job, panel: Panel) -> None:
        """Draw all sub-pixels of a panel, band after band."""
        self._buffers.make_ready(job)
        width, height = panel.size
        quads = job.draw.method == "covering-quad"
        rows = max(1, min(height, SHEET_PIXELS // (width * max(self._quads.groups(job), 1))))
        stopped = has_others(job)
        sheet = self._sheet(job, (width, rows), True, stopped)
        for first in range(0, height, rows):
            part = Part(sheet, (width, rows, float(first), 0.0))
            draw = job.draw
            key = sheet, first, draw.viewmap, draw.offsets.tobytes(), draw.flip_x, draw.flip_y
            job.kept.get("points' cameras", key, lambda part=part: self._find_offsets(job, part))  # type: ignore[misc]
            if stopped:
                self._stop(job, part, panel.depth)
            if quads:
                self._quads.draw(job, part)
            else:
                splat(job, self._buffers, part)
            self._put(job, part, panel, quads)

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
        put(program, held=(part.first, part.count))
        part.sheet.stops_target.use()
        part.sheet.stops_target.clear(depth=0.0)
        ctx.enable_only(ctx.DEPTH_TEST)
        ctx.depth_func = "1"
        job.cover(program)
        ctx.depth_func = "<"

    def _put(self, job: Job, part: Part, panel: Panel, quads: bool) -> None:
        """Normalise a band into the panel's colours and depths, a channel at a time: they may be seen apart."""
        ctx = job.device.ctx
        defines = {**CONSTANTS, "PANEL": True, "QUADS": quads}
        program = job.masked_program("screen.vert", "points_resolve.frag", defines=defines, version=COMPUTE_VERSION)
        if quads:
            self._quads.give(job, part, program)
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
