"""The contenders of the mesh benchmark, made for one scene, rig and size each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...engines.options import Options
from ...errors import DependencyError, InputError
from ...scene.scene import Scene
from . import peers_moderngl, peers_vtk, workloads
from .harness import Contender, cores
from .peers_numpy import memory_writer
from .workloads import Size

if TYPE_CHECKING:
    from ...display.display import Display
    from ...display.rig import Rig
    from ...render import Renderer

OURS = "autostereo"
MODERNGL = "moderngl"
VTK = "VTK"


@dataclass(frozen=True)
class BenchOptions:
    """Switches of a benchmark.

    Parameters
    ----------
    quick : bool
        Small pictures of a small sphere, three rounds: shows that all works; its figures are held to no bar.
    only : tuple of str
        Names of works; empty: all.
    data : Path, optional
        Folder with meshes/bun_zipper.ply, the Stanford bunny.
    repeats : int, optional
        Rounds; None: 7, or 3 if quick.
    specular : float
        Weight of the material's highlight in per-sample-lit works.
    """

    quick: bool = False
    only: tuple[str, ...] = ()
    data: Path | None = None
    repeats: int | None = None
    specular: float = 0.0

    def __post_init__(self) -> None:
        if self.repeats is not None and self.repeats < 1:
            raise InputError(f"bench repeats: expected a whole number ≥ 1, got {self.repeats}")
        if self.specular < 0:
            raise InputError(f"bench specular: expected a number ≥ 0, got {self.specular:g}")

    @property
    def rounds(self) -> int:
        """Number of rounds."""
        return self.repeats or (3 if self.quick else 7)


class Studio:
    """Scenes, renderers and GL contexts that the works share, made on first use.

    Parameters
    ----------
    options : BenchOptions
    say : callable
        Is told in one line what is left out.
    """

    def __init__(self, options: BenchOptions, say: Callable[[str], object]) -> None:
        self.options = options
        self.say = say
        self._scenes: dict[tuple[str, float], Scene] = {}
        self._renderers: dict[Scene, Renderer] = {}
        self._handles: dict[str, Any] = {}

    def size(self, width: int, height: int) -> Size:
        """The picture size of a work, a quarter of it each way if quick."""
        return (width // 4, height // 4) if self.options.quick else (width, height)

    def scene(self, name: str, lighting: str) -> Scene:
        """Scene "sphere", "bunny" or "million"; only per-sample-lit ones have the highlight asked for."""
        specular = self.options.specular if lighting == "sample" else 0.0
        if (name, specular) not in self._scenes:
            quick = self.options.quick
            if name == "bunny":
                assert self.options.data is not None
                scene = workloads.bunny_scene(self.options.data, specular)
            else:
                subdivision = (4 if quick else 6) if name == "sphere" else (5 if quick else 8)
                scene = workloads.sphere_scene(subdivision, specular)
            self._scenes[name, specular] = scene
        return self._scenes[name, specular]

    # --- autostereo ------------------------------------------------------------------------------------------------

    def renderer(self, scene: Scene) -> Renderer:
        """The kept cpu renderer of a scene."""
        from ...render import Renderer

        if scene not in self._renderers:
            self._renderers[scene] = Renderer(scene, engine="cpu")
        return self._renderers[scene]

    def views(self, scene: Scene, rig: Rig, size: Size, lighting: str, name: str = OURS) -> Contender:
        """All views in one pass into a kept stack."""
        renderer, options = self.renderer(scene), Options(lighting=lighting)
        return Contender(name, lambda: renderer.render_views(rig, size=size, options=options))

    def panel(self, scene: Scene, display: Display, rig: Rig, lighting: str, name: str = OURS) -> Contender:
        """The interlaced panel in one pass."""
        renderer, options = self.renderer(scene), Options(lighting=lighting)
        return Contender(name, lambda: renderer.render(display, rig, options=options))

    # --- peers -----------------------------------------------------------------------------------------------------

    def _handle(self, name: str, create: Callable[[], Any]) -> Any:
        """A peer's context or window, or None, said once, when this machine has none."""
        if name not in self._handles:
            try:
                self._handles[name] = create()
            except DependencyError as error:
                self._handles[name] = None
                self.say(f"without {name}: {error}")
        return self._handles[name]

    def moderngl_loop(self, scene: Scene, rig: Rig, size: Size, lighting: str) -> peers_moderngl.ModernGLLoop | None:
        """V passes in moderngl, or None."""
        context = self._handle(MODERNGL, peers_moderngl.shared_context)
        return None if context is None else peers_moderngl.ModernGLLoop(context, scene, rig, size, lighting)

    def vtk_loop(self, scene: Scene, rig: Rig, size: Size, variant: str) -> peers_vtk.VTKLoop | None:
        """V passes in VTK, or None."""
        window = self._handle(VTK, peers_vtk.shared_window)
        return None if window is None else peers_vtk.VTKLoop(window, scene, rig, size, variant)

    def moderngl(self, scene: Scene, rig: Rig, size: Size, lighting: str) -> list[Contender]:
        """The moderngl loop as a contender; none if it is missing."""
        loop = self.moderngl_loop(scene, rig, size, lighting)
        return [] if loop is None else [_peer(MODERNGL, loop)]

    def vtk(self, scene: Scene, rig: Rig, size: Size, lighting: str) -> list[Contender]:
        """The VTK loops as contenders: tuned, plain and, for vertex-lit works, lit beforehand."""
        variants = {VTK: "tuned", "VTK plain": "plain"} | ({"VTK pre-lit": "prelit"} if lighting == "vertex" else {})
        loops = {name: self.vtk_loop(scene, rig, size, variant) for name, variant in variants.items()}
        return [_peer(name, loop) for name, loop in loops.items() if loop is not None]

    def write(self, size: int) -> Contender:
        """Merely writing `size` bytes of warm memory."""
        frame, end = memory_writer(size, cores())
        return Contender("write", frame, release=end)

    def gl_renderer(self) -> str | None:
        """What draws for the peers, e.g. llvmpipe."""
        context = self._handle(MODERNGL, peers_moderngl.shared_context)
        return None if context is None else str(context.info["GL_RENDERER"])


def _peer(name: str, loop: peers_moderngl.ModernGLLoop | peers_vtk.VTKLoop) -> Contender:
    return Contender(name, loop.frame, finish=loop.finish, enter=loop.enter, release=loop.release)


