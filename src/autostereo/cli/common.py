"""What the verbs share: options, reading of sizes and displays, messages, progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import FileError, InputError, MemoryLimitError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..display.display import Display
    from ..display.rig import Rig
    from ..engines.options import Options
    from ..scene.scene import Scene
    from ..scene.volume import Volume

MAX_SIDE = 32_768  # what a Display takes


class State:
    """Settings of the running command."""

    quiet = False


STATE = State()


def _set_quiet(value: bool) -> bool:
    STATE.quiet = value
    return value


# --- options, in the words of the help -----------------------------------------------------------------------------
Inputs = Annotated[
    list[Path], typer.Argument(metavar="IN...", help="Scene files, or folders of slices; several are merged.")
]
Output = Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="Output file.")]
DisplayName = Annotated[
    str, typer.Option("--display", "-d", metavar="NAME", help="Preset name, visual.json, or your own .toml.")
]
OptionalDisplayName = Annotated[
    str | None, typer.Option("--display", "-d", metavar="NAME", help="Preset name, visual.json, or your own .toml.")
]
Size = Annotated[str | None, typer.Option("--size", metavar="WxH", help="Size in pixels.")]
Swap = Annotated[bool, typer.Option("--swap", help="Reverse the order of the views (if depth looks inside out).")]
Camera = Annotated[
    Path | None, typer.Option("--camera", metavar="RIG.json", help="Cameras; without it the scene is framed.")
]
ViewCount = Annotated[int | None, typer.Option("--views", "-n", metavar="V", help="Number of views.")]
Continuous = Annotated[
    bool, typer.Option("--continuous", help="Give every sub-pixel its exact angle, not one of V views.")
]
Background = Annotated[
    str | None, typer.Option("--background", metavar="COLOR", help="#rrggbb, R,G,B in 0…1, black, grey or white.")
]
Method = Annotated[str, typer.Option("--method", help="single-pass, n-pass, n-pass-subres or dibr; gl has more.")]
EngineName = Annotated[str, typer.Option("--engine", help="auto, cpu, gl or reference.")]
Shading = Annotated[str, typer.Option("--shading", help="exact, center or reuse.")]
Lighting = Annotated[str, typer.Option("--lighting", help="sample or vertex.")]
Sampling = Annotated[str, typer.Option("--sampling", help="pixel or subpixel.")]
Samples = Annotated[int, typer.Option("--samples", help="Samples per pixel: 1, 4, 16 or 64.")]
Shape = Annotated[str | None, typer.Option("--shape", metavar="XxYxZ", help="Voxels of a .raw file.")]
VoxelType = Annotated[
    str | None, typer.Option("--dtype", metavar="TYPE", help="Type of its voxels: uint8 … float64, uint16be ….")
]
Frame = Annotated[int | None, typer.Option("--frame", metavar="N", help="Which volume of a 4-D file, from 0.")]
Spacing = Annotated[
    str | None, typer.Option("--spacing", metavar="X,Y,Z", help="Distance of voxels, instead of the file's.")
]
Transfer = Annotated[
    str | None,
    typer.Option("--transfer", metavar="NAME", help="Volumes: a .json, a preset such as ct-bone, or a colour map."),
]
Mode = Annotated[str | None, typer.Option("--mode", help="Volumes: composite, mip or iso.")]
Step = Annotated[float, typer.Option("--step", help="Volumes: distance of slices, in voxels.")]
Rays = Annotated[str, typer.Option("--volume", help="Volumes: shared slabs for all views, or exact rays of their own.")]
Alpha = Annotated[str, typer.Option("--alpha", help="exact, or averaged or minimal over three sub-pixels.")]
PerPass = Annotated[
    int | None, typer.Option("--views-per-pass", metavar="N", help="geometry-shader: most views that one pass draws.")
]
SmallSize = Annotated[
    str | None, typer.Option("--small-size", metavar="WxH", help="n-pass-subres: size of its small views.")
]
Groups = Annotated[int, typer.Option("--groups", metavar="K", help="Points by covering-quad, alpha averaged: groups.")]
References = Annotated[int, typer.Option("--references", metavar="R", help="dibr: how many of the views are drawn.")]
Side = Annotated[
    str, typer.Option("--from", metavar="SIDE", help="Look from the front, back, left, right, top or bottom.")
]
Iso = Annotated[float | None, typer.Option("--iso", metavar="VALUE", help="Volumes: the surface of this value.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", callback=_set_quiet, help="Say nothing but errors.")]


# --- reading of values ---------------------------------------------------------------------------------------------
def whole_number(text: str) -> int | None:
    """The whole number ≥ 0 that a text is, or None; no more than 99 digits are read (Python itself stops at 4300)."""
    text = text.strip()
    return int(text) if text.isascii() and text.isdigit() and len(text) < 100 else None


def parse_pair(text: str, name: str, high: int, picture: bool = False) -> tuple[int, int]:
    """Read "AxB" as two whole numbers in 1…high; of a `picture` that is too large an error says what it would take."""
    parts = text.lower().replace("×", "x").split("x")
    counts = [count for part in parts if (count := whole_number(part)) is not None]
    if not len(parts) == len(counts) == 2:
        raise InputError(f"{name}: expected two whole numbers such as 420x560, got {text[:60]!r}")
    first, second = counts
    if not (1 <= first <= high and 1 <= second <= high):
        from ..memory import gigabytes

        large = picture and 0 < first * second < 1e30
        takes = f"; such a picture would take {gigabytes(3 * first * second)} of memory" if large else ""
        raise InputError(f"{name}: expected numbers from 1 to {high}, got {text}{takes}")
    return first, second


def parse_size(text: str, name: str = "--size") -> tuple[int, int]:
    """Read "WxH" in pixels."""
    return parse_pair(text, name, MAX_SIDE, picture=True)


def parse_numbers(text: str, name: str, count: int) -> tuple[float, ...]:
    """Read `count` finite numbers separated by commas."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(abs(number) < float("inf") for number in numbers):
        raise InputError(f"{name}: expected {count} finite numbers separated by commas, got {text!r}")
    return numbers


def parse_color(text: str, name: str = "--background") -> tuple[float, float, float]:
    """Read "#rrggbb", "R,G,B" in 0…1, or a name."""
    names = {"black": (0.0, 0.0, 0.0), "grey": (0.5, 0.5, 0.5), "gray": (0.5, 0.5, 0.5), "white": (1.0, 1.0, 1.0)}
    if text.lower() in names:
        return names[text.lower()]
    if text.startswith("#") and len(text) == 7:
        try:
            value = int(text[1:], 16)
            return (value >> 16) / 255, (value >> 8 & 255) / 255, (value & 255) / 255
        except ValueError:
            pass
    try:
        red, green, blue = parse_numbers(text, name, 3)
        if 0 <= min(red, green, blue) and max(red, green, blue) <= 1:
            return red, green, blue
    except InputError:
        pass
    raise InputError(f"{name}: expected #rrggbb, R,G,B in 0…1, black, grey or white, got {text!r}")


def check_views(views: int | None) -> None:
    """Refuse a view count that is no count."""
    from ..checks import MAX_VIEWS

    if views is not None and not 1 <= views <= MAX_VIEWS:
        raise InputError(f"--views: expected a number from 1 to {MAX_VIEWS}, got {views}")


# --- messages ------------------------------------------------------------------------------------------------------
def say(text: str) -> None:
    """Print a result to stdout unless --quiet."""
    if not STATE.quiet:
        print(text)


def note(text: str) -> None:
    """Print a remark to stderr unless --quiet."""
    if not STATE.quiet:
        print(text, file=sys.stderr, flush=True)


@contextmanager
def working(text: str, total: int | None = None) -> Iterator[Callable[[], None]]:
    """Show a spinner, or a bar over `total` steps, while the block runs; gives a function that counts a step.

    Only on a terminal; nothing in a pipe or with --quiet.
    """
    if STATE.quiet or not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = [SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()]
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(text, total=total)
        yield lambda: progress.advance(task)


def note_compilation() -> None:
    """Say that kernels are being compiled, when they are."""
    note("compiling kernels (once for each kind of picture, up to a minute)…")


def note_idle(options: Options, scene: Scene, method: str) -> None:
    """Name the options that were given and that nothing in this picture asks for."""
    volumes, points = (any(type(item).__name__ == kind for item in scene.objects) for kind in ("Volume", "Points"))
    used = {
        "step": volumes,
        "volume": volumes,
        "alpha": method == "covering-quad" or (volumes and method == "single-pass"),
        "views_per_pass": method.startswith("geometry-shader"),
        "small_size": method == "n-pass-subres",
        "groups": points and method == "covering-quad" and options.alpha != "exact",
        "references": method == "dibr",
    }
    given = [field for field in fields(options) if getattr(options, field.name) != field.default]
    idle = [f"--{field.name.replace('_', '-')}" for field in given if not used.get(field.name, True)]
    if idle:
        note(f"without effect here: {', '.join(idle)}")


def note_reuse(picture: Any, draw: Callable[..., Any], options: Options) -> None:
    """Say which share of the samples was reused, and how near the picture comes to `draw` with exact shading."""
    if picture.reused is None or STATE.quiet:
        return
    said = f"{picture.reused:.0%} of the samples have a nearby view's colour"
    try:
        with working("comparing with exact shading"):
            exact = draw(options=replace(options, shading="exact"))
        note(f"{said}; PSNR {picture.psnr(exact):.1f} dB against exact shading")
    except MemoryLimitError:  # the picture is good, there is no room for a second one
        note(said)


# --- what the verbs work on ----------------------------------------------------------------------------------------
def load_display(
    name: str, size: str | None = None, swap: bool = False, views: int | None = None, continuous: bool = False
) -> Display:
    """Return the display called `name` (preset, visual.json or .toml) with the changes that the options ask for."""
    from ..display.display import Display

    check_views(views)
    display = Display.preset(name, reverse=swap)
    if size is not None:
        display = display.resized(*parse_size(size))
    if views is not None:
        display = display.with_views(views)
    if continuous:
        if display.viewmap is None:
            raise InputError(f"--continuous: {display.name} is not interlaced, it has {display.views} fixed views")
        display = replace(display, viewmap=replace(display.viewmap, continuous=True))
    return display


def slug(name: str) -> str:
    """Return the display's name as part of a file name."""
    return Path(name).stem if name.endswith((".json", ".toml")) else name


def load_camera(path: Path | None) -> Rig | None:
    """Read a rig file; None stays None."""
    if path is None:
        return None
    from ..display.rig import Rig

    return Rig.load(path)


def stem(path: Path) -> str:
    """Return what the output is called after: the file's or the folder's name without .gz and suffix."""
    path = path.resolve() if path.name in ("", ".", "..") else path
    return path.name if path.is_dir() else Path(path.stem).stem if path.suffix.lower() == ".gz" else path.stem


@dataclass(frozen=True)
class VolumeOptions:
    """The options of volumes, as typed."""

    shape: str | None = None
    dtype: str | None = None
    frame: int | None = None
    spacing: str | None = None
    transfer: str | None = None
    mode: str | None = None
    iso: float | None = None

    def hints(self) -> dict[str, Any]:
        """What `load` wants to know."""
        result: dict[str, Any] = {"dtype": self.dtype, "frame": self.frame}
        if self.shape is not None:
            counts = [whole_number(part) for part in self.shape.lower().replace("×", "x").split("x")]
            if len(counts) != 3 or None in counts:
                raise InputError(f"--shape: expected three whole numbers such as 256x256x128, got {self.shape[:60]!r}")
            result["shape"] = tuple(counts)
        if self.spacing is not None:
            result["spacing"] = parse_numbers(self.spacing, "--spacing", 3)
        return result

    def applied(self, scene: Scene) -> Scene:
        """Return the scene with its volumes seen as the options ask for."""
        if self.transfer is None and self.mode is None and self.iso is None:
            return scene
        from ..scene.transfer import TransferFunction
        from ..scene.volume import Volume

        if self.iso is not None and self.mode not in (None, "iso"):
            raise InputError(f"--iso: needs --mode iso, got {self.mode}")
        if not any(isinstance(item, Volume) for item in scene.objects):
            raise InputError("--transfer, --mode and --iso: none of the inputs is a volume")
        file = self.transfer is not None and self.transfer.lower().endswith(".json")
        loaded = TransferFunction.load(self.transfer) if file else None  # type: ignore[arg-type]

        self._check_iso([item for item in scene.objects if isinstance(item, Volume)])

        def seen(volume: Volume) -> Volume:
            changes: dict[str, Any] = {"mode": self.mode or ("composite" if self.iso is None else "iso")}
            if self.iso is not None:
                changes["iso"] = self.iso
            if self.transfer is not None:
                changes["transfer"] = loaded or TransferFunction.fitted(self.transfer, volume)
            return replace(volume, **changes)

        return replace(scene, objects=tuple(seen(x) if isinstance(x, Volume) else x for x in scene.objects))


    def _check_iso(self, volumes: list[Volume]) -> None:
        """Refuse a value that no volume reaches: there would be nothing to see."""
        if self.iso is None or any(low <= self.iso <= high for low, high in (item.value_range for item in volumes)):
            return
        ranges = ", ".join(f"{low:g}…{high:g}" for low, high in (item.value_range for item in volumes))
        raise InputError(f"--iso: expected a value within the volume's, {ranges}, got {self.iso:g}")


def load_scene(paths: list[Path], background: str | None, volumes: VolumeOptions | None = None) -> Scene:
    """Read scene files into one scene."""
    color = parse_color(background) if background is not None else None
    volumes = volumes or VolumeOptions()
    hints = volumes.hints()
    for path in paths:
        if not path.exists():
            raise FileError(f"{path}: no such file")
    with working("reading"):
        from ..io import load

        scene = volumes.applied(load(*paths, **hints))
    return scene if color is None else replace(scene, background=color)


def check_side(side: str, camera: Path | None) -> None:
    """Refuse a side that is none, or that --camera makes meaningless."""
    from ..display.framing import SIDES

    if side not in SIDES:
        raise InputError(f"--from: expected one of {', '.join(SIDES)}, got {side!r}")
    if side != "front" and camera is not None:
        raise InputError("--from: has no meaning with --camera, which says where the cameras stand")


def frame_views(
    scene: Scene, rig: Rig | None, views: int | None, size: tuple[int, int], display: str | None, side: str
) -> Rig:
    """Return the cameras for a stack of views: `rig`, or ones that frame the scene from `side`; `views` of them."""
    from ..display.display import Display
    from ..display.rig import Rig as RigClass

    if rig is not None:
        return rig if views is None else rig.with_views(views)
    if display is not None:
        where = Display.preset(display)
        return RigClass.frame(scene, where if views is None else where.with_views(views), side)
    return RigClass.frame(scene, Display.lenticular(*size, 8 if views is None else views), side)


def load_picture(path: Path, alpha: bool = False) -> NDArray[np.uint8]:
    """Read a picture as (H, W, 3) uint8, or with `alpha` (H, W, 3 or 4)."""
    from ..io.image import read_image

    pixels = read_image(path)
    return pixels if alpha else pixels[..., :3].copy()
