"""autostereo's mesh rendering against its peers; the same as ``autostereo bench mesh``, with every switch."""

from __future__ import annotations

import argparse
from pathlib import Path

from autostereo.cli.benchmarks import mesh, report
from autostereo.cli.benchmarks.contenders import BenchOptions
from autostereo.errors import AutostereoError


def main() -> None:
    """Read the command line, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small pictures, three rounds, no bars")
    parser.add_argument("--only", action="append", default=[], choices=list(mesh.WORKS), help="may be repeated")
    parser.add_argument("--data", type=Path, help="folder with meshes/bun_zipper.ply")
    parser.add_argument("--repeats", type=int, help="rounds (7)")
    parser.add_argument("--specular", type=float, default=0.0, help="highlight of per-sample-lit surfaces (0)")
    parser.add_argument("--json", type=Path, help="also write the numbers here")
    chosen = parser.parse_args()
    options = BenchOptions(chosen.quick, tuple(chosen.only), chosen.data, chosen.repeats, chosen.specular)
    report.bench(options, chosen.json)


if __name__ == "__main__":
    try:
        main()
    except AutostereoError as error:
        raise SystemExit(f"mesh.py: {error}") from None
