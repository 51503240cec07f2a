"""The reference engine's volumes against closed forms and plain numeric integration."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from autostereo import DirectionalLight, InputError, Material, Options, PointLight, Rig, Scene, ViewMap, Volume
from autostereo import TransferFunction as Transfer
from autostereo.engines.engine import Draw
from autostereo.engines.reference import volume as reference
from autostereo.engines.reference.engine import panel_samples, view_samples
from autostereo.engines.reference.mesh import project
from autostereo.engines.reference.picture import look
from autostereo.engines.reference.rays import Rays
from autostereo.render import render_views
from autostereo.transforms import apply, rotation, scaling, translation
from eye_scenes import CAMERA, EYE, draw_panel, draw_views, engine

SMALL = replace(CAMERA, fx=20.0, fy=24.0, width=20, height=16)
GREY = (0.5, 0.5, 0.5)
IDENTITY = np.eye(4)
DIRECTIONS = [np.eye(3), np.eye(3)[:, [2, 0, 1]] * (1, -1, 1), rotation((1, 1, 0.3), 50)[:3, :3]]


def see(scene, offset=0.0, camera=SMALL, **options):
    """What a view sees, unquantised, one sample a pixel."""
    return look(engine.prepare(Scene.of(scene)), view_samples(camera, offset, 1), camera, Options(**options))


def eye_and_direction(camera, offset):
    """The eye (3,) and directions (H·W, 3), d-component 1, of DESIGN section 1, in world space (z = −d)."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    a = (x.ravel() - camera.width / 2) / camera.fx - offset / camera.focal
    b = (camera.height / 2 - y.ravel()) / camera.fy - camera.offset_y / camera.focal
    return np.array([offset, camera.offset_y, 0.0]), np.column_stack([a, b, -np.ones_like(a)])


def box_entry(volume, camera, offset):
    """Depths at which rays enter and leave the box, by the slab method in index space, and length per depth."""
    eye, direction = eye_and_direction(camera, offset)
    inverse = np.linalg.inv(volume.world_from_index)
    start, along = apply(inverse, eye), direction @ inverse[:3, :3].T
    with np.errstate(divide="ignore"):
        ends = np.stack([-start / along, (np.array(volume.shape) - 1 - start) / along])
    enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    return np.maximum(enter, camera.near), leave, np.linalg.norm(direction, axis=1)


def homogeneous(tau, color=GREY, shape=(5, 5, 5), **fields):
    return Volume(np.full(shape, 7, np.uint8), transfer=Transfer([(0, *color, tau)]), shade=False, **fields)


def centred(spacing, shape, depth=4.0, turn=IDENTITY):
    """Fields that put a volume (nz, ny, nx) around (0, 0, −depth)."""
    half = (np.array(shape[::-1]) - 1) / 2 * spacing
    return {"spacing": spacing, "origin": tuple(-half), "transform": translation(0, 0, -depth) @ turn}


def linear(slope, constant, shape=(6, 7, 8), **fields):
    """A field that is linear in index space, s = slope·(i, j, k) + constant."""
    k, j, i = np.mgrid[tuple(slice(n) for n in shape)].astype(float)
    return Volume(slope[0] * i + slope[1] * j + slope[2] * k + constant, **fields)


def scalar_at(volume, points):
    """The scalars of a `linear` field."""
    index = apply(np.linalg.inv(volume.world_from_index), points)
    c = volume.values[0, 0, 0]
    slope = [volume.values[0, 0, 1] - c, volume.values[0, 1, 0] - c, volume.values[1, 0, 0] - c]
    return index @ np.array(slope) + c


turns = st.builds(rotation, st.sampled_from([(1, 0, 0), (0, 1, 0), (1, 1, 0), (1, -2, 3)]), st.floats(0, 360))

# --- transmittance -------------------------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(turns, st.floats(-1.5, 1.5), st.floats(0.05, 3.0), st.sampled_from([0.3, 1.0, 2.7, 1e4]))
def test_homogeneous_box_lets_through_exp_of_length(turn, offset, tau, step):
    volume = homogeneous(tau, **centred((0.4, 0.7, 0.3), (5, 5, 5), turn=turn @ scaling(1.0, 1.3, -0.8)))
    camera = replace(SMALL, offset_y=0.2)
    enter, leave, stretch = box_entry(volume, camera, offset)
    length = np.maximum(leave - enter, 0.0) * stretch
    assert (length > 0.1).sum() > 10
    seen = see(volume, offset, camera, step=step)
    np.testing.assert_allclose(seen.through, np.exp(-tau * length), rtol=1e-9)
    np.testing.assert_allclose(seen.color, np.outer(1 - np.exp(-tau * length), GREY), atol=1e-12)
    np.testing.assert_array_equal(seen.through[length == 0], 1.0)


def test_quantised_picture_over_a_background():
    volume = homogeneous(0.6, (1.0, 0.25, 0.4), **centred((0.5, 0.5, 0.5), (5, 5, 5)))
    offsets = (-1.0, 0.0, 0.75)
    color, depth = draw_views(Scene(volume, background=(0.0, 1.0, 0.4)), SMALL, offsets)
    for v, offset in enumerate(offsets):
        enter, leave, stretch = box_entry(volume, SMALL, offset)
        through = np.exp(-0.6 * np.maximum(leave - enter, 0.0) * stretch)[:, None]
        expected = (1 - through) * (1.0, 0.25, 0.4, 1.0) + through * (0.0, 1.0, 0.4, 0.0)
        np.testing.assert_array_equal(color[v].reshape(-1, 4), np.floor(255 * expected + 0.5))
        half = enter + np.log(2) / (0.6 * stretch)
        np.testing.assert_allclose(depth[v].ravel(), np.where(half <= leave, half, np.inf), rtol=1e-6)
    assert np.isfinite(depth).any() and np.isinf(depth).any()


def test_near_plane_cuts_the_volume():
    volume = homogeneous(0.5, **centred((1.0, 1.0, 1.0), (5, 5, 5), depth=1.0))
    camera = replace(SMALL, near=1.5)
    enter, leave, stretch = box_entry(volume, camera, 0.3)
    np.testing.assert_allclose(see(volume, 0.3, camera).through, np.exp(-0.5 * (leave - enter) * stretch), rtol=1e-9)
    behind = replace(volume, transform=translation(0, 0, 3.0))
    color, depth = draw_views(behind, camera)
    assert not color.any() and np.isinf(depth).all()


@settings(max_examples=8, deadline=None)
@given(turns, st.sampled_from([-0.75, 0.0, 1.0]), st.integers(0, 2**32 - 1))
def test_clipping_is_before_the_transform(turn, offset, seed):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-0.8, 0.1, 3)
    box = np.array([low, low + rng.uniform(0.3, 1.5, 3)])
    box[seed % 2, 1] = (-np.inf, np.inf)[seed % 2]
    plane = np.append(rng.normal(size=3), rng.uniform(0, 0.5))
    volume = homogeneous(0.8, **centred((0.4, 0.5, 0.45), (5, 5, 5), turn=turn), clip_box=box, clip_plane=plane)
    eye, direction = eye_and_direction(SMALL, offset)
    t = np.linspace(2.0, 6.0, 2001)
    points = eye + t[:, None, None] * direction
    inverse = np.linalg.inv(volume.transform)
    local = apply(inverse, points.reshape(-1, 3)).reshape(points.shape)
    index = (local - volume.origin) / volume.spacing
    inside = ((index >= 0) & (index <= 4) & (local >= box[0]) & (local <= box[1])).all(axis=-1)
    inside &= local @ plane[:3] + plane[3] >= 0
    length = inside.sum(axis=0) * 2e-3 * np.linalg.norm(direction, axis=1)
    np.testing.assert_allclose(see(volume, offset).through, np.exp(-0.8 * length), atol=4e-3)


def test_of_two_volumes_optical_depths_add_and_colours_mix():
    one = homogeneous(0.5, (1.0, 0.0, 0.0), **centred((0.5, 0.5, 0.5), (5, 5, 5)))
    two = homogeneous(1.5, (0.0, 1.0, 0.0), (9, 9, 9), **centred((0.25, 0.25, 0.25), (9, 9, 9)))  # the same box
    seen = see([one, two], 0.4)
    enter, leave, stretch = box_entry(one, SMALL, 0.4)
    length = np.maximum(leave - enter, 0.0) * stretch
    np.testing.assert_allclose(seen.through, np.exp(-2.0 * length), rtol=1e-9)
    np.testing.assert_allclose(seen.color, np.outer(1 - np.exp(-2.0 * length), (0.25, 0.75, 0.0)), atol=1e-9)

    far = replace(two, transform=translation(0.3, 0, -6.5))
    seen = see([far, one], 0.4)
    enter, leave, stretch = box_entry(far, SMALL, 0.4)
    behind = np.exp(-1.5 * np.maximum(leave - enter, 0.0) * stretch)
    front = np.exp(-0.5 * length)
    np.testing.assert_allclose(seen.through, front * behind, rtol=1e-9)
    np.testing.assert_allclose(seen.color, np.column_stack([1 - front, front * (1 - behind), 0 * front]), atol=1e-9)


# --- transfer functions along a ray --------------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(turns, st.floats(-1, 1), st.sampled_from([0.5, 1.0, 2.0, 1e4]))
def test_linear_extinction_of_a_linear_field(turn, offset, step):
    fields = centred((0.4, 0.3, 0.4), (6, 7, 8), turn=turn)
    volume = linear((0.1, 0.05, 0.2), 1.0, shade=False, transfer=Transfer([(0, *GREY, 0.0), (4, *GREY, 2.0)]), **fields)
    enter, leave, stretch = box_entry(volume, SMALL, offset)
    hit = leave > enter
    eye, direction = eye_and_direction(SMALL, offset)
    ends = [scalar_at(volume, eye + t[:, None] * direction) for t in (enter, leave)]
    optical = (ends[0] + ends[1]) / 2 * 0.5 * (leave - enter) * stretch  # extinction is s/2
    np.testing.assert_allclose(see(volume, offset, step=step).through[hit], np.exp(-optical[hit]), rtol=1e-9)


@settings(max_examples=30, deadline=None)
@given(turns, st.floats(-1, 1), st.sampled_from([0.5, 2.0, 1e4]))
def test_step_transfer_function_of_a_linear_field(turn, offset, step):
    """Extinction 0 below s = 2.5 and 1.5 above: the ray counts from where it crosses the plane s = 2.5."""
    transfer = Transfer([(0, *GREY, 0), (2.5, *GREY, 0), (2.5, *GREY, 1.5), (9, *GREY, 1.5)])
    fields = centred((0.4, 0.3, 0.4), (6, 7, 8), turn=turn)
    volume = linear((0.2, 0.1, 0.4), 0.3, shade=False, transfer=transfer, **fields)
    enter, leave, stretch = box_entry(volume, SMALL, offset)
    hit = leave > enter
    eye, direction = eye_and_direction(SMALL, offset)
    first, last = (scalar_at(volume, eye + t[:, None] * direction) for t in (enter, leave))
    above = np.clip((np.maximum(first, last) - 2.5) / np.maximum(np.abs(last - first), 1e-300), 0.0, 1.0)
    length = above * (leave - enter) * stretch
    np.testing.assert_allclose(see(volume, offset, step=step).through[hit], np.exp(-1.5 * length[hit]), rtol=1e-6)


@pytest.mark.parametrize(("step", "tolerance"), [(1e4, 3e-4), (1.0, 1e-5), (0.25, 2e-5)])
def test_colour_within_a_slab_is_attenuated(step, tolerance):
    """Colour runs linearly from 0 to 1, τ is constant: ∫ τ·x/L·exp(−τx) dx = (1 − exp(−τL))/(τL) − exp(−τL)."""
    shape = (9, 9, 9)
    for sign in (-1, 1):
        transfer = Transfer([(0, 0, 0, 0, 1.0), (8, 1, 1, 1, 1.0)])
        fields = centred((0.25, 0.25, 0.125), shape) | {"shade": False, "transfer": transfer}
        volume = linear((0, 0, sign), 0 if sign > 0 else 8, shape, **fields)  # front to back: z falls
        enter, leave, stretch = box_entry(volume, SMALL, 0.5)
        through = (leave - enter > 1 - 1e-9) & (leave - enter < 1 + 1e-9)  # from the front face to the back face
        assert through.sum() > 20
        x = stretch[through]  # = τL
        rising = (1 - np.exp(-x)) / x - np.exp(-x)
        expected = rising if sign < 0 else 1 - np.exp(-x) - rising
        found = see(volume, 0.5, step=step).color[through, 0]
        np.testing.assert_allclose(found, expected, atol=tolerance)


def blobs(seed=0, n=14):
    """A smooth random field in 0…1."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).random((n, n - 2, n + 2)), 1.5)
    return (field - field.min()) / np.ptp(field)


VIVID = Transfer([(0.2, 0, 0, 1, 0.0), (0.5, 0, 1, 0, 2.0), (0.7, 1, 0.5, 0, 0.5), (1.0, 1, 1, 1, 6.0)])


def test_converges_to_the_emission_absorption_integral():
    values = blobs()
    turn = rotation((1, 2, 0.5), 40)
    volume = Volume(values, shade=False, transfer=VIVID, **centred((0.15, 0.2, 0.15), values.shape, turn=turn))
    eye, direction = eye_and_direction(SMALL, -0.6)
    enter, leave, stretch = box_entry(volume, SMALL, -0.6)
    hit = leave > enter
    n = 4000
    t = enter[hit, None] + (np.arange(n) + 0.5) / n * (leave - enter)[hit, None]
    points = eye + t[..., None] * direction[hit, None]
    index = apply(np.linalg.inv(volume.world_from_index), points.reshape(-1, 3))
    s = ndimage.map_coordinates(values, index.T[::-1], order=1, mode="nearest").reshape(t.shape)
    value = VIVID.evaluate(s)
    optical = value[..., 3] * ((leave - enter) * stretch)[hit, None] / n
    before = np.exp(-(np.cumsum(optical, axis=1) - optical))
    light = np.sum((before * (1 - np.exp(-optical)))[..., None] * value[..., :3], axis=1)
    through = np.exp(-optical.sum(axis=1))
    assert through.min() < 0.1 and len(t) > 50
    errors = []
    for step in (2.0, 1.0, 0.5, 0.1):
        seen = see(volume, -0.6, step=step)
        errors.append([np.abs(seen.through[hit] - through).max(), np.abs(seen.color[hit] - light).max()])
    errors = np.array(errors)
    assert (errors[1:] < 0.5 * errors[:-1]).all()
    assert errors[1].max() < 0.025 and errors[3].max() < 5e-4


def test_does_not_depend_on_the_sampling_rate():
    values = ndimage.zoom(blobs(), 3, order=3).clip(0, 1)
    volume = Volume(values, transfer=VIVID, **centred((0.05, 0.06, 0.05), values.shape))
    coarse, fine = (draw_views(volume, SMALL, (-0.5, 0.5), step=s)[0].astype(int) for s in (2.0, 0.5))
    assert np.ptp(fine[..., :3]) > 150
    assert np.abs(coarse - fine).max() <= 10 and np.abs((coarse - fine).mean()) < 0.3


def test_slabs_agree_with_the_pre_integration_table():
    rng = np.random.default_rng(1)
    grid = np.linspace(0, 1, 33)
    table = VIVID.table(0, 1, 33, 0.7)
    i, j = rng.integers(0, 33, (2, 200))
    lit = (np.maximum(i, j) > 7)  # else transparent
    color = reference.slab_color(VIVID, grid[i], grid[j], np.full(200, 0.7), reference.PIECES[1])
    np.testing.assert_allclose(color[lit], table[i, j, :3][lit], atol=3e-3)


# --- geometry --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["composite", "mip"])
@pytest.mark.parametrize("direction", DIRECTIONS, ids=["upright", "swapped", "oblique"])
def test_bright_voxel_appears_where_its_centre_projects(mode, direction):
    """Array axes are (z, y, x), spacings differ, the direction's columns are the axes: positions pin them all."""
    values = np.zeros((7, 9, 11), np.uint8)
    values[2, 6, 3] = 200
    transfer = Transfer([(0, 1, 1, 1, 0.0), (200, 1, 1, 1, 2.0)])
    spacing, origin = np.array((0.11, 0.13, 0.17)), np.array((0.1, -0.3, -4.6))
    volume = Volume(values, spacing, origin, direction, transfer, shade=False, mode=mode)
    position = apply(EYE, origin + direction @ (spacing * (3, 6, 2)))
    camera = replace(CAMERA, fx=150.0, fy=170.0, width=150, height=150, offset_y=0.1)
    offsets = np.arange(-2, 3) * 0.15
    found = []
    for offset in offsets:
        alpha = 1 - see(volume, offset, camera, step=0.2).through.reshape(150, 150)
        rows, columns = np.mgrid[0.5:150, 0.5:150]
        found.append([np.sum(alpha * columns) / alpha.sum(), np.sum(alpha * rows) / alpha.sum()])
        x, y = project(camera, position, offset)
        np.testing.assert_allclose(found[-1], (x, y), atol=0.1)
        np.testing.assert_allclose(np.unravel_index(alpha.argmax(), alpha.shape), (y - 0.5, x - 0.5), atol=1.0)
    np.testing.assert_allclose(np.mean(found, axis=0), project(camera, position, 0.0), atol=0.08)  # x is linear in v


def test_planes_are_even_and_those_of_the_finest_volume():
    one = homogeneous(1.0, **centred((0.5, 0.5, 0.25), (5, 5, 5)))
    two = homogeneous(1.0, **centred((0.4, 0.3, 0.6), (5, 5, 5), depth=5.0))
    fields = [f.in_eye_space(CAMERA) for f in engine.prepare(Scene([one, two])).fields]
    depths = reference.planes(fields, CAMERA, 0.7)
    assert depths[0] == 3.5 and depths[-1] == pytest.approx(6.2)  # 4 − 0.5 … 5 + 1.2
    assert len(depths) - 1 == np.ceil(2.7 / (0.7 * 0.25))
    np.testing.assert_allclose(np.diff(depths), 2.7 / 16)
    assert len(reference.planes(fields[:1], CAMERA, 1e5)) == 2
    np.testing.assert_allclose(reference.planes(fields, replace(CAMERA, near=4.0), 1e5), (4.0, 6.2))
    with pytest.raises(InputError, match="step"):
        reference.planes(fields, CAMERA, 1e-7)


def test_trilinear_interpolation():
    rng = np.random.default_rng(2)
    grid = rng.integers(0, 60000, (4, 5, 6)).astype(np.uint16)
    index = rng.uniform(0, (5, 4, 3), (300, 3))
    expected = ndimage.map_coordinates(grid.astype(float), index.T[::-1], order=1)
    np.testing.assert_allclose(reference.trilinear(grid, index), expected, rtol=1e-12)
    corners = np.array([(0, 0, 0), (5, 4, 3), (5, 0, 3), (2, 3, 1)])
    np.testing.assert_array_equal(reference.trilinear(grid, corners * 1.0), grid[tuple(corners.T[::-1])])
    np.testing.assert_array_equal(reference.trilinear(np.full((3, 3, 3), 0.1), rng.uniform(0, 2, (50, 3))), 0.1)


@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16", "float32", "float64"])
def test_all_types_of_values_look_the_same(dtype):
    values = np.floor(blobs(1) * 100)
    fields = {"transfer": Transfer([(0, *GREY, 0), (100, 1, 0, 0, 3)]), **centred((0.2, 0.2, 0.2), values.shape)}
    first, _ = draw_views(Volume(values, **fields), SMALL)
    second, _ = draw_views(Volume(values.astype(dtype), **fields), SMALL)
    assert np.ptp(first) > 50
    np.testing.assert_array_equal(first, second)


# --- shading ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["central", "sobel"])
def test_voxel_gradients(kind):
    volume = linear((2.0, -3.0, 0.5), 1.0)
    gradients = reference.voxel_gradients(volume.values, kind)
    np.testing.assert_allclose(gradients, np.broadcast_to((2.0, -3.0, 0.5), gradients.shape), atol=1e-12)
    noise = np.random.default_rng(3).integers(0, 255, (5, 6, 7)).astype(np.uint8)
    inner = (slice(1, -1),) * 3
    for axis in range(3):
        if kind == "sobel":
            expected = ndimage.sobel(noise.astype(float), axis)[inner] / 32
        else:
            expected = ndimage.correlate1d(noise.astype(float), [-0.5, 0, 0.5], axis)[inner]
        np.testing.assert_allclose(reference.voxel_gradients(noise, kind)[inner][..., 2 - axis], expected, atol=1e-12)


@pytest.mark.parametrize("shading", ["exact", "center"])
def test_both_sides_of_the_gradient_are_lit(shading):
    material = Material(0.1, 0.6, 0.5, 9.0)
    lights = [PointLight((1.0, 2.0, 1.0), (0.9, 0.5, 0.1)), DirectionalLight((0.3, -0.2, 1), (0.2, 0.3, 0.4))]
    turn = rotation((1, 2, 0), 35)
    fields = centred((0.3, 0.5, 0.4), (6, 6, 6), turn=turn) | {"material": material}
    color = np.array((0.2, 0.4, 0.6))
    fields["transfer"] = Transfer([(0, *color, 1e4)])  # opaque: all light comes from where the ray enters
    volumes = [linear((s, 2 * s, -s), 1.0, (6, 6, 6), **fields) for s in (1.0, -1.0)]
    slope = np.array((1.0, 2.0, -1.0)) / (0.3, 0.5, 0.4)
    normal = turn[:3, :3] @ slope / np.linalg.norm(slope)
    eye, direction = eye_and_direction(SMALL, 0.5)
    enter, leave, _ = box_entry(volumes[0], SMALL, 0.5)
    step = 0.01  # shading is that of a slab's middle
    both = [see(Scene(v, lights), 0.5, step=step, shading=shading) for v in volumes]
    np.testing.assert_allclose(both[0].color, both[1].color, atol=1e-12)
    viewer = eye if shading == "exact" else np.zeros(3)
    for ray in np.nonzero(leave > enter + 0.1)[0][::7]:
        point = eye + enter[ray] * direction[ray]
        expected = color * 0.1
        for light in lights:
            if isinstance(light, PointLight):
                towards = np.array(light.position) - point
            else:
                towards = -np.array(light.direction)
            towards = towards / np.linalg.norm(towards)
            view = (viewer - point) / np.linalg.norm(viewer - point)
            half = (towards + view) / np.linalg.norm(towards + view)
            expected = expected + color * 0.6 * abs(normal @ towards) * light.color
            expected = expected + 0.5 * abs(normal @ half) ** 9 * np.array(light.color)
        np.testing.assert_allclose(both[0].color[ray], expected, atol=2e-3)


def test_where_nothing_changes_there_is_no_shading():
    plain = homogeneous(1.0, (0.3, 0.6, 0.9), **centred((0.5, 0.5, 0.5), (5, 5, 5)))
    shaded = replace(plain, shade=True, material=Material(0.0, 0.1, 0.9))
    np.testing.assert_array_equal(see(plain).color, see(shaded).color)


# --- maximum and isosurface --------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(turns, st.floats(-1, 1), st.sampled_from([0.7, 1e4]))
def test_maximum_of_a_linear_field_is_at_an_end(turn, offset, step):
    transfer = Transfer([(0, 1, 0, 0, 0.0), (2, 0, 1, 0, 1.0), (4, 0, 0, 1, 4.0)])
    fields = centred((0.4, 0.3, 0.4), (6, 7, 8), turn=turn)
    volume = linear((0.2, 0.1, 0.3), 0.0, mode="mip", transfer=transfer, **fields)
    enter, leave, _ = box_entry(volume, SMALL, offset)
    hit = leave > enter
    eye, direction = eye_and_direction(SMALL, offset)
    ends = np.array([scalar_at(volume, eye + t[:, None] * direction) for t in (enter, leave)])
    value = transfer.evaluate(ends.max(axis=0))
    alpha = np.where(hit, value[:, 3] / 4.0, 0.0)
    background = (0.25, 0.5, 0.75)
    seen = see(Scene(volume, background=background), offset, step=step)
    np.testing.assert_allclose(1 - seen.through, alpha, atol=1e-9)
    expected = alpha[:, None] * value[:, :3] + (1 - alpha)[:, None] * background
    np.testing.assert_allclose(seen.color, expected, atol=1e-9)
    sure = hit & (np.abs(alpha - 0.5) > 1e-6) & (np.abs(ends[0] - ends[1]) > 1e-9)
    depth = np.where(alpha >= 0.5, np.where(ends[0] >= ends[1], enter, leave), np.inf)
    np.testing.assert_allclose(seen.depth[sure], depth[sure], rtol=1e-9)


def test_maximum_finds_a_peak_between_planes():
    values = blobs(3)
    volume = Volume(values, mode="mip", transfer=Transfer([(0, 0, 0, 0, 0), (1, 1, 1, 1, 1)]),
                    **centred((0.2, 0.2, 0.2), values.shape))  # fmt: skip
    coarse, fine = (1 - see(volume, 0.3, step=s).through for s in (1.0, 0.05))
    assert (fine >= coarse - 0.01).all() and np.abs(fine - coarse).max() < 0.05 and fine.max() > 0.9


@settings(max_examples=20, deadline=None)
@given(turns, st.floats(-1, 1), st.sampled_from([0.5, 3.0]))
def test_isosurface_of_a_linear_field_is_a_plane(turn, offset, step):
    fields = centred((0.4, 0.3, 0.4), (6, 7, 8), turn=turn)
    volume = linear((0.2, 0.1, 0.4), 0.3, mode="iso", iso=2.1, shade=False, **fields)
    enter, leave, _ = box_entry(volume, SMALL, offset)
    eye, direction = eye_and_direction(SMALL, offset)
    first, last = (scalar_at(volume, eye + t[:, None] * direction) for t in (enter, leave))
    hit = (leave > enter) & ((first - 2.1) * (last - 2.1) < 0)
    sure = hit | (leave < enter - 1e-9) | ((first - 2.1) * (last - 2.1) > 1e-9)
    depth = enter + (leave - enter) * (2.1 - first) / np.where(hit, last - first, 1.0)
    seen = see(volume, offset, step=step)
    np.testing.assert_allclose(seen.depth[sure], np.where(hit, depth, np.inf)[sure], rtol=1e-8)
    np.testing.assert_array_equal(seen.through[sure], np.where(hit, 0.0, 1.0)[sure])


def test_isosurface_of_a_radial_field_is_a_sphere():
    n, radius = 61, 0.8
    k, j, i = np.mgrid[:n, :n, :n] / (n - 1) * 2 - 1
    values = 1 - np.sqrt(i * i + j * j + k * k)
    color = np.array((0.9, 0.5, 0.3))
    light = DirectionalLight((0.5, -0.3, -1.0))
    material, transfer = Material(0.1, 0.9, 0.4, 10.0), Transfer([(0, *color, 1)])
    volume = Volume(values, (2 / (n - 1),) * 3, (-1, -1, -1), mode="iso", iso=1 - radius, material=material,
                    transfer=transfer, transform=translation(0, 0, -4))  # fmt: skip
    camera = replace(CAMERA, fx=100.0, fy=100.0)
    for offset in (-1.0, 0.0, 0.7):
        eye, direction = eye_and_direction(camera, offset)
        centre = np.array((0.0, 0.0, -4.0))
        a, b = np.sum(direction**2, axis=1), direction @ (eye - centre)
        c = (eye - centre) @ (eye - centre) - radius**2
        square = b * b - a * c
        depth = np.where(square > 0, (-b - np.sqrt(np.maximum(square, 0))) / a, np.inf)
        clear = np.abs(square) / a > 0.02  # away from the outline
        seen = see(Scene(volume, [light]), offset, camera)
        np.testing.assert_allclose(seen.depth[clear], depth[clear], atol=2e-3)
        hit = clear & (square > 0)
        assert hit.sum() > 500
        point = eye + depth[hit, None] * direction[hit]
        normal = (point - centre) / radius
        towards = -np.array(light.direction) / np.linalg.norm(light.direction)
        view = (eye - point) / np.linalg.norm(eye - point, axis=1, keepdims=True)
        half = (towards + view) / np.linalg.norm(towards + view, axis=1, keepdims=True)
        cosine, gloss = normal @ towards, np.maximum(np.sum(normal * half, axis=1), 0) ** 10
        expected = color * (0.1 + 0.9 * np.maximum(cosine, 0))[:, None] + 0.4 * np.where(cosine > 0, gloss, 0)[:, None]
        np.testing.assert_allclose(seen.color[hit], np.clip(expected, 0, 1), atol=0.01)
    inside = replace(volume, values=1.0 - values, iso=radius)  # the gradient points the other way
    np.testing.assert_allclose(see(inside, 0.7, camera).color, see(volume, 0.7, camera).color, atol=1e-9)


def test_first_of_several_isosurfaces_is_seen_and_no_lid_closes_a_cut():
    values = np.zeros((9, 9, 9))
    values[2] = values[6] = 1.0  # two sheets across the line of sight
    fields = centred((0.5, 0.5, 0.5), values.shape)
    volume = Volume(values, mode="iso", iso=0.5, **fields)
    camera = replace(SMALL, fx=60.0, fy=60.0)
    _, depth = draw_views(volume, camera)
    np.testing.assert_allclose(depth, 4 - 1.25)  # between layers 6 and 7, z = +1.25
    _, depth = draw_views(replace(volume, clip_box=[(-9, -9, -9), (9, 9, 1.0)]), camera)
    np.testing.assert_allclose(depth, 4 - 0.75)  # the cut is inside the sheet: its back is seen


# --- panels, samples, passes -----------------------------------------------------------------------------------


OFFSETS = (np.arange(6) - 2.5) / 4
MASK = ViewMap(6, a=0.2, b=-0.07, offsets=np.array([[0.1, 0.17, 0.24]]))


def still_life():
    values = blobs(4)
    return Scene(Volume(values, transfer=VIVID, material=Material(specular=0.3), **centred((0.15,) * 3, values.shape)),
                 background=(0.1, 0.2, 0.3))  # fmt: skip


@pytest.mark.parametrize("mode", ["composite", "mip", "iso"])
@pytest.mark.parametrize("flip", [(False, False), (True, True)])
def test_panel_is_the_interlaced_views(mode, flip):
    scene = Scene(replace(still_life().objects[0], mode=mode), background=(0.1, 0.2, 0.3))
    draw = Draw(SMALL, OFFSETS, (-1, 1), MASK, *flip)
    views, _ = draw_views(scene, SMALL, OFFSETS)
    woven = np.zeros((16, 20, 3), np.uint8)
    engine.interlace(views, draw, woven)
    assert np.ptp(woven) > 50
    np.testing.assert_array_equal(draw_panel(scene, draw), woven)


def test_continuous_panel_traces_every_sub_pixel_from_its_own_camera():
    viewmap = ViewMap(6, a=0.25, b=0.125, offsets=np.array([[0.0, 0.0625, 0.5]]), continuous=True)
    draw = Draw(SMALL, OFFSETS, (-1, 1), viewmap)
    panel = draw_panel(still_life(), draw)
    v = panel_samples(draw).v[..., 0]
    offsets, index = np.unique(v, return_inverse=True)
    views, _ = draw_views(still_life(), SMALL, offsets)
    rows, columns, channels = np.ogrid[:16, :20, :3]
    np.testing.assert_array_equal(panel, views[index.reshape(v.shape), rows, columns, channels])


def test_averaged_alpha_of_one_slab():
    """One slab: each channel emits its own light, and lets through the background by the mean of the three alphas."""
    color, background = (0.9, 0.6, 0.3), (0.2, 0.4, 1.0)
    volume = homogeneous(0.7, color, **centred((0.5, 0.5, 0.5), (5, 5, 5)))
    draw = Draw(SMALL, OFFSETS, (-1, 1), MASK, options=Options(alpha="averaged", step=1e5))
    panel = draw_panel(Scene(volume, background=background), draw)
    alpha = np.stack([1 - see(volume, offset).through.reshape(16, 20) for offset in OFFSETS])
    view = MASK.view(np.arange(16), np.arange(20))
    own = alpha[view, np.arange(16)[:, None, None], np.arange(20)[:, None]]
    mean = own.mean(axis=2, keepdims=True)
    assert np.ptp(own - mean) > 0.1
    expected = own * color + (1 - mean) * background
    np.testing.assert_array_equal(panel, np.floor(255 * expected + 0.5))


def test_averaged_alpha_of_many_slabs():
    scene = Scene(replace(still_life().objects[0], shade=False), background=(0.1, 0.2, 0.3))
    draw = Draw(SMALL, OFFSETS, (-1, 1), MASK, options=Options(alpha="averaged"))
    panel = draw_panel(scene, draw)
    exact = draw_panel(scene, replace(draw, options=Options()))
    assert 2 < np.abs(panel.astype(int) - exact).max() < 60

    field = engine.prepare(scene).fields[0].in_eye_space(SMALL)
    depths = reference.planes([field], SMALL, 1.0)
    rays = Rays.through(SMALL, panel_samples(draw))
    _, optical, color = reference.slabs(field, rays, depths, np.full(len(rays), np.inf), [])
    optical, color = optical.reshape(16, 20, 3, -1), color.reshape(16, 20, 3, -1, 3)
    expected, through = np.zeros((16, 20, 3)), np.ones((16, 20, 1))
    for k in range(len(depths) - 1):
        alpha = 1 - np.exp(-optical[..., k])
        expected += through * alpha * color[:, :, range(3), k, range(3)]
        through = through * (1 - alpha.mean(axis=2, keepdims=True))
    expected = np.floor(255 * (expected + through * scene.background) + 0.5)
    assert np.abs(panel - expected).max() <= 1 and (panel != expected).mean() < 0.01  # sums in another order


@pytest.mark.parametrize("samples", [1, 4])
def test_averaged_alpha_is_exact_where_views_are_equal(samples):
    draw = Draw(SMALL, np.zeros(6), (-1, 1), MASK, options=Options(alpha="averaged", samples=samples))
    averaged = draw_panel(still_life(), draw)
    exact = draw_panel(still_life(), replace(draw, options=Options(samples=samples)))
    assert np.abs(averaged.astype(int) - exact).max() <= 1 and (averaged != exact).mean() < 0.01


def test_samples_are_a_finer_picture_averaged():
    fine = replace(SMALL, fx=40.0, fy=48.0, width=40, height=32)
    color, depth = draw_views(still_life(), SMALL, OFFSETS[:2], samples=4)
    full, full_depth = draw_views(still_life(), fine, OFFSETS[:2])
    blocks = full.reshape(2, 16, 2, 20, 2, 4)
    np.testing.assert_array_equal(color, (blocks.sum(axis=(2, 4), dtype=int) + 2) // 4)
    np.testing.assert_array_equal(depth, full_depth.reshape(2, 16, 2, 20, 2).min(axis=(2, 4)))


def test_pictures_do_not_depend_on_how_much_is_held_at_a_time(monkeypatch):
    draw = Draw(SMALL, OFFSETS, (-1, 1), MASK, options=Options(alpha="averaged"))
    scenes = [Scene(replace(still_life().objects[0], mode=mode)) for mode in ("composite", "mip", "iso")]
    first = [(*draw_views(scene, SMALL), draw_panel(scene, draw)) for scene in scenes]
    monkeypatch.setattr(reference, "SAMPLES", 70)
    for scene, expected in zip(scenes, first, strict=True):
        for a, b in zip((*draw_views(scene, SMALL), draw_panel(scene, draw)), expected, strict=True):
            np.testing.assert_array_equal(a, b)


def test_n_pass_gives_the_same_views():
    rig = Rig(position=(0, 0, 0), target=(0, 0, -4), views=3)
    options = Options(depth=True)
    stacks = [
        render_views(still_life(), rig, (24, 20), method=method, engine="reference", options=options)
        for method in ("single-pass", "n-pass")
    ]
    assert np.ptp(stacks[0].color) > 50
    np.testing.assert_array_equal(stacks[0].color, stacks[1].color)
    np.testing.assert_array_equal(stacks[0].depth, stacks[1].depth)
