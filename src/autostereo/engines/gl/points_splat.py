"""Surfels to samples by a compute shader, an invocation for each surfel, and view unless a panel is drawn.

Technique. An invocation takes its surfel to the pixels around its projections (Hübner 2007b, section 3.2), whose rays
meet its disc (section 3.3.2). On a panel, whose cameras alternate from sub-pixel to sub-pixel, it finds those of
neighbouring cameras by arithmetic (points_lattice.py), where they are on lattices. Sums are whole numbers, so that one
pass, n passes and any order of surfels give the same bits.

No quads are drawn: for surfels of a few pixels they cost more than their samples, in the vertex stage, and in fragments
that devices shade by blocks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .context import COMPUTE_VERSION, Device
from .job import Job
from .memory import Memory
from .points_buffers import MOST_GROUPS, SurfelBuffers, give_draw, work_groups
from .points_lattice import Lattice, find_lattice
from .programs import Defines, put

if TYPE_CHECKING:
    from .points import Part, Sheet

BAND_ROWS = 32  # of a GPU's invocation


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


def splat(job: Job, surfels: SurfelBuffers, part: Part) -> None:
    """Find the nearest of all surfels, then sum up those that are seen; leaves the sums bound."""
    ctx, sheet = job.device.ctx, part.sheet
    pixels = sheet.size[0] * sheet.size[1]
    samples, values = (3 * pixels, 2) if sheet.panel else (pixels, 4)
    sums = job.kept.get(("sums", sheet.panel), samples, lambda: Sums(job.device, samples, values))
    sums.clear(job)
    surfels.ready.bind(0)
    sums.bind()
    defines: Defines = {**surfels.switches(job), "PANEL": sheet.panel, "STOPPED": sheet.stops is not None}
    lattice = bind_lattice(job, sheet) if sheet.panel else None
    if lattice is not None:
        defines = {
            **defines, "LATTICE": True, "EXACT": lattice.exact, "UNITS": lattice.units, "SLOTS": len(lattice.slots)
        }  # fmt: skip
    rows = sheet.size[1] if sheet.panel else job.atlas.layout.height
    band = max(band_rows(job.device), -(-2 * part.count * rows // MOST_GROUPS))
    for nearest in (True, False):
        ctx.memory_barrier()
        program = job.program("points_splat.comp", defines={**defines, "NEAREST": nearest}, version=COMPUTE_VERSION)
        sheet.give(program)
        give_draw(program, job, part.place)
        program["count"], program["band_rows"] = surfels.count, band
        put(program, first_view=part.first)
        if lattice is not None:
            program["phase_step"], program["flip"] = lattice.step, (job.draw.flip_x, job.draw.flip_y)
            program["slots"].write(lattice.slots.tobytes())
        program.run(*work_groups(surfels.count), part.count * -(-rows // band))
    ctx.memory_barrier()


def band_rows(device: Device) -> int:
    """Rows that an invocation fills at most: on GPUs few, as discs may fill the picture, and drivers end long loops."""
    return BAND_ROWS if device.is_hardware else 2**20


def bind_lattice(job: Job, sheet: Sheet) -> Lattice | None:
    """Where sub-pixels of neighbouring cameras lie on the panel, if on a lattice; binds what the shader reads."""
    draw, size = job.draw, (job.draw.camera.width, job.draw.camera.height)
    assert draw.viewmap is not None
    viewmap = draw.viewmap

    def make() -> tuple[Lattice | None, Any]:
        lattice = find_lattice(viewmap, size, draw.offsets)
        return lattice, lattice and job.device.ctx.texture((size[1], 1), 1, lattice.starts.tobytes(), dtype="f4")

    found: Lattice | None
    found, starts = job.kept.get("lattice", (viewmap, size, draw.offsets.tobytes()), make)
    assert sheet.offsets is not None
    sheet.offsets.bind_to_image(4, write=False)
    if found is not None:
        starts.bind_to_image(5, write=False)
    return found
