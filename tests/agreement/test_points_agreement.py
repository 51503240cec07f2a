"""Every engine draws points like the reference; its single pass is its n passes, and its panels are its views."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import autostereo as aus
from autostereo.scene.samples import surfel_cloud
from autostereo.transforms import rotation, translation

from .helpers import engines_for, need
from .volume_cases import BACKGROUND, DISCRETE, DISPLAYS, LIGHTS, SIZE, H, W, assert_alike, panel, random, rigs, views

pytestmark = pytest.mark.parametrize("engine", engines_for(aus.Points))
SHADINGS = st.sampled_from(["exact", "center"])


@st.composite
def clouds(draw):
    """Surfels of every size and slant about the origin, with and without normals, some of them at one place."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.sampled_from([1, 2, 20, 80]))
    positions = rng.normal(0, 0.5, (count, 3))
    if draw(st.booleans()):
        positions[count // 2 :] = positions[0]
    normals = rng.normal(size=(count, 3)) * draw(st.sampled_from([(1, 1, 1), (1, 1, 0.1)]))
    sizes = draw(st.sampled_from([(0.05, 0.4), (1e-5, 0.05), (0.5, 30.0)]))
    fields = {"normals": None if draw(st.booleans()) else normals, "colors": rng.random((count, 3))}
    if draw(st.booleans()):
        stretch = np.diag([*rng.uniform(0.5, 1.5, 3), 1.0])
        turn = rotation(rng.normal(size=3), float(rng.uniform(0, 360)))
        fields["transform"] = translation(*rng.normal(0, 0.2, 3)) @ turn @ stretch
    material = aus.Material(0.2, 0.7, draw(st.sampled_from([0.0, 0.4])), 12.0)
    radii = np.exp(rng.uniform(*np.log(sizes), count))
    return aus.Points(positions, radii=radii, material=material, **fields)


@st.composite
def scenes(draw):
    """One or two clouds, under the default light or others."""
    parts = draw(st.lists(clouds(), min_size=1, max_size=2))
    return aus.Scene(parts, draw(st.sampled_from([None, LIGHTS])), BACKGROUND)


@given(scenes(), rigs(), SHADINGS, st.sampled_from([1, 4]))
@random(30)
def test_views_are_those_of_the_reference(engine, scene, rig, shading, count):
    need(engine)
    options = {"shading": shading, "samples": count, "depth": True}
    expected, found = (views(scene, rig, e, **options) for e in ("reference", engine))
    assert_alike(found.color, expected.color, share=0.01)
    same = np.isfinite(found.depth) == np.isfinite(expected.depth)
    both = np.isfinite(found.depth) & np.isfinite(expected.depth)
    off = np.abs(found.depth[both] - expected.depth[both]) > 1e-3 * expected.depth[both]
    assert (~same).mean() <= 0.01 and off.sum() <= 0.01 * same.size


@given(
    scenes(), rigs(), st.sampled_from(list(DISPLAYS)), st.sampled_from(["pixel", "subpixel"]), st.sampled_from([1, 4])
)
@random(30)
def test_panels_are_those_of_the_reference(engine, scene, rig, name, sampling, count):
    need(engine)
    display, options = DISPLAYS[name], {"sampling": sampling, "samples": count}
    rig = rig.with_views(display.views)
    expected, found = (panel(scene, display, rig, e, **options) for e in ("reference", engine))
    assert_alike(found, expected)


@given(scenes(), rigs(), st.sampled_from(DISCRETE), SHADINGS, st.sampled_from([1, 1, 4]))
@random(25)
def test_one_pass_is_many_bit_for_bit(engine, scene, rig, name, shading, count):
    need(engine)
    display, options = DISPLAYS[name], {"shading": shading, "samples": count}
    rig = rig.with_views(display.views)
    one = views(scene, rig, engine, depth=True, **options)
    many = views(scene, rig, engine, method="n-pass", depth=True, **options)
    np.testing.assert_array_equal(one.color, many.color)
    np.testing.assert_array_equal(one.depth, many.depth)
    found = panel(scene, display, rig, engine, **options)
    np.testing.assert_array_equal(found, aus.interlace(many, display).pixels)
    np.testing.assert_array_equal(found, panel(scene, display, rig, engine, method="n-pass", **options))


@given(clouds(), st.floats(0.2, 1.5), st.integers(1, 7))
@random(25)
def test_cameras_that_all_stand_to_one_side(engine, cloud, first, count):
    """The centre camera, which none of them is, may see the other side of a disc."""
    need(engine)
    rig = aus.Rig(position=(0, 0, 3), fov_y=40, near=0.05, offsets=tuple(first + 0.3 * np.arange(count)), views=count)
    for side in (1, -1):
        mirrored = replace(rig, offsets=tuple(np.sort(side * np.array(rig.offsets))))
        for shading in ("exact", "center"):
            expected, found = (views(cloud, mirrored, e, shading=shading).color for e in ("reference", engine))
            assert_alike(found, expected, share=0.01)


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (30, 1), (2, 3), (257, 2)])
def test_pictures_of_any_size(engine, size):
    need(engine)
    rng = np.random.default_rng(2)
    content = aus.Points(rng.normal(0, 0.5, (60, 3)), rng.normal(size=(60, 3)), 0.2, rng.random((60, 3)))
    rig = aus.Rig(position=(0, 0, 3), fov_y=36, views=9, baseline=0.6)
    expected, found = (views(content, rig, e, size).color for e in ("reference", engine))
    assert_alike(found, expected)
    display = aus.Display.slanted(*size, 9, lens_pitch=5.7, subpixel_pitch=1.0, slant_deg=9.46)
    panels = [panel(content, display, rig, e) for e in ("reference", engine)]
    assert_alike(panels[1], panels[0])


def test_any_number_of_views(engine):
    need(engine)
    content = surfel_cloud(600)
    for count in (1, 2, 3, 17, 100):
        rig = aus.Rig(position=(0, 0, 4), fov_y=36, views=count, baseline=0.8)
        one = views(content, rig, engine, depth=True)
        many = views(content, rig, engine, method="n-pass", depth=True)
        assert one.color.shape == (count, H, W, 4)
        np.testing.assert_array_equal(one.color, many.color)
        np.testing.assert_array_equal(one.depth, many.depth)


# --- closed forms ----------------------------------------------------------------------------------------------------


@given(
    st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(2, 8), st.floats(0.1, 1.5), st.sampled_from([None, (0, 0, 1)])
)
@random(25)
def test_positions_of_a_point_over_all_views_sum_to_that_of_the_centre(engine, x, y, d, baseline, normal):
    """Cameras stand evenly about the middle, so the mean of a disc's places is its place for the centre camera."""
    need(engine)
    size, rig = (301, 201), aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=40, views=8, baseline=baseline)
    disc = aus.Points([(x * d / 4, y * d / 4, -d)], None if normal is None else [normal], 0.05 * d)
    seen = views(disc, rig, engine, size).color[..., 3] > 0
    columns, rows = np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5
    area = seen.sum(axis=(1, 2))
    assert (area > 100).all() and not seen[:, :, [0, -1]].any()
    at_x, at_y = (seen * columns).sum(axis=(1, 2)) / area, (seen * rows[:, None]).sum(axis=(1, 2)) / area
    f = size[1] / 2 / np.tan(np.deg2rad(20))
    place = size[0] / 2 + f * x / 4 + f * rig.camera_offsets * (1 / 4 - 1 / d)
    np.testing.assert_allclose(at_x, place, atol=0.25)
    np.testing.assert_allclose(at_x.sum(), 8 * (size[0] / 2 + f * x / 4), atol=0.8)
    np.testing.assert_allclose(at_y, size[1] / 2 - f * y / 4, atol=0.25)


def test_a_closed_cloud_has_no_dark_hairlines_for_outer_eyes(engine):
    """Discs at the rim, of which only outer eyes see the outside, are lit there: the ball looks like a sphere."""
    need(engine)
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    white = aus.Material(0.0, 1.0)
    ball = aus.Points(normals, normals, 0.12, np.ones((4000, 3)), material=white)
    rig = aus.Rig(position=(0, 0, 4), fov_y=40, views=5, baseline=4.0)
    light = aus.DirectionalLight((-1, 0, -0.2))  # from the right, where the rightmost camera sees more than the centre
    seen = views(aus.Scene(ball, light), rig, engine, (120, 90))
    rightmost = seen.color[-1]
    x, y = np.meshgrid(np.arange(120) + 0.5 - 60, 45 - np.arange(90) - 0.5)
    f = 45 / np.tan(np.deg2rad(20))
    eye, way = np.array([2.0, 0, 4.0]), np.stack([x / f - 0.5, y / f, -np.ones_like(x)], axis=-1)
    along = (way @ eye) / (way**2).sum(axis=-1)
    inside = (eye @ eye) - along**2 * (way**2).sum(axis=-1)  # squared distance of the ray from the centre
    root = np.sqrt(np.maximum(1 - inside, 0) / (way**2).sum(axis=-1))
    normal = eye + (-along - root)[..., None] * way
    lit = 255 * np.clip(normal @ (np.array([1, 0, 0.2]) / np.hypot(1, 0.2)), 0, 1)
    sure = inside < 0.9
    assert sure.sum() > 1000
    assert np.abs(rightmost[sure][:, 0] - lit[sure]).max() <= 25


# --- odd clouds ------------------------------------------------------------------------------------------------------


def test_clouds_of_one_point_and_of_equal_points(engine):
    need(engine)
    rig = aus.Rig(position=(0, 0, 3), fov_y=36, views=3, baseline=0.5)
    one = aus.Points([(0.1, 0.2, 0)], radii=0.3, colors=[(1.0, 0, 0)])
    many = aus.Points(np.tile((0.1, 0.2, 0.0), (50, 1)), radii=0.3, colors=np.tile((1.0, 0, 0), (50, 1)))
    first, second = (views(p, rig, engine).color for p in (one, many))
    assert first.any()
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("radius", [1e-30, 1e-3, 0.002])
def test_points_without_normals_are_seen_however_small(engine, radius):
    need(engine)
    rng = np.random.default_rng(3)
    rig = aus.Rig(position=(0, 0, 3), fov_y=36, views=5, baseline=0.5)
    for position in rng.uniform(-0.4, 0.4, (12, 3)):
        dot = aus.Points([position], radii=radius)
        expected, found = (views(dot, rig, e).color for e in ("reference", engine))
        count = (found[..., 3] > 0).sum(axis=(1, 2))
        assert ((count >= 1) & (count <= 4)).all()
        assert_alike(found, expected, share=2e-3)


def test_updates_of_a_renderer(engine):
    need(engine)
    content = surfel_cloud(500)
    rig = aus.Rig(position=(0, 0, 4), fov_y=36, views=3, baseline=0.6)
    renderer = aus.Renderer(content, engine=engine)
    renderer.render_views(rig, SIZE)
    turned = rotation((0, 1, 0), 50)
    renderer.update(transform=turned)
    found = renderer.render_views(rig, SIZE).color
    np.testing.assert_array_equal(found, views(replace(content, transform=turned), rig, engine).color)
