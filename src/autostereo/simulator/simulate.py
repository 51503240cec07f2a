"""`simulate`: a scene, a row of cameras and a machine, to a Report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from ..display.rig import Rig
from ..errors import InputError, UnsupportedError
from ..scene.scene import Scene
from .kernels import buffers
from .kernels import state as layout
from .kernels.textures import ACCESSES, LOOKUPS, MISSES
from .machine import Machine
from .pipeline import Pass, Pictures, Setting, make_view, prepare_textures
from .report import COUNTERS, Report
from .textures import BC1_BYTES
from .workload import Workload

MAX_SIDE, MAX_VIEWS, MAX_PIXELS = 8192, 256, 1 << 28  # pixels of all views: some 4 GB
SIZE = (640, 480)
T = TypeVar("T")
R = TypeVar("R")
Counts = NDArray[np.int64]


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
    tally = Tally(machine)
    for span in _spans(rig, machine):
        state = Pass(workload, machine, rig, view, span, pictures)
        state.draw_all(Setting())
        state.finish()
        tally.add(state)
    color = pictures.colors.view(np.uint8).reshape(*pictures.colors.shape, 4)
    return tally.report(workload.name, pictures, color)


def simulate_accumulation(
    scene: Scene | Workload, rigs: Sequence[Rig], machine: Machine, *, size: tuple[int, int] = SIZE
) -> Report:
    """Draw the mean of many views, such as depth of field, into one colour buffer (Hasselgren 2006, section 4.4).

    Each rig is a row of samples, all with the same number of views. For each row the machine draws depths first,
    colours off, then colours where depths are equal, added with weight 1/n. The colour buffer has 16 bits a channel,
    see `pipeline.py`.

    Returns
    -------
    Report
        `color` (1, H, W, 4) is the mean; `depth` that of the last row's views.
    """
    if not rigs:
        raise InputError("rigs: expected at least one")
    if machine.shading.approximate and machine.shading.source == "color-buffer":
        raise UnsupportedError("machine shading.source: a colour buffer that accumulates holds no colours to reuse")
    samples = sum(rig.views for rig in rigs)
    workload = _checked(scene, rigs[0], machine, size)
    pictures = Pictures.common(size, workload.background)
    settings = Setting(color=False), Setting(layout.EQUAL, True, 1.0 / samples)
    tally, stored = Tally(machine), None
    for rig in rigs:
        view = make_view(rig, size)
        for span in _spans(rig, machine):
            state = Pass(workload, machine, rig, view, span, pictures)
            if stored is not None:  # the colour buffer stays, only depths are cleared
                state.color.stored[:] = stored
            state.draw_twice(settings)
            state.finish()
            tally.add(state)
            stored = state.color.stored
    opacity = np.clip(pictures.total[..., 3:], 0, 1)
    rgb = np.clip(pictures.total[..., :3] + (1 - opacity) * np.array(workload.background, np.float32), 0, 1)
    color = np.floor(255 * np.concatenate([rgb, opacity], axis=2) + 0.5).astype(np.uint8)
    return tally.report(workload.name, pictures, color[None])


def _spans(rig: Rig, machine: Machine) -> Iterator[tuple[int, int]]:
    """The views (first, end) of each pass."""
    at_once = machine.traversal.views or rig.views
    for first in range(0, rig.views, at_once):
        yield first, min(first + at_once, rig.views)


def in_parallel(items: Iterable[T], work: Callable[[T], R]) -> list[R]:
    """Results of `work`, in order: one thread for each core that Numba may use, as kernels hold no lock."""
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        return list(pool.map(work, items))


def check_size(views: int, size: tuple[int, int]) -> None:
    """Raise InputError unless the simulator takes so many views of this size."""
    if not 1 <= views <= MAX_VIEWS:
        raise InputError(f"rig views: the simulator takes 1 to {MAX_VIEWS}, got {views}")
    if len(size) != 2 or not all(1 <= side <= MAX_SIDE for side in size):
        raise InputError(f"size: expected sides from 1 to {MAX_SIDE}, got {size}")
    if views * size[0] * size[1] > MAX_PIXELS:
        raise InputError(
            f"size: the simulator takes {MAX_PIXELS} pixels in all views, got {views} of {size[0]}×{size[1]}"
        )


def _checked(scene: Scene | Workload, rig: Rig, machine: Machine, size: tuple[int, int]) -> Workload:
    if not isinstance(machine, Machine):
        raise InputError(f"machine: expected a Machine, got {type(machine).__name__}")
    if not isinstance(rig, Rig):
        raise InputError(f"rig: expected a Rig, got {type(rig).__name__}")
    check_size(rig.views, size)
    machine.check_size(size)
    workload = scene if isinstance(scene, Workload) else Workload.of(Scene.of(scene))
    prepare_textures(workload, machine)  # once, before frames run side by side
    return workload


class Tally:
    """Adds up what the passes over a frame counted."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.counters = dict.fromkeys(COUNTERS, 0)
        self.of_view: Counts | int = 0
        self.runs: Counts | int = 0
        self.depth: NDArray[np.float32] | None = None

    def add(self, state: Pass) -> None:
        """The counters of one finished pass; the depths of its views."""
        texture, totals = state.memory.counts, state.fragments.totals
        line = self.machine.texture.line_bytes
        if self.machine.texture.compression == "bc1":
            line = line * BC1_BYTES // 64
        found = {
            "texels": texture[ACCESSES], "texture_misses": texture[MISSES], "lookups": texture[LOOKUPS],
            "texture_bytes": texture[MISSES] * line,
            "tiles": totals[layout.TILES], "tiles_culled": totals[layout.CULLED],
            "rows": totals[layout.ROWS], "horizon_rows": totals[layout.HORIZON],
        }  # fmt: skip
        for name, buffer in (("depth", state.depth), ("color", state.color)):
            counts = buffer.counts
            found |= {
                f"{name}_read": counts[buffers.READ], f"{name}_written": counts[buffers.WRITTEN],
                f"{name}_hits": counts[buffers.HITS], f"{name}_misses": counts[buffers.MISSES],
                f"{name}_raw": counts[buffers.RAW],
            }  # fmt: skip
        for name, value in found.items():
            self.counters[name] += int(value)
        self.of_view = self.of_view + state.fragments.of_view
        self.runs = self.runs + state.target.runs
        first, last = state.span
        if self.depth is None or first == 0:
            self.depth = np.full(state.depth.values.shape, np.inf, np.float32)
        with np.errstate(divide="ignore"):
            self.depth[first:last] = state.view.near * layout.Z_SCALE / state.depth.values[first:last]

    def report(self, scene: str, pictures: Pictures, color: NDArray[np.uint8]) -> Report:
        """The sums, and the pictures (V, H, W, 4)."""
        assert isinstance(self.of_view, np.ndarray) and isinstance(self.runs, np.ndarray) and self.depth is not None
        views, height, width = self.depth.shape
        return Report(
            self.machine.name, scene, views, (width, height), self.counters,
            self.of_view[:, layout.COVERED], self.of_view[:, layout.PASSED], self.runs, self.of_view[:, layout.REUSED],
            color, self.depth, pictures.how, pictures.misses,
        )  # fmt: skip
