"""Points: what they accept, and the radii and normals that they estimate from neighbours."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo import InputError, Material, Mesh, Points, Scene
from autostereo.scene.neighbors import estimate_normals, estimate_radii
from autostereo.scene.shapes import displaced_sphere, icosphere, torus
from autostereo.transforms import rotation, scaling, translation

THREE = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


def grid(columns, rows, step=(1.0, 1.0)):
    """Points of a grid in the plane z = 0, row by row."""
    y, x = np.mgrid[:rows, :columns].astype(float)
    return np.stack([step[0] * x.ravel(), step[1] * y.ravel(), np.zeros(x.size)], axis=1)


def sphere(count, seed=1):
    points = np.random.default_rng(seed).standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


# --- fields -------------------------------------------------------------------------------------


def test_defaults_and_types():
    points = Points(np.array(THREE, np.float32), radii=0.5)
    assert len(points) == 3 and points.positions.dtype == np.float64 and points.normals is None
    np.testing.assert_array_equal(points.radii, [0.5] * 3)
    np.testing.assert_array_equal(points.colors, np.full((3, 3), np.float32(0.8)))
    np.testing.assert_array_equal(points.transform, np.eye(4))
    assert points.material == Material() and points.colors.dtype == np.float32


def test_normals_become_unit_vectors_and_bytes_colors():
    points = Points(THREE, [(0, 0, 5), (3, 0, 4), (1e-200, 0, 0)], (1, 2, 3), np.array([(255, 0, 51, 9)] * 3, np.uint8))
    np.testing.assert_allclose(points.normals, [(0, 0, 1), (0.6, 0, 0.8), (1, 0, 0)], atol=1e-15)
    np.testing.assert_array_equal(points.colors, np.float32([(1, 0, 0.2)] * 3))
    np.testing.assert_array_equal(points.radii, [1, 2, 3])


def test_normals_of_zero_length_are_estimated():
    normals = np.zeros((25, 3))
    normals[7] = (0, 1, 0)
    found = Points(grid(5, 5), normals).normals
    np.testing.assert_array_equal(found[7], (0, 1, 0))
    np.testing.assert_allclose(np.delete(found, 7, axis=0), [(0, 0, 1)] * 24, atol=1e-12)


def test_the_arrays_given_are_not_kept():
    positions = np.array(THREE, float)
    points = Points(positions, radii=1)
    positions[:] = 9
    np.testing.assert_array_equal(points.positions, THREE)


def test_bounds_hold_the_discs():
    flat = Points([(1, 2, 3)], normals=[(0, 0, 1)], radii=0.5)
    np.testing.assert_allclose(flat.bounds, [(0.5, 1.5, 3), (1.5, 2.5, 3)])
    np.testing.assert_allclose(replace(flat, normals=None).bounds, [(0.5, 1.5, 2.5), (1.5, 2.5, 3.5)])
    moved = replace(flat, transform=translation(10, 0, 0) @ scaling(2) @ rotation((1, 0, 0), 90))
    np.testing.assert_allclose(moved.bounds, [(11, -6, 3), (13, -6, 5)], atol=1e-12)


def test_radii_follow_the_transform():
    points = Points(THREE, [(0, 0, 1), (1, 0, 0), (0, 1, 0)], 1.0, transform=scaling(4.0, 9.0, 1.0))
    np.testing.assert_allclose(points.world_radii, [6, 3, 2])  # an ellipse of the same area
    np.testing.assert_allclose(replace(points, normals=None).world_radii, [36 ** (1 / 3)] * 3)
    np.testing.assert_allclose(replace(points, transform=scaling(3.0)).world_radii, [3] * 3)
    turned = replace(points, transform=rotation((1, 2, 3), 40))
    np.testing.assert_allclose(turned.world_radii, [1] * 3)
    np.testing.assert_allclose(turned.world_normals, points.normals @ turned.transform[:3, :3].T, atol=1e-15)


def test_a_scene_takes_points_beside_meshes():
    points, mesh = Points(THREE, radii=1), Mesh(THREE, [(0, 1, 2)])
    assert Scene.of(points).objects == (points,)
    assert Scene([mesh, points]).objects == (mesh, points)
    np.testing.assert_array_equal(Scene([mesh, points]).bounds, points.bounds)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Points([(0, 0)]), r"positions: expected shape \(N, 3\), got \(1, 2\)"),
        (lambda: Points(np.zeros((0, 3))), "positions: expected at least one point, got none"),
        (lambda: Points("cloud.ply"), "positions: expected an array of numbers, got str"),
        (lambda: Points([*THREE, (np.nan, 0, 0)]), "positions: .* found NaN or infinity in 1 of 4"),
        (lambda: Points([(0, 0, 1e31)], radii=1), r"positions: expected numbers within ±1e\+30, found ±1e\+31"),
        (lambda: Points([(1, 2, 3)]), "radii: cannot be estimated from one point; give radii"),
        (lambda: Points([(1, 2, 3)] * 7), "radii: cannot be estimated from 7 points that are all at one position"),
        (lambda: Points(THREE, radii=0), "radii: expected finite numbers > 0, found 1 of 1"),
        (lambda: Points(THREE, radii=(1, 0, -1)), "radii: expected finite numbers > 0, found 2 of 3"),
        (lambda: Points(THREE, radii=(1, np.nan, np.inf)), "radii: expected finite numbers > 0, found 2 of 3"),
        (lambda: Points(THREE, radii=(1, 2)), r"radii: expected one number or shape \(3,\), got \(2,\)"),
        (lambda: Points(THREE, radii="big"), "radii: expected numbers, got str"),
        (lambda: Points(THREE, normals=[(0, 0, 1)]), r"normals: expected shape \(3, 3\), got \(1, 3\)"),
        (lambda: Points(THREE, normals=[(0, 0, np.inf)] * 3), "normals: expected finite numbers"),
        (lambda: Points(THREE, colors=[(0, 0, 2.0)] * 3), "colors: expected floats 0…1"),
        (lambda: Points(THREE, colors=[(0, 0, 1.0)]), r"colors: expected shape \(3, 3\) or \(3, 4\), got \(1, 3\)"),
        (lambda: Points(THREE, material="wood"), "material: expected a Material, got str"),
        (lambda: Points(THREE, transform=np.eye(3)), "transform: expected shape"),
    ],
)
def test_errors_name_the_field(make, words):
    with pytest.raises(InputError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


# --- radii --------------------------------------------------------------------------------------


def test_radii_of_a_square_grid():
    radii = estimate_radii(grid(9, 7, (0.25, 0.25))).reshape(7, 9)
    inner = 0.25 * (1 + np.sqrt(2)) / 2  # four neighbours at 1, four at √2: the median lies between
    np.testing.assert_allclose(radii[1:-1, 1:-1], inner, rtol=1e-12)
    assert radii.max() <= 0.25 * 2.0  # the corners


def test_radii_leave_no_holes_on_evenly_sampled_surfaces():
    # a ray through any place of the surface must meet a disc
    for positions, normals in (
        (icosphere(4).vertices, icosphere(4).vertices),
        (torus(columns=90, rows=30).vertices, torus(columns=90, rows=30).normals),
    ):
        first = np.unique(positions.round(9), axis=0, return_index=True)[1]
        positions, normals = positions[first], normals[first]
        radii = estimate_radii(positions)
        rng = np.random.default_rng(4)
        a, b = rng.integers(0, len(positions), 3000), rng.standard_normal((3000, 3))
        tangent = np.cross(normals[a], b)
        place = positions[a] + tangent / np.linalg.norm(tangent, axis=1, keepdims=True) * radii[a, None]
        inside = np.linalg.norm(place[:, None] - positions, axis=2) < radii  # (places, points)
        assert inside.any(axis=1).all()


@settings(max_examples=20, deadline=None)
@given(st.floats(-200, 200), st.integers(2, 40))
def test_radii_scale_with_the_cloud_and_are_always_positive(exponent, count):
    points = np.random.default_rng(count).random((count, 3))
    scale = 2.0 ** np.floor(exponent)
    np.testing.assert_array_equal(estimate_radii(points * scale), estimate_radii(points) * scale)
    assert (estimate_radii(points * 1e-200) > 0).all()


def test_duplicates_do_not_change_radii():
    once = grid(9, 9)
    thrice = np.concatenate([once, once[::-1], once])
    np.testing.assert_array_equal(
        estimate_radii(thrice), np.concatenate([estimate_radii(once), estimate_radii(once)[::-1], estimate_radii(once)])
    )


def test_an_outlier_stays_a_small_disc():
    radii = estimate_radii(np.concatenate([grid(9, 9), [(4, 4, 1000)]]))
    assert radii[-1] < 2.5 and radii[:-1].max() <= 2.0


def test_two_points_reach_each_other():
    np.testing.assert_array_equal(estimate_radii(np.array([(0.0, 0, 0), (3, 0, 4)])), [5, 5])


def test_scan_lines_of_wide_spacing_are_covered():
    radii = estimate_radii(grid(60, 20, (1.0, 4.0))).reshape(20, 60)
    assert radii[2:-2, 5:-5].min() > np.hypot(0.5, 2.0)  # half the diagonal of a cell


# --- normals ------------------------------------------------------------------------------------


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 1, 0), (0.6, 0, 0.8), (-1, 2, -4)])
def test_normals_of_a_plane_are_exact_and_agree(normal):
    normal = np.array(normal) / np.linalg.norm(normal)
    side = np.cross(normal, (0.3, 0.5, 0.7))
    side /= np.linalg.norm(side)
    rng = np.random.default_rng(5)
    points = rng.random((400, 1)) * side + rng.random((400, 1)) * np.cross(normal, side) + (7, 8, 9)
    upward = normal * np.sign(normal[np.abs(normal).argmax()])
    np.testing.assert_allclose(estimate_normals(points), np.tile(upward, (400, 1)), atol=1e-10)


def test_normals_of_a_sphere_point_outwards():
    points = sphere(4000)
    cosine = (estimate_normals(points) * points).sum(axis=1)
    # 13 of 4000 evenly spread points cover a cap of 6.5° around the middle one
    assert cosine.min() > np.cos(np.deg2rad(6.5)) and np.median(cosine) > np.cos(np.deg2rad(1.0))


@pytest.mark.parametrize("mesh", [displaced_sphere(4), torus(), icosphere(4)])
def test_normals_of_closed_surfaces_agree_with_the_mesh(mesh):
    far = replace(mesh, vertices=mesh.vertices + np.array((300, -200, 100)), normals=None)
    cosine = (Points(far.vertices).with_normals().normals * far.shading_normals).sum(axis=1)
    assert cosine.min() > 0.9


def test_normals_do_not_depend_on_where_the_cloud_is():
    points = sphere(500)
    near, far = estimate_normals(points), estimate_normals(points + np.array((6.4e5, 8.5e5, 400)))
    np.testing.assert_allclose(near, far, atol=1e-6)


def test_two_separate_parts_are_both_oriented():
    points = sphere(1500)
    both = np.concatenate([points, points + np.array((10, 0, 0))])
    outward = np.concatenate([points, points])
    assert ((estimate_normals(both) * outward).sum(axis=1) > 0.9).all()


def test_degenerate_clouds_get_unit_normals():
    line = np.linspace(0, 1, 20)[:, None] * np.array((1.0, 2.0, 3.0))
    normals = estimate_normals(line)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(normals @ (1, 2, 3), 0, atol=1e-6)
    np.testing.assert_array_equal(estimate_normals(np.ones((3, 3))), [(0, 0, 1)] * 3)
    np.testing.assert_allclose(np.linalg.norm(estimate_normals(np.eye(3)[:2]), axis=1), 1, rtol=1e-12)


def test_with_normals_keeps_those_given():
    given_normals = Points(THREE, [(0, 1, 0)] * 3)
    assert given_normals.with_normals() is given_normals
    points = Points(THREE, radii=2.0, colors=[(1, 0, 0)] * 3, transform=translation(1, 2, 3))
    made = points.with_normals()
    np.testing.assert_allclose(made.normals, [(0, 0, 1)] * 3, atol=1e-12)
    for name in ("positions", "radii", "colors", "transform"):
        np.testing.assert_array_equal(getattr(made, name), getattr(points, name))
