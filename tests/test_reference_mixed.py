"""The reference engine's scenes of meshes, points and volumes: who hides whom, and where rays end."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from autostereo import Display, Material, Mesh, Options, Points, Rig, Scene, ViewMap, Volume
from autostereo import TransferFunction as Transfer
from autostereo.engines.engine import Draw
from autostereo.engines.reference.engine import panel_samples
from autostereo.errors import InputError
from autostereo.render import render, render_views
from autostereo.transforms import rotation, translation
from eye_scenes import FLAT, bumpy_plane, colourful, draw_panel, draw_views, quad
from volume_scenes import SMALL, see

OFFSETS = (np.arange(6) - 2.5) / 4
BLUE, RED = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
TAU = 0.4


def wall(depth, color=BLUE, reach=9.0):
    """An upright wall, coloured."""
    return quad(-reach, reach, -reach, reach, depth, colors=np.tile(color, (4, 1)))


def leaning(color=BLUE):
    """A wall at d = 4 + X/2, wider than the view."""
    corners = [(-6, -9, -1.0), (6, -9, -7.0), (6, 9, -7.0), (-6, 9, -1.0)]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]], colors=np.tile(color, (4, 1)), material=FLAT)


def leaning_depth(camera, offset):
    x = np.tile(np.arange(camera.width) + 0.5, camera.height)
    slope = (x - camera.width / 2) / camera.fx - offset / camera.focal
    return (4 + offset / 2) / (1 - slope / 2)


def stretch(camera, offset):
    """Length of rays per depth (H·W,)."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    a = (x - camera.width / 2) / camera.fx - offset / camera.focal
    b = (camera.height / 2 - y) / camera.fy
    return np.sqrt(1 + a * a + b * b).ravel()


def fog(near, far, color=RED, mode="composite", **fields):
    """A homogeneous volume that fills the view between two depths."""
    values = np.full((4, 3, 3), 5, np.uint8)
    fields = {"transfer": Transfer([(0, *color, TAU)]), "shade": False} | fields
    return Volume(values, (10.0, 10.0, (far - near) / 3), (-10.0, -10.0, -far), mode=mode, **fields)


# --- volumes and meshes ----------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(st.floats(1.0, 9.0), st.floats(-1, 1), st.sampled_from([0.3, 1.0, 1e4]))
def test_a_wall_ends_the_rays_through_a_volume(depth, offset, step):
    """In front of the wall, behind it and around it: T = exp(−τ·length from 3 to the wall, at most to 6)."""
    seen = see([wall(depth), fog(3.0, 6.0)], offset, step=step)
    length = (np.clip(depth, 3.0, 6.0) - 3.0) * stretch(SMALL, offset)
    through = np.exp(-TAU * length)
    np.testing.assert_allclose(seen.color, np.column_stack([1 - through, 0 * through, through]), atol=1e-9)
    np.testing.assert_array_equal(seen.through, 0.0)
    half = 3.0 + np.log(2) / (TAU * stretch(SMALL, offset))
    np.testing.assert_allclose(seen.depth, np.where(half <= min(depth, 6.0), half, depth), rtol=1e-9)


@pytest.mark.parametrize("step", [0.4, 1.0, 1e4])
@pytest.mark.parametrize("offset", [-1.0, 0.0, 0.75])
def test_a_leaning_wall_ends_rays_at_its_own_depth_in_every_view(offset, step):
    seen = see([fog(2.5, 8.0), leaning()], offset, step=step)
    depth = leaning_depth(SMALL, offset)
    through = np.exp(-TAU * (np.clip(depth, 2.5, 8.0) - 2.5) * stretch(SMALL, offset))
    assert np.ptp(through) > 0.3
    np.testing.assert_allclose(seen.color, np.column_stack([1 - through, 0 * through, through]), atol=1e-9)


def test_a_volume_beside_a_mesh_is_over_the_background():
    small = quad(-0.5, 0.5, -0.4, 0.4, 4.0, colors=np.tile(BLUE, (4, 1)))
    color, depth = draw_views(Scene([small, fog(3.0, 6.0)], background=(0.0, 1.0, 0.0)), SMALL, OFFSETS)
    for v, offset in enumerate(OFFSETS):
        hit = np.isfinite(draw_views(small, SMALL, [offset])[1][0]).ravel()
        assert 0 < hit.sum() < hit.size
        through = np.exp(-TAU * np.where(hit, 1.0, 3.0) * stretch(SMALL, offset))[:, None]
        behind = np.where(hit[:, None], (0, 0, 1, 1), (0, 1, 0, 0))
        expected = np.floor(255 * ((1 - through) * (1, 0, 0, 1) + through * behind) + 0.5)
        expected[hit, 3] = 255
        np.testing.assert_array_equal(color[v].reshape(-1, 4), expected)
    assert np.isfinite(depth).all()


def test_light_of_opaque_things_is_clamped_before_it_is_seen_through_a_volume():
    glaring = quad(-9, 9, -9, 9, 7.0, material=Material(ambient=3.0, diffuse=0.0, two_sided=True))
    through = np.exp(-TAU * 3.0 * stretch(SMALL, 0.0))
    np.testing.assert_allclose(see([glaring, fog(3.0, 6.0)]).color[:, 1], through, atol=1e-12)


@pytest.mark.parametrize("offset", [-1.0, 0.5])
def test_isosurface_and_mesh_hide_each_other(offset):
    """The isosurface z = −4 and a wall that leans through it: they meet at X = 0."""
    values = np.broadcast_to(np.arange(7.0)[:, None, None], (7, 3, 3))
    sheet = Volume(values, (10.0, 10.0, 1.0), (-10.0, -10.0, -7.0), mode="iso", iso=3.0, shade=False,
                   transfer=Transfer([(0, *RED, 1)]))  # fmt: skip
    depth = leaning_depth(SMALL, offset)
    for scene in ([sheet, leaning()], [leaning(), sheet]):
        seen = see(scene, offset)
        np.testing.assert_allclose(seen.depth, np.minimum(depth, 4.0), rtol=1e-9)
        sure = np.abs(depth - 4.0) > 1e-9
        np.testing.assert_allclose(seen.color[sure], np.where(depth[:, None] < 4.0, BLUE, RED)[sure], atol=1e-12)


def test_an_isosurface_ends_the_rays_through_another_volume():
    values = np.broadcast_to(np.arange(7.0)[:, None, None], (7, 3, 3))
    sheet = Volume(values, (10.0, 10.0, 1.0), (-10.0, -10.0, -7.0), mode="iso", iso=3.0, shade=False,
                   transfer=Transfer([(0, *BLUE, 1)]))  # fmt: skip
    seen = see([fog(3.0, 6.0), sheet], 0.5)
    through = np.exp(-TAU * 1.0 * stretch(SMALL, 0.5))
    np.testing.assert_allclose(seen.color, np.column_stack([1 - through, 0 * through, through]), atol=1e-9)


@pytest.mark.parametrize(("depth", "value"), [(2.0, None), (5.0, 2.0), (8.0, 3.0)])
def test_maximum_up_to_a_wall_is_put_over_it(depth, value):
    """s grows with depth from 0 at d = 3 to 3 at d = 6; the wall ends it."""
    values = np.broadcast_to(np.arange(3.0, -1, -1)[:, None, None], (4, 3, 3))
    volume = Volume(values, (10.0, 10.0, 1.0), (-10.0, -10.0, -6.0), mode="mip",
                    transfer=Transfer([(0, *RED, 0), (4, *RED, 8)]))  # fmt: skip
    seen = see([volume, wall(depth)], 0.5)
    alpha = 0.0 if value is None else value / 4
    np.testing.assert_allclose(seen.color, np.tile((alpha, 0.0, 1 - alpha), (320, 1)), atol=1e-9)
    np.testing.assert_array_equal(seen.through, 0.0)
    np.testing.assert_allclose(seen.depth, {2.0: 2.0, 5.0: 5.0, 8.0: 6.0}[depth], rtol=1e-9)


def test_maximum_is_put_over_composite_volumes():
    """Also where it lies behind half of their opacity: only opaque things end its rays."""
    volume = fog(5.0, 5.9, BLUE, mode="mip", transfer=Transfer([(0, *BLUE, 1), (5, *BLUE, 3), (9, *BLUE, 4)]))
    for scene in ([volume, fog(3.0, 6.0)], [fog(3.0, 6.0), volume]):
        seen = see(Scene(scene, background=(0.0, 1.0, 0.0)), 0.5)
        through = np.exp(-TAU * 3.0 * stretch(SMALL, 0.5))
        expected = np.column_stack([1 - through, through, 0 * through]) * 0.25 + np.array((0, 0, 0.75))
        np.testing.assert_allclose(seen.color, expected, atol=1e-9)
        np.testing.assert_allclose(seen.through, 0.25 * through, atol=1e-12)


# --- points and the rest ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [-1.0, 0.0, 0.5])
def test_surfel_and_triangle_hide_each_other(offset):
    """A disc in the plane d = 4 and a wall that leans through it."""
    disc = Points([(0, 0, -4.0)], [(0, 0, 1.0)], 1.2, [RED], material=FLAT)
    alone = see(disc, offset).through == 0
    depth = leaning_depth(SMALL, offset)
    sure = np.abs(depth - 4.0) > 1e-9
    for scene in ([disc, leaning()], [leaning(), disc]):
        seen = see(scene, offset)
        front = alone & (depth > 4.0)
        assert front.sum() > 20 and (alone & ~front).sum() > 20
        np.testing.assert_allclose(seen.color[sure], np.where(front[:, None], RED, BLUE)[sure], atol=1e-12)
        np.testing.assert_allclose(seen.depth, np.where(front, 4.0, depth), rtol=1e-9)


def test_surfels_behind_a_mesh_are_not_blended_into_those_before_it():
    """Both are within ε of the nearest; the wall is between them."""
    pair = Points([(0, 0, -4.0), (0, 0, -4.4)], [(0, 0, 1.0)] * 2, 0.8, [RED, (0, 1.0, 0)], material=FLAT)
    middle = slice(150, 151)
    assert see(pair).color[middle, 1] > 0.3
    np.testing.assert_allclose(see([pair, wall(4.2)]).color[middle], [RED], atol=1e-12)
    np.testing.assert_array_equal(see([pair, wall(3.9)]).color[middle], [BLUE])
    np.testing.assert_array_equal(see([pair, wall(4.0)]).color[middle], [BLUE])  # of equally near ones the mesh


def test_a_surfel_ends_the_rays_through_a_volume():
    disc = Points([(0, 0, -4.0)], [(1, 0, 2.0)], 1.2, [BLUE], material=FLAT)
    for offset in (-1.0, 0.75):
        alone = see(disc, offset)
        hit = np.isfinite(alone.depth)
        seen = see([fog(3.0, 6.0), disc], offset)
        length = (np.where(hit, np.clip(alone.depth, 3, 6), 6.0) - 3.0) * stretch(SMALL, offset)
        through = np.exp(-TAU * length)
        assert hit.sum() > 20 and np.ptp(alone.depth[hit]) > 0.3
        np.testing.assert_allclose(seen.color, np.column_stack([1 - through, 0 * hit, through * hit]), atol=1e-9)
        np.testing.assert_allclose(seen.through, np.where(hit, 0.0, through), rtol=1e-9)


# --- everything together ---------------------------------------------------------------------------------------------


def everything():
    rng = np.random.default_rng(5)
    points, faces = bumpy_plane(3, rng, size=1.2)
    mesh = Mesh(points, faces, colors=colourful(len(points)), material=Material(specular=0.4))
    positions = rng.normal(size=(40, 3)) * (0.7, 0.5, 0.6) - (0, 0, 3.8)
    cloud = Points(positions, rng.normal(size=(40, 3)), rng.uniform(0.05, 0.3, 40), rng.random((40, 3)))
    field = ndimage.gaussian_filter(rng.random((10, 11, 12)), 1.2)
    field = (field - field.min()) / np.ptp(field)
    transfer = Transfer([(0.3, 0, 0.5, 1, 0), (0.6, 1, 1, 0, 1.5), (1, 1, 0, 0, 4)])
    place = {"transfer": transfer, "transform": translation(0, 0, -3.9) @ rotation((1, 1, 0), 30)}
    soft = Volume(field, (0.2,) * 3, (-1.1, -1.0, -0.9), **place)
    hard = replace(soft, mode="iso", iso=0.8)
    bright = replace(soft, mode="mip", transform=soft.transform @ translation(0.5, 0, 0))
    return mesh, cloud, soft, hard, bright


def test_the_order_of_objects_does_not_matter():
    objects = everything()
    expected = draw_views(Scene(objects, background=(0.1, 0.2, 0.3)), SMALL, OFFSETS[:2])
    assert np.ptp(expected[0][..., :3]) > 150
    for order in list(permutations(range(5)))[7::23]:
        color, depth = draw_views(Scene([objects[k] for k in order], background=(0.1, 0.2, 0.3)), SMALL, OFFSETS[:2])
        np.testing.assert_array_equal(color, expected[0])
        np.testing.assert_array_equal(depth, expected[1])


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("flip", [(False, False), (True, True)])
def test_panel_is_the_gathered_views(flip, samples):
    scene = Scene(everything(), background=(0.1, 0.2, 0.3))
    viewmap = ViewMap(6, a=0.25, b=0.125, offsets=np.array([[0.0, 0.0625, 0.5]]), continuous=True)
    draw = Draw(SMALL, OFFSETS, (-1, 1), viewmap, *flip, options=Options(samples=samples))
    panel = draw_panel(scene, draw)
    v = panel_samples(draw).v[..., 0]
    offsets, index = np.unique(v, return_inverse=True)
    views, _ = draw_views(scene, SMALL, offsets, samples=samples)
    rows, columns, channels = np.ogrid[:16, :20, :3]
    expected = views[index.reshape(v.shape), rows, columns, channels]
    np.testing.assert_array_equal(panel, expected[:: -1 if flip[1] else 1, :: -1 if flip[0] else 1])


def test_averaged_alpha_keeps_what_is_opaque():
    """Without a composite volume there is nothing to average."""
    mesh, cloud, _, hard, bright = everything()
    viewmap = ViewMap(6, a=0.2, b=-0.07, offsets=np.array([[0.1, 0.17, 0.24]]))
    draw = Draw(SMALL, OFFSETS, (-1, 1), viewmap)
    averaged = replace(draw, options=Options(alpha="averaged"))
    scene = Scene([mesh, cloud, hard, bright])
    np.testing.assert_array_equal(draw_panel(scene, draw), draw_panel(scene, averaged))
    scene = Scene(everything())
    assert (draw_panel(scene, draw) != draw_panel(scene, averaged)).any()


def test_every_method_draws_the_same_through_the_front_door():
    scene = Scene(everything(), background=(0.1, 0.2, 0.3))
    rig = Rig(position=(0, 0, 0), target=(0, 0, -4), views=8)
    options = Options(depth=True)
    stacks = [render_views(scene, rig, (24, 20), method=m, engine="reference", options=options)
              for m in ("single-pass", "n-pass")]  # fmt: skip
    np.testing.assert_array_equal(stacks[0].color, stacks[1].color)
    np.testing.assert_array_equal(stacks[0].depth, stacks[1].depth)
    display = Display.wavelength_selective(24, 20)
    panels = [render(scene, display, rig, method=m, engine="reference").pixels for m in ("single-pass", "n-pass")]
    assert np.ptp(panels[0]) > 150
    np.testing.assert_array_equal(panels[0], panels[1])
    subsampled = render(scene, display, rig, method="n-pass-subres", engine="reference").pixels
    assert subsampled.shape == panels[0].shape and np.ptp(subsampled) > 50


@pytest.mark.parametrize("engine", ["reference", "cpu"])
def test_small_views_are_of_the_size_asked_for(engine):
    """Views of the panel's own size lose nothing; of one pixel, all there was; the default divides by √V."""
    scene, display = Scene((leaning(), wall(3, RED, 0.5))), Display.lenticular(24, 20, 4)
    rig = Rig(position=(0, 0, 0), target=(0, 0, -4), views=4)

    def panel(method="n-pass-subres", **options):
        return render(scene, display, rig, method=method, engine=engine, options=Options(**options)).pixels

    np.testing.assert_array_equal(panel(small_size=(24, 20)), panel("n-pass"))
    np.testing.assert_array_equal(panel(small_size=(12, 10)), panel())
    assert np.ptp(panel(small_size=(1, 1))) <= np.ptp(panel(small_size=(6, 5)))
    with pytest.raises(InputError, match="small_size: expected at most the panel's 24×20, got 25×1"):
        panel(small_size=(25, 1))
    for wrong in ((0, 4), (4,), [4, 0], (4, 4.0), 4, (True, 4)):
        with pytest.raises(InputError, match="small_size: expected two whole numbers ≥ 1"):
            Options(small_size=wrong)
