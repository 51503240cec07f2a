"""autostereo views: a scene to its views, as pictures, an animation or an array."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import DependencyError, InputError
from ..wording import counted
from . import common, outputs
from .common import say

if TYPE_CHECKING:
    from ..display.rig import Rig
    from ..frame import ViewStack

ANIMATIONS = (".gif", ".webp", ".mp4")


def views(
    inputs: common.Inputs,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="OUT", help="Folder, or a .gif .webp .mp4 .npz file.")
    ],
    views: common.ViewCount = None,
    size: common.Size = None,
    display: common.OptionalDisplayName = None,
    camera: common.Camera = None,
    side: common.Side = "front",
    background: common.Background = None,
    method: common.Method = "single-pass",
    engine: common.EngineName = "auto",
    shading: common.Shading = "exact",
    lighting: common.Lighting = "sample",
    samples: common.Samples = 1,
    depth: Annotated[bool, typer.Option("--depth", help="Also keep eye depth (.npz only).")] = False,
    lens: Annotated[
        str | None, typer.Option("--depth-of-field", metavar="NxM", help="Through a lens of so many samples.")
    ] = None,
    aperture: Annotated[
        float | None, typer.Option("--aperture", help="Side of the square lens; 1/50 of the focal distance.")
    ] = None,
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
    """Render the single views, from left to right.

    A folder receives view_000.png, view_001.png, … and the cameras as rig.json; an animation swings through the
    views and back. The cameras are those of --camera, or they frame the scene for --display (default: 8 views).

    Examples:
      autostereo views bunny.ply -o bunny/ --views 8 --size 512x512
      autostereo views bunny.ply -o bunny.webp -d looking-glass-portrait --size 420x560
      autostereo views bunny.ply -o bunny.npz --depth --camera rig.json
      autostereo views head.nrrd -o head.webp --mode mip
      autostereo views bunny.ply -o bunny/ --views 2 --depth-of-field 8x8
    """
    path, suffix = outputs.folder_or_file(output, (".npz", *ANIMATIONS))
    pixels = common.parse_size(size) if size else (512, 512)
    if suffix not in ("", ".npz", *ANIMATIONS):
        endings = f".npz {' '.join(ANIMATIONS)}"
        raise InputError(f"{path}: expected a name ending in {endings}, or a folder ({path}/), got {suffix}")
    if depth and suffix != ".npz":
        raise InputError("--depth: only a .npz file can hold it")
    if aperture is not None and (lens is None or not aperture > 0):
        raise InputError(f"--aperture: expected a number > 0 beside --depth-of-field NxM, got {aperture:g}")
    samples_of_lens = common.parse_pair(lens, "--depth-of-field", 64) if lens else (1, 1)
    if depth and lens:
        raise InputError("--depth: means through a lens have no one depth, leave out --depth-of-field")
    from ..engines.options import Options

    common.check_views(views)
    if suffix in ANIMATIONS:
        check_animation(path, pixels)
    options = Options(
        shading=shading, lighting=lighting, samples=samples, depth=depth, step=step, volume=volume,
        views_per_pass=views_per_pass, references=references,
    )  # fmt: skip
    volumes = common.VolumeOptions(shape, dtype, frame, spacing, transfer, mode, iso)
    common.check_side(side, camera)
    rig = common.load_camera(camera)
    outputs.check_output(path, (suffix,) if suffix else ())
    outputs.check_apart(path, *inputs)
    scene = common.load_scene(inputs, background, volumes)
    common.note_idle(options, scene, method)
    rig = common.frame_views(scene, rig, views, pixels, display, side)
    if lens is not None:
        options = replace(options, aperture=rig.focal / 50 if aperture is None else aperture, lens=samples_of_lens)

    if suffix in ANIMATIONS:
        check_animation_room(path, rig.views, pixels, 4)
    from ..render import render_views

    drawn = partial(render_views, scene, rig, pixels, method=method, engine=engine)
    with common.working(f"rendering {counted(rig.views, 'view')}"):
        stack = drawn(options=options)
    write_views(path, suffix, stack, rig)
    common.note_reuse(stack, drawn, options)


def write_views(output: Path, suffix: str, stack: ViewStack, rig: Rig) -> None:
    """Write an animation, an array, or, without a suffix, a folder with the cameras."""
    with common.working("writing"):
        if suffix in ANIMATIONS:
            from ..encoders.video import save_animation

            save_animation(output, stack)
        elif suffix:
            stack.save(output)
        else:
            with outputs.whole_folder(output, stale="view_*.png") as folder:
                stack.save(folder)
                rig.save(folder / "rig.json")
    say(f"{output}  {counted(stack.views, 'view')} of {stack.width}×{stack.height}")


def check_animation(path: Path, size: tuple[int, int]) -> None:
    """Refuse, before the long work, an animation that could not be written after it."""
    from importlib.util import find_spec

    from ..image import check_side

    check_side(path, *size)
    if path.suffix.lower() == ".mp4" and find_spec("av") is None:
        raise DependencyError(f"{path}: mp4 needs PyAV; pip install autostereo[video]")


def check_animation_room(path: Path, views: int, size: tuple[int, int], held: int) -> None:
    """Refuse, before the long work, an animation without room beside its views, of `held` bytes a pixel."""
    from ..encoders.video import check_room

    check_room(path, views, size, held * views * size[0] * size[1])
