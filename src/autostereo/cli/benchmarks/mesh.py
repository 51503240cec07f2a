"""``autostereo bench mesh``: one pass against V passes, with what is asked beside what is reached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...engines.options import Options
from ...errors import InputError
from . import jobs, workloads
from .contenders import OURS, VTK, coverage
from .harness import Bar, Contender, Figure, Measured, Times, band, machine_facts, measure, ratio
from .mesh_contenders import MODERNGL, MeshStudio
from .suite import BenchOptions, Keep, Results, Say, Work, check_works, run_works

if TYPE_CHECKING:
    from pathlib import Path

    from ...display.display import Display
    from .workloads import Size

SCENES = ("sphere", "bunny")
LIGHTINGS = ("vertex", "sample")

Bars = dict[str, tuple[float, float]]  # by peer: at least so many times faster, vertex-lit and per-sample-lit

VIEWS: dict[str, tuple[int, Size, Bars]] = {
    "views-8": (8, (512, 512), {MODERNGL: (6, 4)}),
    "views-48": (48, (420, 560), {MODERNGL: (12, 7), VTK: (50, 30)}),
    "views-96": (96, (1024, 512), {MODERNGL: (20, 10)}),
}
WRITE_BAR = Bar(5, at_least=False)  # times the time of merely writing the pictures, vertex-lit
PANELS: dict[str, tuple[Size, str, Bars]] = {  # against which V-pass views
    "panel-portrait": ((1536, 2048), "views-48", {MODERNGL: (6, 4), VTK: (25, 17)}),
    "panel-8k": ((7680, 4320), "views-96", {MODERNGL: (4, 3)}),
}
DISPLAYS: dict[str, Callable[[Size], Display]] = {
    "panel-portrait": workloads.portrait_display,
    "panel-8k": workloads.panel_8k_display,
}


def run(options: BenchOptions | None = None, say: Say = print, keep: Keep = lambda results: None) -> Results:
    """Measure every work of `options` and return its figures.

    Parameters
    ----------
    options : BenchOptions
    say : callable
        Is told in one line what is being measured and what is left out.
    keep : callable
        Is given all figures so far, after each work.

    Returns
    -------
    list of dict
        See `suite.run_works`.

    Raises
    ------
    InputError
        A name in `only` is no work.
    """
    options = options or BenchOptions()
    check_works("mesh", WORKS, options.only)
    without = () if _has_bunny(options, say) else ("bunny",)
    return run_works(WORKS, MeshStudio(options, say), options, say, without, keep)


def facts(options: BenchOptions | None = None) -> dict[str, Any]:
    """Facts about this machine that the figures depend on, the peers' OpenGL among them."""
    studio = MeshStudio(options or BenchOptions(), lambda line: None)
    return machine_facts() | {"opengl": studio.gl_renderer()}


def _has_bunny(options: BenchOptions, say: Say) -> bool:
    if options.quick:
        return False
    if options.data is None:
        say("without the Stanford bunny: --data names the folder with meshes/bun_zipper.ply")
        return False
    check_bunny(options.data)
    return True


def check_bunny(data: Path) -> None:
    """Raise InputError unless the folder has the Stanford bunny."""
    if not (data / "meshes" / "bun_zipper.ply").is_file():
        raise InputError(f"{data}: expected a folder with meshes/bun_zipper.ply")


# --- works -----------------------------------------------------------------------------------------------------------


def _against_peers(measured: Measured, bars: Bars, note: str) -> list[Figure]:
    """How many times faster than each peer, with the bar for this lighting; plain loops are held to none."""
    figures = []
    for peer in measured.times:
        if peer not in (OURS, "write"):
            bar = Bar(bars[peer][LIGHTINGS.index(measured.lighting)]) if peer in bars else None
            figures.append(measured.ratio(peer, OURS, bar, note))
    return figures


def _views(name: str) -> Callable[[MeshStudio, str, str], list[Figure]]:
    """A stack of views against V passes, and against merely writing it."""
    views, full_size, bars = VIEWS[name]

    def figures(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
        scene, size = studio.scene(scene_name, lighting), studio.size(*full_size)
        rig = workloads.rig_for(scene, views, size)
        contenders = [studio.lit_views(scene, rig, size, lighting), *studio.moderngl(scene, rig, size, lighting)]
        if VTK in bars:
            contenders += studio.vtk(scene, rig, size, lighting)
        contenders.append(studio.write(views * size[0] * size[1] * 4))
        measured = Measured(name, measure(contenders, studio.options.rounds), scene_name, lighting)
        note = f"{coverage(studio.renderer(scene), size):.0%} of a view covered"
        asked = WRITE_BAR if name == "views-96" and lighting == "vertex" else None
        return [*_against_peers(measured, bars, note), measured.ratio(OURS, "write", asked)]

    return figures


def _panel(name: str) -> Callable[[MeshStudio, str, str], list[Figure]]:
    """An interlaced panel against the V passes alone, without their weaving."""
    panel_size, source, bars = PANELS[name]
    views, view_size, _ = VIEWS[source]

    def figures(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
        scene, size = studio.scene(scene_name, lighting), studio.size(*view_size)
        display = DISPLAYS[name](studio.size(*panel_size))
        rig = workloads.rig_for(scene, views, (display.width, display.height))
        peer_rig = workloads.rig_for(scene, views, size)
        contenders = [studio.lit_panel(scene, display, rig, lighting)]
        contenders += studio.moderngl(scene, peer_rig, size, lighting)
        if VTK in bars:
            contenders += studio.vtk(scene, peer_rig, size, lighting)
        measured = Measured(name, measure(contenders, studio.options.rounds), scene_name, lighting)
        return _against_peers(measured, bars, f"peers: {source}, unwoven")

    return figures


def _added_view(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """The cost of a view more, from 48 to 96, in times of writing its pixels."""
    scene, size = studio.scene(scene_name, lighting), studio.size(1024, 512)
    contenders = [
        studio.lit_views(scene, workloads.rig_for(scene, views, size), size, lighting, name)
        for views, name in ((48, "48 views"), (96, "96 views"))
    ]
    contenders.append(studio.write(48 * size[0] * size[1] * 4))
    times = measure(contenders, studio.options.rounds)
    value = band(lambda few, many, write: (many - few) / write, *times.values())
    bar = Bar(5, at_least=False) if lighting == "vertex" else None
    measured = "added view / write"
    return [Figure("added-view", measured, *value, scene=scene_name, lighting=lighting, bar=bar, times=times)]


def _million(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """How the time grows with the number of triangles, 82k to 1.3 million: 1 is linear."""
    views, full_size, _ = VIEWS["views-48"]
    size = studio.size(*full_size)
    contenders, triangles = [], []
    for name in (scene_name, "million"):
        scene = studio.scene(name, lighting)
        triangles.append(len(workloads.the_mesh(scene).faces))
        label = f"{triangles[-1]:,} triangles"
        contenders.append(studio.lit_views(scene, workloads.rig_for(scene, views, size), size, lighting, label))
    times = measure(contenders, studio.options.rounds)
    growth = triangles[1] / triangles[0]
    value = band(lambda few, many: many / few / growth, *times.values())
    bar, note = Bar(1, at_least=False), f"{growth:.0f} times the triangles"
    measured = "time growth / triangle growth"
    return [Figure("million", measured, *value, scene=scene_name, lighting=lighting, bar=bar, times=times, note=note)]


def _weave(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """A 3360² quilt to a 1536×2048 panel against NumPy's fancy indexing, its index arrays made beforehand or not."""
    from .peers_numpy import weave_index

    weave, quilt, viewmap, size = jobs.weave_job(studio.size(3360, 3360), studio.size(1536, 2048))
    plan = (quilt.shape[1], quilt.shape[0]), jobs.WEAVE_GRID, viewmap, size
    index = weave_index(*plan)
    different = int(np.count_nonzero(weave() != quilt[index]))
    contenders = [
        Contender(OURS, weave),
        Contender("NumPy indexing", lambda: quilt[index]),
        Contender("NumPy index arrays and indexing", lambda: quilt[weave_index(*plan)]),
    ]
    times = measure(contenders, studio.options.rounds)
    note = f"{different} of {quilt[index].size} sub-pixels differ"
    return [
        Figure("weave", f"{peer} / {OURS}", *band(ratio, times[peer], times[OURS]), bar=bar, times=times, note=note)
        for peer, bar in ((contenders[1].name, Bar(20)), (contenders[2].name, None))
    ]


def _threads(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """One thread against two, for a stack and for a panel."""
    if jobs.available_threads() < 2:
        studio.say("without thread scaling: Numba has one thread here")
        return []
    scene, size = studio.scene(scene_name, lighting), studio.size(1024, 512)
    display = workloads.portrait_display(studio.size(1536, 2048))
    stack_rig = workloads.rig_for(scene, 96, size)
    panel_rig = workloads.rig_for(scene, display.views, (display.width, display.height))
    works = {
        "views-96": studio.lit_views(scene, stack_rig, size, lighting),
        "panel-portrait": studio.lit_panel(scene, display, panel_rig, lighting),
    }
    figures = []
    for name, work in works.items():
        one = replace(work, name="1 thread", enter=partial(jobs.set_threads, 1))
        two = replace(work, name="2 threads", enter=partial(jobs.set_threads, 2))
        with jobs.threads_restored():
            times = measure([one, two], studio.options.rounds)
        value = band(ratio, times[one.name], times[two.name])
        measured = f"{name}: 1 / 2 threads"
        # the contenders' names say which work, as both appear in the table of times
        times = {f"{name}, {contender}": t for contender, t in times.items()}
        figures.append(
            Figure("threads", measured, *value, scene=scene_name, lighting=lighting, bar=Bar(1.7), times=times)
        )
    return figures


def _memory(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """Peak memory of whole jobs in fresh processes, above a warm-up and the output."""
    figures = []
    for job in jobs.MEMORY_JOBS:
        above, output = jobs.peak_memory(job, lighting, studio.options.quick)
        note = f"output {output / 2**20:.0f} MiB"
        value = (above - output) / 1e6
        measured = f"{job}: peak − output"
        bar = Bar(150, at_least=False)
        figures.append(
            Figure("memory", measured, value, value, value, "MB", scene_name, lighting, bar, note=note)
        )
    return figures


def _start(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """Seconds of importing, and of rendering the bunny on the command line for the first and the second time."""
    rounds = studio.options.rounds
    imported = Times(tuple(jobs.import_seconds() for _ in range(rounds)))
    results = [("import autostereo", imported, 0.3)]
    data = studio.options.data
    if data is not None:
        first, again = jobs.command_seconds(data / "meshes" / "bun_zipper.ply", 1 if studio.options.quick else 3)
        results += [("first render of the bunny", Times((first,)), 60), ("second render", Times(again), 3.5)]
    return [
        Figure("start", name, t.median, min(t.seconds), max(t.seconds), "s", bar=Bar(most, at_least=False))
        for name, t, most in results
    ]


def _agreement(studio: MeshStudio, scene_name: str, lighting: str) -> list[Figure]:
    """The contenders draw the same picture: share of pixels of the outermost views off by more than two levels."""
    scene, size = studio.scene(scene_name, lighting), studio.size(512, 512)
    rig = workloads.rig_for(scene, 8, size)
    stack = studio.renderer(scene).render_views(rig, size=size, options=Options(lighting=lighting))
    loops: dict[str, Any] = {MODERNGL: studio.moderngl_loop(scene, rig, size, lighting)}
    if lighting == "vertex" or not studio.options.specular:  # VTK's highlight is another
        loops[VTK] = studio.vtk_loop(scene, rig, size, "prelit" if lighting == "vertex" else "tuned")
    figures = []
    for peer, loop in loops.items():
        if loop is None:
            continue
        shares = []
        for view in (0, rig.views - 1):
            difference = np.abs(loop.picture(view).astype(int) - stack.color[view, ..., :3]).max(axis=2)
            shares.append(float(np.mean(difference > 2)))
        loop.release()
        value = max(shares) * 100, min(shares) * 100, max(shares) * 100
        measured = f"pixels unlike {peer}"
        figures.append(Figure("agreement", measured, *value, "%", scene_name, lighting, Bar(1, at_least=False)))
    return figures


WORKS: dict[str, Work[MeshStudio]] = {
    "agreement": Work("the contenders' pictures", _agreement, SCENES, LIGHTINGS),
    "views-8": Work("8 views 512×512", _views("views-8"), SCENES, LIGHTINGS),
    "views-48": Work("48 views 420×560", _views("views-48"), SCENES, LIGHTINGS),
    "views-96": Work("96 views 1024×512", _views("views-96"), SCENES, LIGHTINGS),
    "panel-portrait": Work("continuous panel 1536×2048", _panel("panel-portrait"), SCENES, LIGHTINGS),
    "panel-8k": Work("panel 7680×4320, 96 views", _panel("panel-8k"), SCENES, LIGHTINGS),
    "added-view": Work("an added view, 48 to 96 at 1024×512", _added_view, SCENES, LIGHTINGS),
    "million": Work("48 views 420×560 of 1.3 million triangles", _million, ("sphere",), LIGHTINGS),
    "weave": Work("weave a 3360² quilt to 1536×2048", _weave),
    "threads": Work("thread scaling", _threads, ("sphere",), LIGHTINGS),
    "memory": Work("peak memory", _memory, ("sphere",), LIGHTINGS),
    "start": Work("starting", _start),
}
