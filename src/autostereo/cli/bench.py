"""autostereo bench: measure this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from . import common

BENCHES = ("mesh",)


def bench(
    name: Annotated[str, typer.Argument(metavar="WHAT", help="What to measure: mesh.")] = "mesh",
    json: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Also write the figures here.")] = None,
    only: Annotated[list[str] | None, typer.Option("--only", metavar="WORK", help="Only this; repeatable.")] = None,
    data: Annotated[
        Path | None, typer.Option("--data", metavar="DIR", help="Folder with meshes/bun_zipper.ply (Stanford bunny).")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Small pictures, three rounds: shows that it works.")] = False,
    quiet: common.Quiet = False,
) -> None:
    """Measure rendering speed on this machine.

    Rendering in one pass is compared with the usual loops of one render per view in moderngl and VTK, if they are
    installed (pip install autostereo[bench]). Ratios are of medians, in one run.

    Examples:
      autostereo bench mesh --quick
      autostereo bench mesh --data data --json bench.json
      autostereo bench mesh --only views-48 --only panel-portrait
    """
    if name not in BENCHES:
        raise InputError(f"bench: expected one of {', '.join(BENCHES)}, got {name!r}")
    if json is not None:
        common.check_output(json, (".json",))
    from .benchmarks import mesh, report
    from .benchmarks.contenders import BenchOptions

    options = BenchOptions(quick=quick, only=tuple(only or ()), data=data)
    common.announce_compilation("cpu", "draw_views", "draw_panel")
    facts = mesh.facts(options)  # before the run, whose own load does not count
    results = mesh.run(options, common.note)
    if json is not None:
        report.save(json, results, facts)
    report.show(results, facts)
