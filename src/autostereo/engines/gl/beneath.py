"""What was drawn before something translucent: a copy of colours and depths, to be read while they are drawn over."""

from __future__ import annotations

from typing import Any

from .context import Device
from .job import Job
from .panel import Panel
from .programs import put_textures


class Beneath:
    """Colours, and depths as in lib/frame.glsl: of a panel one per channel."""

    def __init__(self, device: Device, size: tuple[int, int], channels: int) -> None:
        ctx = device.ctx
        self._color = ctx.texture(size, 4)
        self._depth = ctx.texture(size, channels, dtype="f4")
        for texture in (self._color, self._depth):
            texture.filter = (ctx.NEAREST, ctx.NEAREST)
        self._target = ctx.framebuffer([self._color])
        self._both = ctx.framebuffer([self._color, self._depth])

    @staticmethod
    def of_tiles(job: Job, tiles: range, depths: bool = True) -> Beneath:
        """Copy some tiles of the job's atlas, to the same places; without depths, those of before stay."""
        layout = job.atlas.layout
        kept: Beneath = job.kept.get("beneath tiles", layout, lambda: Beneath(job.device, layout.size, 1))
        for tile in tiles:
            x, y = layout.tiles[tile]
            box = int(x), int(y), layout.width, layout.height
            kept._copy(job, (job.atlas.color, job.atlas.depth if depths else None), box)
        return kept

    @staticmethod
    def of_panel(job: Job, panel: Panel) -> Beneath:
        """Copy a panel that has depths."""
        kept: Beneath = job.kept.get("beneath panel", panel.size, lambda: Beneath(job.device, panel.size, 4))
        kept._copy(job, (panel.color, panel.depth), (0, 0, *panel.size))
        return kept

    def _copy(self, job: Job, textures: tuple[Any, Any | None], box: tuple[int, int, int, int]) -> None:
        ctx = job.device.ctx
        program = job.program("screen.vert", "copy.frag", defines={"DEPTHS": textures[1] is not None})
        for unit, (name, texture) in enumerate(zip(("picture", "depths"), textures, strict=True)):
            if texture is not None:
                texture.use(unit)
                program[name] = unit
        program["first_pixel"] = 0, 0
        target = self._both if textures[1] is not None else self._target
        target.viewport = box
        target.use()
        ctx.enable_only(ctx.NOTHING)
        job.cover(program)

    def use(self, program: Any, color_unit: int, depth_unit: int) -> None:
        """Give them to a program that includes lib/volume_target.glsl."""
        put_textures(program, color_before=(self._color, color_unit), depth_before=(self._depth, depth_unit))
