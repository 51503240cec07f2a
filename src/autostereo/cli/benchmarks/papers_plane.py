"""The plane rasteriser as the paper of 2020 measured it; and what a frame sends to the device."""

from __future__ import annotations

import math
import statistics
from dataclasses import replace

from ...display.display import Display
from ...engines.options import Options
from ...scene.scene import Scene
from . import papers_data, workloads
from .harness import Bar, Figure
from .papers_data import Subject
from .papers_published import FASTER_FROM_2020, HEADLINE_2020
from .papers_studio import CPU, PapersStudio, Way, noted, on_cpu
from .volume import psnr

ONE, N_TIMES, STAGGER = "plane-rasterizer", "plane-rasterizer-n-pass", "plane-rasterizer-staggered"
TRIANGLES = "single-pass by triangles"  # that the device rasterises
PANEL = (1024, 768)
REFERENCES = (2, 4)  # views that are drawn, and others warped from
MDIBR = "drawn by gl, read back, warped on the CPU; the paper's chart has no printed values"
NONE = Bar(0, at_least=False)
STAGGERED = {"16 views of 512×384": (512, 384), "panel 1024×768 of 48 views": PANEL}


def panel(size: workloads.Size, views: int) -> Display:
    """A slanted panel of that many views, with the lens of an 8K template."""
    return workloads.panel_8k_display(size).with_views(views)


def stage_times(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2020, Fig. 14: what the stages take, at two resolutions and two numbers of views."""
    from ...engines.gl.plane_rasterizer import stage_times as clock

    width, height, views = (int(word) for word in name.replace("×", " ").replace(",", "").split()[:3])
    subject, size = papers_data.sphere(studio.options, 6), studio.size(width, height)
    way = Way(ONE, panel(size, views), workloads.rig_for(subject.scene, views, size), ONE)
    whole = studio.row("2020-fig14", name, subject, [on_cpu(way)])
    picture, reason = studio.picture_or_why(subject.scene, way)
    if picture is None:
        nothing = Figure("2020-fig14", "all stages", *(math.nan,) * 3, "ms", name, note=reason)
        return [noted(nothing, subject.words), whole.milliseconds(CPU)]
    rounds = []
    for _ in range(1 if studio.options.quick else 3):
        with clock() as spent:
            studio.picture_or_why(subject.scene, way)
        rounds.append(spent)
    note = "each stage waits for the one before; the paper's chart has no printed values"
    found = []
    for stage in rounds[0]:
        values = [1e3 * spent[stage] for spent in rounds]
        middle = statistics.median(values)
        figure = Figure("2020-fig14", stage, middle, min(values), max(values), "ms", name, note=note)
        found.append(noted(figure, subject.words))
    return [*found, noted(whole.milliseconds(CPU), "a frame, which has no such stages")]


def staggered(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2020, section 4.3: triangles that begin with different views, so that atomic operations meet less often."""
    work, size, views = "2020-stagger", studio.size(*STAGGERED[name]), int(name.split(" views")[0].split()[-1])
    subject = papers_data.sphere(studio.options, 6)
    rig = workloads.rig_for(subject.scene, views, size)
    target = panel(size, views) if name.startswith("panel") else size
    plain, turned = (Way(method, target, rig, method) for method in (ONE, STAGGER))
    row = studio.row(work, name, subject, [plain, turned, on_cpu(plain)])
    one, why = studio.picture_or_why(subject.scene, plain)
    other, reason = studio.picture_or_why(subject.scene, turned)
    unlike = math.nan if one is None or other is None else float((one != other).sum())
    note = why or reason or "the order of views changes no picture"
    figure = Figure(work, "numbers that differ", *(unlike,) * 3, "numbers", name, bar=NONE, note=note)
    note = "what staggering gains; the paper says that it is done, not what it gains"
    return [*row.rates(), row.ratio(ONE, STAGGER, note=note), noted(figure, subject.words)]


def rates_by_views(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2020, Fig. 15: frame rate against the number of views of one panel; the same pipeline a view at a time."""
    work, views = "2020-fig15", int(name.split()[0])
    subject, size = papers_data.sphere(studio.options, 6), studio.size(*PANEL)
    rig, display = workloads.rig_for(subject.scene, views, size), panel(size, views)
    ways = [Way(ONE, display, rig, ONE), Way(TRIANGLES, display, rig, "instanced"), on_cpu(Way("", display, rig))]
    left_out = views > 48 and studio.too_slow(work)
    if not left_out:
        ways.append(Way(N_TIMES, display, rig, N_TIMES))
    row = studio.row(work, name, subject, ways)
    if left_out:
        row.refused[N_TIMES] = f"left out without a GPU; measured where {work} is named"
    bar = None if left_out or views < 8 else Bar(3.0) if views >= 48 else Bar(1.0)
    note = f"same pipeline, view by view; the paper: ahead above {FASTER_FROM_2020} views"
    return [*row.rates(), row.ratio(N_TIMES, ONE, bar, note)]


def against_warping(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2020, Fig. 15: a panel's pixels shared among so many views, drawn, or warped from a few of them (MDIBR)."""
    work, views = "2020-fig15-dibr", int(name.split()[0])
    side = math.sqrt(views)
    subject, size = papers_data.sphere(studio.options, 6), studio.size(round(PANEL[0] / side), round(PANEL[1] / side))
    rig = workloads.rig_for(subject.scene, views, size)
    exact, alone = Way("single-pass", size, rig), Way(ONE, size, rig, ONE)
    counts = [n for n in REFERENCES if n < views]
    warped = [Way(f"dibr, {n} references", size, rig, "dibr", options=Options(references=n)) for n in counts]
    row = studio.row(work, name, subject, [exact, alone, *warped, on_cpu(exact), *(in_memory(way) for way in warped)])
    ratios = [row.ratio(way.name, exact.name, note=f"views of {size[0]}×{size[1]}; {MDIBR}") for way in warped]
    ratios += [row.ratio(in_memory(way).name, CPU, note="both on the cpu engine") for way in warped]
    return [*row.rates(), *ratios, *(figure for way in warped for figure in fidelity(studio, work, name, subject, way))]


def in_memory(way: Way) -> Way:
    """The same by the cpu engine."""
    return replace(way, name=f"{way.name}, {CPU}", engine="cpu")


def fidelity(studio: PapersStudio, work: str, name: str, subject: Subject, way: Way) -> list[Figure]:
    """PSNR of a way's views, all and the worst of them, against those that are drawn."""
    found, reason = studio.picture_or_why(subject.scene, way)
    exact, why = studio.picture_or_why(subject.scene, replace(way, method="single-pass", options=Options()))
    values = [math.nan, math.nan]
    if found is not None and exact is not None:
        found, exact = found[..., :3], exact[..., :3]
        values = [psnr(found, exact), min(psnr(a, b) for a, b in zip(found, exact, strict=True))]
    names = f"PSNR of {way.name}", f"its worst view, {way.name}"
    note = reason or why or "against the same views drawn, references among them"
    figures = [Figure(work, n, v, v, v, "dB", name, note=note) for n, v in zip(names, values, strict=True)]
    return [noted(figure, subject.words) for figure in figures]


def headline(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2020: a panel of 7680×4320 with 96 views of a scene of about a million vertices.

    The paper rasterises views of 1024×512, whose pixels the panel's sub-pixels take; beside that, sub-pixels rasterised
    where they are, two for each pixel of those views.
    """
    work = "2020-headline"
    scaled = studio.too_slow(work)
    part = 4 if scaled else 1
    size, small = studio.size(7680 // part, 4320 // part), studio.size(1024 // part, 512 // part)
    subject = papers_data.globe(studio.options, 1024, 1024)
    display = panel(size, 96)
    rig, rig_of_views = workloads.rig_for(subject.scene, 96, size), workloads.rig_for(subject.scene, 96, small)
    views = Way(f"{ONE}, 96 views of {small[0]}×{small[1]}", small, rig_of_views, ONE)
    ways = [
        *(views, Way(ONE, display, rig, ONE), Way(TRIANGLES, display, rig, "instanced")),
        *(on_cpu(views, f"{CPU}, the views"), on_cpu(Way("", display, rig))),
    ]
    published = {} if scaled else {views.name: HEADLINE_2020}
    row = studio.row(work, name, subject, ways, published)
    note = f"panel {size[0]}×{size[1]}, {len(workloads.the_mesh(subject.scene).vertices)} vertices"
    note += "; 1/16 of the pixels without a GPU, all where the work is named" if scaled else "; the paper: more than"
    return [noted(figure, note) for figure in row.rates()]


def uploads(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """Bytes of scene data that frames after the first send to the device."""
    from ...scene.samples import shells

    subjects = {
        "volume": Subject(Scene((shells(16),)), "data: stand-in shells(16)"),
        "points": papers_data.surfels(studio.options, 1000),
        "mesh": papers_data.sphere(studio.options, 3),
    }
    (scene, words), size = subjects[name], (64, 64)
    found = []
    for method in ("single-pass", "n-pass", *((ONE,) if name == "mesh" else ())):
        way = Way(method, Display.wavelength_selective(*size), workloads.rig_for(scene, 8, size), method)
        picture, reason = studio.picture_or_why(scene, way)
        device, value = studio.device, math.nan
        if picture is not None and device is not None:
            before = device.uploaded
            for _ in range(3):
                way.draw(studio.renderer(scene, "gl"))
            value = float(device.uploaded - before)
        called = f"{method}: sent by three more frames"
        figure = Figure("uploads", called, value, value, value, "bytes", name, bar=NONE, note=reason)
        found.append(noted(figure, words))
    return found
