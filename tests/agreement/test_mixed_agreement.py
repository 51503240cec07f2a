"""Scenes of meshes, points and volumes: every engine draws them like the reference, in one pass as in many."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import autostereo as aus
from autostereo.scene import samples, shapes

from .helpers import engines_for, need
from .test_points_agreement import clouds
from .volume_cases import (
    BACKGROUND,
    DISCRETE,
    DISPLAYS,
    LIGHTS,
    SIZE,
    H,
    W,
    assert_alike,
    assert_one_pass_is_many,
    panel,
    random,
    rigs,
    views,
    volumes,
)

pytestmark = pytest.mark.parametrize("engine", engines_for(aus.Mesh, aus.Points, aus.Volume))
EXACT = {"volume": "exact"}
RIG = aus.Rig(position=(0.4, 0.3, 4), fov_y=36, views=5, baseline=1.0)


@st.composite
def meshes(draw):
    """A few triangles that cut each other."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(1, 6))
    material = aus.Material(0.3, 0.6, 0.2, 9.0, two_sided=True)
    return aus.Mesh(
        rng.normal(0, 0.8, (3 * count, 3)), np.arange(3 * count).reshape(-1, 3), colors=rng.random((3 * count, 3)),
        material=material,
    )  # fmt: skip


@st.composite
def mixed(draw):
    """Two to four objects of at least two kinds, in any order."""
    volume = volumes(shaded=False, steep=False)
    kinds = [meshes(), clouds(), volume]
    first, second = draw(st.permutations(kinds))[:2]
    objects = [draw(first), draw(second), *draw(st.lists(st.one_of(*kinds), max_size=2))]
    if sum(isinstance(x, aus.Volume) for x in objects) > 2:  # tuples of every length are compiled
        objects = objects[:2]
    return aus.Scene(objects, draw(st.sampled_from([None, LIGHTS])), BACKGROUND)


@given(mixed(), rigs(), st.sampled_from([1, 1, 4]), st.sampled_from([0.5, 1.0, 2.0]))
@random(30)
def test_views_are_those_of_the_reference(engine, scene, rig, count, step):
    need(engine)
    options = {"samples": count, "step": step, "depth": True, **EXACT}
    expected, found = (views(scene, rig, e, **options) for e in ("reference", engine))
    assert_alike(found.color, expected.color)
    same = np.isfinite(found.depth) == np.isfinite(expected.depth)
    both = np.isfinite(found.depth) & np.isfinite(expected.depth)
    off = np.abs(found.depth[both] - expected.depth[both]) > 0.05
    assert (~same).mean() <= 0.02 and off.sum() <= 0.02 * same.size


@given(
    mixed(), rigs(), st.sampled_from(list(DISPLAYS)), st.sampled_from(["pixel", "subpixel"]),
    st.sampled_from([1, 1, 4]), st.sampled_from(["exact", "averaged"]),
)  # fmt: skip
@random(30)
def test_panels_are_those_of_the_reference(engine, scene, rig, name, sampling, count, alpha):
    need(engine)
    display, rig = DISPLAYS[name], rig.with_views(DISPLAYS[name].views)
    options = {"sampling": sampling, "samples": count, "alpha": alpha, **EXACT}
    expected, found = (panel(scene, display, rig, e, **options) for e in ("reference", engine))
    assert_alike(found, expected)


@given(mixed(), rigs(), st.sampled_from(DISCRETE), st.sampled_from([1, 1, 4]))
@random(12)
def test_one_pass_is_many_bit_for_bit(engine, scene, rig, name, count):
    need(engine)
    display, options = DISPLAYS[name], {"samples": count, **EXACT}
    assert_one_pass_is_many(scene, display, rig, engine, **options)


def test_the_order_of_objects_does_not_matter(engine):
    need(engine)
    ball = shapes.displaced_sphere(2)
    objects = [
        aus.Mesh(np.asarray(ball.vertices) * 0.4, ball.faces, colors=ball.colors),
        replace(samples.surfel_cloud(800), transform=aus.transforms.translation(0.5, 0, 0)),
        samples.shells(16),
        replace(samples.shells(16), mode="iso", iso=200.0, transform=aus.transforms.translation(-0.6, 0, 0.3)),
    ]
    pictures = [views([objects[k] for k in order], RIG, engine).color for order in ((0, 1, 2, 3), (3, 2, 1, 0))]
    np.testing.assert_array_equal(*pictures)


# --- closed forms: a fog between depths 3 and 5, and something opaque in it ------------------------------------------

TAU = 0.4


def fog(**fields):
    """A red homogeneous volume that fills the view between depths 3 and 5 of a camera at the origin."""
    transfer = aus.TransferFunction([(0, 1, 0, 0, TAU)])
    fields = {"transfer": transfer, "shade": False} | fields
    return aus.Volume(np.full((5, 3, 3), 5, np.uint8), (10.0, 10.0, 0.5), (-10.0, -10.0, -5.0), **fields)


def wall(kind, depth):
    """Something blue across the view at a depth."""
    if kind == "mesh":
        corners = [(-9, -9, -depth), (9, -9, -depth), (9, 9, -depth), (-9, 9, -depth)]
        material = aus.Material(1.0, 0.0, two_sided=True)
        return aus.Mesh(corners, [[0, 1, 2], [0, 2, 3]], colors=np.tile((0.0, 0, 1), (4, 1)), material=material)
    if kind == "points":
        return aus.Points([(0, 0, -depth)], [(0, 0, 1)], 40.0, [(0.0, 0, 1)], material=aus.Material(1.0, 0.0))
    values = np.broadcast_to(np.arange(3.0)[:, None, None], (3, 3, 3))
    blue = aus.TransferFunction([(0, 0, 0, 1, 1)])
    return aus.Volume(values, (10.0, 10.0, 1.0), (-10.0, -10.0, -depth - 1), mode="iso", iso=1.0, shade=False,
                      transfer=blue)  # fmt: skip


@pytest.mark.parametrize("kind", ["mesh", "points", "iso"])
@pytest.mark.parametrize("depth", [2.0, 3.7, 4.25, 6.0])
@pytest.mark.parametrize("step", [0.5, 1.0, 7.0])
def test_what_is_opaque_ends_rays_in_every_view(engine, kind, depth, step):
    """T = exp(−τ·length from 3 to the wall), whatever the slabs; depth: where half of it is taken, or the wall."""
    need(engine)
    rig = aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=40, views=5, baseline=1.0, near=0.1)
    seen = views([fog(), wall(kind, depth)], rig, engine, step=step, depth=True)
    f = H / 2 / np.tan(np.deg2rad(20))
    x, y = np.meshgrid(np.arange(W) + 0.5 - W / 2, np.arange(H) + 0.5 - H / 2)
    stretch = np.sqrt(1 + (x / f - rig.camera_offsets[:, None, None] / 4) ** 2 + (y / f) ** 2)
    through = np.exp(-TAU * (np.clip(depth, 3, 5) - 3) * stretch)
    assert np.abs(seen.color[..., 0] - 255 * (1 - through)).max() <= 1
    assert np.abs(seen.color[..., 2] - 255 * through).max() <= 1
    assert not seen.color[..., 1].any() and (seen.color[..., 3] == 255).all()
    half = 3 + np.log(2) / (TAU * stretch)
    expected = np.where((half < min(depth, 5)), half, depth)
    assert np.mean(np.abs(seen.depth - expected) > 0.02) <= 0.02


@pytest.mark.parametrize("kind", ["mesh", "points"])
def test_the_greatest_value_is_that_before_the_wall(engine, kind):
    """s grows with depth from 0 to 4: α = s(wall)/4."""
    need(engine)
    values = np.broadcast_to(np.arange(4.0, -1, -1)[:, None, None], (5, 3, 3))
    red = aus.TransferFunction([(0, 1, 0, 0, 0), (4, 1, 0, 0, 8)])
    ramp = aus.Volume(values, (10.0, 10.0, 0.5), (-10.0, -10.0, -5.0), mode="mip", transfer=red)
    rig = aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=40, views=3, baseline=1.0, near=0.1)
    for depth, alpha in ((2.0, 0.0), (3.75, 0.375), (4.6, 0.8), (8.0, 1.0)):
        seen = views([ramp, wall(kind, depth)], rig, engine).color
        assert np.abs(seen.astype(int) - np.array([255 * alpha, 0, 255 * (1 - alpha), 255])).max() <= 1


@pytest.mark.parametrize("kind", ["mesh", "points", "iso"])
def test_panels_end_rays_too(engine, kind):
    need(engine)
    rig = aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=40, baseline=1.0, near=0.1)
    for name in ("slanted", "continuous, mirrored"):
        for alpha in ("exact", "averaged"):
            both = [panel([fog(), wall(kind, 3.9)], DISPLAYS[name], rig.with_views(9), e, alpha=alpha)
                    for e in ("reference", engine)]  # fmt: skip
            assert np.abs(both[1].astype(int) - both[0]).max() <= 1


def test_everything_in_a_picture_of_one_pixel_across(engine):
    need(engine)
    ball = shapes.displaced_sphere(2)
    objects = [aus.Mesh(np.asarray(ball.vertices) * 0.4, ball.faces, colors=ball.colors), samples.surfel_cloud(300),
               replace(samples.shells(16), shade=False)]  # fmt: skip
    for size in ((1, 1), (1, 20), (20, 1)):
        both = [views(objects, RIG, e, size, step=0.5).color.astype(int) for e in ("reference", engine)]
        assert np.abs(both[1] - both[0]).max() <= 3


def test_a_renderer_that_moves_and_colours_a_mixed_scene(engine):
    need(engine)
    ball = shapes.displaced_sphere(2)
    scene = aus.Scene([aus.Mesh(ball.vertices, ball.faces), samples.surfel_cloud(300), samples.shells(16)], LIGHTS)
    renderer = aus.Renderer(scene, engine=engine)
    renderer.render_views(RIG, SIZE)
    each = [aus.transforms.translation(k - 1, 0, 0) @ np.diag([0.5, 0.5, 0.5, 1]) for k in range(3)]
    renderer.update(transform=each, transfer=scene.objects[2].transfer.scaled(3.0))
    found = renderer.render_views(RIG, SIZE).color
    fresh = [replace(item, transform=matrix) for item, matrix in zip(scene.objects, each, strict=True)]
    fresh[2] = replace(fresh[2], transfer=scene.objects[2].transfer.scaled(3.0))
    np.testing.assert_array_equal(found, views(aus.Scene(fresh, LIGHTS), RIG, engine).color)


@pytest.mark.parametrize("step", [0.25, 1.0])
def test_volumes_that_overlap_take_half_of_the_light_together(engine, step):
    """Homogeneous boxes, one within the other: half is taken ln 2 / (τ₁ + τ₂) behind their face, whatever the slabs."""
    need(engine)
    boxes = [
        aus.Volume(np.ones((2, 2, 2), np.float32), (size,) * 3, (-size / 2, -size / 2, 1 - size),
                   transfer=aus.TransferFunction([(0, 1, 0.5, 0, tau)]), shade=False)
        for size, tau in ((2.0, 0.3), (1.5, 0.5))
    ]  # fmt: skip
    rig = aus.Rig(position=(0, 0, 5), fov_y=10, views=1, baseline=0.0)
    options = aus.Options(depth=True, step=step, volume="exact")
    for name in ("reference", engine):
        seen = aus.render_views(aus.Scene(boxes), rig, (9, 9), engine=name, options=options).depth
        assert seen[0, 4, 4] == pytest.approx(4 + np.log(2) / 0.8, abs=2e-3)
