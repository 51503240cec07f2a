"""``autostereo bench points``: surfels in one pass against V passes."""

from __future__ import annotations

from typing import Any

from ...engines.options import Options
from ...scene.scene import Scene
from . import workloads
from .contenders import NPASS, OURS, Studio, coverage
from .harness import Bar, Figure, Measured, machine_facts, measure, unlike
from .suite import BenchOptions, Keep, Results, Say, Work, check_works, run_works
from .workloads import Size

SURFELS = 1_000_000
VIEW_SIZE: Size = (420, 560)
PORTRAIT: Size = (1536, 2048)
INDEPENDENT = Bar(1.1, at_least=False)  # times of one panel at different view counts


class PointStudio(Studio):
    """The cloud that all works draw."""

    def __init__(self, options: BenchOptions, say: Say) -> None:
        super().__init__(options, say)
        self._scene: Scene | None = None

    def scene(self) -> Scene:
        """A million surfels of a displaced sphere."""
        if self._scene is None:
            self._scene = workloads.surfel_scene(SURFELS // self.options.divisor**2)
        return self._scene


def run(options: BenchOptions | None = None, say: Say = print, keep: Keep = lambda results: None) -> Results:
    """Measure every work of `options` and return its figures; see `mesh.run`.

    Raises
    ------
    InputError
        A name in `only` is no work.
    UnsupportedError
        The engine draws no points.
    """
    options = options or BenchOptions()
    check_works("points", WORKS, options.only)
    return run_works(WORKS, PointStudio(options, say), options, say, keep=keep)


def facts(options: BenchOptions | None = None) -> dict[str, Any]:
    """Facts about this machine that the figures depend on."""
    return machine_facts()


# --- works -----------------------------------------------------------------------------------------------------------


def _agreement(studio: PointStudio, name: str, lighting: str) -> list[Figure]:
    """One pass and V passes draw the same pictures, compared at the outermost of 8 views."""
    scene, size = studio.scene(), studio.size(*VIEW_SIZE)
    rig, renderer = workloads.rig_for(scene, 8, size), studio.renderer(scene)
    one = renderer.render_views(rig, size).color.copy()
    passes = renderer.render_views(rig, size, method="n-pass").color
    return [unlike(f"pixels unlike {NPASS}", one, passes, name)]


def _views_48(studio: PointStudio, name: str, lighting: str) -> list[Figure]:
    """A stack of 48 views against 48 passes."""
    scene, size = studio.scene(), studio.size(*VIEW_SIZE)
    rig = workloads.rig_for(scene, 48, size)
    contenders = [
        studio.views(scene, rig, size, Options()),
        studio.views(scene, rig, size, Options(), NPASS, "n-pass"),
    ]
    measured = Measured("views-48", measure(contenders, studio.options.rounds), name)
    note = f"{coverage(studio.renderer(scene), size):.0%} of a view covered"
    return [measured.ratio(NPASS, OURS, Bar(8), note)]


def _portrait(studio: PointStudio, name: str, lighting: str) -> list[Figure]:
    """A continuous panel at different view counts."""
    scene, size = studio.scene(), studio.size(*PORTRAIT)
    contenders = [
        studio.panel(
            scene,
            workloads.portrait_display(size).with_views(views),
            workloads.rig_for(scene, views, size),
            Options(),
            f"{views} views",
        )
        for views in (8, 48, 96)
    ]
    measured = Measured("panel-portrait", measure(contenders, studio.options.rounds), name)
    return [measured.ratio(f"{views} views", "8 views", INDEPENDENT) for views in (48, 96)]


CLOUD = ("1M surfels",)
WORKS: dict[str, Work[PointStudio]] = {
    "agreement": Work("one pass and V passes", _agreement, CLOUD),
    "views-48": Work("48 views 420×560", _views_48, CLOUD),
    "panel-portrait": Work("continuous panel 1536×2048", _portrait, CLOUD),
}
