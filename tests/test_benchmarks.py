"""The benchmark measures what it says: the clock, the bars, and peers that draw the right picture."""

from __future__ import annotations

import importlib.util
import itertools
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autostereo.cli.benchmarks import harness, jobs, mesh, peers_moderngl, peers_numpy, peers_vtk, report, workloads
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.display.rig import Rig
from autostereo.engines.engine import Camera, Draw, Target, get_engine
from autostereo.engines.options import Options
from autostereo.errors import DependencyError, InputError
from autostereo.scene.appearance import Material
from autostereo.scene.mesh import Mesh
from autostereo.scene.scene import Scene
from autostereo.scene.shapes import displaced_sphere, icosphere

SIZE = (120, 80)


# --- the clock -------------------------------------------------------------------------------------------------------


@pytest.fixture
def clock(monkeypatch):
    """A clock that only moves when a contender works."""
    state = SimpleNamespace(now=0.0, log=[])
    monkeypatch.setattr(harness, "time", SimpleNamespace(perf_counter=lambda: state.now))

    def contender(name, seconds, tail=0.0, entering=0.0):
        durations = itertools.cycle(seconds)

        def spend(amount):
            state.now += amount

        def frame():
            state.log.append(name)
            spend(next(durations))

        return harness.Contender(
            name,
            frame,
            finish=lambda: spend(tail),
            enter=lambda: spend(entering),
            release=lambda: state.log.append(f"release {name}"),
        )

    return SimpleNamespace(state=state, contender=contender)


def test_turns_alternate_and_entering_is_not_timed(clock):
    contenders = [clock.contender("a", [2.0], entering=7.0), clock.contender("b", [8.0], entering=9.0)]
    times = harness.measure(contenders, repeats=3)
    assert "".join(clock.state.log[:10]) == "abab" + "ab" + "ba" + "ab"  # warm-up, calibration, three rounds
    assert clock.state.log[10:] == ["release a", "release b"]
    assert times["a"].seconds == (2.0, 2.0, 2.0)
    assert harness.band(harness.ratio, times["b"], times["a"]) == (4.0, 4.0, 4.0)


def test_short_frames_are_repeated_and_the_tail_is_shared(clock):
    times = harness.measure([clock.contender("a", [0.25], tail=0.25)], repeats=2, minimum=2.0)
    assert times["a"].frames == 4  # calibrated at 0.5 s a frame, tail included
    assert times["a"].seconds == ((4 * 0.25 + 0.25) / 4,) * 2


def test_contenders_are_released_when_one_fails(clock):
    def fail():
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        harness.measure([clock.contender("a", [1.0]), harness.Contender("b", fail)], repeats=1)
    assert clock.state.log == ["a", "release a"]


def test_band_is_of_medians_and_of_rounds():
    slow, fast = harness.Times((6.0, 8.0, 30.0)), harness.Times((2.0, 4.0, 3.0))
    assert harness.band(harness.ratio, slow, fast) == (8.0 / 3.0, 2.0, 10.0)


@given(st.floats(0.1, 1e3), st.floats(0.1, 1e3))
def test_bars(bar, reached):
    assert harness.Bar(bar).met_by(reached) == (reached >= bar)
    assert harness.Bar(bar, at_least=False).met_by(reached) == (reached <= bar)


def test_figures_become_json():
    times = {"a": harness.Times((1.0, 3.0, 2.0), 5)}
    figure = harness.Figure("w", "a / b", 7.0, 6.0, 8.0, bar=harness.Bar(6), times=times).as_dict()
    assert json.loads(json.dumps(figure)) == figure
    assert (figure["bar"], figure["met"]) == ("≥ 6", True)
    assert figure["times"]["a"] == {"median_s": 2.0, "min_s": 1.0, "max_s": 3.0, "rounds": 3, "frames": 5, "scale": 1.0}


# --- scenes and cameras ----------------------------------------------------------------------------------------------


@given(
    st.tuples(*[st.floats(-0.9, 0.9)] * 3), st.integers(1, 9), st.sampled_from([None, 0.75, 2.0]), st.floats(-0.3, 0.3)
)
def test_clip_transforms_are_the_projection_of_design_1(point, views, aspect, offset_y):
    rig = Rig(position=(0.3, 0.2, 3.0), target=(0.1, 0.0, 0.1), views=views, aspect=aspect, offset_y=offset_y)
    width, height = SIZE
    X, Y, d = rig.eye_from_world[:3, :3] @ point + rig.eye_from_world[:3, 3]
    fy = height / 2 / np.tan(np.radians(rig.fov_y) / 2)
    fx = fy * width / height / (aspect or width / height)
    clip = workloads.clip_from_world(rig, SIZE) @ [*point, 1.0]
    x = width / 2 * (1 + clip[:, 0] / clip[:, 3])
    y = height / 2 * (1 - clip[:, 1] / clip[:, 3])
    expected = width / 2 + fx * X / d + fx * rig.camera_offsets * (1 / rig.focal - 1 / d)
    np.testing.assert_allclose(x, expected, atol=1e-9)
    np.testing.assert_allclose(y, height / 2 - fy * (Y - offset_y) / d - fy * offset_y / rig.focal, atol=1e-9)
    np.testing.assert_allclose(clip[:, 3], d)
    assert ((clip[:, 2] > -clip[:, 3]) == (d > rig.near_depth)).all()


@pytest.mark.parametrize("size", [(512, 512), (420, 560), (1024, 512), (7680, 4320)])
def test_scene_fills_the_window_as_stated(size):
    rig = workloads.rig_for(Scene(icosphere(4)), 48, size)
    height = 2 * rig.focal * np.tan(np.radians(rig.fov_y) / 2)
    assert np.pi / (height * height * size[0] / size[1]) == pytest.approx(workloads.FILL, rel=1e-3)
    assert np.ptp(rig.camera_offsets) == pytest.approx(0.3 * rig.focal)


def test_benchmark_sphere_is_the_one_asked_for():
    (sphere,) = workloads.sphere_scene(6, 0.0).objects
    assert len(sphere.faces) == 81_920 and sphere.colors is not None and not sphere.two_sided


# --- peers -----------------------------------------------------------------------------------------------------------


def moderngl_loop(*arguments):
    try:
        return peers_moderngl.ModernGLLoop(peers_moderngl.shared_context(), *arguments)
    except DependencyError as error:
        pytest.skip(str(error))


def vtk_loop(*arguments):
    try:
        return peers_vtk.VTKLoop(peers_vtk.shared_window(), *arguments)
    except DependencyError as error:
        pytest.skip(str(error))


def test_plain_moderngl_has_one_framebuffer_draws_all_faces_and_the_same_picture():
    scene = workloads.sphere_scene(3, 0.0)
    rig = workloads.rig_for(scene, 3, SIZE)
    tuned, plain = (moderngl_loop(scene, rig, SIZE, "sample", plain) for plain in (False, True))
    assert (len(tuned._targets), len(plain._targets)) == (2, 1)
    for view in range(3):
        assert (tuned.picture(view) == plain.picture(view)).all()
    tuned.release()
    plain.release()
    # turned inside out, a ball without culling shows its near half, whose normals point away from light and viewer
    (ball,) = scene.objects
    turned = Scene(Mesh(ball.vertices, ball.faces[:, ::-1], material=Material(ambient=0.2, two_sided=False)))
    brightest = {}
    for plain in (False, True):
        loop = moderngl_loop(turned, rig, SIZE, "sample", plain)
        brightest[plain] = loop.picture(1).max()
        loop.release()
    assert brightest == {False: 255, True: 51}


@pytest.mark.parametrize("make", [moderngl_loop, vtk_loop], ids=["moderngl", "vtk"])
def test_peer_puts_a_dot_where_the_formula_says(make):
    dot = icosphere(2, 0.05)
    positions = np.array([[0.4, 0.3, 0.6], [-0.5, -0.2, -0.8]])  # in front of and behind the focal plane
    for center, color in zip(positions, np.eye(3), strict=False):
        mesh_ = Mesh(dot.vertices + center, dot.faces, colors=np.broadcast_to(color, dot.vertices.shape))
        rig = Rig(views=5)
        loop = make(Scene(mesh_), rig, (240, 160), "sample" if make is moderngl_loop else "tuned")
        clip = workloads.clip_from_world(rig, (240, 160)) @ [*center, 1.0]
        for view in range(5):
            lit = loop.picture(view).max(axis=2) > 0
            rows, columns = np.nonzero(lit)
            expected = 120 * (1 + clip[view, 0] / clip[view, 3]), 80 * (1 - clip[view, 1] / clip[view, 3])
            found = columns.mean() + 0.5, rows.mean() + 0.5
            np.testing.assert_allclose(found, expected, atol=0.5)
            np.testing.assert_array_equal(loop.picture(view)[lit].any(axis=0), color > 0)
        loop.release()


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize(
    ("lighting", "variant"), [("sample", "tuned"), ("sample", "plain"), ("vertex", "prelit")]
)
def test_peers_draw_the_same_picture(lighting, variant, two_sided):
    ball = displaced_sphere(4)
    scene = Scene(Mesh(ball.vertices, ball.faces, colors=ball.colors, material=Material(two_sided=two_sided)))
    rig = workloads.rig_for(scene, 3, SIZE)
    first, second = moderngl_loop(scene, rig, SIZE, lighting), vtk_loop(scene, rig, SIZE, variant)
    for view in range(3):
        ours, other = first.picture(view).astype(int), second.picture(view).astype(int)
        assert (ours.max(axis=2) > 0).mean() > 0.5
        assert (np.abs(ours - other).max(axis=2) > 2).mean() < 1e-3
    first.release()
    second.release()


@pytest.mark.parametrize("lighting", mesh.LIGHTINGS)
def test_moderngl_draws_what_the_reference_engine_draws(lighting):
    scene = workloads.sphere_scene(3, specular=0.3)
    rig = workloads.rig_for(scene, 3, SIZE)
    focal_length = SIZE[1] / 2 / np.tan(np.radians(rig.fov_y) / 2)
    camera = Camera(rig.eye_from_world, focal_length, focal_length, *SIZE, rig.focal, rig.near_depth)
    offsets = rig.camera_offsets
    target = Target(np.zeros((3, SIZE[1], SIZE[0], 4), np.uint8))
    engine = get_engine("reference")
    draw = Draw(camera, offsets, (offsets[0], offsets[-1]), options=Options(lighting=lighting))
    engine.draw(engine.prepare(scene), draw, target)
    loop = moderngl_loop(scene, rig, SIZE, lighting)
    for view in range(3):
        difference = np.abs(loop.picture(view).astype(int) - target.color[view, ..., :3]).max(axis=2)
        assert (difference > 2).mean() < 1e-3  # silhouettes
    loop.release()


def test_moderngl_lights_back_sides_with_the_opposite_normal():
    square = np.array([[-3.0, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]])
    faces = np.array([[0, 2, 1], [0, 3, 2]])  # seen from behind
    scene = Scene(Mesh(square, faces, normals=np.tile((0.0, 0.0, -1.0), (4, 1))))
    for lighting in mesh.LIGHTINGS:
        loop = moderngl_loop(scene, Rig(views=1), SIZE, lighting)
        assert (loop.picture(0) == 255).all()
        loop.release()


def test_moderngl_highlight_follows_blinn_for_the_views_own_eye():
    square = np.array([[-3.0, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]])
    material = Material(ambient=0.1, diffuse=0.0, specular=0.9, shininess=40.0)
    scene = Scene(Mesh(square, [[0, 1, 2], [0, 2, 3]], normals=np.tile((0.0, 0.0, 1.0), (4, 1)), material=material))
    rig = Rig(views=3, baseline=2.0)
    width, height = SIZE
    loop = moderngl_loop(scene, rig, SIZE, "sample")
    half = rig.focal * np.tan(np.radians(rig.fov_y) / 2)
    x = (2 * (np.arange(width) + 0.5) / width - 1) * half * width / height
    y = (1 - 2 * (np.arange(height) + 0.5) / height) * half
    for view, offset in enumerate(rig.camera_offsets):
        to_eye = np.stack(np.broadcast_arrays(offset - x[None, :], -y[:, None], rig.focal), axis=-1)
        to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
        h = to_eye + np.array([0.0, 0.0, 1.0])
        expected = 255 * (0.1 + 0.9 * (h[..., 2] / np.linalg.norm(h, axis=-1)) ** 40.0)
        assert np.abs(loop.picture(view)[..., 0] - expected).max() < 1.5
    loop.release()


def test_memory_writer_writes_every_byte():
    frame, end = peers_numpy.memory_writer(1001, 2)
    (parts,) = [cell.cell_contents for cell in frame.__closure__ if isinstance(cell.cell_contents, list)]
    frame()
    end()
    assert np.concatenate(parts).tolist() == [3] * 1001


def test_numpy_weaves_what_the_cpu_engine_weaves():
    weave, quilt, viewmap, size = jobs.weave_job((330, 420), (60, 90))
    index = peers_numpy.weave_index((330, 420), jobs.WEAVE_GRID, viewmap, size)
    np.testing.assert_array_equal(weave(), quilt[index])


# --- jobs and the whole ----------------------------------------------------------------------------------------------


def test_peak_memory_counts_what_is_touched_and_freed():
    before = jobs.reset_peak()
    np.ones(60_000_000, np.uint8)
    assert 50e6 < jobs.peak() - before < 120e6


def test_unknown_work_and_missing_bunny_are_named(tmp_path):
    with pytest.raises(InputError, match="nonsense"):
        mesh.run(BenchOptions(only=("nonsense",)))
    with pytest.raises(InputError, match=r"bun_zipper\.ply"):
        mesh.run(BenchOptions(only=("weave",), data=tmp_path))
    with pytest.raises(InputError, match="repeats"):
        BenchOptions(repeats=0)


def test_weave_work_reports_equal_pictures(tmp_path, capsys):
    lines: list[str] = []
    options = BenchOptions(quick=True, only=("weave",), repeats=1)
    results = report.bench("mesh", options, tmp_path / "b.json", lines.append)
    assert [figure["note"].split()[0] for figure in results] == ["0", "0"]
    assert lines == ["weave a 3360² quilt to 1536×2048"]
    saved = json.loads((tmp_path / "b.json").read_text())
    assert saved["figures"] == results and saved["machine"]["cores"] >= 1
    printed = capsys.readouterr().out
    assert "NumPy indexing" in printed and "0 of 0 bars met" in printed


@pytest.mark.skipif(importlib.util.find_spec("autostereo.render") is None, reason="needs autostereo.render")
def test_our_pictures_are_the_peers_pictures():
    results = mesh.run(BenchOptions(quick=True, only=("agreement",), repeats=1), lambda line: None)
    if not results:
        pytest.skip("no peer")
    for figure in results:
        assert figure["value"] < 1.0, figure["measure"]  # per cent, silhouettes only


@pytest.mark.parametrize("name", ["mesh", "volume", "points", "papers"])
def test_scripts_take_works_as_the_command_does(monkeypatch, name):
    """benchmarks/switches.py: names after the script, and no other way."""
    path = Path(__file__).parents[1] / "benchmarks" / "switches.py"
    spec = importlib.util.spec_from_file_location("switches", path)
    switches = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(switches)
    asked = []
    monkeypatch.setattr(report, "bench", lambda name, options, path: asked.append((name, options.only)))
    works = list(report.SUITES[name].WORKS)[:2]
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *works, "--quick"])
    switches.main(name, "")
    assert asked == [(name, tuple(works))]
    monkeypatch.setattr(sys, "argv", [f"{name}.py", "--only", works[0]])
    with pytest.raises(SystemExit):
        switches.main(name, "")
