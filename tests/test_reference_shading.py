"""The reference engine's shading and textures against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autostereo import DirectionalLight, Material, PointLight, Scene
from autostereo.engines.reference.texture import box_weights, level_of_detail, mip_levels, trilinear
from autostereo.transforms import rotation
from eye_scenes import CAMERA, EYE, draw_views, quad

# --- shading -----------------------------------------------------------------------------------------


def lit_by_hand(point, normal, eye, kd, material, lights):
    """The formula of DESIGN section 5, one sample, plain Python."""
    color = kd * material.ambient
    for light in lights:
        if isinstance(light, PointLight):
            towards = np.array(light.position) - point
        else:
            towards = -np.array(light.direction)
        towards = towards / np.linalg.norm(towards)
        view = (eye - point) / np.linalg.norm(eye - point)
        half = (towards + view) / np.linalg.norm(towards + view)
        if normal @ towards > 0:
            color = color + kd * material.diffuse * (normal @ towards) * light.color
            color = color + material.specular * max(normal @ half, 0.0) ** material.shininess * np.array(light.color)
    return np.floor(255 * np.clip(color, 0, 1) + 0.5)


@pytest.mark.parametrize("shading", ["exact", "center", "reuse"])
def test_samples_are_lit_for_their_own_eye(shading):
    material = Material(0.1, 0.6, 0.7, 20.0, two_sided=True)
    lights = [PointLight((0.5, 1.0, 1.0), (0.9, 0.5, 0.1)), DirectionalLight((0.3, 0.1, -2), (0.2, 0.3, 0.4)),
              DirectionalLight((1, 0, 0.2))]  # fmt: skip
    normals = np.array([(0.4, 0, 1), (-0.4, 0.2, 1), (0, 0.5, 1), (0, -0.5, 1.0)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    kd = np.array([0.9, 0.5, 0.25])
    mesh = quad(-1, 1, -1, 1, 4.0, normals=normals, colors=np.tile(kd, (4, 1)), material=material)
    offsets = (-1.0, 0.5)
    color, _ = draw_views(Scene(mesh, lights), offsets=offsets, shading=shading)
    for v, offset in enumerate(offsets):
        for r, x in ((12, 20), (24, 32), (30, 44), (36, 17)):
            point = np.array([(x + 0.5 - 32) / 16, (24 - r - 0.5) / 16, -4.0])
            s, t = (point[0] + 1) / 2, (point[1] + 1) / 2
            w = (1 - s, s - t, t, 0) if s >= t else (1 - t, 0, s, t - s)
            normal = np.array(w) @ normals
            eye = np.array([0.0 if shading == "center" else offset, 0.0, 0.0])
            expected = lit_by_hand(point, normal / np.linalg.norm(normal), eye, kd, material, lights)
            np.testing.assert_array_equal(color[v, r, x, :3], expected)


def test_the_default_light_shines_along_the_centre_line_of_sight():
    camera = replace(CAMERA, eye_from_world=EYE @ rotation((0, 1, 0), 30))
    mesh = replace(quad(-1, 1, -1, 1, 4.0, material=Material(0.25, 0.5)), transform=rotation((0, 1, 0), -30))
    color, _ = draw_views(mesh, camera, offsets=(-0.5, 0.5))
    assert set(np.unique(color[color[..., 3] > 0][:, :3])) == {191}


def test_vertex_lighting_interpolates_unclamped_light_of_the_centre_eye():
    material = Material(0.5, 2.0, two_sided=True)
    normals = np.array([(0, 0, 1.0), (1, 0, 0), (1, 0, 0), (0, 0, 1.0)])
    colors = np.array([(0.5, 0.25, 1), (0.25, 0.5, 1), (0.25, 0.5, 1), (0.5, 0.25, 1)])
    mesh = quad(-1, 1, -1, 1, 4.0, normals=normals, colors=colors, material=material)
    texture = np.full((1, 1, 3), 51, np.uint8)  # 0.2
    textured = replace(mesh, uv=np.zeros((4, 2)), texture=texture)
    s = ((np.arange(16, 48) + 0.5 - 32) / 16 + 1)[:, None] / 2
    light = (1 - s) * colors[0] * 2.5 + s * colors[1] * 0.5
    for item, tint in ((mesh, 1.0), (textured, 0.2)):
        color, _ = draw_views(item, offsets=(-0.5, 0.0), lighting="vertex")
        expected = np.floor(255 * np.clip(light * tint, 0, 1) + 0.5)
        np.testing.assert_allclose(color[:, 20, 16:48, :3], np.broadcast_to(expected, (2, 32, 3)), atol=1e-9)


def test_background_alpha_and_depth_where_nothing_is():
    color, depth = draw_views(Scene(quad(5, 6, 5, 6, 4.0), background=(0.5, 0.25, 1.0)))
    assert (color == (128, 64, 255, 0)).all() and (depth == np.inf).all()


# --- textures ----------------------------------------------------------------------------------------

MARKED = np.array([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 255)]], np.uint8)  # rows from the top
UNIT_UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)])


def test_texture_stands_upright_and_repeats():
    color, _ = draw_views(quad(-1 / 16, 1 / 16, -1 / 16, 1 / 16, 4.0, uv=UNIT_UV, texture=MARKED))
    np.testing.assert_array_equal(color[0, 23:25, 31:33, :3], MARKED)  # a texel a pixel
    twice, _ = draw_views(quad(-1, 1, -1, 1, 4.0, uv=2 * UNIT_UV, texture=MARKED))
    tile = twice[0, 8:40, 16:48]
    np.testing.assert_array_equal(tile[:16, :16], tile[16:, 16:])
    np.testing.assert_array_equal(tile[:16, :16], tile[:16, 16:])


@pytest.mark.parametrize("shift", [(4096, -4096), (-1, 0), (0.0, 77)])
def test_whole_texture_shifts_change_nothing(shift):
    texture = np.random.default_rng(6).integers(0, 256, (8, 8, 3)).astype(np.uint8)
    plain, moved = (
        draw_views(quad(-1, 1, -1, 1, 2.0, uv=UNIT_UV * 3 + s, texture=texture), offsets=(-0.5, 0.5))[0]
        for s in ((0, 0), shift)
    )
    np.testing.assert_array_equal(plain, moved)


@pytest.mark.parametrize("level", [0, 1, 2])
def test_plane_with_two_to_the_level_texels_per_pixel_shows_that_mip_level(level):
    texture = np.random.default_rng(7).integers(0, 256, (32, 32, 3)).astype(np.uint8)
    half = 16 / 2**level / 16  # 32/2^level pixels wide at depth 4
    color, _ = draw_views(quad(-half, half, -half, half, 4.0, uv=UNIT_UV, texture=texture), offsets=(0.0, 0.5))
    n, k = 32 >> level, 1 << level
    mean = texture.reshape(n, k, n, k, 3).mean(axis=(1, 3))
    top, left = 24 - n // 2, 32 - n // 2
    for picture in color:
        np.testing.assert_allclose(picture[top : top + n, left : left + n, :3], np.floor(mean + 0.5), atol=1)


def test_level_of_detail_takes_the_longer_axis_and_blends_levels():
    levels = mip_levels(np.zeros((16, 64, 3), np.uint8))
    assert [level.shape[:2] for level in levels] == [(16, 64), (8, 32), (4, 16), (2, 8), (1, 4), (1, 2), (1, 1)]
    dx = np.array([(4 / 64, 0), (0, 1 / 16), (0.1 / 64, 0), (0, 1e9), (0, 0)])
    dy = np.array([(0, 1 / 16), (0, 2**1.5 / 16), (0, 0), (0, 0), (0, 0)])
    np.testing.assert_allclose(level_of_detail(levels, dx, dy), [2, 1.5, 0, 6, 0], atol=1e-12)
    steps = [np.full(level.shape, k, np.float32) for k, level in enumerate(levels)]
    detail = np.array([0, 0.25, 3.5, 6])
    np.testing.assert_array_equal(trilinear(steps, np.full((4, 2), 0.3), detail)[:, 0], detail)


@given(st.integers(1, 200))
def test_box_filter_weights_every_texel_alike(size):
    weights = box_weights(size)
    smaller = max(1, size // 2)
    assert weights.shape == (smaller, size)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(weights.sum(axis=0), smaller / size, atol=1e-12)
    np.testing.assert_allclose(weights, weights[::-1, ::-1], atol=1e-12)
    if size % 2 == 0:
        np.testing.assert_array_equal(weights, np.repeat(np.eye(smaller), 2, axis=1) / 2)
