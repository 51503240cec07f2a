"""autostereo warp: a picture with depth (RGBD) to the picture of a display, or to views."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..wording import an, counted
from . import common, outputs
from .common import note, say
from .views import ANIMATIONS, check_animation, check_animation_room, write_views

if TYPE_CHECKING:
    from ..display.display import Display
    from ..frame import ViewStack


def warp(
    picture: Annotated[Path, typer.Argument(metavar="PICTURE", help="A picture.")],
    depth: Annotated[Path, typer.Argument(metavar="DEPTH", help="Its depths: .npy, or grey .png or .tif of 16 bits.")],
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="OUT", help="Picture; or folder, or .gif .webp .mp4 .npz.")
    ],
    display: common.OptionalDisplayName = None,
    size: common.Size = None,
    swap: common.Swap = False,
    views: common.ViewCount = None,
    camera: common.Camera = None,
    unit: Annotated[float, typer.Option("--unit", help="Of depth: 0.001 makes metres of millimetres.")] = 1.0,
    fov: Annotated[
        float | None, typer.Option("--fov", help="Vertical field of view of the picture, degrees; 36.")
    ] = None,
    quiet: common.Quiet = False,
) -> None:
    """Make views of one picture with depth, from a depth camera or a renderer.

    Depth is measured along the camera's axis; 0 is none. The picture was taken from the middle of the row of cameras;
    what it does not see is guessed. With --display a picture is the interlaced panel, of the picture's middle where its
    shape is another. --camera has the field of view, the focal plane and the baseline; else they suit the depths.

    Examples:
      autostereo warp room.png room_depth.png --unit 0.001 --fov 45 -d looking-glass-portrait -o panel.png
      autostereo warp room.png room_depth.npy -o room.gif --views 12
    """
    from ..checks import LARGEST, SMALLEST, check_number
    from ..image import IMAGE_SUFFIXES

    path, suffix = outputs.folder_or_file(output, (".npz", *ANIMATIONS, *IMAGE_SUFFIXES))
    to_panel = display is not None and suffix in IMAGE_SUFFIXES
    if not to_panel and suffix not in ("", ".npz", *ANIMATIONS):
        raise InputError(f"{path}: expected --display with a picture, or a folder, .npz {' '.join(ANIMATIONS)}")
    if not to_panel and size is not None:
        raise InputError("--size: is that of a panel's picture; views have the size of PICTURE")
    check_number("--unit", unit, SMALLEST, LARGEST)
    if fov is not None and (camera is not None or not 0 < fov < 179):
        raise InputError(f"--fov: expected degrees between 0 and 179, and no --camera, got {fov:g}")
    where = None if display is None else common.load_display(display, size, swap, views)
    if where is not None and where.viewmap is None and to_panel:
        raise InputError(f"{where.name}: {an(where.layout)} picture is not interlaced; leave out --display for views")
    common.check_views(views)
    if to_panel:
        assert where is not None
        outputs.check_image(path, where.picture_size)
    else:
        outputs.check_output(path, (suffix,) if suffix else ())
    outputs.check_apart(path, picture, depth)
    rig = common.load_camera(camera)
    field = rig.fov_y if rig is not None else 36.0 if fov is None else fov
    taken = read_rgbd(picture, depth, unit)
    if suffix in ANIMATIONS and not to_panel:
        check_animation(path, (taken.width, taken.height))

    from ..display.display import Display
    from ..display.framing import frame_depths
    from ..render import warp as draw

    if to_panel:
        assert where is not None
        taken, field = cut_to_shape(taken, where.aspect, field)
    target = where or Display.lenticular(taken.width, taken.height, 8 if views is None else views)
    if rig is None:
        assert taken.depth is not None
        rig = frame_depths(taken.depth[0], target, field)
    rig = replace(rig.with_views(target.views), fov_y=field, aspect=taken.width / taken.height)
    if suffix in ANIMATIONS and not to_panel:
        check_animation_room(path, rig.views, (taken.width, taken.height), 8)  # color and depth
    with common.working(f"warping to {counted(rig.views, 'view')}"):
        stack = draw(taken, rig)
    if to_panel:
        assert where is not None
        write_panel(path, stack, where)
    else:
        write_views(path, suffix, stack, rig)


def read_rgbd(picture: Path, depth: Path, unit: float) -> ViewStack:
    """Read a picture and its depths as a stack of one."""
    import numpy as np

    from ..frame import ViewStack
    from ..io.depth import read_depth

    with common.working("reading"):
        pixels, depths = common.load_picture(picture), read_depth(depth, unit)
    if depths.shape != pixels.shape[:2]:
        (height, width), (rows, columns) = pixels.shape[:2], depths.shape
        raise InputError(f"{depth}: expected {width}×{height} depths, as the picture's pixels, found {columns}×{rows}")
    color = np.full((1, *depths.shape, 4), 255, np.uint8)
    color[0, ..., :3] = pixels
    return ViewStack(color, depths[None])


def cut_to_shape(taken: ViewStack, aspect: float, field: float) -> tuple[ViewStack, float]:
    """Return the middle of a picture that has a panel's shape, and its vertical field of view in degrees."""
    from math import atan, degrees, radians, tan

    from ..frame import ViewStack

    assert taken.depth is not None
    width = min(taken.width, max(1, round(taken.height * aspect)))
    height = min(taken.height, max(1, round(taken.width / aspect)))
    left, top = (taken.width - width) // 2, (taken.height - height) // 2
    middle = slice(None), slice(top, top + height), slice(left, left + width)
    if (width, height) != (taken.width, taken.height):
        note(f"only the middle of the picture has the panel's shape: {width}×{height}")
    share = height / taken.height
    return ViewStack(taken.color[middle], taken.depth[middle]), degrees(2 * atan(share * tan(radians(field) / 2)))


def write_panel(output: Path, stack: ViewStack, display: Display) -> None:
    """Interlace views of whatever size, interpolated, and write the panel's picture."""
    from ..engines.cpu.gather import weave
    from ..image import write_image

    assert display.viewmap is not None
    panel, flips = (display.width, display.height), (display.flip_x, display.flip_y)
    with common.working("weaving"):
        grid = (stack.views, 1)
        write_image(output, weave(stack.quilt(*grid), grid, display.viewmap, panel, "linear", flips))
    outputs.note_lossy(output, display)
    say(f"{output}  {panel[0]}×{panel[1]}")
