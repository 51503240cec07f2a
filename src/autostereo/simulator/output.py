"""Showing and saving what a study found: tables and charts as the paper's Figures 8 and 10, JSON, a picture."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DependencyError
from ..image import write_atomic
from .report import Report
from .study import CLASSES

Rows = Sequence[dict[str, Any]]
COLORS = {"texture": "#4e79a7", "depth": "#f28e2b", "color": "#59a14f"}


def show(rows: Rows) -> None:
    """Print a table of bytes, and one of the formulas (1) to (3) beside the first machine."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    if not console.is_terminal:
        console.width = max(console.width, 170)
    width, height = rows[0]["size"]
    table = Table(title=f"{rows[0]['scene']}, {width}×{height} a view, MB a frame (mean of {rows[0]['frames']})")
    for name in ("views", "machine", "texture", "of first", "least … greatest", "depth", "colour", "total", "of first",
                 "m", "shader runs, M", "approximated", "PSNR (least), dB", "Mtexel/s"):  # fmt: skip
        table.add_column(name, justify="left" if name == "machine" else "right")
    for row in rows:
        first = next(r for r in rows if r["views"] == row["views"])
        quality = "" if row["psnr"] is None else f"{row['psnr']:.1f} ({row['psnr_min']:.1f})"
        low, high = row["texture_range"]
        table.add_row(
            str(row["views"]), row["machine"], f"{row['texture'] / 1e6:.2f}", _share(row["texture"], first["texture"]),
            f"{low / 1e6:.2f} … {high / 1e6:.2f}", f"{row['depth'] / 1e6:.2f}", f"{row['color'] / 1e6:.2f}",
            f"{row['total'] / 1e6:.2f}", _share(row["total"], first["total"]), f"{row['miss_rate']:.3f}",
            f"{row['shaded'] / 1e6:.3f}", _share(row["share_approximated"], 1.0), quality,
            f"{row['texels_per_second'] / 1e6:.0f}",
        )  # fmt: skip
    console.print(table)
    if any(row.get("optimum") for row in rows):
        console.print("total, of the theoretical optimum: " + ", ".join(
            f"{row['machine']} {row['views']} at once {row['total'] / row['optimum']:.2f}"
            for row in rows if row.get("optimum")
        ))  # fmt: skip
    if "model" in rows[0]:
        console.print(_model_table(rows))


def _share(value: float, base: float) -> str:
    return f"{value / base:.1%}" if base and value else ""


def _model_table(rows: Rows) -> Any:
    from rich.table import Table

    table = Table(title="bytes for a pixel of a view: equations (1) to (3), and what was counted")
    for name in ("views", "machine", "", "d", "overdraw", "m", "depth", "colour", "texture", "total"):
        table.add_column(name, justify="left" if name in ("machine", "") else "right")
    for row in rows:
        for line in ("predicted", "fitted", "measured"):
            t = row["model"][line]
            table.add_row(
                str(row["views"]), row["machine"], line, f"{t['depth_complexity']:.2f}", f"{t['overdraw']:.2f}",
                f"{t['miss_rate']:.3f}", *(f"{t[k]:.1f}" for k in ("depth", "color", "texture", "total")),
            )  # fmt: skip
    return table


def save(path: str | os.PathLike[str], rows: Rows) -> None:
    """Write all figures as JSON."""
    text = json.dumps({"rows": list(rows)}, indent=1, allow_nan=False)
    write_atomic(path, lambda file: file.write(text.encode() + b"\n"))


def need_matplotlib() -> None:
    """Raise DependencyError unless charts can be drawn."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise DependencyError("charts need matplotlib; pip install autostereo[bench]") from error


def save_chart(path: str | os.PathLike[str], rows: Rows) -> None:
    """Draw bytes against views as the paper's Figure 8: a group of bars a number of views, a bar a machine.

    For depth of field also the theoretical optimum, as in its Figure 10.
    """
    need_matplotlib()
    from matplotlib.figure import Figure

    machines = list(dict.fromkeys(row["machine"] for row in rows))
    counts = sorted({row["views"] for row in rows})
    figure = Figure(figsize=(9, 4.5), layout="constrained")
    axes = figure.subplots()
    wide = 0.8 / len(machines)
    for k, machine in enumerate(machines):
        mine = {row["views"]: row for row in rows if row["machine"] == machine}
        at = [i + (k - (len(machines) - 1) / 2) * wide for i, n in enumerate(counts) if n in mine]
        base = np.zeros(len(at))
        for part in CLASSES[:3]:
            values = np.array([mine[n][part] / 1e6 for n in counts if n in mine])
            label = part if k == 0 else None
            axes.bar(at, values, wide * 0.9, base, color=COLORS[part], label=label, edgecolor="white")
            base += values
        for x, top in zip(at, base, strict=True):
            axes.annotate(machine, (x, top), rotation=90, fontsize=7, ha="center", va="bottom", xytext=(0, 2),
                          textcoords="offset points")  # fmt: skip
    best = {row["views"]: row["optimum"] / 1e6 for row in rows if row.get("optimum")}
    if best:
        axes.plot([counts.index(n) for n in best], list(best.values()), "k--o", label="theoretical optimum")
    axes.set_xticks(range(len(counts)), [str(n) for n in counts])
    axes.set_xlabel("views")
    axes.set_ylabel("MB a frame")
    axes.set_title(str(rows[0]["scene"]))
    axes.margins(y=0.25)
    axes.legend(frameon=False, loc="upper left")
    suffix = os.path.splitext(path)[1].lower().lstrip(".")
    write_atomic(path, lambda file: figure.savefig(file, format=suffix, dpi=120))


def approximation_picture(report: Report) -> NDArray[np.uint8]:
    """Views side by side (H, V·W, 3) with approximated pixels tinted green, as the paper's Figure 9."""
    tinted = report.color[..., :3].astype(np.float32)
    if len(report.how):
        green = np.array([40.0, 220.0, 60.0], np.float32)
        tinted = np.where((report.how == 2)[..., None], 0.5 * tinted + 0.5 * green, tinted)
    return np.concatenate(list(np.floor(tinted + 0.5).astype(np.uint8)), axis=1)
