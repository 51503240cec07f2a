"""Surfels in K groups: the 1+1 pass of Hübner 2007b, section 3.5.2, as printed but for ε, a surfel's radius.

The geometry is drawn once. Each group has a tile of its own in which a depth buffer keeps its nearest surfel, by one
depth for the three sub-pixels of a pixel; a last pass blends what the groups have kept. Surfels take turns in groups
along a curve that fills space (points_buffers.py), so that neighbours, which should be blended, are seldom in one.
Where they are, all but one are lost: the picture is that of `single-pass` only where K groups part them all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...errors import UnsupportedError
from .atlas import Layout
from .context import COMPUTE_VERSION, Device
from .job import Job
from .points_buffers import CONSTANTS, SurfelBuffers
from .programs import Defines

if TYPE_CHECKING:
    from .points import Part
    from .points_quads import Quads

SHARES, EPSILONS, KEPT = 6, 7, 8  # texture units, after those of points.py, points_quads.py and points_buffers.py


class Groups:
    """Tiles of a band of the panel, one for each group."""

    def __init__(self, device: Device, layout: Layout) -> None:
        ctx = device.ctx
        self.layout = layout
        self.shares = ctx.texture(layout.size, 4, dtype="u4")
        self.epsilons = ctx.texture(layout.size, 1, dtype="f4")
        self.kept = ctx.depth_texture(layout.size)
        self.kept.compare_func = ""
        for texture in (self.shares, self.epsilons, self.kept):
            texture.filter = (ctx.NEAREST, ctx.NEAREST)
        self.target = ctx.framebuffer([self.shares, self.epsilons], self.kept)


def number_of_groups(job: Job, buffers: SurfelBuffers) -> int:
    """K, or 0 where a method is exact and has no groups."""
    return min(job.draw.options.groups, buffers.count) if job.one_depth else 0


def groups_layout(job: Job, count: int, size: tuple[int, int]) -> Layout:
    """Tiles for `count` groups.

    Raises
    ------
    UnsupportedError
        A texture of the device is too small.
    """
    layout = Layout.fitting(count, size, job.device.limits)
    if layout.count < count:
        raise UnsupportedError(
            f"groups {count}: a texture of this device holds {layout.count} tiles of {size[0]}×{size[1]} pixels "
            f"({job.device.renderer}): choose fewer"
        )
    return layout


def sum_groups(job: Job, quads: Quads, part: Part, target: Any, count: int) -> None:
    """Fill what a band is blended into, `target`, with what `count` groups show."""
    ctx = job.device.ctx
    layout = groups_layout(job, count, part.sheet.size)
    groups = job.kept.get("groups", layout, lambda: Groups(job.device, layout))
    place = (*part.place[:3], float(layout.columns))
    defines: Defines = {"GROUPS": count, "LEAST_DEPTH": job.draw.options.alpha == "minimal"}
    program = quads.program(job, part, "points_groups.frag", place, defines)
    groups.target.color_mask = ((False,) * 4,) * 2  # whole numbers cannot be cleared; `kept` says what is there
    groups.target.use()
    groups.target.clear()
    groups.target.color_mask = ((True,) * 4,) * 2
    ctx.enable_only(ctx.DEPTH_TEST)
    quads.render(job, program)

    defines = {**CONSTANTS, "GROUPS": count}
    program = job.program("screen.vert", "points_blend.frag", defines=defines, version=COMPUTE_VERSION)
    for name, unit in (("shares", SHARES), ("epsilons", EPSILONS), ("kept", KEPT)):
        getattr(groups, name).use(unit)
        program[name] = unit
    program["sheet"] = place
    target.use()
    ctx.enable_only(ctx.NOTHING)
    job.cover(program)
