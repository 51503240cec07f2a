"""Panels: sub-pixels gathered from an atlas by the mask, in fragment shaders."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..gathering import Tiles
from .atlas import read_into
from .context import Device
from .job import Job
from .programs import Defines

ALL = (1.0, 1.0, 1.0)
NOTHING, EVERYTHING = (False,) * 4, (True,) * 4  # channels that are written


class Panel:
    """Textures of a panel's picture.

    Attributes
    ----------
    color : moderngl.Texture
        RGBA, 8 bits; row 0 is the top.
    depth : moderngl.Texture, optional
        Depth-buffer values (lib/frame.glsl) of each channel, float32; made when the panel is asked `with_depth`.
    target, both : moderngl.Framebuffer
        Of `color` alone, and with `depth` if there is one.
    """

    def __init__(self, device: Device, size: tuple[int, int], with_depth: bool = False) -> None:
        ctx = device.ctx
        device.check_texture(size, "a panel")
        self.device, self.size = device, size
        self.color = ctx.texture(size, 4)
        self.depth = ctx.texture(size, 4, dtype="f4") if with_depth else None
        for texture in (self.color, self.depth):
            if texture is not None:
                texture.filter = (ctx.NEAREST, ctx.NEAREST)
        self.target = ctx.framebuffer([self.color])
        self.both = self.target if self.depth is None else ctx.framebuffer([self.color, self.depth])

    def clear(self) -> None:
        """Nothing gathered yet."""
        self.both.clear()

    def fill(self, background: NDArray[np.float64]) -> None:
        """Everything infinitely far, in the background's colour: for what is drawn over a panel with depth."""
        self.both.clear(1.0, 1.0, 1.0, 1.0)
        self.target.clear(*background, 1.0)

    def gather(self, job: Job, channels: tuple[float, ...] = ALL) -> None:
        """Add those sub-pixels of `channels` (three of 0 and 1) that the job's atlas holds."""
        defines: Defines = {
            "CHANNELS": job.columns is not None, "ONE_TILE": job.one_depth, "WITH_DEPTH": self.depth is not None
        }
        program = job.masked_program("screen.vert", "compose.frag", defines=defines)
        job.atlas.color.use(0)
        program["atlas_color"] = 0
        if self.depth is not None:
            job.atlas.depth.use(1)
            program["atlas_depth"] = 1
        program["held"], program["channels"] = (job.first, job.count), channels
        self.both.use()
        self._add(job, program)

    def weave(
        self, job: Job, quilt: Any, tiles: Tiles, held: tuple[int, int], channels: tuple[float, ...] = ALL
    ) -> None:
        """Add what a quilt's texture holds, bilinearly, and for continuous maps between views as well.

        held: the first of the quilt's views, and how many they are.
        """
        program = job.masked_program("screen.vert", "weave.frag")
        quilt.use(0)
        program["quilt"] = 0
        program["quilt_height"] = tiles.quilt_height
        program["tile"] = tiles.columns, tiles.width, tiles.height
        program["panel_size"] = self.size
        program["held"], program["channels"] = held, channels
        self.target.use()
        self._add(job, program)

    def _add(self, job: Job, program: Any) -> None:
        """Add what a program finds to what has been gathered."""
        ctx = self.device.ctx
        ctx.enable_only(ctx.BLEND)
        ctx.blend_func = ctx.ONE, ctx.ONE
        job.cover(program)

    def read(self, out: NDArray[np.uint8]) -> None:
        """Fill out (H, W, 3) uint8."""
        read_into(self.target, out)


def write_only(target: Any, mask: tuple[bool, ...] = EVERYTHING) -> None:
    """Draw to a framebuffer, and write all its colours in these channels alone."""
    count = len(target.color_attachments)
    target.color_mask = mask if count == 1 else (mask,) * count
    target.use()  # masks of a single colour are not taken over before


class Mean:
    """The mean of several samples of a picture."""

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        ctx = device.ctx
        self._ctx, self._count = ctx, 0
        self._sums = ctx.texture(size, 4, dtype="f4")
        self._sums.filter = (ctx.NEAREST, ctx.NEAREST)
        self._target = ctx.framebuffer([self._sums])

    def clear(self) -> None:
        """No sample yet."""
        self._target.clear()
        self._count = 0

    def add(self, job: Job, picture: Any) -> None:
        """Add a picture's texture."""
        program = job.program("screen.vert", "accumulate.frag")
        picture.use(0)
        program["picture"] = 0
        self._target.use()
        self._ctx.enable_only(self._ctx.BLEND)
        self._ctx.blend_func = self._ctx.ONE, self._ctx.ONE
        job.cover(program)
        self._count += 1

    def write(self, job: Job, target: Any) -> None:
        """Fill a framebuffer with the mean."""
        program = job.program("screen.vert", "mean.frag")
        self._sums.use(0)
        program["sums"] = 0
        program["count"] = float(self._count)
        target.use()
        self._ctx.enable_only(self._ctx.NOTHING)
        job.cover(program)
