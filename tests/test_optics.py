"""Optics: which zone an eye is in, by closed forms, and a real lens that must show an orthoscopic picture."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.display.calibration import Calibration
from autostereo.display.display import Display
from autostereo.display.optics import column_mm, eye_at, wanted_phase, zone_coordinate

PANEL = Display.lenticular(12, 4, 8).physical(size_mm=(360.0, 120.0), cone_deg=40.0)
CONVERGING = PANEL.physical(distance_mm=700.0)
TAN = math.tan(math.radians(20))


# --- closed forms ----------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.integers(1, 128), st.floats(-0.5, 130))
def test_a_view_has_one_phase_over_the_whole_panel(views: int, u: float) -> None:
    phase = wanted_phase(Display.lenticular(7, 2, views), view=u)
    assert phase.shape == (7, 3) and phase.dtype == np.float64
    assert (phase == phase[0, 0]).all() and 0 <= phase[0, 0] < 1
    difference = phase[0, 0] - (u + 0.5) / views
    assert abs(difference - round(difference)) < 1e-9


@pytest.mark.parametrize("display", [PANEL, PANEL.swapped(), Display.preset("looking-glass-go").resized(90, 7)])
def test_the_zone_of_a_view_is_where_the_mask_shows_it(display: Display) -> None:
    """Discrete masks: a sub-pixel shows view i exactly when the phase of zone i is nearest, whatever `reverse`."""
    vm = display.viewmap
    assert vm is not None
    rows, columns = np.arange(display.height), np.arange(display.width)
    view = vm.view(rows, columns)
    phase = (view + 0.5) / vm.views if vm.table is not None else vm.phase(rows, columns)
    distance = np.stack(
        [np.abs((phase - wanted_phase(display, view=i) + 0.5) % 1 - 0.5) for i in range(display.views)]
    )
    assert np.array_equal(distance.argmin(axis=0), view)


def test_columns_lie_at_the_centres_of_their_subpixels() -> None:
    x = column_mm(PANEL)
    assert x[0] == pytest.approx([-175, -165, -155]) and x[-1] == pytest.approx([155, 165, 175])
    assert column_mm(replace(PANEL, flip_x=True)) == pytest.approx(-x)


@settings(deadline=None)
@given(st.floats(-500, 500), st.floats(100, 3000))
def test_parallel_and_converging_zones_are_the_printed_forms(x_eye: float, z_eye: float) -> None:
    x = column_mm(PANEL)
    parallel = 0.5 + (x_eye - x) / (2 * z_eye * TAN)
    converging = 0.5 + (x + (x_eye - x) * 700 / z_eye) / (2 * 700 * TAN)  # V · zone width = 2·D·tan(cone/2)
    assert zone_coordinate(PANEL, (x_eye, z_eye)) == pytest.approx(parallel, abs=1e-12)
    assert zone_coordinate(CONVERGING, (x_eye, z_eye)) == pytest.approx(converging, abs=1e-12)
    for display, f in ((PANEL, parallel), (CONVERGING, converging)):
        difference = wanted_phase(display, eye=(x_eye, z_eye)) - f
        assert np.abs(difference - np.round(difference)).max() < 1e-9


def test_zones_that_meet_far_away_are_parallel() -> None:
    far = PANEL.physical(distance_mm=9e8)
    assert zone_coordinate(far, (50.0, 600.0)) == pytest.approx(zone_coordinate(PANEL, (50.0, 600.0)), abs=1e-6)


@pytest.mark.parametrize("u", [-0.4, 0, 2.25, 3.5, 7, 7.4])
def test_where_zones_meet_the_whole_panel_shows_one_view(u: float) -> None:
    eye = eye_at(CONVERGING, u)
    assert eye[1] == 700
    assert np.abs(wanted_phase(CONVERGING, eye=eye) - (u + 0.5) / 8).max() < 1e-12
    x, z = eye_at(PANEL, u)
    assert z == pytest.approx(3 * math.hypot(360, 120))
    centre = replace(PANEL, width=1, viewmap=PANEL.viewmap)  # the green sub-pixel of one column is at the centre
    assert wanted_phase(centre, eye=(x, z))[0, 1] == pytest.approx((u + 0.5) / 8)


@pytest.mark.parametrize("display", [PANEL, CONVERGING, PANEL.swapped(), replace(PANEL, flip_x=True)])
def test_zones_count_from_the_left_as_the_viewer_sees_them(display: Display) -> None:
    left, right = (zone_coordinate(display, (x, 650.0)) for x in (-32.0, 32.0))
    assert (right - left) == pytest.approx(64 / (2 * 650 * TAN))


def test_two_eyes_see_left_and_right_views_of_a_two_view_panel() -> None:
    display = Display.stereo(4, 2, "column-interleaved").physical(size_mm=(300, 200), distance_mm=600, cone_deg=12)
    assert (np.floor(wanted_phase(display, eye=(-32, 600)) * 2) == 0).all()
    assert (np.floor(wanted_phase(display, eye=(32, 600)) * 2) == 1).all()


@pytest.mark.parametrize(
    ("display", "options", "message"),
    [
        (PANEL, {}, "either view .* or eye"),
        (PANEL, dict(view=1, eye=(0, 1)), "either view .* or eye"),
        (PANEL, dict(view="1"), "view: expected a number, got '1'"),
        (PANEL, dict(view=math.nan), "view: expected a number"),
        (PANEL, dict(eye=(0, 0)), "eye z: expected a number from 0.001"),
        (PANEL, dict(eye=(0, -5)), "eye z"),
        (PANEL, dict(eye=(math.inf, 5)), "eye x"),
        (PANEL, dict(eye=(1, 2, 3)), r"eye: expected \(x, z\) in mm"),
        (PANEL, dict(eye="12"), r"eye: expected \(x, z\) in mm"),
        (Display.lenticular(4, 4, 4), dict(eye=(0, 500)), "lenticular-4-pixel has no size; give it one with .physical"),
        (Display.anaglyph(4, 4), dict(view=0), "anaglyph picture has no zones"),
    ],
)
def test_bad_eyes(display: Display, options: dict, message: str) -> None:
    with pytest.raises(aus.AutostereoError, match=message):
        wanted_phase(display, **options)


# --- a real lens -----------------------------------------------------------------------------------------------


def through_lenses(display: Display, eye: tuple[float, float]) -> list[tuple[int, int, int, float]]:
    """What one eye sees of row 0 through a sheet of real lenses: (column, channel, view, zone coordinate) per lens.

    An independent model in the viewer's space, lengths in panel widths. Lens k has its axis at p_k and covers one
    pitch; a sub-pixel left of the axis sends its light to the right, at most by cone/2. Nothing here knows of phases,
    mirroring or `reverse`; the views come from the mask.
    """
    c: Calibration | None = display.calibration
    assert c is not None and display.size_mm is not None
    inches = c.width / c.dpi
    pitch = 1 / (c.pitch * inches * math.cos(math.atan(1 / c.slope)))
    height = (c.height - 0.5) / c.height * (c.height / c.width)  # of the top row over the bottom edge
    s = np.arange(3 * c.width)
    place = (s // 3 + 0.5) / c.width + (s % 3) / (3 * c.width)
    lean = height / c.slope
    if c.flip_x:  # seen in a mirror
        place, lean = 1 - place, -lean
    views = display.viewmap.view(np.array([0]), np.arange(c.width))[0].reshape(-1)  # type: ignore[union-attr]
    x_eye, z_eye = eye[0] / display.size_mm[0], eye[1] / display.size_mm[0]
    seen = []
    for k in range(int(-0.1 * c.lenses), int(1.1 * c.lenses)):
        axis = (k + 0.5 + c.center) * pitch - lean
        under = np.flatnonzero(np.abs(place - axis) <= pitch / 2)
        if len(under) < int(3 * c.width * pitch):  # a lens cut off by the edge
            continue
        ray = (x_eye - (axis - 0.5)) / z_eye  # tan of the direction to the eye
        emitted = -(place[under] - axis) / (pitch / 2) * math.tan(math.radians(c.cone_deg) / 2)
        best = under[np.argmin(np.abs(emitted - ray))]
        zone = 0.5 + ray / (2 * math.tan(math.radians(c.cone_deg) / 2))
        seen.append((int(best) // 3, int(best) % 3, int(views[best]), zone))
    return seen


def unit(**flags: int) -> Display:
    numbers = dict(pitch=52.56, slope=-7.142, center=0.4735, DPI=324, screenW=384, screenH=200, viewCone=40)
    return Display.from_calibration({**numbers, "serial": "LKG-P", **flags})


@pytest.mark.parametrize("flip", [0, 1])
def test_a_calibration_with_inv_view_is_orthoscopic_through_a_real_lens(flip: int) -> None:
    display = unit(invView=1, flipImageX=flip)
    means = []
    for x_eye in (-60.0, -30.0, 0.0, 30.0, 60.0):
        seen = through_lenses(display, (x_eye, 400.0))
        assert len(seen) > 40
        # a lens covers 18 or 19 sub-pixels, so that the nearest is up to 1.4 of 48 views away from the ideal one
        for _, _, view, zone in seen:
            assert abs(view + 0.5 - zone * 48) < 2
        means.append(np.mean([view for _, _, view, _ in seen]))
    assert (np.diff(means) > 3).all()  # the further right the eye, the further right the camera


def test_without_inv_view_the_real_lens_is_pseudoscopic_and_swapped_mends_it() -> None:
    def mean(display: Display, x_eye: float) -> float:
        return float(np.mean([view for _, _, view, _ in through_lenses(display, (x_eye, 400.0))]))

    wrong = unit(invView=0)
    assert mean(wrong, 40.0) < mean(wrong, -40.0) - 5
    assert mean(wrong.swapped(), 40.0) > mean(wrong.swapped(), -40.0) + 5


@pytest.mark.parametrize("flip", [0, 1])
@pytest.mark.parametrize("x_eye", [-70.0, 0.0, 45.0])
def test_the_wanted_phase_is_that_of_the_subpixel_a_real_lens_shows(flip: int, x_eye: float) -> None:
    display = unit(invView=1, flipImageX=flip)
    wanted = wanted_phase(display, eye=(x_eye, 400.0))
    phase = display.viewmap.phase(np.array([0]), np.arange(display.width))[0]  # type: ignore[union-attr]
    step = 1 / display.calibration.lens_subpixels  # type: ignore[union-attr]
    for column, channel, _, _ in through_lenses(display, (x_eye, 400.0)):
        distance = abs((phase[column, channel] - wanted[column, channel] + 0.5) % 1 - 0.5)
        assert distance < 0.6 * step  # half a sub-pixel, and a little for a lens that is not a point
