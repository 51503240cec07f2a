"""`simulate`: a scene, a row of cameras and a machine, to a Report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numba
import numpy as np

from ..display.rig import Rig
from ..errors import InputError
from ..scene.scene import Scene
from .kernels import buffers, raster
from .kernels.textures import ACCESSES, LOOKUPS, MISSES
from .machine import Machine
from .pipeline import Pass, Pictures, Setting, make_view, prepare_textures
from .report import COUNTERS, Report
from .textures import BC1_BYTES
from .workload import Workload

MAX_SIDE, MAX_VIEWS = 8192, 256
SIZE = (640, 480)
T = TypeVar("T")


def simulate(
    scene: Scene | Workload, rig: Rig, machine: Machine, *, size: tuple[int, int] = SIZE, maps: bool = False
) -> Report:
    """Draw one frame on a simulated machine.

    Parameters
    ----------
    scene : Scene or Workload
        Meshes; or draws with shaders of their own.
    rig : Rig
        The views.
    machine : Machine
    size : (width, height)
        Of each view.
    maps : bool
        Also keep, per pixel, how it was made and its texture cache misses.

    Returns
    -------
    Report

    Raises
    ------
    InputError, UnsupportedError
        A tile is larger than the frame, the size is impossible, or the scene holds something other than meshes.
    """
    workload = _checked(scene, rig, machine, size)
    view = make_view(rig, size)
    shape = (rig.views, size[1], size[0])
    pictures = Pictures.empty(shape, workload.background, maps)
    passes = []
    at_once = machine.traversal.views or rig.views
    for first in range(0, rig.views, at_once):
        state = Pass(workload, machine, rig, view, (first, min(first + at_once, rig.views)), pictures)
        state.draw_all(Setting())
        state.finish()
        passes.append(state)
    return report_of(machine, workload, passes, pictures)


def simulate_accumulation(
    scene: Scene | Workload, rigs: Sequence[Rig], machine: Machine, *, size: tuple[int, int] = SIZE
) -> Report:
    """Draw the mean of many views, such as depth of field, into one colour buffer (Hasselgren 2006, section 4.4).

    Each rig is a row of samples, all with the same number of views. For each row the machine draws depths first, colours off, then
    colours where depths are equal, added with weight 1/n. The colour buffer has 16 bits a channel, see `pipeline.py`.

    Returns
    -------
    Report
        `color` (1, H, W, 4) is the mean; `depth` (1, H, W) that of the last row's first view.
    """
    if not rigs:
        raise InputError("rigs: expected at least one")
    samples = sum(rig.views for rig in rigs)
    workload = _checked(scene, rigs[0], machine, size)
    pictures = Pictures.common(size, workload.background)
    settings = Setting(color=False), Setting(raster.EQUAL, True, 1.0 / samples)
    passes = []
    for rig in rigs:
        view = make_view(rig, size)
        at_once = machine.traversal.views or rig.views
        for first in range(0, rig.views, at_once):
            state = Pass(workload, machine, rig, view, (first, min(first + at_once, rig.views)), pictures)
            if passes:  # the colour buffer stays; only depths are cleared
                state.color.stored[:] = passes[-1].color.stored
            state.draw_twice(settings)
            state.finish()
            passes = [*passes[:0], state] if not passes else [_merged(passes[0], state)]
    total = pictures.total
    opacity = np.clip(total[..., 3:], 0, 1)
    rgb = np.clip(total[..., :3] + (1 - opacity) * np.array(workload.background, np.float32), 0, 1)
    color = np.floor(255 * np.concatenate([rgb, opacity], axis=2) + 0.5).astype(np.uint8)
    report = report_of(machine, workload, passes, pictures)
    return Report(**(vars(report) | {"color": color[None], "depth": report.depth[:1]}))


def simulate_all(
    frames: Iterable[T], simulate_one: Callable[[T], Report], progress: Callable[[], None] = lambda: None
) -> list[Report]:
    """Frames in parallel, one thread for each core Numba may use; the reports are in order and do not depend on it."""
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:

        def one(frame: T) -> Report:
            report = simulate_one(frame)
            progress()
            return report

        return list(pool.map(one, frames))


def _checked(scene: Scene | Workload, rig: Rig, machine: Machine, size: tuple[int, int]) -> Workload:
    if not isinstance(machine, Machine):
        raise InputError(f"machine: expected a Machine, got {type(machine).__name__}")
    if not isinstance(rig, Rig):
        raise InputError(f"rig: expected a Rig, got {type(rig).__name__}")
    if not 1 <= rig.views <= MAX_VIEWS:
        raise InputError(f"rig views: the simulator takes 1 to {MAX_VIEWS}, got {rig.views}")
    if len(size) != 2 or not all(1 <= side <= MAX_SIDE for side in size):
        raise InputError(f"size: expected sides from 1 to {MAX_SIDE}, got {size}")
    machine.check_size(size)
    workload = scene if isinstance(scene, Workload) else Workload.of(Scene.of(scene))
    prepare_textures(workload, machine)  # once, before frames run side by side
    return workload


def report_of(machine: Machine, workload: Workload, passes: Sequence[Pass], pictures: Pictures) -> Report:
    """Add up the counters of all passes over a frame."""
    counters = dict.fromkeys(COUNTERS, 0)
    line = machine.texture.line_bytes
    if machine.texture.compression == "bc1":
        line = line * BC1_BYTES // 64
    for state in passes:
        texture, totals = state.memory.counts, state.fragments.totals
        found = {
            "texels": texture[ACCESSES], "texture_misses": texture[MISSES], "lookups": texture[LOOKUPS],
            "texture_bytes": texture[MISSES] * line,
            "tiles": totals[raster.TILES], "tiles_culled": totals[raster.CULLED],
            "rows": totals[raster.ROWS], "horizon_rows": totals[raster.HORIZON],
        }  # fmt: skip
        for name, buffer in (("depth", state.depth), ("color", state.color)):
            counts = buffer.counts
            found |= {
                f"{name}_read": counts[buffers.READ], f"{name}_written": counts[buffers.WRITTEN],
                f"{name}_hits": counts[buffers.HITS], f"{name}_misses": counts[buffers.MISSES],
                f"{name}_raw": counts[buffers.RAW],
            }  # fmt: skip
        for name, value in found.items():
            counters[name] += int(value)
    of_view = sum(state.fragments.of_view for state in passes)
    near = passes[0].view.near
    z = sum(state.depth.values for state in passes)  # each pass has only its own views
    with np.errstate(divide="ignore"):
        depth = (near * raster.Z_SCALE / z).astype(np.float32)
    views, height, width = z.shape
    return Report(
        machine.name, workload.name, views, (width, height), counters,
        of_view[:, raster.COVERED], of_view[:, raster.PASSED], sum(state.target.runs for state in passes),
        of_view[:, raster.REUSED], pictures.colors.view(np.uint8).reshape(*pictures.colors.shape, 4), depth,
        pictures.how, pictures.misses,
    )  # fmt: skip
