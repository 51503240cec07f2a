"""What an engine is: prepare a scene, draw it, gather pictures. The ENGINES table lists every one.

An engine knows arrays, camera offsets, a view map and a target. It knows neither displays nor files.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..checks import shown
from ..errors import InputError, UnsupportedError
from ..scene.scene import Scene
from ..viewmap import ViewMap
from .options import Options


@dataclass(frozen=True, eq=False)
class Camera:
    """The centre camera of a rig at one picture size: all that a projection needs (DESIGN section 1).

    For an eye-space point (X, Y, d) and a camera at offset vd:
    x = width/2 + fx·X/d + fx·vd·(1/focal − 1/d),  y = height/2 − fy·(Y − offset_y)/d − fy·offset_y/focal;
    `shift` is added to both. The samples of a pixel are spread over `spread` of its width, about its centre.
    """

    eye_from_world: NDArray[np.float64]
    fx: float
    fy: float
    width: int
    height: int
    focal: float
    near: float
    offset_y: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    spread: float = 1.0


@dataclass(frozen=True, eq=False)
class Draw:
    """One traversal of the scene.

    Attributes
    ----------
    camera : Camera
    offsets : ndarray of shape (V,), float64
        Camera offsets of the views to draw, ascending.
    culling : (float, float)
        Range of offsets over which culling must be conservative. It is that of the whole rig, also when
        a pass draws one view of it, so that every method draws exactly the same triangles.
    viewmap : ViewMap, optional
        None: draw a stack of views. Else draw the interlaced panel; `offsets` are then those of its V views.
    flip_x, flip_y : bool
        Panel only: the panel shows the picture mirrored.
    options : Options
    method : str
        How to draw, for engines that know several ways (`own_methods`).
    """

    camera: Camera
    offsets: NDArray[np.float64]
    culling: tuple[float, float]
    viewmap: ViewMap | None = None
    flip_x: bool = False
    flip_y: bool = False
    options: Options = field(default_factory=Options)
    method: str = "single-pass"

    @property
    def pixels(self) -> int:
        """Pixels of one view, or of the panel."""
        return self.camera.width * self.camera.height


def channel_camera(camera: Camera, channel: int) -> Camera:
    """The camera whose pixels are sampled where channel 0, 1 or 2 of a panel's lies: in their thirds, left to right."""
    return replace(camera, shift=((1 - channel) / 3, 0.0), spread=1 / 3)


def small_camera(draw: Draw) -> Camera:
    """The camera of a panel's small views, which are scaled up: method n-pass-subres. They are sampled all over.

    Raises
    ------
    InputError
        `Options.small_size` is larger than the panel.
    """
    camera, side = draw.camera, len(draw.offsets) ** 0.5
    usual = max(1, round(camera.width / side)), max(1, round(camera.height / side))
    width, height = draw.options.small_size or usual
    if width > camera.width or height > camera.height:
        most = f"{camera.width}×{camera.height}"
        raise InputError(f"options small_size: expected at most the panel's {most}, got {width}×{height}")
    x, y = width / camera.width, height / camera.height
    shift = camera.shift[0] * x, camera.shift[1] * y
    return replace(camera, width=width, height=height, fx=camera.fx * x, fy=camera.fy * y, shift=shift, spread=1.0)


@dataclass(eq=False)
class Target:
    """Arrays that a draw fills.

    Attributes
    ----------
    color : ndarray of shape (V, H, W, 4) for views or (H, W, 3) for a panel, uint8, C-contiguous
    depth : ndarray of shape (V, H, W), float32, optional
    covered, reused : int
        Counters: shaded samples, and those of them whose colour was reused.
    """

    color: NDArray[np.uint8]
    depth: NDArray[np.float32] | None = None
    covered: int = 0
    reused: int = 0


class Engine(Protocol):
    """A way to draw. `prepare` once per scene, `draw` once per frame and pass.

    An engine that carries out methods by itself, in one `draw`, names them in `own_methods` and is told which in
    `Draw.method`; without that attribute it is "single-pass" alone, and the schedules of methods/ do the rest.
    """

    name: str

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods it can be driven by."""

    def prepare(self, scene: Scene) -> Any:
        """Turn a scene into what this engine draws fastest."""

    def update(self, prepared: Any, scene: Scene) -> Any:
        """Return `prepared` for the same objects under other transforms and transfer functions."""

    def draw(self, prepared: Any, draw: Draw, target: Target) -> None:
        """Fill `target`."""

    def beside(self, prepared: Any, draw: Draw) -> int:
        """Bytes of the pictures that a draw holds beside its target, in main memory."""

    def interlace(self, views: NDArray[np.uint8], draw: Draw, out: NDArray[np.uint8]) -> None:
        """Gather out[r, x, c] from views (V, H, W, 4) by `draw.viewmap`, with flips; u is rounded to a view."""

    def merge_view(self, view: NDArray[np.uint8], index: int, draw: Draw, out: NDArray[np.uint8]) -> None:
        """Write into the panel those sub-pixels that show view `index`, from its picture (H, W, 4)."""

    def weave(
        self, quilt: NDArray[np.uint8], grid: tuple[int, int], draw: Draw, size: tuple[int, int]
    ) -> NDArray[np.uint8]:
        """Gather a panel of `size` from a quilt of views of another size, bilinearly."""


def _cpu() -> Engine:
    from .cpu.engine import CpuEngine

    return CpuEngine()


def _reference() -> Engine:
    from .reference.engine import ReferenceEngine

    return ReferenceEngine()


def _gl() -> Engine:
    from .gl.engine import GlEngine

    return GlEngine()


ENGINES: dict[str, Callable[[], Engine]] = {"cpu": _cpu, "gl": _gl, "reference": _reference}

_made: dict[str, Engine] = {}


@cache
def gpu_answers() -> bool:
    """Whether there is a GPU to draw with; without moderngl nothing is tried."""
    if importlib.util.find_spec("moderngl") is None:
        return False
    from .gl.context import hardware_answers

    return hardware_answers()


def choose_engine(scene: Scene) -> str:
    """The engine that "auto" means: gl where a GPU answers that can draw all of the scene, else cpu."""
    if not gpu_answers():
        return "cpu"
    from .gl.engine import draws

    return "gl" if draws(scene) else "cpu"


def engine_that_has(method: str) -> str | None:
    """The engine that draws by a method of its own, found without starting it; None where there is none."""
    from .gl.engine import METHODS

    return "gl" if any(method in names for names in METHODS.values()) else None


def get_engine(name: str, scene: Scene | None = None) -> Engine:
    """Return the engine called `name`; "auto" is the fastest there is, for the scene if one is given."""
    if isinstance(name, str) and name == "auto":
        name = "cpu" if scene is None else choose_engine(scene)
    if not isinstance(name, str) or name not in ENGINES:
        raise UnsupportedError(f"engine {shown(name)}: there are {', '.join(ENGINES)} and auto")
    if name not in _made:
        _made[name] = ENGINES[name]()
    return _made[name]
