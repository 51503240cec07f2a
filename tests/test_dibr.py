"""Method dibr: closed forms of planes and steps, and how near it comes to exact views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.methods.dibr import reference_views
from autostereo.scene import samples, shapes

W, H = SIZE = (96, 64)
RIG = aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=40, baseline=1.0, views=9, near=0.1)
FOCAL = H / 2 / np.tan(np.deg2rad(20))  # pixels
PLAIN = aus.Material(1.0, 0.0, two_sided=True)


def wall(depth: float, **fields) -> aus.Mesh:
    """Something textured across the view, parallel to the picture."""
    corners = [(-9, -9, -depth), (9, -9, -depth), (9, 9, -depth), (-9, 9, -depth)]
    image = np.random.default_rng(0).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    fields = {"uv": [(0, 0), (3, 0), (3, 3), (0, 3)], "texture": image, "material": PLAIN} | fields
    return aus.Mesh(corners, [[0, 1, 2], [0, 2, 3]], **fields)


def views(scene, method="dibr", rig=RIG, size=SIZE, engine="cpu", **options):
    return aus.render_views(scene, rig, size, method=method, engine=engine, options=aus.Options(depth=True, **options))


def psnr(found, expected):
    error = np.mean((found[..., :3].astype(float) - expected[..., :3]) ** 2)
    return 10 * np.log10(255**2 / max(error, 1e-9))


def depth_of(pixels: float, step: float) -> float:
    """The depth at which a view `step` beside another shows a thing so many pixels to its right."""
    return 1 / (1 / 4 - pixels / (FOCAL * step))


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pixels", [0, 1, 2, -1, -3])
@pytest.mark.parametrize("references", [2, 3, 5])
@pytest.mark.parametrize("engine", ["cpu", "reference"])
def test_a_plane_that_slides_by_whole_pixels_is_exact(pixels, references, engine):
    """Every view shows the same samples of the texture, so all of a picture is that of the n-pass, borders too."""
    scene = aus.Scene(wall(depth_of(pixels, RIG.baseline / 8)))
    exact, found = (views(scene, m, engine=engine, references=references) for m in ("n-pass", "dibr"))
    assert np.ptp(exact.color[..., :3]) > 200
    if pixels:
        assert (exact.color[0] != exact.color[1]).any()
    np.testing.assert_array_equal(found.color, exact.color)
    np.testing.assert_allclose(found.depth, exact.depth, rtol=1e-6)


@pytest.mark.parametrize("depth", [2.3, 3.1, 6.7, 14.0])
def test_a_gradient_is_exact_at_any_depth(depth):
    """What is linear in the picture stays so between pixels."""
    colors = [(0, 0.1, 0.9), (1, 0.1, 0.5), (1, 1, 0.1), (0, 1, 0.5)]
    scene = aus.Scene(wall(depth, uv=None, texture=None, colors=colors))
    exact, found = (views(scene, m) for m in ("n-pass", "dibr"))
    assert np.abs(found.color.astype(int) - exact.color).max() <= 1


def test_a_step_hides_and_uncovers_what_is_behind_it():
    """A near square before a far wall: its edges lie where geometry puts them, and the wall is whole beside it."""
    near = aus.Mesh([(-0.4, -0.4, -3), (0.4, -0.4, -3), (0.4, 0.4, -3), (-0.4, 0.4, -3)], [[0, 1, 2], [0, 2, 3]],
                    colors=np.tile((1.0, 0, 0), (4, 1)), material=PLAIN)  # fmt: skip
    far = wall(8.0, uv=None, texture=None, colors=np.tile((0, 0, 1.0), (4, 1)))
    found = views([near, far])
    for k, offset in enumerate(RIG.camera_offsets):
        row = found.color[k, H // 2]
        left, right = (W / 2 + FOCAL * (x / 3 + offset * (1 / 4 - 1 / 3)) for x in (-0.4, 0.4))
        x = np.arange(W) + 0.5
        inside, sure = (x > left) & (x < right), np.minimum(np.abs(x - left), np.abs(x - right)) > 0.75
        np.testing.assert_array_equal(row[sure], np.where(inside, 1, 0)[sure, None] * (255, 0, 0, 255)
                                      + np.where(inside, 0, 1)[sure, None] * (0, 0, 255, 255))  # fmt: skip
        np.testing.assert_allclose(found.depth[k, H // 2][sure], np.where(inside, 3.0, 8.0)[sure], rtol=1e-5)


def test_a_picture_with_depth_alone():
    """Seen from the middle: views slide by their parallax, and what the frame did not hold goes on as its border."""
    depth = depth_of(2, RIG.baseline / 8)
    picture = views(aus.Scene(wall(depth)), "single-pass", RIG.with_views(1))
    found = aus.warp(picture, RIG)
    for k, view in enumerate(found.color):
        slide = 2 * (k - 4)
        columns = np.clip(np.arange(W) - slide, 0, W - 1)
        np.testing.assert_array_equal(view, picture.color[0][:, columns])
    assert found.depth is not None
    np.testing.assert_allclose(found.depth, depth, rtol=1e-6)
    both = views(aus.Scene(wall(depth)), "n-pass")
    outer = aus.ViewStack(both.color[[0, 8]], both.depth[[0, 8]])
    np.testing.assert_array_equal(aus.warp(outer, RIG, RIG.camera_offsets[[0, 8]]).color, both.color)


# --- against exact views ---------------------------------------------------------------------------------------------


def scenes():
    ball = shapes.displaced_sphere(4)
    place = aus.transforms.translation(0, 0, -4)
    mesh = aus.Mesh(ball.vertices, ball.faces, colors=ball.colors, transform=place)
    return {
        "a mesh": (mesh, 37, 38),
        "before a wall": ([mesh, wall(5.5)], 34, 35),
        "points": (replace(samples.surfel_cloud(4000), transform=place), 33, 35),
    }


@pytest.mark.parametrize("name", list(scenes()))
def test_views_come_near_the_exact_ones_and_nearer_with_more_references(name):
    """In decibels, the worst view of nine: 2 and 5 references; references themselves are exact."""
    scene, two, five = scenes()[name]
    exact = views(scene, "n-pass", size=(256, 192)).color
    worst = {}
    for count in (1, 2, 5, 9):
        found = views(scene, size=(256, 192), references=count).color
        worst[count] = min(psnr(a, b) for a, b in zip(found, exact, strict=True))
        drawn = reference_views(9, count)
        np.testing.assert_array_equal(found[drawn], exact[drawn])
    print(name, {count: round(value, 1) for count, value in worst.items()})
    assert worst[1] < worst[2] < worst[5]
    assert worst[2] >= two and worst[5] >= five


@pytest.mark.parametrize("engine", ["cpu", "gl", "reference"])
def test_panels_are_the_interlaced_views(engine):
    if engine == "gl":
        from gl_device import need_device

        need_device()
    display = aus.Display.slanted(*SIZE, 9, lens_pitch=5.7, subpixel_pitch=1.0, slant_deg=9.46)
    scene = [wall(5.5), aus.Mesh([(-0.5, -0.5, -3), (0.5, -0.5, -3.5), (0, 0.5, -2.5)], [[0, 1, 2]], material=PLAIN)]
    for shown in (display, replace(display, flip_x=True, flip_y=True)):
        panel = aus.render(scene, shown, RIG, method="dibr", engine=engine, options=aus.Options(references=3))
        stack = views(scene, engine=engine, references=3)
        np.testing.assert_array_equal(panel.pixels, aus.interlace(stack, shown).pixels)


# --- what may be asked for -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "expected"), [(1, [4]), (2, [0, 8]), (3, [0, 4, 8]), (9, range(9)), (50, range(9))])
def test_references_are_spread_evenly(count, expected):
    np.testing.assert_array_equal(reference_views(9, count), list(expected))


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (2, 3)])
def test_pictures_of_any_size(size):
    exact, found = (views(wall(4.0), m, size=size) for m in ("n-pass", "dibr"))
    assert found.color.shape == (9, size[1], size[0], 4)
    np.testing.assert_array_equal(found.color, exact.color)


def test_what_cannot_be_warped_is_refused():
    for value in (0, 1.5, True):
        with pytest.raises(aus.InputError, match="options references: expected a whole number ≥ 1"):
            aus.Options(references=value)
    picture = views(aus.Scene(wall(5.0)), "single-pass", RIG.with_views(1))
    with pytest.raises(aus.InputError, match="pictures: expected a ViewStack with depth"):
        aus.warp(aus.ViewStack(picture.color), RIG)
    with pytest.raises(aus.InputError, match=r"offsets: expected 1 numbers, .* got 2"):
        aus.warp(picture, RIG, (0.0, 1.0))
    for bad in (0.0, -1.0, np.nan):
        depth = picture.depth.copy()
        depth[0, 3, 5] = bad
        with pytest.raises(aus.InputError, match="pictures: expected depths > 0"):
            aus.warp(aus.ViewStack(picture.color, depth), RIG)


def test_through_a_lens_references_are_its_own():
    """Depth of field: the cameras of a row of the lens are warped from its outermost."""
    scene, options = aus.Scene(wall(depth_of(0, 1.0))), aus.Options(aperture=0.5, lens=(4, 2))
    exact, found = (aus.render_views(scene, RIG, SIZE, method=m, options=options).color for m in ("n-pass", "dibr"))
    np.testing.assert_array_equal(found, exact)
