"""The CPU engine: Numba kernels on bands of rows, all views at once."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from queue import LifoQueue
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from ...scene.scene import Scene
from ..engine import Camera, Draw, Target
from . import gather
from .jit import is_compiled
from .mesh_panel import CELL, Panel, RowPlan, draw_panel
from .mesh_raster import Lighting, Scratch, Surface
from .mesh_setup import (
    CameraNumbers, clip_near, count_crossing, cull_and_count, fill_bins, light_vertices, project_vertices, turn_normals,
)
from .mesh_shade import FLOAT_ROWS, INT_ROWS, STRIDE
from .mesh_views import draw_views
from .scene_arrays import SceneArrays, background_word, light_array, scene_arrays
from .threads import run_rows
from .tiles import Grid

__all__ = ["CpuEngine", "is_compiled"]

BAND_BYTES = 400_000  # of tiles: with what else a band touches it stays in L2
TILE_BYTES = 128
VERTEX_CHUNK = 8192


@dataclass(eq=False)
class Prepared:
    """A scene ready to draw, with buffers that live from frame to frame (fresh memory is dear)."""

    scene: Scene
    arrays: SceneArrays
    buffers: dict[str, NDArray[Any]] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def buffer(self, name: str, shape: tuple[int, ...], dtype: type) -> NDArray[Any]:
        """An uninitialised array of this shape, in memory kept under `name`."""
        count = int(np.prod(shape))
        held = self.buffers.get(name)
        if held is None or held.size < count or held.dtype != dtype:
            held = self.buffers[name] = np.empty(count, dtype)
        return held[:count].reshape(shape)


class CpuEngine:
    """Draws meshes; see engines.engine.Engine."""

    name = "cpu"
    methods = ("single-pass", "n-pass", "n-pass-subres")

    def prepare(self, scene: Scene) -> Prepared:
        """Gather the scene's meshes, textures and materials."""
        return Prepared(scene, scene_arrays(scene))

    def draw(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        """Draw a stack of views, or straight to the panel."""
        with prepared.lock:
            if draw.viewmap is None:
                self._draw_views(prepared, draw, target)
            else:
                self._draw_panel(prepared, draw, target)

    def interlace(self, views: NDArray[np.uint8], draw: Draw, out: NDArray[np.uint8]) -> None:
        """Gather a panel from its V views."""
        assert draw.viewmap is not None
        gather.interlace(views, draw.viewmap, draw.flip_x, draw.flip_y, out)

    def merge_view(self, view: NDArray[np.uint8], index: int, draw: Draw, out: NDArray[np.uint8]) -> None:
        """Write into the panel those sub-pixels that show view `index`."""
        assert draw.viewmap is not None
        gather.merge_view(view, index, draw.viewmap, (draw.flip_x, draw.flip_y), out)

    def weave(
        self, quilt: NDArray[np.uint8], grid: tuple[int, int], draw: Draw, size: tuple[int, int]
    ) -> NDArray[np.uint8]:
        """Gather a panel of `size` from a quilt of views of another size, bilinearly."""
        assert draw.viewmap is not None
        return gather.weave(quilt, grid, draw.viewmap, size, "linear", (draw.flip_x, draw.flip_y))

    def _draw_views(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        views, height, width, _ = target.color.shape
        grid = tile_grid(views, width)
        row_bytes = grid.groups * grid.across * TILE_BYTES
        rows_per_band = int(np.clip(BAND_BYTES // row_bytes, 1, 16))
        surface, camera, lighting = surface_at(prepared, draw, rows_per_band)
        lanes = np.full(grid.groups * grid.views, draw.offsets[-1])
        lanes[:views] = draw.offsets
        lane_offsets = np.repeat(lanes, grid.columns).astype(np.float32)
        side = round(draw.options.samples**0.5)
        sums = rows_per_band * views * width * 4 if side > 1 else 0
        scratches = Pool(lambda: new_scratch(rows_per_band * grid.groups * grid.across, sums))
        background = background_word(prepared.scene)
        out = target.color.view(np.int32).reshape(views, height, width)
        depth = np.empty((0, 0, 0), np.float32) if target.depth is None else target.depth

        def task(first: int, end: int) -> None:
            with scratches as scratch:
                draw_views(
                    (first, end, rows_per_band), surface, camera, lighting, lane_offsets, background, grid, side,
                    scratch, out, depth,
                )

        run_rows(-(-height // rows_per_band), task)

    def _draw_panel(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        assert draw.viewmap is not None
        height, width, _ = target.color.shape
        rows_per_band = 4
        surface, camera, lighting = surface_at(prepared, draw, rows_per_band)
        side = round(draw.options.samples**0.5)
        panel = Panel(
            gather.map_args(draw.viewmap), np.ascontiguousarray(draw.offsets, dtype=np.float64),
            offset_groups(prepared, draw), draw.flip_x, draw.flip_y, draw.options.sampling == "subpixel",
        )
        tiles = -(-3 * width // 16) + panel.groups
        plans = Pool(
            lambda: (new_plan(width, tiles, panel.groups), new_scratch(tiles, 3 * width if side > 1 else 0))
        )
        background = background_word(prepared.scene)

        def task(first: int, end: int) -> None:
            with plans as (plan, scratch):
                draw_panel(
                    (first, end, rows_per_band), surface, camera, lighting, panel, background, np.uint64(16), side,
                    plan, scratch, target.color,
                )

        run_rows(-(-height // rows_per_band), task)


class Pool:
    """Memory for one task at a time: made when none is free, kept for the next task."""

    def __init__(self, make: Any) -> None:
        self._make, self._free = make, LifoQueue[Any]()
        self._local = threading.local()

    def __enter__(self) -> Any:
        try:
            self._local.item = self._free.get_nowait()
        except Exception:
            self._local.item = self._make()
        return self._local.item

    def __exit__(self, *_: object) -> None:
        self._free.put(self._local.item)


def new_scratch(tiles: int, sums: int) -> Scratch:
    """One thread's memory for a band of `tiles`, with `sums` accumulators for sub-samples."""
    return Scratch(
        np.zeros(tiles * TILE_BYTES // 4, np.int32), np.zeros(32, np.float32), np.zeros(FLOAT_ROWS * STRIDE, np.float32),
        np.zeros(INT_ROWS * STRIDE, np.int32), np.zeros(sums, np.uint16),
    )


def new_plan(width: int, tiles: int, groups: int) -> RowPlan:
    """One thread's memory for the plan of a panel row."""
    return RowPlan(
        np.empty((width, 3)), np.empty(2 * tiles * 16, np.float32), np.empty(tiles * 16, np.float32),
        np.empty(3 * width, np.int32), np.empty(3 * width, np.int32), np.empty(groups + 1, np.int64),
        np.empty((-(-width // CELL) + 2, groups), np.int32), np.empty((2, groups), np.float32),
    )


def tile_grid(views: int, width: int) -> Grid:
    """Shape of the tiles for V views: as square as the number of views lets them be."""
    per_tile = 1 if views == 1 else 2 if views == 2 else 4
    columns = 16 // per_tile
    return Grid(per_tile, columns, -(-views // per_tile), -(-width // columns), 16)


def offset_groups(prepared: Prepared, draw: Draw) -> int:
    """How many groups of offsets a panel's row is sorted into.

    A tile of G groups spans 16·G/3 pixels, and a segment slides by parallax/G within a group: best when alike.
    """
    vertices = prepared.buffers["vertices"].reshape(-1, 3)[:: max(1, len(prepared.arrays.positions) // 1000), 2]
    vertices = vertices[vertices > 0]
    reach = draw.offsets[-1] - draw.offsets[0]
    parallax = draw.camera.fx * reach * np.abs(1.0 / draw.camera.focal - vertices)
    typical = float(np.mean(parallax)) if len(vertices) else 0.0
    return int(np.clip(round((3 * typical / 16) ** 0.5), 1, 16))


def surface_at(prepared: Prepared, draw: Draw, rows_per_band: int) -> tuple[Surface, CameraNumbers, Lighting]:
    """Project, light, clip, cull and bin the scene's triangles for one camera."""
    arrays, camera, options = prepared.arrays, draw.camera, draw.options
    numbers = CameraNumbers(
        float(camera.width), float(camera.height), camera.fx, camera.fy, camera.focal, camera.near, camera.offset_y
    )
    count = len(arrays.positions)
    e = np.ascontiguousarray(camera.eye_from_world)
    per_sample = options.lighting == "sample"
    lights = light_array(prepared.scene, camera)
    two_sided = bool(arrays.materials[:, 4].any())
    vertices = prepared.buffer("vertices", (count, 3), np.float64)
    attributes = prepared.buffer("attributes", (count, 12 if two_sided and not per_sample else 6), np.float32)

    def vertex_stage(first: int, last: int) -> None:
        project_vertices(first, last, arrays.positions, e, numbers, vertices)
        if per_sample:
            turn_normals(first, last, arrays.normals, arrays.colors, e, attributes)
        else:
            light_vertices(first, last, arrays, e, numbers, lights, attributes)

    run_rows(count, vertex_stage, VERTEX_CHUNK)
    faces, face_ids, uv = arrays.faces, prepared.buffer("ids", (len(arrays.faces),), np.int32), arrays.uv
    face_ids[:] = np.arange(len(faces), dtype=np.int32)
    crossing = count_crossing(faces, vertices)
    behind = bool((vertices[:, 2] < 0).any())
    if behind:
        faces, face_ids, vertices, attributes, uv = _clipped(
            arrays, e, numbers, crossing, (faces, face_ids, vertices, attributes, uv)
        )
    side = round(options.samples**0.5)
    bands = (rows_per_band, 0.5 / side, 1.0 - 0.5 / side)
    triangles, bin_start, bins = _binned(prepared, (faces, face_ids, vertices), numbers, draw.culling, bands)
    surface = Surface(
        vertices, attributes, uv, triangles, bin_start, bins, arrays.face_material, arrays.materials, arrays.texels,
        arrays.texture_levels, arrays.level_count,
    )
    own_eye = np.float32(options.shading != "center")
    return surface, numbers, Lighting(lights, per_sample, own_eye)


def _clipped(arrays: SceneArrays, e: Any, camera: CameraNumbers, crossing: int, held: tuple[Any, ...]) -> tuple[Any, ...]:
    """Triangles cut at the near plane, in arrays with room for the new vertices."""
    faces, face_ids, vertices, attributes, uv = held
    room = 2 * crossing

    def grown(a: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([a, np.zeros((room, a.shape[1]), a.dtype)]) if len(a) else a

    vertices, attributes, uv = grown(vertices), grown(attributes), grown(uv)
    out_faces = np.empty((len(faces) + crossing, 3), np.int32)
    out_ids = np.empty(len(out_faces), np.int32)
    count = clip_near(faces, face_ids, arrays.positions, e, camera, vertices, attributes, uv, out_faces, out_ids)
    return out_faces[:count], out_ids[:count], vertices, attributes, uv


def _binned(
    prepared: Prepared, mesh: tuple[Any, ...], camera: CameraNumbers, culling: tuple[float, float], bands: Any
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int32]]:
    """Visible triangles, and the triangles of each band in the order of faces."""
    faces, face_ids, vertices = mesh
    chunks = max(1, min(2 * numba.get_num_threads(), len(faces) // 4096))
    edges = np.linspace(0, len(faces), chunks + 1).astype(np.int64)
    count_bands = -(-int(camera.height) // bands[0])
    counts = np.zeros((chunks, count_bands), np.int64)
    kept = np.zeros(chunks, np.int64)
    triangles = prepared.buffer("triangles", (max(len(faces), 1), 4), np.int32)

    def cull(first: int, last: int) -> None:
        for c in range(first, last):
            kept[c] = cull_and_count(
                (edges[c], edges[c + 1]), faces, face_ids, vertices, prepared.arrays, camera, culling, bands,
                triangles, counts[c],
            )

    run_rows(chunks, cull, 1)
    bin_start = np.zeros(count_bands + 1, np.int64)
    np.cumsum(counts.sum(axis=0), out=bin_start[1:])
    cursors = bin_start[:-1] + np.cumsum(counts, axis=0) - counts
    bins = prepared.buffer("bins", (max(int(bin_start[-1]), 1),), np.int32)

    def fill(first: int, last: int) -> None:
        for c in range(first, last):
            fill_bins(edges[c], kept[c], triangles, vertices, camera.height, bands, cursors[c], bins)

    run_rows(chunks, fill, 1)
    return triangles, bin_start, bins
