"""Charts of ``bench papers``, like the papers' own: a PNG for each work, ours beside what is printed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...errors import DependencyError
from ...image import write_atomic

UNITS = {"fps": "frames per second", "%": "per cent", "ms": "milliseconds", "dB": "PSNR in dB", "a sample": "a sample"}
LINES = ("2020-fig15", "2020-fig15-dibr")  # by a number of views
LOGARITHMIC = ("fps", "ms")
COLORS = 10  # of matplotlib's; what comes after them is told apart by
DASHES, HATCHES = ("-", "--", ":", "-."), ("", "///", "...", "xxx")


def need_matplotlib() -> None:
    """Raise DependencyError where it is not installed."""
    if find_spec("matplotlib") is None:
        raise DependencyError("bench --plots needs matplotlib: pip install autostereo[bench]")


def plot(folder: Path, results: Sequence[dict[str, Any]]) -> list[Path]:
    """Draw the figures of each work and unit.

    Parameters
    ----------
    folder : Path
        Is made if it is not there.
    results : sequence of dict
        Of `papers.run`.

    Returns
    -------
    list of Path
        The files `<work>-<unit>.png`.

    Raises
    ------
    DependencyError
        matplotlib is not installed.
    """
    need_matplotlib()
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    shown = [f for f in results if f["value"] is not None and f["unit"] in UNITS]
    charts: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for f in shown:
        charts.setdefault((f["work"], f["unit"]), []).append(f)
    paths = []
    for (work, unit), figures in charts.items():
        chart = Figure(figsize=(9, 4.5), layout="constrained")
        axes = chart.add_subplot()
        (_lines if work in LINES else _bars)(axes, figures)
        axes.set(title=work, ylabel=UNITS[unit], yscale="log" if unit in LOGARITHMIC else "linear")
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
        path = folder / f"{work}-{'percent' if unit == '%' else unit.replace(' ', '-')}.png"
        paths.append(write_atomic(path, partial(chart.savefig, format="png", dpi=120)))
    return paths


def _lines(axes: Any, figures: Sequence[dict[str, Any]]) -> None:
    """Values by number of views, a line for each measure."""
    for k, measure in enumerate(dict.fromkeys(f["measure"] for f in figures)):
        found = [f for f in figures if f["measure"] == measure]
        views, values = [int(f["scene"].split()[0]) for f in found], [f["value"] for f in found]
        dash = DASHES[k // COLORS % len(DASHES)]
        axes.plot(views, values, color=f"C{k % COLORS}", linestyle=dash, marker="o", label=measure)
    axes.set_xlabel("views")


def _bars(axes: Any, figures: Sequence[dict[str, Any]]) -> None:
    """Bars, a group for each scene; what the paper has as a line across the bar of the same measure."""
    scenes = list(dict.fromkeys(f["scene"] for f in figures))
    measures = list(dict.fromkeys(f["measure"] for f in figures))
    width, printed = 0.8 / len(measures), False
    for k, measure in enumerate(measures):
        found = [f for f in figures if f["measure"] == measure]
        places = [scenes.index(f["scene"]) + (k + 0.5) * width - 0.4 for f in found]
        look = {"color": f"C{k % COLORS}", "hatch": HATCHES[k // COLORS % len(HATCHES)], "edgecolor": "white"}
        axes.bar(places, [f["value"] for f in found], width, label=measure, **look)
        for place, f in zip(places, found, strict=True):
            if f["published"] is not None:
                name = None if printed else "paper"
                axes.hlines(f["published"], place - width / 2, place + width / 2, colors="black", label=name)
                printed = True
    axes.set_xticks(range(len(scenes)), scenes)
