"""autostereo pattern: pictures that show an unknown panel's order, pitch, slope and phase to the eye."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..wording import an
from . import common, outputs
from .common import note, say

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..display.display import Display
    from ..viewmap import ViewMap

KINDS = ("numbers", "eyes", "pitch", "slope", "phase")
STEPS = {"pitch": 0.001, "slope": 0.02, "phase": 0.1}  # default difference between neighbouring strips
PICTURE_ROWS = 270  # the drawn pictures are enlarged to the panel: one drawing per view must fit into memory
BAND = 64  # panel rows at a time, for the same reason

READ = {
    "numbers": "Move to the right: the numbers should count up. Down? Use --swap.",
    "eyes": "From the middle, the left eye should see a red L and the right eye a blue R. The other way? Use --swap.",
    "pitch": "From the middle with one eye: take the strip with the fewest colour changes; x1 is the present value.",
    "slope": "From the middle with one eye: take the strip whose colour borders stand upright.",
    "phase": "From the middle with one eye: take the strip whose white line stands in the middle of the panel.",
}


def pattern(
    display: common.DisplayName,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Output file.")],
    kind: Annotated[str, typer.Option("--kind", help="numbers, eyes, pitch, slope or phase.")] = "numbers",
    strips: Annotated[int, typer.Option("--strips", help="Strips of a pitch, slope or phase pattern.")] = 9,
    step: Annotated[
        float | None, typer.Option("--step", help="Difference from strip to strip (pitch .001, slope .02, phase .1).")
    ] = None,
    size: common.Size = None,
    swap: common.Swap = False,
    views: common.ViewCount = None,
    quiet: common.Quiet = False,
) -> None:
    """Draw test pictures for an unknown panel.

    They show its order of views, pitch, slope and phase to the eye.

    numbers: every view in its own colour with its number. eyes: a red L in the left half of the views, a blue R in
    the right half. pitch, slope, phase: strips in which that value differs by --step, labelled; the printed table
    gives the numbers of each strip as a .toml file or a visual.json takes them.

    Examples:
      autostereo pattern -d looking-glass-portrait -o numbers.png
      autostereo pattern -d my_panel.toml --kind eyes -o eyes.png
      autostereo pattern -d visual.json --kind phase --strips 11 --step 0.05 -o phase.png
    """
    if kind not in KINDS:
        raise InputError(f"--kind: expected one of {', '.join(KINDS)}, got {kind!r}")
    if not 3 <= strips <= 99:
        raise InputError(f"--strips: expected a number from 3 to 99, got {strips}")
    width = STEPS.get(kind, 0.0) if step is None else step
    if step is not None and not 0 < abs(step) * strips < 2:
        raise InputError(f"--step: expected a number other than 0 and within ±{2 / strips:.3g}, got {step:g}")
    where = common.load_display(display, size, swap, views)
    outputs.check_image(output, where.picture_size)
    with common.working("drawing"):
        if kind in STEPS:
            sweep = make_sweep(where, kind, strips, width)
            pixels = draw_sweep(where, sweep)
        else:
            pictures = (draw_numbers if kind == "numbers" else draw_eyes)(where.views, where.aspect)
            pixels = spread(where, pictures)
        from ..image import write_image

        write_image(output, pixels)
    outputs.note_lossy(output, where)
    if kind in STEPS:
        for strip in sweep:
            say(strip.row)
    varies = where.viewmap is not None and where.viewmap.offsets is not None
    note(READ[kind] + (" Two at once? See --kind phase." if kind == "numbers" and varies else ""))
    outputs.note_ending(output, where.ending)
    say(f"{output}  {pixels.shape[1]}×{pixels.shape[0]}")


# --- one picture per view ------------------------------------------------------------------------------------------
def draw_numbers(views: int, aspect: float) -> NDArray[np.uint8]:
    """Pictures (V, h, w, 3) that show each view's number nine times on a colour of its own."""
    import colorsys

    colors = []
    for k in range(views):
        red, green, blue = colorsys.hsv_to_rgb(k * 0.8 / max(views - 1, 1), 1.0, 0.75 if k % 2 else 0.5)
        colors.append((round(red * 255), round(green * 255), round(blue * 255)))
    return _draw([str(k) for k in range(views)], colors, aspect, grid=3)


def draw_eyes(views: int, aspect: float) -> NDArray[np.uint8]:
    """Pictures (V, h, w, 3): a red L for the left half of the views, a blue R for the right half.

    The middle one of an odd number of views is black.
    """
    sides = [("L", (200, 0, 0)) if 2 * k < views - 1 else ("R", (0, 0, 200)) for k in range(views)]
    if views % 2:
        sides[views // 2] = ("", (0, 0, 0))
    return _draw([text for text, _ in sides], [color for _, color in sides], aspect, grid=1)


def _draw(texts: list[str], colors: list[tuple[int, int, int]], aspect: float, grid: int) -> NDArray[np.uint8]:
    """Draw `texts` white on `colors`, grid × grid times, as pictures (V, h, w, 3)."""
    import numpy as np
    from PIL import Image, ImageDraw, ImageFont

    h = PICTURE_ROWS
    w = min(max(1, round(h * aspect)), 8 * h)
    longest = max(max(len(text) for text in texts), 1)
    font: Any = ImageFont.load_default(size=max(6, min(0.7 * h / grid, 1.4 * w / grid / longest)))
    pictures = np.empty((len(texts), h, w, 3), dtype=np.uint8)
    for k, (text, color) in enumerate(zip(texts, colors, strict=True)):
        image = Image.new("RGB", (w, h), color)
        pen = ImageDraw.Draw(image)
        for cell in range(grid * grid):
            center = ((cell % grid + 0.5) * w / grid, (cell // grid + 0.5) * h / grid)
            pen.text(center, text, fill="white", font=font, anchor="mm")
        pictures[k] = np.asarray(image)
    return pictures


def spread(display: Display, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Interlace pictures (V, h, w, 3), enlarged to the panel; (H, W, 3).

    Done band by band: a stack of full-size views would take gigabytes on large panels.
    """
    import numpy as np

    _, h, w, _ = pictures.shape
    if display.viewmap is None:
        return _spread_packed(display, pictures)
    columns, channels = np.arange(display.width), np.arange(3)
    x = (columns[::-1] if display.flip_x else columns) * w // display.width
    panel = np.empty((display.height, display.width, 3), dtype=np.uint8)
    for top in range(0, display.height, BAND):
        rows = np.arange(top, min(top + BAND, display.height))
        y = (display.height - 1 - rows if display.flip_y else rows) * h // display.height
        view = display.viewmap.view(rows, columns)
        panel[rows] = pictures[view, y[:, None, None], x[None, :, None], channels]
    return panel


def _spread_packed(display: Display, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The same for layouts without a mask: enlarge, then pack."""
    if display.views < 2:
        raise InputError(f"{display.name}: {an(display.layout)} picture has no views to tell apart")
    import numpy as np

    from ..encoders.stereo import pack

    _, h, w, _ = pictures.shape
    width, height = display.view_size
    y, x = np.arange(height) * h // height, np.arange(width) * w // width
    return pack(pictures[:, y[:, None], x], display.layout, swap=display.eyes_swapped, anamorphic=True)


# --- strips ----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True, eq=False)
class Strip:
    """One strip of a sweep: its label, its mask, and its line of the printed table."""

    label: str
    viewmap: ViewMap
    row: str


def make_sweep(display: Display, kind: str, strips: int, step: float) -> list[Strip]:
    """Vary the lens period (`pitch`), the tangent of the slant (`slope`) or the phase over `strips` strips.

    Pitch and slope turn about the middle of the panel, so that the phase there stays.
    """
    if display.viewmap is None:
        what = an(display.layout)
        raise InputError(f"--kind {kind}: {display.name}: {what} picture has no lenses, whose {kind} varies")
    if display.viewmap.offsets is None:
        raise InputError(f"--kind {kind}: {display.name} has a fixed table, which has no {kind} to vary")
    sweep = []
    for k in range(strips):
        change = (k - strips // 2) * step
        vary = _vary_mask if display.calibration is None else _vary_calibration
        viewmap, numbers = vary(display, kind, change)
        label = f"{change:+.3f}" if kind == "phase" else f"x{1 + change:.4f}"
        sweep.append(Strip(label, viewmap, f"{label:>8}  {numbers}"))
    return sweep


def _phase_in_the_middle(display: Display, viewmap: ViewMap) -> float:
    """Phase of the first cell's red sub-pixel in the middle of the panel, in lenses, not wrapped."""
    assert viewmap.offsets is not None
    return float(
        viewmap.a * (display.width - 1) / 2 + viewmap.b * (display.height - 1) / 2 + viewmap.offsets[0, 0]
    )


def _vary_mask(display: Display, kind: str, change: float) -> tuple[ViewMap, str]:
    """The mask with one number changed, and van Berkel's numbers for it (docs/design.md, section 3)."""
    import numpy as np

    base = display.viewmap
    assert base is not None and base.offsets is not None
    a = base.a / (1 + change) if kind == "pitch" else base.a
    b = base.b / (1 + change) if kind == "pitch" else base.b * (1 + change) if kind == "slope" else base.b
    viewmap = replace(base, a=a, b=b, offsets=base.offsets + np.arange(3) * (a - base.a) / 3)
    shift = change if kind == "phase" else _phase_in_the_middle(display, base) - _phase_in_the_middle(display, viewmap)
    assert viewmap.offsets is not None
    viewmap = replace(viewmap, offsets=viewmap.offsets + shift)
    slant = math.atan2(-b, a) if a > 0 else math.atan2(b, -a)
    unit = display.subpixel_pitch
    pitch = 3 / math.hypot(a, b) * unit if a or b else math.inf
    phase = float((base.offsets[0, 0] + shift) % 1.0)
    numbers = f"slant_deg {math.degrees(slant):.6g}, phase {phase:.5f}"
    return viewmap, f"lens_pitch {pitch:.6g}, subpixel_pitch {unit:.12g}, {numbers}"


def _vary_calibration(display: Display, kind: str, change: float) -> tuple[ViewMap, str]:
    """The same for a Looking Glass: its calibration with one number changed."""
    base, lens = display.viewmap, display.calibration
    assert base is not None and lens is not None
    if kind == "pitch":
        lens = replace(lens, pitch=lens.pitch / (1 + change))
    elif kind == "slope":  # the lenses keep their distance along the row, so that only their slant differs
        slope = lens.slope / (1 + change)
        along = math.cos(math.atan(1 / lens.slope)) / math.cos(math.atan(1 / slope))
        lens = replace(lens, slope=slope, pitch=lens.pitch * along)
    reverse = base.reverse != lens.invert
    viewmap = lens.viewmap(base.views, base.continuous, reverse)
    shift = change if kind == "phase" else _phase_in_the_middle(display, base) - _phase_in_the_middle(display, viewmap)
    lens = replace(lens, center=lens.center - shift)
    viewmap = lens.viewmap(base.views, base.continuous, reverse)
    return viewmap, f"pitch {lens.pitch:.6g}, slope {lens.slope:.6g}, center {lens.center % 1.0:.5f}"


def draw_sweep(display: Display, sweep: list[Strip]) -> NDArray[np.uint8]:
    """Draw strips (H, W, 3): red for the left half of a zone, blue for the right, white in its middle; labelled."""
    import numpy as np
    from PIL import Image, ImageDraw, ImageFont

    colors = np.array([[210, 0, 0], [255, 255, 255], [0, 0, 210]], dtype=np.uint8)
    columns, channels = np.arange(display.width), np.arange(3)
    panel = np.empty((display.height, display.width, 3), dtype=np.uint8)
    edges = [display.height * k // len(sweep) for k in range(len(sweep) + 1)]
    if min(np.diff(edges)) < 8:
        raise InputError(f"--strips: {len(sweep)} strips on {display.height} rows leave less than 8 rows each")
    for strip, top, bottom in zip(sweep, edges, edges[1:], strict=False):
        for start in range(top, bottom, BAND):
            rows = np.arange(start, min(start + BAND, bottom))
            phase = strip.viewmap.phase(rows, columns)
            panel[rows] = colors[np.where(np.abs(phase - 0.5) < 0.04, 1, np.where(phase < 0.5, 0, 2)), channels]
    image = Image.fromarray(panel)
    pen = ImageDraw.Draw(image)
    height = edges[1]
    font: Any = ImageFont.load_default(size=min(0.4 * height, 0.03 * display.width))
    for strip, top in zip(sweep, edges, strict=False):
        box = pen.textbbox((0, 0), strip.label, font=font)
        pen.rectangle((0, top, box[2] + 8, top + box[3] + 8), fill="black")
        pen.text((4, top + 2), strip.label, fill="white", font=font)
        pen.line((0, top, display.width, top), fill="black", width=max(1, height // 50))
    return np.asarray(image)
