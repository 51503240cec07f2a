"""The benchmarks of volumes and points measure what they say, and VTK is given the same volume."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import autostereo as aus
from autostereo.cli import bench
from autostereo.cli.benchmarks import (
    harness,
    jobs_volume,
    peers_vtk,
    peers_vtk_volume,
    points,
    report,
    volume,
    workloads,
)
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.display.rig import Rig
from autostereo.engines import engine as engines
from autostereo.errors import AutostereoError, DependencyError, InputError, UnsupportedError
from autostereo.render import render_views
from autostereo.scene.appearance import Material
from autostereo.scene.samples import shells
from autostereo.scene.scene import Scene
from autostereo.scene.transfer import TransferFunction
from autostereo.scene.volume import Volume

QUIET = {"quick": True, "repeats": 1, "shrink": 32}


def options(*only, **changes):
    return BenchOptions(**{**QUIET, "only": only, **changes})


def silent(line):
    pass


# --- an engine whose times are known ---------------------------------------------------------------------------------


class Clockwork:
    """Draws one level everywhere; takes a second a frame and, of a stack, one more for each view."""

    name = "clockwork"
    methods = ("single-pass", "n-pass")

    def __init__(self):
        self.now, self.level, self.drawn = 0.0, 100, []

    def prepare(self, scene):
        return scene

    def draw(self, prepared, draw, target):
        self.now += 1.0 + (len(draw.offsets) if draw.viewmap is None else 0)
        self.drawn.append((draw, target.color.shape))
        target.color[...] = self.level + (draw.options.volume == "exact")

    def beside(self, prepared, draw):
        return 0

    def merge_view(self, view, index, draw, out):
        pass


class ClockworkVTK:
    """Ten seconds a view."""

    def __init__(self, window, scene, rig, size, threads):
        self.clock, self.rig, self.size, self.threads = window, rig, size, threads
        window.loops.append(self)

    def enter(self):
        pass

    def frame(self):
        self.clock.engine.now += 10.0 * self.rig.views

    def finish(self):
        pass

    def picture(self, view):
        return np.full((self.size[1], self.size[0], 3), self.clock.engine.level + 1, np.uint8)

    def release(self):
        pass


@pytest.fixture
def clockwork(monkeypatch):
    engine = Clockwork()
    window = SimpleNamespace(engine=engine, loops=[])
    monkeypatch.setitem(engines.ENGINES, "clockwork", lambda: engine)
    monkeypatch.setitem(engines._made, "clockwork", engine)
    monkeypatch.setattr(harness, "time", SimpleNamespace(perf_counter=lambda: engine.now))
    monkeypatch.setattr(peers_vtk, "shared_window", lambda: window)
    monkeypatch.setattr(peers_vtk_volume, "VTKVolumeLoop", ClockworkVTK)
    return window


def figures(suite, *only, **changes):
    found = suite.run(options(*only, engine="clockwork", **changes), silent)
    return {(f["scene"], f["measure"]): f for f in found}


def test_vtk_and_own_passes_are_timed_on_three_views_and_scaled_to_all(clockwork):
    found = figures(volume, "views-48")
    for scene, bar in (("128³", 30.0), ("256³", 25.0)):
        of_vtk, of_passes = found[scene, "VTK / autostereo"], found[scene, "own n-pass / autostereo"]
        assert of_vtk["value"] == pytest.approx(48 * 10 / (1 + 48))
        assert of_passes["value"] == pytest.approx(48 * (1 + 1) / (1 + 48))
        assert (of_vtk["bar"], of_passes["bar"]) == (f"≥ {bar:g}", None)
        assert "VTK: 1/16 of its views timed, × 16" in of_vtk["note"] and "100% of a view" in of_vtk["note"]
        assert {name: t["scale"] for name, t in of_vtk["times"].items()} == {
            "autostereo": 1, "own n-pass": 16, "VTK": 16,
        }
    for loop in clockwork.loops:  # the outermost cameras of the 48, and the middle
        full = workloads.rig_for(Scene(shells(16)), 48, loop.size).camera_offsets
        np.testing.assert_allclose(loop.rig.camera_offsets, [full[0], 0.0, full[-1]], atol=1e-12)


def test_twice_the_views_panels_and_exact_rays(clockwork):
    found = figures(volume, "views-96", "exact", "panels-8")
    for scene in volume.SCENES:
        assert found[scene, "96 views / 48 views"]["value"] == pytest.approx(97 / 49)
        assert found[scene, 'VTK / "exact"']["value"] == pytest.approx(480 / 49)
        assert found[scene, "wavelength-selective / single view"]["value"] == 1 / 2
        assert found[scene, "wavelength-selective, own 8-pass / wavelength-selective"]["value"] == 8 * 2
        assert found[scene, "lenticular / single view"]["value"] == 1 / 2
        assert found[scene, "VTK single view / single view"]["value"] == 10 / 2
        assert found[scene, "VTK single view / single view"]["note"] == ""  # nothing was scaled
    assert {f["bar"] for f in found.values()} == {"≤ 1.8", "≥ 1.5", "≤ 1.5", "≥ 5", "≤ 1.2", "≥ 1", None}
    exact = [draw for draw, _ in clockwork.engine.drawn if draw.options.volume == "exact"]
    assert exact and all(len(draw.offsets) == 48 for draw in exact)


def test_portrait_panels_of_volumes_and_points_are_continuous_at_every_view_count(clockwork):
    found = figures(volume, "panel-portrait") | figures(points, "panel-portrait")
    assert {(f["value"], f["bar"]) for f in found.values()} == {(1.0, "≤ 1.1"), (1.0, "≤ 1.3")}
    panels = [(draw, shape) for draw, shape in clockwork.engine.drawn if draw.viewmap is not None]
    assert {shape for _, shape in panels} == {(2048 // 32, 1536 // 32, 3)}
    assert {(draw.viewmap.continuous, len(draw.offsets)) for draw, _ in panels} == {
        (True, 8), (True, 48), (True, 96), (False, 8),
    }


def test_points_against_all_their_own_passes(clockwork):
    (figure,) = figures(points, "views-48").values()
    assert figure["value"] == pytest.approx(48 * 2 / 49) and figure["bar"] == "≥ 8"
    assert {t["scale"] for t in figure["times"].values()} == {1}


def test_pictures_are_compared(clockwork):
    found = figures(volume, "agreement", "shared")
    assert found["128³", 'pixels of "exact" unlike own n-pass']["value"] == 0
    assert found["128³", "PSNR of VTK"]["value"] == 100  # it draws the level of "exact"
    assert found["256³", 'PSNR of "shared" against "exact"']["value"] == pytest.approx(20 * math.log10(255))
    assert found["256³", 'PSNR of "shared" against "exact"']["bar"] == "≥ 45"


def test_without_vtk_its_ratios_are_missing_and_one_line_says_why(clockwork, monkeypatch):
    def missing():
        raise DependencyError("VTK is not installed")

    monkeypatch.setattr(peers_vtk, "shared_window", missing)
    lines = []
    found = volume.run(options("views-48", "exact", "panels-8", "agreement", engine="clockwork"), lines.append)
    assert not any("VTK /" in f["measure"] or "VTK single" in f["measure"] for f in found)
    assert any("own n-pass" in f["measure"] for f in found)
    assert [line for line in lines if "VTK" in line] == ["without VTK: VTK is not installed"]


def test_an_engine_that_draws_nothing_is_not_measured(clockwork):
    clockwork.engine.level = 0
    with pytest.raises(UnsupportedError, match="clockwork draws nothing of this Volume"):
        figures(volume, "views-48")
    with pytest.raises(UnsupportedError, match="clockwork draws nothing of this Points"):
        figures(points, "views-48")


def test_an_engine_that_refuses_is_quoted(clockwork, monkeypatch):
    def refuse(scene):
        raise UnsupportedError("engine clockwork draws Mesh, the scene holds a Volume")

    monkeypatch.setattr(clockwork.engine, "prepare", refuse)
    with pytest.raises(UnsupportedError, match="engine clockwork draws Mesh"):
        figures(volume, "views-48")


@pytest.mark.parametrize(("suite", "name"), [(volume, "volume"), (points, "points")])
def test_unknown_works_are_named(suite, name):
    with pytest.raises(InputError, match=f"bench {name}: there is no work 'nix'; there are agreement, "):
        suite.run(options("nix"), silent)


def test_report_prints_and_saves_every_benchmark(clockwork, tmp_path, capsys):
    for name in ("volume", "points"):
        path = tmp_path / f"{name}.json"
        found = report.bench(name, options("views-48", engine="clockwork"), path, silent)
        saved = json.loads(path.read_text())
        assert saved["figures"] == found and saved["machine"]["cores"] >= 1
    printed = capsys.readouterr().out
    assert "scaled × 16" in printed and "lit per" not in printed and "OpenGL" not in printed
    assert "0 of 0 bars met" in printed  # quick: held to no bar


def test_the_verb_lists_every_benchmark():
    assert set(bench.BENCHES) == set(report.SUITES)


# --- small functions -------------------------------------------------------------------------------------------------


def test_psnr_is_its_definition():
    a = np.zeros((4, 5, 3), np.uint8)
    b = a.copy()
    assert volume.psnr(a, b) == 100
    b[0, 0, 0] = 255
    assert volume.psnr(a, b) == pytest.approx(10 * math.log10(60))
    assert volume.psnr(b, a) == volume.psnr(a, b)
    assert volume.psnr(np.stack([a, a]), np.stack([a, b])) == pytest.approx(10 * math.log10(120))


def test_there_is_one_psnr():
    """Of pictures, of benchmarks and of the simulator."""
    sources = [path.read_text(encoding="utf-8") for path in Path(aus.__file__).parent.rglob("*.py")]
    assert sum("255.0**2" in source or "255**2" in source for source in sources) == 1


def test_unlike_pixels_are_those_off_by_more_than_a_level():
    stack = np.full((3, 2, 5, 4), 10, np.uint8)
    other = stack.copy()
    other[0, 0, 0, 1] = 11
    other[0, 1, 2, 3] = 8
    other[1] = 0  # not an outermost view
    figure = harness.unlike("m", stack, other)
    assert (figure.value, figure.low, figure.high) == (10.0, 0.0, 10.0)


def test_step_transfer_has_steps_where_the_shells_have_values():
    transfer = workloads.step_transfer()
    for value in (32, 160):
        before, after = transfer.evaluate([value - 1e-9, value])[:, 3]
        assert after - before >= 1
    assert {0, 255} <= set(np.unique(shells(16).values[::5])) | {0, 255}


def test_16_bit_shells_look_the_same():
    wide, narrow = workloads.shells_transfer(np.uint16), workloads.shells_transfer(np.uint8)
    values = np.arange(256)
    np.testing.assert_allclose(wide.evaluate(values * 257), narrow.evaluate(values), atol=1e-9)


# --- memory ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("job", jobs_volume.MEMORY_JOBS)
def test_peak_memory_counts_the_whole_process(job):
    found = jobs_volume.peak_memory(job, "uint16", 16, options(engine="reference", shrink=64))
    width, height = (420 // 64, 560 // 64) if job == "views-48" else (1536 // 64, 2048 // 64)
    assert found["output"] == (48 * width * height * 4 if job == "views-48" else width * height * 3)
    assert 20e6 < found["start"] <= found["peak"] < 2e9


def test_a_failing_job_is_named_with_its_complaint():
    with pytest.raises(AutostereoError, match="bench memory, views-48: engine 'nix': there are"):
        jobs_volume.peak_memory("views-48", "uint8", 16, options(engine="nix"))


# --- VTK is given the same volume ------------------------------------------------------------------------------------

SIZE = (90, 60)


def vtk_loop(volume_, rig, size=SIZE):
    try:
        return peers_vtk_volume.VTKVolumeLoop(peers_vtk.shared_window(), Scene((volume_,)), rig, size, 2)
    except DependencyError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_vtk_absorbs_per_scene_unit_in_every_view(scale):
    """A homogeneous cube: colour·(1 − exp(−τ·L)), L the length of the ray in the cube, to half a sample."""
    tau, voxels = 1.5 / scale, 41
    step = 1.0 / (voxels - 1)
    transfer = TransferFunction([(0, 0.8, 0.4, 1.0, tau)])
    box = Volume(np.full((voxels,) * 3, 7, np.uint8), (step,) * 3, (-0.5,) * 3, transfer=transfer, shade=False)
    box = replace(box, transform=np.diag([scale, scale, scale, 1.0]))
    rig = Rig(position=(0.0, 0.0, 4.0 * scale), views=3, baseline=1.2 * scale)
    loop = vtk_loop(box, rig)
    for view, offset in enumerate(rig.camera_offsets):
        length = math.hypot(4.0 * scale, offset) / 4.0  # the ray through the target leaves by the front and the back
        through = np.exp(-tau * length)
        expected = 255 * np.array([0.8, 0.4, 1.0]) * (1 - through)
        tolerance = 255 * through * tau * scale * step * 0.75 + 1
        found = loop.picture(view)[SIZE[1] // 2, SIZE[0] // 2]
        assert np.abs(found - expected).max() < tolerance
    loop.release()


@pytest.mark.parametrize("index", [(3, 7, 10), (12, 4, 2)])  # i, j, k
def test_vtk_shows_a_bright_voxel_where_the_formula_says(index):
    values = np.zeros((13, 12, 16), np.uint8)
    i, j, k = index
    values[k, j, i] = 255
    transfer = TransferFunction([(0, 1, 1, 1, 0), (255, 1, 1, 1, 60)])
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    marked = Volume(values, (0.1, 0.12, 0.08), (0.5, -0.7, -0.5), turned, transfer, shade=False)
    marked = replace(marked, transform=np.diag([1.2, 1.2, 1.2, 1.0]))
    rig = Rig(views=3)
    clip = workloads.clip_from_world(rig, (240, 160)) @ marked.world_from_index @ [i, j, k, 1.0]
    loop = vtk_loop(marked, rig, (240, 160))
    for view in range(3):
        rows, columns = np.nonzero(loop.picture(view).max(axis=2) > 60)
        assert len(rows)
        expected = 120 * (1 + clip[view, 0] / clip[view, 3]), 80 * (1 - clip[view, 1] / clip[view, 3])
        np.testing.assert_allclose((columns.mean() + 0.5, rows.mean() + 0.5), expected, atol=1.5)
    loop.release()


def test_vtk_draws_what_the_reference_engine_draws():
    scene = Scene((shells(64),))
    rig = workloads.rig_for(scene, 2, (60, 80))
    stack = render_views(scene, rig, (60, 80), engine="reference").color
    loop = vtk_loop(scene.objects[0], rig, (60, 80))
    for view in range(2):
        assert volume.psnr(loop.picture(view), stack[view, ..., :3]) > 32
    loop.release()


@pytest.mark.parametrize(
    "changes", [{"mode": "mip"}, {"clip_plane": (0.0, 0.0, 1.0, 0.0)}, {"values": np.ones((4, 4, 4), np.float32)}]
)
def test_vtk_peer_refuses_what_it_would_draw_otherwise(changes):
    with pytest.raises(UnsupportedError, match="VTK volume peer"):
        peers_vtk_volume.VTKVolumeLoop(None, Scene((replace(shells(16), **changes),)), Rig(views=1), SIZE, 1)


def test_shells_are_what_the_benchmark_needs():
    (body,) = workloads.shells_scene(32).objects
    assert body.shade and body.mode == "composite" and isinstance(body.material, Material)
    assert body.values.shape == (32,) * 3 and body.values.dtype == np.uint8
