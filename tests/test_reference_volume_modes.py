"""The reference engine's shading of volumes, its other modes, and its panels, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from autostereo import DirectionalLight, Material, Options, PointLight, Rig, Scene, ViewMap, Volume
from autostereo import TransferFunction as Transfer
from autostereo.engines.engine import Draw
from autostereo.engines.reference import volume as reference
from autostereo.engines.reference.engine import panel_samples
from autostereo.engines.reference.rays import Rays
from autostereo.render import render_views
from autostereo.transforms import rotation, translation
from eye_scenes import CAMERA, draw_panel, draw_views, engine
from volume_scenes import (
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
