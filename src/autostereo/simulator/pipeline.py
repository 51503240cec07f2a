"""One pass of the simulated machine over a scene: its buffers and caches, and the stages that draws go through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..display.rig import Rig
from .kernels import raster, shading, state
from .kernels.buffers import COLOR, DEPTH, NONE, WRITTEN, Buffer, flush
from .kernels.geometry import View
from .kernels.lru import make_lru
from .kernels.shading import Target, Work
from .kernels.state import Fragments, Plan, Scratch
from .machine import BufferCache, Machine
from .textures import TextureStore
from .workload import BLENDS, SHADERS, Draw, Workload, attributes_in_eye_space, lights_in_eye_space

MIN_FRAGMENTS = 1 << 16  # of the list between rasteriser and shading: what fits the processor's caches
ACCUMULATION_BYTES = 8  # a pixel of the common colour buffer: 1/256 of a colour is less than a level of 8 bits


def make_view(rig: Rig, size: tuple[int, int]) -> View:
    """The cameras of a rig for pictures of `size` (DESIGN section 1)."""
    width, height = size
    half = np.tan(np.deg2rad(rig.fov_y) / 2)
    fy = float(height / 2 / half)
    fx = float(width / 2 / ((rig.aspect or width / height) * half))
    offsets = rig.camera_offsets
    a = (np.arange(width) + 0.5 - width / 2) / fx - offsets[:, None] / rig.focal
    b = (height / 2 - (np.arange(height) + 0.5)) / fy - rig.offset_y / rig.focal
    return View(width, height, fx, fy, rig.focal, rig.near_depth, rig.offset_y, offsets, a, b)


@lru_cache(maxsize=4)
def _store(textures: tuple[Any, ...], line_bytes: int, compressed: bool) -> TextureStore:
    return TextureStore.of(textures, line_bytes, compressed)


def prepare_textures(workload: Workload, machine: Machine) -> TextureStore:
    """The textures in the machine's memory, made once for all frames that share them."""
    return _store(workload.textures, machine.texture.line_bytes, machine.texture.compression == "bc1")


@dataclass(frozen=True)
class Setting:
    """How a pass writes: `depth_test` of `kernels.raster`, whether colours are made, and the weight of accumulated
    ones."""

    depth_test: int = state.LESS
    color: bool = True
    weight: float = 0.0  # 0: each view has its own colour buffer


class Pass:
    """The state of the machine while it draws views first … last − 1.

    Parameters
    ----------
    workload, machine : Workload, Machine
    rig : Rig
    view : View
        All views of the rig.
    span : (int, int)
        The views of this pass; caches are those of a machine for so many.
    colors, total, maps : ndarrays
        Pictures (V, H, W) uint32, the common colour buffer (H, W, 4) float32 or empty, and per-pixel maps or empty.
    """

    def __init__(
        self, workload: Workload, machine: Machine, rig: Rig, view: View, span: tuple[int, int], pictures: Pictures
    ) -> None:
        self.workload, self.machine, self.view, self.span = workload, machine, view, span
        views, count = len(view.offsets), span[1] - span[0]
        shape = (views, view.height, view.width)
        self.eye_from_world = rig.eye_from_world
        texture = machine.texture
        self.memory = prepare_textures(workload, machine).memory(texture.slots(count), texture.ways)
        self.depth = _buffer(machine.depth, np.zeros(shape, np.uint32), count, DEPTH, 4)
        accumulates = len(pictures.total) > 0
        self.color = _buffer(
            machine.color, pictures.colors, count, NONE if accumulates else COLOR, ACCUMULATION_BYTES if accumulates
            else 4
        )
        capacity = max(MIN_FRAGMENTS, view.width * machine.traversal.tile[1] * count)
        self.fragments = _fragments(capacity, views)
        self.target = Target(
            self.color, self.depth, pictures.total, np.zeros((capacity, 4), np.float32), np.zeros(capacity),
            np.zeros(views, np.int64), pictures.how, pictures.misses,
        )  # fmt: skip
        self.plan = _plan(machine, span, views)
        # the copy of the colour buffer's cache that runs ahead, where approximations are taken from it
        shadow = make_lru(len(self.color.stored), len(self.color.dirty))
        self.shadow = self.color._replace(cache=shadow)
        self.scratch = _scratch(self.plan, view, len(self.color.stored))
        self._eye_space: dict[int, tuple[NDArray[np.float64], NDArray[np.float64]]] = {}

    def draw_all(self, setting: Setting) -> None:
        """Every draw of the workload; by-view machines go over all of them for each view."""
        first, last = self.span
        if self.machine.traversal.order == "by-view":
            for v in range(first, last):
                self._draw_views(self.plan._replace(first=v, last=v + 1), setting)
        else:
            self._draw_views(self.plan, setting)

    def draw_twice(self, settings: tuple[Setting, Setting]) -> None:
        """Two settings after each other, for each view where the machine draws view by view."""
        first, last = self.span
        by_view = self.machine.traversal.order == "by-view"
        for v in range(first, last) if by_view else [first]:
            plan = self.plan._replace(first=v, last=v + 1) if by_view else self.plan
            for setting in settings:
                self._draw_views(plan, setting)

    def finish(self) -> None:
        """Write the caches back."""
        flush(self.depth)
        flush(self.color)

    def _draw_views(self, plan: Plan, setting: Setting) -> None:
        for draw in self.workload.draws:
            late = draw.depth_output
            changed = plan._replace(
                depth_test=setting.depth_test, depth_write=draw.depth_write and setting.depth_test == state.LESS,
                late=late, z_max=plan.z_max and not late, z_min=plan.z_min and not late,
                # the colour buffer has no depths to interpolate
                approximate=plan.approximate and draw.approximate and not (late and plan.from_buffer),
                from_buffer=plan.from_buffer and not late,
            )  # fmt: skip
            self._draw(draw, changed, setting)
            if plan.from_buffer and late:  # what went through the colour buffer's cache was not known ahead
                for mine, real in zip(self.shadow.cache, self.color.cache, strict=True):
                    mine[:] = real

    def _draw(self, draw: Draw, plan: Plan, setting: Setting) -> None:
        work, shade = self._work(draw, plan, setting)
        cursor = self.fragments.cursor
        cursor[:] = 0, 0, 0, 0, cursor[state.BASE]
        done = False
        while not done:
            done = raster.rasterize(
                work.corners, draw.facing, self.view, plan, self.depth, self.shadow, self.fragments, self.scratch
            )
            if (setting.color or plan.late) and cursor[state.COUNT]:
                shade(self.fragments, work, self.view, self.memory, self.target)
            cursor[state.BASE] += cursor[state.COUNT]
            cursor[state.COUNT] = 0

    def _work(self, draw: Draw, plan: Plan, setting: Setting) -> tuple[Work, Callable[..., Any]]:
        key = id(draw)
        if key not in self._eye_space:
            corners = draw.corners @ self.eye_from_world[:3, :3].T + self.eye_from_world[:3, 3]
            self._eye_space[key] = corners, attributes_in_eye_space(draw, self.eye_from_world)
        corners, attributes = self._eye_space[key]
        uniforms = np.array(draw.uniforms, np.float64)
        number, derivatives, shade = 0, attributes.shape[2], shading.shade_fragments
        if isinstance(draw.shader, str):
            number, derivatives = SHADERS[draw.shader]
            if draw.shader == "surface":
                uniforms = np.concatenate([uniforms, lights_in_eye_space(self.workload.lights, self.eye_from_world)])
            elif draw.shader == "shadows":
                uniforms = np.concatenate([self.eye_from_world[:3, :3] @ uniforms[:3], uniforms[3:]])
            elif draw.shader == "ocean":
                uniforms = np.concatenate([uniforms[:2], self.eye_from_world[:3, :3].T.ravel()])
        else:
            shade = _own_shader(draw.shader)
            derivatives = derivatives if draw.derivatives is None else draw.derivatives
        options = self.machine.shading
        blend = shading.ACCUMULATE if setting.weight else BLENDS.index(draw.blend)
        from_buffer = options.approximate and options.source == "color-buffer"
        units = np.array(draw.textures, np.int64)
        work = Work(
            corners, attributes, derivatives, draw.mirrored, number, uniforms, units, blend, float(setting.weight),
            options.unified_camera, from_buffer, plan.late, plan.depth_test == state.EQUAL, plan.depth_write,
            setting.color, np.zeros((3, attributes.shape[2])), np.zeros((5, 5)), np.zeros((3, 3)),
        )  # fmt: skip
        return work, shade


@dataclass(frozen=True, eq=False)
class Pictures:
    """What a frame leaves: see `Pass`."""

    colors: NDArray[np.uint32]
    total: NDArray[np.float32]
    how: NDArray[np.uint8]
    misses: NDArray[np.int32]

    @staticmethod
    def empty(shape: tuple[int, int, int], background: tuple[float, float, float], maps: bool) -> Pictures:
        """Cleared pictures (V, H, W) of views."""
        red, green, blue = (int(np.floor(255 * value + 0.5)) for value in background)
        colors = np.full(shape, red | green << 8 | blue << 16, np.uint32)
        none = (0, 0, 0)
        return Pictures(
            colors, np.zeros(none, np.float32),
            np.zeros(shape if maps else none, np.uint8), np.zeros(shape if maps else none, np.int32),
        )  # fmt: skip

    @staticmethod
    def common(size: tuple[int, int], background: tuple[float, float, float]) -> Pictures:
        """A common colour buffer for all views (section 4.4)."""
        width, height = size
        pictures = Pictures.empty((1, height, width), background, False)
        return replace(pictures, total=np.zeros((height, width, 4), np.float32))


@lru_cache(maxsize=16)
def _own_shader(function: Callable[..., Any]) -> Callable[..., Any]:
    return shading.shading_with(function)


def _buffer(part: BufferCache, values: NDArray[np.uint32], views: int, codec: int, pixel_bytes: int) -> Buffer:
    count, height, width = values.shape
    (w, h), slots = part.block, part.blocks(views, pixel_bytes)
    across, down = -(-width // w), -(-height // h)
    blocks, raw = count * across * down, w * h * pixel_bytes
    counts = np.zeros(6, np.int64)
    stored = np.zeros(blocks, np.int32)
    if not part.fast_clear:  # clearing is writing
        stored[:] = raw
        counts[WRITTEN] = views * across * down * raw
    return Buffer(
        values, w, h, across, down, pixel_bytes, codec if part.compression else NONE, make_lru(blocks, slots), stored,
        np.zeros(slots, np.uint64), np.zeros(slots, np.bool_), np.zeros(slots, np.bool_),
        np.zeros(blocks, np.uint32), np.zeros(blocks, np.uint32), counts, np.zeros((4, h, w), np.int64),
    )  # fmt: skip


def _fragments(capacity: int, views: int) -> Fragments:
    whole = partial(np.zeros, capacity, np.int32)
    taps = capacity * state.MAX_TAPS
    return Fragments(
        whole(), whole(), whole(), whole(), whole(), whole(), np.zeros(taps, np.int32),
        np.zeros(taps, np.float32), np.zeros(5, np.int64), np.zeros((views, 3), np.int64), np.zeros(4, np.int64),
    )  # fmt: skip


def _plan(machine: Machine, span: tuple[int, int], views: int) -> Plan:
    options, traversal = machine.shading, machine.traversal
    measures = {"axis": state.AXIS, "dot": state.DOT, "axis-unsigned": state.UNSIGNED}
    order = measures[traversal.measure] if traversal.order == "sorted" else state.IN_TURN
    first, last = span
    sets = min(options.sets, last - first)
    group = np.zeros(views, np.int64)
    group[first:last] = np.arange(last - first) * sets // (last - first)
    exact = np.full(sets, -1, np.int64)
    if options.exact == "middle":
        members = [np.nonzero(group[first:last] == g)[0] + first for g in range(sets)]
        exact[:] = [(m[0] + m[-1]) // 2 for m in members]
    return Plan(
        *traversal.tile, order, first, last, machine.depth.z_max, machine.depth.z_min, state.LESS, True, False,
        options.approximate, group, exact, options.tiles, options.filter == "tent",
        options.single_neighbour == "use", options.approximate and options.source == "color-buffer",
    )  # fmt: skip


def _scratch(plan: Plan, view: View, blocks: int) -> Scratch:
    views, groups = len(view.offsets), len(plan.exact)
    tiles = -(-view.width // plan.tile_w)
    return Scratch(
        np.zeros((views, 3, 3)), np.zeros(views), np.zeros(views),
        np.zeros(views, np.int64), np.zeros(views, np.int64), np.zeros(views, np.int64),
        np.zeros(groups, np.int64), np.full((groups, plan.tile_h, view.width), -1, np.int32),
        np.full((groups, tiles), -1, np.int64), np.zeros(groups, np.int64), np.zeros((4, 3)),
        np.zeros(blocks if plan.from_buffer else 1, np.int64),
    )  # fmt: skip
