"""Absurd numbers and arrays of the wrong kind: one sentence that says the range, or what was found."""

from __future__ import annotations

from datetime import date
from fractions import Fraction

import numpy as np
import pytest

import autostereo as aus
from autostereo.checks import check_number, check_views, real_array
from autostereo.render import make_camera

CORNERS, FACES = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
VALUES = np.arange(27.0).reshape(3, 3, 3)


def scaled(factor):
    return np.diag([factor, 1, 1, 1])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: aus.Rig(position=(0, 0, 1e300)), r"rig position: expected three numbers within ±1e\+15"),
        (lambda: aus.Rig(target=(0, 1e16, 0)), r"rig target: expected three numbers within ±1e\+15"),
        (lambda: aus.Rig(up=(0, 1e300, 0)), r"rig up: expected three numbers within ±1e\+30"),
        (lambda: aus.Rig(up=(0, 1e-300, 0)), "rig up: expected a vector of some length"),
        (lambda: aus.Rig(position=(0, 0, 1e-160)), "position and target must differ"),
        (lambda: aus.Rig(baseline=1e300), r"rig baseline: expected a number from 0 to 1e\+15, got 1e\+300"),
        (lambda: aus.Rig(baseline=1j), "rig baseline: expected a number, got 1j"),
        (lambda: aus.Rig(focal_distance=1e-300), "rig focal_distance: expected a number from 1e-30 to"),
        (lambda: aus.Rig(near=1e-300), "rig near: expected a number from 1e-30 to"),
        (lambda: aus.Rig(aspect=1e-300), "rig aspect: expected a number from 1e-06 to"),
        (lambda: aus.Rig(fov_y=1e-300), "rig fov_y: expected a number from 0.001 to 179"),
        (lambda: aus.Rig(offset_y=-1e16), "rig offset_y: expected a number from"),
        (lambda: aus.Rig(offsets=(-1e300, 1e300)), r"rig offsets: expected numbers within ±1e\+15"),
        (lambda: aus.Rig(views=10**30), "rig views: expected a whole number 1…4096"),
        (lambda: aus.Rig(offsets=range(5000)), "rig views: expected a whole number 1…4096, got 5000"),
        (lambda: aus.ViewMap(10**30, np.zeros((1, 1, 3), int)), "views: expected a whole number 1…4096"),
        (lambda: aus.Points(CORNERS, radii=1e300), r"radii: expected radii up to 1e\+15"),
        (lambda: aus.Points(CORNERS, radii=1e10, transform=scaled(1e10)), r"radii: expected radii up to 1e\+15"),
        (lambda: aus.Points(np.multiply(CORNERS, 1e10), transform=scaled(1e10)), "positions: expected places in the"),
        (lambda: aus.Mesh(np.multiply(CORNERS, 1e10), FACES, transform=scaled(1e10)), "vertices: expected places in"),
        (lambda: aus.Mesh(CORNERS, FACES, normals=[(0, 0, 1e300)] * 3), r"normals: expected numbers within ±1e\+30"),
        (lambda: aus.Mesh(CORNERS, FACES, transform=scaled(1e300)), r"transform: expected numbers within ±1e\+30"),
        (lambda: aus.Volume(VALUES, spacing=(1e300, 1, 1)), r"spacing: expected three numbers within ±1e\+30"),
        (lambda: aus.Volume(VALUES, spacing=(1e20, 1, 1)), r"spacing: expected voxels of 1e-30 and more within"),
        (lambda: aus.Volume(VALUES, origin=(1e300, 0, 0)), r"origin: expected three numbers within ±1e\+30"),
        (lambda: aus.Volume(VALUES * 1e300), r"values: expected numbers within ±1e\+30, found 0…2.6e\+301"),
        (lambda: aus.Volume(VALUES, mode="iso", iso=1e300), "iso: expected a number from"),
        (lambda: aus.Volume(VALUES, clip_box=[(0, 0, 0), (1, 1, 1e300)]), r"clip_box: expected numbers within ±1e\+30"),
        (lambda: aus.DirectionalLight((0, 0, -1e-300)), "light direction: expected a vector of some length"),
        (lambda: aus.DirectionalLight((0, 0, -1e300)), "light direction: expected three numbers within"),
        (lambda: aus.PointLight((0, 0, 1e16)), "light position: expected three numbers within"),
        (lambda: aus.PointLight((0, 0, 1), color=(1e300, 1, 1)), "light color: expected three numbers within"),
    ],
)  # fmt: skip
def test_absurd_numbers_are_refused(make, words):
    with pytest.raises(aus.InputError, match=words):
        make()


def test_ends_of_the_ranges_are_taken():
    aus.Rig(position=(0, 0, 1e15), baseline=1e15, fov_y=0.001, aspect=1e6, near=1e-30, views=4096)
    aus.Mesh(np.multiply(CORNERS, 1e15), FACES)
    aus.Points(CORNERS, radii=1e15)
    aus.Volume(VALUES, clip_box=[(-np.inf,) * 3, (np.inf,) * 3])


def test_cameras_whose_parallax_cannot_be_counted():
    """Every number is in its range, but pixels would be counted beyond 32 bits."""
    with pytest.raises(aus.InputError, match=r"compare baseline \(or aperture\) and focal_distance"):
        make_camera(aus.Rig(focal_distance=1e-30, baseline=1e15), (8, 8))
    with pytest.raises(aus.InputError, match=r"compare baseline \(or aperture\) and focal_distance"):
        make_camera(aus.Rig(focal_distance=1e-30, offset_y=1e15), (8, 8))
    with pytest.raises(aus.InputError, match=r"compare baseline \(or aperture\) and focal_distance"):
        make_camera(aus.Rig(focal_distance=1e-30, baseline=0), (8, 8), aperture=1e15)


def test_up_may_be_short():
    assert np.array_equal(aus.Rig(up=(0, 1e-20, 0)).eye_from_world, aus.Rig().eye_from_world)


WRONG = [
    (lambda a: a + 1j, "got complex numbers"),
    (lambda a: a.astype("U9"), "got text"),
    (lambda a: a.astype("U9").tolist(), "got text"),
    (lambda a: a.astype("S9"), "got bytes"),
    (lambda a: a.astype(np.int64).astype("datetime64[s]"), "got dates"),
    (lambda a: a.astype(np.int64).astype("timedelta64[s]"), "got spans of time"),
    (lambda a: np.full(a.shape, date(2026, 1, 1), object), "got ndarray"),
    (lambda a: np.full(a.shape, "1", object), "got ndarray"),
    (lambda a: np.ma.array(a, mask=np.arange(a.size).reshape(a.shape) == 1), "found 1 masked entries"),
]
FIELDS = {
    "vertices": (np.array(CORNERS), lambda a: aus.Mesh(a, FACES)),
    "faces": (np.array(FACES), lambda a: aus.Mesh(CORNERS, a)),
    "normals": (np.ones((3, 3)), lambda a: aus.Mesh(CORNERS, FACES, normals=a)),
    "colors": (np.ones((3, 3)), lambda a: aus.Mesh(CORNERS, FACES, colors=a)),
    "uv": (np.ones((3, 2)), lambda a: aus.Mesh(CORNERS, FACES, uv=a)),
    "transform": (np.eye(4), lambda a: aus.Mesh(CORNERS, FACES, transform=a)),
    "positions": (np.array(CORNERS), lambda a: aus.Points(a, radii=1)),
    "radii": (np.ones(3), lambda a: aus.Points(CORNERS, radii=a)),
    "values": (VALUES, aus.Volume),
    "spacing": (np.ones(3), lambda a: aus.Volume(VALUES, spacing=a)),
    "direction": (np.eye(3), lambda a: aus.Volume(VALUES, direction=a)),
    "clip_plane": (np.ones(4), lambda a: aus.Volume(VALUES, clip_plane=a)),
    "transfer points": (np.array([(0, 0, 0, 0, 0), (1, 1, 1, 1, 1)]), aus.TransferFunction),
    "rig offsets": (np.array([-1.0, 0.0, 1.0]), lambda a: aus.Rig(offsets=a)),
    "rig position": (np.array([0.0, 0.0, 4.0]), lambda a: aus.Rig(position=a)),
    "table": (np.array([[[0, 1, 0]]]), lambda a: aus.Display.from_table(8, 8, 2, a)),
}


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize(("spoil", "words"), WRONG)
def test_arrays_of_the_wrong_kind_are_refused(field, spoil, words):
    good, make = FIELDS[field]
    make(good)
    make(np.ma.array(good))  # nothing of it is masked
    with pytest.raises(aus.InputError, match=f"{field}: expected .*{words}"):
        make(spoil(np.asarray(good)))


def test_one_number():
    assert check_number("x", np.float32(0.5), 0, 1) == 0.5 and check_number("x", Fraction(1, 4)) == 0.25
    for bad in (True, np.True_, "1", 1j, None, [1.0], np.datetime64(1, "s"), np.ones(1)):
        with pytest.raises(aus.InputError, match="x: expected a number, got"):
            check_number("x", bad)
    for bad in (np.nan, np.inf, 10**400, -0.1, 1.1):
        with pytest.raises(aus.InputError, match="x: expected a number from 0 to 1, got"):
            check_number("x", bad, 0, 1)
    for bad in (0, 4097, True, 2.0, "2", None):
        with pytest.raises(aus.InputError, match="views: expected a whole number 1…4096, got"):
            check_views(bad)


def test_wide_whole_numbers_are_numbers():
    assert real_array("x", [10**25, Fraction(1, 2)]).tolist() == [1e25, 0.5]


def test_surfels_that_reach_from_far_to_the_eye():
    """Their near end is known to a rounding of their size; beyond the eye it led out of the picture's arrays."""
    rng = np.random.default_rng(1)
    for _ in range(300):
        points = aus.Points(rng.normal(0, 1e5, (4, 3)), radii=1e6, normals=rng.normal(0, 1, (4, 3)))
        rig = aus.Rig(position=rng.integers(-1, 5, 3) + np.array((0, 0, 0.25)), target=(0, 0, 0.5), views=3)
        if (points.positions @ rig.eye_from_world[2, :3] + rig.eye_from_world[2, 3]).max() > 0:
            stack = aus.render_views(points, rig, (8, 8), engine="cpu", options=aus.Options(depth=True))
            assert ((stack.depth > 0) & (np.isfinite(stack.depth) == (stack.color[..., 3] > 0))).all()


def test_a_huge_triangle_is_cut_at_the_near_plane():
    """Its new corners are not before it by a rounding, where they would have no place in the picture (a warning)."""
    mesh = aus.Mesh([(-1e15, -1e15, -1e15), (1e15, -1e15, 1e15), (0, 1e15, 1e15)], FACES)
    for engine in ("reference", "cpu"):
        assert aus.render_views(mesh, aus.Rig(views=2), (8, 8), engine=engine).views == 2


def test_options_take_numbers_of_numpy_and_keep_plain_ones():
    given = aus.Options(
        step=np.float32(0.5), aperture=np.float64(0.25), samples=np.int64(4), depth=np.bool_(False),
        small_size=[np.int64(3), 4], lens=np.array([2, 3]), views_per_pass=np.int64(2), groups=np.uint8(5),
        references=np.int32(3), shading=np.str_("center"),
    )  # fmt: skip
    plain = aus.Options(
        step=0.5, aperture=0.25, samples=4, depth=False, small_size=(3, 4), lens=(2, 3), views_per_pass=2, groups=5,
        references=3, shading="center",
    )  # fmt: skip
    assert given == plain and hash(given) == hash(plain)
    for name, value in vars(plain).items():
        kept = getattr(given, name)
        assert type(kept) is type(value), name
        assert not isinstance(kept, tuple) or [type(number) for number in kept] == [int, int]
    assert type(aus.Options(step=2).step) is float


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("step", True, "expected a number, got True"),
        ("step", np.bool_(True), "expected a number, got"),
        ("step", np.float32(0), "expected a number > 0 .*, got"),
        ("step", np.inf, "expected a finite number, got inf"),
        ("samples", True, "expected one of 1, 4, 16, 64, got True"),
        ("samples", 4.0, "expected one of 1, 4, 16, 64, got 4.0"),
        ("samples", np.array([4, 4]), "expected one of 1, 4, 16, 64, got array"),
        ("depth", 1, "expected one of False, True, got 1"),
        ("shading", ["exact"], "expected one of 'exact', 'center', 'reuse', got"),
        ("lens", (True, 1), "expected two whole numbers from 1 to 64, got"),
        ("lens", np.array([1.0, 2.0]), "expected two whole numbers from 1 to 64, got"),
        ("lens", [np.int64(1), np.int64(65)], "expected two whole numbers from 1 to 64, got"),
        ("small_size", np.array([4, 4, 4]), "expected two whole numbers ≥ 1, got"),
        ("small_size", {4, 5}, "expected two whole numbers ≥ 1, got"),
        ("views_per_pass", np.bool_(True), "expected a whole number ≥ 1, got"),
        ("groups", np.int64(0), "expected a whole number ≥ 1, got"),
        ("references", None, "expected a whole number ≥ 1, got None"),
    ],
)
def test_options_refuse_what_only_looks_like_numbers(name, value, words):
    with pytest.raises(aus.InputError, match=f"options {name}: {words}"):
        aus.Options(**{name: value})
