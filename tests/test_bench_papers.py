"""``bench papers`` measures every table of the papers, and prints what they print beside it."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from autostereo.cli.benchmarks import (
    harness,
    papers,
    papers_plane,
    papers_published,
    papers_varyings,
    report,
    suite,
    workloads,
)
from autostereo.cli.benchmarks.papers_data import Subject
from autostereo.cli.benchmarks.papers_plane import STAGGER
from autostereo.cli.benchmarks.papers_studio import PapersStudio, Way, on_cpu
from autostereo.cli.benchmarks.suite import BenchOptions, Work
from autostereo.display.display import Display
from autostereo.engines import engine as engines
from autostereo.engines.gl import context
from autostereo.engines.options import Options
from autostereo.errors import DependencyError, InputError
from autostereo.render import Renderer
from autostereo.scene.scene import Scene
from autostereo.scene.shapes import icosphere
from gl_device import need_device

SIZE = (48, 32)


def quick(*only, **changes):
    return BenchOptions(quick=True, repeats=1, shrink=32, only=only, **changes)


def silent(line):
    pass


# --- what the papers print -------------------------------------------------------------------------------------------


def test_published_figures_are_those_of_the_papers():
    def printed(table):
        return " · ".join("/".join(f"{value:g}" for value in row.values()) for row in table.values())

    p = papers_published
    assert printed(p.VOLUMES_512) == "463/51/128 · 241/29/57 · 89/10/26 · 15/1.9/8.3 · 15/1.8/7.8"
    large = "116/12.8/39/26.6 · 58.8/6.8/25.6/11.9 · 24.8/3.3/10.5/5.5 · 6.4/0.9/1.9/2.1 · 5.9/0.8/1.8/2"
    assert printed(p.VOLUMES_1900) == large
    assert printed(p.FIGURE_6) == "8.3/1.9/3"
    assert printed(p.VIEWS_2008) == "157/157 · 80/141 · 38/70 · 19/24"
    assert printed(p.ILLUMINATION_2008) == "326/326/160/160 · 168/167/83/83 · 80/80/28/28 · 60/60/24/23"
    assert printed(p.PASSES_2008) == "14/15/23/21/14"
    assert p.VARYINGS_2008 == (13, 14, 2, 4)
    assert p.HEADLINE_2020 == 60 and p.FASTER_FROM_2020 == 10 and p.MULTIPLICATIONS_2020 == (38, 8, 30)
    assert {work.split("-")[0] for work in papers.WORKS} >= set(p.SOURCES)


# --- every table -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    need_device()
    folder, lines = tmp_path_factory.mktemp("papers"), []
    path = folder / "papers.json"
    results = report.bench("papers", quick(), path, lines.append)
    charts = report.plot(folder / "charts", results)
    return SimpleNamespace(results=results, saved=json.loads(path.read_text()), lines=lines, charts=charts)


def found(measured, work, scene, measure):
    (figure,) = [f for f in measured.results if (f["work"], f["scene"], f["measure"]) == (work, scene, measure)]
    return figure


@pytest.mark.parametrize("work", papers.WORKS)
def test_every_work_has_figures_of_every_scene(measured, work):
    figures = [f for f in measured.results if f["work"] == work]
    assert {f["scene"] for f in figures} == set(papers.WORKS[work].scenes)
    for f in figures:
        if f["value"] is None:
            assert f["note"].startswith("not available: "), f
        else:
            assert math.isfinite(f["value"]) and f["low"] <= f["value"] <= f["high"], f
            assert f["value"] > 0 or f["unit"] in ("bytes", "ms", "numbers"), f


def test_nothing_failed_and_nothing_is_not_available(measured):
    assert not [f for f in measured.results if f["value"] is None]


COUNTED = ("2020-multiplications",)  # no scene is drawn


@pytest.mark.parametrize("work", [work for work in papers.WORKS if work not in COUNTED])
def test_every_figure_says_which_data_it_used_and_every_work_has_the_cpu_engine(measured, work):
    figures = [f for f in measured.results if f["work"] == work]
    assert all("data: stand-in " in f["note"] for f in figures), [f for f in figures if "data: " not in f["note"]]
    assert work == "uploads" or any("cpu engine" in f["measure"] for f in figures)


def test_the_ratio_of_one_number_more_stands_beside_the_papers(measured):
    for scene, printed in (("4 views", 2.0), ("8 views", None)):
        rate = {n: found(measured, "2008-varyings", scene, f"{n} numbers")["value"] for n in papers_varyings.NUMBERS}
        ratio = found(measured, "2008-varyings", scene, "14 numbers / 13 numbers")
        assert ratio["value"] == pytest.approx(rate[13] / rate[14]) and ratio["published"] == printed
        assert found(measured, "2008-varyings", scene, "24 numbers / 13 numbers")["published"] is None


def test_staggering_changes_no_picture(measured):
    unlike = [f for f in measured.results if f["measure"] == "numbers that differ"]
    assert len(unlike) == 2 and {f["value"] for f in unlike} == {0.0} and {f["bar"] for f in unlike} == {"≤ 0"}
    for scene in papers.WORKS["2020-stagger"].scenes:
        rate = {m: found(measured, "2020-stagger", scene, m)["value"] for m in ("plane-rasterizer", STAGGER)}
        ratio = found(measured, "2020-stagger", scene, f"plane-rasterizer / {STAGGER}")["value"]
        assert ratio == pytest.approx(rate[STAGGER] / rate["plane-rasterizer"])


def test_depth_image_based_rendering_has_its_rate_and_its_fidelity(measured):
    for views in (f"{n} views" for n in (8, 16, 48, 96)):
        for way in ("dibr, 2 references", "dibr, 4 references"):
            rate = {e: found(measured, "2020-fig15-dibr", views, f"{way}{e}")["value"] for e in ("", ", cpu engine")}
            drawn = {e: found(measured, "2020-fig15-dibr", views, e)["value"] for e in ("single-pass", "cpu engine")}
            ratio = found(measured, "2020-fig15-dibr", views, f"{way} / single-pass")["value"]
            assert ratio == pytest.approx(drawn["single-pass"] / rate[""])
            ratio = found(measured, "2020-fig15-dibr", views, f"{way}, cpu engine / cpu engine")["value"]
            assert ratio == pytest.approx(drawn["cpu engine"] / rate[", cpu engine"])
            all_of_them = found(measured, "2020-fig15-dibr", views, f"PSNR of {way}")["value"]
            worst = found(measured, "2020-fig15-dibr", views, f"its worst view, {way}")["value"]
            assert 15 < worst <= all_of_them < 90


def test_fidelity_is_that_of_the_views():
    """Beside a psnr of its own making; references alone are exact."""
    need_device()
    studio, scene = PapersStudio(quick(), silent), Scene((icosphere(3),))
    rig = workloads.rig_for(scene, 5, SIZE)
    for count in (2, 5):
        way = Way("w", SIZE, rig, "dibr", options=Options(references=count))
        overall, worst = papers_plane.fidelity(studio, "", "", Subject(scene, ""), way)
        exact = Renderer(scene, "gl").render_views(rig, SIZE).color[..., :3].astype(float)
        stack = Renderer(scene, "gl").render_views(rig, SIZE, method="dibr", options=way.options).color[..., :3]
        errors = ((stack - exact) ** 2).mean(axis=(1, 2, 3))
        if count == 5:
            assert (overall.value, worst.value) == (100, 100)
        else:
            assert overall.value == pytest.approx(10 * np.log10(255**2 / errors.mean()))
            assert worst.value == pytest.approx(10 * np.log10(255**2 / errors.max()))


def test_ours_stands_beside_what_is_printed(measured):
    assert found(measured, "2007a-table1", "Engine 256³", "GPU-MV")["published"] == 8.3
    assert found(measured, "2007a-table1", "Engine 256³", "MV sub-res 256×256")["published"] == 3
    assert found(measured, "2007a-table1", "Engine 256³", "MV / GPU-MV")["published"] == pytest.approx(8.3 / 1.9)
    assert found(measured, "2007a-table2", "Skull 256³", "MV sub-res 512×512")["published"] == 1.8
    assert found(measured, "2007a-table2", "Skull 256³", "MV of SV")["published"] == pytest.approx(100 * 0.8 / 5.9)
    assert found(measured, "2007b-points", "1M surfels", "GPU-MV of SV")["published"] == pytest.approx(100 / 3)
    assert found(measured, "2008-table1", "4 views", "geometry-shader")["published"] == 70
    assert found(measured, "2008-table2", "8 views", "geometry-shader, per pixel")["published"] == 23
    assert found(measured, "2008-table3", "12 views", "4 passes")["published"] == 23
    assert found(measured, "2008-table3", "12 views", "1 pass")["published"] is None
    views = "plane-rasterizer, 96 views of 32×16"
    assert found(measured, "2020-headline", "1M vertices", views)["published"] == 60
    assert found(measured, "2020-multiplications", "8 views", "in one pass")["published"] == 8 + 30 / 8


def test_ratios_and_shares_are_those_of_the_rates(measured):
    scene = "Neghip 64³"
    rate = {name: found(measured, "2007a-table1", scene, name)["value"] for name in ("SV", "MV", "GPU-MV")}
    ratio = found(measured, "2007a-table1", scene, "MV / GPU-MV")
    assert ratio["value"] == pytest.approx(rate["GPU-MV"] / rate["MV"])
    assert found(measured, "2007a-table1", scene, "MV of SV")["value"] == pytest.approx(100 * rate["MV"] / rate["SV"])
    assert ratio["bar"] == "≥ 2.5" and ratio["met"] is None  # quick: held to no bar


def test_what_approximations_lose_is_told_apart(measured):
    for scene in papers.WORKS["alpha"].scenes:
        every = {f["measure"]: f["value"] for f in measured.results if (f["work"], f["scene"]) == ("alpha", scene)}
        for engine in ("", ", cpu engine"):
            lost = {m: value for m, value in every.items() if m.endswith("cpu engine") == bool(engine)}
            assert lost.pop(f"PSNR of exact opacity{engine}") > 60  # the same rays in one pass
            names = "averaged opacity", "MV sub-res 256×256", "shared lookups"
            assert set(lost) == {f"PSNR of {name}{engine}" for name in names}
            assert all(value < 60 for value in lost.values()), (scene, lost)


def test_a_frame_after_the_first_sends_no_scene_data(measured):
    sent = [f for f in measured.results if f["work"] == "uploads"]
    assert len(sent) == 7 and {f["value"] for f in sent} == {0.0}


def test_the_report_names_the_device_and_json_holds_all(measured):
    assert measured.saved["figures"] == measured.results
    device = need_device()
    facts = measured.saved["machine"]
    assert facts["device"] == {"renderer": device.renderer, "hardware": device.is_hardware}
    assert any(line.startswith(f"OpenGL: {device.renderer}, ") for line in report.describe(facts))


def test_charts_are_pictures(measured):
    names = {path.name for path in measured.charts}
    assert {"2007a-table1-fps.png", "2007a-chart2-percent.png", "2008-table3-fps.png", "2020-fig15-fps.png"} <= names
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in measured.charts)


# --- what goes wrong -------------------------------------------------------------------------------------------------


@pytest.fixture
def no_device(monkeypatch):
    """A process that gets no OpenGL, and has none yet."""
    monkeypatch.setattr(context, "_made", DependencyError("engine gl gets no OpenGL context"))
    monkeypatch.setattr(engines, "_made", {})


@pytest.mark.usefixtures("no_device")
def test_without_a_device_the_reason_is_said_once(capsys):
    lines = []
    results = report.bench("papers", quick("2020-multiplications", "2008-table3"), None, lines.append)
    assert [line for line in lines if "context" in line] == ["without engine gl: engine gl gets no OpenGL context"]
    notes = {f["note"].split("; ")[0] for f in results if f["value"] is None}
    assert notes == {"not available: no OpenGL"}
    assert [f["measure"] for f in results if f["value"] is not None] == ["cpu engine"]
    assert "OpenGL: none" in capsys.readouterr().out


@pytest.mark.usefixtures("no_device")
def test_where_nothing_can_be_measured_the_reason_is_the_error():
    with pytest.raises(DependencyError, match=r"^engine gl gets no OpenGL context$"):
        report.bench("papers", quick("2020-multiplications"), None, silent)


def test_what_a_driver_refuses_costs_one_figure():
    class Broken:
        def render_views(self, *arguments, **named):
            raise RuntimeError("out of nothing\nmore")

    studio, scene = PapersStudio(quick(), silent), Scene((icosphere(1),))
    studio._scenes, studio._renderers = [scene], {(id(scene), "broken"): Broken()}
    rig = workloads.rig_for(scene, 2, SIZE)
    ways = [Way("a", SIZE, rig, engine="broken"), Way("b", SIZE, rig, engine="cpu")]
    row = studio.row("w", "s", Subject(scene, ""), ways)
    assert row.refused == {"a": "failed: RuntimeError: out of nothing"} and list(row.times) == ["b"]
    figure = row.ratio("a", "b", harness.Bar(1)).as_dict()
    assert figure["value"] is None and figure["met"] is False and figure["note"] == row.refused["a"]


def test_an_engine_that_draws_nothing_is_not_timed(monkeypatch):
    studio, scene = PapersStudio(quick(), silent), Scene((icosphere(1),))
    rig = workloads.rig_for(scene, 2, SIZE)
    monkeypatch.setattr(Way, "draw", lambda self, renderer, out=None: np.full((2, 4, 4, 4), 7, np.uint8))
    row = studio.row("w", "s", Subject(scene, ""), [Way("a", SIZE, rig, engine="cpu")])
    assert not row.times and "draws nothing" in row.refused["a"]


def test_what_is_measured_is_kept_when_a_later_work_fails(monkeypatch, tmp_path):
    def fail(studio, scene, lighting):
        raise RuntimeError("no")

    one = harness.Figure("good", "a", 1.0, 1.0, 1.0)
    works = {"good": Work("good", lambda *_: [one]), "bad": Work("bad", fail)}
    monkeypatch.setattr(papers, "WORKS", works)
    with pytest.raises(RuntimeError):
        report.bench("papers", quick(), tmp_path / "p.json", silent)
    assert [f["work"] for f in json.loads((tmp_path / "p.json").read_text())["figures"]] == ["good"]


def test_no_work_begins_after_the_budget(monkeypatch):
    now = SimpleNamespace(seconds=0.0)
    monkeypatch.setattr(suite, "time", SimpleNamespace(monotonic=lambda: now.seconds))

    def spend(studio, scene, lighting):
        now.seconds += 10
        return [harness.Figure(scene, "a", 1.0, 1.0, 1.0)]

    lines = []
    works = {"w": Work("work", spend, ("x", "y", "z"))}
    results = suite.run_works(works, None, BenchOptions(budget=15), lines.append)
    assert [f["work"] for f in results] == ["x", "y"]
    assert lines == ["work · x", "work · y", "left out, the budget of 15 s is spent: work · z"]
    with pytest.raises(InputError, match="budget"):
        BenchOptions(budget=0)


def test_unknown_works_are_named():
    with pytest.raises(InputError, match="bench papers: there is no work 'nix'; there are 2007a-table1, "):
        papers.run(quick("nix"), silent)


# --- timing ----------------------------------------------------------------------------------------------------------


def test_no_round_begins_after_the_limit(monkeypatch):
    now = SimpleNamespace(seconds=0.0, frames=0)
    monkeypatch.setattr(harness, "time", SimpleNamespace(perf_counter=lambda: now.seconds))

    def frame():
        now.seconds += 3
        now.frames += 1

    contender = harness.Contender("a", frame, scale=2.0)
    times = harness.measure([contender], 5, least=2, limit=10, warm=True)["a"]
    assert (times.seconds, times.frames) == ((6.0, 6.0), 2)
    assert now.frames == 5  # one to find how many frames, two rounds: the second begins after 9 s, no third after 15
    assert harness.measure([contender], 5, limit=2, warm=True)["a"].seconds == (6.0,)
    assert now.frames == 7  # one round there always is


def test_pictures_stay_on_the_device_only_meanwhile():
    device = need_device()
    scene = Scene((icosphere(2),))
    rig, renderer = workloads.rig_for(scene, 8, SIZE), Renderer(scene, "gl")
    panel = Display.wavelength_selective(*SIZE)
    ways = [Way(m, t, rig, m) for m in ("single-pass", "n-pass") for t in (panel, SIZE)]
    for way in [*ways, Way("n-pass-subres", panel, rig, "n-pass-subres")]:
        wanted = way.draw(renderer).copy()
        assert wanted.max() > 0
        out = np.full_like(wanted, 9)
        with device.without_reading():
            way.draw(renderer, out)
            device.finish()
        assert (out == 9).all()
        assert (way.draw(renderer, out) == wanted).all()


def test_references_are_read_back_nevertheless():
    """What is warped on the CPU has to be there: its picture is the same whether others are read or not."""
    device, scene = need_device(), Scene((icosphere(2),))
    way, renderer = Way("", SIZE, workloads.rig_for(scene, 8, SIZE), "dibr"), Renderer(scene, "gl")
    wanted = way.draw(renderer).copy()
    with device.without_reading():
        assert (way.draw(renderer, np.zeros_like(wanted)) == wanted).all()


def test_cpu_columns_are_drawn_by_the_cpu():
    way = on_cpu(Way("x", SIZE, workloads.rig_for(Scene((icosphere(1),)), 2, SIZE), "geometry-shader"))
    assert (way.name, way.engine, way.method) == ("cpu engine", "cpu", "single-pass")
