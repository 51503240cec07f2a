"""Framing: everything in view in every view, disparities within comfort, a balanced focal plane."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.display.display import Display
from autostereo.display.framing import MARGIN, depth_budget, frame_depths, frame_rig
from autostereo.display.rig import Rig

NAMES = [
    "looking-glass-portrait", "looking-glass-go", "looking-glass-16-landscape", "lenticular-8", "light-field-8k",
    "side-by-side-half", "checkerboard", "philips-wowvx", "wavelength-selective-8",
]  # fmt: skip
DISPLAYS = [
    *(Display.preset(n) for n in NAMES),
    Display.preset("looking-glass-go").with_views(1),
    Display.from_table(30, 500, 2, [[[0, 1, 0]]]),  # a very narrow panel
    Display.slanted(800, 600, 9, lens_pitch=9, subpixel_pitch=2, slant_deg=9.5, continuous=True),
    Display.slanted(800, 600, 2, lens_pitch=9, subpixel_pitch=2, slant_deg=9.5, continuous=True).physical(cone_deg=170),
]


def box(center: tuple[float, ...], half: tuple[float, ...]) -> SimpleNamespace:
    return SimpleNamespace(bounds=np.array([np.subtract(center, half), np.add(center, half)]))


def corners_of(bounds: np.ndarray) -> np.ndarray:
    return np.array(list(itertools.product(*bounds.T)))


def window(rig: Rig, points: np.ndarray, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Place of world points in the focal-plane window of the camera at `offset`: −1…1 is inside (DESIGN section 1)."""
    eye = points @ rig.eye_from_world[:3, :3].T + rig.eye_from_world[:3, 3]
    x, y, d = eye.T
    half_height = rig.focal * math.tan(math.radians(rig.fov_y) / 2)
    assert rig.aspect is not None
    across = offset + (x - offset) * rig.focal / d  # where the ray from the camera crosses the focal plane
    return across / (half_height * rig.aspect), y * rig.focal / d / half_height


def disparities(rig: Rig, display: Display, depths: np.ndarray) -> np.ndarray:
    """Shift in pixels of `comfort_size` between adjacent views, shape (depths, V − 1); > 0 behind the focal plane."""
    ahead = np.array([[*rig.position[:2], rig.position[2] - d] for d in depths])
    x = np.array([window(rig, ahead, float(o))[0] for o in rig.camera_offsets])
    shift = np.diff(x.reshape(len(rig.camera_offsets), len(depths)), axis=0).T
    return shift * display.comfort_size[0] / 2


EXTENT = st.one_of(st.just(0.0), st.floats(1e-3, 1e3))


@settings(deadline=None)
@given(
    index=st.integers(0, len(DISPLAYS) - 1),
    center=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    half=st.tuples(EXTENT, EXTENT, EXTENT),
)
def test_the_whole_box_is_in_every_view_and_comfortable(index: int, center: tuple, half: tuple) -> None:
    assume(max(half) > 2e-3)  # points have a test of their own
    display, scene = DISPLAYS[index], box(center, half)
    rig = Rig.frame(scene, display)
    assert rig.views == display.views and rig.aspect == display.aspect and rig.fov_y == display.fov_y
    offsets = rig.camera_offsets
    extremes = rig.offset_at(np.array([-0.5, display.views - 0.5])) if display.continuous else offsets[[0, -1]]
    corners = corners_of(scene.bounds)
    for offset in extremes:
        x, y = window(rig, corners, float(offset))
        assert np.abs(x).max() <= 1 - MARGIN + 1e-6 and np.abs(y).max() <= 1 - MARGIN + 1e-6

    budget = depth_budget(scene, display)
    assert budget.nearest > rig.near_depth and budget.fits
    depths = np.array([budget.nearest, budget.farthest])
    assert 2 / rig.focal == pytest.approx((1 / depths).sum(), rel=1e-9)
    assert -budget.disparity_near == pytest.approx(budget.disparity_far, rel=1e-6, abs=1e-6)
    if display.views > 1:
        measured = disparities(rig, display, depths)
        assert np.abs(measured).max() <= display.comfort * (1 + 1e-6)
        assert measured[0] == pytest.approx(budget.disparity_near, rel=1e-3, abs=1e-6)
        assert measured[1] == pytest.approx(budget.disparity_far, rel=1e-3, abs=1e-6)
    cone = 2 * rig.focal * math.tan(math.radians(display.cone_deg) / 2)
    assert rig.baseline <= cone * (1 + 1e-9)
    limited = budget.disparity_far >= display.comfort * (1 - 1e-6)
    assert limited or rig.baseline == pytest.approx(cone)  # one of the two limits is reached


@pytest.mark.parametrize("display", DISPLAYS, ids=lambda d: f"{d.name}-{d.views}")
@pytest.mark.parametrize("half", [(1, 1, 1), (3, 1, 0.2), (1, 4, 1), (0.1, 0.1, 2), (2, 1, 0)])
def test_the_box_fills_the_picture_where_something_limits_it(display: Display, half: tuple) -> None:
    """No needless distance: the edge of a view is reached, or the near end of a deep box is close to the camera."""
    scene = box((1, 2, 3), half)
    rig = frame_rig(scene, display)
    ends = (-0.5, display.views - 0.5) if display.continuous else (0, display.views - 1)
    offsets = rig.offset_at(np.array(ends))
    if display.views == 1:
        offsets = np.array([-0.5, 0.5]) * rig.baseline
    most = max(np.abs(v).max() for o in offsets for v in window(rig, corners_of(scene.bounds), float(o)))
    distance = rig.position[2] - 3
    assert most == pytest.approx(1 - MARGIN, rel=1e-6) or distance == pytest.approx(1.25 * half[2])


@pytest.mark.parametrize("anatomical", [False, True])
@pytest.mark.parametrize("side", ["front", "back", "left", "right", "top", "bottom"])
def test_every_side_shows_the_whole_box(side: str, anatomical: bool) -> None:
    scene = box((1, 2, 3), (0.5, 2, 3.5))
    scene.anatomical = anatomical
    for display in (DISPLAYS[0], DISPLAYS[-2]):
        rig = Rig.frame(scene, display, side)
        for offset in rig.camera_offsets:
            places = window(rig, corners_of(scene.bounds), float(offset))
            assert max(np.abs(v).max() for v in places) <= 1 - MARGIN + 1e-9


@pytest.mark.parametrize(("side", "screen"), [
    # what is at the right, the top and near in the picture: of a patient L, P, S are +x, +y, +z
    ("front", ("+x", "+z", "-y")), ("back", ("-x", "+z", "+y")), ("left", ("+y", "+z", "+x")),
    ("right", ("-y", "+z", "-x")), ("top", ("-x", "-y", "+z")), ("bottom", ("+x", "-y", "-z")),
])  # fmt: skip
def test_sides_of_a_patient(side: str, screen: tuple[str, str, str]) -> None:
    """From the front the patient's left is at the right of the picture and the head on top; so it is from the feet."""
    axes = {f"{sign}{name}": s * np.eye(3)[k] for k, name in enumerate("xyz") for sign, s in (("+", 1), ("-", -1))}
    patient = aus.Volume(np.zeros((3, 3, 3), np.uint8), origin=(-1, -1, -1), anatomical=True)
    rig = Rig.frame(aus.Scene(patient), DISPLAYS[0], side)
    expected = np.stack([axes[screen[0]], axes[screen[1]], -axes[screen[2]]])
    np.testing.assert_allclose(rig.eye_from_world[:3, :3], expected, atol=1e-12)


def test_sides_of_all_else() -> None:
    scene = box((0, 0, 0), (1, 1, 1))
    assert Rig.frame(scene, DISPLAYS[0]) == Rig.frame(scene, DISPLAYS[0], "front")
    for side, towards in (("front", (0, 0, 1)), ("left", (-1, 0, 0)), ("right", (1, 0, 0)), ("top", (0, 1, 0))):
        assert np.argmax(np.array(Rig.frame(scene, DISPLAYS[0], side).position) * towards) == np.argmax(np.abs(towards))
    with pytest.raises(aus.InputError, match="side: expected one of front, back, left"):
        Rig.frame(scene, DISPLAYS[0], "behind")


@pytest.mark.parametrize("center", [(0, 0, 0), (5, -3, 2), (1e6, 1e6, 1e6), (0, 0, -1e-12)])
def test_a_point_has_a_rig(center: tuple) -> None:
    for display in DISPLAYS:
        rig = frame_rig(box(center, (0, 0, 0)), display)
        assert np.isfinite([*rig.position, rig.focal, rig.baseline]).all() and rig.focal > 0
        x, y = window(rig, np.array([center], float), float(rig.camera_offsets[-1]))
        assert abs(x[0]) <= 1 and abs(y[0]) <= 1


def test_a_plane_lies_in_the_focal_plane_and_takes_the_whole_cone() -> None:
    display = Display.preset("looking-glass-portrait")
    scene = box((0, 0, 7), (3, 4, 0))
    rig, budget = frame_rig(scene, display), depth_budget(scene, display)
    assert budget.nearest == budget.farthest == pytest.approx(rig.focal)
    assert abs(budget.disparity_near) < 1e-12
    assert rig.baseline == pytest.approx(2 * rig.focal * math.tan(math.radians(20)))
    assert rig.position[2] - rig.focal == pytest.approx(7)


def test_disparity_is_the_law_of_displays_3_4() -> None:
    """δ = [tan(cone/2)/tan(g/2)]·|1 − F/z|·tileH/(N − 1) with the full cone and square view pixels."""
    display = Display.preset("looking-glass-portrait")
    rig = Rig(position=(0, 0, 10), fov_y=14, baseline=20 * math.tan(math.radians(20)), views=48, aspect=0.75)
    budget = depth_budget(box((0, 0, 0), (1, 1, 3)), display, rig)
    for depth, measured in ((7, budget.disparity_near), (13, budget.disparity_far)):
        law = math.tan(math.radians(20)) / math.tan(math.radians(7)) * (1 - 10 / depth) * 560 / 47
        assert measured == pytest.approx(law)
    assert math.tan(math.radians(20)) / math.tan(math.radians(7)) * 560 / 47 == pytest.approx(35, abs=0.5)
    assert budget.comfortable == (pytest.approx(8.76, abs=0.02), pytest.approx(11.65, abs=0.03))  # 0.88 F … 1.16 F
    assert not budget.fits


def test_equal_angles_count_their_widest_step() -> None:
    display = Display.preset("looking-glass-portrait")
    rig = Rig(position=(0, 0, 10), fov_y=14, baseline=20 * math.tan(math.radians(20)), views=48, aspect=0.75)
    even, outer = (
        depth_budget(box((0, 0, 0), (1, 1, 3)), display, r).disparity_far
        for r in (rig, replace(rig, spacing="equal-angle"))
    )
    assert outer / even == pytest.approx(1.08, abs=0.01)  # displays.md 3.4: outer pairs exceed the mean by 8 %


@settings(deadline=None)
@given(st.floats(0.1, 50), st.floats(5, 60))
def test_comfortable_depths_are_where_disparity_reaches_comfort(baseline: float, fov_y: float) -> None:
    display = DISPLAYS[3]
    rig = Rig(position=(0, 0, 10), fov_y=fov_y, baseline=baseline, aspect=display.aspect, focal_distance=9.0)
    budget = depth_budget(np.array([[-1, -1, -1], [1, 1, 1]]), display, rig)
    for depth, sign in zip(budget.comfortable, (-1, 1), strict=True):
        if math.isfinite(depth):
            assert disparities(rig, display, np.array([depth]))[0] == pytest.approx(sign * display.comfort, rel=1e-6)


def test_budget_when_nothing_moves_or_the_camera_is_inside() -> None:
    display = Display.preset("lenticular-8")
    still = depth_budget(box((0, 0, 0), (1, 1, 1)), display, Rig(baseline=0.0))
    assert (still.disparity_near, still.disparity_far, still.comfortable) == (0, 0, (0, math.inf))
    inside = depth_budget(box((0, 0, 0), (9, 9, 9)), display, Rig())
    assert inside.nearest == Rig().near_depth and inside.farthest == 13
    with pytest.raises(aus.InputError, match="whole scene lies behind the camera"):
        depth_budget(box((0, 0, 9), (1, 1, 1)), display, Rig())
    with pytest.raises(aus.InputError, match="8 views, the rig gives 3 offsets"):
        depth_budget(box((0, 0, 0), (1, 1, 1)), display, Rig(offsets=(-1, 0, 1)))


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (np.zeros((3, 2)), r"bounds: expected shape \(2, 3\), got \(3, 2\)"),
        (np.full((2, 3), np.nan), "bounds: expected finite coordinates"),
        ([[0, 0, 0], [1, 1, np.inf]], "bounds: expected finite coordinates"),
        ([[0, 0, 0], [1, 1, 1e300]], "bounds: expected finite coordinates up to 1e"),
        ([[0, 0, 1], [1, 1, 0]], "the lower corner first"),
        ("abc", "bounds: expected numbers"),
    ],
)
def test_bad_bounds(bounds: object, message: str) -> None:
    with pytest.raises(aus.InputError, match=message):
        frame_rig(SimpleNamespace(bounds=bounds), DISPLAYS[0])


def test_a_real_scene_is_framed() -> None:
    mesh = aus.Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]), np.array([[0, 1, 2]]))
    rig = Rig.frame(aus.Scene(mesh), Display.preset("looking-glass-portrait"))
    assert rig.position[:2] == (0.5, 0.5) and rig.target == (0.5, 0.5, 0.25)


# --- pictures with depth ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("display", DISPLAYS, ids=lambda d: d.name)
@pytest.mark.parametrize(("near", "far"), [(1.0, 1.0), (0.5, 40.0), (2.0, 2.25)])
def test_depths_of_a_picture_are_comfortable_and_balanced(display, near, far):
    """What lies between the hundredth and the ninety-ninth per cent; neither an outlier nor the sky counts."""
    rng = np.random.default_rng(0)
    depth = np.full((40, 50), np.inf, np.float32)
    depth[:30] = rng.permutation([near] * 745 + [far] * 745 + [1e-3] * 5 + [1e6] * 5).reshape(30, 50)
    rig = frame_depths(depth, display, 50.0)
    assert (rig.fov_y, rig.views, rig.aspect) == (50.0, display.views, display.aspect)
    assert 1 / rig.focal == pytest.approx((1 / near + 1 / far) / 2)
    assert rig.baseline <= 2 * rig.focal * math.tan(math.radians(display.cone_deg) / 2) * (1 + 1e-9)
    budget = depth_budget(np.array([[-1, -1, -far], [1, 1, -near]]), display, rig)
    assert budget.fits and budget.disparity_near == pytest.approx(-budget.disparity_far, abs=1e-9)


def test_a_picture_without_depths_cannot_be_framed():
    with pytest.raises(aus.InputError, match="depth: expected some finite depths, found none"):
        frame_depths(np.full((2, 2), np.inf, np.float32), DISPLAYS[0], 50.0)
