"""Volumes of a scene as the kernels read them: prepared once, cut, lit and classified anew in every frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.scene import Scene
from ...scene.volume import Volume
from ..engine import Camera, Draw
from ..options import Options
from ..volumes import Slices, half_spaces
from .memory import Memory
from .scene_arrays import light_array
from .volume_modes import LEVELS
from .volume_rays import BLOCK_ROWS, ROW
from .volume_sample import CHUNK, LIST, LIST_ROWS, Cut, Planes
from .volume_setup import (
    BLOCK,
    TABLE,
    Field,
    is_sharp,
    make_plain,
    make_table,
    prepare_field,
    shown_blocks,
    table_range,
)
from .volume_views import ISO, MIP, Ways

MODES = ("composite", "mip", "iso")  # in the order of volume_views
RUN_STEP = 0.5  # voxels, a sixteenth of a run


@dataclass(frozen=True, eq=False)
class PreparedVolumes:
    """The volumes of a scene, ready to be drawn."""

    scene: Scene
    fields: list[Field]

    @property
    def volumes(self) -> list[Volume]:
        """The volumes themselves."""
        return [f.volume for f in self.fields]

    def is_sharp(self, index: int) -> bool:
        """Whether a volume makes sharp edges; see volume_setup.is_sharp."""
        return is_sharp(self.fields[index].volume, self.fields[index].faces)


def prepare_volumes(scene: Scene, volumes: list[Volume]) -> PreparedVolumes:
    """Prepare all volumes of a scene, of one type if they are several."""
    return PreparedVolumes(scene, [prepare_field(volume, len(volumes) > 1) for volume in volumes])


def update_volumes(prepared: PreparedVolumes, scene: Scene, volumes: list[Volume]) -> PreparedVolumes:
    """The same volumes under other transforms and transfer functions: scalars and gradients stay as they are."""
    pairs = zip(prepared.fields, volumes, strict=True)
    return PreparedVolumes(scene, [field._replace(volume=volume) for field, volume in pairs])


def gradient_turn(camera: Camera, volume: Volume) -> NDArray[np.float32]:
    """Matrix (3, 3) that turns gradients from object to eye space, of about length 1."""
    turn = camera.eye_from_world[:3, :3] @ np.linalg.inv(volume.transform[:3, :3]).T
    return (turn / np.abs(turn).max()).astype(np.float32)


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
    of = (volume, slices.distance)
    table = memory.remember(("table", index), of, partial(make_table, volume.transfer, low, high, slices.distance))
    plain = np.zeros(0, np.uint8)
    if is_shared(prepared, [index], draw.options):
        plain = memory.remember(("plain", index), of, partial(make_plain, table))
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


def pixel_of(cut: Cut, camera: Camera, slices: Slices) -> float:
    """Width of the nearest pixel, in voxels."""
    return float(slices.first / camera.fx * np.abs(cut.from_eye[:, 0]).max())
