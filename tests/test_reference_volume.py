"""The reference engine's composite volumes against closed forms and plain numeric integration."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from autostereo import InputError, Scene, Volume
from autostereo import TransferFunction as Transfer
from autostereo.engines.reference import volume as reference
from autostereo.engines.reference.mesh import project
from autostereo.transforms import apply, rotation, scaling, translation
from eye_scenes import CAMERA, EYE, draw_views, engine
from volume_scenes import (
    GREY,
    SMALL,
    VIVID,
    blobs,
    box_entry,
    centred,
    eye_and_direction,
    homogeneous,
    linear,
    scalar_at,
    see,
    turns,
)

DIRECTIONS = [np.eye(3), np.eye(3)[:, [2, 0, 1]] * (1, -1, 1), rotation((1, 1, 0.3), 50)[:3, :3]]

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
