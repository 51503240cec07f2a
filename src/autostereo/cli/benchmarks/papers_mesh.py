"""Points and triangles as Hübner et al. 2007b and de Sorbier et al. 2008 measured them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ...display.display import Display
from ...engines.options import Options
from ...scene.appearance import Material
from ...scene.scene import Scene
from ...scene.shapes import checker
from . import papers_data, workloads
from .harness import Bar, Figure
from .papers_data import Subject
from .papers_published import CHART_CLAIMS, GEOMETRY, GPU_MV, ILLUMINATION_2008, MV, N_PASS, PASSES_2008, SV, VIEWS_2008
from .papers_studio import CPU, PapersStudio, Way, noted, on_cpu

POINTS = {"100k surfels": 100_000, "1M surfels": 1_000_000}
VIEW_2008 = (240, 180)
POINT_BAR = Bar(1.5)
UNLIT = Material(ambient=1.0, diffuse=0.0)
COVERING, PAPER_SPLATS = "GPU-MV covering-quad", "GPU-MV 1+1 pass"
INDEXED = "indexed"
OWN_VERTICES = "vertices of their own, kept on the device: OpenGL's core profile has no immediate mode"


def chart_points(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007b, Chart 2: surfels, 8 views at 512×512 in per cent of the single view."""
    subject = papers_data.surfels(studio.options, POINTS[name])
    averaged = Options(alpha="averaged")
    extra = [("covering-quad", PAPER_SPLATS, averaged)]
    return _chart(studio, "2007b-points", name, subject, extra, POINT_BAR)


def chart_triangles(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007b, Chart 3: indexed triangles, 8 views at 512×512 in per cent of the single view."""
    subject = papers_data.stanford(studio.options, name)
    least = Options(alpha="minimal")
    extra = [("covering-quad", COVERING, Options()), ("covering-quad", f"{COVERING}, least depth", least)]
    return _chart(studio, "2007b-triangles", name, subject, extra, None)


def chart_immediate(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007b, Chart 4: the immediate mode, whose triangles share no vertices; here by vertices of their own.

    OpenGL's core profile has no immediate mode, and the engine keeps scenes on the device: sending them is not timed.
    """
    subject, size = papers_data.stanford(studio.options, name), studio.size(512, 512)
    own, filters = papers_data.unindexed(subject.scene), Display.wavelength_selective(*size)
    rig, claims = workloads.rig_for(subject.scene, 8, size), CHART_CLAIMS["8 views"]
    ways = [
        Way(SV, size, rig.with_views(1), "n-pass"),
        Way(MV, filters, rig, "n-pass"),
        Way(GPU_MV, filters, rig),
        Way(COVERING, filters, rig, "covering-quad"),
        on_cpu(Way("", filters, rig), f"{GPU_MV} on {CPU}"),
    ]
    indexed = [replace(way, name=f"{way.name}, {INDEXED}") for way in ways]
    row = studio.row("2007b-immediate", name, subject, [*(replace(way, scene=own) for way in ways), *indexed])
    multi, *single = (row.percent(way.name, SV, claims[MV if way.name == MV else GPU_MV]) for way in ways[1:4])
    shares = [multi, *(noted(figure, "the paper: at least") for figure in single)]
    pairs = zip(ways, indexed, strict=True)
    gains = [row.ratio(way.name, other.name, note="times the time") for way, other in pairs]
    return [
        figure if figure.measure.endswith(INDEXED) and figure.unit == "fps" else noted(figure, OWN_VERTICES)
        for figure in [*row.rates(), *gains, *shares]
    ]


def _chart(
    studio: PapersStudio,
    work: str,
    name: str,
    subject: Subject,
    extra: Sequence[tuple[str, str, Options]],
    bar: Bar | None,
) -> list[Figure]:
    size = studio.size(512, 512)
    rig, filters = workloads.rig_for(subject.scene, 8, size), Display.wavelength_selective(*size)
    ways = [
        Way(SV, size, rig.with_views(1), "n-pass"),
        Way(MV, filters, rig, "n-pass"),
        Way(GPU_MV, filters, rig),
        *(Way(called, filters, rig, method, options=options) for method, called, options in extra),
        on_cpu(Way("", filters, rig), f"{GPU_MV} on {CPU}"),
    ]
    row = studio.row(work, name, subject, ways)
    claims = CHART_CLAIMS["8 views"]
    shares = [
        row.percent(way.name, SV, claims[MV if way.name == MV else GPU_MV]) for way in ways[1:] if way.engine == "gl"
    ]
    ratios = [row.ratio(MV, way.name, bar if way.name == GPU_MV else None) for way in ways[2:]]
    return [*row.rates(), *ratios, *shares]


# --- de Sorbier 2008 -------------------------------------------------------------------------------------------------


def table_views(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2008, Table 1: views of 240×180, about 80,000 triangles."""
    subject, size, views = papers_data.sphere(studio.options, 6), studio.size(*VIEW_2008), int(name.split()[0])
    return _duplication(studio, "2008-table1", name, subject, workloads.rig_for(subject.scene, views, size), size)


def vertex_heavy(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """Where sharing the work of vertices pays: many triangles, few pixels."""
    subject, size = papers_data.sphere(studio.options, 8), studio.size(60, 45)
    return _duplication(studio, "2008-vertices", name, subject, workloads.rig_for(subject.scene, 8, size), size)


def _duplication(
    studio: PapersStudio, work: str, name: str, subject: Subject, rig: workloads.Rig, size: workloads.Size
) -> list[Figure]:
    ways = [Way(method, size, rig, method) for method in (N_PASS, GEOMETRY, "geometry-shader-painter", "instanced")]
    published = VIEWS_2008[name] if work == "2008-table1" else None
    row = studio.row(work, name, subject, [*ways, on_cpu(ways[0])], published)
    note = "same pipeline, one view a pass"
    return [*row.rates(), *(row.ratio(N_PASS, other, note=note) for other in (GEOMETRY, "instanced", CPU))]


def table_illumination(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2008, Table 2: kinds of illumination by the geometry shader, a pass for all views."""
    size, views = studio.size(*VIEW_2008), int(name.split()[0])
    found = []
    for kind, paper in ILLUMINATION_2008[name].items():
        subject, options = illuminated(studio, kind)
        way = Way(f"{GEOMETRY}, {kind}", size, workloads.rig_for(subject.scene, views, size), GEOMETRY, options=options)
        ways = [way, on_cpu(way, f"{CPU}, {kind}")]
        found += studio.row("2008-table2", name, subject, ways, {way.name: paper}).rates()
    return found


def illuminated(studio: PapersStudio, kind: str) -> tuple[Subject, Options]:
    """A scene of about 80,000 triangles, and options, for a kind of illumination of Table 2."""
    if kind == "texture":
        return changed(papers_data.globe(studio.options, 286, 143), UNLIT, checker()), Options()
    subject = papers_data.sphere(studio.options, 6)
    if kind == "none":
        return changed(subject, UNLIT), Options(lighting="vertex")
    return subject, Options(lighting="vertex" if kind == "per vertex" else "sample")


def changed(subject: Subject, material: Material, texture: Any = None) -> Subject:
    """The same mesh of another material, and with a texture."""
    mesh = replace(workloads.the_mesh(subject.scene), material=material, texture=texture)
    return subject._replace(scene=Scene((mesh,)))


def table_passes(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2008, Table 3: 12 views in 1, 2, 3, 4, 6 passes of the geometry shader."""
    subject, size = papers_data.sphere(studio.options, 6), studio.size(*VIEW_2008)
    rig = workloads.rig_for(subject.scene, 12, size)
    ways = [Way(N_PASS, size, rig, N_PASS)]
    for passes in (1, 2, 3, 4, 6):
        called = "1 pass" if passes == 1 else f"{passes} passes"
        ways.append(Way(called, size, rig, GEOMETRY, options=Options(views_per_pass=12 // passes)))
    row = studio.row("2008-table3", name, subject, [*ways, on_cpu(ways[0])], PASSES_2008[name])
    return [*row.rates(), *(row.ratio(N_PASS, way.name) for way in ways[1:])]
