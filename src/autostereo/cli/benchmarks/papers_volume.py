"""Volumes as Hübner and Pajarola 2007a measured them."""

from __future__ import annotations

import math
from dataclasses import replace

from ...display.display import Display
from ...engines.options import Options
from . import papers_data, workloads
from .harness import Bar, Figure
from .papers_data import Subject
from .papers_published import (
    BUCKY,
    CHART_CLAIMS,
    ENGINE,
    FIGURE_6,
    GPU_MV,
    MV,
    NEGHIP,
    SKULL,
    SUBRES_512,
    SUBRES_1900,
    SV,
    VOLUMES_512,
    VOLUMES_1900,
)
from .papers_studio import CPU, PapersStudio, Way, noted, on_cpu
from .volume import psnr

LENTICULAR, MV_LENTICULAR, SLICES = "GPU-MV lenticular", "MV lenticular", "GPU-MV by slices"
OWN = Options(volume="exact")  # no ray takes what another has looked up
EXACT = "GPU-MV, own lookups"
FOCI = (0.5, 0.75, 1.5, 3.0)  # of the distance to the object
SHARED = Bar(2.5)  # three views a pixel, from 64³ on
ONE_VIEW = Bar(6.0)
STEREO = Bar(1.8)


def table_512(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007a, Table 1: 8 views at 512×512; also for a lenticular sheet, one view a pixel."""
    work = "2007a-table1"
    subject = papers_data.volume(studio.options, name)
    size = studio.size(512, 512)
    rig = workloads.rig_for(subject.scene, 8, size)
    filters, lenses = Display.wavelength_selective(*size), Display.lenticular(*size, 8)
    ways = [
        Way(SV, size, rig.with_views(1), "n-pass"),
        Way(MV, filters, rig, "n-pass"),
        Way(GPU_MV, filters, rig),
        Way(LENTICULAR, lenses, rig),
        Way(EXACT, filters, rig, options=OWN),
        on_cpu(Way("", filters, rig), f"{GPU_MV} on {CPU}"),
    ]
    if name in (BUCKY, NEGHIP) or not studio.too_slow(work):
        ways += [Way(MV_LENTICULAR, lenses, rig, "n-pass"), Way(SLICES, filters, rig, options=Options(proxy="slices"))]
    if name in FIGURE_6:
        ways.append(small_views(studio, SUBRES_512, filters, rig))
    row = studio.row(work, name, subject, ways, VOLUMES_512[name] | FIGURE_6.get(name, {}))
    found = row.rates()
    found.append(row.ratio(MV, GPU_MV, None if name == BUCKY else SHARED, "three views a pixel, lookups shared"))
    found.append(row.ratio(MV, EXACT, note="three views a pixel, nothing approximated; lit for each eye, unlike MV"))
    base = MV_LENTICULAR if any(way.name == MV_LENTICULAR for way in ways) else MV
    note = "one view a pixel" + ("" if base == MV_LENTICULAR else "; MV costs the same by every mask")
    found.append(row.ratio(base, LENTICULAR, ONE_VIEW, note))
    return [*found, row.percent(MV, SV), row.percent(GPU_MV, SV)]


def table_1900(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007a, Table 2: 8 views at 1900×1200, with small views scaled up."""
    work = "2007a-table2"
    if name != BUCKY and studio.too_slow(work):
        studio.say(f"left out without a GPU: {work}, {name}; measured where the work is named")
        return []
    subject = papers_data.volume(studio.options, name)
    size = studio.size(1900, 1200)
    rig, filters = workloads.rig_for(subject.scene, 8, size), Display.wavelength_selective(*size)
    ways = [
        Way(SV, size, rig.with_views(1), "n-pass"),
        Way(MV, filters, rig, "n-pass"),
        small_views(studio, SUBRES_1900, filters, rig),
        Way(GPU_MV, filters, rig),
        on_cpu(Way("", filters, rig), f"{GPU_MV} on {CPU}"),
    ]
    row = studio.row(work, name, subject, ways, VOLUMES_1900[name])
    found = row.rates()
    found += [row.ratio(MV, GPU_MV), row.ratio(SUBRES_1900, GPU_MV)]
    return [*found, row.percent(MV, SV), row.percent(GPU_MV, SV)]


def chart_stereo(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007a, Chart 2: two views at 512×512 in per cent of the single view, with early z of 1, 2, 4 pixels a view."""
    work = "2007a-chart2"
    if name in (ENGINE, SKULL) and studio.too_slow(work):
        studio.say(f"left out without a GPU: {work}, {name}; measured where the work is named")
        return []
    subject = papers_data.volume(studio.options, name)
    size = studio.size(512, 512)
    rig = workloads.rig_for(subject.scene, 2, size)
    columns = {pixels: striped(size, pixels) for pixels in (1, 2, 4)}
    early = {f"early z, {pixels} pixels a view": display for pixels, display in columns.items()}
    ways = [
        Way(SV, size, rig.with_views(1), "n-pass"),
        Way("2 MV", columns[1], rig, "n-pass"),
        Way(GPU_MV, columns[1], rig),
        *(Way(called, display, rig, "n-pass-masked") for called, display in early.items()),
        on_cpu(Way("", columns[1], rig), f"{GPU_MV} on {CPU}"),
    ]
    row = studio.row(work, name, subject, ways)
    claims = {"2 MV": CHART_CLAIMS["stereo"][MV]}
    shares = [row.percent(way.name, SV, claims.get(way.name)) for way in ways[1:]]
    return [*row.rates(), row.ratio("2 MV", GPU_MV, STEREO, "stereo"), *shares]


def small_views(
    studio: PapersStudio, name: str, panel: Display, rig: workloads.Rig, options: Options | None = None
) -> Way:
    """Views of the paper's small size, which the name says, scaled up to the panel."""
    width, height = (int(side) for side in name.split()[-1].split("×"))
    options = replace(options or Options(), small_size=studio.size(width, height))
    return Way(name, panel, rig, "n-pass-subres", options=options)


def striped(size: workloads.Size, pixels: int) -> Display:
    """A stereo panel whose views alternate every so many columns of pixels."""
    return Display.from_table(*size, 2, [[[view] * 3 for view in (0, 1) for _ in range(pixels)]])


def focal_plane(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007a/b: the cost of the focal plane's distance from the object, in a single pass."""
    subject = papers_data.volume(studio.options, NEGHIP)
    size = studio.size(512, 512)
    rig, filters = workloads.rig_for(subject.scene, 8, size), Display.wavelength_selective(*size)
    ways = [Way("in focus", filters, rig)]
    ways += [Way(f"focus at {f:g} of the distance", filters, replace(rig, focal_distance=f * rig.focal)) for f in FOCI]
    cpu = [on_cpu(way, f"{way.name}, {CPU}") for way in ways]
    row = studio.row("focal-plane", name, subject, [*ways, *cpu])
    slower = [row.ratio(way.name, some[0].name, note="times the time") for some in (ways, cpu) for way in some[1:]]
    return [*row.rates(), *slower]


def alpha(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007a, Fig. 6, and its one opacity for three views: what they lose, against each view's own rays.

    Each approximation by itself: sharing lookups between the rays of a pixel is the default of the single pass.
    """
    subject = papers_data.volume(studio.options, name)
    size = studio.size(512, 512)
    rig, filters = workloads.rig_for(subject.scene, 8, size), Display.wavelength_selective(*size)
    averaged = replace(OWN, alpha="averaged")
    pairs = [
        (Way("exact opacity", filters, rig, options=OWN), OWN),
        (Way("averaged opacity", filters, rig, options=averaged), OWN),
        (small_views(studio, SUBRES_512, filters, rig, OWN), OWN),
        (Way("shared lookups", filters, rig), Options()),
    ]
    return [
        fidelity(studio, name, subject, replace(way, engine=engine), options)
        for engine in ("gl", "cpu")
        for way, options in pairs
    ]


def fidelity(studio: PapersStudio, name: str, subject: Subject, way: Way, options: Options) -> Figure:
    """PSNR of a way against n passes of its engine."""
    picture, reason = studio.picture_or_why(subject.scene, replace(way, method="n-pass", options=options))
    other, why = studio.picture_or_why(subject.scene, way)
    value = math.nan if picture is None or other is None else psnr(other, picture)
    called = f"PSNR of {way.name}" + ("" if way.engine == "gl" else f", {CPU}")
    return noted(Figure("alpha", called, value, value, value, "dB", name, note=reason or why), subject.words)
