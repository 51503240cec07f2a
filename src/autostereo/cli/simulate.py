"""autostereo simulate: a scene on simulated multi-view rasterisation hardware."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from . import common, outputs

if TYPE_CHECKING:
    from ..display.rig import Rig
    from ..simulator import Machine, Workload

DEFAULTS = ("bf-tx", "multi-view", "multi-view-approximate")
LENS_DEFAULTS = ("bf-dc", "multi-view")
PATH = 200  # frames of the procedural scenes
MAX_VIEWS = 256


def simulate(
    scene: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="level, soft-shadows, ocean, atrium, relief; or files of meshes."),
    ],
    machine: Annotated[
        list[str] | None,
        typer.Option("--machine", "-m", metavar="NAME", help="Built-in machine or a .toml of your own; repeatable."),
    ] = None,
    views: Annotated[str, typer.Option("--views", "-n", metavar="V,…", help="Numbers of views.")] = "1,2,4,8,16",
    size: common.Size = None,
    every: Annotated[
        int | None,
        typer.Option("--every", metavar="N", help="Every N-th of 200 frames: 20; with --depth-of-field the first."),
    ] = None,
    camera: common.Camera = None,
    side: common.Side = "front",
    lens: Annotated[
        str | None,
        typer.Option("--depth-of-field", metavar="NxM", help="Instead: the mean of so many samples of a lens."),
    ] = None,
    aperture: Annotated[float, typer.Option("--aperture", help="Side of the square lens, scene units.")] = 0.1,
    json: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write all figures here.")] = None,
    chart: Annotated[Path | None, typer.Option("--chart", metavar="FILE", help="Draw bytes against views.")] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="All views of the first frame, approximated pixels green."),
    ] = None,
    quiet: common.Quiet = False,
) -> None:
    """Count the bytes that multi-view rasterisation hardware moves (Hasselgren and Akenine-Möller 2006).

    Built-in machines: multi-view (each triangle to all views, tiles sorted for the texture cache),
    multi-view-approximate, scanline, by-triangle (not sorted), bf-tx and bf-dc (view by view, the same bytes of cache
    spent on textures, or on depth and colour). Their .toml files are models for your own.

    Examples:
      autostereo simulate level
      autostereo simulate ocean -m bf-tx -m multi-view --views 4,16 --json ocean.json --chart ocean.png
      autostereo simulate level.obj -m machine.toml --views 8 --picture approximated.png
      autostereo simulate atrium --depth-of-field 16x16
    """
    from ..simulator import Machine, study
    from ..simulator.simulate import check_size

    names = machine or (LENS_DEFAULTS if lens else DEFAULTS)
    machines = [Machine.load(name) for name in names]
    called = [one.name for one in machines]
    if len(set(called)) < len(called):
        raise InputError(f"--machine: expected machines of different names, got {', '.join(called)}")
    counts = _counts(views)
    pixels = common.parse_size(size) if size else study.SIZE
    check_size(max(counts), pixels)
    for one in machines:
        one.check_size(pixels)
    if every is None:
        every = PATH if lens else 20  # 16×16 samples of one frame are as much work as 16 frames of 16 views
    if not 1 <= every <= PATH:
        raise InputError(f"--every: expected a number from 1 to {PATH}, got {every}")
    if not 0 < aperture < float("inf"):
        raise InputError(f"--aperture: expected a number > 0, got {aperture:g}")
    samples = common.parse_pair(lens, "--depth-of-field", 64) if lens else (1, 1)
    if picture is not None and lens is not None:
        raise InputError("--picture: shows views, not --depth-of-field")
    for path, suffixes in ((json, (".json",)), (chart, (".png", ".svg", ".pdf"))):
        if path is not None:
            outputs.check_output(path, suffixes)
    if picture is not None:
        outputs.check_image(picture)
    from ..simulator import output

    if chart is not None:
        output.need_matplotlib()
    name, source, frames = _source(scene, max(counts), pixels, camera, side, every)
    work: study.Study | study.FieldStudy
    if lens is not None:
        work = study.FieldStudy(source, machines, samples, aperture, counts, frames, pixels)
    else:
        work = study.Study(name, source, machines, counts, frames, pixels)
    steps = len(counts) * len(machines) * len(frames)
    with common.working(f"simulating {name}", steps) as step:
        rows = work.run(step)
    if json is not None:
        output.save(json, rows)
    if chart is not None:
        output.save_chart(chart, rows)
    if picture is not None:
        _save_picture(picture, source(frames[0], max(counts)), machines, pixels)
    if not common.STATE.quiet:
        output.show(rows)


def _counts(text: str) -> list[int]:
    counts = sorted(common.whole_number(part) or 0 for part in text.split(","))
    if not 1 <= counts[0] <= counts[-1] <= MAX_VIEWS:
        raise InputError(f"--views: expected numbers from 1 to {MAX_VIEWS} separated by commas, got {text[:60]!r}")
    if len(set(counts)) < len(counts):
        raise InputError(f"--views: expected each number once, got {text!r}")
    return counts


def _source(
    scene: Sequence[str], most: int, size: tuple[int, int], camera: Path | None, side: str, every: int
) -> tuple[str, Callable[[int, int], tuple[Workload, Rig]], list[int]]:
    """What to draw: (name, (frame, views) → (workload, rig), frames)."""
    from ..simulator import Workload
    from ..simulator.scenes import SCENES

    if len(scene) == 1 and scene[0] in SCENES:
        if camera is not None or side != "front":
            raise InputError(f"--camera and --from: {scene[0]} has its own camera path")
        return scene[0], SCENES[scene[0]].at, list(range(0, PATH, every))
    for one in scene:
        if one in SCENES and not Path(one).exists():
            found = f"got {len(scene)} names"
            raise InputError(f"scene: the built-in {one} stands alone, expected one scene or files, {found}")
        if not Path(one).exists() and Path(one).suffix == "":
            raise InputError(f"scene: expected {', '.join(SCENES)} or a file, got {one!r}")
    common.check_side(side, camera)
    loaded = common.load_scene([Path(one) for one in scene], None)
    rig = common.frame_views(loaded, common.load_camera(camera), most if camera is None else None, size, None, side)
    workload = Workload.of(loaded, common.stem(Path(scene[0])))
    spacing = rig.baseline / max(1, rig.views - 1)  # neighbours stay as far apart, whatever the number of views

    def at(_: int, views: int) -> tuple[Workload, Rig]:
        return workload, replace(rig, offsets=None, views=views, baseline=spacing * (views - 1))

    return workload.name, at, [0]


def _save_picture(
    path: Path, frame: tuple[Workload, Rig], machines: Sequence[Machine], size: tuple[int, int]
) -> None:
    from ..image import write_image
    from ..simulator import output, simulate

    chosen: Any = next((m for m in machines if m.shading.approximate), machines[-1])
    write_image(path, output.approximation_picture(simulate(*frame, chosen, size=size, maps=True)))
