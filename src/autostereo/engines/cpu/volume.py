"""Volumes on the cpu engine: from prepared fields to kernels, over what is drawn already."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.scene import Scene
from ...scene.transfer import TransferFunction
from ...scene.volume import Volume
from ..engine import Camera, Draw
from ..options import Options
from ..volumes import Slices, half_spaces, make_slices
from .gather import map_args
from .kernels import is_joined, is_woven
from .memory import Memory
from .mesh import panel_lines
from .mesh_panel import Panel
from .mesh_setup import camera_numbers
from .panel_lines import LinePlan
from .scene_arrays import light_array
from .threads import run_rows
from .volume_modes import LEVELS
from .volume_panel import PIXEL_ROWS, draw_panel_rays, draw_panel_rows
from .volume_plan import SLIDE, can_share, plan_bundles, share_slices, shared_reach
from .volume_rays import BLOCK_ROWS, RAYS, ROW
from .volume_sample import CHUNK, LIST, LIST_ROWS, SLABS, Cut, Planes
from .volume_setup import (
    BLOCK,
    TABLE,
    Field,
    make_plain,
    make_table,
    prepare_field,
    shown_blocks,
)
from .volume_shared import LINE, SLAB_ROWS, SPAN, Shared
from .volume_views import ISO, MIP, Ways, draw_rows, draw_shared_rows, draw_woven_rows

MODES = ("composite", "mip", "iso")  # in the order of volume_views
RUN_STEP = 0.5  # voxels, a sixteenth of a run
SHARED_BLOCKS = 3  # of rays: sampled ones, what lies between, and those of it that are sampled, too
WIDEST_PAIR = 1.25  # voxels between sampled positions, up to which what lies between is interpolated
FINE_VIEWS = (1, 8, 3)  # positions of a shared slab: least and most per pixel, and per voxel between them


@dataclass(frozen=True, eq=False)
class PreparedVolumes:
    """The volumes of a scene, ready to be drawn."""

    scene: Scene
    fields: list[Field]

    @property
    def volumes(self) -> list[Volume]:
        """The volumes themselves."""
        return [f.volume for f in self.fields]


def prepare_volumes(scene: Scene, volumes: list[Volume]) -> PreparedVolumes:
    """Prepare all volumes of a scene, of one type if they are several."""
    return PreparedVolumes(scene, [prepare_field(volume, len(volumes) > 1) for volume in volumes])


def update_volumes(prepared: PreparedVolumes, scene: Scene, volumes: list[Volume]) -> PreparedVolumes:
    """The same volumes under other transforms and transfer functions: scalars and gradients stay as they are."""
    pairs = zip(prepared.fields, volumes, strict=True)
    return PreparedVolumes(scene, [field._replace(volume=volume) for field, volume in pairs])


def table_range(volume: Volume) -> tuple[float, float]:
    """Scalars between which a volume is classified; beyond the ends of a transfer function nothing changes."""
    low, high = volume.value_range
    points = volume.transfer.points[:, 0]
    if volume.mode != "composite":
        return low, high
    margin = 0.5 * float(points[-1] - points[0])  # for slabs that lead beyond an end
    first, last = max(low, float(points[0]) - margin), min(high, float(points[-1]) + margin)
    return (first, last) if first < last else (low, high)


def gradient_turn(camera: Camera, volume: Volume) -> NDArray[np.float32]:
    """Matrix (3, 3) that turns gradients from object to eye space, of about length 1."""
    turn = camera.eye_from_world[:3, :3] @ np.linalg.inv(volume.transform[:3, :3]).T
    return (turn / np.abs(turn).max()).astype(np.float32)


def tables(transfer: TransferFunction, low: float, high: float, length: float) -> tuple[NDArray[Any], NDArray[Any]]:
    """Slabs of a length (make_table), and between which of them the transfer function is plain (make_plain)."""
    table = make_table(transfer, low, high, length)
    return table, make_plain(table)


def make_cut(prepared: PreparedVolumes, index: int, draw: Draw, slices: Slices, memory: Memory) -> tuple[Cut, Ways]:
    """How volume `index` is cut, lit and classified in this frame."""
    f, camera = prepared.fields[index], draw.camera
    volume = f.volume
    index_from_eye = np.linalg.inv(camera.eye_from_world @ volume.world_from_index)
    along = float(np.abs(index_from_eye[:3, 0]).max())  # voxels per unit of X
    step = RUN_STEP / along
    x = (camera.eye_from_world @ np.column_stack([volume.corners, np.ones(8)]).T)[0]
    first = float(x.min()) - 2.0 * step
    reach = int(np.ceil((8 * step * along + 1 + slices.distance * np.abs(index_from_eye[:3, 2]).max()) / (1 << BLOCK)))
    shown = memory.remember(("shown", index), (reach, volume), lambda: shown_blocks(f, reach))
    low, high = table_range(volume)
    table, plain = memory.remember(
        ("table", index),
        (volume, slices.distance),
        lambda: tables(volume.transfer, low, high, slices.distance),
    )
    low, high = (low - f.first_value) / f.value_step, (high - f.first_value) / f.value_step
    lights, m = light_array(prepared.scene, camera), volume.material
    channels, light_colors = 0, 0
    if f.grid.words.size:
        light_colors = 3 if np.ptp(lights[:, 4:7], axis=1).any() else 1
        channels = light_colors * (2 if m.specular > 0 else 1)
    cut = Cut(
        f.grid.scalars,
        f.grid.words,
        f.grid.shape,
        np.ascontiguousarray(index_from_eye[:3]),
        half_spaces(volume),
        shown,
        first,
        step,
        low,
        (TABLE - 1.0) / (high - low if high > low else 1.0),
        gradient_turn(camera, volume),
        lights,
        channels,
        light_colors,
        (1.0 - m.ambient) / max(m.diffuse, 1e-6),
        float(m.shininess),
        camera.offset_y,
        volume.gradient == "sobel",
    )
    mode = MODES.index(volume.mode)
    colors, level = np.zeros((1, 4), np.float32), 0.0
    if mode == MIP:
        colors = volume.transfer.evaluate(np.linspace(*volume.value_range, LEVELS)).astype(np.float32)
        colors[:, 3] /= max(volume.transfer.max_opacity, 1e-30)
    elif mode == ISO:
        assert volume.iso is not None
        colors[0] = volume.transfer.evaluate(volume.iso)
        level = ((volume.iso - f.first_value) / f.value_step - low) * cut.scale
    own_eyes = draw.options.shading != "center" and (mode == ISO or draw.options.volume == "exact")
    light = (channels, light_colors)
    return cut, Ways(
        mode,
        table,
        plain,
        (m.ambient, m.diffuse, m.specular),
        light,
        np.ascontiguousarray(colors),
        level,
        volume.shade,
        own_eyes,
    )


def samples_of(prepared: PreparedVolumes, index: int, camera: Camera, cut: Cut) -> int:
    """Steps across a slice, in whole runs."""
    x = (camera.eye_from_world @ np.column_stack([prepared.fields[index].volume.corners, np.ones(8)]).T)[0]
    return (int((float(x.max()) - cut.first) / cut.step) + 4 + (1 << CHUNK)) >> CHUNK << CHUNK


def new_planes(samples: int, slices: Slices) -> Planes:
    """One thread's memory for slices."""
    runs = samples >> CHUNK
    return Planes(
        np.zeros((slices.slabs + 1, runs), np.uint8),
        np.zeros(runs, np.uint8),
        np.zeros(LIST, np.int32),
        np.zeros(LIST, np.int64),
        np.zeros(8 * LIST, np.int32),
        np.zeros(LIST_ROWS * LIST, np.float32),
    )


def volume_groups(prepared: PreparedVolumes, opaque: bool) -> list[list[int]]:
    """Which volumes are drawn together: each isosurface, or all that compose and each of the greatest values."""
    modes = [v.mode for v in prepared.volumes]
    if opaque:
        return [[k] for k, mode in enumerate(modes) if mode == "iso"]
    composite = [k for k, mode in enumerate(modes) if mode == "composite"]
    return ([composite] if composite else []) + [[k] for k, mode in enumerate(modes) if mode == "mip"]


def new_rays(counts: list[int], slices: Slices) -> tuple[Any, ...]:
    """One thread's memory for rays of their own: planes of each volume, a block of rays."""
    planes = tuple(new_planes(n, slices) for n in counts)
    return planes, np.zeros(BLOCK_ROWS * ROW, np.float32), np.zeros(ROW, np.int32)


def is_shared(prepared: PreparedVolumes, group: list[int], options: Options) -> bool:
    """Whether the slabs of a group are shared by all views: one volume that composes, if the options allow."""
    alone = len(group) == 1 and prepared.volumes[group[0]].mode == "composite"
    return alone and options.volume == "shared"


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


def pixel_of(cut: Cut, camera: Camera, slices: Slices) -> float:
    """Width of the nearest pixel, in voxels."""
    return float(slices.first / camera.fx * np.abs(cut.from_eye[:, 0]).max())


def new_shared(camera: Camera, slices: Slices, offsets: NDArray[np.float64], fine: int, pixel: float) -> Shared:
    """One thread's memory for shared slabs that reach as far as the views see."""
    begin, count = shared_reach(camera, slices, offsets)
    paired = fine <= 2 and 2 * pixel / fine <= WIDEST_PAIR
    values = np.zeros(SLABS * fine * SLAB_ROWS * LINE, np.float32)
    shown = np.zeros((SLABS, (count + 2 * RAYS) // SPAN), np.uint8)  # more: what is drawn are whole SIMD steps
    places, parts = np.zeros((SLABS, 3), np.int64), np.zeros(SLABS, np.float32)
    front, back, picked = (np.zeros(ROW, np.int32) for _ in range(3))
    return Shared(begin, fine, paired, count, values, shown, places, parts, front, back, picked)


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

    def task(first: int, end: int) -> None:
        with pool as (planes, slabs, rays, packed, line, scratch):
            args = (cut, numbers, slices, ways, offsets, groups, planes, slabs, rays, packed, line)
            if draw.viewmap is None:
                draw_shared_rows((first, end), *args, color)
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
