"""autostereo render: a scene to the interlaced picture of a display."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import perf_counter

from . import common, outputs
from .common import note, say


def render(
    inputs: common.Inputs,
    display: common.DisplayName,
    output: common.Output = None,
    size: common.Size = None,
    swap: common.Swap = False,
    camera: common.Camera = None,
    side: common.Side = "front",
    views: common.ViewCount = None,
    continuous: common.Continuous = False,
    background: common.Background = None,
    method: common.Method = "single-pass",
    engine: common.EngineName = "auto",
    shading: common.Shading = "exact",
    lighting: common.Lighting = "sample",
    sampling: common.Sampling = "pixel",
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
    alpha: common.Alpha = "exact",
    views_per_pass: common.PerPass = None,
    small_size: common.SmallSize = None,
    groups: common.Groups = 8,
    references: common.References = 2,
    quiet: common.Quiet = False,
) -> None:
    """Render scene files to the interlaced picture of a display.

    Without -o the picture is called after the first file and the display, in the current folder. Save panels as
    png or webp: a lossy format would mix the views.

    Examples:
      autostereo render bunny.ply --display looking-glass-portrait
      autostereo render room.glb lamp.glb -d visual.json -o room.png
      autostereo render bunny.ply -d alioscopy-8 --swap --background white --samples 4
      autostereo render bunny.ply -d my_panel.toml --size 3840x2160 --camera rig.json
      autostereo render head.nii.gz -d looking-glass-portrait --transfer ct-bone --from left
      autostereo render engine.raw --shape 256x256x128 --dtype uint8 -d alioscopy-8 --iso 120
    """
    from ..engines.options import Options

    where = common.load_display(display, size, swap, views, continuous)
    options = Options(
        shading=shading, lighting=lighting, sampling=sampling, samples=samples, step=step, volume=volume, alpha=alpha,
        views_per_pass=views_per_pass, groups=groups, references=references,
        small_size=None if small_size is None else common.parse_size(small_size, "--small-size"),
    )  # fmt: skip
    volumes = common.VolumeOptions(shape, dtype, frame, spacing, transfer, mode, iso)
    common.check_side(side, camera)
    rig = common.load_camera(camera)
    own = f"{common.stem(inputs[0])}_{common.slug(display)}{where.ending}.png"
    path = outputs.check_image(output or Path(own), where.picture_size)
    outputs.check_apart(path, *inputs)
    scene = common.load_scene(inputs, background, volumes)
    common.note_idle(options, scene, method)

    from ..display.rig import Rig
    from ..render import render as draw

    rig = rig or Rig.frame(scene, where, side)
    drawn = partial(draw, scene, where, rig, method=method, engine=engine)
    start = perf_counter()
    with common.working("rendering"):
        panel = drawn(options=options)
    note(f"rendered in {perf_counter() - start:.2f} s")
    with common.working("writing"):
        panel.save(path)
    outputs.note_lossy(path, where)
    outputs.note_ending(path, where.ending)
    say(f"{path}  {panel.width}×{panel.height}")
    common.note_reuse(panel, drawn, options)
