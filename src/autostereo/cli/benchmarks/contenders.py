"""This engine as a contender of any benchmark, and peers that may be missing."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ...engines.options import Options
from ...errors import DependencyError, UnsupportedError
from ...scene.scene import Scene
from . import peers_vtk, workloads
from .harness import Contender
from .suite import BenchOptions, Say
from .workloads import Size

if TYPE_CHECKING:
    from ...display.display import Display
    from ...display.rig import Rig
    from ...render import Renderer

OURS = "autostereo"
NPASS = "own n-pass"
VTK = "VTK"


class Loop(Protocol):
    """A peer that draws every view of its rig once a frame."""

    def enter(self) -> None:
        """Make its context current."""

    def frame(self) -> None:
        """Draw every view."""

    def finish(self) -> None:
        """Wait until everything is drawn."""

    def release(self) -> None:
        """Free what it holds."""


class Studio:
    """Renderers and GL contexts that the works share, made on first use.

    Parameters
    ----------
    options : BenchOptions
    say : callable
        Is told in one line what is left out.
    """

    def __init__(self, options: BenchOptions, say: Say) -> None:
        self.options = options
        self.say = say
        self._renderers: dict[Scene, Renderer] = {}
        self._handles: dict[str, Any] = {}

    def size(self, width: int, height: int) -> Size:
        """The picture size of a work, smaller each way if quick."""
        return max(1, width // self.options.divisor), max(1, height // self.options.divisor)

    # --- autostereo ------------------------------------------------------------------------------------------------

    def renderer(self, scene: Scene) -> Renderer:
        """The kept renderer of a scene.

        Raises
        ------
        AutostereoError
            The engine does not draw such a scene; also if it says so by an empty picture, whose time would flatter it.
        """
        from ...render import Renderer

        if scene not in self._renderers:
            renderer = Renderer(scene, engine=self.options.engine)
            if coverage(renderer, (64, 64)) == 0:
                kinds = ", ".join(sorted({type(item).__name__ for item in scene.objects}))
                raise UnsupportedError(f"bench: engine {self.options.engine} draws nothing of this {kinds}")
            self._renderers[scene] = renderer
        return self._renderers[scene]

    def forget(self, scene: Scene) -> None:
        """Free a scene's renderer."""
        self._renderers.pop(scene, None)

    def views(
        self, scene: Scene, rig: Rig, size: Size, options: Options, name: str = OURS, method: str = "single-pass"
    ) -> Contender:
        """All views into a stack that it keeps."""
        renderer = self.renderer(scene)
        out = np.empty((rig.views, size[1], size[0], 4), np.uint8)
        return Contender(name, lambda: renderer.render_views(rig, size, method=method, options=options, out=out))

    def panel(
        self,
        scene: Scene,
        display: Display,
        rig: Rig,
        options: Options,
        name: str = OURS,
        method: str = "single-pass",
    ) -> Contender:
        """The interlaced panel into memory that it keeps."""
        renderer = self.renderer(scene)
        out = np.empty((display.height, display.width, 3), np.uint8)
        return Contender(name, lambda: renderer.render(display, rig, method=method, options=options, out=out))

    # --- peers -----------------------------------------------------------------------------------------------------

    def handle(self, name: str, create: Callable[[], Any]) -> Any:
        """A peer's context or window, or None, said once, when this machine has none."""
        if name not in self._handles:
            try:
                self._handles[name] = create()
            except DependencyError as error:
                self._handles[name] = None
                self.say(f"without {name}: {error}")
        return self._handles[name]

    def vtk_window(self) -> Any:
        """VTK's window, or None."""
        return self.handle(VTK, peers_vtk.shared_window)


def coverage(renderer: Renderer, size: Size) -> float:
    """Share of the centre view's pixels that show the scene."""
    stack = renderer.render_views(workloads.rig_for(renderer.scene, 1, size), size)
    return float(np.count_nonzero(stack.color[..., 3]) / stack.color[..., 3].size)


def peer(name: str, loop: Loop, scale: float = 1.0) -> Contender:
    """A peer's loop as a contender."""
    return Contender(name, loop.frame, finish=loop.finish, enter=loop.enter, release=loop.release, scale=scale)
