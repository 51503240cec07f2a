"""Several machines, numbers of views and frames: the figures of a comparison, and what they average to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from ..display.rig import Rig
from .machine import Machine
from .model import compare
from .report import Report
from .simulate import SIZE, in_parallel, simulate, simulate_accumulation
from .workload import Workload

Source = Callable[[int, int], tuple[Workload, Rig]]  # frame number, views → what to draw
CLASSES = ("texture", "depth", "color", "total")


@dataclass(frozen=True)
class Study:
    """What to compare.

    Parameters
    ----------
    name : str
    source : callable
        (frame number, views) → (Workload, Rig).
    machines : sequence of Machine
    views : sequence of int
    frames : sequence of int
    size : (width, height)
    """

    name: str
    source: Source
    machines: Sequence[Machine]
    views: Sequence[int] = (1, 2, 4, 8, 16)
    frames: Sequence[int] = tuple(range(0, 200, 20))
    size: tuple[int, int] = SIZE

    def run(self, progress: Callable[[], None] = lambda: None) -> list[dict[str, Any]]:
        """One row for each machine and number of views, in that order: means over the frames, and their spread."""
        rows = []
        for views in self.views:
            of_frame = in_parallel(self.frames, partial(self._frame, views, progress))
            rows += [_summary([figures[k] for figures in of_frame]) for k in range(len(self.machines))]
        return rows

    def _frame(self, views: int, progress: Callable[[], None], number: int) -> list[dict[str, Any]]:
        workload, rig = self.source(number, views)
        exact: Report | None = None
        rows = []
        for machine in self.machines:
            start = perf_counter()
            report = simulate(workload, rig, machine, size=self.size)
            seconds = perf_counter() - start
            changes_pictures = machine.shading.approximate or machine.shading.unified_camera
            compresses = machine.texture.compression != "none"
            if not changes_pictures and not compresses:
                exact = exact or report
            quality = None
            if changes_pictures:
                if exact is None:
                    exact = simulate(workload, rig, _exact(machine), size=self.size)
                quality = report.psnr(exact)
            triangles = max(1, sum(len(draw.corners) for draw in workload.draws))
            size = {"pixels_per_triangle": float(report.covered.sum() / (views * triangles))}
            rows.append(figures_of(report, machine, seconds, quality) | size)
            progress()
        return rows


def _exact(machine: Machine) -> Machine:
    return machine.with_(shading={"approximate": False, "unified_camera": False}, texture={"compression": "none"})


def figures_of(report: Report, machine: Machine, seconds: float, quality: Any = None) -> dict[str, Any]:
    """The numbers of one frame."""
    counters = report.counters
    approximated_views = report.approximated > 0
    share = report.share_approximated[approximated_views]
    finite = np.empty(0)
    if quality is not None:  # of what is approximated; without that, of all views that a unified camera changes
        chosen = quality[approximated_views] if approximated_views.any() else quality
        finite = chosen[np.isfinite(chosen)]
    return {
        "machine": machine.name, "scene": report.scene, "views": report.views, "size": list(report.size),
        "texture": report.texture_bytes, "depth": report.depth_bytes, "color": report.color_bytes,
        "total": report.total_bytes, "miss_rate": report.miss_rate,
        "shaded": int(report.shaded.sum()), "approximated": int(report.approximated.sum()),
        "share_approximated": float(share.mean()) if len(share) else 0.0,
        "psnr": float(finite.mean()) if len(finite) else None,
        "psnr_min": float(finite.min()) if len(finite) else None,
        "depth_ratio": counters["depth_raw"] / max(1, counters["depth_written"]),
        "color_ratio": counters["color_raw"] / max(1, counters["color_written"]),
        "tiles_culled": counters["tiles_culled"] / max(1, counters["tiles"]),
        "horizon_rows": counters["horizon_rows"] / max(1, counters["rows"]),
        "texels_per_second": counters["texels"] / seconds,
        "seconds": seconds,
        "counters": report.counters,
        "share_of_view": report.share_approximated.tolist(),
        "psnr_of_view": [None] * report.views if quality is None else [q if np.isfinite(q) else None for q in quality],
        "model": compare(report),
    }  # fmt: skip


def _summary(figures: list[dict[str, Any]]) -> dict[str, Any]:
    """Means over frames; for bytes also their least and greatest."""
    row = dict(figures[0])
    for key, value in figures[0].items():
        if isinstance(value, float) or key in (*CLASSES, "shaded", "approximated", "psnr", "psnr_min"):
            row[key] = _mean([f[key] for f in figures])
    for key in ("share_of_view", "psnr_of_view"):
        row[key] = [_mean(list(of_view)) for of_view in zip(*(f[key] for f in figures), strict=True)]
    row["counters"] = {name: _mean([f["counters"][name] for f in figures]) for name in figures[0]["counters"]}
    row["frames"] = len(figures)
    for key in CLASSES:
        row[f"{key}_range"] = [float(min(f[key] for f in figures)), float(max(f[key] for f in figures))]
    if "model" in row:
        row["model"] = _mean_model(figures)
    return row


def _mean(values: Sequence[float | None]) -> float | None:
    """The mean of what is known."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _mean_model(figures: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    return {
        line: {k: float(np.mean([f["model"][line][k] for f in figures])) for k in terms}
        for line, terms in figures[0]["model"].items()
    }


@dataclass(frozen=True)
class FieldStudy:
    """Depth of field on several machines (section 6.1): a square grid of samples over the lens.

    Parameters
    ----------
    source : callable
        (frame number, views) → (Workload, Rig).
    machines : sequence of Machine
    samples : (columns, rows)
    aperture : float
        Side of the square lens, world units.
    views : sequence of int
        How many views the multi-view machines draw at once.
    """

    source: Source
    machines: Sequence[Machine]
    samples: tuple[int, int]
    aperture: float
    views: Sequence[int] = (1, 2, 4, 8, 16)
    frames: Sequence[int] = (0,)
    size: tuple[int, int] = SIZE

    def run(self, progress: Callable[[], None] = lambda: None) -> list[dict[str, Any]]:
        """One row for each machine and number of views that it draws at once.

        "optimum": the bytes of a multi-view machine if in each pass all views but one cost no texture and no colour
        (section 6.1), as far as it was also run with one view at once.
        """
        cases = [(machine, views) for views in self.views for machine in self.machines]

        def one(case: tuple[Machine, int]) -> list[dict[str, Any]]:
            rows = []
            for number in self.frames:
                workload, rig = self.source(number, 1)
                machine = case[0].with_(traversal={"views": case[1]})
                start = perf_counter()
                rigs = lens(rig, self.samples, self.aperture)
                report = simulate_accumulation(workload, rigs, machine, size=self.size)
                figures = figures_of(report, case[0], perf_counter() - start)
                del figures["model"]  # the formulas are about views that have a colour buffer each
                rows.append(figures | {"views": case[1]})
                progress()
            return rows

        rows = [_summary(figures) for figures in in_parallel(cases, one)]
        multi = {machine.name for machine in self.machines if machine.traversal.order != "by-view"}
        single = {row["machine"]: row for row in rows if row["views"] == 1 and row["machine"] in multi}
        for row in rows:
            base = single.get(row["machine"])
            row["optimum"] = base and base["depth"] + (base["texture"] + base["color"]) / row["views"]
        return rows


def lens(rig: Rig, samples: tuple[int, int], aperture: float) -> list[Rig]:
    """Rows of cameras that sample a square lens at the centres of a grid; what is in focus is the rig's focal plane."""
    columns, rows = samples
    heights = (np.arange(rows) - (rows - 1) / 2) * (aperture / rows)
    baseline = aperture * (columns - 1) / columns
    return [replace(rig, views=columns, baseline=baseline, offset_y=float(y)) for y in heights]
