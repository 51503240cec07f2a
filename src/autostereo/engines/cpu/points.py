"""Points on the cpu engine: from clouds to kernels, over what is drawn already."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from ...scene.points import Points
from ...scene.scene import Scene
from ..engine import Draw
from .memory import Memory
from .mesh import new_block, panel_lines
from .mesh_panel import Panel
from .mesh_setup import CameraNumbers, camera_numbers
from .panel_lines import line_buckets, line_capacity
from .panel_list import STRIDE
from .points_block import Splats
from .points_panel import PLANE as PANEL_PLANE
from .points_panel import PLANES as PANEL_PLANES
from .points_panel import splat_panel
from .points_setup import WORDS, Grid, View, fill_bins, place_surfels
from .points_views import PAD, PLANE, PLANES, VIEWS_AT_ONCE, Scratch, row_samples, splat_views
from .scene_arrays import light_array
from .threads import run_rows

LIST_ROWS = 8  # most rows of float32 lists that a draw of points needs
SAMPLES = 12_000  # of a block of views: with what else a block touches they stay in L2
PANEL_SAMPLES = 12_288  # of a block of a panel, likewise
PANEL_COLUMNS = 2048  # most pixels of a panel's block


class PointArrays(NamedTuple):
    """Clouds one behind the other, in world space.

    positions (N, 3) float64, normals (N, 3) float32, zero where there is none, radii (N,) and colors (N, 3) float32,
    material (N,) int32, materials (M, 4) float32: ambient, diffuse, specular, shininess.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float32]
    radii: NDArray[np.float32]
    colors: NDArray[np.float32]
    material: NDArray[np.int32]
    materials: NDArray[np.float32]


def prepare_points(objects: Sequence[Points]) -> PointArrays:
    """Gather clouds in world space."""
    normals = [np.zeros((len(p), 3)) if p.world_normals is None else p.world_normals for p in objects]
    materials = [(m.ambient, m.diffuse, m.specular, m.shininess) for m in (p.material for p in objects)]
    return PointArrays(
        np.concatenate([p.world_positions for p in objects]),
        np.concatenate(normals).astype(np.float32),
        np.concatenate([p.world_radii for p in objects]).astype(np.float32),
        np.concatenate([p.colors for p in objects]),
        np.repeat(np.arange(len(objects), dtype=np.int32), [len(p) for p in objects]),
        np.array(materials, np.float32),
    )


def view_grid(views: int, width: int, height: int) -> Grid:
    """Blocks for which the samples of all views, or as many as are drawn at once, stay in cache."""
    views = min(views, VIEWS_AT_ONCE)
    columns = max(48, SAMPLES // views - PAD)
    blocks = -(-width // columns)
    columns = -(-width // blocks)
    rows = int(np.clip(SAMPLES // (views * row_samples(columns)), 1, 16))
    return Grid(min(rows, height), columns, blocks)


def draw_points_views(
    arrays: PointArrays, scene: Scene, draw: Draw, color: NDArray[np.uint8], depth: NDArray[np.float32], buffers: Memory
) -> None:
    """Splat surfels over color (V, H, W, 4) where they are nearer than eye depth (V, H, W); both are updated."""
    views, height, width = depth.shape
    grid, camera = view_grid(views, width, height), camera_numbers(draw.camera)
    splats = splats_at(arrays, scene, draw, (camera, grid), buffers, (draw.offsets.min(), draw.offsets.max()))
    offsets = np.pad(draw.offsets.astype(np.float32), (0, 15), mode="edge")
    pool = buffers.pool(("points",), lambda: new_scratch(PLANES * int(PLANE)))
    out = color.view(np.int32).reshape(views, height, width)

    def task(first: int, end: int) -> None:
        with pool as scratch:
            splat_views((first, end), grid, splats, camera, offsets, scratch, out, depth)

    run_rows(-(-height // grid.rows) * grid.blocks, task)


def draw_points_panel(
    arrays: PointArrays, scene: Scene, draw: Draw, color: NDArray[np.uint8], depth: NDArray[np.float32], buffers: Memory
) -> None:
    """Splat surfels over color (H, W, 3) where they are nearer than eye depth (H, W, 3); both are updated.

    Both are laid out as the panel shows them, mirrored by the draw's flips.
    """
    height, width, _ = depth.shape
    plan, camera, grid = panel_lines(draw, buffers), camera_numbers(draw.camera), panel_grid(width, height)
    splats = splats_at(arrays, scene, draw, (camera, grid), buffers, (plan.low, plan.high))
    panel = Panel(plan, draw.flip_x, draw.flip_y, draw.options.sampling == "subpixel")
    pool = buffers.pool(
        ("points panel", grid, line_capacity(plan, grid.columns), line_buckets(plan, grid.columns)),
        lambda: (new_block(grid.rows, grid.columns, plan), new_scratch(PANEL_PLANES * int(PANEL_PLANE))),
    )

    def task(first: int, end: int) -> None:
        with pool as (block, scratch):
            splat_panel((first, end), grid, splats, camera, panel, block, scratch, color, depth)

    run_rows(-(-height // grid.rows) * grid.blocks, task)


def panel_grid(width: int, height: int) -> Grid:
    """Blocks for which the samples of a panel stay in cache."""
    blocks = -(-width // PANEL_COLUMNS)
    columns = (-(-width // blocks) + 31) // 32 * 32
    return Grid(min(max(1, PANEL_SAMPLES // (3 * columns)), height), columns, blocks)


def new_scratch(samples: int) -> Scratch:
    """One thread's memory."""
    return Scratch(
        np.zeros(samples, np.float32), np.zeros(LIST_ROWS * STRIDE, np.float32), np.zeros(2 * STRIDE, np.int32)
    )


def splats_at(
    arrays: PointArrays,
    scene: Scene,
    draw: Draw,
    frame: tuple[CameraNumbers, Grid],
    buffers: Memory,
    offsets: tuple[float, float],
) -> Splats:
    """Bring surfels before the camera, light, cull and bin them; frame = (camera, grid); range of offsets to draw."""
    camera, grid = frame
    count = len(arrays.positions)
    lights, own_eye = light_array(scene, draw.camera), draw.options.shading != "center"
    e = np.ascontiguousarray(draw.camera.eye_from_world, dtype=np.float64)
    turn = np.ascontiguousarray(np.linalg.inv(e[:3, :3]).T)
    low, high = min(draw.culling[0], offsets[0]), max(draw.culling[1], offsets[1])
    view = View(e, turn, float(low), float(high), lights, own_eye)
    records = buffers.buffer("surfels", (count, WORDS), np.float32)
    ranges = buffers.buffer("surfel ranges", (count, 4), np.int32)
    backs = buffers.buffer("surfel backs", (count, 3), np.float32)
    words = records.view(np.int32)

    # a few chunks, each with its own cursors: bins are filled in parallel and keep the order of surfels
    chunks = max(1, min(8 * numba.get_num_threads(), count // 4096))
    edges = np.linspace(0, count, chunks + 1).astype(np.int64)
    blocks = -(-int(camera.height) // grid.rows) * grid.blocks
    counts = np.zeros((chunks, blocks), np.int64)

    def place(first: int, end: int) -> None:
        for c in range(first, end):
            span = edges[c], edges[c + 1]
            place_surfels(span, arrays, view, camera, grid, records, words, backs, ranges, counts[c])

    run_rows(chunks, place, 1)
    bin_start = np.zeros(blocks + 1, np.int64)
    np.cumsum(counts.sum(axis=0), out=bin_start[1:])
    cursors = bin_start[:-1] + np.cumsum(counts, axis=0) - counts
    bins = buffers.buffer("surfel bins", (max(int(bin_start[-1]), 1),), np.int32)

    def fill(first: int, end: int) -> None:
        for c in range(first, end):
            fill_bins((edges[c], edges[c + 1]), ranges, grid.blocks, cursors[c], bins)

    run_rows(chunks, fill, 1)
    return Splats(records, words, backs, bin_start, bins, arrays.materials, lights, own_eye)
