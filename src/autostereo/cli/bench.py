"""autostereo bench: measure this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from . import common, outputs

BENCHES = ("mesh", "volume", "points", "papers")


def bench(
    name: Annotated[
        str, typer.Argument(metavar="WHAT", help="What to measure: mesh, volume, points or papers.")
    ] = "mesh",
    works: Annotated[
        list[str] | None, typer.Argument(metavar="WORK", help="Only these works.", show_default=False)
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Also write the figures here.")] = None,
    repeats: Annotated[
        int | None, typer.Option("--repeats", metavar="N", help="Rounds; 7, or 3 with --quick; papers: 3, 1.")
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option("--data", metavar="DIR", help="Folder with meshes/… (mesh, papers), volumes/… (papers)."),
    ] = None,
    budget: Annotated[
        float | None, typer.Option("--budget", metavar="SECONDS", help="Begin no work any more after this time.")
    ] = None,
    plots: Annotated[
        Path | None,
        typer.Option("--plots", "--plot", metavar="DIR", help="Charts (PNG) of papers, as the papers have them."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Small pictures, three rounds: shows that it works.")] = False,
    quiet: common.Quiet = False,
) -> None:
    """Measure rendering speed on this machine.

    Rendering in one pass is compared with one render per view: by this engine (volume, points) and by the usual loops
    in moderngl (mesh) and VTK (mesh, volume), if they are installed (pip install autostereo[bench]). Ratios are of
    medians, in one run. papers: the tables of the papers that engine gl follows, beside their printed figures.

    Examples:
      autostereo bench mesh --quick
      autostereo bench mesh --data data --json bench.json
      autostereo bench volume views-48 panels-8 --repeats 15
      autostereo bench points
      autostereo bench papers 2007a-table1 2007b-points --json papers.json --plots charts
    """
    if name not in BENCHES:
        raise InputError(f"bench: expected one of {', '.join(BENCHES)}, got {name!r}")
    if json is not None:
        outputs.check_output(json, (".json",))
    if plots is not None and name != "papers":
        raise InputError(f"bench --plots: only papers has charts, got {name!r}")
    if plots is not None:
        outputs.check_folder(plots)
    from .benchmarks import report
    from .benchmarks.papers_plots import need_matplotlib
    from .benchmarks.suite import BenchOptions

    options = BenchOptions(quick=quick, only=tuple(works or ()), data=data, repeats=repeats, budget=budget)
    report.check(name, options)
    if plots is not None:
        need_matplotlib()
    results = report.bench(name, options, json, common.note)
    if plots is not None:
        report.plot(plots, results)
