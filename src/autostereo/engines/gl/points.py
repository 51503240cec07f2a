"""Points on the gl engine: surfels into the tiles of views, or all sub-pixels of a panel in a single pass.

Technique. A compute shader takes each surfel, once per view or on panels once for all cameras, to the pixels around its
projections (Hübner 2007b, section 3.2), whose rays meet its disc (section 3.3.2). Which surfels a sample sees is known
once the nearest is (ε-z), so that is done twice: first the least depth is kept, then the shares of those within their own
radius of it are summed (the usual 2+1 passes; Botsch and Kobbelt 2003), per channel of a panel. A last pass over the
picture normalises. Sums are whole numbers, so that no order of surfels changes a bit.

No quads are drawn: for surfels of a few pixels these cost more than their samples, in the vertex stage and in fragments
that are shaded by blocks. `covering-quad` draws them, as the paper does (points_quads.py).

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
from .context import Device
from .job import Job, Stage
from .memory import Memory
from .panel import Panel, write_only
from .points_buffers import CONSTANTS, SurfelBuffers, give_draw, work_groups
from .points_lattice import Lattice, find_lattice
from .points_quads import Quads
from .programs import Defines

SHEET_PIXELS = 2**22  # of a sheet: with all its sums a quarter of a gigabyte for panels
OFFSETS, STOPS = 0, 1  # texture units
VERSION = 430


class Sheet:
    """What is known of a sheet's samples before points: cameras of a panel's sub-pixels, and depths that may hide points.

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
        for name, texture, unit in (("offsets", self.offsets, OFFSETS), ("stops", self.stops, STOPS)):
            if name in program:
                assert texture is not None
                texture.use(unit)
                program[name] = unit


class Sums:
    """Least depth of each sample, and sums of what it sees (lib/sums.glsl)."""

    def __init__(self, device: Device, samples: int, values: int) -> None:
        self.nearest = Memory(device, samples, 1, "u4")
        self.words = [Memory(device, values * samples, 1, "u4") for _ in range(2)]

    def clear(self, job: Job) -> None:
        """Nothing is seen."""
        self.nearest.fill(job, True)
        for memory in self.words:
            memory.fill(job, False)

    def bind(self) -> None:
        """To the image units of lib/sums.glsl."""
        for unit, memory in enumerate([self.nearest, *self.words], 1):
            memory.bind(unit)


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
            self._splat(job, part)
            program = job.masked_program if job.mask is not None else job.program
            resolve = program("tile.vert", "points_resolve.frag", defines=CONSTANTS, version=VERSION)
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
            self._find_offsets(job, part)
            if stopped:
                self._stop(job, part, panel.depth)
            if quads:
                self._quads.draw(job, part)
            else:
                self._splat(job, part)
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
        if "held" in program:
            program["held"] = part.first, part.count
        part.sheet.stops_target.use()
        part.sheet.stops_target.clear(depth=0.0)
        ctx.enable_only(ctx.DEPTH_TEST)
        ctx.depth_func = "1"
        job.cover(program)
        ctx.depth_func = "<"

    def _splat(self, job: Job, part: Part) -> None:
        """Find the nearest of all surfels, then sum up those that are seen."""
        ctx, sheet = job.device.ctx, part.sheet
        samples, values = (3 * sheet.size[0] * sheet.size[1], 2) if sheet.panel else (sheet.size[0] * sheet.size[1], 4)
        sums = job.kept.get(("sums", sheet.panel), samples, lambda: Sums(job.device, samples, values))
        sums.clear(job)
        self._buffers.ready.bind(0)
        sums.bind()
        lattice = self._lattice(job, sheet)
        for nearest in (True, False):
            ctx.memory_barrier()
            defines: Defines = {
                **self._buffers.switches(job), "PANEL": sheet.panel, "STOPPED": sheet.stops is not None, "NEAREST": nearest,
                "LATTICE": lattice is not None, "UNITS": lattice.units if lattice else 0,
                "SLOTS": len(lattice.slots) if lattice else 0,
            }
            program = job.program("points_splat.comp", defines=defines, version=VERSION)
            sheet.give(program)
            give_draw(program, job, part.place)
            program["count"] = self._buffers.count
            if lattice is not None:
                program["phase_step"], program["flip"] = lattice.step, (job.draw.flip_x, job.draw.flip_y)
                program["slots"].write(lattice.slots.tobytes())
            if "first_view" in program:
                program["first_view"] = part.first
            program.run(*work_groups(self._buffers.count), part.count)
        ctx.memory_barrier()

    def _lattice(self, job: Job, sheet: Sheet) -> Lattice | None:
        """Where sub-pixels of neighbouring cameras lie on a panel, if on a lattice; binds what the shader reads of it."""
        if sheet.offsets is None:
            return None
        draw, size = job.draw, (job.draw.camera.width, job.draw.camera.height)
        assert draw.viewmap is not None
        viewmap = draw.viewmap

        def make() -> tuple[Lattice | None, Any]:
            lattice = find_lattice(viewmap, size, draw.offsets)
            return lattice, lattice and job.device.ctx.texture((size[1], 1), 1, lattice.starts.tobytes(), dtype="f4")

        lattice, starts = job.kept.get("lattice", (viewmap, size, draw.offsets.tobytes()), make)
        sheet.offsets.bind_to_image(4, write=False)
        if lattice is not None:
            starts.bind_to_image(5, write=False)
        found: Lattice | None = lattice
        return found

    def _put(self, job: Job, part: Part, panel: Panel, quads: bool) -> None:
        """Normalise a band into the panel's colours and depths, a channel at a time: they may be seen apart."""
        ctx = job.device.ctx
        defines = {**CONSTANTS, "PANEL": True, "QUADS": quads}
        program = job.masked_program("screen.vert", "points_resolve.frag", defines=defines, version=VERSION)
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
