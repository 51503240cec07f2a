"""``autostereo bench papers``: the papers' tables, measured here, beside the figures that they print."""

from __future__ import annotations

from typing import Any

from . import papers_counts, papers_data, papers_mesh, papers_plane, papers_quads, papers_varyings, papers_volume
from .harness import machine_facts
from .papers_published import ILLUMINATION_2008, PASSES_2008, SOURCES, VIEWS_2008, VOLUMES_512
from .papers_studio import PapersStudio, missing_device
from .suite import BenchOptions, Keep, Results, Say, Work, check_works, run_works


def run(options: BenchOptions | None = None, say: Say = print, keep: Keep = lambda results: None) -> Results:
    """Measure every work of `options` and return its figures; see `mesh.run`.

    Raises
    ------
    InputError
        A name in `only` is no work.
    DependencyError, UnsupportedError
        There is no OpenGL, and nothing could be measured without.
    """
    options = options or BenchOptions()
    check_works("papers", WORKS, options.only)
    missing = missing_device()
    if missing is not None:
        say(f"without engine gl: {missing}")
    results = run_works(WORKS, PapersStudio(options, say), options, say, keep=keep)
    if missing is not None and all(f["value"] is None for f in results):
        raise missing
    return results


def facts(options: BenchOptions | None = None) -> dict[str, Any]:
    """Facts about this machine that the figures depend on, the gl engine's device among them."""
    device = PapersStudio(options or BenchOptions(), print).device
    known = None if device is None else {"renderer": device.renderer, "hardware": device.is_hardware}
    return machine_facts() | {"device": known, "sources": SOURCES}


VOLUMES = tuple(VOLUMES_512)
WORKS: dict[str, Work[PapersStudio]] = {
    "2007a-table1": Work("2007a Table 1: volumes, 512×512, 8 views", papers_volume.table_512, VOLUMES),
    "2008-table1": Work("2008 Table 1: views of 240×180", papers_mesh.table_views, tuple(VIEWS_2008)),
    "2020-fig15": Work(
        "2020 Fig. 15: rate by views of one panel",
        papers_plane.rates_by_views,
        tuple(f"{views} views" for views in (2, 8, 16, 48, 96)),
    ),
    "2020-fig15-dibr": Work(
        "2020 Fig. 15: views of one panel's pixels in all, drawn or warped",
        papers_plane.against_warping,
        tuple(f"{views} views" for views in (8, 16, 48, 96)),
    ),
    "2007b-points": Work("2007b Chart 2: points", papers_mesh.chart_points, tuple(papers_mesh.POINTS)),
    "2007b-triangles": Work("2007b Chart 3: triangles", papers_mesh.chart_triangles, tuple(papers_data.MESHES)),
    "2007b-immediate": Work(
        "2007b Chart 4: immediate mode", papers_mesh.chart_immediate, tuple(papers_data.MESHES)
    ),
    "2007a-chart2": Work("2007a Chart 2: stereo", papers_volume.chart_stereo, VOLUMES),
    "2020-headline": Work("2020: 96 views, a million vertices", papers_plane.headline, ("1M vertices",)),
    "2008-table3": Work("2008 Table 3: passes", papers_mesh.table_passes, tuple(PASSES_2008)),
    "2008-table2": Work("2008 Table 2: illumination", papers_mesh.table_illumination, tuple(ILLUMINATION_2008)),
    "2008-varyings": Work(
        "2008 section 5: numbers between stages, 240×180", papers_varyings.varyings, ("4 views", "8 views")
    ),
    "2008-vertices": Work("8 views of 60×45, many vertices", papers_mesh.vertex_heavy, ("1.3M triangles",)),
    "2020-fig14": Work(
        "2020 Fig. 14: stages",
        papers_plane.stage_times,
        ("512×384, 16 views", "1024×768, 16 views", "1024×768, 48 views"),
    ),
    "2020-stagger": Work(
        "2020 section 4.3: triangles begin with different views", papers_plane.staggered, tuple(papers_plane.STAGGERED)
    ),
    "2020-multiplications": Work(
        "2020 section 3: multiplications", papers_counts.multiplications, ("1 view", "8 views", "48 views")
    ),
    "uploads": Work("what a frame sends", papers_plane.uploads, ("volume", "points", "mesh")),
    "alpha": Work("what approximations lose", papers_volume.alpha, VOLUMES[:3]),
    "focal-plane": Work("distance of the focal plane", papers_volume.focal_plane, ("8 views",)),
    "focal-plane-quads": Work(
        "distance of the focal plane, covering quads",
        papers_quads.focal_plane,
        (papers_quads.TRIANGLES, papers_quads.SURFELS),
    ),
    "2007a-table2": Work("2007a Table 2: volumes, 1900×1200, 8 views", papers_volume.table_1900, VOLUMES),
}
