"""A frame: atlas after atlas, pass after pass, sample after sample; then gathered, and read back once.

How often the scene is traversed is all that the methods for views differ in (`passes`); they fill the same tiles of
the same atlas through the same shaders, so that their pictures are the same; but geometry-shader has one shader more,
and what it clips is rounded a little otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..engine import Draw, Target, channel_camera, small_camera
from ..gathering import Tiles
from .atlas import Atlas, Layout
from .blocks import stored_background
from .context import Limits
from .job import CLEARLY, Job, Kept, Stage
from .panel import ALL, NOTHING, Mean, Panel, write_only

PIXEL_BYTES, PANEL_BYTES, MEAN_BYTES = 8, 4, 16  # of a pixel of an atlas, with depth; of a panel; of a mean
CHANNELS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def sample_positions(samples: int) -> list[tuple[float, float]]:
    """Positions (x, y) of a pixel's samples within it, on a regular grid."""
    side = round(samples**0.5)
    return [((k % side + 0.5) / side, (k // side + 0.5) / side) for k in range(side * side)]


def atlases(job: Job, name: str = "atlas") -> Iterator[Job]:
    """The job for one atlas of views after the other, until all views have been in one; `name` keeps it."""
    camera, views = job.draw.camera, len(job.draw.offsets)
    layout = Layout.fitting(views, (camera.width, camera.height), job.device.limits)
    atlas = job.kept.get(name, layout, lambda: Atlas(job.device, layout))
    for first in range(0, views, layout.count):
        yield job.with_atlas(atlas, first, min(layout.count, views - first))


def texture_bytes(draw: Draw, limits: Limits, kept: Kept) -> int:
    """Bytes of the textures that pictures are drawn into, but for those that are kept from the frame before.

    Of panels in one pass it is the most: where it is faster they are drawn with fewer.
    """
    panel = draw.viewmap is not None
    small = panel and draw.method == "n-pass-subres"
    camera = small_camera(draw) if small else draw.camera
    channels = draw.viewmap is not None and draw.viewmap.continuous and not draw.method.startswith("n-pass")
    name = "channels" if channels else "small atlas" if small else "atlas"
    layout = Layout.fitting(3 if channels else len(draw.offsets), (camera.width, camera.height), limits)
    width, height = layout.size
    atlas = 0 if kept.holds(name, layout) else PIXEL_BYTES * width * height
    panels = PANEL_BYTES * draw.pixels if panel and "panel" not in kept else 0
    if draw.options.samples > 1 and "mean" not in kept and "panel mean" not in kept:
        atlas += MEAN_BYTES * (draw.pixels if panel and not small else width * height)
    return atlas + panels


def passes(job: Job) -> Iterator[range]:
    """The tiles that each traversal of the scene draws, of those in the atlas."""
    method = job.draw.method
    if method.startswith("n-pass"):
        step = 1
    elif method == "geometry-shader":
        step = job.draw.options.views_per_pass or job.count
    elif method == "geometry-shader-painter":
        step = targets_per_pass(job)
    else:
        step = job.count
    for start in range(0, job.count, step):
        yield range(start, min(start + step, job.count))


def targets_per_pass(job: Job) -> int:
    """Views of a pass that has a render target for each (de Sorbier 2008, section 4.2: "limits … to eight")."""
    most = job.device.limits.draw_buffers
    return min(job.draw.options.views_per_pass or most, most)


def draw_tiles(job: Job, stages: list[Stage], channels: tuple[float, ...] | None = None) -> None:
    """Clear the atlas and draw its views into it.

    channels: of a panel, those that are to be gathered: what the mask hides of them need not be drawn.
    """
    whole = channels == ALL and job.count == len(job.draw.offsets)  # else masks change within a frame
    if whole and job.draw.method == "single-pass":
        _start_masked(job)
    else:
        job.atlas.clear(stored_background(job.scene))
    for tiles in passes(job):
        if channels is not None and job.draw.method == "n-pass-masked":
            _hide(job, tiles, channels)
        for stage in stages:
            stage.draw_views(job, tiles)


def _start_masked(job: Job) -> None:
    """An empty atlas with all that the mask hides already hidden: made once, then copied in every frame."""

    def masked() -> Atlas:
        part = replace(job, atlas=Atlas(job.device, job.atlas.layout))
        part.atlas.clear(stored_background(job.scene))
        _hide(part, range(part.count), ALL)
        return part.atlas

    key = job.atlas.layout, job.draw.viewmap, job.draw.flip_x, job.draw.flip_y
    job.device.ctx.copy_framebuffer(job.atlas.target, job.kept.get("masked", key, masked).target)


def _hide(job: Job, tiles: range, channels: tuple[float, ...]) -> None:
    """Bring the depth of pixels that show nothing of a tile's view to the front (Hübner 2007a, section 4, early z)."""
    ctx = job.device.ctx
    program = job.masked_program("tile.vert", "hide.frag")
    program["first_view"], program["first_held"], program["channels"] = tiles.start, job.first, channels
    write_only(job.atlas.target, NOTHING)
    ctx.enable_only(ctx.DEPTH_TEST)
    job.vertex_array(program, []).render(ctx.TRIANGLE_STRIP, vertices=4, instances=len(tiles))
    write_only(job.atlas.target)


# --- views ---------------------------------------------------------------------------------------------------


def draw_views(job: Job, stages: list[Stage], target: Target) -> None:
    """Draw a stack of views, as many at a time as an atlas may hold."""
    for part in atlases(job):
        _draw_samples(part, stages, target.depth)
        wanted = job.device.reads or target.depth is not None  # what has depths is worked on: dibr
        for tile in range(part.count if wanted else 0):
            part.atlas.read_color(tile, target.color[part.first + tile])


def _draw_samples(job: Job, stages: list[Stage], depth: NDArray[np.float32] | None = None) -> None:
    """Fill an atlas with the mean colours of all samples, and `depth` (V, H, W) with the nearest depths."""
    samples, size = sample_positions(job.draw.options.samples), job.atlas.layout.size
    mean = job.kept.get("mean", size, lambda: Mean(job.device, size)) if samples[1:] else None
    if mean is not None:
        mean.clear()
    for x, y in samples:
        camera = job.draw.camera
        across, down = camera.shift
        job.write_frame(replace(camera, shift=(across + camera.spread * (0.5 - x), down + 0.5 - y)))
        draw_tiles(job, stages)
        if mean is not None:
            mean.add(job, job.atlas.color)
        if depth is not None:
            for tile, view in enumerate(range(job.first, job.first + job.count)):
                found = job.depths.depth_from_window(job.atlas.read_depth(tile))
                depth[view] = found if (x, y) == samples[0] else np.minimum(depth[view], found)
    if mean is not None:
        mean.write(job, job.atlas.over)


# --- panels --------------------------------------------------------------------------------------------------


def by_channels(job: Job, stages: list[Stage]) -> bool:
    """Whether the panel's sub-pixels are drawn for their own cameras, and not views.

    In a single pass: where cameras lie between views, and where it is expected to be clearly faster, as where few
    triangles are seen by many views.
    """
    draw = job.draw
    assert draw.viewmap is not None
    if draw.method != "single-pass":
        return draw.method == "covering-quad"
    if draw.viewmap.continuous or not stages:
        return True
    costs = [stage.costs(job) for stage in stages]
    return sum(channels for _, channels in costs) < CLEARLY * (job.views_cost + sum(own for own, _ in costs))


def draw_panel(job: Job, stages: list[Stage], target: Target) -> None:
    """Draw a panel: tiles of views or of channels, gathered by the mask, and what is drawn over that."""
    camera = job.draw.camera
    size = camera.width, camera.height
    over = [stage for stage in stages if stage.draws_over(job)]
    under = [stage for stage in stages if stage not in over]
    with_depth = bool(over) and len(stages) > 1  # one kind of objects hides itself
    panel = job.kept.get("panel", (size, with_depth), lambda: Panel(job.device, size, with_depth))
    if job.draw.method == "n-pass-subres":
        _weave_small(job, stages, panel)
    else:
        _draw_panel_samples(job, under, over, panel)
    if job.device.reads:
        panel.read(target.color)


def _draw_panel_samples(job: Job, under: list[Stage], over: list[Stage], panel: Panel) -> None:
    """Fill a panel with the mean colours of all samples: what lies `under`, gathered, and what is drawn `over` it."""
    camera, size = job.draw.camera, panel.size
    samples = sample_positions(job.draw.options.samples)
    mean = job.kept.get("panel mean", size, lambda: Mean(job.device, size)) if samples[1:] else None
    if mean is not None:
        mean.clear()
    gather = _gather_channels if by_channels(job, under) else _gather_views
    for sample in samples:
        if under or not over:
            panel.clear()
            gather(job, under, panel, sample)
        else:
            panel.fill(stored_background(job.scene))
        for stage in over:
            job.write_frame(camera)
            stage.draw_panel(positioned(job, sample), panel)
        if mean is not None:
            mean.add(job, panel.color)
    if mean is not None:
        mean.write(job, panel.target)


def positioned(job: Job, sample: tuple[float, float]) -> Job:
    """The job for what is drawn by channels, told where in a pixel they are sampled."""
    own = job.draw.options.sampling == "subpixel"
    columns = tuple((c + sample[0]) / 3 if own else sample[0] for c in range(3))
    return replace(job, columns=columns, row=sample[1])


def _gather_views(job: Job, stages: list[Stage], panel: Panel, sample: tuple[float, float]) -> None:
    """Draw views and gather them; where sub-pixels are sampled at their own centres, a channel at a time."""
    x, y = sample
    own = job.draw.options.sampling == "subpixel"
    for column, channels in [((c + x) / 3, CHANNELS[c]) for c in range(3)] if own else [(x, ALL)]:
        job.write_frame(replace(job.draw.camera, shift=(0.5 - column, 0.5 - y)))
        for part in atlases(job):
            draw_tiles(part, stages, channels)
            panel.gather(part, channels)


def _gather_channels(job: Job, stages: list[Stage], panel: Panel, sample: tuple[float, float]) -> None:
    """Draw the sub-pixels of each channel into a tile of their own, and gather them."""
    place = positioned(job, sample)
    job.write_frame(job.draw.camera)
    tiles = 1 if place.one_depth else 3
    layout = Layout.fitting(tiles, panel.size, job.device.limits)
    atlas = job.kept.get("channels", layout, lambda: Atlas(job.device, layout))
    for first in range(0, tiles, layout.count):
        part = job.with_atlas(atlas, first, min(layout.count, tiles - first), (place.columns, place.row))
        atlas.clear(stored_background(job.scene))
        for stage in stages:
            stage.draw_channels(part)
        panel.gather(part)


def _weave_small(job: Job, stages: list[Stage], panel: Panel) -> None:
    """Small views, scaled up while they are woven (Hübner 2007a, section 2.3), as methods/n_pass_subres.py has it."""
    draw = job.draw
    own = draw.options.sampling == "subpixel"
    panel.clear()
    for camera, channels in (
        [(channel_camera(draw.camera, c), CHANNELS[c]) for c in range(3)] if own else [(draw.camera, ALL)]
    ):
        small = small_camera(replace(draw, camera=camera))
        for part in atlases(replace(job, draw=replace(draw, camera=small)), "small atlas"):
            _draw_samples(part, stages)
            layout = part.atlas.layout
            tiles = Tiles(layout.columns, small.width, small.height, *layout.size, 4)
            panel.weave(job, part.atlas.color, tiles, (part.first, part.count), channels)


def interlace(job: Job, views: NDArray[np.uint8], first: int) -> Panel:
    """Gather a panel of pictures (n, H, W, 3 or 4) of the views from `first` on."""
    count, height, width, channels = views.shape
    layout = Layout.fitting(count, (width, height), job.device.limits)
    atlas, panel = Atlas(job.device, layout), Panel(job.device, (width, height))
    panel.clear()
    for start in range(0, count, layout.count):
        held = views[start : start + layout.count]
        for picture, (x, y) in zip(held, layout.tiles, strict=False):
            rgba = np.full((height, width, 4), 255, np.uint8)
            rgba[..., :channels] = picture
            atlas.color.write(rgba, (int(x), int(y), width, height))
        panel.gather(job.with_atlas(atlas, first + start, len(held)))
    return panel
