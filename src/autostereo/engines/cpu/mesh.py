"""Meshes on the cpu engine: from a scene to kernels."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from ...scene.mesh import Mesh
from ...scene.scene import Scene
from ..engine import Draw, Target
from . import mesh_panel, mesh_views
from .memory import Memory
from .mesh_panel import Panel
from .mesh_raster import Scratch, Shader, Surface
from .mesh_reuse import exact_offsets
from .mesh_setup import (
    CameraNumbers,
    camera_numbers,
    clip_near,
    count_crossing,
    cull_and_count,
    fill_bins,
    light_vertices,
    project_vertices,
    turn_normals,
)
from .mesh_shade import ANY, DIFFUSE, PLAIN
from .panel_lines import LinePlan, line_buckets, line_capacity, plan_lines
from .panel_list import STRIDE, Block
from .scene_arrays import SceneArrays, background_word, light_array, scene_arrays
from .simd import LANES
from .threads import run_rows

BAND_BYTES = 320_000  # of the samples of a row of all views: with what else a row touches they stay in L2
PANEL_COLUMNS = 8192  # most pixels of a panel's block
VERTEX_CHUNK = 4096
CHUNKS = 4  # of triangles that a thread sorts into bins
_counting = threading.Lock()


@dataclass(frozen=True, eq=False)
class PreparedMeshes:
    """The meshes of a scene, ready to be drawn."""

    scene: Scene
    arrays: SceneArrays
    face_ids: NDArray[np.int32]


def prepare_meshes(scene: Scene, meshes: list[Mesh]) -> PreparedMeshes:
    """Gather meshes, textures and materials."""
    arrays = scene_arrays(meshes)
    return PreparedMeshes(scene, arrays, np.arange(len(arrays.faces), dtype=np.int32))


def panel_lines(draw: Draw, memory: Memory) -> LinePlan:
    """The plan of a panel's lines, that of the frame before if it still fits."""
    viewmap, width, flip, offsets = draw.viewmap, draw.camera.width, draw.flip_x, draw.offsets
    assert viewmap is not None
    key = (viewmap, width, flip, offsets.tobytes())
    return memory.remember("lines", key, lambda: plan_lines(viewmap, width, flip, offsets))


def draw_mesh_views(prepared: PreparedMeshes, draw: Draw, target: Target, memory: Memory) -> None:
    """Draw a stack of views: every pixel of the target, and its depth if it has one."""
    views, height, width, _ = target.color.shape
    side = round(draw.options.samples**0.5)
    block = view_block(views, width)
    blocks = -(-width // block)
    surface, camera, shader = surface_at(prepared, draw, block, blocks, memory)
    samples = views * block + block + LANES  # a run of one view may lead on where another's has ended
    sums = 4 * samples if side > 1 else 0
    exact = (len(shader.exact), width)
    offsets = np.pad(draw.offsets.astype(np.float32), (0, LANES - 1), mode="edge")
    pool = memory.pool(
        ("views", samples, sums, exact, offsets.shape),
        lambda: (new_scratch(samples, sums, exact), np.zeros(offsets.shape, np.int32)),
    )
    kernel = mesh_views.KERNELS[only_kind(surface, shader)]
    background = background_word(prepared.scene)
    out = target.color.view(np.int32).reshape(views, height, width)
    depth = np.empty((0, 0, 0), np.float32) if target.depth is None else target.depth

    def task(first: int, end: int) -> None:
        with pool as (scratch, places):
            job = (surface, camera, shader, offsets, places, background, side)
            kernel((first, end, blocks, block), job, scratch, out, depth)
            count_samples(target, scratch)

    run_rows(height * blocks, task)


def draw_mesh_panel(prepared: PreparedMeshes, draw: Draw, target: Target, memory: Memory) -> None:
    """Draw every pixel of a panel, and its depth (H, W, 3) if the target has one."""
    height, width, _ = target.color.shape
    plan = panel_lines(draw, memory)
    columns = panel_block(width)
    blocks = -(-width // columns)
    surface, camera, shader = surface_at(prepared, draw, columns, blocks, memory)
    side = round(draw.options.samples**0.5)
    panel = Panel(plan, draw.flip_x, draw.flip_y, draw.options.sampling == "subpixel")
    samples = columns * 3 + LANES
    sums = samples if side > 1 else 0
    exact = (len(shader.exact), width)
    pool = memory.pool(
        ("panel", columns, line_capacity(plan, columns), line_buckets(plan, columns), sums, exact),
        lambda: (new_block(1, columns, plan), new_scratch(samples, sums, exact)),
    )
    background = background_word(prepared.scene)
    depth = np.empty((0, 0, 0), np.float32) if target.depth is None else target.depth
    kernel = mesh_panel.KERNELS[only_kind(surface, shader)]

    def task(first: int, end: int) -> None:
        with pool as (block, scratch):
            job = (surface, camera, shader, panel, background, side)
            kernel((first, end, blocks, columns), job, (block, scratch), target.color, depth)
            count_samples(target, scratch)

    run_rows(height * blocks, task)


def only_kind(surface: Surface, shader: Shader) -> int:
    """What shades every triangle: PLAIN or DIFFUSE where that holds for all, else ANY."""
    return shader.simple if surface.materials[:, 6].all() else ANY


def new_scratch(samples: int, sums: int, exact: tuple[int, int]) -> Scratch:
    """One thread's memory: a band of `samples`, accumulators for sub-samples, colours of `exact` views × width."""
    band, words = np.zeros(samples, np.int64), np.zeros(2 * LANES, np.int64)
    return Scratch(
        band,
        band.view(np.int32),
        np.zeros(16, np.float32),
        np.zeros(STRIDE, np.int32),
        words,
        words.view(np.int32),
        np.zeros(3 * LANES, np.float32),
        np.zeros(LANES, np.int32),
        np.zeros(17, np.float32),
        np.zeros(8 * LANES, np.float32),
        np.zeros(4 * LANES, np.int32),
        np.zeros(sums, np.uint16),
        np.zeros(exact[0] * (exact[1] + LANES), np.int32),
        np.zeros((3, exact[0]), np.int32),
        np.zeros(2, np.int64),
    )


def count_samples(target: Target, scratch: Scratch) -> None:
    """Move a thread's counters to the target's."""
    with _counting:
        target.covered += int(scratch.counts[0])
        target.reused += int(scratch.counts[1])
    scratch.counts[:] = 0


def new_block(rows: int, columns: int, plan: LinePlan) -> Block:
    """One thread's memory for a panel's block of so many pixels."""
    capacity = line_capacity(plan, columns)
    return Block(
        np.zeros(rows * columns * 3, np.float32),
        np.zeros((rows, 3, capacity), np.float32),
        np.zeros((rows, capacity), np.int32),
        np.zeros((rows, line_buckets(plan, columns) + 1), np.int32),
        np.zeros((3, capacity), np.float32),
        np.zeros((2, capacity), np.int32),
        np.zeros(columns, np.float64),
    )


def panel_block(width: int) -> int:
    """Columns of a panel's block, for whose samples and offsets 36 bytes a pixel are at hand."""
    blocks = -(-width // PANEL_COLUMNS)
    return (-(-width // blocks) + 15) // 16 * 16


def view_block(views: int, width: int) -> int:
    """Columns of a block for which the samples of a row of all views stay in cache."""
    columns = max(64, BAND_BYTES // (8 * views))
    blocks = -(-width // columns)
    return (-(-width // blocks) + 15) // 16 * 16  # whole cache lines of a picture


def surface_at(
    prepared: PreparedMeshes, draw: Draw, block: int, blocks: int, memory: Memory
) -> tuple[Surface, CameraNumbers, Shader]:
    """Project, light, clip, cull the scene's triangles, and bin them to rows × blocks of so many columns."""
    arrays, camera, options = prepared.arrays, draw.camera, draw.options
    numbers = camera_numbers(camera)
    count = len(arrays.positions)
    e = np.ascontiguousarray(camera.eye_from_world)
    per_sample = options.lighting == "sample"
    lights = light_array(prepared.scene, camera)
    two_sided = bool(arrays.materials[:, 4].any())
    vertices = memory.buffer("vertices", (count, 3), np.float64)
    sides = 2 if two_sided and not per_sample else 1
    attributes = memory.buffer("attributes", (count, 8 * sides), np.float32)

    behind: list[int] = []

    def vertex_stage(first: int, last: int) -> None:
        behind.append(project_vertices(first, last, arrays.positions, e, numbers, vertices))
        if per_sample:
            turn_normals(first, last, arrays.normals, arrays.colors, e, attributes)
        else:
            light_vertices(first, last, arrays, e, numbers, lights, attributes)

    run_rows(count, vertex_stage, VERTEX_CHUNK)
    faces, face_ids, uv = arrays.faces, prepared.face_ids, arrays.uv
    if any(behind):
        faces, face_ids, vertices, attributes, uv = _clipped(
            arrays, e, numbers, (faces, face_ids, vertices, attributes, uv)
        )
    side = round(options.samples**0.5)
    bins = (0.5 / side, 1.0 - 0.5 / side, block, blocks)
    triangles, bin_start, binned = _binned(
        (prepared.arrays, memory), (faces, face_ids, vertices), numbers, draw.culling, bins
    )
    surface = Surface(
        vertices.ravel(), attributes.ravel(), uv, triangles.ravel(), bin_start, binned, arrays.materials,
        sides,
    )  # fmt: skip
    own_eye = np.float32(options.shading != "center")
    directional = options.shading != "reuse" and not lights[:, 0].any()
    exact = exact_offsets(draw.offsets) if options.shading == "reuse" else np.empty(0, np.float32)
    shader = Shader(
        lights,
        arrays.texels,
        arrays.texture_levels,
        arrays.level_count,
        per_sample,
        own_eye,
        PLAIN if not per_sample else DIFFUSE if directional else ANY,
        exact,
        np.float32(camera.fx / camera.focal),
    )
    return surface, numbers, shader


def _clipped(arrays: SceneArrays, e: Any, camera: CameraNumbers, held: tuple[Any, ...]) -> tuple[Any, ...]:
    """Triangles cut at the near plane, in arrays with room for the new vertices."""
    faces, face_ids, vertices, attributes, uv = held
    crossing = count_crossing(faces, vertices)
    room = 2 * crossing

    def grown(a: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([a, np.zeros((room, a.shape[1]), a.dtype)]) if len(a) else a

    vertices, attributes, uv = grown(vertices), grown(attributes), grown(uv)
    out_faces = np.empty((len(faces) + crossing, 3), np.int32)
    out_ids = np.empty(len(out_faces), np.int32)
    count = clip_near(faces, face_ids, arrays.positions, e, camera, vertices, attributes, uv, out_faces, out_ids)
    return out_faces[:count], out_ids[:count], vertices, attributes, uv


def _binned(
    held: tuple[SceneArrays, Memory],
    mesh: tuple[Any, ...],
    camera: CameraNumbers,
    culling: tuple[float, float],
    bins: Any,
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int32]]:
    """Visible triangles, and the triangles of each bin in the order of faces."""
    arrays, memory = held
    faces, face_ids, vertices = mesh
    chunks = max(1, min(CHUNKS * numba.get_num_threads(), len(faces) // 4096))
    edges = np.linspace(0, len(faces), chunks + 1).astype(np.int64)
    count_bins = int(camera.height) * bins[3]
    counts = np.zeros((chunks, count_bins), np.int64)
    kept = np.zeros(chunks, np.int64)
    triangles = memory.buffer("triangles", (max(len(faces), 1), 8), np.int32)

    def cull(first: int, last: int) -> None:
        for c in range(first, last):
            kept[c] = cull_and_count(
                (edges[c], edges[c + 1]),
                faces,
                face_ids,
                vertices,
                arrays,
                camera,
                culling,
                bins,
                triangles,
                counts[c],
            )

    run_rows(chunks, cull, 1)
    bin_start = np.zeros(count_bins + 1, np.int64)
    np.cumsum(counts.sum(axis=0), out=bin_start[1:])
    cursors = bin_start[:-1] + np.cumsum(counts, axis=0) - counts
    binned = memory.buffer("bins", (int(bin_start[-1]) + LANES,), np.int32)

    def fill(first: int, last: int) -> None:
        for c in range(first, last):
            fill_bins(edges[c], kept[c], triangles, bins[2], bins[3], cursors[c], binned)

    run_rows(chunks, fill, 1)
    if len(binned) > LANES:  # the last bin is read in whole steps, of triangles that there are
        binned[-LANES:] = binned[-LANES - 1]
    return triangles, bin_start, binned
