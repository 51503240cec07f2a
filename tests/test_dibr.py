"""Method dibr: closed forms of planes and steps, and how near it comes to exact views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

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


def test_what_is_infinitely_far_slides_as_far_as_the_focal_plane_is_near():
    """A sky: fx·Δv/fd pixels to the right from view to view, here two; a thing on the focal plane before it rests."""
    rig = replace(RIG, baseline=2 * 4 / FOCAL * 8)
    sky = np.random.default_rng(2).integers(0, 256, (1, H, W, 4)).astype(np.uint8)
    depth = np.full((1, H, W), np.inf, np.float32)
    depth[:, 20:40, 30:50] = 4.0
    found = aus.warp(aus.ViewStack(sky, depth), rig)
    assert found.depth is not None
    for k in range(9):
        expected = sky[0][:, np.clip(np.arange(W) - 2 * (k - 4), 0, W - 1)]
        still = np.zeros((H, W), bool)
        still[20:40, 30:50] = True
        hidden = np.zeros((H, W), bool)  # the sky behind the thing, which no picture shows
        hidden[20:40, 30 + min(2 * (k - 4), 0) : 50 + max(2 * (k - 4), 0)] = True
        np.testing.assert_array_equal(found.color[k][still], sky[0][still])
        np.testing.assert_array_equal(found.color[k][~hidden], expected[~hidden])
        np.testing.assert_array_equal(found.depth[k], np.where(still, 4.0, np.inf))


def test_what_is_hidden_from_all_is_what_lies_behind_the_edge_and_no_smear():
    """A gap between two posts, through which the references see sky, but none of it where a view between them does."""
    depth = np.full((1, 1, 60), np.inf, np.float32)
    depth[..., 10:30] = depth[..., 34:50] = 4.0  # on the focal plane: they rest, the sky slides
    color = np.where(np.isfinite(depth), 200, 30)[..., None].repeat(4, axis=-1).astype(np.uint8)
    rig = replace(RIG, baseline=100 / 4 * 8, views=9, aspect=60.0)  # farther than a post is wide
    found = aus.warp(aus.ViewStack(color, depth), rig)
    for view in found.color:
        np.testing.assert_array_equal(view, color[0])


# --- a plain twin ----------------------------------------------------------------------------------------------------


def segments(row, inverse):
    """Ends of all segments of a row: (first pixel, its share of a half, second pixel, its share)."""
    yield 0, -0.5, 0, 0.0
    for i in range(len(row) - 1):
        a, b = inverse[i], inverse[i + 1]
        before, after = inverse[i - 1] if i else 0.0, inverse[i + 2] if i + 2 < len(row) else 0.0
        slopes = [abs(2 * a - before - b)] * bool(before > 0) + [abs(2 * b - after - a)] * bool(after > 0)
        error = min([abs(a - b), *slopes])
        if (a == b == 0) if a * b == 0 else error <= 0.01 * max(a, b):
            yield i, 0.0, i + 1, 0.0
        else:
            yield i, 0.0, i, 0.5
            yield i + 1, -0.5, i + 1, 0.0
    yield len(row) - 1, 0.0, len(row) - 1, 0.5


def gaps(row, inverse):
    """The same of what lies between two pixels that are not joined: the farther of them goes on."""
    for i, _, j, after in segments(row, inverse):
        if i == j and after == 0.5 and i + 1 < len(row):
            yield i, 0.5, i + 1, -0.5


def seen(row, inverse, slide, focal, of=segments):
    """Colours (W, 4) and inverse depth (W,) that a row shows after a slide: every sample tries every segment."""
    x = np.arange(len(row)) + 0.5
    color, near = np.zeros((len(row), 4)), np.full(len(row), -1.0)
    place = x + slide * (1 / focal - inverse)
    for i, before, j, after in of(row, inverse):
        first, last = place[i] + before, place[j] + after
        if last <= first:
            continue
        if of is gaps:
            i = j = i if inverse[i] < inverse[j] else j
        t = (x - first) / (last - first)
        w = inverse[i] + t * (inverse[j] - inverse[i])
        nearer = (first <= x) & (x < last) & (w > near)
        near[nearer] = w[nearer]
        color[nearer] = (row[i] + t[:, None] * (row[j].astype(float) - row[i]))[nearer]
    return color, near


def warped(rows, inverses, offsets, offset, fx, focal):
    """One row of a view, from rows (R, W, 4) and inverse depths (R, W) of references, as the module's text has it."""
    order = sorted(range(len(rows)), key=lambda k: abs(offsets[k] - offset))
    color, near = seen(rows[order[0]], inverses[order[0]], fx * (offset - offsets[order[0]]), focal)
    for n, k in enumerate(order[1:]):
        other, inverse = seen(rows[k], inverses[k], fx * (offset - offsets[k]), focal)
        for j in range(len(near)):
            gap = abs(offsets[order[0]] - offset) / (abs(offsets[order[0]] - offset) + abs(offsets[k] - offset))
            both = near[j] >= 0 and inverse[j] >= 0
            alike = both and abs(near[j] - inverse[j]) <= 0.01 * max(near[j], inverse[j])
            part = gap if alike and n == 0 else 1.0 if inverse[j] > near[j] and (n == 0 or near[j] < 0) else 0.0
            if part:
                color[j], near[j] = color[j] + part * (other[j] - color[j]), near[j] + part * (inverse[j] - near[j])
    for k in order:
        guess, inverse = seen(rows[k], inverses[k], fx * (offset - offsets[k]), focal, gaps)
        color, near = np.where((near < 0)[:, None], guess, color), np.where(near < 0, inverse, near)
    filled = np.flatnonzero(near >= 0)
    for j in np.flatnonzero(near < 0):
        left, right = filled[filled < j], filled[filled > j]
        if len(left) and len(right):
            source = left[-1] if near[left[-1]] <= near[right[0]] else right[0]
            color[j], near[j] = color[source], near[source]
        else:
            column = -1 if len(left) else 0
            k = min(order, key=lambda k: inverses[k][column])
            color[j], near[j] = rows[k][column], inverses[k][column]
    return color, near


SLOPE = [1 / w for w in (0.5, 0.46, 0.42, 0.38, 0.34)]  # inverse depths on one line, apart by more than one per cent
FLAT = [0.7, 2.0, 2.01, 2.03, 4.0, 4.2, 30.0, np.inf]
RUNS = st.one_of(st.sampled_from([SLOPE[:2], SLOPE, SLOPE[::-1]]), st.lists(st.sampled_from(FLAT), max_size=5))
DEPTHS = st.lists(RUNS, min_size=1, max_size=3).map(lambda runs: [d for run in runs for d in run] or [4.0])


@settings(max_examples=200, deadline=None)
@example([0.7] * 7 + [0.705] * 7, [-0.28, 0.28], 0)  # seen from the middle, the two pictures do not meet
@example([0.7] * 7 + [0.705] * 7, [-0.28, 0.28], 9)
@example([2.0, 1 / 0.46, 2.0, 1 / 0.46, 0.7, 0.7, 0.7], [0.0, -0.016], 2**32 - 1)  # a colour between two bytes, 95.5
@given(DEPTHS, st.lists(st.floats(-1, 1).map(lambda x: round(x, 3)), min_size=1, max_size=4), st.integers(0, 2**32 - 1))
def test_rows_are_those_of_the_plain_twin(row, offsets, seed):
    """Random steps, slopes and skies, seen from up to four places in any order, beside or beyond them."""
    rng, width = np.random.default_rng(seed), len(row)
    depth = np.stack([np.roll(row, rng.integers(width)) for _ in offsets]).astype(np.float32)
    color = rng.integers(0, 256, (len(offsets), 1, width, 4)).astype(np.uint8)
    rig = replace(RIG, views=7, aspect=width / 20)
    found = aus.warp(aus.ViewStack(color, depth[:, None]), rig, offsets)
    fx, inverse = 1 / 2 / np.tan(np.deg2rad(20)) * 20, 1 / depth.astype(float)
    for k, offset in enumerate(rig.camera_offsets):
        if offset in offsets:
            np.testing.assert_array_equal(found.color[k], color[offsets.index(offset)])
            continue
        expected, near = warped(color[:, 0], inverse, offsets, offset, fx, 4.0)
        assert np.abs(found.color[k, 0] - expected).max() <= 0.5 + 1e-9  # rounded; a tie may go either way
        with np.errstate(divide="ignore"):
            np.testing.assert_allclose(found.depth[k, 0], 1 / near, rtol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_no_hole_stays_open_whatever_the_depths(count):
    """Every colour and depth lies within what its row has, from the least of float32 to infinity."""
    rng = np.random.default_rng(count)
    extremes = np.array([1e-45, 1e-30, 1e-3, 1.0, 3.9, 4.0, 1e3, 3e38, np.inf], np.float32)
    depth = rng.choice(extremes, (count, H, W))
    color = rng.integers(60, 200, (count, H, W, 4)).astype(np.uint8)
    color[:, ::2] //= 2
    found = aus.warp(aus.ViewStack(color, depth), RIG, np.linspace(-0.4, 0.3, count))
    assert found.depth is not None
    for pictures, of in ((color, found.color), (depth, found.depth)):
        low, high = (f(f(pictures, axis=2), axis=0) for f in (np.min, np.max))  # (H, …)
        assert (of >= low[:, None]).all() and (of <= high[:, None]).all()


# --- against exact views ---------------------------------------------------------------------------------------------


def scenes():
    ball = shapes.displaced_sphere(4)
    place = aus.transforms.translation(0, 0, -4)
    mesh = aus.Mesh(ball.vertices, ball.faces, colors=ball.colors, transform=place)
    return {
        "a mesh": (mesh, 37, 38),
        "before a wall": ([mesh, wall(5.5)], 34, 35),
        "points": (replace(samples.surfel_cloud(4000), transform=place), 33, 35),
        "a volume": (replace(samples.shells(24), transform=place), 31, 38),
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
@pytest.mark.parametrize("name", ["a mesh", "points", "a volume"])
def test_references_are_what_the_engine_draws(name, engine):
    """Bit for bit, colours and depths, whichever kind and engine; the others are warped from them."""
    if engine == "gl":
        from gl_device import need_device

        need_device()
    scene, size = scenes()[name][0], (32, 24)
    found, drawn = views(scene, size=size, engine=engine), [0, 8]
    exact = views(scene, "single-pass", RIG.with_views(2), size, engine)
    assert exact.color[..., :3].any()
    np.testing.assert_array_equal(found.color[drawn], exact.color)
    np.testing.assert_array_equal(found.depth[drawn], exact.depth)
    warped = aus.warp(exact, RIG, RIG.camera_offsets[drawn])
    np.testing.assert_array_equal(found.color, warped.color)
    np.testing.assert_array_equal(found.depth, warped.depth)


@pytest.mark.parametrize("engine", ["cpu", "gl", "reference"])
def test_panels_are_the_interlaced_views(engine):
    if engine == "gl":
        from gl_device import need_device

        need_device()
    display = aus.Display.slanted(*SIZE, 9, lens_pitch=5.7, subpixel_pitch=1.0, slant_deg=9.46)
    scene = [wall(5.5), aus.Mesh([(-0.5, -0.5, -3), (0.5, -0.5, -3.5), (0, 0.5, -2.5)], [[0, 1, 2]], material=PLAIN)]
    mirrored = replace(display, flip_x=True, flip_y=True)
    continuous = replace(display, viewmap=replace(display.viewmap, continuous=True))  # rounded to the nearest view
    for shown in (display, mirrored, continuous, aus.Display.lenticular(*SIZE, 9, per="subpixel")):
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
    with pytest.raises(aus.InputError, match=r"offsets: expected 1 numbers, .* got \(0.0, 1.0\)"):
        aus.warp(picture, RIG, (0.0, 1.0))
    for bad in ((np.nan,), (1e31,), ((0.0,),), ("left",), None):
        with pytest.raises(aus.InputError, match="offsets: expected"):
            aus.warp(picture, RIG, bad)
    with pytest.raises(aus.InputError, match="rig: expected a Rig, got NoneType"):
        aus.warp(picture, None)
    with pytest.raises(aus.InputError, match=r"depth: expected shape \(1, 64, 96\), got \(1, 63, 96\)"):
        aus.ViewStack(picture.color, picture.depth[:, 1:])
    with pytest.raises(aus.InputError, match="expected depths that are numbers, got text"):
        aus.warp(aus.ViewStack(picture.color, np.full((1, H, W), "near")), RIG)
    for bad in (0.0, -1.0, np.nan, -np.inf, 1e-50):
        depth = picture.depth.astype(np.float64)
        depth[0, 3, 5] = bad
        with pytest.raises(aus.InputError, match="pictures: expected depths > 0"):
            aus.warp(aus.ViewStack(picture.color, depth), RIG)


def test_through_a_lens_references_are_its_own():
    """Depth of field: the cameras of a row of the lens are warped from its outermost."""
    scene, options = aus.Scene(wall(depth_of(0, 1.0))), aus.Options(aperture=0.5, lens=(4, 2))
    exact, found = (aus.render_views(scene, RIG, SIZE, method=m, options=options).color for m in ("n-pass", "dibr"))
    np.testing.assert_array_equal(found, exact)
