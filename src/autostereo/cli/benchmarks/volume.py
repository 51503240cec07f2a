"""``autostereo bench volume``: one pass against V passes, single views, and VTK's ray caster on the CPU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...engines.options import Options
from ...frame import decibels, squared_error
from ...scene.scene import Scene
from . import workloads
from .contenders import NPASS, OURS, VTK, Studio, coverage, peer
from .harness import Bar, Contender, Figure, Measured, cores, machine_facts, measure, unlike
from .suite import BenchOptions, Keep, Results, Say, Work, check_works, run_works
from .workloads import Size

if TYPE_CHECKING:
    from ...display.rig import Rig

SCENES = {"128³": 128, "256³": 256}
VTK_BARS = {"128³": Bar(30), "256³": Bar(25)}
VIEW_SIZE: Size = (420, 560)
PANEL_8: Size = (512, 512)
PORTRAIT: Size = (1536, 2048)
TIMED_VIEWS = 3  # of many passes: the two outermost views and the middle one, scaled to all
DOUBLE = Bar(1.8, at_least=False)  # times the time, for twice the views
INDEPENDENT = Bar(1.1, at_least=False)  # times of one panel at different view counts
EXACT = '"exact"'


class VolumeStudio(Studio):
    """Scenes of one volume, and VTK's views of them."""

    def __init__(self, options: BenchOptions, say: Say) -> None:
        super().__init__(options, say)
        self._scenes: dict[str, Scene] = {}

    def scene(self, name: str) -> Scene:
        """Nested semi-transparent shells, shaded, of 128³ or 256³ voxels."""
        if name not in self._scenes:
            self._scenes[name] = workloads.shells_scene(self.voxels(name))
        return self._scenes[name]

    def voxels(self, name: str) -> int:
        """Voxels along each axis, fewer if quick."""
        return max(16, SCENES[name] // self.options.divisor)

    def rig(self, name: str, views: int, size: Size) -> Rig:
        """Cameras for pictures of `size`."""
        return workloads.rig_for(self.scene(name), views, size)

    def n_pass(self, name: str, rig: Rig, size: Size) -> Contender:
        """This engine, one render a view: timed on three views, scaled to all."""
        some = few(rig)
        contender = self.views(self.scene(name), some, size, Options(), NPASS, "n-pass")
        return replace(contender, scale=rig.views / some.views)

    def vtk(self, name: str, rig: Rig, size: Size, called: str = VTK) -> list[Contender]:
        """VTK's ray caster, timed on three views and scaled to all; none if VTK is missing."""
        some = few(rig)
        loop = self.vtk_loop(name, some, size)
        return [] if loop is None else [peer(called, loop, rig.views / some.views)]

    def vtk_loop(self, name: str, rig: Rig, size: Size) -> Any:
        """V passes in VTK, or None."""
        from .peers_vtk_volume import VTKVolumeLoop

        window = self.vtk_window()
        return None if window is None else VTKVolumeLoop(window, self.scene(name), rig, size, cores())


def few(rig: Rig) -> Rig:
    """The rig with its outermost cameras and one in the middle, or itself if it has no more than that."""
    return rig.with_views(min(TIMED_VIEWS, rig.views))


def run(options: BenchOptions | None = None, say: Say = print, keep: Keep = lambda results: None) -> Results:
    """Measure every work of `options` and return its figures; see `mesh.run`.

    Raises
    ------
    InputError
        A name in `only` is no work.
    UnsupportedError
        The engine draws no volumes.
    """
    options = options or BenchOptions()
    check_works("volume", WORKS, options.only)
    return run_works(WORKS, VolumeStudio(options, say), options, say, keep=keep)


def facts(options: BenchOptions | None = None) -> dict[str, Any]:
    """Facts about this machine that the figures depend on."""
    return machine_facts()


# --- works -----------------------------------------------------------------------------------------------------------


def _agreement(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """The contenders draw the same picture, compared at the outermost of 8 views."""
    scene, size = studio.scene(name), studio.size(*PANEL_8)
    rig, renderer, options = studio.rig(name, 8, size), studio.renderer(scene), Options(volume="exact")
    exact = renderer.render_views(rig, size, options=options).color.copy()
    passes = renderer.render_views(rig, size, method="n-pass", options=options).color
    figures = [unlike(f"pixels of {EXACT} unlike {NPASS}", exact, passes, name)]
    loop = studio.vtk_loop(name, rig, size)
    if loop is not None:
        decibels = [psnr(loop.picture(view), exact[view, ..., :3]) for view in (0, rig.views - 1)]
        loop.release()
        value = min(decibels), min(decibels), max(decibels)
        note = "VTK samples points, autostereo integrates between them"
        figures.append(Figure("agreement", f"PSNR of {VTK}", *value, "dB", name, bar=Bar(30), note=note))
    return figures


def _views_48(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """A stack of 48 views against VTK's and this engine's 48 passes."""
    scene, size = studio.scene(name), studio.size(*VIEW_SIZE)
    rig = studio.rig(name, 48, size)
    contenders = [
        studio.views(scene, rig, size, Options()),
        studio.n_pass(name, rig, size),
        *studio.vtk(name, rig, size),
    ]
    measured = Measured("views-48", measure(contenders, studio.options.rounds), name)
    note = f"{coverage(studio.renderer(scene), size):.0%} of a view covered"
    figures = [measured.ratio(VTK, OURS, VTK_BARS[name], note)] if VTK in measured.times else []
    return [*figures, measured.ratio(NPASS, OURS, note=note)]


def _views_96(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """Twice the views."""
    scene, size = studio.scene(name), studio.size(*VIEW_SIZE)
    contenders = [
        studio.views(scene, studio.rig(name, views, size), size, Options(), f"{views} views") for views in (48, 96)
    ]
    measured = Measured("views-96", measure(contenders, studio.options.rounds), name)
    return [measured.ratio("96 views", "48 views", DOUBLE)]


def _exact(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """Every view's own rays against VTK's, 48 views."""
    scene, size = studio.scene(name), studio.size(*VIEW_SIZE)
    rig = studio.rig(name, 48, size)
    contenders = [studio.views(scene, rig, size, Options(volume="exact"), EXACT), *studio.vtk(name, rig, size)]
    if len(contenders) == 1:
        return []
    measured = Measured("exact", measure(contenders, studio.options.rounds), name)
    return [measured.ratio(VTK, EXACT, Bar(1.5))]


def _panels_8(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """Panels of 8 views against this engine's single view and its 8 passes; the single view against VTK's."""
    from ...display.display import Display

    scene, size = studio.scene(name), studio.size(*PANEL_8)
    rig, single = studio.rig(name, 8, size), "single view"
    displays = {
        "wavelength-selective": Display.wavelength_selective(*size),
        "lenticular": Display.lenticular(*size, 8),
    }
    contenders = [studio.views(scene, rig.with_views(1), size, Options(), single)]
    for kind, display in displays.items():
        contenders.append(studio.panel(scene, display, rig, Options(), kind))
        contenders.append(studio.panel(scene, display, rig, Options(), f"{kind}, own 8-pass", "n-pass"))
    contenders += studio.vtk(name, rig.with_views(1), size, f"{VTK} {single}")
    measured = Measured("panels-8", measure(contenders, studio.options.rounds), name)
    figures = [
        measured.ratio("wavelength-selective", single, Bar(1.5, at_least=False), "three views a pixel"),
        measured.ratio("wavelength-selective, own 8-pass", "wavelength-selective", Bar(5)),
        measured.ratio("lenticular", single, Bar(1.2, at_least=False), "one view a pixel"),
        measured.ratio("lenticular, own 8-pass", "lenticular"),
    ]
    if f"{VTK} {single}" in measured.times:
        figures.append(measured.ratio(f"{VTK} {single}", single, Bar(1)))
    return figures


def _portrait(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """A continuous panel at different view counts, against panels of that size with 8 views."""
    from ...display.display import Display

    scene, size = studio.scene(name), studio.size(*PORTRAIT)
    continuous = {views: workloads.portrait_display(size).with_views(views) for views in (8, 48, 96)}
    displays = {f"{views} views": display for views, display in continuous.items()}
    displays["8-view wavelength-selective"] = Display.wavelength_selective(*size)
    displays["8-view slanted"] = replace(
        continuous[8], viewmap=replace(continuous[8].viewmap, continuous=False)  # type: ignore[type-var]
    )
    contenders = [
        studio.panel(scene, display, studio.rig(name, display.views, size), Options(), called)
        for called, display in displays.items()
    ]
    measured = Measured("panel-portrait", measure(contenders, studio.options.rounds), name)
    at_most, rays = Bar(1.3, at_least=False), "three views a pixel in both"
    return [
        measured.ratio("48 views", "8 views", INDEPENDENT),
        measured.ratio("96 views", "8 views", INDEPENDENT),
        measured.ratio("48 views", "8-view wavelength-selective", at_most, rays),
        measured.ratio("48 views", "8-view slanted", at_most, rays),
    ]


def _shared(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """What is lost by sharing samples between views, where it is worst: outermost views, a step transfer function."""
    shells, size = workloads.the_volume(studio.scene(name)), studio.size(*VIEW_SIZE)
    scene = Scene((replace(shells, transfer=workloads.step_transfer()),))
    rig, renderer = workloads.rig_for(scene, 48, size), studio.renderer(scene)
    outermost = [0, rig.views - 1]
    shared = renderer.render_views(rig, size).color[outermost]  # by a list: a copy
    exact = renderer.render_views(rig, size, options=Options(volume="exact")).color[outermost]
    studio.forget(scene)
    decibels = [psnr(a[..., :3], b[..., :3]) for a, b in zip(shared, exact, strict=True)]
    value = min(decibels), min(decibels), max(decibels)
    note = "outermost of 48 views, a step transfer function"
    return [Figure("shared", f'PSNR of "shared" against {EXACT}', *value, "dB", name, bar=Bar(45), note=note)]


def _memory(studio: VolumeStudio, name: str, lighting: str) -> list[Figure]:
    """Peak memory of whole jobs in fresh processes, the interpreter and what it has loaded included."""
    from .jobs_volume import MEMORY_JOBS, VALUE_TYPES, peak_memory

    figures = []
    for job in MEMORY_JOBS:
        for dtype in VALUE_TYPES:
            voxels = studio.voxels(name)
            found = peak_memory(job, dtype, voxels, studio.options)
            value = (found["peak"] - found["output"] - 300e6) / voxels**3
            parts = ", ".join(f"{part} {found[part] / 1e6:.0f} MB" for part in ("peak", "start", "output"))
            bar = Bar(6, at_least=False)
            called = f"{job} of {dtype}: peak − output − 300 MB"
            figures.append(Figure("memory", called, value, value, value, "B/voxel", name, bar=bar, note=parts))
    return figures


def psnr(picture: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Peak signal-to-noise ratio of two pictures or stacks in dB, at most 100: JSON has no infinity."""
    return min(100.0, decibels(squared_error(picture, other)))


def _work(title: str, figures: Callable[[VolumeStudio, str, str], list[Figure]], *scenes: str) -> Work[VolumeStudio]:
    return Work(title, figures, scenes or tuple(SCENES))


WORKS: dict[str, Work[VolumeStudio]] = {
    "agreement": _work("the contenders' pictures", _agreement),
    "views-48": _work("48 views 420×560", _views_48),
    "views-96": _work("96 views 420×560 instead of 48", _views_96),
    "exact": _work("48 views 420×560, every view's own rays", _exact),
    "panels-8": _work("panels 512×512 of 8 views", _panels_8),
    "panel-portrait": _work("continuous panel 1536×2048", _portrait, "256³"),
    "shared": _work("what sharing samples loses", _shared),
    "memory": _work("peak memory", _memory, "256³"),
}
