"""What orders, approximation and accumulation are there for, and the errata of the paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.simulator import Draw, Machine, Workload, in_parallel, simulate, simulate_accumulation
from autostereo.simulator.scenes import SCENES
from sim_scenes import MULTI, RIG, SIZE, layers, wall

BIG = (160, 120)
MACHINES = {name: Machine.load(name) for name in Machine.names()}


def texture_bytes(machine: Machine, workload: Workload, views: int = 8, size: tuple[int, int] = BIG) -> int:
    return simulate(workload, replace(RIG, views=views, baseline=0.1 * (views - 1)), machine, size=size).texture_bytes


@pytest.mark.parametrize("measure", ["axis", "dot"])
@pytest.mark.parametrize("tile", [(8, 8), (1, 1)])
def test_sorted_views_share_what_one_view_reads(measure, tile):
    """A receding wall of one colour of texels: eight views read little more than one, view by view eight times as
    much."""
    machine = MULTI.with_(traversal={"measure": measure, "tile": tile}, depth={"z_max": False})
    by_view = MACHINES["bf-dc"].with_(traversal={"tile": tile}, depth={"z_max": False})
    one, eight = (texture_bytes(machine, wall(0.4), views) for views in (1, 8))
    brute = texture_bytes(by_view, wall(0.4))
    assert eight < 1.7 * one
    assert brute > 5 * one


def turned(workload: Workload) -> Workload:
    """The same triangles, their corners numbered so that both coordinates may fall along a row."""
    draw = workload.draws[0]
    return Workload(
        tuple(
            replace(draw, corners=np.roll(draw.corners, k, axis=1), attributes=np.roll(draw.attributes, k, axis=1))
            for k in range(3)
        )[2:],
        workload.textures,
    )


def test_the_measure_needs_the_sign_of_the_direction():
    """Erratum: section 5's measure is "simply the component of t". Where it falls along the row that is no sorting at
    all."""
    printed = MULTI.with_(traversal={"measure": "axis-unsigned"})
    unsorted = texture_bytes(MACHINES["by-triangle"], wall(0.4))
    walls = wall(0.4), turned(wall(0.4))
    assert max(texture_bytes(MULTI, workload) for workload in walls) < 0.4 * unsorted
    assert max(texture_bytes(printed, workload) for workload in walls) > 0.6 * unsorted


def test_both_measures_sort_alike():
    dot = MULTI.with_(traversal={"measure": "dot"})
    for workload in (wall(0.4), wall(0.4, 4), layers()):
        a, b = (texture_bytes(m, workload) for m in (MULTI, dot))
        assert abs(a - b) <= 0.02 * a


def test_a_row_that_crosses_the_horizon_is_counted_and_drawn_all_the_same():
    """Weakness of section 5: a floor that reaches behind the eye, seen with its horizon tilted."""
    corners = np.array([[(-30, -8, 6.0), (30, 6, 6.0), (0, -1.2, -60.0)]])
    uv = np.array([[(0, 0, 0, 0), (40, 0, 1, 0), (20, 40, 0, 1)]], float)
    workload = Workload((Draw(corners, uv, "level", (0, 1), (1.0,)),), layers().textures)
    found = simulate(workload, RIG, MULTI, size=SIZE)
    assert found.counters["horizon_rows"] > 0
    expected = simulate(workload, RIG, MACHINES["bf-tx"], size=SIZE)
    np.testing.assert_array_equal(found.color, expected.color)


def test_a_triangle_culled_in_some_views():
    """Edge-on to the middle camera: seen from one side by the left views, culled in the others."""
    corners = np.array([[(0.0, -1, 1), (0.0, -1, -4), (0.0, 1.5, -4)]])
    attributes = np.zeros((1, 3, 1))
    workloads = [Workload((Draw(corners, attributes, facing=facing),)) for facing in (1, -1, 0)]
    faces = [simulate(workload, RIG, MULTI, size=SIZE).passed for workload in workloads]
    assert all((one > 0).any() and (one == 0).any() for one in faces[:2])
    np.testing.assert_array_equal(faces[0] + faces[1], faces[2])
    approximate = MULTI.with_(shading={"approximate": True})
    found = simulate(Workload((Draw(corners, attributes, facing=1),)), RIG, approximate, size=SIZE)
    np.testing.assert_array_equal(found.passed, faces[0])


# --- approximate shading (section 4.3) --------------------------------------------------------------------------------
VARIANTS = {
    "one tile": {"tiles": 1},
    "two tiles": {"tiles": 2},
    "four tiles": {},
    "largest": {"exact": "largest"},
    "two sets": {"sets": 2},
    "afresh": {"single_neighbour": "shade"},
    "tent": {"filter": "tent"},
    "colour buffer": {"source": "color-buffer"},
}


@pytest.mark.parametrize("name", VARIANTS)
def test_borders_and_depth_are_always_right(name):
    """And every fragment is either shaded or put together from others."""
    machine = MULTI.with_(shading={"approximate": True, **VARIANTS[name]})
    for workload in (layers(), wall(0.3, 2)):
        exact = simulate(workload, RIG, MULTI, size=SIZE)
        found = simulate(workload, RIG, machine, size=SIZE, maps=True)
        np.testing.assert_array_equal(found.depth, exact.depth)
        np.testing.assert_array_equal(found.color[..., 3], exact.color[..., 3])
        np.testing.assert_array_equal(found.shaded + found.approximated, exact.shaded)
        assert found.approximated.sum() > 0
        assert (found.how == 2).any()
        if name not in ("largest", "two sets"):
            middle = (RIG.views - 1) // 2
            assert found.approximated[middle] == 0
            np.testing.assert_array_equal(found.color[middle], exact.color[middle])


def test_approximation_is_good_and_saves_nearly_all_shading():
    exact = simulate(wall(0.2), RIG, MULTI, size=BIG)
    found = simulate(wall(0.2), RIG, MULTI.with_(shading={"approximate": True}), size=BIG)
    others = np.arange(RIG.views) != (RIG.views - 1) // 2
    assert found.share_approximated[others].min() > 0.85
    assert found.psnr(exact)[others].min() > 38


def test_a_flat_wall_in_the_focal_plane_is_reused_to_the_last_bit():
    """No parallax: taps hit fragments exactly."""
    exact = simulate(wall(), RIG, MULTI, size=BIG)
    found = simulate(wall(), replace(RIG, focal_distance=4.0), MULTI.with_(shading={"approximate": True}), size=BIG)
    assert np.abs(found.color.astype(int) - exact.color).max() <= 1
    assert found.share_approximated[0] > 0.99


def test_the_colour_buffer_as_output_cache_fails_with_blending():
    """The paper's discussion: what lies behind a transparent triangle is taken along."""
    behind = wall().draws[0]
    glass = replace(behind, corners=behind.corners + np.array([0, 0, 1.5]), blend="alpha", uniforms=(0.4,))
    workload = Workload((behind, glass), wall().textures)
    exact = simulate(workload, RIG, MULTI, size=SIZE)
    quality = {}
    for source in ("output-cache", "color-buffer"):
        machine = MULTI.with_(shading={"approximate": True, "source": source})
        quality[source] = simulate(workload, RIG, machine, size=SIZE).psnr(exact)[[0, -1]].min()
    assert quality["output-cache"] > quality["color-buffer"] + 6


def test_a_unified_camera_makes_highlights_the_same_in_all_views():
    mesh = aus.Mesh(
        [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [[0, 1, 2], [0, 2, 3]],
        material=aus.Material(0.1, 0.5, 0.8, 60, two_sided=True),
    )  # fmt: skip
    scene, rig = aus.Scene(mesh, aus.PointLight((0, 0, 3))), replace(RIG, focal_distance=4.0)
    own = simulate(scene, rig, MULTI, size=SIZE).color
    unified = simulate(scene, rig, MULTI.with_(shading={"unified_camera": True}), size=SIZE).color
    assert not np.array_equal(own[0], own[-1])
    assert np.abs(unified[0].astype(int) - unified[-1]).max() <= 1
    centre = aus.render_views(scene, rig, SIZE, engine="reference", options=aus.Options(shading="center"))
    np.testing.assert_array_equal(unified, centre.color)


# --- accumulative colour rendering (section 4.4) ----------------------------------------------------------------------
def lens(rows: int, columns: int, radius: float = 0.15) -> list[aus.Rig]:
    """Rows of cameras over a square lens."""
    return [
        replace(RIG, views=columns, baseline=2 * radius, offset_y=float(y)) for y in np.linspace(-radius, radius, rows)
    ]


@pytest.mark.parametrize("name", ["multi-view", "bf-dc", "bf-tx"])
def test_depth_of_field_is_the_mean_of_its_samples(name):
    rigs = lens(3, 4)
    found = simulate_accumulation(layers(), rigs, MACHINES[name], size=SIZE)
    samples = np.concatenate([simulate(layers(), rig, MULTI, size=SIZE).color for rig in rigs]).astype(float)
    seen = samples[..., 3:] / 255
    mean = np.where(seen > 0, samples[..., :3], np.floor(255 * np.array([0.2, 0.3, 0.4]) + 0.5)).mean(axis=0)
    assert np.abs(found.color[0, ..., :3] - mean).max() <= 1.01  # each sample was rounded before its mean was taken
    assert found.shaded.sum() == int((samples[..., 3] > 0).sum())  # only what is seen is shaded


def test_one_colour_buffer_for_all_views_costs_less():
    rigs = lens(2, 8)
    multi, brute = (simulate_accumulation(wall(0.4), rigs, MACHINES[k], size=BIG) for k in ("multi-view", "bf-dc"))
    assert multi.color_bytes < 0.3 * brute.color_bytes
    assert multi.texture_bytes < 0.3 * brute.texture_bytes


# --- scenes and frames ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", SCENES)
def test_scenes_fill_their_pictures_and_move(name):
    pictures = []
    for number in (0, 100):
        workload, rig = SCENES[name].at(number, 2)
        report = simulate(workload, rig, MULTI, size=(64, 48))
        assert (report.color[..., 3] > 0).mean() > (0.5 if name in ("atrium", "relief") else 0.6)
        assert report.color[..., :3].std() > 15
        pictures.append(report.color)
    assert not np.array_equal(*pictures)


def test_counters_do_not_depend_on_threads():
    frames = [SCENES["level"].at(number, 2) for number in (0, 50, 100)]
    together = in_parallel(frames, lambda frame: simulate(*frame, MULTI, size=(64, 48)))
    alone = [simulate(*frame, MULTI, size=(64, 48)) for frame in frames]
    assert [r.as_dict() for r in together] == [r.as_dict() for r in alone]


# --- what the method rests on, with plain NumPy -----------------------------------------------------------------------
def barycentric(corners: np.ndarray, x: np.ndarray, y: float, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Perspective-correct weights (n, 3) and depths (n,) of a row's samples, by solving for them; f = 100, focal 4."""
    rays = np.stack([x / 100 - v / 4, np.full_like(x, y / 100), np.ones_like(x)])
    weights = np.linalg.solve((corners - (v, 0, 0)).T, rays).T
    return weights / weights.sum(axis=1, keepdims=True), 1 / weights.sum(axis=1)


@pytest.mark.parametrize("seed", range(5))
def test_traversal_directions_are_the_same_in_all_views(seed):
    """Section 4.1: the samples of a row lie on one line of barycentric space, in every view."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform((-2, -2, 2), (2, 2, 9), (3, 3))
    pbs = [barycentric(corners, np.arange(-30.0, 30), 7.0, v)[0][:, 1:] for v in (-1.0, 0.0, 0.7)]
    points = np.concatenate(pbs)
    near = points[np.abs(points).max(axis=1) < 100]
    spread = np.linalg.svd(near - near.mean(axis=0), compute_uv=False)
    assert spread[1] < 1e-9 * spread[0]


@pytest.mark.parametrize("seed", range(5))
def test_equation_5_is_a_shift_by_parallax(seed):
    """Interpolating the exact view's homogeneous corners by the approximated view's weights: x slides, y stays."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform((-2, -2, 2), (2, 2, 9), (3, 3))
    x, a, e = np.arange(-30.0, 30), -0.4, 0.9
    weights, depth = barycentric(corners, x, 7.0, a)
    d = corners[:, 2]
    homogeneous = np.stack([100 * (corners[:, 0] + e * (d / 4 - 1)), 100 * corners[:, 1], d], axis=1)
    c = weights @ homogeneous
    np.testing.assert_allclose(c[:, 0] / c[:, 2], x + 100 * (e - a) * (1 / 4 - 1 / depth), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(c[:, 1] / c[:, 2], 7.0, rtol=1e-9)
