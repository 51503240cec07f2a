"""The procedural volumes and point cloud: what they must be, in closed form."""

import inspect

import numpy as np
import pytest

from autostereo import InputError, Points, Volume
from autostereo.scene import samples
from autostereo.scene.samples import c60_atoms, c60_density, engine_part, hydrogen_orbital, shells, surfel_cloud
from autostereo.scene.shapes import displaced_sphere


def at(volume, points):
    """Values at points (N, 3) of the scene, trilinear."""
    index = (np.asarray(points) - volume.origin) / volume.spacing
    low = np.minimum(np.floor(index).astype(int), np.array(volume.values.shape[::-1]) - 2)
    f = index - low
    total = 0.0
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, f, 1 - f), axis=1)
        x, y, z = (low + corner).T
        total = total + weight * volume.values[z, y, x]
    return total


ORBITALS = [(1, 0, 0), (2, 0, 0), (2, 1, 1), (3, 2, 0), (3, 2, -1), (4, 2, 0), (4, 3, 2), (6, 3, -3)]


@pytest.mark.parametrize(("n", "l", "m"), ORBITALS)
def test_hydrogen_integrates_to_one(n, l, m):  # noqa: E741
    volume = hydrogen_orbital(96, n, l, m)
    assert volume.values.dtype == np.float32 and volume.value_range[0] >= 0
    total = volume.values.sum(dtype=np.float64) * np.prod(volume.spacing)
    assert 0.995 <= total + 2e-3 and total <= 1.002  # 99.5 % lie within the sphere in the cube


def test_hydrogen_ground_state_in_closed_form():
    # |ψ|² = e^(−2r/a) / (π·a³): three numbers fix a, the axis and the origin
    volume = hydrogen_orbital(65, 1, 0, 0)
    centre = float(volume.values[32, 32, 32])
    a = (np.pi * centre) ** (-1 / 3)
    points = np.random.default_rng(1).integers(0, 65, (200, 3))
    r = np.linalg.norm((points - 32) / 32, axis=1)
    expected = centre * np.exp(-2 * r / a)
    np.testing.assert_allclose(volume.values[tuple(points.T)], expected, rtol=1e-4)


def test_hydrogen_axis_nodes_and_turns():
    # 2p: m = 0 along y with a node at y = 0; m = 1 along z, m = −1 along x, all of one shape
    along_y, along_z, along_x = (hydrogen_orbital(33, 2, 1, m).values for m in (0, 1, -1))
    assert (along_y[:, 16, :] == 0).all() and along_y[16, 24, 16] > 0
    np.testing.assert_allclose(along_z, along_y.transpose(1, 0, 2), rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(along_x, along_y.transpose(0, 2, 1), rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize(("n", "l"), [(2, 0), (3, 0), (3, 1), (4, 1), (5, 2)])
def test_hydrogen_has_as_many_radial_nodes_as_it_must(n, l):  # noqa: E741
    r = np.linspace(1e-3, 8 * n * n, 200_000)
    wave = samples._radial(n, l, r)
    assert (np.diff(np.sign(wave)) != 0).sum() == n - l - 1
    assert np.sum((wave * r) ** 2) * (r[1] - r[0]) == pytest.approx(1, abs=1e-6)
    mean = np.sum(wave**2 * r**3) * (r[1] - r[0])
    assert mean == pytest.approx((3 * n * n - l * (l + 1)) / 2, rel=1e-5)  # in Bohr radii


def test_c60_atoms_form_a_truncated_icosahedron():
    atoms = c60_atoms()
    assert atoms.shape == (60, 3)
    distance = np.linalg.norm(atoms[:, None] - atoms, axis=2) + 9 * np.eye(60)
    edge = 4 / np.sqrt(58 + 18 * np.sqrt(5))  # circumradius 1
    np.testing.assert_allclose(np.sort(distance, axis=1)[:, :3], edge, rtol=1e-12)  # every atom has three bonds
    assert distance.min(axis=1).max() < 0.999 * np.sort(distance, axis=1)[:, 3].min()


def test_c60_has_sixty_equal_maxima():
    volume = c60_density(129)
    assert volume.values.dtype == np.uint16
    inner = volume.values[1:-1, 1:-1, 1:-1].astype(int)
    highest = np.ones(inner.shape, bool)
    for step in np.ndindex(3, 3, 3):
        if step != (1, 1, 1):
            z, y, x = (slice(s, s + 127) for s in step)
            highest &= inner > volume.values[z, y, x]
    found = np.argwhere(highest)[:, ::-1] + 1
    assert len(found) == 60
    places = found * volume.spacing + np.array(volume.origin)
    distance = np.linalg.norm(places[:, None] - 0.8 * c60_atoms(), axis=2)
    assert (np.sort(distance.argmin(axis=0)) == np.arange(60)).all() and distance.min(axis=0).max() < 0.025
    heights = volume.values[tuple(found[:, ::-1].T)]
    assert heights.min() > 0.985 * 65535


def test_c60_looks_the_same_from_opposite_sides():
    values = c60_density(48).values.astype(int)
    assert np.abs(values - values[::-1, ::-1, ::-1]).max() <= 1


def test_engine_part_is_two_materials_in_air():
    volume = engine_part(96)
    assert volume.values.dtype == np.uint8 and volume.values.shape == (58, 77, 96)
    np.testing.assert_allclose(volume.bounds.sum(axis=0), 0, atol=1e-5)
    corner = volume.values[:4, :4, :4]
    assert 2 < corner.mean() < 7 and corner.std() > 1  # air, with noise
    metal = at(volume, [(0.0, -0.2, 0.0), (0.78, 0.1, 0.3), (-0.78, 0.1, -0.3)])
    np.testing.assert_allclose(metal, 114, atol=10)
    steel = at(volume, [(0.0, -0.42, 0.0), (0.4, 0.12, 0.235), (-0.4, 0.12, -0.235), (0.87, -0.6, 0.45)])
    np.testing.assert_allclose(steel, 219, atol=25)
    hollow = at(volume, [(0.4, 0.1, 0.0), (-0.4, 0.1, 0.0), (0.0, -0.42, 0.13)])
    np.testing.assert_allclose(hollow, 4, atol=10)


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("size", [64, 128])
def test_shells_have_steps_at_their_radii(size, count):
    volume = shells(size, count)
    assert volume.values.dtype == np.uint8 and volume.value_range[1] == 255
    radii = 0.95 * (1 - np.arange(count) / (count + 1))
    direction = np.random.default_rng(2).standard_normal((50, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    for k, radius in enumerate(radii):
        height = 255 / count
        np.testing.assert_allclose(at(volume, direction * radius), (k + 0.5) * height, atol=0.12 * height + 0.5)
        np.testing.assert_allclose(at(volume, direction * (radius - 0.09)), (k + 1) * height, atol=0.51)
    opacity = volume.transfer.evaluate(np.arange(0, 256))[:, 3]
    flat = np.round(np.arange(count + 1) * 255 / count).astype(int)
    assert (opacity[flat] == 0).all() and opacity.max() > 0  # between the steps nothing is seen


def test_shells_take_a_quarter_of_the_light_each():
    volume = shells(256, 1)
    line = np.linspace((0, 0, 1), (0, 0, 0), 4001)
    depth = volume.transfer.evaluate(at(volume, line))[:, 3].mean()
    assert 1 - np.exp(-depth) == pytest.approx(0.25, abs=0.03)


def test_surfel_cloud_lies_on_the_displaced_sphere():
    points = surfel_cloud(20_000)
    assert isinstance(points, Points) and len(points) == 20_000
    np.testing.assert_allclose(np.linalg.norm(points.normals, axis=1), 1, rtol=1e-12)
    assert np.abs(points.bounds).max() < 1.05
    mesh = displaced_sphere(5, 0.86)
    from scipy.spatial import cKDTree

    distance, near = cKDTree(mesh.vertices).query(points.positions)
    assert distance.max() < 0.06  # the mesh's own edges are that long
    cosine = (mesh.shading_normals[near] * points.normals).sum(axis=1)
    assert np.median(cosine) > 0.99 and cosine.min() > 0.8
    reach, direction = np.linalg.norm(points.positions, axis=1), points.positions
    from autostereo.scene.shapes import hills

    height = 0.86 * (1 + 0.15 * hills(direction / reach[:, None])[0])
    step = np.sqrt(4 * np.pi / 20_000 / 1.6)
    np.testing.assert_allclose(reach, height, atol=6 * 0.04 * step)  # six sigma of the range noise


def test_surfel_cloud_has_no_holes():
    points = surfel_cloud(5_000)
    rng = np.random.default_rng(3)
    direction = rng.standard_normal((3000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    # where the ray from the centre meets each surfel's plane, within its disc
    slope = direction @ points.normals.T
    reach = (points.positions * points.normals).sum(axis=1) / np.where(np.abs(slope) < 1e-9, np.nan, slope)
    hit = direction[:, None] * reach[:, :, None] - points.positions
    inside = (np.linalg.norm(hit, axis=2) <= points.radii) & (reach > 0)
    assert inside.any(axis=1).all()


def test_surfel_cloud_is_scanned_in_lines():
    points = surfel_cloud(50_000, amplitude=0.0)
    gap = np.linalg.norm(np.diff(points.positions, axis=0), axis=1)
    step = 0.86 * np.sqrt(4 * np.pi / 50_000 / 1.6)
    assert np.median(gap) == pytest.approx(step, rel=0.02)


@pytest.mark.parametrize("make", [hydrogen_orbital, c60_density, engine_part, shells, surfel_cloud])
def test_every_sample_is_the_same_each_time_and_within_the_cube(make):
    argument = {next(iter(inspect.signature(make).parameters)): 2_000 if make is surfel_cloud else 40}
    one, two = make(**argument), make(**argument)
    assert isinstance(one, (Volume, Points)) and np.abs(one.bounds).max() <= 1 + 1e-6
    for name in ("values", "positions", "colors", "radii"):
        if hasattr(one, name):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: hydrogen_orbital(4), "size: expected a whole number in 8…1024, got 4"),
        (lambda: hydrogen_orbital(32, 0), "n: expected a whole number in 1…8, got 0"),
        (lambda: hydrogen_orbital(32, 2, 2), "l: expected a whole number in 0…1, got 2"),
        (lambda: hydrogen_orbital(32, 3, 1, -2), "m: expected a whole number in -1…1, got -2"),
        (lambda: c60_density(128.5), "size: expected a whole number"),
        (lambda: engine_part(8), "size: expected a whole number in 32…1024, got 8"),
        (lambda: shells(64, 9), "count: expected a whole number in 1…8, got 9"),
        (lambda: surfel_cloud(1), "count: expected a whole number in 100…20000000, got 1"),
        (lambda: surfel_cloud(1000, 2), "amplitude: expected a number from 0 to 0.9, got 2"),
    ],
)
def test_bad_arguments(make, words):
    with pytest.raises(InputError, match=words):
        make()
