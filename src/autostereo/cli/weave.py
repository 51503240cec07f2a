"""autostereo weave: a quilt to the interlaced picture of a display."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..wording import an, counted
from . import common, outputs
from .common import note, say

SAME_ASPECT = 0.01  # by which two aspects may differ, as names of quilts have four digits


def weave(
    quilt: Annotated[Path, typer.Argument(metavar="QUILT", help="A quilt picture, as name_qs8x6a0.75.png.")],
    display: common.DisplayName,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Output file.")],
    grid: Annotated[
        str | None, typer.Option("--grid", metavar="CxR", help="Tiles across and up, if the name does not say.")
    ] = None,
    filter: Annotated[str, typer.Option("--filter", help="nearest or linear.")] = "nearest",
    size: common.Size = None,
    swap: common.Swap = False,
    views: common.ViewCount = None,
    continuous: common.Continuous = False,
    quiet: common.Quiet = False,
) -> None:
    """Weave a quilt into the interlaced picture of a display.

    The quilt's tiles are the views, bottom left first; their number becomes the display's unless its mask is a table.

    Examples:
      autostereo weave bunny_qs8x6a0.75.png -d looking-glass-portrait -o panel.png
      autostereo weave picture.png --grid 5x9 -d visual.json --filter linear -o panel.png
    """
    from ..encoders.quilt import parse_quilt_name
    from ..io.files import check_start

    named = parse_quilt_name(quilt)
    check_start(quilt)
    if grid is not None:
        columns, rows = common.parse_pair(grid, "--grid", 1024)
    elif named is not None:
        columns, rows = named.columns, named.rows
    else:
        raise InputError(f"{quilt}: the name does not say how many tiles (…_qs8x6a0.75.png); give --grid 8x6")
    where = common.load_display(display, size, swap, None, continuous)
    common.check_views(views)
    if where.viewmap is not None and where.viewmap.table is None:
        where = where.with_views(columns * rows if views is None else views)
    elif where.viewmap is not None and views is None and columns * rows != where.views:
        raise InputError(
            f"{quilt}: {columns}×{rows} tiles, but the mask of {where.name} has {counted(where.views, 'view')}; "
            f"give --views {where.views} to take the first {where.views} tiles"
        )
    if where.viewmap is None:
        raise InputError(f"{where.name}: {an(where.layout)} picture is not woven from a quilt")
    outputs.check_image(output, where.picture_size)
    outputs.check_apart(output, quilt)
    pixels = common.load_picture(quilt, alpha=True)
    from ..engines.cpu.gather import weave as draw
    from ..image import write_image

    panel = (where.width, where.height)
    with common.working("weaving"):
        flips = (where.flip_x, where.flip_y)
        write_image(output, draw(pixels, (columns, rows), where.viewmap, panel, filter, flips))
    if named is not None and abs(named.aspect / where.aspect - 1) > SAME_ASPECT:
        note(
            f"{quilt}: was made for a display of aspect {named.aspect:g}, {where.name} has {where.aspect:.4g}: "
            "the picture is squashed"
        )
    outputs.note_lossy(output, where)
    say("{}  {}×{}".format(output, *panel))
