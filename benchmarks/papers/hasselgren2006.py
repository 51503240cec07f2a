"""The figures of Hasselgren and Akenine-Möller 2006 from our own runs, printed beside theirs.

python benchmarks/papers/hasselgren2006.py [EXPERIMENT ...] [--every 20] [--json FILE] [--mesh level.obj]
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import autostereo as aus
from autostereo.simulator import Machine, Workload
from autostereo.simulator.scenes import SCENES
from autostereo.simulator.study import FieldStudy, Study

MACHINES = {name: Machine.load(name) for name in Machine.names()}
TX, DC, TRI = MACHINES["bf-tx"], MACHINES["bf-dc"], MACHINES["by-triangle"]
OURS, APPROXIMATE = MACHINES["multi-view"], MACHINES["multi-view-approximate"]
Rows = list[dict[str, Any]]


def line(row: dict[str, Any], label: str = "") -> str:
    share = f"{row['share_approximated']:.1%}" if row["share_approximated"] else "-"
    psnr = f"{row['psnr']:.1f}" if row["psnr"] else "-"
    megabytes = " ".join(f"{key} {row[key] / 1e6:8.2f}" for key in ("texture", "depth", "color", "total"))
    return (
        f"{row['scene']:13} {row['views']:3} views {label or row['machine']:24} {megabytes} MB, "
        f"m {row['miss_rate']:.3f}, approximated {share}, PSNR {psnr} dB, depth packed {row['depth_ratio']:.2f}, "
        f"colour {row['color_ratio']:.3f}, horizon {row['horizon_rows']:.2%}, "
        f"{row['texels_per_second'] / 1e6:.0f} Mtexel/s"
    )


def study(name: str, machines: list[Machine], views: tuple[int, ...], frames: range, **more: Any) -> Rows:
    rows = Study(name, SCENES[name].at, machines, views, frames, **more).run()
    for row in rows:
        print(line(row), flush=True)
    return rows


def level(frames: range) -> Rows:
    """Figure 8, left: texture bandwidth nearly constant from 1 to 16 views."""
    return study("level", [TX, DC, TRI, OURS, APPROXIMATE], (1, 2, 4, 8, 16), frames)


def shadows(frames: range) -> Rows:
    """Figure 8, middle: the same; PSNR 36 to 40 dB with a unified camera."""
    unified = APPROXIMATE.with_(name="approximate, unified", shading={"unified_camera": True})
    return study("soft-shadows", [TX, OURS, unified], (1, 2, 4, 8, 16), frames)


def ocean(frames: range) -> Rows:
    """Figure 8, right: worse than BF TX beyond eight views at 6 kB, better at 12 kB, and in 4 passes of a 4-view
    machine."""
    twice = [m.with_(name=f"{m.name} 12 kB", texture={"bytes": 12288}) for m in (TX, OURS)]
    passes = OURS.with_(name="multi-view, 4 at once", traversal={"views": 4})
    unified = OURS.with_(name="multi-view, unified", shading={"unified_camera": True})
    return study("ocean", [TX, OURS, *twice, passes, unified], (1, 2, 4, 8, 16), frames)


def small(frames: range) -> Rows:
    """Section 6.2: a four-view machine. Paper: 80×60 100 / 31.3 / 28.5 %; 640×480 100 / 88.8 / 27.3 %."""
    rows: Rows = []
    for size in ((80, 60), (640, 480)):
        found = study("level", [TX, TRI, OURS], (4,), frames, size=size)
        shares = " / ".join(f"{row['texture'] / found[0]['texture']:.1%}" for row in found)
        width = f"{size[0]}×{size[1]}, {found[0]['pixels_per_triangle']:.2f} pixels a triangle"
        print(f"{width}: BF TX / triangle by triangle / sorted = {shares}")
        rows += found
    return rows


def approximation(frames: range) -> Rows:
    """Section 6: 95 % approximated in stereo, 80 % at 16 views, about 40 dB; the share falls with the views'
    divergence."""
    rows: Rows = []
    variants = {
        "k = 1": {"tiles": 1}, "k = 2": {"tiles": 2}, "k = 4": {}, "k = 8": {"tiles": 8},
        "single: shade": {"single_neighbour": "shade"}, "tent": {"filter": "tent"}, "largest": {"exact": "largest"},
        "4 sets": {"sets": 4}, "colour buffer": {"source": "color-buffer"},
    }  # fmt: skip
    machines = [APPROXIMATE.with_(name=name, shading=change) for name, change in variants.items()]
    rows += study("level", [OURS, *machines], (16,), frames)
    for spacing in (0.01, 0.03, 0.1, 0.3):
        wide = replace(SCENES["level"], spacing=spacing)
        for row in Study("level", wide.at, [OURS, APPROXIMATE], (2, 16), frames).run():
            print(line(row, f"{spacing} apart, {row['machine']}"), flush=True)
            rows.append(row | {"spacing": spacing})
    return rows


def field(frames: range) -> Rows:
    """Figure 10: 16×16 samples of an aperture; near the optimum, at which all views but one cost no texture and
    colour."""
    rows = FieldStudy(SCENES["atrium"].at, [DC, TX, OURS], (16, 16), 0.15, (1, 4, 16), frames[:1]).run()
    best = {row["views"]: row["optimum"] for row in rows if row["optimum"]}
    for row in rows:
        print(line(row), f"total / optimum {row['total'] / best[row['views']]:.2f}", flush=True)
    return rows


def resolution(frames: range) -> Rows:
    """Section 6: bandwidth grows slightly less than the number of pixels."""
    rows: Rows = []
    for size in ((320, 240), (640, 480), (1280, 960)):
        rows += study("level", [TX, OURS], (4,), frames, size=size)
    return rows


def orders(frames: range) -> Rows:
    """The measures, and scanlines: dot (4), axis with and without its sign, tiles of one pixel."""
    machines = [TRI, OURS] + [
        OURS.with_(name=name, traversal={"measure": name}) for name in ("dot", "axis-unsigned")
    ]
    return study("level", [*machines, MACHINES["scanline"].with_(depth={"z_max": False})], (8,), frames)


def mesh(path: Path) -> Rows:
    """A real game level, from the middle of its triangles in six directions."""
    scene = aus.load(path)
    workload = Workload.of(scene, path.stem)
    middle = np.median(np.concatenate([draw.corners.mean(axis=1) for draw in workload.draws]), axis=0)
    unit = float(np.ptp(scene.bounds, axis=0).max()) / 2000  # some 12 cm of a level of 250 m

    def at(number: int, views: int) -> tuple[Workload, aus.Rig]:
        angle = 2 * np.pi * number / 6
        target = middle + 50 * unit * np.array([np.sin(angle), -0.05, np.cos(angle)])
        wide = 0.5 * unit * (views - 1)
        return workload, aus.Rig(tuple(middle), tuple(target), fov_y=60.0, near=unit, views=views, baseline=wide)

    rows = Study(path.stem, at, [TX, TRI, OURS, APPROXIMATE], (1, 4, 16), range(6)).run()
    for row in rows:
        print(line(row), flush=True)
    return rows


EXPERIMENTS: dict[str, Callable[[range], Rows]] = {
    "level": level, "small": small, "ocean": ocean, "approximation": approximation, "orders": orders, "resolution":
    resolution, "field": field, "shadows": shadows,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT")
    parser.add_argument("--every", type=int, default=20)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--mesh", type=Path)
    arguments = parser.parse_args()
    frames = range(0, 200, arguments.every)
    results: dict[str, Rows] = {}
    names = arguments.experiments or ([] if arguments.mesh else list(EXPERIMENTS))
    for name in names:
        print(f"\n{name}: {EXPERIMENTS[name].__doc__}", flush=True)
        results[name] = EXPERIMENTS[name](frames)
    if arguments.mesh:
        print(f"\n{arguments.mesh}", flush=True)
        results["mesh"] = mesh(arguments.mesh)
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
