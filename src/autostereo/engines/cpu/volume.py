"""Volumes on the cpu engine: which kernels draw them, over what is drawn already."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..engine import Camera, Draw
from ..volumes import Slices, make_slices
from .kernels import is_joined, is_woven
from .memory import Memory
from .mesh import panel_lines
from .mesh_panel import Panel
from .mesh_setup import camera_numbers
from .panel_lines import LinePlan
from .threads import run_rows
from .view_rows import map_args
from .volume_cut import (
    PreparedVolumes,
    is_shared,
    make_cut,
    new_planes,
    new_rays,
    pixel_of,
    samples_of,
    volume_groups,
)
from .volume_edges import draw_edges
from .volume_panel import PIXEL_ROWS, draw_panel_rays, draw_panel_rows
from .volume_plan import SLIDE, can_share, plan_bundles, share_slices, shared_reach
from .volume_rays import BLOCK_ROWS, RAYS, ROW
from .volume_sample import SLABS, Cut
from .volume_shared import LINE, SLAB_ROWS, SPAN, Shared
from .volume_views import Ways, draw_rows, draw_shared_rows, draw_woven_rows

SHARED_BLOCKS = 3  # of rays: sampled ones, what lies between, and those of it that are sampled, too
WIDEST_PAIR = 1.25  # voxels between sampled positions, up to which what lies between is interpolated
FINE_VIEWS = (1, 8, 3)  # positions of a shared slab: least and most per pixel, and per voxel between them


def draw_volume_views(
    prepared: PreparedVolumes,
    opaque: bool,
    draw: Draw,
    color: NDArray[np.uint8],
    depth: NDArray[np.float32],
    memory: Memory,
) -> None:
    """Draw isosurfaces (opaque), or all else, over color (V, H, W, 4); depth (V, H, W), if it has a size, ends rays."""
    camera, options = draw.camera, draw.options
    slices = make_slices(prepared.volumes, camera, options.step)
    if slices is None:
        return
    numbers = camera_numbers(camera)
    views, height, _, _ = color.shape
    wants_depth = depth.size > 0 and (opaque or options.depth)
    may_share = views > 1 and depth.size == 0 and can_share(camera, slices, draw.offsets)
    groups = volume_groups(prepared, opaque)
    apart = wants_depth and not opaque and len(groups) > 1  # what is translucent ends no rays
    ends = depth.copy() if apart else depth
    for group in groups:
        if may_share and is_shared(prepared, group, options):
            _draw_shared(prepared, group[0], draw, slices, color, memory)
            continue
        made = [make_cut(prepared, index, draw, slices, memory) for index in group]
        cuts, ways = tuple(cut for cut, _ in made), tuple(way for _, way in made)
        counts = [samples_of(prepared, index, camera, cut) for index, cut in zip(group, cuts, strict=True)]
        pool = memory.pool((("volume rays", *group), *counts, slices.slabs), partial(new_rays, counts, slices))
        nearest = ends.copy() if apart else depth

        def task(
            first: int, end: int, cuts: Any = cuts, ways: Any = ways, pool: Any = pool, nearest: Any = nearest
        ) -> None:
            with pool as (planes, rays, packed):
                args = (ways, draw.offsets, wants_depth, planes, rays, packed)
                draw_rows((first, end), cuts, numbers, slices, *args, color, nearest)

        run_rows(height, task)
        if apart:
            np.minimum(depth, nearest, out=depth)


def new_shared(camera: Camera, slices: Slices, offsets: NDArray[np.float64], fine: int, pixel: float) -> Shared:
    """One thread's memory for shared slabs that reach as far as the views see."""
    begin, count = shared_reach(camera, slices, offsets)
    paired = fine <= 2 and 2 * pixel / fine <= WIDEST_PAIR
    values = np.zeros(SLABS * fine * SLAB_ROWS * LINE, np.float32)
    shown = np.zeros((SLABS, (count + 2 * RAYS) // SPAN), np.uint8)  # more: what is drawn are whole SIMD steps
    places, parts = np.zeros((SLABS, 3), np.int64), np.zeros(SLABS, np.float32)
    front, back, picked = (np.zeros(ROW, np.int32) for _ in range(3))
    return Shared(begin, fine, paired, count, values, shown, places, parts, front, back, picked)


def edge_task(
    cut: Cut, ways: Ways, samples: int, draw: Draw, slices: Slices, color: NDArray[np.uint8], memory: Memory
) -> Callable[[int, int, NDArray[np.uint8]], None]:
    """A task (first row, end, what was there before) that draws edges of a volume in views color (V, H, W, 4) again."""
    views, _, width, _ = color.shape

    def make() -> Any:
        planes, rays, packed = new_rays([samples], slices)
        return planes, (rays, packed, np.zeros(width + 1, np.uint8), np.zeros(views * width + 1, np.int32))

    pool = memory.pool(("volume edges", samples, slices.slabs, views, width), make)
    numbers = camera_numbers(draw.camera)

    def task(first: int, end: int, behind: NDArray[np.uint8]) -> None:
        with pool as (planes, scratch):
            draw_edges((first, end), (cut,), numbers, slices, (ways,), draw.offsets, planes, scratch, behind, color)

    return task


def _draw_shared(
    prepared: PreparedVolumes, index: int, draw: Draw, slices: Slices, color: NDArray[np.uint8], memory: Memory
) -> None:
    """Draw volume `index` from slabs that all views share, over color (V, H, W, 4) or a panel color (H, W, 3)."""
    camera, offsets = draw.camera, draw.offsets
    numbers, slices = camera_numbers(camera), share_slices(slices, camera, offsets, SLIDE[0])
    cut, ways = make_cut(prepared, index, draw, slices, memory)
    samples = samples_of(prepared, index, camera, cut)
    pixel = pixel_of(cut, camera, slices)
    fine = int(np.clip(np.ceil(FINE_VIEWS[2] * pixel), FINE_VIEWS[0], FINE_VIEWS[1]))
    if draw.viewmap is not None:
        fine = 1  # as where sub-pixels are looked up: of each view a panel shows a few
    groups = plan_bundles(camera, slices, offsets, fine, pixel)
    key = (
        "volume shared",
        fine,
        pixel,
        samples,
        slices,
        camera.width,
        camera.fx,
        camera.focal,
        offsets.tobytes(),
    )
    pool = memory.pool(
        key,
        lambda: (
            new_planes(samples, slices),
            tuple(new_shared(camera, slices, offsets, fine, pixel) for _ in range(2)),
            np.zeros(SHARED_BLOCKS * BLOCK_ROWS * ROW, np.float32),
            np.zeros(ROW, np.int32),
            np.zeros(len(offsets) * SLAB_ROWS * LINE, np.float32),
            (np.zeros((camera.width, 3), np.float64), np.zeros(3 * camera.width, np.int32)),
        ),
    )

    edges = None
    if draw.viewmap is None and prepared.is_sharp(index):
        edges = edge_task(cut, ways, samples, draw, slices, color, memory)

    def task(first: int, end: int) -> None:
        with pool as (planes, slabs, rays, packed, line, scratch):
            args = (cut, numbers, slices, ways, offsets, groups, planes, slabs, rays, packed, line)
            if draw.viewmap is None:
                behind = None if edges is None else color[:, first:end].copy()
                draw_shared_rows((first, end), *args, color)
                if edges is not None and behind is not None:
                    edges(first, end, behind)
            else:
                weave = (map_args(draw.viewmap), draw.flip_x, draw.flip_y, *scratch)
                draw_woven_rows((first, end), *args, weave, color)

    run_rows(camera.height, task)


def draw_volume_panel(
    prepared: PreparedVolumes,
    opaque: bool,
    draw: Draw,
    color: NDArray[np.uint8],
    depth: NDArray[np.float32],
    memory: Memory,
) -> None:
    """Draw isosurfaces (opaque), or all else, over a panel color (H, W, 3); depth (H, W, 3) likewise."""
    camera, options = draw.camera, draw.options
    slices = make_slices(prepared.volumes, camera, options.step)
    if slices is None:
        return
    assert draw.viewmap is not None
    plan = panel_lines(draw, memory)
    panel = Panel(plan, draw.flip_x, draw.flip_y, options.sampling == "subpixel")
    joined = is_joined(draw.viewmap, options)
    averaged = options.alpha == "averaged" and not joined
    numbers = camera_numbers(camera)
    may_share = not joined and depth.size == 0 and can_share(camera, slices, np.array([plan.low, plan.high]))
    reach = np.array([plan.low, plan.high])
    woven = is_woven(draw.viewmap, options)
    for group in volume_groups(prepared, opaque):
        shared = may_share and is_shared(prepared, group, options)
        shared = shared and not prepared.is_sharp(group[0])
        if shared and woven:
            _draw_shared(prepared, group[0], draw, slices, color, memory)
            continue
        own = share_slices(slices, camera, reach, SLIDE[1]) if shared else slices
        made = [make_cut(prepared, index, draw, own, memory) for index in group]
        cuts, ways = tuple(cut for cut, _ in made), tuple(way for _, way in made)
        counts = [samples_of(prepared, index, camera, cut) for index, cut in zip(group, cuts, strict=True)]
        pixel = pixel_of(cuts[0], camera, own)
        pool = _panel_pool(group, counts, draw, own, pixel, plan if shared else None, memory)

        def task(
            first: int, end: int, cuts: Any = cuts, ways: Any = ways, pool: Any = pool, own: Slices | None = own,
            shared: bool = shared,
        ) -> None:  # fmt: skip
            with pool as (planes, slabs, scratch):
                rows: Any = (first, end)
                if shared:
                    one = (rows, cuts[0], numbers, own, ways[0])
                    draw_panel_rows(*one, panel, averaged, planes[0], slabs, scratch, color)
                else:
                    all_of = (rows, cuts, numbers, own, ways, panel, averaged, joined, opaque and depth.size > 0)
                    draw_panel_rays(*all_of, planes, scratch, color, depth)

        run_rows(camera.height, task)


def _panel_pool(
    group: list[int],
    counts: list[int],
    draw: Draw,
    slices: Slices,
    pixel: float,
    plan: LinePlan | None,
    memory: Memory,
) -> Any:
    """Threads' memory for a panel; counts: samples of each volume's planes; plan: for shared slabs."""
    camera, width = draw.camera, draw.camera.width
    reach = np.zeros(0) if plan is None else np.array([plan.low, plan.high])

    def make() -> Any:
        scratch = (
            np.zeros(3 * width, np.float32),
            np.zeros(width, np.float64),
            np.zeros(SHARED_BLOCKS * BLOCK_ROWS * ROW, np.float32),
            np.zeros(ROW, np.int32),
            np.zeros(0 if plan is None else PIXEL_ROWS * ROW * 3 * -(-width // RAYS), np.float32),
        )
        slabs = None if plan is None else new_shared(camera, slices, reach, 1, pixel)
        return tuple(new_planes(n, slices) for n in counts), slabs, scratch

    key = (("volume panel", *group), *counts, width, slices, pixel, camera.fx, camera.focal, reach.tobytes())
    return memory.pool(key, make)
