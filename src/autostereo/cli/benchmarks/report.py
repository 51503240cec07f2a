"""Showing and saving what a benchmark measured. SUITES lists every benchmark."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from ...errors import InputError
from ...image import write_atomic
from . import mesh, papers, points, volume
from .suite import BenchOptions, Say, check_works

Results = Sequence[dict[str, Any]]

# each has WORKS, run, facts
SUITES: dict[str, ModuleType] = {"mesh": mesh, "volume": volume, "points": points, "papers": papers}


def check(name: str, options: BenchOptions) -> None:
    """Raise InputError, before anything is measured, where a work or the data folder is none."""
    check_works(name, SUITES[name].WORKS, options.only)
    if options.data is None:
        return
    if name == "mesh":
        mesh.check_bunny(options.data)
    elif not any((options.data / kind).is_dir() for kind in ("meshes", "volumes")):
        raise InputError(f"{options.data}: expected a folder with meshes/ or volumes/, found none")


def unread(name: str, options: BenchOptions) -> str:
    """What is not drawn of the data folder that was given, in one line; nothing where it is used."""
    if options.data is None:
        return ""
    if name in ("volume", "points"):
        return f"--data {options.data} is not used: bench {name} makes its own data"
    drawn = "small spheres are drawn, its bunny only by work start" if name == "mesh" else "small stand-ins are drawn"
    return f"--data {options.data} is not used with --quick: {drawn}" if options.quick else ""


def bench(name: str, options: BenchOptions, path: Path | None = None, say: Say = print) -> Results:
    """Measure, print the tables and, if `path` is given, write everything as JSON.

    Parameters
    ----------
    name : {"mesh", "volume", "points", "papers"}
    options : BenchOptions
    path : Path, optional
        Written after each work, so that what is measured stays when a later one fails.
    say : callable
        Is told in one line what is being measured and what is left out.
    """
    check(name, options)
    if left := unread(name, options):
        say(left)
    suite = SUITES[name]
    facts = suite.facts(options)  # before the run, whose own load does not count

    def keep(found: Results) -> None:
        if path is not None:
            save(path, found, facts)

    results = suite.run(options, say, keep)
    keep(results)
    show(results, facts)
    return results


def show(results: Results, facts: dict[str, Any]) -> None:
    """Print the machine, a table of figures with their bars, and a table of times."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        console.width = max(console.width, 150)  # a pipe has no width: do not cut the tables to 80 columns
    for line in describe(facts):
        console.print(line, highlight=False)
    console.print(_figures(results))
    if any(figure["times"] and figure["unit"] != "fps" for figure in results):  # rates say it already
        console.print(_times(results))
    asked = [figure for figure in results if figure["met"] is not None]
    console.print(f"{sum(figure['met'] for figure in asked)} of {len(asked)} bars met", highlight=False)


def describe(facts: dict[str, Any]) -> list[str]:
    """The machine facts as lines."""
    versions = ", ".join(f"{name} {number}" for name, number in facts["versions"].items() if number)
    lines = [
        f"{facts['processor']}, {facts['cores']} cores, {' '.join(facts['vector_units'])}, load {facts['load']}",
        f"{facts['system']}, Python {facts['python']}, {versions}",
    ]
    if "opengl" in facts:
        lines.append(f"OpenGL of the peers: {facts['opengl'] or 'none'}")
    if "device" in facts:
        device = facts["device"]
        kind = "" if device is None else ", a GPU" if device["hardware"] else ", software: the CPU draws"
        lines.append(f"OpenGL: {device['renderer'] if device else 'none'}{kind}")
    if facts["load"] is not None and facts["load"] > 0.5:
        lines.append("This machine is busy with other things: the figures say little.")
    return lines


def save(path: Path, results: Results, facts: dict[str, Any]) -> Path:
    """Write facts and figures as JSON."""
    text = json.dumps({"machine": facts, "figures": list(results)}, indent=2, ensure_ascii=False)
    return write_atomic(path, lambda file: file.write(text.encode() + b"\n"))


def number(value: float) -> str:
    """Three significant digits without an exponent."""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


WORDS = {"work": "work", "scene": "scene", "lighting": "lit per"}


def _where(results: Results) -> list[str]:
    """Fields that say which work a row belongs to, those left out that no work of this benchmark has."""
    return [field for field in WORDS if any(f[field] for f in results)]


def _figures(results: Results) -> Any:
    from rich.table import Table

    where, printed = _where(results), any(f["published"] is not None for f in results)
    table = Table(title="figures: ratios of medians, with the smallest and largest of a round")
    for heading in (*(WORDS[field] for field in where), "measure"):
        table.add_column(heading)
    for heading in (*(("paper",) if printed else ()), "asked", "reached", "noise"):
        table.add_column(heading, justify="right")
    table.add_column("met")
    table.add_column("note")
    for f in results:
        met = "" if f["met"] is None else "yes" if f["met"] else "[bold red]no[/]"
        had = f["value"] is not None
        noise = f"{number(f['low'])} … {number(f['high'])}" if had else ""
        reached = f"{number(f['value'])} {f['unit']}" if had else "—"
        paper = () if not printed else ("" if f["published"] is None else number(f["published"]),)
        place = (f[field] for field in where)
        table.add_row(*place, f["measure"], *paper, f["bar"] or "", reached, noise, met, f["note"])
    return table


def _times(results: Results) -> Any:
    from rich.table import Table

    where = _where(results)
    table = Table(title="times in milliseconds")
    for heading in (*(WORDS[field] for field in where), "contender"):
        table.add_column(heading)
    for heading in ("median", "min … max", "rounds × frames"):
        table.add_column(heading, justify="right")
    rows = {}
    for f in results:
        for name, t in f["times"].items():
            spread = f"{number(1e3 * t['min_s'])} … {number(1e3 * t['max_s'])}"
            taken = f"{t['rounds']} × {t['frames']}" + (f", scaled × {t['scale']:g}" if t["scale"] != 1 else "")
            rows[(*(f[field] for field in where), name)] = (number(1e3 * t["median_s"]), spread, taken)
    for key, row in rows.items():
        table.add_row(*key, *row)
    return table


def plot(folder: Path, results: Results) -> list[Path]:
    """Draw charts of the papers' tables; see papers_plots.plot."""
    from .papers_plots import plot as draw

    return draw(folder, results)
