"""Proxy slices: volumes as a stack of rectangles, blended back to front (Hübner 2007a, section 3.2).

The paper's way, beside the march: every slab is a draw of its own over all that it covers, so that it looks up both its
ends, never ends early and skips nothing. Blending takes an alpha of each channel from a second source, which the
hardware of 2007 did not have: it had the mean of the three (`alpha="averaged"`). Pictures are summed up in float32.
"""

from __future__ import annotations

from typing import Any

from .job import Job
from .panel import Panel

ONE_MINUS_SECOND_COLOR = 0x88FA  # GL_ONE_MINUS_SRC1_COLOR


def slices_on_tiles(job: Job, program: Any, slabs: int, tiles: range) -> None:
    """Blend so many slabs over some tiles of the job's atlas, behind what is in front of them."""
    atlas, layout = job.atlas, job.atlas.layout
    layer = job.kept.get("layer of tiles", atlas, lambda: _layer(job, layout.size, atlas.depth))
    boxes = [(int(x), int(y), layout.width, layout.height) for x, y in layout.tiles[tiles.start : tiles.stop]]
    for box in boxes:
        _transfer(job, atlas.color, layer, box)
    layer.viewport = (0, 0, *layout.size)
    _blend(job, program, layer, slabs * len(tiles), depth_test=True)
    for box in boxes:
        _transfer(job, layer.color_attachments[0], atlas.over, box)
    atlas.over.viewport = (0, 0, *layout.size)


def slices_on_panel(job: Job, program: Any, slabs: int, panel: Panel) -> None:
    """Blend so many slabs over a panel."""
    layer = job.kept.get("layer of panel", panel.size, lambda: _layer(job, panel.size))
    box = (0, 0, *panel.size)
    _transfer(job, panel.color, layer, box)
    _blend(job, program, layer, slabs, depth_test=False)
    _transfer(job, layer.color_attachments[0], panel.target, box)


def _layer(job: Job, size: tuple[int, int], depth: Any = None) -> Any:
    """A framebuffer of colours in float32, with a depth buffer that is only tested."""
    ctx = job.device.ctx
    texture = ctx.texture(size, 4, dtype="f4")
    texture.filter = (ctx.NEAREST, ctx.NEAREST)
    layer = ctx.framebuffer([texture], depth)
    layer.depth_mask = False
    return layer


def _transfer(job: Job, picture: Any, target: Any, box: tuple[int, int, int, int]) -> None:
    program = job.program("screen.vert", "transfer.frag")
    picture.use(0)
    program["picture"] = 0
    target.viewport = box
    target.use()
    job.device.ctx.enable_only(job.device.ctx.NOTHING)
    job.cover(program)


def _blend(job: Job, program: Any, layer: Any, instances: int, depth_test: bool) -> None:
    ctx = job.device.ctx
    layer.use()
    ctx.enable_only(ctx.BLEND | ctx.DEPTH_TEST if depth_test else ctx.BLEND)
    ctx.blend_func = ctx.ONE, ONE_MINUS_SECOND_COLOR
    job.vertex_array(program, []).render(ctx.TRIANGLE_STRIP, vertices=4, instances=instances)
    ctx.blend_func = ctx.ONE, ctx.ZERO  # Mesa refuses two targets while a second source is set, even unblended
