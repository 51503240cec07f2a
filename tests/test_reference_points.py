"""The reference engine's surfels against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from autostereo import DirectionalLight, Material, Options, PointLight, Points, Rig, Scene, ViewMap
from autostereo.engines.engine import Draw
from autostereo.engines.reference import points as reference
from autostereo.engines.reference.engine import panel_samples, view_samples
from autostereo.engines.reference.mesh import project
from autostereo.engines.reference.picture import look
from autostereo.engines.reference.points import Surfels
from autostereo.render import render_views
from autostereo.transforms import apply, rotation, scaling, translation
from eye_scenes import CAMERA, EYE, FLAT, draw_panel, draw_views, engine

SMALL = replace(CAMERA, fx=20.0, fy=24.0, width=20, height=16)
OFFSETS = (np.arange(6) - 2.5) / 4


def surfels(positions, normals=None, radii=1.0, **fields):
    return Points(np.atleast_2d(positions), None if normals is None else np.atleast_2d(normals), radii,
                  **({"material": FLAT} | fields))  # fmt: skip


def see(scene, offset=0.0, camera=CAMERA, **options):
    """What a view sees, unquantised, one sample a pixel."""
    return look(engine.prepare(Scene.of(scene)), view_samples(camera, offset, 1), camera, Options(**options))


def disc_homography(position, normal, radius, camera, offset):
    """Matrix from (s, t, 1), s² + t² ≤ 1 on the disc, to homogeneous picture positions: DESIGN section 1 in columns."""
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    second = np.cross(normal, first) / np.linalg.norm(normal)
    columns = np.column_stack([radius * first, radius * second, position])  # world; d = −z
    columns[:, 2] -= (offset, camera.offset_y, 0.0)
    X, Y, d = columns * [[1], [1], [-1]]
    cx = camera.width / 2 + camera.fx * offset / camera.focal
    cy = camera.height / 2 - camera.fy * camera.offset_y / camera.focal
    return np.array([camera.fx * X + cx * d, -camera.fy * Y + cy * d, d])


def disc_coordinates(position, normal, radius, camera, offset):
    """(s, t) (H·W, 2) on the disc and depth (H·W,) where the rays of all pixels meet its plane."""
    matrix = disc_homography(np.asarray(position, float), np.asarray(normal, float), radius, camera, offset)
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    h = np.linalg.solve(matrix, np.stack([x.ravel(), y.ravel(), np.ones(x.size)]))
    return (h[:2] / h[2]).T, 1 / h[2]  # the last row of the matrix makes 1/h₂ the depth


def narrowest(position, normal, radius, camera, offset):
    """Least width in pixels of a disc's projected outline, measured over all directions."""
    turn = np.linspace(0, 2 * np.pi, 2001)
    matrix = disc_homography(np.asarray(position, float), np.asarray(normal, float), radius, camera, offset)
    h = matrix @ np.stack([np.cos(turn), np.sin(turn), np.ones_like(turn)])
    direction = np.stack([np.cos(turn[:1000]), np.sin(turn[:1000])])
    return np.ptp((h[:2] / h[2]).T @ direction, axis=0).min()


unit_vectors = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.15, 1))

# --- one surfel ----------------------------------------------------------------------------------------------------


@settings(max_examples=50, deadline=None)
@given(unit_vectors, st.floats(-1, 1), st.floats(0.3, 1.2), st.sampled_from([2.5, 4.0, 7.0]), st.booleans())
def test_outline_is_the_projected_disc_in_every_view(normal, offset, radius, depth, behind):
    camera = replace(CAMERA, offset_y=0.3, fy=50.0)
    position = np.array((0.2, -0.1, -depth))
    color = np.array((0.25, 0.5, 0.75))
    assume(narrowest(position, normal, radius, camera, offset) > 1.1)
    disc = surfels(position, normal if behind else -np.array(normal), radius, colors=[color])
    seen = see(disc, offset, camera)
    place, hit_depth = disc_coordinates(position, normal, radius, camera, offset)
    rho = np.sum(place**2, axis=1)
    inside = (rho < 1) & (hit_depth > 0)
    sure = (np.abs(rho - 1) > 1e-9) & (np.abs(hit_depth - camera.near) > 1e-9)
    covered = inside & (hit_depth >= camera.near)
    np.testing.assert_array_equal(seen.through[sure] == 0, covered[sure])
    np.testing.assert_allclose(seen.depth[sure], np.where(covered, hit_depth, np.inf)[sure], rtol=1e-9)
    np.testing.assert_allclose(seen.color[sure & covered], np.tile(color, ((sure & covered).sum(), 1)), atol=1e-12)


@pytest.mark.parametrize(("depth", "pixels_per_view"), [(8.0, 2), (4.0, 0), (2.0, -4)])
def test_surfel_without_a_normal_is_a_circle_that_moves_by_the_disparity(depth, pixels_per_view):
    color, found = draw_views(surfels((0.01, 0.02, -depth), radii=depth / 64 * 7.3), offsets=(np.arange(5) - 2) / 4)
    x, y = project(CAMERA, np.array((0.01, 0.02, depth)), 0.0)
    rows, columns = np.mgrid[0.5:48, 0.5:64]
    circle = (columns - x) ** 2 + (rows - y) ** 2 < 7.3**2
    np.testing.assert_array_equal(color[2, ..., 3] == 255, circle)
    np.testing.assert_array_equal(found[2], np.where(circle, depth, np.inf).astype(np.float32))
    for i in range(5):
        np.testing.assert_array_equal(color[i], np.roll(color[2], (i - 2) * pixels_per_view, axis=1))


def test_surfels_move_with_their_transform():
    rng = np.random.default_rng(1)
    position, normal = rng.normal(size=(30, 3)) * 0.5, rng.normal(size=(30, 3))
    colors = rng.random((30, 3))
    turn = translation(0.1, 0, -4) @ rotation((1, 2, 3), 70) @ scaling(1.5)
    moved = surfels(position, normal, 0.1, colors=colors, transform=turn)
    baked = surfels(apply(turn, position), normal @ turn[:3, :3].T, 0.15, colors=colors)
    first, second = (draw_views(p, offsets=(-0.5, 0.5)) for p in (moved, baked))
    assert 0.05 < (first[0][..., 3] > 0).mean() < 0.9
    assert (first[0] != second[0]).any(axis=-1).mean() < 1e-3


def test_surfels_in_front_of_the_near_plane_are_dropped():
    camera = replace(CAMERA, near=2.0)
    assert not draw_views(surfels((0, 0, -1.99), radii=0.5), camera)[0].any()
    assert draw_views(surfels((0, 0, -2.01), radii=0.5), camera)[0].any()
    leaning = surfels((0, 0, -2.1), (1, 0, 1), 1.0)  # reaches before the near plane, which cuts it
    _, depth = draw_views(leaning, camera)
    place, expected = disc_coordinates((0, 0, -2.1), (1, 0, 1), 1.0, camera, 0.0)
    covered = (np.sum(place**2, axis=1) < 1) & (expected >= 2.0)
    assert (expected[np.sum(place**2, axis=1) < 1] < 2.0).any()
    np.testing.assert_array_equal(np.isfinite(depth).ravel(), covered)


# --- small and thin ones ---------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1, 1), st.sampled_from([None, (0, 0, 1), (3, 1, 1)]))
def test_the_smallest_surfel_is_a_dot(x, y, offset, normal):
    """However small, it is a circle of radius 0.71: it holds one to four pixel centres."""
    dot = surfels((x, y, -5.0), normal, 1e-6)
    seen = see(dot, offset)
    rows, columns = np.mgrid[0.5:48, 0.5:64]
    px, py = project(CAMERA, np.array((x, y, 5.0)), offset)
    square = ((columns - px) ** 2 + (rows - py) ** 2).ravel()
    np.testing.assert_array_equal(seen.through == 0, square < 0.71**2)
    assert 1 <= (seen.through == 0).sum() <= 4
    np.testing.assert_array_equal(seen.depth[square < 0.71**2], 5.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-1, 1))
def test_thin_means_less_than_a_pixel_wide(seed, offset):
    rng = np.random.default_rng(seed)
    camera = replace(CAMERA, fy=40.0)
    position = rng.uniform((-1, -1, -6), (1, 1, -3))
    normal = rng.normal(size=3) * (1, 1, rng.choice([0.1, 1.0]))
    normal /= np.linalg.norm(normal)
    radius = rng.uniform(0.005, 0.15)
    width = narrowest(position, normal, radius, camera, offset)
    centre = apply(EYE, position) - (offset, 0, 0)
    found = reference.is_thin(centre[None], apply(EYE, normal)[None], np.array([radius]), camera)[0]
    if abs(width - 1) > 0.02:  # the projection of the disc's middle is taken for all of it
        assert found == (width < 1)


def test_an_edge_on_disc_turns_to_the_camera_in_those_views_that_see_its_edge():
    disc = surfels((0.0, 0.0, -4.0), (1, 0, 0), 0.5)
    narrow = see(disc, 0.0)
    rows, columns = np.mgrid[0.5:48, 0.5:64]
    circle = ((columns - 32) ** 2 + (rows - 24) ** 2 < 8**2).ravel()
    np.testing.assert_array_equal(narrow.through == 0, circle)
    np.testing.assert_array_equal(narrow.depth[circle], 4.0)
    beside = see(disc, 1.0)
    place, _ = disc_coordinates((0, 0, -4), (1, 0, 0), 0.5, CAMERA, 1.0)
    np.testing.assert_array_equal(beside.through == 0, np.sum(place**2, axis=1) < 1)
    assert 0 < (beside.through == 0).sum() < circle.sum()


# --- blending --------------------------------------------------------------------------------------------------------


def pair_colors(first, second, radii, offset, normals=((0, 0, 1), (0, 0, 1))):
    """Colour and weights (H·W, 2) of a red and a green disc."""
    both = surfels([first, second], normals, radii, colors=[(1.0, 0, 0), (0, 1.0, 0)])
    weights = [
        np.maximum(1 - np.sum(disc_coordinates(p, n, r, CAMERA, offset)[0] ** 2, axis=1), 0.0)
        for p, n, r in zip((first, second), normals, radii, strict=True)
    ]
    return see(both, offset), np.stack(weights, axis=1)


@pytest.mark.parametrize("offset", [-1.0, 0.0, 0.5])
@pytest.mark.parametrize("gap", [0.0, 0.39, -0.29])
def test_overlapping_surfels_are_blended_by_their_weights(gap, offset):
    """Neither is further behind the other than by its own radius: both count wherever they are."""
    seen, weight = pair_colors((-0.1, 0.0, -4.0), (0.15, 0.1, -4.0 - gap), (0.3, 0.4), offset)
    total = weight.sum(axis=1)
    covered = total > 0
    assert ((weight > 0).all(axis=1)).sum() > 20
    np.testing.assert_array_equal(seen.through == 0, covered)
    np.testing.assert_allclose(seen.color[covered, :2], (weight[covered] / total[covered, None]), atol=1e-9)
    near = np.minimum(np.where(weight[:, 0] > 0, 4.0, np.inf), np.where(weight[:, 1] > 0, 4.0 + gap, np.inf))
    np.testing.assert_allclose(seen.depth, near, rtol=1e-12)


@pytest.mark.parametrize("offset", [-1.0, 0.5])
def test_a_surfel_further_behind_than_its_own_radius_is_hidden(offset):
    seen, weight = pair_colors((-0.1, 0.0, -4.0), (0.15, 0.1, -4.41), (0.8, 0.4), offset)
    red, green = weight.T
    np.testing.assert_array_equal(seen.color[red > 0, :2], np.tile((1.0, 0.0), ((red > 0).sum(), 1)))
    alone = (green > 0) & (red == 0)
    np.testing.assert_array_equal(seen.color[alone, :2], np.tile((0.0, 1.0), (alone.sum(), 1)))
    swapped, weight = pair_colors((-0.1, 0.0, -4.0), (0.15, 0.1, -4.41), (0.3, 0.8), offset)  # now ε is 0.8
    both = (weight > 0).all(axis=1)
    assert both.sum() > 20 and (swapped.color[both, :2] > 0).all()


def test_visibility_is_decided_where_rays_meet_the_discs():
    """Two discs cross like an X: each is in front on its side, the rest within ε is blended."""
    seen, weight = pair_colors((0, 0, -4.0), (0, 0, -4.0), (0.5, 0.5), 0.25, ((1, 0, 1), (-1, 0, 1)))
    both = (weight > 0).all(axis=1)
    depth = [disc_coordinates((0, 0, -4), n, 0.5, CAMERA, 0.25)[1] for n in ((1, 0, 1), (-1, 0, 1))]
    np.testing.assert_allclose(seen.depth[both], np.minimum(*depth)[both], rtol=1e-9)
    hidden = np.abs(depth[0] - depth[1]) > 0.5
    assert (both & hidden).any() and (both & ~hidden).any()
    for k in (0, 1):
        expected = np.where(hidden, depth[k] < depth[1 - k], weight[:, k] / np.maximum(weight.sum(axis=1), 1e-300))
        np.testing.assert_allclose(seen.color[both, k], expected[both], atol=1e-9)


def test_colours_of_several_clouds_are_blended_together():
    rng = np.random.default_rng(2)
    positions, normals = rng.normal(size=(40, 3)) * 0.5 - (0, 0, 4), rng.normal(size=(40, 3))
    colors, radii = rng.random((40, 3)), rng.uniform(0.1, 0.5, 40)
    one = surfels(positions, normals, radii, colors=colors)
    two = [surfels(positions[k], normals[k], radii[k], colors=colors[k]) for k in (slice(0, 25), slice(25, 40))]
    for offset in (-0.5, 0.5):
        first, second = see(one, offset), see(two, offset)
        np.testing.assert_allclose(first.color, second.color, atol=1e-12)
        np.testing.assert_array_equal(first.depth, second.depth)


# --- light -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shading", ["exact", "center", "reuse"])
@pytest.mark.parametrize("turned", [False, True])
def test_surfels_are_lit_once_at_their_centres_on_the_side_of_the_viewer(shading, turned):
    material = Material(0.1, 0.6, 0.7, 12.0)
    lights = [PointLight((0.5, 1.0, 1.0), (0.9, 0.5, 0.1)), DirectionalLight((0.3, 0.1, -2), (0.2, 0.3, 0.4)),
              DirectionalLight((1, 0, 0.9))]  # fmt: skip
    position, normal, kd = np.array((0.3, -0.2, -4.0)), np.array((0.6, 0.1, 1.0)), np.array((0.9, 0.5, 0.25))
    normal /= np.linalg.norm(normal)
    disc = surfels(position, -normal if turned else normal, 0.4, colors=[kd], material=material)
    for offset in (-1.0, 0.75):
        seen = see(Scene(disc, lights), offset, shading=shading)
        viewer = np.array((0.0 if shading == "center" else offset, 0, 0))
        expected = kd * 0.1
        for light in lights:
            place = isinstance(light, PointLight)
            towards = np.array(light.position) - position if place else -np.array(light.direction)
            towards = towards / np.linalg.norm(towards)
            view = (viewer - position) / np.linalg.norm(viewer - position)
            half = (towards + view) / np.linalg.norm(towards + view)
            if normal @ towards > 0:
                expected = expected + kd * 0.6 * (normal @ towards) * light.color
                expected = expected + 0.7 * max(normal @ half, 0.0) ** 12 * np.array(light.color)
        covered = seen.through == 0
        assert covered.sum() > 50
        found = seen.color[covered]
        np.testing.assert_allclose(found, np.broadcast_to(np.clip(expected, 0, 1), found.shape), atol=1e-12)


@pytest.mark.parametrize("shading", ["exact", "center"])
def test_every_eye_sees_its_own_side_lit(shading):
    """The centre camera sees a disc from its left, where it is lit; a camera to the right of it sees the dark side.

    Unless all eyes are to see what the centre camera does.
    """
    normal = np.array((-1.0, 0.0, 0.2)) / np.hypot(1.0, 0.2)
    disc = surfels((0.5, 0.0, -4.0), normal, 0.8, colors=[(1.0, 1.0, 1.0)], material=Material(0.0, 1.0))
    light = DirectionalLight(tuple(-normal))
    for offset in (0.0, 2.0):
        assert np.sign(normal @ (np.array((offset, 0, 0)) - (0.5, 0, -4))) == (1 if offset == 0 else -1)
        seen = see(Scene(disc, [light]), offset, shading=shading)
        assert (seen.through == 0).any()
        bright = 1.0 if offset == 0 or shading == "center" else 0.0
        np.testing.assert_allclose(seen.color[seen.through == 0], bright, atol=1e-12)


# --- panels, samples, passes -----------------------------------------------------------------------------------------


def cloud(seed=3, count=60, **fields):
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(count, 3)) * (0.7, 0.5, 1.0) - (0, 0, 4)
    return surfels(positions, rng.normal(size=(count, 3)), rng.uniform(0.01, 0.4, count), colors=rng.random((count, 3)),
                   **({"material": Material(specular=0.4)} | fields))  # fmt: skip


@pytest.mark.parametrize("flip", [(False, False), (True, True)])
@pytest.mark.parametrize("continuous", [False, True])
def test_panel_is_the_gathered_views(flip, continuous):
    viewmap = ViewMap(6, a=0.25, b=0.125, offsets=np.array([[0.0, 0.0625, 0.5]]), continuous=continuous)
    draw = Draw(SMALL, OFFSETS, (-1, 1), viewmap, *flip)
    panel = draw_panel(Scene(cloud(), background=(0.1, 0.2, 0.3)), draw)
    v = panel_samples(draw).v[..., 0]
    offsets, index = np.unique(v, return_inverse=True)
    views, _ = draw_views(Scene(cloud(), background=(0.1, 0.2, 0.3)), SMALL, offsets)
    rows, columns, channels = np.ogrid[:16, :20, :3]
    expected = views[index.reshape(v.shape), rows, columns, channels]
    np.testing.assert_array_equal(panel, expected[:: -1 if flip[1] else 1, :: -1 if flip[0] else 1])


def test_samples_are_a_finer_picture_averaged():
    # how small and thin discs are drawn depends on the size of pixels: these are neither
    large = replace(cloud(), normals=cloud().normals * (0.3, 0.3, 0) + (0, 0, 1), radii=np.full(60, 0.4))
    fine = replace(SMALL, fx=40.0, fy=48.0, width=40, height=32)
    color, depth = draw_views(large, SMALL, OFFSETS[:2], samples=4)
    full, full_depth = draw_views(large, fine, OFFSETS[:2])
    blocks = full.reshape(2, 16, 2, 20, 2, 4)
    np.testing.assert_array_equal(color, (blocks.sum(axis=(2, 4), dtype=int) + 2) // 4)
    np.testing.assert_array_equal(depth, full_depth.reshape(2, 16, 2, 20, 2).min(axis=(2, 4)))


def test_pictures_do_not_depend_on_how_much_is_held_at_a_time(monkeypatch):
    draw = Draw(SMALL, OFFSETS, (-1, 1), ViewMap(6, a=0.2, b=-0.07, offsets=np.array([[0.1, 0.17, 0.24]])))
    first = (*draw_views(cloud(), SMALL), draw_panel(cloud(), draw))
    monkeypatch.setattr(reference, "PAIRS", 50)
    for a, b in zip((*draw_views(cloud(), SMALL), draw_panel(cloud(), draw)), first, strict=True):
        np.testing.assert_array_equal(a, b)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_pixel_that_a_surfel_touches_is_left_out(seed):
    """Against all pairs of surfels and samples, with surfels of all sizes, also around the cameras."""
    rng = np.random.default_rng(seed)
    positions = rng.normal((0, 0, -2), (1, 1, 2), (20, 3))
    points = surfels(positions, rng.normal(size=(20, 3)), rng.choice([0.001, 0.3, 3.0], 20))
    prepared = Surfels.of(points).in_eye_space(SMALL)
    samples = view_samples(SMALL, rng.uniform(-1, 1), 4)
    found = reference.find_splats(prepared, SMALL, samples)
    count, size = len(prepared.radii), samples.x.size
    surfel, sample = np.repeat(np.arange(count), size), np.tile(np.arange(size), count)
    at = (a.ravel()[sample] for a in (samples.x, samples.y, samples.v))
    depth, weight = reference.intersect(prepared.take(surfel), SMALL, *at)
    hit = weight > 0
    order = np.lexsort([found.sample, found.surfel])
    np.testing.assert_array_equal(found.surfel[order], surfel[hit])
    np.testing.assert_array_equal(found.sample[order], sample[hit])
    np.testing.assert_array_equal(found.depth[order], depth[hit])


def test_n_pass_gives_the_same_views():
    rig = Rig(position=(0, 0, 0), target=(0, 0, -4), views=3)
    stacks = [
        render_views(cloud(), rig, (24, 20), method=method, engine="reference", options=Options(depth=True))
        for method in ("single-pass", "n-pass")
    ]
    np.testing.assert_array_equal(stacks[0].color, stacks[1].color)
    np.testing.assert_array_equal(stacks[0].depth, stacks[1].depth)


def test_a_cloud_out_of_sight_is_nothing():
    color, depth = draw_views(surfels((0, 0, 3.0)))
    assert not color.any() and np.isinf(depth).all()
    assert not draw_views(surfels((50.0, 0, -4.0)))[0].any()
