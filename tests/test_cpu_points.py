"""The cpu engine's surfels: against the reference, closed forms, and themselves drawn view by view."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo import DirectionalLight, Display, Material, Options, PointLight, Points, Scene
from autostereo.engines.cpu import gather
from autostereo.engines.cpu import points as cpu
from autostereo.engines.cpu.memory import Memory
from autostereo.engines.engine import Draw
from autostereo.engines.reference.points import is_thin
from autostereo.scene.samples import surfel_cloud
from autostereo.transforms import rotation, scaling, translation
from eye_scenes import CAMERA, FLAT, quad
from eye_scenes import draw_panel as reference_panel
from eye_scenes import draw_views as reference_views

BACKGROUND = (0.25, 0.5, 0.75)
OFFSETS = (np.arange(6) - 2.5) / 4
LIGHTS = (PointLight((1, 1, 1), (0.5, 0.4, 0.3)), DirectionalLight((0.3, -0.2, -1), (0.5, 0.5, 0.6)))
W, H = CAMERA.width, CAMERA.height
LENSES = {"lens_pitch": 5.7, "subpixel_pitch": 1.0, "slant_deg": 9.46, "phase": 0.3}
SLANTED = Display.slanted(W, H, 6, **LENSES)
DISPLAYS = {
    "slanted": SLANTED,
    "mirrored": replace(SLANTED, flip_x=True, flip_y=True),
    "reversed": Display.slanted(W, H, 6, **LENSES | {"slant_deg": -20.0}, reverse=True),
    "coarse lenses": Display.slanted(W, H, 6, **LENSES | {"lens_pitch": 47.0}),
    "phases at wraps": Display.slanted(W, H, 6, lens_pitch=6.0, subpixel_pitch=1.0, slant_deg=0.0),
    "lenticular": Display.lenticular(W, H, 6),
    "per sub-pixel": replace(Display.lenticular(W, H, 6, per="subpixel"), flip_x=True),
    "wavelength-selective": Display.wavelength_selective(W, H),
    "cells": Display.preset("looking-glass-16-landscape").resized(W, H).with_views(6),
    "one view": Display.lenticular(W, H, 1),
}


def surfels(positions, normals=None, radii=1.0, **fields):
    return Points(np.atleast_2d(positions), None if normals is None else np.atleast_2d(normals), radii,
                  **({"material": FLAT} | fields))  # fmt: skip


def cloud(seed, count=60, near=False, **fields):
    """Surfels of all sizes, some edge-on, some behind the cameras; near: also around them, and huge."""
    rng = np.random.default_rng(seed)
    positions = rng.normal((0, 0, -1.5 if near else -4), (0.9, 0.6, 1.5), (count, 3))
    normals = rng.normal(size=(count, 3)) * (1, 1, rng.choice([0.1, 1.0]))
    radii = np.exp(rng.uniform(-7, 5 if near else 0, count))
    fields = {"colors": rng.random((count, 3)), "material": Material(0.1, 0.7, 0.5, 12.0)} | fields
    return Points(positions, normals, radii, **fields)


def draw_of(camera=CAMERA, offsets=OFFSETS, display=None, **options):
    draw = Draw(camera, np.array(offsets, float), (min(offsets) - 0.2, max(offsets) + 0.2), options=Options(**options))
    if display is not None:
        draw = replace(draw, viewmap=display.viewmap, flip_x=display.flip_x, flip_y=display.flip_y)
    return draw


def splat(scene, draw, held=np.inf, memory=None):
    """Colours and depths of views, or of a panel, over a background at depth `held`."""
    scene = Scene.of(scene)
    shape = (draw.camera.height, draw.camera.width)
    shape = (*shape, 3) if draw.viewmap is not None else (len(draw.offsets), *shape)
    color = np.zeros(shape if draw.viewmap is not None else (*shape, 4), np.uint8)
    color[..., :3] = np.floor(255 * np.array(scene.background) + 0.5)
    depth = np.full(shape, held, np.float32)
    one = cpu.draw_points_views if draw.viewmap is None else cpu.draw_points_panel
    one(cpu.prepare_points(scene.objects), scene, draw, color, depth, memory or Memory())
    return color, depth


def assert_alike(found, expected, levels=1, outside=1e-3):
    """Colours within so many levels, but for a small share of samples: those on outlines."""
    wrong = (np.abs(found.astype(int) - expected) > levels).any(axis=-1)
    assert wrong.mean() <= outside


# --- against the reference -----------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans(), st.booleans(), st.sampled_from(["exact", "center", "reuse"]))
def test_views_are_those_of_the_reference(seed, near, bare, shading):
    camera = replace(CAMERA, fy=50.0, offset_y=0.3)
    content = cloud(seed, near=near)
    scene = Scene(replace(content, normals=None) if bare else content, LIGHTS, BACKGROUND)
    color, depth = splat(scene, draw_of(camera, shading=shading))
    expected, expected_depth = reference_views(scene, camera, OFFSETS, shading=shading)
    assert_alike(color, expected)
    same = np.isfinite(depth) == np.isfinite(expected_depth)
    assert same.mean() > 0.999
    close = np.isclose(depth, expected_depth, rtol=1e-4)
    assert (close | ~same).mean() > 0.999


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["pixel", "subpixel"]), st.booleans(), st.booleans())
def test_panels_are_those_of_the_reference(seed, sampling, continuous, flip):
    display = Display.slanted(W, H, 6, **LENSES, continuous=continuous)
    draw = draw_of(display=replace(display, flip_x=flip, flip_y=flip), sampling=sampling)
    scene = Scene(cloud(seed), LIGHTS, BACKGROUND)
    color, depth = splat(scene, draw)
    assert_alike(color[..., None], reference_panel(scene, draw)[..., None], outside=2e-3)
    background = np.floor(255 * np.array(BACKGROUND) + 0.5)
    assert (color[np.isinf(depth)] == np.broadcast_to(background, color.shape)[np.isinf(depth)]).all()


def test_a_scanned_surface_is_that_of_the_reference():
    """Where discs are less than a pixel wide in some views, seen from the front in some, from behind in others."""
    scan = surfel_cloud(3000)
    scan = replace(scan, transform=translation(0, 0, -4) @ rotation((1, 2, 0), 50), radii=scan.radii * 0.5)
    offsets = np.linspace(-1.5, 1.5, 5)
    scene = Scene(scan, LIGHTS)
    color, depth = splat(scene, draw_of(offsets=offsets))
    expected, expected_depth = reference_views(scene, offsets=offsets)
    assert 0.2 < np.isfinite(depth).mean() < 0.9
    assert_alike(color, expected)
    assert np.isclose(depth, expected_depth, rtol=1e-4).mean() > 0.999


def test_a_disc_turns_from_its_front_over_its_edge_to_its_back():
    scene = Scene(surfels((0.0, 0.0, -4.0), (1, 0.05, 0.01), 0.5, material=Material(specular=0.4)), LIGHTS)
    offsets = np.linspace(-1, 1, 21)
    color, depth = splat(scene, draw_of(offsets=offsets))
    expected, expected_depth = reference_views(scene, offsets=offsets)
    counts = (color[..., 3] > 0).sum(axis=(1, 2))
    middle = np.unique(expected_depth[10])  # it lies in the plane of constant depth there, in few views
    np.testing.assert_array_equal(middle, np.float32([4.0, np.inf]))
    assert counts[10] > 2 * counts[7] > 0
    assert_alike(color, expected)
    np.testing.assert_allclose(depth, expected_depth, rtol=1e-5)


# --- closed forms --------------------------------------------------------------------------------------------------


def hits(position, normal, radius, offset, camera=CAMERA):
    """Weight (≤ 0 outside) and depth where the rays of all pixels meet a disc, by the definition, (H, W)."""
    X, Y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    ray = np.stack([(X - camera.width / 2) / camera.fx - offset / camera.focal,
                    -(Y - camera.height / 2) / camera.fy, -np.ones_like(X)], axis=-1)  # fmt: skip
    eye = np.array([offset, 0.0, 0.0])
    along = ray @ normal
    depth = (np.asarray(position) - eye) @ normal / np.where(along == 0, 1e-30, along)
    away = eye + depth[..., None] * ray - position
    return np.where(depth >= camera.near, 1 - (away**2).sum(axis=-1) / radius**2, -1.0), depth


@settings(max_examples=40, deadline=None)
@given(st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.3, 1)), st.floats(0.3, 1.2), st.booleans())
def test_a_disc_is_its_projection(normal, radius, behind):
    normal = np.array(normal) * (-1 if behind else 1)
    position, color = np.array((0.2, -0.1, -4.0)), (0.25, 0.45, 0.75)
    found, depth = splat(surfels(position, normal, radius, colors=[color]), draw_of())
    for i, offset in enumerate(OFFSETS):
        weight, expected = hits(position, normal, radius, offset)
        centre = (position - (offset, 0, 0)) * (1, 1, -1)  # in eye space, of this eye
        unit = normal * (1, 1, -1) / np.linalg.norm(normal)
        if is_thin(centre[None], unit[None], np.array([radius]), CAMERA)[0]:
            continue  # see test_a_disc_turns_from_its_front_over_its_edge_to_its_back
        sure = np.abs(weight) > 1e-4
        np.testing.assert_array_equal((found[i, ..., 3] == 255)[sure], (weight > 0)[sure])
        inside = sure & (weight > 0)
        np.testing.assert_allclose(depth[i][inside], expected[inside], rtol=1e-5)
        assert (found[i][inside] == (64, 115, 191, 255)).all()
        assert np.isinf(depth[i][sure & (weight < 0)]).all() and not found[i][sure & (weight < 0)].any()


@pytest.mark.parametrize("gap", [0.0, 0.25, -0.25])
def test_two_surfels_are_blended_by_their_weights(gap):
    """Neither is further behind the other than by its own radius."""
    places, normals, radii = [(-0.1, 0, -4), (0.15, 0.1, -4 - gap)], [(0.3, 0, 1), (0, 0.2, 1)], (0.5, 0.6)
    color, depth = splat(surfels(places, normals, radii, colors=[(1.0, 0, 0), (0, 1.0, 0)]), draw_of())
    for i, offset in enumerate(OFFSETS):
        w, d = np.array([hits(p, n, r, offset) for p, n, r in zip(places, normals, radii, strict=True)]).swapaxes(0, 1)
        sure = (np.abs(w) > 1e-4).all(axis=0)
        w = np.maximum(w, 0)
        near = np.where(w > 0, d, np.inf).min(axis=0)
        assert (d - near <= 0.45)[w > 0].all()  # the scene does not test what is hidden
        seen = sure & (w.sum(axis=0) > 0)
        assert ((w > 0).all(axis=0) & seen).sum() > 30
        expected = 255 * w[:, seen] / w[:, seen].sum(axis=0)
        assert np.abs(color[i][seen][:, :2] - expected.T).max() <= 0.51
        np.testing.assert_allclose(depth[i][seen], near[seen], rtol=1e-5)


def test_a_surfel_further_behind_than_its_own_radius_is_hidden():
    places = [(-0.1, 0.0, -4.0), (0.15, 0.1, -4.5)]
    for radii, mixed in (((0.8, 0.4), False), ((0.4, 0.8), True)):
        color, _ = splat(surfels(places, [(0, 0, 1)] * 2, radii, colors=[(1.0, 0, 0), (0, 1.0, 0)]), draw_of())
        for i, offset in enumerate(OFFSETS):
            red, green = (hits(p, (0, 0, 1), r, offset)[0] for p, r in zip(places, radii, strict=True))
            both = (red > 1e-3) & (green > 1e-3)
            assert both.sum() > 50
            assert ((color[i][both][:, 1] > 0) == mixed).all() and (color[i][both][:, 0] > 0).all()
            assert (color[i][(red < -1e-3) & (green > 1e-3)] == (0, 255, 0, 255)).all()


@pytest.mark.parametrize(("depth", "pixels_per_view"), [(8.0, 2), (4.0, 0), (2.0, -4)])
def test_surfels_slide_by_the_disparity(depth, pixels_per_view):
    offsets = (np.arange(5) - 2) / 4
    color, found = splat(surfels((0.01, 0.02, -depth), radii=depth / 64 * 7.3), draw_of(offsets=offsets))
    assert 150 < (color[2, ..., 3] > 0).sum() < 180
    for i in range(5):
        np.testing.assert_array_equal(color[i], np.roll(color[2], (i - 2) * pixels_per_view, axis=1))
        np.testing.assert_allclose(found[i][np.isfinite(found[i])], depth, rtol=1e-6)


def test_a_shifted_camera_shifts_the_picture():
    content = Scene(cloud(4), LIGHTS)
    still, depth = splat(content, draw_of())
    moved, moved_depth = splat(content, draw_of(replace(CAMERA, shift=(3.0, -2.0))))
    assert_alike(moved[:, :-2, 3:], still[:, 2:, :-3])
    assert np.isclose(moved_depth[:, :-2, 3:], depth[:, 2:, :-3], rtol=1e-4).mean() > 0.999


# --- one pass is many, however it is cut up ------------------------------------------------------------------------


def one_by_one(scene, draw, **kwargs):
    stacks = [splat(scene, replace(draw, offsets=draw.offsets[i : i + 1]), **kwargs) for i in range(len(draw.offsets))]
    return [np.concatenate(parts) for parts in zip(*stacks, strict=True)]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from(["exact", "center"]))
def test_single_pass_is_view_by_view_bit_for_bit(seed, near, shading):
    scene, draw = Scene(cloud(seed, near=near), LIGHTS, BACKGROUND), draw_of(shading=shading)
    for a, b in zip(splat(scene, draw), one_by_one(scene, draw), strict=True):
        np.testing.assert_array_equal(a, b)


def gathered(values, display):
    """Gather (H, W, 3) from views (V, H, W, 3)."""
    view = display.view_of_subpixel()
    rows, columns, channels = np.ogrid[:H, :W, :3]
    rows = H - 1 - rows if display.flip_y else rows
    columns = W - 1 - columns if display.flip_x else columns
    return values[view, rows, columns, channels]


@pytest.mark.parametrize("display", DISPLAYS.values(), ids=DISPLAYS)
@pytest.mark.parametrize("near", [False, True])
def test_panels_are_the_gathered_views_bit_for_bit(display, near):
    offsets = (np.arange(display.views) - (display.views - 1) / 2) / 4
    for seed in range(4):
        scene = Scene(cloud(seed, near=near), LIGHTS, BACKGROUND)
        color, depth = splat(scene, draw_of(offsets=offsets))
        found, found_depth = splat(scene, draw_of(offsets=offsets, display=display))
        woven = np.empty((H, W, 3), np.uint8)
        gather.interlace(color, display.viewmap, display.flip_x, display.flip_y, woven)
        np.testing.assert_array_equal(found, woven)
        np.testing.assert_array_equal(found_depth, gathered(np.repeat(depth[..., None], 3, axis=3), display))


def test_pictures_do_not_depend_on_blocks(monkeypatch):
    scene = Scene([cloud(1, 200), surfel_cloud(500)], LIGHTS, BACKGROUND)
    draws = (draw_of(), draw_of(display=SLANTED))
    first = [splat(scene, draw) for draw in draws]
    monkeypatch.setattr(cpu, "SAMPLES", 64)
    monkeypatch.setattr(cpu, "PANEL_SAMPLES", 1)
    monkeypatch.setattr(cpu, "PANEL_COLUMNS", 17)
    for draw, expected in zip(draws, first, strict=True):
        for a, b in zip(splat(scene, draw), expected, strict=True):
            np.testing.assert_array_equal(a, b)


def test_more_views_than_are_drawn_at_once():
    camera = replace(CAMERA, fx=16.0, fy=16.0, width=16, height=12)
    scene, draw = Scene(cloud(2), LIGHTS), draw_of(camera, np.linspace(-0.5, 0.5, cpu.VIEWS_AT_ONCE + 9))
    for a, b in zip(splat(scene, draw), one_by_one(scene, draw), strict=True):
        np.testing.assert_array_equal(a, b)


def test_memory_serves_frames_of_any_size():
    memory = Memory()
    for seed, count, size in ((1, 300, (64, 48)), (2, 20, (30, 70)), (3, 500, (1, 1)), (4, 50, (90, 5))):
        camera = replace(CAMERA, width=size[0], height=size[1])
        display = Display.slanted(*size, 6, **LENSES)
        for draw in (draw_of(camera), draw_of(camera, OFFSETS[:2]), draw_of(camera, display=display)):
            found, fresh = splat(cloud(seed, count), draw, memory=memory), splat(cloud(seed, count), draw)
            np.testing.assert_array_equal(found[0], fresh[0])
            np.testing.assert_array_equal(found[1], fresh[1])


@given(st.integers(1, 2000), st.integers(1, 20000), st.integers(1, 20000))
def test_blocks_fit_their_memory(views, width, height):
    grid = cpu.view_grid(views, width, height)
    assert grid.rows * min(views, cpu.VIEWS_AT_ONCE) * cpu.row_samples(grid.columns) <= cpu.PLANE
    assert 1 <= grid.rows <= height and (grid.blocks - 1) * grid.columns < width <= grid.blocks * grid.columns
    grid = cpu.panel_grid(width, height)
    assert grid.rows * 3 * grid.columns <= cpu.PANEL_PLANE and grid.columns % 32 == 0
    assert 1 <= grid.rows <= height and (grid.blocks - 1) * grid.columns < width <= grid.blocks * grid.columns


# --- over what is drawn already ------------------------------------------------------------------------------------


@pytest.mark.parametrize("wall", [3.0, 4.0, 5.5])
def test_surfels_are_seen_in_front_of_what_is_drawn_already(wall):
    content = cloud(5, 150, material=FLAT)
    back = quad(-40, 40, -40, 40, wall, colors=np.tile(np.float32(BACKGROUND), (4, 1)))
    color, depth = splat(Scene(content, background=BACKGROUND), draw_of(), held=wall)
    expected, expected_depth = reference_views(Scene([back, content]), offsets=OFFSETS)
    seen = depth < wall
    assert 0.02 < seen.mean() < 0.98
    assert_alike(color[..., :3], expected[..., :3])
    np.testing.assert_array_equal(color[..., 3], np.where(seen, 255, 0))
    assert np.isclose(depth, expected_depth, rtol=1e-4).mean() > 0.999
    found, found_depth = splat(Scene(content, background=BACKGROUND), draw_of(display=SLANTED), held=wall)
    np.testing.assert_array_equal(found, gathered(color[..., :3], SLANTED))
    np.testing.assert_array_equal(found_depth, gathered(np.repeat(depth[..., None], 3, axis=3), SLANTED))


def test_nothing_changes_where_nothing_is_seen():
    unseen = surfels((0, 0, 3.0)), surfels((50.0, 0, -4)), surfels((0, 0, -0.2), radii=0.1), cloud(6, near=True)
    for content in unseen:
        for display in (None, SLANTED):
            color, depth = splat(Scene(content, background=BACKGROUND), draw_of(display=display), held=0.01)
            assert (color[..., :3] == (64, 128, 191)).all() and (depth == np.float32(0.01)).all()


# --- odd clouds ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 0, 0), (0, 1, 0), (1, 1, 0), (3, 1, 1)])
@pytest.mark.parametrize("radius", [1e-45, 1e-6, 1e-3])
def test_the_smallest_surfel_is_a_dot_in_every_view(normal, radius):
    position = np.array((0.013, 0.022, -5.0))
    color, depth = splat(surfels(position, normal, radius), draw_of())
    rows, columns = np.mgrid[0.5:H, 0.5:W]
    for i, offset in enumerate(OFFSETS):
        x = 32 + 64 * position[0] / 5 + 64 * offset * (1 / 4 - 1 / 5)
        y = 24 - 64 * position[1] / 5
        dot = (columns - x) ** 2 + (rows - y) ** 2 < 0.71**2
        assert 1 <= dot.sum() <= 4
        np.testing.assert_array_equal(color[i, ..., 3] > 0, dot)
        np.testing.assert_allclose(depth[i][dot], 5.0, rtol=1e-6)


@pytest.mark.parametrize("radius", [50.0, 1e4, 1e15])
def test_a_huge_surfel_fills_the_picture(radius):
    for normal in ((0, 0, 1), (0.3, 0.2, 1)):
        color, depth = splat(surfels((0.1, 0.2, -4), normal, radius, colors=[(1, 0.45, 0)]), draw_of())
        assert (color == (255, 115, 0, 255)).all()
        for i, offset in enumerate(OFFSETS):
            np.testing.assert_allclose(depth[i], hits((0.1, 0.2, -4), normal, radius, offset)[1], rtol=1e-4)
        found, _ = splat(surfels((0.1, 0.2, -4), normal, radius, colors=[(1, 0.45, 0)]), draw_of(display=SLANTED))
        assert (found == (255, 115, 0)).all()


def test_a_floor_under_the_cameras_reaches_from_the_near_plane_to_the_horizon():
    scene = Scene(surfels((0, -1.0, -4), (0, 1, 0), 1e3))
    color, depth = splat(scene, draw_of())
    expected, expected_depth = reference_views(scene, offsets=OFFSETS)
    assert 0.4 < (expected[..., 3] > 0).mean() < 0.6
    assert_alike(color, expected)
    assert np.isclose(depth, expected_depth, rtol=1e-4).mean() > 0.999


def test_identical_points_are_their_mean():
    rng = np.random.default_rng(7)
    colors = rng.random((1000, 3))
    color, depth = splat(surfels(np.tile((0, 0, -4.0), (1000, 1)), np.tile((0, 0.2, 1.0), (1000, 1)), 0.5,
                                 colors=colors), draw_of())  # fmt: skip
    seen = color[..., 3] > 0
    assert seen.sum() > 100 and (np.isfinite(depth) == seen).all()
    assert np.abs(color[seen][:, :3] - 255 * colors.mean(axis=0)).max() < 0.6


def test_far_away_coordinates():
    """Positions in metres of a map, a few million from its origin."""
    content = cloud(8, material=FLAT)
    away = translation(4e6, 5e6, 300.0)
    camera = replace(CAMERA, eye_from_world=CAMERA.eye_from_world @ np.linalg.inv(away))
    here, _ = splat(content, draw_of())
    there, _ = splat(replace(content, transform=away), draw_of(camera))
    assert_alike(there, here)
    outside = surfels([(1e15, 0, -4), (0, -1e15, -1e15), (0, 0, -1e15)], [(0, 0, 1)] * 3, 1.0)
    assert (splat(outside, draw_of())[0][..., 3] > 0).sum() <= 4 * len(OFFSETS)


def test_clouds_are_gathered_in_world_space():
    first = Points([(1, 2, 3), (4, 5, 6)], [(0, 0, 1), (1, 0, 0)], (1, 2), transform=scaling(2.0))
    second = Points([(7, 8, 9)], None, 3.0, [(255, 0, 51)] and np.array([(255, 0, 51)], np.uint8), material=FLAT)
    arrays = cpu.prepare_points([first, second])
    np.testing.assert_array_equal(arrays.positions, [(2, 4, 6), (8, 10, 12), (7, 8, 9)])
    np.testing.assert_allclose(arrays.normals, [(0, 0, 1), (1, 0, 0), (0, 0, 0)])
    np.testing.assert_allclose(arrays.radii, (2, 4, 3))
    np.testing.assert_allclose(arrays.colors, [(0.8, 0.8, 0.8)] * 2 + [(1, 0, 0.2)])
    np.testing.assert_array_equal(arrays.material, (0, 0, 1))
    np.testing.assert_allclose(arrays.materials, [(0.2, 0.8, 0, 32), (1, 0, 0, 32)])
