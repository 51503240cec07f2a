"""What the works of ``bench papers`` share: ways to draw a scene, tried, measured in turns, set beside the paper's.

Throughput as the papers measure it: frames in a row, on the gl engine without reading them back and without waiting
in between; the wait at the end is timed. The cpu engine's pictures are in memory when a frame ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...display.display import Display
from ...display.rig import Rig
from ...engines.options import Options
from ...errors import AutostereoError, UnsupportedError
from ...scene.scene import Scene
from .harness import Bar, Contender, Figure, Times, band, measure, ratio
from .papers_data import Subject
from .suite import BenchOptions, Say
from .workloads import Size

if TYPE_CHECKING:
    from ...engines.gl.context import Device
    from ...engines.gl.programs import Programs
    from ...render import Renderer

FRAMES = 3  # in a row at least: threads of software OpenGL are idle at the end of a lone one
LIMIT = 6.0  # seconds of one table's row after which no round is begun any more
CPU = "cpu engine"


@dataclass(frozen=True)
class Way:
    """One column of a table: how a scene is drawn.

    Attributes
    ----------
    name : str
    target : Display or (width, height)
        A panel, or the size of a stack's views.
    rig : Rig
    method, engine : str
    options : Options
    scene : Scene, optional
        Another than its row's.
    """

    name: str
    target: Display | Size
    rig: Rig
    method: str = "single-pass"
    engine: str = "gl"
    options: Options = field(default_factory=Options)
    scene: Scene | None = None

    def draw(self, renderer: Renderer, out: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """Draw a frame."""
        if isinstance(self.target, Display):
            return renderer.render(self.target, self.rig, method=self.method, options=self.options, out=out).pixels
        return renderer.render_views(self.rig, self.target, method=self.method, options=self.options, out=out).color


@dataclass
class Row:
    """A row of a table, measured: the times of the ways that there are, and why there are not the others."""

    work: str
    scene: str
    data: str
    times: dict[str, Times]
    refused: dict[str, str]
    published: Mapping[str, float]

    def rates(self) -> list[Figure]:
        """Frames per second of every way, beside the paper's."""
        found = []
        for name, spent in self.times.items():
            value = band(lambda seconds: 1.0 / seconds, spent)
            times = {name: spent}
            found.append(self._figure(name, value, "fps", times=times, published=self.published.get(name)))
        return found + [
            self._figure(name, (math.nan,) * 3, "fps", note=reason, published=self.published.get(name))
            for name, reason in self.refused.items()
        ]

    def milliseconds(self, name: str) -> Figure:
        """A frame's time."""
        spent = self.times.get(name)
        value = (math.nan,) * 3 if spent is None else band(lambda seconds: 1e3 * seconds, spent)
        return self._figure(name, value, "ms", note=self.refused.get(name, ""))

    def ratio(self, slow: str, fast: str, bar: Bar | None = None, note: str = "") -> Figure:
        """How many times faster `fast` is, beside the paper's figure if it has both."""
        rates = self.published
        paper = rates[fast] / rates[slow] if slow in rates and fast in rates else None
        reason = "; ".join(dict.fromkeys(self.refused[name] for name in (slow, fast) if name in self.refused))
        value = (math.nan,) * 3 if reason else band(ratio, self.times[slow], self.times[fast])
        return self._figure(f"{slow} / {fast}", value, "×", note=reason or note, published=paper, bar=bar)

    def percent(self, name: str, single: str, published: float | None = None) -> Figure:
        """Frame rate in per cent of the single view's."""
        found = self.ratio(single, name)
        paper = 100 * found.published if found.published is not None else published
        shares = {part: 100 * getattr(found, part) for part in ("value", "low", "high")}
        return replace(found, measure=f"{name} of {single}", unit="%", published=paper, **shares)

    def _figure(self, name: str, value: Sequence[float], unit: str, **rest: Any) -> Figure:
        low, high = min(value[1:]), max(value[1:])
        return noted(Figure(self.work, name, value[0], low, high, unit, self.scene, **rest), self.data)


class PapersStudio:
    """Renderers of the scene at hand, on both engines, and what is known of the device."""

    def __init__(self, options: BenchOptions, say: Say) -> None:
        self.options = options
        self.say = say
        self._scenes: list[Scene] = []
        self._renderers: dict[tuple[int, str], Renderer] = {}

    @property
    def device(self) -> Device | None:
        """The OpenGL device, if there is one."""
        from ...engines.gl.context import get_device

        return get_device() if missing_device() is None else None

    def size(self, width: int, height: int) -> Size:
        """The picture size of a work, smaller each way if quick."""
        return max(8, width // self.options.divisor), max(8, height // self.options.divisor)

    def too_slow(self, work: str) -> bool:
        """Whether the largest rows of a work are to be left out: without a GPU, unless the work is asked for."""
        slow = self.device is None or not self.device.is_hardware
        return slow and not self.options.quick and work not in self.options.only

    def renderer(self, scene: Scene, engine: str) -> Renderer:
        """A scene's renderer; those of a row before are let go."""
        from ...render import Renderer

        if not any(scene is one for one in self._scenes):
            self._begin([scene])
        key = id(scene), engine
        if key not in self._renderers:
            self._renderers[key] = Renderer(scene, engine)
        return self._renderers[key]

    def _begin(self, scenes: list[Scene]) -> None:
        """Keep no more than these."""
        here = {id(scene) for scene in scenes}
        self._scenes = scenes
        self._renderers = {key: kept for key, kept in self._renderers.items() if key[0] in here}

    def row(
        self, work: str, name: str, subject: Subject, ways: Sequence[Way], published: Mapping[str, float] | None = None
    ) -> Row:
        """Try every way, then measure those that draw, in turns."""
        contenders, refused = [], {}
        self._begin([subject.scene, *(way.scene for way in ways if way.scene is not None)])
        for way in ways:
            try:
                contenders.append(self._contender(way.scene or subject.scene, way))
            except AutostereoError as error:
                refused[way.name] = not_available(error)
            except Exception as error:  # a driver's: one table less, not the end
                refused[way.name] = f"failed: {type(error).__name__}: {(str(error).splitlines() or [''])[0]}"
        repeats = self.options.repeats or (1 if self.options.quick else 3)
        minimum, least = (0.0, 1) if self.options.quick else (0.1, FRAMES)
        with self.device.without_reading() if self.device is not None else nullcontext():
            times = measure(contenders, repeats, minimum, least, LIMIT, warm=True)
        return Row(work, name, subject.words, times, refused, published or {})

    def picture_or_why(self, scene: Scene, way: Way) -> tuple[NDArray[np.uint8] | None, str]:
        """A frame, read back, of its own memory; or why there is none."""
        try:
            return way.draw(self.renderer(scene, way.engine)).copy(), ""
        except AutostereoError as error:
            return None, not_available(error)

    def _contender(self, scene: Scene, way: Way) -> Contender:
        """A way that has drawn a frame, without an error of OpenGL, and not nothing."""
        renderer, device = self.renderer(scene, way.engine), self.device
        out = way.draw(renderer)
        if way.engine == "gl" and device is not None:
            with device:
                error = device.ctx.error
            if error != "GL_NO_ERROR":
                raise RuntimeError(error)
        if (out == out.reshape(-1, out.shape[-1])[0]).all():
            raise UnsupportedError(f"engine {way.engine} draws nothing of this by {way.method}")
        finish = device.finish if way.engine == "gl" and device is not None else _nothing
        return Contender(way.name, lambda: way.draw(renderer, out), finish=finish)


def missing_device() -> AutostereoError | None:
    """Why there is no OpenGL device; None where there is one."""
    from ...engines.gl.context import get_device

    try:
        get_device()
    except AutostereoError as error:
        return error
    return None


def not_available(error: AutostereoError) -> str:
    """Why a figure is missing, for its note; why there is no device is said once, at the start (papers.run)."""
    missing = missing_device()
    return f"not available: {'no OpenGL' if missing is not None and str(missing) == str(error) else error}"


def _nothing() -> None:
    pass


@contextmanager
def programs_in_use(device: Device, programs: Programs) -> Iterator[None]:
    """Draw with other programs than the device's own meanwhile."""
    usual, device.programs = device.programs, programs
    try:
        yield
    finally:
        device.programs = usual


def on_cpu(way: Way, name: str = CPU) -> Way:
    """The same in a single pass of the cpu engine."""
    return replace(way, name=name, engine="cpu", method="single-pass")


def noted(figure: Figure, words: str) -> Figure:
    """The figure with one more note."""
    return replace(figure, note="; ".join(note for note in (figure.note, words) if note))
