"""Meshes by the plane rasteriser: parallel multi-view polygon rasterisation in compute shaders (PMR 2020).

A triangle is set up once for all views and rasterised in the space of column, row and view:

    vertices → setup → tiles → fine rasteriser, twice → pixel encoding

`setup` clips, snaps, culls; `tiles` finds the blocks of 4×4 pixels × 4 views that a triangle covers; the fine one
leaves in every voxel the least depth, then the first triangle of that depth; `encode` shades what is seen and writes it
to tiles of views, or to a panel (lib/plane_triangle.glsl, lib/plane_tile.glsl, plane_*.comp).
For a panel, depths and winners are kept per sub-pixel: each shows one camera, and no other voxel is looked at.

Nothing is read back in between: dispatches take their size from the counts of the stage before. A tile that finds no
room in the queue is rasterised where it was found; for the next frame the queue is made larger, or the scene cut into
pieces. Pictures that are too large for a buffer are drawn in rounds of some rows.

METHODS are variants: one pass; the same pipeline run with one view after the other; planes as the paper prints them,
for comparison; triangles that begin with different views of a tile, or channels of a panel's, so that those which
cover it at one time do not change the same samples (section 4.3; lib/plane_order.glsl).
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import UnsupportedError
from ...scene.mesh import Mesh
from .context import COMPUTE_VERSION
from .job import CLEARLY, Job
from .mesh import Meshes, set_material, switches
from .panel import NOTHING, Panel, write_only
from .plane_buffers import (
    BLOCK_VIEWS,
    MAX_BLOCKS,
    MAX_SIDE,
    PANEL_BLOCKS,
    TRIANGLE_TEXELS,
    Corners,
    Memory,
    Piece,
    Queue,
    Round,
    Voxels,
    chunks,
    rounds,
    upload_blocks,
)
from .programs import Defines, put

ONE_VIEW = "plane-rasterizer-n-pass"
METHODS = ("plane-rasterizer", ONE_VIEW, "plane-rasterizer-planar", "plane-rasterizer-staggered")
# SHADER_STORAGE, SHADER_IMAGE_ACCESS, COMMAND, BUFFER_UPDATE, TEXTURE_UPDATE; TEXTURE_FETCH, FRAMEBUFFER for pictures
BARRIERS = 0x2000 | 0x20 | 0x40 | 0x200 | 0x100 | 0x8 | 0x400
GROUP = 64  # invocations of a work group
CHANNELS = 3
GROUPS = 65535  # work groups in one direction, as many as every device has
# seconds of a CPU, measured on llvmpipe: a triangle, a tile that is looked at for it, a sample of the picture
PLANE_TRIANGLE, PLANE_TILE, PLANE_SAMPLE = 0.1e-6, 50e-9, 85e-9
STAGES = ("clear", "vertices", "setup", "tiles", "depth", "winner", "encode")

_clock: dict[str, float] | None = None


@contextmanager
def stage_times() -> Iterator[dict[str, float]]:
    """Seconds that each of STAGES takes in what is drawn meanwhile; every stage then waits for the one before."""
    global _clock
    before, _clock = _clock, dict.fromkeys(STAGES, 0.0)
    try:
        yield _clock
    finally:
        _clock = before


@contextmanager
def _stage(job: Job, name: str) -> Iterator[None]:
    """Clock a stage, if asked for, and let the next one see what it wrote."""
    if _clock is None:
        yield
    else:
        job.device.ctx.finish()
        start = time.perf_counter()
        yield
        job.device.ctx.finish()
        _clock[name] += time.perf_counter() - start
    job.device.ctx.memory_barrier(BARRIERS)


@dataclass(frozen=True)
class Pass:
    """Blocks of views that one pass draws: the first, how many, and the camera offsets that they reach."""

    first: int
    count: int
    reach: tuple[float, float]


class PlaneMeshes(Meshes):
    """The meshes of a scene, also by the methods here; a stage (engine.py)."""

    def draws_over(self, job: Job) -> bool:
        """On panels by the methods here, which draw nothing but meshes: their sub-pixels need no tiles."""
        return job.draw.method in METHODS or self._is_fastest(job)

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of these tiles."""
        if job.draw.method in METHODS or (job.mask is None and self._is_fastest(job)):
            Drawing(job, self._parts).views()
        else:
            super().draw_views(job, tiles)

    def _is_fastest(self, job: Job) -> bool:
        """Whether a single pass is expected to be clearly faster this way: many triangles in many views."""
        draw, camera = job.draw, job.draw.camera
        able = job.device.version >= COMPUTE_VERSION and max(camera.width, camera.height) <= MAX_SIDE
        if draw.method != "single-pass" or not able or any(type(item) is not Mesh for item in job.scene.objects):
            return False
        place = camera.eye_from_world.tobytes(), draw.offsets.tobytes(), draw.culling, draw.viewmap
        lens = camera.fx, camera.fy, camera.width, camera.height, camera.focal, camera.near
        return bool(job.kept.get("plane is fastest", (place, lens), lambda: self._cost(job) < self._least_other(job)))

    def _least_other(self, job: Job) -> float:
        """Seconds that any other way is expected to take, less a margin."""
        draw = job.draw
        views, channels = self.costs(job)
        views += job.views_cost
        if draw.viewmap is None:
            return CLEARLY * views
        return CLEARLY * (channels if draw.viewmap.continuous else min(views, channels))

    def _cost(self, job: Job) -> float:
        """Expected seconds of a CPU, from the sizes of some triangles' boxes in each block of views."""
        camera, views = job.draw.camera, len(job.draw.offsets)
        on_panel = job.draw.viewmap is not None
        blocks = -(-views // views_of_a_block(job))
        width, height, slide = self.sizes(job)
        across = np.minimum(width + slide / blocks, camera.width) / 4 + 1
        tiles = float(np.mean(across * (np.minimum(height, camera.height) / 4 + 1) * np.minimum(height, 1)))
        samples = (3 if on_panel else views) * camera.width * camera.height
        return self.triangles * (PLANE_TRIANGLE + PLANE_TILE * blocks * tiles) + PLANE_SAMPLE * samples

    def draw_panel(self, job: Job, panel: Panel) -> None:
        """Draw the sub-pixels of a panel."""
        Drawing(job, self._parts).panel(panel)


class Drawing:
    """One draw of meshes into the tiles of the job's atlas, or into a panel."""

    def __init__(self, job: Job, parts: list[Any]) -> None:
        job.device.require(COMPUTE_VERSION, f"method {job.draw.method!r}", "method 'n-pass' or engine='cpu'")
        check_size(job)
        self.job, self.parts = job, parts
        kept, device = job.kept, job.device
        self.numbers = np.cumsum([0, *(part.triangles for part in parts)])
        self.queue = kept.get("plane queue", None, lambda: Queue(device))
        self.queue.grow(int(self.numbers[-1]))
        self.chunks = chunks(parts, self.queue.most)
        self.room = room = 2 * max(sum(piece[2] for piece in chunk) for chunk in self.chunks)
        self.triangles = kept.get("plane triangles", room, lambda: Memory(device, TRIANGLE_TEXELS * room, 4, "u4"))
        self.corners = kept.get("plane corners", tuple(parts), self._send_corners)
        self.one_view = job.draw.method == ONE_VIEW
        self.on_panel = job.columns is not None
        self.size = views_of_a_block(job)
        self.blocks, self.block_texture = upload_blocks(job, self.size)
        self.sample_at = (*(job.columns or (0.5, 0.5, 0.5)), job.row)
        self.views_in_all = len(job.draw.offsets) if self.on_panel else job.count

    def _send_corners(self) -> list[Corners]:
        result = []
        for part in self.parts:
            corners = Corners(self.job.device, part)
            corners.triangles.bind(1)
            self.job.device.bind_storage(part.indices, 1)
            program = self.job.program("plane_corners.comp", version=COMPUTE_VERSION)
            put(program, count=part.triangles)
            _run(program, part.triangles)
            result.append(corners)
        self.job.device.ctx.memory_barrier(BARRIERS)
        return result

    def views(self) -> None:
        """Draw all views of the atlas."""
        layout, atlas = self.job.atlas.layout, self.job.atlas
        for views in self._passes():
            tiles = range(views.first * self.size, min((views.first + views.count) * self.size, self.job.count))
            for part in rounds((layout.width, layout.height), len(tiles), 0):
                self._clear(part)
                self._raster(part, views)
                self._encode(part, tiles.start, atlas.color)
                if self.job.draw.options.depth:
                    self._write_depths(part, tiles)

    def panel(self, panel: Panel) -> None:
        """Draw the sub-pixels of a panel."""
        for part in rounds(panel.size, CHANNELS, len(self.blocks)):
            self._clear(part)
            self._show(part)
            for views in self._passes():
                self._raster(part, views)
            self._encode(part, 0, panel.color)

    def _passes(self) -> Iterator[Pass]:
        bands = -(-self.job.draw.camera.height // 16)  # of large triangles: a dispatch's z is block and band
        step = 1 if self.one_view else min(MAX_BLOCKS, GROUPS // bands)
        for first in range(0, len(self.blocks), step):
            some = self.blocks[first : first + step, 4:6]
            yield Pass(first, len(some), (float(some[0, 0]), float(some[-1, 1])))

    # --- stages ----------------------------------------------------------------------------------------------

    def _clear(self, part: Round) -> None:
        samples = 16 * part.tiles * part.planes
        voxels = self.job.kept.get("plane voxels", samples, lambda: Voxels(self.job.device, samples))
        with _stage(self.job, "clear"):
            voxels.clear(self.job)
        self.triangles.bind(0)
        self.queue.counters.bind_to_storage_buffer(0)

    def _show(self, part: Round) -> None:
        """What the panel's tiles show; made once for a panel that needs one round."""
        job, draw = self.job, self.job.draw
        key = (draw.viewmap, part, draw.flip_x, draw.flip_y, draw.offsets.tobytes(), self.size)
        shown, offsets = job.kept.get("plane shown", key, lambda: self._find_shown(part))
        shown.bind(4)
        offsets.bind(5)

    def _find_shown(self, part: Round) -> tuple[Any, Any]:
        job, device = self.job, self.job.device
        shown = Memory(device, part.tiles * len(self.blocks), 2, "u4")
        offsets = Memory(device, 16 * part.tiles * part.planes, 1, "f4")
        shown.bind(4)
        offsets.bind(5)
        program = job.masked_program("plane_shown.comp", version=COMPUTE_VERSION)
        put(program, picture=(part.width, part.rows), first_row=part.first_row)
        put(program, grouping=(self.size, len(self.blocks)))
        _run(program, part.tiles)
        device.ctx.memory_barrier(BARRIERS)
        return shown, offsets

    def _raster(self, part: Round, views: Pass) -> None:
        """Depths and winners of a pass; the queue is filled once if the scene is not cut into pieces."""
        for find_depth in (True, False):
            for chunk in self.chunks:
                if find_depth or len(self.chunks) > 1:
                    self._set_up(part, views, chunk)
                    self._find_tiles(part, views, find_depth)
                with _stage(self.job, "depth" if find_depth else "winner"):
                    fine = self._program("plane_fine.comp", part, views)
                    put(fine, find_depth=find_depth, room=self.queue.room)
                    fine.run_indirect(self.queue.counters, 4 * (8 + 6))
                if not find_depth:
                    self._find_tiles(part, views, find_depth, repeat=True)

    def _set_up(self, part: Round, views: Pass, chunk: list[Piece]) -> None:
        self._size_dispatches(part, views, 0)
        for number, first, count in chunk:
            mesh, corners = self.parts[number], self.corners[number]
            with _stage(self.job, "vertices"):
                defines = switches(self.job, mesh)
                program = self.job.program("plane_vertex.comp", defines=defines, version=COMPUTE_VERSION)
                set_material(program, self.job, mesh)
                self.job.device.bind_storage(mesh.vertices, 1)
                corners.points.bind(6)
                corners.surfaces.bind(7)
                put(program, count=mesh.corners)
                _run(program, mesh.corners)
            with _stage(self.job, "setup"):
                corners.triangles.bind(1)
                program = self._program("plane_setup.comp", part, views)
                put(program, range=(first, count), first_triangle=int(self.numbers[number]), room=self.room)
                put(program, two_sided=mesh.two_sided, reach=views.reach)
                _run(program, count)
        self.queue.entries.bind(1)
        self.block_texture.bind_to_image(7)
        self._size_dispatches(part, views, 1)

    def _find_tiles(self, part: Round, views: Pass, find_depth: bool, repeat: bool = False) -> None:
        """Fill the queue; or, where it has overflowed, rasterise everything once more."""
        with _stage(self.job, "tiles"):
            program = self._program("plane_tiles.comp", part, views)
            put(program, room=self.queue.room, triangle_room=self.room, find_depth=find_depth, everything=repeat)
            for large in (False, True):
                put(program, large=large)
                program.run_indirect(self.queue.counters, 4 * (8 + (9 if repeat else 0) + 3 * large))
        if not repeat:
            self._size_dispatches(part, views, 2)

    def _size_dispatches(self, part: Round, views: Pass, after: int) -> None:
        program = self._program("plane_args.comp", part, views)
        put(program, after_stage=after, room=self.queue.room)
        program.run(1)
        self.job.device.ctx.memory_barrier(BARRIERS)

    def _program(self, name: str, part: Round, views: Pass) -> Any:
        method = self.job.draw.method
        defines: Defines = {
            "PANEL": self.on_panel,
            "PLANAR": method == "plane-rasterizer-planar",
            "STAGGER": method == "plane-rasterizer-staggered",
        }
        program = self.job.program(name, defines=defines, version=COMPUTE_VERSION)
        put(program, picture=(part.width, part.rows), first_row=part.first_row, sample_at=self.sample_at)
        put(program, pass_views=(views.first, views.count, self.size, self.views_in_all))
        put(program, plane_count=part.planes, first_offset=float(self.job.draw.offsets[0]))
        return program

    def _encode(self, part: Round, first_tile: int, picture: Any) -> None:
        """Shade what is seen, into a texture: the atlas, from a tile on, or a panel."""
        job = self.job
        groups = -(-part.width // 16), -(-part.rows // 4), 1 if self.on_panel else part.planes
        for number, (mesh, corners) in enumerate(zip(self.parts, self.corners, strict=True)):
            with _stage(job, "encode"):
                defines = {**switches(job, mesh), "PANEL": self.on_panel}
                program = job.program("plane_encode.comp", defines=defines, version=COMPUTE_VERSION)
                set_material(program, job, mesh)
                corners.triangles.bind(1)
                corners.points.bind(6)
                corners.surfaces.bind(7)
                picture.bind_to_image(4)
                put(program, picture=(part.width, part.rows), first_row=part.first_row, sample_at=self.sample_at)
                put(program, first_tile=first_tile, plane_count=part.planes, flip=(job.draw.flip_x, job.draw.flip_y))
                put(program, range=(int(self.numbers[number]), mesh.triangles))
                program.run(*groups)

    def _write_depths(self, part: Round, tiles: range) -> None:
        """Into the atlas's depth buffer."""
        job, ctx = self.job, self.job.device.ctx
        program = job.program("tile.vert", "plane_depth.frag", version=COMPUTE_VERSION)
        put(program, first_view=tiles.start, first_tile=tiles.start, plane_count=part.planes)
        put(program, picture=(part.width, part.rows), first_row=part.first_row)
        write_only(job.atlas.target, NOTHING)
        ctx.enable_only(ctx.DEPTH_TEST)
        job.vertex_array(program, []).render(ctx.TRIANGLE_STRIP, vertices=4, instances=len(tiles))
        write_only(job.atlas.target)


def views_of_a_block(job: Job) -> int:
    """How many views are looked at together: of a panel as many as its tiles' sub-pixels are worth the looking."""
    if job.draw.method == ONE_VIEW:
        return 1
    return BLOCK_VIEWS if job.draw.viewmap is None else max(1, len(job.draw.offsets) // PANEL_BLOCKS)


def check_size(job: Job) -> None:
    """Raise UnsupportedError when the column or row of a tile is more than an entry of the queue has bits for."""
    camera = job.draw.camera
    if max(camera.width, camera.height) > MAX_SIDE:
        raise UnsupportedError(
            f"method {job.draw.method!r}: pictures have at most {MAX_SIDE} pixels a side, "
            f"this one {camera.width}×{camera.height}: choose a smaller size or single-pass"
        )


def _run(program: Any, invocations: int) -> None:
    groups = -(-invocations // GROUP)
    program.run(min(groups, GROUPS), -(-groups // GROUPS))
