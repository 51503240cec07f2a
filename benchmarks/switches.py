"""What the scripts beside this file share: the command line."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from autostereo.cli.benchmarks import report
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.errors import AutostereoError


def main(name: str, description: str | None) -> None:
    """Read the command line, measure, print."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--quick", action="store_true", help="small pictures, three rounds, no bars")
    works = list(report.SUITES[name].WORKS)
    parser.add_argument("only", nargs="*", metavar="WORK", help=f"only these: {', '.join(works)}")
    parser.add_argument("--repeats", type=int, help="rounds (7)")
    parser.add_argument("--json", type=Path, help="also write the numbers here")
    if name == "papers":
        parser.add_argument("--data", type=Path, help="folder with meshes/…, volumes/…")
        parser.add_argument("--budget", type=float, help="seconds after which no work is begun")
        parser.add_argument("--plots", type=Path, help="folder for charts")
    else:
        parser.add_argument("--engine", default="cpu", help="what is measured (cpu)")
    if name == "mesh":
        parser.add_argument("--data", type=Path, help="folder with meshes/bun_zipper.ply")
        parser.add_argument("--specular", type=float, default=0.0, help="highlight of per-sample-lit surfaces (0)")
    chosen = vars(parser.parse_args())
    path, plots = chosen.pop("json"), chosen.pop("plots", None)
    try:
        results = report.bench(name, BenchOptions(**chosen | {"only": tuple(chosen["only"])}), path)
        if plots is not None:
            report.plot(plots, results)
    except AutostereoError as error:
        raise SystemExit(f"{Path(sys.argv[0]).name}: {error}") from None
