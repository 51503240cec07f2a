"""autostereo observe: what an eye in front of a panel sees."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from . import common, outputs
from .common import note, say


def observe(
    panel: Annotated[Path, typer.Argument(metavar="PANEL", help="An interlaced picture.")],
    display: common.DisplayName,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Output file.")],
    view: Annotated[
        float | None, typer.Option("--view", metavar="U", help="Zone the eye is in: 0 leftmost, 3.5 between 3 and 4.")
    ] = None,
    eye: Annotated[
        str | None, typer.Option("--eye", metavar="X,Z", help="Or its place: mm to the right, mm in front.")
    ] = None,
    crosstalk: Annotated[float, typer.Option("--crosstalk", help="Share of light from neighbours, 0…1.")] = 0.0,
    swap: common.Swap = False,
    views: common.ViewCount = None,
    continuous: common.Continuous = False,
    quiet: common.Quiet = False,
) -> None:
    """Compute what an eye in front of a panel sees.

    The display's optics choose one sub-pixel for each place, colour and lens. Name the display that the picture was
    made for, with the same --views, --swap and --continuous. A picture of another size is taken for that of a display
    of this size with the same lenses and pixels, as `render --size` makes it, and a line says so; one that was scaled
    afterwards shows wrong views.

    Examples:
      autostereo observe panel.png -d looking-glass-portrait --view 20 -o left.png
      autostereo observe panel.png -d looking-glass-portrait --eye -32,500 --crosstalk 0.1 -o left.png
    """
    if (view is None) == (eye is None):
        raise InputError("observe: expected either --view U or --eye X,Z")
    from ..checks import check_number

    place = None
    if eye is not None:
        x, z = common.parse_numbers(eye, "--eye", 2)
        place = (check_number("--eye X", x, -1e9, 1e9), check_number("--eye Z", z, 1e-3, 1e9))
    if view is not None:
        view = check_number("--view", view, -1e6, 1e6)
    if not 0 <= crosstalk < 1:
        raise InputError(f"--crosstalk: expected a number from 0 up to but not including 1, got {crosstalk:g}")
    outputs.check_image(output)
    outputs.check_apart(output, panel)
    where = common.load_display(display, None, swap, views, continuous)
    if where.viewmap is not None and place is not None and where.size_mm is None:
        raise InputError(
            f"--eye: expected a display with a size, {where.name} has none; "
            "give a .toml of your own with size_mm below [optics], or --view U"
        )
    pixels = common.load_picture(panel)
    outputs.check_image(output, (pixels.shape[1], pixels.shape[0]))
    width, height = where.picture_size
    if pixels.shape[:2] != (height, width) and where.viewmap is not None:
        where = where.resized(pixels.shape[1], pixels.shape[0])
        size = f"{where.width}×{where.height}"
        note(f"{panel}: {size} pixels, where {where.name} has {width}×{height}: taken for a display of {size} pixels")
    from ..frame import Panel
    from ..image import write_image
    from ..render import observe as look

    with common.working("looking"):
        seen = look(Panel(pixels), where, view=view, eye=place, crosstalk=crosstalk)
        write_image(output, seen)
    say(f"{output}  {seen.shape[1]}×{seen.shape[0]}")
