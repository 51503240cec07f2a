"""Shaders that give depths: late depth tests, and approximated depths as the interpolation of cached ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.errors import UnsupportedError
from autostereo.simulator import Draw, Machine, Texture, Workload, simulate, simulate_accumulation
from autostereo.simulator.scenes import SCENES
from sim_scenes import MULTI, RIG, SIZE, layers

APPROXIMATE = MULTI.with_(shading={"approximate": True})
BIG = (160, 120)
NEAR = 0.2


def late(workload: Workload) -> Workload:
    """The same, its depths left alone by shaders that could change them."""
    return replace(workload, draws=tuple(replace(draw, depth_output=True) for draw in workload.draws))


def slab(heights: np.ndarray, scale: float = 1.0) -> Workload:
    """One triangle in the plane z = 0.3·x, with these heights (h, w), that covers the middle of every view."""
    points = np.array([(-9.0, -4.0), (9.0, -4.0), (0.0, 9.0)])
    corners = np.concatenate([points, 0.3 * points[:, :1]], axis=1)[None]
    normal = np.broadcast_to(np.array([-0.3, 0, 1]) / np.hypot(1, 0.3), (1, 3, 3))
    uv = points[None] / 4
    attributes = np.concatenate([uv, 0 * uv, normal, corners], axis=2)
    gray = np.broadcast_to(np.uint8(128), (*heights.shape, 3))
    textures = Texture(np.concatenate([gray, heights[..., None]], axis=2)), Texture(np.full((1, 1, 3), 128, np.uint8))
    return Workload((Draw(corners, attributes, "relief", (0, 1), (1.0, scale), depth_output=True),), textures)


def waves() -> np.ndarray:
    y, x = np.mgrid[:128, :128] * 2 * np.pi / 128
    return np.floor(255 * (0.5 + 0.25 * np.sin(2 * x) + 0.2 * np.cos(3 * y + x))).astype(np.uint8)


@pytest.mark.parametrize("blend", ["replace", "alpha"])
@pytest.mark.parametrize("change", [
    {}, {"traversal": {"order": "by-view"}}, {"traversal": {"tile": (1, 1)}}, {"depth": {"z_min": True}},
    {"depth": {"z_max": False, "compression": False}},
])  # fmt: skip
def test_a_depth_that_is_left_alone_is_the_triangles_own(change, blend):
    """To the last bit; but all that is covered has been shaded."""
    machine = MULTI.with_(**change)
    early, found = (simulate(work(layers(blend=blend)), RIG, machine, size=SIZE) for work in (lambda w: w, late))
    np.testing.assert_array_equal(found.color, early.color)
    np.testing.assert_array_equal(found.depth, early.depth)
    np.testing.assert_array_equal(found.passed, early.passed)
    np.testing.assert_array_equal(found.shaded, found.covered)
    assert found.shaded.sum() > early.shaded.sum()
    assert found.counters["tiles_culled"] == 0


@pytest.mark.parametrize("height", [0, 51, 255])
def test_an_even_height_is_the_plane_that_lies_so_much_higher(height):
    """Against the geometry of the raised plane, in every view."""
    found = simulate(slab(np.full((4, 4), height, np.uint8), 0.8), RIG, MULTI, size=SIZE)
    shift = (height / 255 - 0.5) * 0.8 * np.array([-0.3, 0, 1]) / np.hypot(1, 0.3)
    flat = slab(np.zeros((4, 4), np.uint8)).draws[0]
    raised = Workload((Draw(flat.corners + shift, flat.attributes[..., :1]),))
    expected = simulate(raised, RIG, MULTI, size=SIZE)
    both = np.isfinite(found.depth) & np.isfinite(expected.depth)
    assert both.mean() > 0.5
    np.testing.assert_allclose(found.depth[both], expected.depth[both], rtol=1e-6)


def test_heights_decide_where_surfaces_meet():
    """Relief through a plane: visible is what is nearer at the pixel, by depths worked out with NumPy."""
    workload = slab(np.kron(np.array([[0, 255], [255, 0]], np.uint8), np.ones((64, 64), np.uint8)), 0.8)
    draw = workload.draws[0]
    plane = replace(draw, shader="plain", uniforms=(0.0, 0.0, 1.0, 1.0), depth_output=False)
    relief, level = (simulate(Workload((one,), workload.textures), RIG, MULTI, size=BIG) for one in (draw, plane))
    for draws in ((draw, plane), (plane, draw)):
        both = simulate(Workload(draws, workload.textures), RIG, MULTI, size=BIG)
        np.testing.assert_array_equal(both.depth, np.minimum(relief.depth, level.depth))
        blue = (both.color[..., :3] == (0, 0, 255)).all(axis=-1)
        different = relief.depth != level.depth
        np.testing.assert_array_equal(blue[different], (level.depth < relief.depth)[different])
        assert 0.2 < blue.mean() < 0.8


def parallax(report: aus.simulator.Report, v: int, e: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns in view e (H, W) of what the plane z = 0.3·x shows in view v, with plain NumPy; near/depth there."""
    width, height = report.size
    f = height / 2 / np.tan(np.deg2rad(RIG.fov_y) / 2)
    offsets, focal = RIG.camera_offsets, RIG.focal
    slope = (np.arange(width) + 0.5 - width / 2) / f - offsets[v] / focal
    # eye (o, 0, 4): z = 4 − d = 0.3·(o + slope·d)
    depth = np.broadcast_to((4 - 0.3 * offsets[v]) / (1 + 0.3 * slope), (height, width))
    return np.arange(width) + f * (offsets[e] - offsets[v]) * (1 / focal - 1 / depth), NEAR / depth


def test_approximated_depths_are_interpolated_between_those_of_the_exact_view():
    """Section 4.3's first footnote: x by equation (5), weights by how far the two neighbours are."""
    machine = APPROXIMATE.with_(shading={"tiles": 64})
    found = simulate(slab(waves(), 0.6), RIG, machine, size=BIG, maps=True)
    exact = simulate(slab(waves(), 0.6), RIG, MULTI, size=BIG)
    middle = (RIG.views - 1) // 2
    np.testing.assert_array_equal(found.depth[middle], exact.depth[middle])
    np.testing.assert_array_equal(np.isfinite(found.depth), np.isfinite(exact.depth))
    stored = NEAR / found.depth[middle].astype(np.float64)  # 0 where nothing is
    rows = np.arange(BIG[1])[:, None]
    for v in set(range(RIG.views)) - {middle}:
        x, own = parallax(found, v, middle)
        left = np.floor(x).astype(int)
        inside = (left >= 0) & (left < BIG[0] - 1)
        left = np.clip(left, 0, BIG[0] - 2)
        a, b = stored[rows, left], stored[rows, left + 1]
        mixed = (found.how[v] == 2) & inside & (a > 0) & (b > 0)
        assert mixed.mean() > 0.5
        expected = a + (x - left) * (b - a)
        np.testing.assert_allclose(NEAR / found.depth[v][mixed], expected[mixed], rtol=1e-6)
        assert (np.abs(expected / own - 1) > 0.02)[mixed].any()  # not the triangle's own
        error = np.abs(found.depth[v] / exact.depth[v] - 1)[mixed]
        assert 0 < error.max() < 0.03


def test_approximated_depths_of_a_plane_are_right():
    """1/depth is affine along a row, so that two neighbours give it exactly; every border stays where it is."""
    exact = simulate(late(layers(count=1, seed=5)), RIG, MULTI, size=SIZE)
    found = simulate(late(layers(count=1, seed=5)), RIG, APPROXIMATE, size=SIZE)
    assert found.approximated.sum() > 0.5 * found.shaded.sum()
    np.testing.assert_array_equal(found.color[..., 3], exact.color[..., 3])
    single = np.isfinite(exact.depth) & (np.abs(found.depth / np.where(np.isfinite(exact.depth), exact.depth, 1) - 1)
                                         > 1e-5)  # fmt: skip
    assert single.mean() < 0.03  # at borders, where one neighbour is used as it is


def test_the_colour_buffer_has_no_depths_to_give():
    """Draws that give depths are shaded in full there; others before and after them are approximated as ever."""
    machine = APPROXIMATE.with_(shading={"source": "color-buffer"})
    relief = slab(waves(), 0.6)
    alone = simulate(relief, RIG, machine, size=SIZE)
    assert alone.approximated.sum() == 0
    np.testing.assert_array_equal(alone.depth, simulate(relief, RIG, MULTI, size=SIZE).depth)
    plane = replace(relief.draws[0], shader="level", uniforms=(1.0,), depth_output=False)
    behind = replace(plane, corners=plane.corners - (0, 0, 0.3))
    mixed = Workload((behind, relief.draws[0], plane), relief.textures)
    found, exact = (simulate(mixed, RIG, one, size=SIZE) for one in (machine, MULTI))
    assert found.approximated.sum() > 0
    np.testing.assert_array_equal(found.depth, exact.depth)
    with pytest.raises(UnsupportedError, match="accumulates"):
        simulate_accumulation(relief, [RIG], machine, size=SIZE)


@pytest.mark.parametrize("machine", [MULTI, Machine.load("bf-dc"), APPROXIMATE])
def test_a_depth_pass_and_a_colour_pass_agree_on_depths(machine):
    """Accumulation tests for equal depths: everything seen is found again, approximated or not."""
    rig = replace(RIG, focal_distance=4.0, offset_y=0.1)
    workload = slab(waves(), 0.6)
    found = simulate_accumulation(workload, [rig], machine, size=SIZE)
    samples = simulate(workload, rig, machine, size=SIZE)
    np.testing.assert_array_equal(found.depth, samples.depth)
    share = (samples.color[..., 3] > 0).mean(axis=0)
    assert np.abs(found.color[0, ..., 3] - np.floor(255 * share + 0.5)).max() <= 1
    assert np.abs(found.color[0, ..., :3] - samples.color[..., :3].mean(axis=0)).max() <= 1.01


def test_own_shaders_give_depths():
    def nearer(at, dx, dy, eye, uniforms, memory, units, out):
        out[0] = out[1] = out[2] = out[3] = 1.0
        out[4] = eye[4] / (eye[4] / out[4] + uniforms[0])  # near/depth to depth and back

    flat = slab(waves()).draws[0]
    draw = Draw(flat.corners, flat.attributes, nearer, uniforms=(0.25,), depth_output=True)
    own = Draw(flat.corners, flat.attributes, nearer, uniforms=(0.25,))
    found, kept = (simulate(Workload((one,)), RIG, MULTI, size=SIZE) for one in (draw, own))
    np.testing.assert_allclose(found.depth, kept.depth + 0.25, rtol=1e-6)


def test_depths_out_of_range_are_clamped():
    """Nearer than the near plane is at it; beyond everything is not seen."""
    def odd(at, dx, dy, eye, uniforms, memory, units, out):
        out[0] = out[1] = out[2] = out[3] = 1.0
        out[4] = uniforms[0]

    flat = slab(waves()).draws[0]
    made = Draw(flat.corners, flat.attributes, odd, uniforms=(7.0,), depth_output=True)
    near, far = (
        simulate(Workload((replace(made, uniforms=(value,)),)), RIG, MULTI, size=SIZE) for value in (7.0, -3.0)
    )
    seen = np.isfinite(near.depth)
    np.testing.assert_allclose(near.depth[seen], NEAR, rtol=1e-6)
    assert seen.any() and far.passed.sum() == 0 and not np.isfinite(far.depth).any()


def test_single_draws_can_be_kept_from_approximation():
    """Section 4.3: "the application programmer should have fine-grained control over this feature"."""
    workload = layers()
    kept = replace(workload, draws=tuple(replace(draw, approximate=False) for draw in workload.draws))
    found, exact = (simulate(kept, RIG, machine, size=SIZE) for machine in (APPROXIMATE, MULTI))
    assert found.approximated.sum() == 0
    np.testing.assert_array_equal(found.color, exact.color)
    assert simulate(workload, RIG, APPROXIMATE, size=SIZE).approximated.sum() > 0


def test_stones_stand_out_of_the_water():
    """The scene: in every view some of the floor is dry, some is under water, and both change with the heights."""
    workload, rig = SCENES["relief"].at(0, 2)
    found = simulate(workload, rig, MULTI, size=BIG)
    flat = replace(workload, draws=tuple(replace(draw, depth_output=False) for draw in workload.draws))
    level = simulate(flat, rig, MULTI, size=BIG)
    changed = (found.color != level.color).any(axis=-1).mean(axis=(1, 2))
    assert (changed > 0.02).all()
    close = simulate(workload, rig, APPROXIMATE, size=BIG)
    assert close.psnr(found).min() > 30
    assert close.share_approximated[1] > 0.5
