"""Displays: masks against the tables in the papers, constructors, and variants of a display."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.display.display import Display
from autostereo.display.quilt import Quilt


def rows_of(display: Display) -> list[list[int]]:
    """Views of the sub-pixels of each row, from the top."""
    return display.view_of_subpixel().reshape(display.height, -1).tolist()


# --- masks against what the sources print --------------------------------------------------------------------


def test_lenticular_per_pixel_is_x_mod_v() -> None:
    assert rows_of(Display.lenticular(4, 2, 3)) == [[0, 0, 0, 1, 1, 1, 2, 2, 2, 0, 0, 0]] * 2


def test_lenticular_per_subpixel_is_de_sorbier_figure_4a() -> None:
    assert rows_of(Display.lenticular(4, 2, 6, per="subpixel")) == [[0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5]] * 2


@settings(deadline=None)
@given(st.integers(1, 128), st.sampled_from(["pixel", "subpixel"]))
def test_lenticular_of_any_number_of_views(views: int, per: str) -> None:
    view = Display.lenticular(50, 2, views, per=per).view_of_subpixel()
    x, c = np.ogrid[:50, :3]
    assert np.array_equal(view[1], ((x + 0 * c) if per == "pixel" else 3 * x + c) % views)


def test_slanted_6_views_is_de_sorbier_figure_4b() -> None:
    view = rows_of(replace(Display.preset("de-sorbier-6-slanted"), width=2, height=7))
    assert view == [
        [0, 2, 4, 0, 2, 4],
        [5, 1, 3, 5, 1, 3],
        [4, 0, 2, 4, 0, 2],
        [3, 5, 1, 3, 5, 1],
        [2, 4, 0, 2, 4, 0],
        [1, 3, 5, 1, 3, 5],
        [0, 2, 4, 0, 2, 4],
    ]


def test_wavelength_selective_is_erratum_4() -> None:
    display = Display.wavelength_selective(20, 30)
    view = display.view_of_subpixel()
    for r in range(30):
        for x in range(20):
            x_offset, y_offset = 3 * x % 8, (r + 1) % 12
            red = (math.floor((1 + y_offset + math.floor(y_offset / 3)) / 2) + x_offset) % 8
            assert view[r, x].tolist() == [red, (red + 1) % 8, (red + 2) % 8]
    assert display.views == 8
    assert display.viewmap is not None and display.viewmap.table is not None
    assert display.viewmap.table.shape == (12, 8, 3)
    assert np.bincount(display.viewmap.table.ravel()).tolist() == [36] * 8


def test_alioscopy_shifts_by_a_subpixel_each_row_and_uses_views_alike() -> None:
    display = replace(Display.preset("alioscopy-8"), width=64, height=40)
    s = display.view_of_subpixel().reshape(40, -1)
    assert s[0].tolist() == [i % 8 for i in range(192)]
    assert np.array_equal(s[1:, 1:], s[:-1, :-1])
    assert np.bincount(s.ravel()).tolist() == [64 * 40 * 3 // 8] * 8


@settings(deadline=None)
@given(
    lens=st.floats(1.5, 60), slant=st.floats(-40, 40), phase=st.floats(-3, 3), views=st.integers(1, 128)
)
def test_physical_slanted_is_pmr_equation_14(lens: float, slant: float, phase: float, views: int) -> None:
    numbers = dict(lens_pitch=lens * 0.05, subpixel_pitch=0.05, slant_deg=slant, phase=phase)
    display = Display.slanted(9, 8, views, continuous=True, **numbers)  # type: ignore[arg-type]
    r, x, c = np.ogrid[:8, :9, :3]
    alpha = math.radians(slant)
    period = lens / math.cos(alpha)
    t = (3 * x + c - 3 * r * math.tan(alpha)) / period + phase
    phi = (display.view_of_subpixel() + 0.5) / views
    error = phi - t
    assert np.abs(error - np.round(error)).max() < 1e-9
    discrete = Display.slanted(9, 8, views, **numbers)  # type: ignore[arg-type]
    assert discrete.view_of_subpixel().dtype == np.int32
    assert np.array_equal(discrete.view_of_subpixel(), np.minimum(np.floor(phi * views + 1e-13), views - 1)) or (
        np.abs(phi * views - np.round(phi * views)).min() < 1e-9
    )


def test_physical_slanted_leans_like_a_backslash() -> None:
    display = Display.slanted(40, 30, 8, lens_pitch=8.0, subpixel_pitch=1.0, slant_deg=45.0, continuous=True)
    phi = display.viewmap.phase(np.arange(30), np.arange(40))  # type: ignore[union-attr]
    shift = phi[1:, 1:] - phi[:-1, :-1]  # one pixel to the right and one down is along the lens
    assert np.abs(shift - np.round(shift)).max() < 1e-12


def test_slanted_of_whole_numbers_is_the_table_where_floats_are_safe() -> None:
    alpha = math.degrees(math.atan(1 / 3))
    shifted = Display.slanted(
        16, 16, 8, lens_pitch=8 * math.cos(math.radians(alpha)), subpixel_pitch=1.0, slant_deg=alpha, phase=1 / 16
    )
    table = Display.from_table(16, 16, 8, replace(Display.preset("alioscopy-8"), width=8, height=8).view_of_subpixel())
    assert np.array_equal(shifted.view_of_subpixel(), table.view_of_subpixel())


@pytest.mark.parametrize(
    ("layout", "expected"),
    [
        ("row-interleaved", [[0, 0], [1, 1], [0, 0]]),
        ("column-interleaved", [[0, 1], [0, 1], [0, 1]]),
        ("checkerboard", [[0, 1], [1, 0], [0, 1]]),
    ],
)
def test_two_view_masks(layout: str, expected: list[list[int]]) -> None:
    display = Display.stereo(2, 3, layout)
    assert display.layout == "interlaced" and display.views == 2
    assert np.array_equal(display.view_of_subpixel(), np.repeat(np.array(expected)[..., None], 3, axis=2))
    swapped = Display.stereo(2, 3, layout, reverse=True)
    assert np.array_equal(swapped.view_of_subpixel(), 1 - display.view_of_subpixel())


def test_user_table() -> None:
    table = [[[0, 1, 2], [2, 1, 0]]]
    assert Display.from_table(3, 2, 3, table).view_of_subpixel().tolist() == [[[0, 1, 2], [2, 1, 0], [0, 1, 2]]] * 2


# --- constructors ---------------------------------------------------------------------------------------------

SLANTED = dict(lens_pitch=8.0, subpixel_pitch=1.0, slant_deg=10.0)
CONSTRUCTORS = {
    "lenticular": lambda **k: Display.lenticular(12, 8, 4, **k),
    "wavelength": lambda **k: Display.wavelength_selective(12, 8, **k),
    "slanted": lambda **k: Display.slanted(12, 8, 8, **SLANTED, **k),
    "slanted continuous": lambda **k: Display.slanted(12, 8, 8, **SLANTED, continuous=True, **k),
    "table": lambda **k: Display.from_table(12, 8, 2, [[[0, 1, 0]]], **k),
    "preset": lambda **k: Display.preset("looking-glass-go", **k).resized(12, 8),
    **{f"stereo {n}": (lambda n=n, **k: Display.stereo(12, 8, n, **k)) for n in ("side-by-side", "checkerboard")},
    "anaglyph": lambda **k: Display.anaglyph(12, 8, **k),
    "rgbd": lambda **k: Display.rgbd(12, 8, **k),
}


@pytest.mark.parametrize("name", CONSTRUCTORS)
def test_every_constructor_takes_reverse_and_swapped_toggles_it(name: str) -> None:
    plain, reverse = CONSTRUCTORS[name](), CONSTRUCTORS[name](reverse=True)
    assert reverse.reverse is not plain.reverse
    assert plain.swapped().reverse is reverse.reverse and plain.swapped().swapped().reverse is plain.reverse
    assert (plain.width, plain.height, plain.views) == (12, 8, reverse.views)
    if plain.viewmap is not None:
        assert plain.viewmap.reverse is plain.reverse and not plain.eyes_swapped
        assert np.array_equal(plain.swapped().view_of_subpixel(), reverse.view_of_subpixel())
        phi = plain.view_of_subpixel()
        if plain.continuous:
            phi = (phi + 0.5) / plain.views
            assert np.array_equal((reverse.view_of_subpixel() + 0.5) / plain.views, np.where(phi == 0, 0, 1 - phi))
        else:
            assert np.array_equal(reverse.view_of_subpixel(), plain.views - 1 - phi)


def test_packed_layouts_have_sizes() -> None:
    sizes = {
        "side-by-side": ((60, 40), (120, 40)),
        "side-by-side-half": ((30, 40), (60, 40)),
        "top-bottom": ((60, 40), (60, 80)),
        "top-bottom-half": ((60, 20), (60, 40)),
    }
    for layout, expected in sizes.items():
        display = Display.stereo(60, 40, layout)
        assert (display.view_size, display.picture_size) == expected
        assert (display.layout, display.views, display.aspect) == (layout, 2, 1.5)
        with pytest.raises(aus.UnsupportedError, match="has no mask"):
            display.view_of_subpixel()
    assert Display.rgbd(60, 40).view_size == (30, 40) and Display.rgbd(60, 40).views == 1
    assert Display.anaglyph(60, 40).view_size == Display.anaglyph(60, 40).picture_size == (60, 40)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Display.lenticular(0, 8, 4), "width: expected a whole number of pixels 1…32768, got 0"),
        (lambda: Display.lenticular(8, 40000, 4), "height: expected a whole number of pixels 1…32768, got 40000"),
        (lambda: Display.lenticular(8.0, 8, 4), "width: expected a whole number"),
        (lambda: Display.lenticular(True, 8, 4), "width: expected a whole number"),
        (lambda: Display.lenticular(8, 8, 0), "views: expected a whole number 1…4096, got 0"),
        (lambda: Display.lenticular(8, 8, "8"), "views: expected a whole number"),
        (lambda: Display.lenticular(8, 8, 4, per="row"), "per: expected one of pixel, subpixel, got 'row'"),
        (lambda: Display.lenticular(8, 8, 4, reverse="no"), "reverse: expected True or False"),
        (lambda: Display.slanted(8, 8, 4, lens_pitch=0, subpixel_pitch=1, slant_deg=0), "lens_pitch: expected"),
        (lambda: Display.slanted(8, 8, 4, lens_pitch=1, subpixel_pitch=-1, slant_deg=0), "subpixel_pitch: expected"),
        (lambda: Display.slanted(8, 8, 4, lens_pitch=1, subpixel_pitch=1, slant_deg=90), "slant_deg: expected"),
        (
            lambda: Display.slanted(8, 8, 4, lens_pitch=1, subpixel_pitch=1, slant_deg=0, phase=math.nan),
            "phase: expected",
        ),
        (
            lambda: Display.slanted(8, 8, 4, lens_pitch=1e-8, subpixel_pitch=1, slant_deg=0),
            "one lens covers 1e-08 sub-pixels",
        ),
        (lambda: Display.from_table(8, 8, 2, [[[0, 1, 2]]]), "view indices 0…1, found 0…2"),
        (lambda: Display.from_table(8, 8, 2, [[0, 1]]), r"table: expected shape \(h, w, 3\), got \(1, 2\)"),
        (lambda: Display.from_table(8, 8, 2, [[[0.5, 1, 1]]]), "table: expected integers, got float64"),
        (lambda: Display.from_table(8, 8, 2, [[[0, 1, 1]], [[0], [1]]]), "uneven rows"),
        (lambda: Display.from_table(8, 8, 2, [[["a", "b", "c"]]]), "table: expected an array of integers .*got text"),
        (lambda: Display.stereo(8, 8, "diagonal"), "layout: expected one of side-by-side, .*got 'diagonal'"),
        (lambda: Display.stereo(7, 8, "side-by-side-half"), "expected an even number of pixels to halve, got 7"),
        (lambda: Display.stereo(8, 7, "top-bottom-half"), "expected an even number of pixels to halve, got 7"),
        (lambda: Display.rgbd(7, 8), "expected an even number"),
        (lambda: Display("x", 8, 8), "a view map is missing"),
        (lambda: Display("x", 8, 8, layout="quad"), "layout: expected one of interlaced"),
        (lambda: Display.lenticular(8, 8, 4).physical(size_mm=100), r"size_mm: expected \(width, height\)"),
        (lambda: Display.lenticular(8, 8, 4).physical(size_mm=(100, 0)), "size_mm height: expected a number"),
        (lambda: Display.lenticular(8, 8, 4).physical(distance_mm=-1), "distance_mm: expected a number"),
        (lambda: Display.lenticular(8, 8, 4).physical(cone_deg=180), "cone_deg: expected a number"),
        (lambda: Display.lenticular(8, 8, 4).with_views(5), "views: lenticular-4-pixel .* has 4 by its mask"),
        (lambda: Quilt(0, 6, 10, 10, 1.0), "quilt columns: expected a whole number"),
        (lambda: Quilt(20, 6, 10, 10, 1.0), "20×6 tiles do not fit 10×10 pixels"),
        (lambda: Quilt(2, 2, 10, 10, 0), "quilt aspect: expected a number"),
        (lambda: replace(Display.lenticular(8, 8, 4), quilt=Quilt(1, 3, 9, 9, 1.0)), "1×3 tiles cannot hold 4 views"),
    ],
)
def test_bad_displays_name_the_field(make: object, message: str) -> None:
    with pytest.raises(aus.InputError, match=message):
        make()  # type: ignore[operator]


# --- variants -------------------------------------------------------------------------------------------------


def test_physical_keeps_what_is_not_given() -> None:
    display = Display.lenticular(8, 8, 4).physical(size_mm=(160, 90))
    further = display.physical(distance_mm=600, cone_deg=20)
    assert (further.size_mm, further.distance_mm, further.cone_deg) == ((160.0, 90.0), 600.0, 20.0)
    assert further.viewmap is display.viewmap


def test_with_views_samples_the_same_phase() -> None:
    go = Display.preset("looking-glass-go").resized(50, 40)
    more = go.with_views(100)
    rows, columns = np.arange(40), np.arange(50)
    assert (more.views, more.quilt, go.with_views(66).quilt) == (100, None, go.quilt)
    assert np.array_equal(more.viewmap.phase(rows, columns), go.viewmap.phase(rows, columns))  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["looking-glass-16-landscape", "looking-glass-16-portrait", "looking-glass-portrait"])
@pytest.mark.parametrize("swap", [False, True])
def test_resized_looking_glass_is_the_bottom_left_corner_of_the_panel(name: str, swap: bool) -> None:
    whole = Display.preset(name, reverse=swap)
    part = whole.resized(30, 21)
    rows, columns = np.arange(21), np.arange(30)
    expected = whole.viewmap.phase(whole.height - 21 + rows, columns)  # type: ignore[union-attr]
    difference = part.viewmap.phase(rows, columns) - expected  # type: ignore[union-attr]
    assert np.abs(difference - np.round(difference)).max() < 1e-9
    assert part.reverse is whole.reverse
    assert part.size_mm == pytest.approx([30 * 25.4 / whole.calibration.dpi, 21 * 25.4 / whole.calibration.dpi])  # type: ignore[union-attr]
    assert part.quilt is not None and part.quilt.aspect == 30 / 21


def test_resized_table_and_slanted_are_the_top_left_corner() -> None:
    for display in (Display.wavelength_selective(30, 30), Display.slanted(30, 30, 7, **SLANTED)):
        assert np.array_equal(display.resized(11, 13).view_of_subpixel(), display.view_of_subpixel()[:13, :11])
