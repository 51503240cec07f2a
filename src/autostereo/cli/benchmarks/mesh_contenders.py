"""The contenders of the mesh benchmark, made for one scene, rig and size each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...engines.options import Options
from ...scene.scene import Scene
from . import peers_moderngl, peers_vtk, workloads
from .contenders import OURS, VTK, Studio, peer
from .harness import Contender, cores
from .peers_numpy import memory_writer
from .suite import BenchOptions, Say
from .workloads import Size

if TYPE_CHECKING:
    from ...display.display import Display
    from ...display.rig import Rig

MODERNGL = "moderngl"


class MeshStudio(Studio):
    """Scenes of one mesh, and the loops that draw them."""

    def __init__(self, options: BenchOptions, say: Say) -> None:
        super().__init__(options, say)
        self._scenes: dict[tuple[str, float], Scene] = {}

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

    def lit_views(self, scene: Scene, rig: Rig, size: Size, lighting: str, name: str = OURS) -> Contender:
        """All views in one pass."""
        return self.views(scene, rig, size, Options(lighting=lighting), name)

    def lit_panel(self, scene: Scene, display: Display, rig: Rig, lighting: str) -> Contender:
        """The interlaced panel in one pass."""
        return self.panel(scene, display, rig, Options(lighting=lighting))

    # --- peers -----------------------------------------------------------------------------------------------------

    def moderngl_loop(
        self, scene: Scene, rig: Rig, size: Size, lighting: str, plain: bool = False
    ) -> peers_moderngl.ModernGLLoop | None:
        """V passes in moderngl, or None."""
        context = self.handle(MODERNGL, peers_moderngl.shared_context)
        return None if context is None else peers_moderngl.ModernGLLoop(context, scene, rig, size, lighting, plain)

    def vtk_loop(self, scene: Scene, rig: Rig, size: Size, variant: str) -> peers_vtk.VTKLoop | None:
        """V passes in VTK, or None."""
        window = self.vtk_window()
        return None if window is None else peers_vtk.VTKLoop(window, scene, rig, size, variant)

    def moderngl(self, scene: Scene, rig: Rig, size: Size, lighting: str) -> list[Contender]:
        """The moderngl loops as contenders, tuned and plain; none if it is missing."""
        variants = {MODERNGL: False, f"{MODERNGL} plain": True}
        loops = {name: self.moderngl_loop(scene, rig, size, lighting, plain) for name, plain in variants.items()}
        return [peer(name, loop) for name, loop in loops.items() if loop is not None]

    def vtk(self, scene: Scene, rig: Rig, size: Size, lighting: str) -> list[Contender]:
        """The VTK loops as contenders: tuned, plain and, for vertex-lit works, lit beforehand."""
        variants = {VTK: "tuned", f"{VTK} plain": "plain"}
        variants |= {f"{VTK} pre-lit": "prelit"} if lighting == "vertex" else {}
        loops = {name: self.vtk_loop(scene, rig, size, variant) for name, variant in variants.items()}
        return [peer(name, loop) for name, loop in loops.items() if loop is not None]

    def write(self, size: int) -> Contender:
        """Merely writing `size` bytes of warm memory."""
        frame, end = memory_writer(size, cores())
        return Contender("write", frame, release=end)

    def gl_renderer(self) -> str | None:
        """What draws for the peers, e.g. llvmpipe."""
        context = self.handle(MODERNGL, peers_moderngl.shared_context)
        return None if context is None else str(context.info["GL_RENDERER"])
