"""Measuring contenders in turns, and the figures that come out.

All contenders of one work run in one process, one after the other in every round, in alternating order, so that a
machine that slows down slows all of them. A ratio is that of the medians; its noise band is the smallest and the
largest ratio within a round.
"""

from __future__ import annotations

import gc
import math
import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

VECTOR_UNITS = ("sse4_2", "avx", "avx2", "fma", "avx512f", "avx512bw", "asimd", "sve")
Pictures = NDArray[np.uint8]
MAX_FRAMES = 64  # in a row; enough to hide the tail of a frame


def _nothing() -> None:
    pass


@dataclass(frozen=True)
class Contender:
    """One way to do a work.

    Attributes
    ----------
    name : str
    frame : callable
        Does the work once; may return before the work is finished.
    scale : float
        Times are multiplied by it: where `frame` does only a share of a long work, 1 / share.
    finish : callable
        Waits for what `frame` left under way; timed, once after all frames of a turn.
    enter : callable
        Called before a turn, not timed: makes a context current, sets the number of threads.
    release : callable
        Called when the measurement is over.
    """

    name: str
    frame: Callable[[], object]
    finish: Callable[[], object] = _nothing
    enter: Callable[[], object] = _nothing
    release: Callable[[], object] = _nothing
    scale: float = 1.0


@dataclass(frozen=True)
class Times:
    """Seconds per frame of one contender, one value a round; `scale` is already in them."""

    seconds: tuple[float, ...]
    frames: int = 1
    scale: float = 1.0

    @property
    def median(self) -> float:
        """Median over the rounds."""
        return statistics.median(self.seconds)

    def as_dict(self) -> dict[str, float]:
        """Median, minimum, maximum, rounds, frames in a row per round, and what a frame's time was multiplied by."""
        return {
            "median_s": self.median,
            "min_s": min(self.seconds),
            "max_s": max(self.seconds),
            "rounds": len(self.seconds),
            "frames": self.frames,
            "scale": self.scale,
        }


def measure(
    contenders: Sequence[Contender],
    repeats: int,
    minimum: float = 0.1,
    least: int = 1,
    limit: float = math.inf,
    warm: bool = False,
) -> dict[str, Times]:
    """Measure all contenders in turns.

    Parameters
    ----------
    contenders : sequence of Contender
        With different names. Each is run once to warm up and once to find how many frames take `minimum`.
    repeats : int
        Rounds.
    minimum : float
        Seconds that one turn should last: short frames are repeated, up to 64 in a row, and the time is divided.
    least : int
        Frames that one turn should have at least, however long they are.
    limit : float
        Seconds after which no round but the first is begun any more.
    warm : bool
        They have all been run already.

    Returns
    -------
    dict of Times by contender's name
    """
    try:
        begin = time.perf_counter()
        if not warm:
            for contender in contenders:
                _turn(contender, 1)
        once = [_turn(contender, 1) for contender in contenders]
        frames = [min(MAX_FRAMES, max(least, math.ceil(minimum / max(spent, 1e-9)))) for spent in once]
        seconds: list[list[float]] = [[] for _ in contenders]
        collecting = gc.isenabled()
        gc.disable()
        try:
            for turn in range(repeats):
                if turn > 0 and time.perf_counter() - begin >= limit:
                    break
                order = range(len(contenders))
                for k in reversed(order) if turn % 2 else order:
                    seconds[k].append(contenders[k].scale * _turn(contenders[k], frames[k]))
        finally:
            if collecting:
                gc.enable()
    finally:
        for contender in contenders:
            contender.release()
    return {c.name: Times(tuple(s), n, c.scale) for c, s, n in zip(contenders, seconds, frames, strict=True)}


def _turn(contender: Contender, frames: int) -> float:
    """Seconds per frame of `frames` frames in a row."""
    contender.enter()
    start = time.perf_counter()
    for _ in range(frames):
        contender.frame()
    contender.finish()
    return (time.perf_counter() - start) / frames


@dataclass(frozen=True)
class Bar:
    """What is asked of a figure: at least, or at most, `value`."""

    value: float
    at_least: bool = True

    def __str__(self) -> str:
        return f"{'≥' if self.at_least else '≤'} {self.value:g}"

    def met_by(self, reached: float) -> bool:
        """Whether `reached` satisfies the bar."""
        return reached >= self.value if self.at_least else reached <= self.value


@dataclass(frozen=True)
class Figure:
    """One number that was measured.

    Attributes
    ----------
    work, scene, lighting : str
        "" where a work has no scene or no lighting.
    measure : str
        What `value` is, e.g. "moderngl / autostereo".
    value, low, high : float
        The number and its noise band; NaN where it could not be had, `note` says why.
    published : float, optional
        What the paper has, where a table of a paper is reproduced.
    unit : str
    bar : Bar, optional
        What is asked, if anything.
    times : dict of Times by contender
    note : str
    """

    work: str
    measure: str
    value: float
    low: float
    high: float
    unit: str = "×"
    scene: str = ""
    lighting: str = ""
    bar: Bar | None = None
    times: dict[str, Times] | None = None
    note: str = ""
    published: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and strings, ready for JSON; a number that could not be had is None."""
        return {
            "work": self.work,
            "scene": self.scene,
            "lighting": self.lighting,
            "measure": self.measure,
            "value": None if math.isnan(self.value) else self.value,
            "low": None if math.isnan(self.low) else self.low,
            "high": None if math.isnan(self.high) else self.high,
            "unit": self.unit,
            "bar": None if self.bar is None else str(self.bar),
            "met": None if self.bar is None else self.bar.met_by(self.value),
            "times": {name: times.as_dict() for name, times in (self.times or {}).items()},
            "note": self.note,
            "published": self.published,
        }


def band(compute: Callable[..., float], *times: Times) -> tuple[float, float, float]:
    """Value of `compute` at the medians, and its smallest and largest value within a round."""
    rounds = [compute(*seconds) for seconds in zip(*(t.seconds for t in times), strict=True)]
    return compute(*(t.median for t in times)), min(rounds), max(rounds)


def ratio(slow: float, fast: float) -> float:
    """How many times faster `fast` is."""
    return slow / fast


@dataclass(frozen=True)
class Measured:
    """The times of one work's contenders, from which figures are made."""

    work: str
    times: dict[str, Times]
    scene: str = ""
    lighting: str = ""

    def ratio(self, slow: str, fast: str, bar: Bar | None = None, note: str = "") -> Figure:
        """The figure "slow / fast"; its note also says which of the two did only a share of the work."""
        pair = {name: self.times[name] for name in (slow, fast)}
        shares = [f"{name}: 1/{t.scale:g} of its views timed, × {t.scale:g}" for name, t in pair.items() if t.scale > 1]
        return Figure(
            self.work,
            f"{slow} / {fast}",
            *band(ratio, *pair.values()),
            scene=self.scene,
            lighting=self.lighting,
            bar=bar,
            times=self.times,
            note="; ".join([note, *shares] if note else shares),
        )


def unlike(measured: str, stack: Pictures, other: Pictures, scene: str = "") -> Figure:
    """Share of pixels of the outermost views (V, H, W, C) that differ by more than one level in any channel."""
    shares = [
        100 * float(np.mean(np.abs(stack[view].astype(int) - other[view]).max(axis=2) > 1)) for view in (0, -1)
    ]
    note, bar = "of the outermost views, by more than one level", Bar(2, at_least=False)
    return Figure("agreement", measured, max(shares), min(shares), max(shares), "%", scene, bar=bar, note=note)


def cores() -> int:
    """Number of processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine_facts() -> dict[str, Any]:
    """What the figures depend on: processor, vector units, cores, load, software versions."""
    flags, model = _cpuinfo()
    return {
        "processor": model,
        "vector_units": [unit for unit in VECTOR_UNITS if unit in flags],
        "cores": cores(),
        "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in ("autostereo", "numpy", "numba", "llvmlite", "moderngl", "vtk")},
    }


def _cpuinfo() -> tuple[set[str], str]:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return set(), platform.processor() or platform.machine()
    fields = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    flags = set((fields.get("flags") or fields.get("Features") or "").split())
    return flags, fields.get("model name") or platform.machine()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
