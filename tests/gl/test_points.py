"""Points on the gl engine, by every method, mask and option: against the reference, and one pass against n passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.engines.gl import points as gl_points
from autostereo.engines.gl import points_splat
from autostereo.engines.gl.points_buffers import FLOATS, space_filling_order
from autostereo.scene.samples import surfel_cloud
from gl_device import need_device

from .point_scenes import BACKGROUND, DISPLAYS, LIGHTS, RIG, SIZE, SLANTED, assert_alike, cloud, levels, scenes

W, H = SIZE
OPTIONS = {
    "plain": {},
    "sub-pixel": {"sampling": "subpixel"},
    "samples": {"samples": 4},
    "centre": {"shading": "center"},
}
FOR_VIEWS = ("single-pass", "n-pass", "instanced")
CASES = [(name, display, "plain") for name in ("mixed", "near") for display in DISPLAYS]
CASES += [("mixed", d, o) for d in ("wavelength-selective", "continuous, mirrored") for o in OPTIONS if o != "plain"]
MANY = ("n-pass", "n-pass-masked", "instanced")


def views(scene, engine="gl", method="single-pass", rig=RIG, **options):
    return aus.render_views(scene, rig, SIZE, method=method, engine=engine, options=aus.Options(**options))


def panel(scene, display, engine="gl", method="single-pass", rig=RIG, **options):
    return aus.render(scene, display, rig, method=method, engine=engine, options=aus.Options(**options)).pixels


# --- like the reference ------------------------------------------------------------------------------


@pytest.mark.parametrize("options", ["plain", "samples", "centre"])
@pytest.mark.parametrize("name", ["mixed", "near", "surface"])
def test_views_are_those_of_the_reference(name, options):
    """By each method the same bits; colours and depths those of the reference."""
    need_device()
    options = OPTIONS[options] | {"depth": True}
    expected = views(scenes()[name], "reference", **options)
    first, *others = (views(scenes()[name], method=m, **options) for m in FOR_VIEWS)
    assert_alike(first.color, expected.color)
    same = np.isclose(first.depth, expected.depth, rtol=2e-4)
    assert same.mean() >= 0.999
    for other in others:
        np.testing.assert_array_equal(other.color, first.color)
        np.testing.assert_array_equal(other.depth, first.depth)


@pytest.mark.parametrize(("name", "display", "options"), CASES)
def test_panels_are_those_of_the_reference(name, display, options):
    need_device()
    scene, shown = scenes()[name], DISPLAYS[display]
    expected = panel(scene, shown, "reference", **OPTIONS[options])
    found = panel(scene, shown, method="single-pass", **OPTIONS[options])
    assert_alike(found, expected)
    np.testing.assert_array_equal(panel(scene, shown, method="covering-quad", **OPTIONS[options]), found)
    for method in MANY if not shown.continuous else ():
        assert_alike(panel(scene, shown, method=method, **OPTIONS[options]), found)


@pytest.mark.parametrize("rig", [
    replace(RIG, position=(1, 2, 3.5), up=(0.3, 1, 0), aspect=2.0, offset_y=0.2),
    replace(RIG, spacing="equal-angle", baseline=3.0, focal_distance=2.5),
    replace(RIG, offsets=(-0.9, -0.1, 0.0, 0.35, 1.4)),
])  # fmt: skip
def test_any_rig_agrees_with_the_reference(rig):
    need_device()
    scene = scenes()["mixed"]
    assert_alike(views(scene, rig=rig).color, views(scene, "reference", rig=rig).color)
    assert_alike(panel(scene, SLANTED, rig=rig), panel(scene, SLANTED, "reference", rig=rig))


def test_small_views_scaled_up_are_those_of_the_reference():
    need_device()
    scene, display = scenes()["mixed"], DISPLAYS["slanted"]
    expected = panel(scene, display, "reference", "n-pass-subres")
    assert_alike(panel(scene, display, method="n-pass-subres"), expected, 0.01)  # a pixel is spread over many


def test_continuous_panels_in_views_show_the_nearest():
    need_device()
    scene, display = scenes()["mixed"], DISPLAYS["continuous"]
    stack = views(scene, method="n-pass")
    np.testing.assert_array_equal(panel(scene, display, method="n-pass"), aus.interlace(stack, display).pixels)


@pytest.mark.parametrize("display", ["wavelength-selective", "lenticular", "cells", "slanted, reversed"])
def test_n_passes_are_interlaced_bit_for_bit(display):
    need_device()
    scene, shown = scenes()["near"], DISPLAYS[display]
    stack = views(scene, method="single-pass", rig=RIG.with_views(shown.views))
    woven = aus.interlace(stack, shown).pixels
    for method in MANY:
        np.testing.assert_array_equal(panel(scene, shown, method=method), woven)


# --- surfels at their limits -------------------------------------------------------------------------


@pytest.mark.parametrize("normal", [None, (0, 0, 1), (1, 0, 0), (3, 1, 1), (0.3, 0.2, 1)])
@pytest.mark.parametrize("radius", [1e-45, 1e-6, 0.02, 50.0, 1e4, 1e15])
def test_discs_of_any_size(normal, radius):
    need_device()
    disc = aus.Points([(0.013, 0.022, 0.5)], None if normal is None else [normal], radius, [(0.9, 0.5, 0.1)])
    scene = aus.Scene(disc, background=BACKGROUND)
    for expected, found in (
        (views(scene, "reference").color, views(scene).color),
        (panel(scene, SLANTED, "reference"), panel(scene, SLANTED)),
    ):
        assert (levels(found, expected) > 1).sum() <= 1
        assert radius >= 1 or (found != found[..., :1, :1, :]).any()


def test_discs_before_the_near_plane_are_cut():
    need_device()
    rig = replace(RIG, near=2.0)
    scene = aus.Scene(aus.Points([(0, 0, 1.9), (0, 0, 2.01)], [(1, 0, 1), (0, 0, 1)], 1.0), background=BACKGROUND)
    assert_alike(views(scene, rig=rig).color, views(scene, "reference", rig=rig).color)


def test_equal_surfels_are_their_mean():
    need_device()
    colors = np.random.default_rng(7).random((500, 3))
    place, normal = np.tile((0, 0, 0.0), (500, 1)), np.tile((0, 0.2, 1.0), (500, 1))
    scene = aus.Points(place, normal, 0.5, colors, material=aus.Material(1.0, 0.0))
    color = views(scene).color
    seen = color[..., 3] > 0
    assert seen.sum() > 100
    assert np.abs(color[seen][:, :3] - 255 * colors.mean(axis=0)).max() <= 0.6


def test_far_from_the_origin():
    need_device()
    scene = cloud(8, material=aus.Material(1.0, 0.0))
    away = np.eye(4)
    away[:3, 3] = 4e6, 5e6, 300
    rig = replace(RIG, position=tuple(away[:3, 3] + RIG.position), target=tuple(away[:3, 3]))
    assert_alike(views(replace(scene, transform=away), rig=rig).color, views(scene).color)


# --- many, in parts ----------------------------------------------------------------------------------


def test_sheets_and_bands_change_nothing(monkeypatch):
    need_device()
    scene = scenes()["mixed"]
    first = views(scene).color, panel(scene, SLANTED), panel(scene, DISPLAYS["continuous, mirrored"])
    monkeypatch.setattr(gl_points, "SHEET_PIXELS", 7 * W)  # a view at a time; bands of 7 rows, the last of 1
    second = views(scene).color, panel(scene, SLANTED), panel(scene, DISPLAYS["continuous, mirrored"])
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
    monkeypatch.setattr(gl_points, "SHEET_PIXELS", 3 * W * H)  # 3 views, then 2
    np.testing.assert_array_equal(views(scene).color, first[0])
    monkeypatch.setattr(points_splat, "band_rows", lambda device: 5)  # an invocation's, as on GPUs
    third = views(scene).color, panel(scene, SLANTED), panel(scene, DISPLAYS["continuous, mirrored"])
    for a, b in zip(first, third, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_frame_after_the_first_sends_no_scene_data():
    device = need_device()
    before, clouds = device.uploaded, [cloud(1, 30), cloud(2, 12)]
    renderer = aus.Renderer(aus.Scene(clouds), "gl")
    sent = 42 * FLOATS * 4 + 2 * 4 * 4
    assert device.uploaded - before == sent
    for method in ("single-pass", "n-pass", "covering-quad"):
        for rig in (RIG, replace(RIG, position=(1, 0, 3))):
            for options in (aus.Options(), aus.Options(alpha="averaged", groups=5)):
                renderer.render(SLANTED, rig, method=method, options=options)
    renderer.render_views(RIG, (32, 24))
    assert device.uploaded - before == sent


def test_a_renderer_follows_its_camera_and_options():
    """What is made ready for a frame is not used for the next."""
    need_device()
    renderer = aus.Renderer(scenes()["mixed"], "gl")
    for rig in (RIG, replace(RIG, position=(0.5, 0.2, 3.5))):
        for options in (aus.Options(), aus.Options(shading="center")):
            found = renderer.render(SLANTED, rig, options=options).pixels.copy()
            np.testing.assert_array_equal(found, aus.render(scenes()["mixed"], SLANTED, rig, engine="gl",
                                                            options=options).pixels)  # fmt: skip


def test_neighbours_follow_each_other():
    positions = np.random.default_rng(0).permutation(surfel_cloud(4000).positions).astype(np.float32)
    order = space_filling_order(positions)
    np.testing.assert_array_equal(np.sort(order), np.arange(4000))
    step = np.linalg.norm(np.diff(positions[order], axis=0), axis=1)
    assert np.median(step) < 0.1 < np.median(np.linalg.norm(np.diff(positions, axis=0), axis=1))
    np.testing.assert_array_equal(space_filling_order(np.zeros((5, 3), np.float32)), np.arange(5))


# --- groups ------------------------------------------------------------------------------------------


def test_a_group_for_each_surfel_is_exact_where_a_pixel_shows_one_view():
    """One depth for three sub-pixels is then the depth; half floats cost a level."""
    need_device()
    for name in ("mixed", "near"):
        scene, display = scenes()[name], DISPLAYS["lenticular"]
        found = panel(scene, display, method="covering-quad", alpha="averaged", groups=120)
        assert_alike(found, panel(scene, display), 0.002)


def test_more_groups_lose_fewer_surfels():
    need_device()
    scene, display = scenes()["surface"], DISPLAYS["lenticular"]
    exact = panel(scene, display).astype(float)
    errors = [
        np.mean((panel(scene, display, method="covering-quad", alpha="averaged", groups=k) - exact) ** 2)
        for k in (1, 4, 16, 64)
    ]
    print("mean squared errors", errors)
    assert errors == sorted(errors, reverse=True) and errors[-1] < errors[0] / 20


def test_one_depth_for_three_views_is_a_compromise():
    """Exact by default; else what one view sees hides what another would."""
    need_device()
    scene, display = scenes()["surface"], DISPLAYS["wavelength-selective"]
    exact = panel(scene, display)
    np.testing.assert_array_equal(panel(scene, display, method="covering-quad", groups=3), exact)
    averaged = panel(scene, display, method="covering-quad", alpha="averaged", groups=200)
    assert 0.01 < (levels(averaged, exact) > 1).mean() < 0.5


def test_more_groups_than_a_texture_holds():
    device = need_device()
    most = (device.limits.texture // W) * (device.limits.texture // H)
    scene = aus.Scene(cloud(1, most + 1), LIGHTS)
    with pytest.raises(aus.UnsupportedError, match=rf"groups {most + 1}: a texture of this device holds \d+ tiles"):
        panel(scene, SLANTED, method="covering-quad", alpha="averaged", groups=most + 1)


@pytest.mark.parametrize("baseline", [1e-96, 1e-38, 1e-30])
def test_cameras_as_near_as_numbers_can_tell(baseline):
    """Where float32 cannot part them, no lattice tells whose a sub-pixel is."""
    need_device()
    scene, rig = scenes()["mixed"], replace(RIG, baseline=baseline)
    for display in ("continuous, mirrored", "wavelength-selective", "slanted"):
        assert_alike(panel(scene, DISPLAYS[display], rig=rig), panel(scene, DISPLAYS[display], "reference", rig=rig))
