"""The reference engine against closed forms. It is the specification: nothing here compares it with an engine."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo import DirectionalLight, Material, Mesh, Options, Rig, Scene, ViewMap
from autostereo.engines.engine import Camera, Draw
from autostereo.engines.reference.engine import view_samples
from autostereo.engines.reference.mesh import edge_functions, project, trace
from autostereo.transforms import apply, rotation, scaling, translation
from autostereo.viewmap import offset_at
from eye_scenes import CAMERA, EYE, FLAT, bumpy_plane, colourful, draw_panel, draw_views, engine, quad

# --- projection ------------------------------------------------------------------------------------


def test_plane_at_the_focal_distance_is_the_same_in_all_views():
    color, depth = draw_views(quad(-1, 1, -1, 1, 4.0, colors=colourful(4)), offsets=np.arange(-4, 5) / 8)
    assert len(np.unique(color[0].reshape(-1, 4), axis=0)) > 100
    assert (color == color[0]).all() and (depth == depth[0]).all()
    assert set(np.unique(depth)) == {4.0, np.inf}


@pytest.mark.parametrize(("depth", "pixels_per_view"), [(8.0, 2), (2.0, -4)])
def test_dot_moves_by_the_disparity_formula(depth, pixels_per_view):
    step = 0.25  # f·step·(1/4 − 1/depth) = pixels_per_view
    assert 64 * step * (1 / 4 - 1 / depth) == pixels_per_view
    scale = depth / 64
    dot = quad(-3 * scale, 2 * scale, -2 * scale, 2 * scale, depth, colors=colourful(4))
    color, _ = draw_views(dot, offsets=(np.arange(5) - 2) * step)
    for i in range(5):
        np.testing.assert_array_equal(color[i], np.roll(color[2], (i - 2) * pixels_per_view, axis=1))
    np.testing.assert_array_equal(np.nonzero(color[2, ..., 3].any(axis=0))[0], np.arange(29, 34))


@settings(max_examples=40, deadline=None)
@given(st.floats(0.3, 100), st.floats(-1, 1), st.floats(-20, 20), st.floats(0.5, 30))
def test_covered_columns_are_half_open(depth, offset, left, width):
    shift = 32 + 64 * offset * (1 / 4 - 1 / depth)
    scale = depth / 64
    _, found = draw_views(quad(left * scale, (left + width) * scale, -9e9, 9e9, depth), offsets=[offset])
    centre = np.arange(64) + 0.5
    sure = (np.abs(centre - shift - left) > 1e-9) & (np.abs(centre - shift - left - width) > 1e-9)
    expected = (shift + left <= centre) & (centre < shift + left + width)
    assert (np.isfinite(found[0]) == expected)[:, sure].all()


def textbook_pixel(rig, offset, point, width, height):
    """Pixel of a world point through glFrustum · lookAt, written down from the OpenGL 2.1 reference."""
    position, target, up = (np.array(v) for v in (rig.position, rig.target, rig.up))
    z = (position - target) / np.linalg.norm(position - target)
    x = np.cross(up, z) / np.linalg.norm(np.cross(up, z))
    y = np.cross(z, x)
    view = np.eye(4)
    view[:3, :3] = x, y, z
    view[:3, 3] = -view[:3, :3] @ (position + offset * x)
    n, f = 0.1, 100.0
    half_y = np.tan(np.radians(rig.fov_y) / 2) * n
    half_x = half_y * width / height
    shear = offset * n / rig.focal  # a camera further right sees the window further left
    left, right, bottom, top = -half_x - shear, half_x - shear, -half_y, half_y
    frustum = np.array(
        [
            [2 * n / (right - left), 0, (right + left) / (right - left), 0],
            [0, 2 * n / (top - bottom), (top + bottom) / (top - bottom), 0],
            [0, 0, -(f + n) / (f - n), -2 * f * n / (f - n)],
            [0, 0, -1, 0],
        ]
    )
    clip = frustum @ view @ np.append(point, 1.0)
    return (clip[0] / clip[3] + 1) / 2 * width, (1 - clip[1] / clip[3]) / 2 * height


def cross(p, q):
    """z of the cross product of plane vectors (…, 2)."""
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


def test_views_are_those_of_a_textbook_frustum():
    rig = Rig(position=(3, 2, 5), target=(0.5, 0, 0), up=(0.1, 1, 0), fov_y=40, baseline=1.5, views=5)
    width, height = 80, 60
    f = height / 2 / np.tan(np.radians(20))
    camera = Camera(rig.eye_from_world, f, f, width, height, rig.focal, rig.near_depth)
    for point in np.random.default_rng(1).uniform(-0.8, 0.8, (20, 3)):
        eye = apply(rig.eye_from_world, point)
        for offset in rig.camera_offsets:
            expected = textbook_pixel(rig, offset, point, width, height)
            np.testing.assert_allclose(project(camera, eye, offset), expected, atol=1e-9)
        triangle = point + np.array([(0, 0, 0), (0.4, 0, 0), (0, 0.4, 0.1)])
        _, depth = draw_views(Mesh(triangle, [[0, 1, 2]], material=FLAT), camera, rig.camera_offsets[:1])
        a, b, c = (np.array(textbook_pixel(rig, rig.camera_offsets[0], p, width, height)) for p in triangle)
        centres = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)
        area = np.array([cross(q - p, centres - p) for p, q in ((a, b), (b, c), (c, a))]) * np.sign(cross(b - a, c - a))
        assert (area > 0).all(axis=0).sum() > 5
        np.testing.assert_array_equal(np.isfinite(depth[0]), (area > 0).all(axis=0))


# --- visibility ------------------------------------------------------------------------------------


def moller_trumbore(corners, origin, direction):
    """Distance along the ray and weights of corners 1 and 2 (Möller and Trumbore 1997); directions (M, 3)."""
    e1, e2 = corners[1] - corners[0], corners[2] - corners[0]
    p = np.cross(direction, e2)
    det = p @ e1
    s = origin - corners[0]
    q = np.cross(s, e1)
    return (q @ e2) / det, (p @ s) / det, (direction @ q) / det


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-1, 1), st.sampled_from([0.0, 0.3]))
def test_hits_are_those_of_ray_triangle_intersection(seed, offset, offset_y):
    rng = np.random.default_rng(seed)
    camera = replace(CAMERA, offset_y=offset_y, width=24, height=18, fx=20.0, fy=24.0)
    corners = rng.normal((0, 0, 3), (2, 2, 3), (3, 3))  # often behind the near plane or the eye
    samples = view_samples(camera, offset, 1)
    hits = trace(corners[None], np.array([0]), camera, samples)
    x, y = samples.x.ravel(), samples.y.ravel()
    direction = np.column_stack(
        [(x - 12) / 20 - offset / 4, (9 - y) / 24 - offset_y / 4, np.ones(x.size)]  # d grows by one per unit
    )
    d, w1, w2 = moller_trumbore(corners, np.array([offset, offset_y, 0.0]), direction)
    margin = np.min([w1, w2, 1 - w1 - w2, d - camera.near], axis=0)
    found = np.zeros(samples.x.shape, bool)
    found[hits.where] = True
    sure = np.abs(margin) > 1e-7
    np.testing.assert_array_equal(found.ravel()[sure], (margin > 0)[sure])
    hit = found.ravel()
    np.testing.assert_allclose(hits.depth, d[hit], rtol=1e-6)
    np.testing.assert_allclose(hits.weights[:, 1:], np.column_stack([w1, w2])[hit], atol=1e-6)


def test_edge_functions_are_affine_in_x_and_offset_along_a_row():
    rng = np.random.default_rng(2)
    corners = rng.normal((0, 0, 4), 1, (3, 3))
    x, v = rng.uniform(0, 64, 50), rng.uniform(-1, 1, 50)
    e, _, _ = edge_functions(corners, CAMERA, x, np.full(50, 13.5), v)
    basis = np.column_stack([np.ones(50), x, v])
    _, residual, rank, _ = np.linalg.lstsq(basis, e, rcond=None)
    assert rank == 3 and residual.max() < 1e-24


def test_edge_functions_are_the_ruled_side_faces_of_the_errata():
    """DESIGN erratum 1: E(x, y, v) of edge AB; ours is −d_A·d_B/(fx·fy) times that (rows run downwards)."""
    rng = np.random.default_rng(3)
    corners = rng.uniform((-1, -1, 2), (1, 1, 4), (3, 3))
    (xa, ya), (xb, yb) = (project(CAMERA, corners[k], 0.0) for k in (0, 1))
    da, db = (64 * (1 / 4 - 1 / corners[k, 2]) for k in (0, 1))
    x, y, v = rng.uniform(0, 48, (3, 30))
    ruled = (ya - yb) * x + (xb - xa + v * (db - da)) * y + (xa * yb - xb * ya + v * (da * yb - db * ya))
    e, _, _ = edge_functions(corners, CAMERA, x, y, v)
    np.testing.assert_allclose(e[:, 2], -ruled * corners[0, 2] * corners[1, 2] / 64**2, rtol=1e-9)


def test_weights_change_by_their_derivatives():
    corners = np.array([[-2.0, -1.5, 2.0], [2.5, -1.0, 6.0], [0.0, 2.0, 3.0]])
    samples = view_samples(CAMERA, 0.25, 1)
    hits = trace(corners[None], np.array([0]), CAMERA, samples)
    h = 1e-5
    for axis, slope in (("x", hits.weights_dx), ("y", hits.weights_dy)):
        ends = []
        for s in (-h, h):
            moved = {k: getattr(samples, k)[hits.where] + (s if k == axis else 0) for k in "xyv"}
            e, _, _ = edge_functions(corners, CAMERA, **moved)
            ends.append(e / e.sum(axis=1, keepdims=True))
        np.testing.assert_allclose(slope, (ends[1] - ends[0]) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("aligned", [False, True])
def test_tessellated_plane_covers_every_sample_once_in_every_view(aligned):
    points, faces = bumpy_plane(16 if aligned else 9, np.random.default_rng(4), aligned=aligned)
    # aligned: vertices fall on pixel centres, x + ½ and y + ½, of a picture of odd size
    camera = replace(CAMERA, width=65, height=49) if aligned else CAMERA
    corners = apply(EYE, points)[faces]
    for offset in (np.arange(-4, 5) / 8) if aligned else np.linspace(-0.5, 0.5, 5):
        samples = view_samples(camera, offset, 1)
        count = np.zeros(samples.x.shape, int)
        for triangle in corners:
            count[trace(triangle[None], np.array([0]), camera, samples).where] += 1
        assert (count == 1).all()


def test_top_left_rule_on_pixel_centres():
    """Edges run exactly through sample positions: left and top edges take them, right and bottom edges do not."""
    mesh = quad(-21.5 / 16, -11.5 / 16, -3.5 / 16, 5.5 / 16, 4.0)
    color, _ = draw_views(mesh)
    rows, columns = np.nonzero(color[0, ..., 3])
    assert (columns.min(), columns.max()) == (10, 19)  # 32 − 21.5 = 10.5 ≤ x + ½ < 20.5
    assert (rows.min(), rows.max()) == (18, 26)  # 24 − 5.5 = 18.5 ≤ y + ½ < 27.5
    assert len(rows) == 10 * 9


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_equally_near_triangles_the_earlier_wins(order):
    pair = [quad(-1, 1, -1, 1, 3.0, colors=np.full((4, 3), c)) for c in (0.25, 0.75)]
    color, _ = draw_views([pair[k] for k in order], offsets=(-0.5, 0.0, 0.5))
    assert set(np.unique(color[color[..., 3] > 0][:, 0])) == {(64, 191)[order[0]]}
    vertices, shades = np.concatenate([m.vertices for m in pair]), np.concatenate([m.colors for m in pair])
    faces = np.concatenate([pair[k].faces + 4 * k for k in order])
    joined, _ = draw_views(Mesh(vertices, faces, colors=shades, material=FLAT), offsets=(-0.5, 0.0, 0.5))
    np.testing.assert_array_equal(joined, color)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 1, 0)])
def test_of_a_triangle_and_its_copy_from_another_corner_the_earlier_wins(order):
    rng = np.random.default_rng(1)
    for _ in range(20):
        corners = rng.normal(size=(3, 3)) - (0, 0, 6)
        pair = [
            Mesh(corners[list(k)], [[0, 1, 2]], colors=np.full((3, 3), c), material=replace(FLAT, two_sided=True))
            for k, c in (((0, 1, 2), 0.25), (order, 0.75))
        ]
        color, _ = draw_views(pair, offsets=(-0.5, 0.0, 0.5))
        assert set(np.unique(color[color[..., 3] > 0][:, 0])) <= {64}


def test_nearer_surface_hides_and_interpenetration_follows_depth():
    wall = quad(-9, 9, -9, 9, 4.0, colors=np.tile([1.0, 0, 0], (4, 1)))
    leaning = Mesh(
        [(-4, -9, -2.0), (4, -9, -6.0), (4, 9, -6.0), (-4, 9, -2.0)], [[0, 1, 2], [0, 2, 3]],
        colors=np.tile([0, 1.0, 0], (4, 1)), material=FLAT,
    )  # fmt: skip
    for offset in (-0.5, 0.0, 0.5):
        color, depth = draw_views([wall, leaning], offsets=[offset])
        # leaning has d = 4 + X/2: they meet at X = 0, d = 4, which does not move between views
        assert (color[0, :, :32, 1] == 255).all() and (color[0, :, 32:, 0] == 255).all()
        slope = (np.arange(32) + 0.5 - 32) / 64 - offset / 4
        expected = (4 + offset / 2) / (1 - slope / 2)
        np.testing.assert_allclose(depth[0, :, :32], np.tile(expected, (48, 1)), rtol=1e-6)


def test_near_plane_cuts_a_floor_that_passes_under_the_camera():
    camera = replace(CAMERA, near=3.0)
    floor = Mesh([(-99, -1, 50), (99, -1, 50), (99, -1, -64), (-99, -1, -64)], [[0, 1, 2], [0, 2, 3]], material=FLAT)
    _, depth = draw_views(floor, camera, offsets=(-0.5, 0.5))
    below = np.arange(48) + 0.5 - 24
    with np.errstate(divide="ignore"):
        d = np.where(below > 0, 64 / below, np.inf)
    expected = np.where((d >= 3.0) & (d <= 64.0), d, np.inf)
    assert np.isfinite(expected).sum() == 20  # rows 25 (d = 42.7) … 44 (d = 3.1); row 24 has d = 128
    np.testing.assert_allclose(depth, np.broadcast_to(expected[None, :, None], depth.shape), rtol=1e-6)


# --- sides and transforms ----------------------------------------------------------------------------


def test_one_sided_surface_is_culled_per_view():
    """A wall that runs straight ahead: cameras on the side of its normal see it, one in its plane sees nothing."""
    points = np.array([(0.25, -1, -2.0), (0.25, -1, -3.0), (0.25, 1, -3.0), (0.25, 1, -2.0)])
    offsets = np.array([-0.5, 0.25, 1.0])
    for face in ([0, 1, 2], [2, 1, 0]):
        normal = np.cross(points[face[1]] - points[face[0]], points[face[2]] - points[face[0]])
        for two_sided in (False, True):
            color, _ = draw_views(Mesh(points, [face], material=Material(two_sided=two_sided)), offsets=offsets)
            facing = normal[0] * (offsets - 0.25)
            expected = (facing != 0) if two_sided else (facing > 0)
            np.testing.assert_array_equal(color[..., 3].any(axis=(1, 2)), expected)


def test_a_back_side_is_lit_with_the_normal_turned_round():
    light = DirectionalLight((0.5, 0.25, -1.0))
    lit = Material(two_sided=True, specular=0.5, shininess=8)
    colors = colourful(4)
    facing, away = quad(-1, 1, -1, 1, 4.0, colors=colors, material=lit), quad(-1, 1, -1, 1, 4.0, colors=colors)
    away = Mesh(away.vertices, away.faces[:, ::-1], colors=colors, material=lit)
    assert (away.shading_normals == -facing.shading_normals).all()
    for lighting in ("sample", "vertex"):
        pictures = [draw_views(Scene(m, [light]), offsets=(-0.5, 0.5), lighting=lighting)[0] for m in (facing, away)]
        assert len(np.unique(pictures[0])) > 20
        np.testing.assert_allclose(pictures[0].astype(int), pictures[1], atol=1)


def test_a_mirroring_transform_keeps_the_front():
    points, faces = bumpy_plane(3, np.random.default_rng(5), size=1.0)
    base = Mesh(points, faces, colors=colourful(len(points)), material=Material(two_sided=False))
    mirror = scaling(-1, 1, 1)
    moved = Mesh(points, faces, base.normals, base.colors, material=base.material, transform=mirror)
    baked = Mesh(apply(mirror, points), faces[:, ::-1], None, base.colors, material=base.material)
    first, second = (draw_views(m, offsets=(-0.5, 0.5))[0] for m in (moved, baked))
    assert (first[..., 3] > 0).mean() > 0.2
    np.testing.assert_allclose(first.astype(int), second, atol=1)
    inside_out = replace(base, transform=rotation((0, 1, 0), 180) @ translation(0, 0, 8))
    assert not draw_views(inside_out)[0].any()


# --- samples, panels, passes -------------------------------------------------------------------------


def still_life():
    """Two overlapping surfaces in front of and behind the focal plane, one of them curved."""
    points, faces = bumpy_plane(4, np.random.default_rng(8), size=1.5)
    points[:, 2] *= 1.3
    return Scene([Mesh(points, faces, colors=colourful(len(points)), material=Material(specular=0.4)),
                  quad(-0.5, 0.4, -0.7, 0.3, 2.5, colors=colourful(4, 1))], background=(0.1, 0.2, 0.3))  # fmt: skip


SMALL = replace(CAMERA, fx=16.0, fy=16.0, width=20, height=14)
OFFSETS = (np.arange(6) - 2.5) / 4


@pytest.mark.parametrize("samples", [4, 16])
def test_samples_are_a_finer_picture_averaged(samples):
    k = round(samples**0.5)
    fine = replace(SMALL, fx=k * 16.0, fy=k * 16.0, width=k * 20, height=k * 14)
    color, depth = draw_views(still_life(), SMALL, OFFSETS, samples=samples)
    full, full_depth = draw_views(still_life(), fine, OFFSETS)
    blocks = full.reshape(6, 14, k, 20, k, 4)
    np.testing.assert_array_equal(color, (blocks.sum(axis=(2, 4), dtype=int) + samples // 2) // samples)
    np.testing.assert_array_equal(depth, full_depth.reshape(6, 14, k, 20, k).min(axis=(2, 4)))


def list_masks():
    rng = np.random.default_rng(9)
    x, c = np.arange(6)[:, None], np.arange(3)
    slanted = (2 * (3 * x + c)[None] - np.arange(3)[:, None, None]) % 6
    yield "slanted table", ViewMap(6, table=slanted)
    yield "random table", ViewMap(6, table=rng.integers(0, 6, (5, 7, 3)), reverse=True)
    yield "phase", ViewMap(6, a=0.2, b=-0.07, offsets=np.array([[0.1, 0.17, 0.24]]))
    yield "cells", ViewMap(6, a=0.31, b=0.03, offsets=rng.random((2, 3)), cell_mode=1, height=14)


MASKS = list(list_masks())


@pytest.mark.parametrize("flip", [(False, False), (True, False), (False, True), (True, True)])
@pytest.mark.parametrize(("name", "viewmap"), MASKS, ids=[name for name, _ in MASKS])
def test_panel_is_the_interlaced_views(name, viewmap, flip):
    draw = Draw(SMALL, OFFSETS, (-1, 1), viewmap, *flip)
    panel = draw_panel(still_life(), draw)
    views, _ = draw_views(still_life(), SMALL, OFFSETS)
    woven = np.zeros_like(panel)
    engine.interlace(views, draw, woven)
    np.testing.assert_array_equal(panel, woven)
    for r, x, c in np.random.default_rng(10).integers(0, (14, 20, 3), (50, 3)):  # the rule, spelt out
        view = viewmap.view(np.array([r]), np.array([x]))[0, 0, c]
        picture = (13 - r if flip[1] else r, 19 - x if flip[0] else x)
        assert panel[r, x, c] == views[(view, *picture, c)]


def test_continuous_panel_interpolates_camera_offsets():
    viewmap = ViewMap(6, a=0.25, b=0.125, offsets=np.array([[0.0, 0.0625, 0.5]]), continuous=True)
    uneven = np.array([-1.0, -0.75, -0.25, 0.0, 0.75, 1.0])
    panel = draw_panel(still_life(), Draw(SMALL, uneven, (-1, 1), viewmap))
    v = offset_at(uneven, viewmap.camera(np.arange(14), np.arange(20)))
    offsets, index = np.unique(v, return_inverse=True)
    assert len(offsets) > 6 and offsets[0] < uneven[0]
    views, _ = draw_views(still_life(), SMALL, offsets)
    rows, columns, channels = np.ogrid[:14, :20, :3]
    np.testing.assert_array_equal(panel, views[index.reshape(v.shape), rows, columns, channels])


@pytest.mark.parametrize("samples", [1, 4])
def test_subpixel_sampling_is_a_panel_three_times_as_wide(samples):
    _, viewmap = MASKS[0]
    options = Options(sampling="subpixel", samples=samples)
    panel = draw_panel(still_life(), Draw(SMALL, OFFSETS, (-1, 1), viewmap, options=options))
    views, _ = draw_views(still_life(), replace(SMALL, fx=48.0, width=60), OFFSETS, samples=samples)
    rows, columns, channels = np.ogrid[:14, :20, :3]
    view = viewmap.view(np.arange(14), np.arange(20))
    difference = panel.astype(int) - views[view, rows, 3 * columns + channels, channels]
    assert (difference != 0).mean() < 0.01  # (j + ½)/6 is not exact in binary: a sample may change sides


def test_drawing_view_by_view_gives_the_same_stack():
    together = draw_views(still_life(), SMALL, OFFSETS)
    for i, offset in enumerate(OFFSETS):
        alone = draw_views(still_life(), SMALL, [offset])
        np.testing.assert_array_equal(together[0][i], alone[0][0])
        np.testing.assert_array_equal(together[1][i], alone[1][0])
