"""Every engine draws meshes like the reference, and its single pass equals its n passes bit for bit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.viewmap import ViewMap

from .helpers import (
    OTHER_ENGINES,
    RIG,
    SCENES,
    SIZE,
    assert_agree,
    floor,
    interior_of_panel,
    interior_of_views,
    levels_of,
    need,
    random_scene,
    smooth,
    soup,
)

pytestmark = pytest.mark.parametrize("engine", OTHER_ENGINES)
W, H = SIZE
RANDOM = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


def displays():
    """One of every kind of mask, by name."""
    rng = np.random.default_rng(3)
    portrait = aus.Display.preset("looking-glass-portrait").resized(W, H)
    slanted = {"lens_pitch": 5.7, "subpixel_pitch": 1.0, "slant_deg": 9.46, "phase": 0.3}
    return {
        "lenticular per pixel": aus.Display.lenticular(W, H, 5),
        "lenticular per sub-pixel": aus.Display.lenticular(W, H, 7, per="subpixel"),
        "wavelength-selective": aus.Display.wavelength_selective(W, H),
        "slanted table": aus.Display.preset("de-sorbier-6-slanted").resized(W, H),
        "slanted physical": aus.Display.slanted(W, H, 9, **slanted),
        "slanted forwards, reversed": aus.Display.slanted(W, H, 9, **slanted | {"slant_deg": -20.0}, reverse=True),
        "fine lenses": aus.Display.slanted(W, H, 30, **slanted | {"lens_pitch": 1.4}),
        "coarse lenses": aus.Display.slanted(W, H, 4, **slanted | {"lens_pitch": 47.0}),
        "looking glass": portrait,
        "looking glass, mirrored": replace(portrait, flip_x=True, flip_y=True),
        "looking glass, cells": aus.Display.preset("looking-glass-16-landscape").resized(W, H),
        "user table": aus.Display.from_table(W, H, 6, rng.integers(0, 6, (5, 7, 3))),
        "user table, reversed": aus.Display.from_table(W, H, 6, rng.integers(0, 6, (3, 4, 3)), reverse=True),
        "user table as large as the panel": aus.Display.from_table(W, H, 11, rng.integers(0, 11, (H, W, 3))),
        "one view": aus.Display.lenticular(W, H, 1),
        "row interleaved": aus.Display.stereo(W, H, layout="row-interleaved"),
        "column interleaved": aus.Display.stereo(W, H, layout="column-interleaved", reverse=True),
        "checkerboard": aus.Display.stereo(W, H, layout="checkerboard"),
    }


DISPLAYS = displays()


def views(scene, rig, engine, method="n-pass", **options):
    return aus.render_views(scene, rig, size=SIZE, method=method, engine=engine, options=aus.Options(**options))


def panel(scene, display, rig, engine, **options):
    return aus.render(scene, display, rig, method="single-pass", engine=engine, options=aus.Options(**options)).pixels


def assert_one_pass_is_many(scene, display, rig, engine, **options):
    """The single-pass stack equals the n-pass one, and the panel its interlaced views, bit for bit."""
    rig = rig.with_views(display.views)
    many = views(scene, rig, engine, depth=True, **options)
    one = views(scene, rig, engine, "single-pass", depth=True, **options)
    np.testing.assert_array_equal(one.color, many.color)
    np.testing.assert_array_equal(one.depth, many.depth)
    woven, found = aus.interlace(many, display).pixels, panel(scene, display, rig, engine, **options)
    if engine == "gl":  # a single pass may meet triangles by rays: silhouettes, many at 40×30, may differ
        differs = np.abs(found.astype(int) - woven) > 1
        if differs.mean() > 0.01:  # drivers cut triangles that reach the eye coarsely: then it is to be the exact one
            differs &= np.abs(found.astype(int) - panel(scene, display, rig, "reference", **options)) > 1
        assert differs.mean() <= 0.01
        every = aus.Options(**options)
        found = aus.render(scene, display, rig, method="instanced", engine=engine, options=every).pixels
    np.testing.assert_array_equal(found, woven)


# --- like the reference ------------------------------------------------------------------------------


@pytest.mark.parametrize("lighting", ["sample", "vertex"])
@pytest.mark.parametrize("shading", ["exact", "center"])
@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("name", SCENES)
def test_views_are_those_of_the_reference(engine, name, samples, shading, lighting):
    need(engine)
    scene, by = SCENES[name]
    options = {"shading": shading, "lighting": lighting, "samples": samples, "depth": True}
    rig = RIG.with_views(3)
    expected = views(scene, rig, "reference", **options)
    found = views(scene, rig, engine, "single-pass", **options)
    inside = interior_of_views(scene, rig, SIZE, samples, by)
    assert_agree(found.color, expected.color, inside, levels_of(engine, name == "floor"))
    np.testing.assert_array_equal(np.isfinite(found.depth[inside]), np.isfinite(expected.depth[inside]))
    np.testing.assert_allclose(found.depth[inside], expected.depth[inside], rtol=2e-4)


@pytest.mark.parametrize(("samples", "sampling"), [(1, "pixel"), (4, "pixel"), (1, "subpixel")])
@pytest.mark.parametrize("name", ["slanted physical", "looking glass, mirrored", "slanted table", "continuous"])
def test_panels_are_those_of_the_reference(engine, name, samples, sampling):
    need(engine)
    continuous = aus.Display.slanted(W, H, 9, lens_pitch=5.7, subpixel_pitch=1, slant_deg=9.5, continuous=True)
    display = DISPLAYS.get(name, continuous)
    rig = RIG.with_views(display.views)
    options = aus.Options(sampling=sampling, samples=samples)
    for scene, by in (SCENES["smooth"], SCENES["soup"]):
        expected, found = (aus.render(scene, display, rig, engine=e, options=options) for e in ("reference", engine))
        inside = interior_of_panel(scene, rig, display, options, by)
        assert_agree(found.pixels, expected.pixels, inside)


@pytest.mark.parametrize("rig", [
    replace(RIG, position=(1, 2, 3.5), up=(0.3, 1, 0), aspect=2.0, offset_y=0.2),
    replace(RIG, spacing="equal-angle", baseline=3.0, focal_distance=2.5),
    replace(RIG, offsets=(-0.9, -0.1, 0.0, 0.35, 1.4)),
])  # fmt: skip
def test_any_rig_agrees_with_the_reference(engine, rig):
    need(engine)
    expected, found = (views(smooth(), rig, e, "single-pass") for e in ("reference", engine))
    assert_agree(found.color, expected.color, interior_of_views(smooth(), rig, SIZE, 1, "object"))


@pytest.mark.parametrize("texture", [(1, 1), (64, 1), (7, 13), (33, 20)])
def test_textures_of_any_size_agree_with_the_reference(engine, texture):
    need(engine)
    expected, found = (views(floor(texture, 3), RIG, e, "single-pass") for e in ("reference", engine))
    inside = interior_of_views(floor(), RIG, SIZE, 1, "object")
    assert_agree(found.color, expected.color, inside, levels_of(engine, True))


@given(data=st.data())
@RANDOM
def test_random_meshes_agree_with_the_reference(engine, data):
    """Lattice vertices put edges on pixel centres, where precision decides: only the interior is compared."""
    need(engine)
    scene = random_scene(integers(data), texture=data.draw(st.booleans()))
    rig = RIG.with_views(2)
    expected, found = (views(scene, rig, e, "single-pass") for e in ("reference", engine))
    inside = interior_of_views(scene, rig, SIZE, 1, "triangle")
    difference = np.abs(found.color.astype(int) - expected.color).max(axis=-1)
    assert difference[inside].max(initial=0) <= levels_of(engine, scene.objects[0].texture is not None)


def test_of_equally_near_triangles_the_earlier_is_seen_as_in_the_reference(engine):
    need(engine)
    first, second = smooth().objects[0], soup().objects[0]
    again = [replace(mesh, colors=1 - mesh.colors) for mesh in (first, second)]
    scene = aus.Scene([first, second, *again])
    alone = aus.Scene([first, second])
    np.testing.assert_array_equal(views(scene, RIG, engine).color, views(alone, RIG, engine).color)


@pytest.mark.parametrize("depth", [4.0, 3.0, 1 / 3, 7.7])
def test_of_triangles_in_one_plane_before_the_cameras_the_earlier_is_seen(engine, depth):
    """They share no edge, so that only equal depths in all of them make the first win everywhere."""
    need(engine)
    material = aus.Material(1, 0, two_sided=True)
    first, second = (
        aus.Mesh(np.array(corners) * depth / 4, [[0, 1, 2]], colors=np.tile(color, (3, 1)), material=material)
        for corners, color in (
            ([(-1, -1, 0), (1, -0.9, 0), (0.1, 1, 0)], (1.0, 0, 0)),
            ([(-0.8, -1.2, 0), (1.2, -0.7, 0), (-0.2, 0.9, 0)], (0, 1.0, 0)),
        )
    )
    rig = aus.Rig(position=(0, 0, depth), views=3, baseline=0.2 * depth)
    both, alone = (aus.render_views(meshes, rig, (120, 120), engine=engine) for meshes in ([first, second], first))
    covered = alone.color[..., 3] == 255
    assert covered.sum() > 10_000 and (both.color[..., 0] == alone.color[..., 0]).all()


# --- single pass = n passes --------------------------------------------------------------------------


def integers(data):
    """`draw_integers` of `random_scene`, from hypothesis."""
    return lambda low, high, count: np.array(
        data.draw(st.lists(st.integers(low, high), min_size=count, max_size=count)), dtype=int
    )


@pytest.mark.parametrize("name", DISPLAYS)
def test_single_pass_is_n_passes_for_every_mask(engine, name):
    need(engine)
    for scene in (smooth(), soup(), floor()):
        assert_one_pass_is_many(scene, DISPLAYS[name], RIG, engine)


@pytest.mark.parametrize("lighting", ["sample", "vertex"])
@pytest.mark.parametrize("shading", ["exact", "center"])
@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("name", SCENES)
def test_single_pass_is_n_passes_for_every_option(engine, name, samples, shading, lighting):
    need(engine)
    scene, _ = SCENES[name]
    options = {"shading": shading, "lighting": lighting, "samples": samples}
    assert_one_pass_is_many(scene, DISPLAYS["slanted physical"], RIG, engine, **options)


@given(data=st.data())
@RANDOM
def test_single_pass_is_n_passes_for_random_meshes(engine, data):
    need(engine)
    scene = random_scene(integers(data), texture=data.draw(st.booleans()))
    display = DISPLAYS[data.draw(st.sampled_from(["slanted physical", "slanted table", "looking glass, cells"]))]
    options = {
        "shading": data.draw(st.sampled_from(["exact", "center"])),
        "lighting": data.draw(st.sampled_from(["sample", "vertex"])),
        "samples": data.draw(st.sampled_from([1, 4])),
    }
    assert_one_pass_is_many(scene, display, RIG, engine, **options)


@given(seed=st.integers(0, 2**32 - 1), baseline=st.floats(0, 8), focal=st.floats(0.3, 20))
@RANDOM
def test_single_pass_is_n_passes_for_random_triangles_and_rigs(engine, seed, baseline, focal):
    need(engine)
    rig = replace(RIG, baseline=baseline, focal_distance=focal)
    for name in ("slanted physical", "wavelength-selective"):
        assert_one_pass_is_many(soup(seed, count=14), DISPLAYS[name], rig, engine)


@pytest.mark.parametrize("baseline", [1e-20, 1e-34, 1e-40, 1e-200, 1e-310, 5e-324])
def test_single_pass_is_n_passes_for_cameras_that_hardly_differ(engine, baseline):
    """Where pixels per unit of offset are more than numbers hold."""
    need(engine)
    assert_one_pass_is_many(soup(1, count=14), DISPLAYS["slanted physical"], replace(RIG, baseline=baseline), engine)


def test_continuous_panel_is_interlaced_from_the_cameras_it_asks_for(engine):
    """A phase that repeats asks for few cameras: drawn as views, they give the continuous panel bit for bit."""
    need(engine)
    viewmap = ViewMap(5, a=0.25, b=0.125, offsets=np.array([[0.0, 0.0625, 0.5]]), continuous=True)
    display = aus.Display("continuous", W, H, viewmap)
    v = RIG.offset_at(display.view_of_subpixel())
    offsets, index = np.unique(v, return_inverse=True)
    stack = views(soup(), replace(RIG, offsets=tuple(offsets), views=len(offsets)), engine)
    rows, columns, channels = np.ogrid[:H, :W, :3]
    woven = stack.color[index.reshape(v.shape), rows, columns, channels]
    found = panel(soup(), display, RIG, engine)
    if engine == "gl":  # views are rasterised, a continuous panel is not: silhouettes and roundings may differ
        differs = np.abs(found.astype(int) - woven) > 1
        assert differs.mean() <= 0.005
    else:
        np.testing.assert_array_equal(found, woven)
