"""autostereo quilt: a scene to a quilt."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import FileError, InputError
from ..wording import counted
from . import common, outputs
from .common import say

if TYPE_CHECKING:
    from ..display.display import Display
    from ..display.quilt import Quilt
    from ..display.rig import Rig
    from ..scene.scene import Scene


def quilt(
    inputs: common.Inputs,
    output: Annotated[
        str | None, typer.Option("--output", "-o", metavar="OUT", help="File; _qs…x…a… is added to it. Or folder.")
    ] = None,
    display: common.OptionalDisplayName = None,
    grid: Annotated[str | None, typer.Option("--grid", metavar="CxR", help="Tiles across and up.")] = None,
    view_size: Annotated[str | None, typer.Option("--view-size", metavar="WxH", help="Size of a tile.")] = None,
    aspect: Annotated[
        float | None, typer.Option("--aspect", help="Width/height of the display, if a tile's is another.")
    ] = None,
    camera: common.Camera = None,
    side: common.Side = "front",
    background: common.Background = None,
    method: common.Method = "single-pass",
    engine: common.EngineName = "auto",
    shading: common.Shading = "exact",
    lighting: common.Lighting = "sample",
    samples: common.Samples = 1,
    shape: common.Shape = None,
    dtype: common.VoxelType = None,
    frame: common.Frame = None,
    spacing: common.Spacing = None,
    transfer: common.Transfer = None,
    mode: common.Mode = None,
    iso: common.Iso = None,
    step: common.Step = 1.0,
    volume: common.Rays = "shared",
    views_per_pass: common.PerPass = None,
    references: common.References = 2,
    quiet: common.Quiet = False,
) -> None:
    """Render a quilt: all views tiled into one picture.

    The leftmost view stands at the bottom left. The layout is the display's own, or --grid with --view-size; it
    becomes part of the file's name. In a folder that exists the file is called after the first input.

    Examples:
      autostereo quilt bunny.ply --display looking-glass-portrait
      autostereo quilt bunny.ply --grid 8x6 --view-size 420x560 -o out.png
      autostereo quilt scan/ -d looking-glass-portrait --transfer mr-brain
    """
    from ..engines.options import Options

    where = None if display is None else common.load_display(display)
    layout = choose_layout(where, grid, view_size, aspect)
    options = Options(
        shading=shading, lighting=lighting, samples=samples, step=step, volume=volume,
        views_per_pass=views_per_pass, references=references,
    )  # fmt: skip
    volumes = common.VolumeOptions(shape, dtype, frame, spacing, transfer, mode, iso)
    common.check_side(side, camera)
    rig = common.load_camera(camera)
    from ..encoders.quilt import quilt_path

    path = quilt_path(_place(output, f"{common.stem(inputs[0])}.png"), layout)
    outputs.check_image(path, (layout.width, layout.height))
    outputs.check_apart(path, *inputs)
    scene = common.load_scene(inputs, background, volumes)
    common.note_idle(options, scene, method)
    rig = _frame(scene, where, layout, side) if rig is None else rig.with_views(layout.views)
    if rig.aspect is None:
        rig = replace(rig, aspect=layout.aspect)
    from ..encoders.quilt import save_quilt
    from ..render import render_views

    drawn = partial(render_views, scene, rig, layout.tile, method=method, engine=engine)
    with common.working(f"rendering {counted(rig.views, 'view')}"):
        stack = drawn(options=options)
    with common.working("writing"):
        save_quilt(path, stack, layout)
    outputs.note_lossy(path, None)
    say(f"{path}  {layout.width}×{layout.height}")
    common.note_reuse(stack, drawn, options)


def _place(output: str | None, own: str) -> Path:
    """Where the quilt goes before its layout is added to the name: `own`, in a folder if that is what `output` is."""
    if output is None:
        return Path(own)
    if Path(output).is_dir():
        return Path(output) / own
    if output.endswith(("/", os.sep)):
        raise FileError(f"{output}: no such folder")
    return Path(output)


def choose_layout(display: Display | None, grid: str | None, view_size: str | None, aspect: float | None) -> Quilt:
    """Return the display's own quilt, with what the options change, or the one they describe."""
    from ..display.quilt import Quilt
    from ..encoders.quilt import MAX_PIXELS, MAX_TILES

    own = None if display is None else display.quilt
    if own is None and (grid is None or view_size is None):
        name = "without --display" if display is None else f"{display.name} has no quilt of its own"
        raise InputError(f"quilt: {name}: expected --grid CxR and --view-size WxH")
    if own is not None and grid is None and view_size is None:
        return own if aspect is None else replace(own, aspect=aspect)
    columns, rows = common.parse_pair(grid, "--grid", MAX_TILES) if grid else (own.columns, own.rows)  # type: ignore[union-attr]
    width, height = common.parse_size(view_size, "--view-size") if view_size else own.tile  # type: ignore[union-attr]
    if max(columns * width, rows * height) > MAX_PIXELS:
        wanted = f"{columns * width}×{rows * height}"
        raise InputError(f"quilt: expected at most {MAX_PIXELS} pixels a side, {columns}×{rows} tiles make {wanted}")
    if aspect is None:
        aspect = width / height if display is None else display.aspect
    return Quilt(columns, rows, columns * width, rows * height, aspect)


def _frame(scene: Scene, display: Display | None, layout: Quilt, side: str) -> Rig:
    """Cameras that frame the scene from `side`: for the display, or for a panel of the shape of a tile."""
    from ..display.display import Display
    from ..display.rig import Rig

    fixed = display is None or display.viewmap is None or display.viewmap.table is not None
    if display is None or (fixed and display.views != layout.views):
        height = layout.tile[1]
        display = Display.lenticular(max(1, round(height * layout.aspect)), height, layout.views)
    elif display.views != layout.views:
        display = display.with_views(layout.views)
    return Rig.frame(scene, replace(display, quilt=layout), side)
