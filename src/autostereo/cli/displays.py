"""autostereo displays: the built-in displays."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from . import common

if TYPE_CHECKING:
    from ..display.display import Display


def displays(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="A preset, a visual.json or a .toml.")] = None,
) -> None:
    """List the built-in displays, or describe one.

    Examples:
      autostereo displays
      autostereo displays looking-glass-portrait
      autostereo displays /media/usb/LKG_calibration/visual.json
    """
    from ..display.presets import preset_title

    if name is not None:
        lines = describe(common.load_display(name))
        if title := preset_title(name):
            lines.insert(1, ("title", title))
        for label, value in lines:
            print(f"{label:<12} {value}")
        return
    from ..display.display import Display

    rows = []
    for preset in Display.presets():
        display = Display.preset(preset)
        rows.append((preset, f"{display.width}×{display.height}", str(display.views), preset_title(preset)))
    if sys.stdout.isatty():
        _print_table(rows)
        return
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, [*widths, 0], strict=True)).rstrip())


def _print_table(rows: list[tuple[str, str, str, str]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for title, justify in (("name", "left"), ("panel", "right"), ("views", "right"), ("display", "left")):
        table.add_column(title, justify=justify, no_wrap=title == "name")  # type: ignore[arg-type]
    for row in rows:
        table.add_row(*row)
    Console().print(table)


def describe(display: Display) -> list[tuple[str, str]]:
    """Return (label, value) lines about a display."""
    lines = [
        ("name", display.name),
        ("panel", f"{display.width}×{display.height} px"),
        ("picture", "{}×{} px".format(*display.picture_size)),
        ("views", f"{display.views}{', continuous' if display.continuous else ''}"),
        ("layout", display.layout + (", reversed" if display.reverse else "")),
    ]
    viewmap = display.viewmap
    if viewmap is not None and viewmap.table is not None:
        height, width, _ = viewmap.table.shape
        lines.append(("mask", f"table, repeated every {width}×{height} px"))
    elif viewmap is not None and viewmap.offsets is not None:
        lens = f"lens of {abs(3 / viewmap.a):.6g} sub-pixels along the row" if viewmap.a else "lens along the rows"
        if viewmap.a and viewmap.b:
            lens += f" ({3 / math.hypot(viewmap.a, viewmap.b):.6g} across the lens)"
        lines.append(("mask", f"{lens}, phase {viewmap.a:+.9g} per pixel, {viewmap.b:+.9g} per row"))
        if len(viewmap.offsets) > 1:
            lines.append(("cells", f"{len(viewmap.offsets)}, pattern {viewmap.cell_mode}"))
    if display.calibration is not None:
        sheet = display.calibration
        numbers = f"pitch {sheet.pitch:g}, slope {sheet.slope:g}, center {sheet.center:g}, DPI {sheet.dpi:g}"
        lines.append(("calibration", numbers))
    if display.flip_x or display.flip_y:
        lines.append(("flips", " ".join(axis for axis, flip in (("x", display.flip_x), ("y", display.flip_y)) if flip)))
    if display.quilt is not None:
        quilt = display.quilt
        tiles = f"{quilt.columns}×{quilt.rows} tiles in {quilt.width}×{quilt.height} px"
        lines.append(("quilt", f"{tiles}, aspect {quilt.aspect:.4g}"))
    lines.append(("cone", f"{display.cone_deg:g}°"))
    if display.size_mm is not None:
        lines.append(("size", "{:.1f}×{:.1f} mm".format(*display.size_mm)))
    if display.distance_mm is not None:
        lines.append(("distance", f"{display.distance_mm:g} mm"))
    tile = "{}×{}".format(*display.comfort_size)
    lines.append(("comfort", f"{display.comfort:g} px between adjacent views of {tile} px"))
    lines.append(("source", display.source or "none given"))
    if display.ending:
        lines.append(("names end in", display.ending))
    if display.note:
        lines.append(("note", display.note))
    return lines
