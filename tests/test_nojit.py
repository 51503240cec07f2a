"""Kernels run as plain Python, where an array index out of bounds is an error and an integer that overflows a warning.

Compiled, a kernel would read or write whatever lies there. `make test` sets NUMBA_DISABLE_JIT=1 for this file.
"""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from agreement.helpers import assert_agree, interior_of_panel, interior_of_views, random_scene
from autostereo.engines.cpu import gather, observe
from autostereo.engines.reference import gather as reference

pytestmark = [
    pytest.mark.skipif(
        os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0"),
        reason="the JIT is on: run NUMBA_DISABLE_JIT=1 pytest tests/test_nojit.py",
    ),
    # kernels divide as C does, by zero too; whatever else NumPy warns of is an error
    pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning", "ignore:invalid value:RuntimeWarning"),
]

W, H = SIZE = (20, 13)
VIEWS = 3
RIG = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=1.2, views=VIEWS, near=0.2)
LIGHTS = (aus.DirectionalLight((0.5, -1, -1), (0.8, 0.7, 0.6)), aus.PointLight((1, 1, 2.5), (0.3, 0.4, 0.5)))
LENSES = {"lens_pitch": 5.7, "subpixel_pitch": 1.0, "slant_deg": 9.46, "phase": 0.3}
SLANTED = aus.Display.slanted(W, H, VIEWS, **LENSES)
DISPLAYS = {
    "slanted": SLANTED,
    "slanted, mirrored": replace(SLANTED, flip_x=True, flip_y=True),
    "slanted, reversed": aus.Display.slanted(W, H, VIEWS, **LENSES | {"slant_deg": -20.0}, reverse=True),
    "fine lenses": aus.Display.slanted(W, H, VIEWS, **LENSES | {"lens_pitch": 1.4}),
    "coarse lenses": aus.Display.slanted(W, H, VIEWS, **LENSES | {"lens_pitch": 47.0}),
    "lenticular": aus.Display.lenticular(W, H, VIEWS),
    "lenticular, mirrored": replace(aus.Display.lenticular(W, H, VIEWS, per="subpixel"), flip_x=True),
    "wavelength-selective": aus.Display.wavelength_selective(W, H),
    "table as large as the panel": aus.Display.from_table(W, H, VIEWS, np.arange(H * W * 3).reshape(H, W, 3) % VIEWS),
    "cells": aus.Display.preset("looking-glass-16-landscape").resized(W, H).with_views(VIEWS),
    "one view": aus.Display.lenticular(W, H, 1),
    "checkerboard": aus.Display.stereo(W, H, layout="checkerboard"),
}
CONTINUOUS = aus.Display.slanted(W, H, VIEWS, **LENSES, continuous=True)


def scene(kind: str) -> aus.Scene:
    """A few triangles: facing, slanted, edge-on, leaving the picture on every side, and of size zero."""
    rng = np.random.default_rng(5)
    vertices = np.array([
        (-1.2, -0.9, 0.3), (1.1, -1, -0.5), (0.1, 1.2, 0), (-0.8, 0.2, 1.2), (0.9, 0.3, -1),
        (9, 0.1, -3), (-9, 0.2, -2), (0.2, 7, 0.5), (0, 0, 0), (0, 0, -5),
    ])  # fmt: skip
    if kind == "near-clipped":
        vertices[[5, 6, 7], 2] = 3.7, 4.5, 6.0
    faces = np.array([[0, 1, 2], [3, 4, 2], [5, 6, 0], [7, 3, 1], [8, 9, 2], [4, 4, 0], [0, 2, 3]])
    fields = {"colors": rng.uniform(0, 1, (10, 3))}
    if kind == "textured":
        fields |= {"uv": rng.uniform(-2, 3, (10, 2)), "texture": rng.integers(0, 256, (5, 8, 3)).astype(np.uint8)}
    specular = 0.5 if kind == "specular" else 0.0
    material = aus.Material(0.3, 0.6, specular, 12, two_sided=kind != "one-sided")
    return aus.Scene(aus.Mesh(vertices, faces, material=material, **fields), LIGHTS, (0.1, 0.2, 0.3))


KINDS = ("plain", "textured", "specular", "one-sided", "near-clipped")
SCENES = {kind: scene(kind) for kind in KINDS}
EVERY_SCENE = pytest.mark.parametrize("kind", KINDS)
EVERY_LIGHTING = pytest.mark.parametrize("lighting", ["sample", "vertex"])


def views(content: aus.Scene, method: str = "single-pass", engine: str = "cpu", rig: aus.Rig = RIG, **options):
    return aus.render_views(content, rig, SIZE, method=method, engine=engine, options=aus.Options(**options))


def panel(content: aus.Scene, display: aus.Display, method: str = "single-pass", engine: str = "cpu", **options):
    return aus.render(content, display, RIG, method=method, engine=engine, options=aus.Options(**options)).pixels


def assert_one_pass_is_many(content: aus.Scene, display: aus.Display, **options) -> None:
    rig = RIG.with_views(display.views)
    one = views(content, rig=rig, depth=True, **options)
    many = views(content, "n-pass", rig=rig, depth=True, **options)
    np.testing.assert_array_equal(one.color, many.color)
    np.testing.assert_array_equal(one.depth, many.depth)
    woven = aus.interlace(one, display).pixels
    np.testing.assert_array_equal(panel(content, display, **options), woven)
    np.testing.assert_array_equal(panel(content, display, "n-pass", **options), woven)


@EVERY_SCENE
@EVERY_LIGHTING
@pytest.mark.parametrize("shading", ["exact", "center"])
@pytest.mark.parametrize("samples", [1, 4])
def test_single_pass_is_n_passes_for_every_option(kind, lighting, shading, samples):
    assert_one_pass_is_many(SCENES[kind], SLANTED, lighting=lighting, shading=shading, samples=samples)


@pytest.mark.parametrize("display", DISPLAYS.values(), ids=DISPLAYS)
def test_single_pass_is_n_passes_for_every_mask(display):
    for kind, lighting in (("textured", "sample"), ("plain", "vertex")):
        assert_one_pass_is_many(SCENES[kind], display, lighting=lighting)


@pytest.mark.parametrize("seed", range(8))
def test_single_pass_is_n_passes_for_random_meshes(seed):
    rng = np.random.default_rng(seed)
    content = random_scene(lambda low, high, count: rng.integers(low, high + 1, count), texture=seed % 2 == 0)
    assert_one_pass_is_many(content, SLANTED, lighting=("sample", "vertex")[seed // 2 % 2])


@EVERY_SCENE
@EVERY_LIGHTING
def test_views_are_those_of_the_reference(kind, lighting):
    content = SCENES[kind]
    found, expected = (views(content, engine=e, lighting=lighting, depth=True) for e in ("cpu", "reference"))
    inside = interior_of_views(content, RIG, SIZE, 1, "triangle")
    assert_agree(found.color, expected.color, inside)
    np.testing.assert_allclose(found.depth[inside], expected.depth[inside], rtol=2e-4)


@EVERY_LIGHTING
@pytest.mark.parametrize("sampling", ["pixel", "subpixel"])
@pytest.mark.parametrize("display", [SLANTED, CONTINUOUS, DISPLAYS["slanted, mirrored"]], ids=lambda d: d.name)
def test_panels_are_those_of_the_reference(display, sampling, lighting):
    content = SCENES["plain"]
    found, expected = (
        panel(content, display, engine=e, sampling=sampling, lighting=lighting) for e in ("cpu", "reference")
    )
    inside = interior_of_panel(content, RIG, display, aus.Options(sampling=sampling), "triangle")
    assert_agree(found, expected, inside)


@EVERY_LIGHTING
@pytest.mark.parametrize("kind", ["plain", "textured", "specular"])
def test_reused_colours_stay_in_bounds(kind, lighting):
    """Which samples are covered does not change, only how they are shaded."""
    found = views(SCENES[kind], shading="reuse", lighting=lighting, depth=True)
    expected = views(SCENES[kind], lighting=lighting, depth=True)
    np.testing.assert_array_equal(found.depth, expected.depth)
    assert panel(SCENES[kind], CONTINUOUS, shading="reuse", lighting=lighting).shape == (H, W, 3)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (2, 2), (17, 3)])
def test_pictures_of_any_size(size):
    display = aus.Display.slanted(*size, VIEWS, **LENSES)
    one = aus.render_views(SCENES["textured"], RIG, size)
    np.testing.assert_array_equal(
        aus.render(SCENES["textured"], display, RIG).pixels, aus.interlace(one, display).pixels
    )


def test_triangles_outside_every_picture_leave_the_background():
    """Beside the cameras, and behind them."""
    vertices = np.array([(50, 0, 0), (51, 0, 0), (50, 1, 0), (0, 0, 9), (1, 0, 9), (0, 1, 9)])
    content = aus.Scene(aus.Mesh(vertices, [[0, 1, 2], [3, 4, 5]]), background=(1.0, 0.5, 0.0))
    assert (panel(content, SLANTED) == (255, 128, 0)).all()
    assert (views(content).color == (255, 128, 0, 0)).all()


@pytest.mark.parametrize("display", [SLANTED, CONTINUOUS, DISPLAYS["cells"]], ids=lambda d: d.name)
def test_quilts_are_woven_to_panels(display):
    """What shows one colour everywhere is woven to it."""
    corners, glow = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], aus.Material(1, 0)
    square = aus.Mesh(corners, [[0, 1, 2], [0, 2, 3]], material=glow)
    assert (panel(aus.Scene(square), display, "n-pass-subres") == 255).all()


def cloud(seed: int) -> aus.Points:
    """Surfels of all sizes, some edge-on, some around and behind the cameras, a huge one."""
    rng = np.random.default_rng(seed)
    positions = rng.normal((0, 0, 0.5), (0.9, 0.6, 1.5), (24, 3))
    normals = rng.normal(size=(24, 3)) * (1, 1, 0.3)
    radii = np.append(np.exp(rng.uniform(-6, 0, 23)), 1e4)
    return aus.Points(positions, normals, radii, rng.random((24, 3)), material=aus.Material(specular=0.5))


@pytest.mark.parametrize("name", ["slanted", "slanted, mirrored", "lenticular", "coarse lenses", "cells"])
def test_single_pass_is_n_passes_for_points_among_meshes(name):
    for objects in (cloud(1), [cloud(2), *SCENES["plain"].objects]):
        assert_one_pass_is_many(aus.Scene(objects, LIGHTS), DISPLAYS[name])


def test_a_wide_single_view_of_points_stays_within_its_memory():
    """Lanes beyond the last view have no samples; what they would read lay behind a thread's memory."""
    cloud = aus.Points(np.random.default_rng(0).normal(size=(6, 3)) * 0.3, radii=0.05)
    found = aus.render_views(cloud, replace(RIG, views=1), (4000, 2), engine="cpu")
    assert found.color[..., 3].any()


def test_points_are_those_of_the_reference():
    content = aus.Scene(cloud(3), LIGHTS)
    found, expected = (views(content, engine=e, depth=True) for e in ("cpu", "reference"))
    assert (np.abs(found.color.astype(int) - expected.color) > 1).any(axis=-1).mean() < 5e-3
    found, expected = (panel(content, CONTINUOUS, engine=e, sampling="subpixel") for e in ("cpu", "reference"))
    assert (np.abs(found.astype(int) - expected) > 1).mean() < 5e-3


@pytest.mark.parametrize("count", [1, 2, 4])
def test_warped_rows_stay_in_bounds(count):
    """Whatever the depths are: from the least that a float32 holds to infinity."""
    rng = np.random.default_rng(count)
    depth = rng.choice(np.array([1e-45, 1e-3, 1.0, 3.9, 4.0, 1e3, 3e38, np.inf], np.float32), (count, H, W))
    color = rng.integers(0, 256, (count, H, W, 4)).astype(np.uint8)
    found = aus.warp(aus.ViewStack(color, depth), RIG, np.linspace(-0.4, 0.3, count))
    assert found.depth is not None and (found.depth > 0).all()
    exact, near = (aus.render_views(scene("plain"), RIG, SIZE, method=m, engine="cpu") for m in ("n-pass", "dibr"))
    np.testing.assert_array_equal(near.color[[0, 2]], exact.color[[0, 2]])


@pytest.mark.parametrize("flips", [(False, False), (True, True)])
@pytest.mark.parametrize("display", [*DISPLAYS.values(), CONTINUOUS], ids=lambda d: d.name)
def test_gathering_is_that_of_the_reference(display, flips):
    rng = np.random.default_rng(0)
    stack = rng.integers(0, 256, (display.views, H, W, 4)).astype(np.uint8)
    found, expected, merged = (np.empty((H, W, 3), np.uint8) for _ in range(3))
    gather.interlace(stack, display.viewmap, *flips, found)
    reference.interlace(stack, display.viewmap, *flips, expected)
    np.testing.assert_array_equal(found, expected)
    for index, picture in enumerate(stack):
        gather.merge_view(picture, index, display.viewmap, flips, merged)
    np.testing.assert_array_equal(merged, expected)

    quilt = rng.integers(0, 256, (2 * 5 + 1, display.views * 7 + 1, 3)).astype(np.uint8)
    for name in ("nearest", "linear"):
        arguments = (quilt, (display.views, 2), display.viewmap, SIZE, name, flips)
        np.testing.assert_array_equal(gather.weave(*arguments), reference.weave(*arguments))

    wanted = rng.uniform(0, 1, (W, 3))
    for crosstalk in (0.0, 0.3):
        seen = observe.observe(expected, display.viewmap, wanted, crosstalk=crosstalk, flips=flips)
        np.testing.assert_array_equal(
            seen, reference.observe(expected, display.viewmap, wanted, crosstalk=crosstalk, flips=flips)
        )


@pytest.mark.parametrize("change", [
    {}, {"shading": {"approximate": True, "filter": "tent"}},
    {"shading": {"approximate": True, "source": "color-buffer"}},
    {"traversal": {"order": "by-view"}, "depth": {"z_min": True}}, {"traversal": {"tile": (1, 1)}},
])  # fmt: skip
def test_the_simulator_stays_in_bounds(change):
    from autostereo.simulator import simulate
    from sim_scenes import MULTI, layers

    exact = simulate(layers(), RIG, MULTI, size=SIZE)
    found = simulate(layers(), RIG, MULTI.with_(**change), size=SIZE, maps=True)
    np.testing.assert_array_equal(found.depth, exact.depth)
    assert found.counters["texels"] > 0


def test_simulated_shaders_that_give_depths_stay_in_bounds():
    from autostereo.simulator import simulate
    from autostereo.simulator.scenes import SCENES
    from sim_scenes import MULTI

    found = simulate(*SCENES["relief"].at(0, 2), MULTI.with_(shading={"approximate": True}), size=(24, 16))
    assert found.approximated.sum() > 0
