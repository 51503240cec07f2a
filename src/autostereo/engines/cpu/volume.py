"""Volumes on the cpu engine: from prepared fields to kernels, over what is drawn already."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scene.scene import Scene
from ...scene.volume import Volume
from ..engine import Camera, Draw
from .memory import Memory
from .mesh_setup import camera_numbers
from .scene_arrays import light_array
from .threads import run_rows
from .volume_rays import BLOCK_ROWS, RAYS, ROW
from .volume_sample import CHUNK, LIST, LIST_ROWS, SLABS, Cut, Planes, Slices
from .volume_setup import (
    BLOCK,
    TABLE,
    Field,
    depth_range,
    half_spaces,
    make_table,
    prepare_field,
    shown_blocks,
)
from .volume_shared import LINE, SLAB_ROWS, Shared
from .volume_views import VIEWS_AT_ONCE, Ways, draw_rows, draw_shared_rows

FINE = (0.25, 0.5)
FINE_VIEWS = 2  # positions of a shared slab per pixel
MAX_PLANES = 2**20


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


def make_slices(volumes: list[Volume], camera: Camera, step: float) -> Slices | None:
    """Slices through all volumes (see reference.volume.planes); None when nothing lies behind the near plane."""
    first, last = depth_range(volumes, camera)
    if last <= first:
        return None
    count = (last - first) / (step * min(float(v.voxel_size.min()) for v in volumes))
    if count > MAX_PLANES:
        raise InputError(f"options step: {step:g} voxels make {count:.3g} slabs of the volumes, at most {MAX_PLANES}")
    slabs = max(1, int(np.ceil(count)))
    return Slices(first, (last - first) / slabs, slabs)


def make_cut(
    prepared: PreparedVolumes, index: int, camera: Camera, slices: Slices, memory: Memory
) -> tuple[Cut, Ways]:
    """How volume `index` is cut, lit and classified in this frame."""
    f = prepared.fields[index]
    volume = f.volume
    index_from_eye = np.linalg.inv(camera.eye_from_world @ volume.world_from_index)
    along = float(np.abs(index_from_eye[:3, 0]).max())  # voxels per unit of X
    step = float(np.clip(slices.first / camera.fx, FINE[0] / along, FINE[1] / along))
    x = (camera.eye_from_world @ np.column_stack([volume.corners, np.ones(8)]).T)[0]
    first = float(x.min()) - 2.0 * step
    reach = int(np.ceil((8 * step * along + 1 + slices.distance * np.abs(index_from_eye[:3, 2]).max()) / (1 << BLOCK)))
    shown = memory.remember(("shown", index), (reach, volume), lambda: shown_blocks(f, reach))
    low, high = f.grid.low, f.grid.high
    table = memory.remember(
        ("table", index),
        (volume, slices.distance),
        lambda: make_table(volume.transfer, *volume.value_range, slices.distance),
    )
    lights, m = light_array(prepared.scene, camera), volume.material
    channels, colors = 0, 0
    if f.grid.words.size:
        colors = 3 if np.ptp(lights[:, 4:7], axis=1).any() else 1
        channels = colors * (2 if m.specular > 0 else 1)
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
        (TABLE - 1.0) / max(high - low, 1e-300),
        np.ascontiguousarray(camera.eye_from_world[:3, :3], dtype=np.float32),
        lights,
        channels,
        colors,
        (1.0 - m.ambient) / max(m.diffuse, 1e-6),
        float(m.shininess),
        camera.offset_y,
    )
    return cut, Ways(table, (m.ambient, m.diffuse, m.specular), (channels, colors))


def samples_of(prepared: PreparedVolumes, index: int, camera: Camera, cut: Cut) -> int:
    """Samples of a slice, in whole runs."""
    x = (camera.eye_from_world @ np.column_stack([prepared.fields[index].volume.corners, np.ones(8)]).T)[0]
    return (int((float(x.max()) - cut.first) / cut.step) + 4 + (1 << CHUNK)) >> CHUNK << CHUNK


def new_planes(samples: int, slices: Slices, channels: int) -> Planes:
    """One thread's memory for slices."""
    runs = samples >> CHUNK
    return Planes(
        np.zeros((SLABS + 1, 1 + channels, samples + 1), np.float32),
        np.zeros((slices.slabs + 1, runs), np.uint8),
        np.zeros((slices.slabs + 1, runs), np.uint8),
        np.zeros(LIST, np.int64),
        np.zeros(8 * LIST, np.int32),
        np.zeros(LIST_ROWS * LIST, np.float32),
    )


def draw_volume_views(
    prepared: PreparedVolumes, draw: Draw, color: NDArray[np.uint8], depth: NDArray[np.float32], memory: Memory
) -> None:
    """Draw volumes over color (V, H, W, 4), where depth (V, H, W), if it has a size, ends rays."""
    camera = draw.camera
    slices = make_slices(prepared.volumes, camera, draw.options.step)
    if slices is None:
        return
    numbers = camera_numbers(camera)
    views, height, width, _ = color.shape
    for index in range(len(prepared.fields)):
        cut, ways = make_cut(prepared, index, camera, slices, memory)
        if draw.options.volume == "shared" and views > 1 and not draw.options.depth and depth.size == 0:
            _draw_shared(cut, ways, draw, slices, samples_of(prepared, index, camera, cut), color, memory)
            continue
        own_eyes = draw.options.volume == "exact" and draw.options.shading != "center" and cut.channels > cut.colors
        samples, channels = samples_of(prepared, index, camera, cut), ways.light[0]
        count = min(VIEWS_AT_ONCE, views) * -(-width // RAYS) * BLOCK_ROWS * ROW
        pool = memory.pool(
            (("volume rays", index), samples, slices.slabs, channels, count),
            lambda samples=samples, channels=channels, count=count: (
                new_planes(samples, slices, channels),
                np.zeros(count, np.float32),
                np.zeros(ROW, np.int32),
            ),
        )

        def task(first: int, end: int, cut: Cut = cut, ways: Ways = ways, pool: Any = pool) -> None:
            with pool as (planes, rays, packed):
                together = 1 if own_eyes else VIEWS_AT_ONCE
                args = (ways, draw.offsets, together, own_eyes, draw.options.depth, planes, rays, packed)
                draw_rows((first, end), cut, numbers, slices, *args, color, depth)

        run_rows(height, task)


def new_shared(camera: Camera, slices: Slices, offsets: NDArray[np.float64], fine: int, phases: int) -> Shared:
    """One thread's memory for shared slabs that reach as far as the views see."""
    ends = np.array([slices.first, slices.first + slices.slabs * slices.distance])
    shifts = np.outer(offsets, camera.fx / camera.focal - camera.fx / ends)
    begin = float(np.floor(-shifts.max())) - 2.0
    positions = (camera.width - float(shifts.min()) + 2.0 - begin) * fine
    count = -(-int(np.ceil(positions / phases) + 2) // RAYS) * RAYS
    values = np.zeros(SLABS * phases * SLAB_ROWS * LINE, np.float32)
    return Shared(begin, fine, phases, count, values, np.zeros((SLABS, count // RAYS), np.uint8))


def _draw_shared(
    cut: Cut, ways: Ways, draw: Draw, slices: Slices, samples: int, color: NDArray[np.uint8], memory: Memory
) -> None:
    camera, offsets = draw.camera, draw.offsets
    numbers = camera_numbers(camera)
    key = ("volume shared", samples, slices, ways.light[0], camera.width, camera.fx, camera.focal, offsets.tobytes())
    pool = memory.pool(
        key,
        lambda: (
            new_planes(samples, slices, ways.light[0]),
            new_shared(camera, slices, offsets, FINE_VIEWS, FINE_VIEWS),
            np.zeros(BLOCK_ROWS * ROW, np.float32),
            np.zeros(ROW, np.int32),
            np.zeros(len(offsets) * SLAB_ROWS * LINE, np.float32),
        ),
    )

    def task(first: int, end: int) -> None:
        with pool as (planes, shared, rays, packed, line):
            draw_shared_rows((first, end), cut, numbers, slices, ways, offsets, planes, shared, rays, packed, line, color)

    run_rows(draw.camera.height, task)


def draw_volume_panel(
    prepared: PreparedVolumes, draw: Draw, color: NDArray[np.uint8], depth: NDArray[np.float32], memory: Memory
) -> None:
    raise NotImplementedError
