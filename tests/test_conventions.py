"""CONVENTIONS.md, statement by statement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.transforms import apply, eye_from_world, rotation, translation
from autostereo.viewmap import ViewMap, offset_at

RIG = aus.Rig(position=(0, 0, 4), target=(0, 0, 0), fov_y=36.0, baseline=1.2, views=5)
SIZE = (60, 40)  # width, height


def square(center: tuple[float, float, float], half: float, color: tuple[float, float, float]) -> aus.Mesh:
    """A square that faces +z, two triangles, counter-clockwise seen from +z."""
    x, y, z = center
    corners = [(x - half, y - half, z), (x + half, y - half, z), (x + half, y + half, z), (x - half, y + half, z)]
    flat = aus.Material(ambient=1.0, diffuse=0.0)
    return aus.Mesh(corners, [[0, 1, 2], [0, 2, 3]], colors=[color] * 4, material=flat)


def draw(*meshes: aus.Mesh, rig: aus.Rig = RIG, **options: object) -> aus.ViewStack:
    return aus.render_views(
        aus.Scene(meshes), rig, SIZE, engine="reference", options=aus.Options(**options)  # type: ignore[arg-type]
    )


def centroid(stack: aus.ViewStack) -> np.ndarray:
    """Centroid (V, 2) of the covered pixels, (x, r)."""
    result = []
    for alpha in stack.color[..., 3]:
        r, x = np.nonzero(alpha)
        result.append((x.mean() + 0.5, r.mean() + 0.5))
    return np.array(result)


# --- space ---------------------------------------------------------------------------------------------------------
def test_matrices_act_on_column_vectors_and_chain_dest_from_source() -> None:
    moved_then_turned = rotation((0, 0, 1), 90) @ translation(1, 0, 0)
    assert np.allclose(apply(moved_then_turned, [(0, 0, 0)]), [(0, 1, 0)])  # right-handed: x turns to y


def test_eye_space_is_x_right_y_up_depth_forward() -> None:
    eye = eye_from_world((0, 0, 4), (0, 0, 0), (0, 1, 0))
    assert np.allclose(apply(eye, [(1, 0, 0), (0, 1, 0), (0, 0, 1)]), [(1, 0, 4), (0, 1, 4), (0, 0, 3)])


def test_depth_is_eye_z_not_distance() -> None:
    depth = draw(square((0, 0, 0), 50.0, (1, 1, 1)), depth=True).depth
    assert depth is not None and depth.dtype == np.float32
    assert np.allclose(depth, 4.0)


def test_depth_is_infinite_where_nothing_was_hit() -> None:
    stack = draw(square((0, 0, 0), 0.3, (1, 1, 1)), depth=True)
    assert stack.depth is not None
    assert np.array_equal(np.isinf(stack.depth), stack.color[..., 3] == 0)
    assert np.isinf(stack.depth).any() and np.isfinite(stack.depth).any()


def test_front_is_counter_clockwise() -> None:
    front = square((0, 0, 0), 0.5, (1, 1, 1))
    one_sided = aus.Material(ambient=1.0, diffuse=0.0, two_sided=False)
    seen = aus.Mesh(front.vertices, front.faces, material=one_sided)
    hidden = aus.Mesh(front.vertices, front.faces[:, ::-1], material=one_sided)
    assert draw(seen).color[..., 3].any()
    assert not draw(hidden).color[..., 3].any()


# --- pictures ------------------------------------------------------------------------------------------------------
def test_size_is_width_height_and_arrays_are_rows_columns() -> None:
    stack = draw(square((0, 0, 0), 0.5, (1, 1, 1)))
    assert stack.color.shape == (5, 40, 60, 4) and stack.color.dtype == np.uint8
    assert (stack.views, stack.height, stack.width) == (5, 40, 60)


def test_row_0_is_the_top_and_column_0_the_left() -> None:
    rig = aus.Rig(views=1)
    up = centroid(draw(square((0, 0.8, 0), 0.2, (1, 1, 1)), rig=rig))[0]
    right = centroid(draw(square((0.8, 0, 0), 0.2, (1, 1, 1)), rig=rig))[0]
    assert up[1] < 20 and right[0] > 30


def test_pixel_centres_are_at_halves() -> None:
    """A square symmetric about the axis covers pixels symmetric about W/2, H/2."""
    covered = draw(square((0, 0, 0), 0.5, (1, 1, 1)), rig=aus.Rig(views=1)).color[0, ..., 3]
    assert np.array_equal(covered, covered[::-1, ::-1])


@pytest.mark.parametrize("value", [0.0, 0.2, 0.45, 0.63, 1.0])
def test_uint8_is_floor_of_255_v_plus_half(value: float) -> None:
    stack = draw(square((0, 0, 0), 50.0, (value, value, value)))
    assert (stack.color[..., :3] == int(255 * value + 0.5)).all()
    assert (stack.color[..., 3] == 255).all()


def test_colours_in_arrays_may_be_integers_0_to_255_others_are_plain_numbers() -> None:
    corners, red = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], (255, 0, 1)
    for thing in (aus.Mesh(corners, [(0, 1, 2)], colors=[red] * 3), aus.Points(corners, colors=[red] * 3)):
        assert thing.colors is not None and np.allclose(thing.colors, [(1, 0, 1 / 255)] * 3)
    assert aus.Scene(thing, background=(1, 0, 0)).background == (1.0, 0.0, 0.0)
    assert np.array_equal(aus.TransferFunction([(0, 1, 0, 0, 1)]).points[0, 1:4], (1, 0, 0))
    with pytest.raises(aus.InputError, match="background: expected values 0…1"):
        aus.Scene(thing, background=red)
    with pytest.raises(aus.InputError, match="expected colours 0…1"):
        aus.TransferFunction([(0, *red, 1)])
    assert aus.DirectionalLight((0, 0, -1), color=(255, -1, 1e6)).color == (255.0, -1.0, 1e6)
    with pytest.raises(aus.InputError, match="light color: expected three numbers within"):
        aus.DirectionalLight((0, 0, -1), color=(2e6, 0, 0))


def test_rgb_is_over_the_background_and_alpha_is_opacity() -> None:
    scene = aus.Scene(square((0, 0, 0), 0.3, (1, 1, 1)), background=(1.0, 0.0, 0.2))
    color = aus.render_views(scene, RIG, SIZE, engine="reference").color
    empty = color[color[..., 3] == 0]
    assert len(empty) and (empty[:, :3] == (255, 0, 51)).all()


def test_uv_origin_is_the_bottom_left_of_the_texture() -> None:
    texture = np.zeros((8, 8, 3), dtype=np.uint8)
    texture[4:, :4] = (255, 0, 0)  # rows from the top: the lower left quarter is red
    plain = square((0, 0, 0), 0.9, (1, 1, 1))
    mesh = aus.Mesh(
        plain.vertices, plain.faces, uv=[(0, 0), (1, 0), (1, 1), (0, 1)], texture=texture, material=plain.material
    )
    red = draw(mesh, rig=aus.Rig(views=1)).color[0, ..., 0] > 128
    r, x = np.nonzero(red)
    assert r.mean() > 20 and x.mean() < 30


# --- views ---------------------------------------------------------------------------------------------------------
def test_view_0_is_the_leftmost_camera() -> None:
    offsets = RIG.camera_offsets
    assert offsets.shape == (5,)
    assert (np.diff(offsets) > 0).all() and offsets[0] == -0.6 and offsets[-1] == 0.6
    assert (aus.Rig(views=1).camera_offsets == 0).all()


def test_near_things_move_left_far_things_right_things_in_focus_stay() -> None:
    near = centroid(draw(square((0, 0, 1.0), 0.2, (1, 1, 1))))
    focus = centroid(draw(square((0, 0, 0.0), 0.2, (1, 1, 1))))
    far = centroid(draw(square((0, 0, -2.0), 0.3, (1, 1, 1))))
    assert (np.diff(near[:, 0]) < 0).all() and (np.diff(far[:, 0]) > 0).all()
    assert (focus == focus[0]).all()
    for moving in (near, far):
        assert np.allclose(moving[:, 1], 20.0)  # the row is the same in every view


def test_camera_coordinate_is_i_at_camera_i_and_goes_on_beyond() -> None:
    offsets = RIG.camera_offsets
    assert np.allclose(offset_at(offsets, np.arange(5.0)), offsets)
    assert np.allclose(offset_at(offsets, np.array([-0.5, 1.5, 4.5])), [-0.75, -0.15, 0.75])


def test_phase_to_view_and_camera_coordinate() -> None:
    mask = ViewMap(8, a=0.1, b=0.0, offsets=np.array([[0.0, 0.03, 0.06]]))
    rows, columns = np.arange(1), np.arange(100)
    phase = mask.phase(rows, columns)
    assert ((phase >= 0) & (phase < 1)).all()
    assert np.array_equal(mask.view(rows, columns), np.floor(phase * 8))
    smooth = ViewMap(8, a=0.1, b=0.0, offsets=np.array([[0.0, 0.03, 0.06]]), continuous=True)
    assert np.array_equal(smooth.camera(rows, columns), phase * 8 - 0.5)


def test_reverse_turns_views_and_phase_round_and_keeps_phase_0() -> None:
    table = np.arange(6).reshape(1, 2, 3)
    rows, columns = np.arange(4), np.arange(10)
    plain, turned = ViewMap(6, table), ViewMap(6, table, reverse=True)
    assert np.array_equal(turned.view(rows, columns), 5 - plain.view(rows, columns))
    lens = ViewMap(4, a=0.25, offsets=np.zeros((1, 3)), reverse=True)  # every sub-pixel on the border of two zones
    assert np.array_equal(lens.phase(np.arange(1), np.arange(4))[0, :, 0], [0.0, 0.75, 0.5, 0.25])
    assert np.array_equal(lens.view(np.arange(1), np.arange(4))[0, :, 0], [3, 2, 1, 0])
    follows = replace(lens, continuous=True).camera(np.arange(1), np.arange(4))[0, :, 0]
    assert np.array_equal(follows, [-0.5, 2.5, 1.5, 0.5])


def test_quilt_tile_0_is_bottom_left_then_right_then_up() -> None:
    color = np.zeros((5, 2, 3, 4), dtype=np.uint8)
    color[..., 3] = 255
    color[..., 0] = np.arange(1, 6)[:, None, None]
    quilt = aus.ViewStack(color).quilt(columns=3, rows=2)
    assert quilt.shape == (4, 9, 4)
    assert np.array_equal(quilt[::2, ::3, 0], [[4, 5, 0], [1, 2, 3]])


def test_positive_slant_leans_like_a_backslash() -> None:
    """Going down a row, a lens of positive slant lies further to the right."""
    display = aus.Display.slanted(
        200, 40, 8, lens_pitch=300.0, subpixel_pitch=1.0, slant_deg=20.0, phase=0.5, continuous=True
    )
    assert display.viewmap is not None
    phase = display.viewmap.phase(np.arange(40), np.arange(200))[..., 0]
    border = [np.nonzero(np.diff(row) < 0)[0][0] for row in phase]  # the first lens border of each row
    assert (np.diff(border) >= 0).all()
    assert (border[39] - border[0]) / 39 == pytest.approx(np.tan(np.deg2rad(20.0)), abs=1 / 39)


def test_subpixels_count_r_g_b_from_the_left() -> None:
    view = aus.Display.lenticular(4, 1, 12, per="subpixel").view_of_subpixel()
    assert view.shape == (1, 4, 3)
    assert np.array_equal(view.ravel(), np.arange(12))


# --- errors --------------------------------------------------------------------------------------------------------
def test_errors_are_autostereo_errors_and_builtin_ones() -> None:
    for name, builtin in (("InputError", ValueError), ("FileError", OSError), ("MemoryLimitError", MemoryError)):
        error = getattr(aus, name)
        assert issubclass(error, aus.AutostereoError) and issubclass(error, builtin)
    with pytest.raises(aus.InputError, match=r"expected shape \(N, 3\), got \(2, 2\)"):
        aus.Mesh([[0, 0], [1, 1]], [[0, 1, 0]])
