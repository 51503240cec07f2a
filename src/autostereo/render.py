"""The one door: pick a method, pick an engine, go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import methods
from .cameras import check_arguments, check_in_view, culling_range, make_camera
from .checks import FARTHEST, real_array
from .display.display import Display
from .display.optics import wanted_phase
from .display.rig import Rig
from .encoders.rgbd import disparity_map, wowvx
from .encoders.stereo import pack
from .engines.engine import Draw, Target, get_engine
from .engines.options import Options
from .errors import InputError, UnsupportedError
from .frame import Panel, ViewStack
from .memory import aligned_empty, check_memory
from .methods import depth_of_field
from .scene.scene import Scene
from .scene.transfer import TransferFunction
from .scene.volume import Volume
from .wording import an, counted

PACKING = {"rgbd": 7}  # bytes for each pixel of a packed picture, its parts included; else 3


def render(
    scene: Any, display: Display, rig: Rig | None = None, *, method: str = "single-pass", engine: str = "auto",
    options: Options | None = None,
) -> Panel:
    """Render the picture that a display's panel shows.

    Parameters
    ----------
    scene : Scene, object or sequence of objects
    display : Display
    rig : Rig, optional
        Cameras; the display's number of views is spread over its baseline. None: `Rig.frame(scene, display)`.
    method : str
        "single-pass", "n-pass", "n-pass-subres", "dibr"; engine gl has more: `get_engine("gl").methods`.
    engine : {"auto", "cpu", "gl", "reference"}
    options : Options, optional

    Returns
    -------
    Panel
        pixels (H, W, 3) uint8.

    Raises
    ------
    AutostereoError
        Bad input, a method the engine lacks, or more memory than the machine has.
    """
    return Renderer(scene, engine).render(display, rig, method=method, options=options)


def render_views(
    scene: Any, rig: Rig, size: tuple[int, int] = (512, 512), *, method: str = "single-pass", engine: str = "auto",
    options: Options | None = None,
) -> ViewStack:
    """Render a stack of views; size = (width, height) of each. See `render` for the rest.

    Returns
    -------
    ViewStack
        color (V, H, W, 4) uint8 and, if asked for in the options, depth (V, H, W) float32.
    """
    return Renderer(scene, engine).render_views(rig, size, method=method, options=options)


class Renderer:
    """A scene made ready once, to render it many times; it keeps prepared data and buffers between frames.

    Arrays that it returns are valid until its next frame of the same kind: copy what must stay.

    Parameters
    ----------
    scene : Scene, object or sequence of objects
    engine : {"auto", "cpu", "gl", "reference"}
    """

    def __init__(self, scene: Any, engine: str = "auto") -> None:
        self.scene = Scene.of(scene)
        self.engine = get_engine(engine, self.scene)
        self._prepared = self.engine.prepare(self.scene)
        self._held: dict[str, NDArray[Any]] = {}

    def render(
        self, display: Display, rig: Rig | None = None, *, method: str = "single-pass", options: Options | None = None,
        out: NDArray[np.uint8] | None = None,
    ) -> Panel:
        """Render a panel; `out` (H, W, 3) uint8 may be given to hold it. See the function `render`."""
        check_arguments(rig, options)
        if not isinstance(display, Display):
            raise InputError(f"display: expected a Display, such as Display.preset('…'), got {type(display).__name__}")
        options = options or Options()
        if options.aperture:
            raise UnsupportedError("options aperture: depth of field is drawn into views, not into panels")
        schedule = methods.get_method(method, self.engine)
        rig = (rig or Rig.frame(self.scene, display)).with_views(display.views)
        if display.viewmap is None:
            return self._render_packed(display, rig, method, options, out)
        size = (display.width, display.height)
        camera = make_camera(rig, size)
        check_in_view(self.scene, rig)
        draw = Draw(
            camera,
            rig.camera_offsets,
            culling_range(rig, display),
            display.viewmap,
            display.flip_x,
            display.flip_y,
            options,
            method,
        )
        shape = (size[1], size[0], 3)
        self._check_room({"panel": shape}, out, schedule.beside(self.engine, self._prepared, draw))
        target = Target(self._array("panel", out, shape, np.uint8))
        schedule.draw_panel(self.engine, self._prepared, draw, target)
        return Panel(target.color, share(target, options))

    def render_views(
        self, rig: Rig, size: tuple[int, int] = (512, 512), *, method: str = "single-pass",
        options: Options | None = None, out: NDArray[np.uint8] | None = None,
    ) -> ViewStack:
        """Render a stack of views; `out` (V, H, W, 4) uint8 may be given to hold it. See `render_views`."""
        return self._render_views(rig, size, method, options, out)

    def _render_views(
        self, rig: Rig, size: tuple[int, int], method: str, options: Options | None, out: NDArray[np.uint8] | None,
        packed: int = 0,
    ) -> ViewStack:
        """A stack of views, of which pictures of `packed` bytes are to be made."""
        check_arguments(rig, options)
        if rig is None:
            raise InputError("rig: expected a Rig, got None")
        options = options or Options()
        schedule = methods.get_method(method, self.engine)
        camera = make_camera(rig, size, options.aperture)
        check_in_view(self.scene, rig)
        offsets = rig.camera_offsets
        shape = (len(offsets), camera.height, camera.width)
        draw = Draw(camera, offsets, culling_range(rig), options=options, method=method)
        held = (self.engine, self._prepared, draw)
        beside = depth_of_field.beside(schedule, *held) if options.aperture else schedule.beside(*held)
        arrays = {"views": (*shape, 4)} | ({"depth": shape} if options.depth else {})
        self._check_room(arrays, out, beside + packed)
        target = Target(self._array("views", out, (*shape, 4), np.uint8))
        if options.depth:
            target.depth = self._array("depth", None, shape, np.float32)
        if options.aperture:
            depth_of_field.draw_views(schedule, self.engine, self._prepared, draw, target)
        else:
            schedule.draw_views(self.engine, self._prepared, draw, target)
        return ViewStack(target.color, target.depth, share(target, options))

    def update(self, transform: Any = None, transfer: Any = None) -> None:
        """Change what the next frame shows without preparing the rest again.

        Parameters
        ----------
        transform : array_like of shape (4, 4) or (objects, 4, 4), optional
            world_from_object, one for all objects or one each.
        transfer : TransferFunction or sequence of them, optional
            One for all volumes, or one each. Voxels are not read again, and gradients are not computed again.

        Raises
        ------
        InputError
            There are not as many as objects or volumes, or they are not of the kind above; nothing is changed then.
        """
        objects = list(self.scene.objects)
        if transform is not None:
            given = real_array("transform", transform, "matrices of numbers")
            each = [given] * len(objects) if given.ndim == 2 else list(given) if given.ndim == 3 else []
            if len(each) != len(objects):
                raise InputError(f"transform: expected one (4, 4) matrix or {len(objects)} of them, got {given.shape}")
            objects = [replace(item, transform=matrix) for item, matrix in zip(objects, each, strict=True)]
        if transfer is not None:
            places = [k for k, item in enumerate(objects) if isinstance(item, Volume)]
            functions = [transfer] * len(places) if isinstance(transfer, TransferFunction) else transfer
            if not places or not isinstance(functions, Sequence) or len(functions) != len(places):
                raise InputError(f"transfer: expected one TransferFunction or {len(places)} of them, one a volume")
            for k, function in zip(places, functions, strict=True):
                objects[k] = replace(objects[k], transfer=function)
        scene = replace(self.scene, objects=tuple(objects))
        self._prepared = self.engine.update(self._prepared, scene)
        self.scene = scene

    def _check_room(self, arrays: Mapping[str, tuple[int, ...]], out: Any, beside: int) -> None:
        """Raise MemoryLimitError unless there is room for all that a frame needs and is not held yet, at once."""
        need = beside
        for name, shape in arrays.items():
            held = self._held.get(name)
            if (held is None or held.shape != shape) and (out is None or name == "depth"):
                need += int(np.prod([int(n) for n in shape])) * (4 if name == "depth" else 1)
        check_memory(need, describe(next(iter(arrays.values()))))

    def _array(self, name: str, out: Any, shape: tuple[int, ...], dtype: type) -> NDArray[Any]:
        """The array to draw into: the caller's, or one kept from frame to frame."""
        if out is not None:
            fits = isinstance(out, np.ndarray) and out.shape == shape and out.dtype == dtype
            if not fits or not out.flags.c_contiguous or not out.flags.writeable:
                raise InputError(f"out: expected a contiguous, writeable {np.dtype(dtype)} array of shape {shape}")
            return out
        held = self._held.get(name)
        if held is None or held.shape != shape:
            self._held.pop(name, None)
            held = self._held[name] = aligned_empty(shape, dtype)
        return held

    def _render_packed(
        self, display: Display, rig: Rig, method: str, options: Options, out: NDArray[np.uint8] | None
    ) -> Panel:
        """Pictures for displays without a mask: packed views, anaglyph, 2D + depth."""
        rig = replace(rig, aspect=rig.aspect or display.aspect)
        options = replace(options, depth=display.layout == "rgbd")
        packed = PACKING.get(display.layout, 3) * int(np.prod(display.picture_size))
        stack = self._render_views(rig, display.view_size, method, options, None, packed)
        if display.layout == "rgbd":
            assert stack.depth is not None
            scale = make_camera(rig, display.view_size).fx * rig.baseline / 8  # as adjacent views of a panel of 9
            disparity = disparity_map(stack.depth[0], rig.focal, scale, display.comfort, display.eyes_swapped)
            pixels = wowvx(stack.color[0], disparity, anamorphic=True)
        else:
            pixels = pack(stack.color, display.layout, swap=display.eyes_swapped, anamorphic=True)
        if out is not None:
            self._array("packed", out, pixels.shape, np.uint8)[...] = pixels
        return Panel(pixels if out is None else out, stack.reused)


def interlace(views: ViewStack, display: Display) -> Panel:
    """Gather the panel's picture from a stack of its V views at the panel's size.

    A continuous display's camera coordinate is rounded to the nearest view.
    """
    if not isinstance(views, ViewStack) or not isinstance(display, Display):
        raise InputError("interlace: expected a ViewStack and a Display")
    if display.viewmap is None:
        raise UnsupportedError(f"{display.name}: {an(display.layout)} picture has no mask to interlace by")
    if (views.width, views.height) != (display.width, display.height) or views.views != display.views:
        raise InputError(
            f"views: expected {display.views} of {display.width}×{display.height} for {display.name}, "
            f"got {views.views} of {views.width}×{views.height}"
        )
    from .engines.cpu import gather

    pixels = np.empty((display.height, display.width, 3), np.uint8)
    gather.interlace(views.color, display.viewmap, display.flip_x, display.flip_y, pixels)
    return Panel(pixels)


def warp(pictures: ViewStack, rig: Rig, offsets: Sequence[float] | NDArray[np.float64] = (0.0,)) -> ViewStack:
    """Views made of pictures with depth, such as one RGBD picture: method "dibr" without a scene.

    Parameters
    ----------
    pictures : ViewStack
        R pictures (R, H, W, 4) with depth (R, H, W), eye depth in the rig's units; inf where there is nothing.
    rig : Rig
        Its field of view and focal plane are those that the pictures were taken with.
    offsets : sequence of R numbers
        Where on the rig's line of cameras the pictures were taken from; 0 is its middle.

    Returns
    -------
    ViewStack
        The rig's views, color (V, H, W, 4) and depth (V, H, W).

    Raises
    ------
    InputError
        There is no depth, some of it is not > 0, or there are not as many offsets as pictures.
    """
    if not isinstance(pictures, ViewStack) or pictures.depth is None:
        raise InputError("pictures: expected a ViewStack with depth")
    if not isinstance(rig, Rig):
        raise InputError(f"rig: expected a Rig, got {type(rig).__name__}")
    check_arguments(rig, None)
    places = np.array(real_array("offsets", offsets, "numbers"), np.float64)
    with np.errstate(over="ignore"):  # beyond float32 is infinitely far
        depths = np.array(real_array("pictures", pictures.depth, "depths that are numbers"), np.float32)
    if places.shape != (pictures.views,) or not (np.abs(places) < FARTHEST).all():
        raise InputError(f"offsets: expected {pictures.views} numbers, one a picture, got {offsets!r}")
    if not (depths > 0).all():
        raise InputError("pictures: expected depths > 0, inf where there is nothing, found zero, negative or NaN")
    from .engines.cpu import dibr

    camera, shape = make_camera(rig, (pictures.width, pictures.height)), (rig.views, *pictures.color.shape[1:])
    check_memory(2 * int(np.prod([int(n) for n in shape])), describe(shape))
    views = Target(np.empty(shape, np.uint8), np.empty(shape[:3], np.float32))
    dibr.warp(Target(np.array(pictures.color, order="C"), depths), places, camera, rig.camera_offsets, views)
    return ViewStack(views.color, views.depth)


def observe(
    panel: Panel, display: Display, view: float | None = None, *, eye: tuple[float, float] | None = None,
    crosstalk: float = 0.0,
) -> NDArray[np.uint8]:
    """What an eye sees of the panel through its optics.

    Parameters
    ----------
    panel : Panel
    display : Display
    view : float, optional
        Camera coordinate u of the zone the eye is in.
    eye : (x, z), optional
        Where the eye is instead, in mm from the panel's centre; needs `display.physical(size_mm=…)`.
    crosstalk : float
        Share of light, 0 ≤ … < 1, from the neighbouring zones.

    Returns
    -------
    ndarray of shape (H, W, 3), uint8
        At each pixel and channel the sub-pixel that its lens shows to the eye.
    """
    if not isinstance(panel, Panel) or not isinstance(display, Display):
        raise InputError("observe: expected a Panel and a Display")
    if display.viewmap is None:
        raise UnsupportedError(f"{display.name}: {an(display.layout)} picture is not seen through lenses")
    if panel.pixels.shape[:2] != (display.height, display.width):
        raise InputError(
            f"panel: expected {display.width}×{display.height} pixels for {display.name}, "
            f"got {panel.width}×{panel.height}"
        )
    from .engines.cpu.observe import observe as look

    wanted = wanted_phase(display, view=view, eye=eye)
    return look(
        panel.pixels, display.viewmap, wanted, crosstalk=crosstalk, flips=(display.flip_x, display.flip_y)
    )


def share(target: Target, options: Options) -> float | None:
    """Share of samples whose colour was reused, when that was asked of an engine that counts; gl shades them all."""
    if options.shading != "reuse" or target.covered == 0:
        return None
    return target.reused / target.covered


def describe(shape: tuple[int, ...]) -> str:
    """A picture's shape in words."""
    if len(shape) == 3 and shape[2] == 3:
        return f"a panel of {shape[1]}×{shape[0]} pixels"
    return f"{counted(shape[0], 'view')} of {shape[2]}×{shape[1]} pixels"
