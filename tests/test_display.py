"""Displays: masks against the tables in the papers, presets, and variants of a display."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.display.display import Display
from autostereo.display.presets import MASKS, preset_title
from autostereo.display.quilt import Quilt

PRESETS = Display.presets()


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
        (lambda: Display.from_table(8, 8, 2, [[[0, 1, 1]], [[0], [1]]]), "rows of unequal length"),
        (lambda: Display.from_table(8, 8, 2, [[["a", "b", "c"]]]), "table: expected integers"),
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


# --- presets --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_loads(name: str) -> None:
    display = Display.preset(name)
    assert display.name == name and len(display.source) > 10 and preset_title(name)
    assert display.quilt is None or display.quilt.views == display.views
    if display.quilt is not None:
        assert display.quilt.aspect == pytest.approx(display.aspect, rel=1e-9)
    if display.viewmap is not None:
        part = display.resized(60, 60).view_of_subpixel()
        assert part.min() >= 0 and part.max() < display.views
        if display.viewmap.table is not None:
            assert set(np.unique(display.viewmap.table)) == set(range(display.views))


# model, serial, panel, DPI, pitch, slope, cone, quilt pixels, columns × rows, pixels per lens
MODELS = [
    ("8.9-gen1", "LKG-2K", (2560, 1600), 338, 49.80, 5.48, 40, (4096, 4096), (5, 9), 6.90),
    ("15.6-gen1", "LKG-4K", (3840, 2160), 283, 50.07, -7.7, 40, (4096, 4096), (5, 9), 5.70),
    ("8k-gen1", "LKG-8K", (7680, 4320), 280, 38.05, -7.7, 40, (8192, 8192), (5, 9), 7.42),
    ("portrait", "LKG-P", (1536, 2048), 324, 52, -7, 40, (3360, 3360), (8, 6), 6.29),
    ("16-gen2", "LKG-A", (3840, 2160), 283, 50, -7, 40, (4096, 4096), (5, 9), 5.72),
    ("32-gen2", "LKG-B", (7680, 4320), 280, 42, -6, 40, (8192, 8192), (5, 9), 6.76),
    ("65", "LKG-D", (7680, 4320), 136, 42, -6, 40, (8192, 8192), (8, 9), 3.28),
    ("go", "LKG-E", (1440, 2560), 491, 80.7, -6.3, 54, (4092, 4092), (11, 6), 6.16),
    ("kiosk", "LKG-F", (1536, 2048), 324, 52, -7, 40, (3360, 3360), (8, 6), 6.29),
    ("16-landscape", "LKG-J", (3840, 2160), 283, 44.72, -6.9, 50, (7680, 4320), (8, 6), 6.39),
    ("16-portrait", "LKG-H", (2160, 3840), 283, 44.72, -7.45, 50, (5995, 6000), (11, 6), 6.39),
    ("32-landscape", "LKG-L", (7680, 4320), 280, 75, -7.2, 50, (8190, 8190), (7, 7), 3.77),
    ("32-portrait", "LKG-K", (4320, 7680), 280, 80.7, -6.3, 54, (8184, 8184), (11, 6), 3.51),
]


@pytest.mark.parametrize("model", MODELS, ids=[m[0] for m in MODELS])
def test_looking_glass_presets_hold_the_nominal_figures(model: tuple) -> None:
    name, serial, panel, dpi, pitch, slope, cone, quilt, grid, per_lens = model
    display = Display.preset(f"looking-glass-{name}")
    c = display.calibration
    assert c is not None and display.quilt is not None
    assert (display.width, display.height) == panel and (c.dpi, c.pitch, c.slope) == (dpi, pitch, slope)
    assert display.cone_deg == cone and display.fov_y == 14
    assert (display.quilt.width, display.quilt.height) == quilt
    assert (display.quilt.columns, display.quilt.rows) == grid
    assert c.lens_subpixels / 3 == pytest.approx(per_lens, abs=0.006)
    assert Display.from_calibration(visual(display, serial + "00001")).views == display.views


def visual(display: Display, serial: str) -> dict:
    c = display.calibration
    assert c is not None
    numbers = dict(pitch=c.pitch, slope=c.slope, center=0, DPI=c.dpi, screenW=c.width, screenH=c.height)
    return {"serial": serial, **{k: {"value": v} for k, v in numbers.items()}}


def test_wanted_tile_sizes() -> None:
    assert Display.preset("looking-glass-portrait").quilt.tile == (420, 560)  # type: ignore[union-attr]
    assert Display.preset("light-field-8k").quilt.tile == (1024, 512)  # type: ignore[union-attr]


def test_unknown_preset_lists_close_names() -> None:
    with pytest.raises(aus.InputError, match=r"display 'looking-glas-portrait'.*close matches: looking-glass-portrait"):
        Display.preset("looking-glas-portrait")
    with pytest.raises(aus.InputError, match="there are acer-spatiallabs, alioscopy-8"):
        Display.preset("zzzzqqqq")
    with pytest.raises(aus.InputError, match="expected a preset's name or a path, got int"):
        Display.preset(3)  # type: ignore[arg-type]


OWN = """
source = "my own measurement"
width = 640
height = 480
reverse = true
comfort = 3.5
fov_y = 20
[mask]
kind = "slanted"
views = 9
lens_pitch = 0.45
subpixel_pitch = 0.1
slant_deg = 9.46
continuous = true
[optics]
size_mm = [300, 225]
distance_mm = 650
cone_deg = 25
[quilt]
columns = 3
rows = 3
width = 600
height = 450
aspect = 1.3333
"""


def test_own_display_goes_through_the_same_door(tmp_path: Path) -> None:
    path = tmp_path / "my-panel.toml"
    path.write_text(OWN, encoding="utf-8")
    for spelling in (path, str(path)):
        display = Display.preset(spelling)
        assert (display.name, display.views, display.continuous, display.reverse) == ("my-panel", 9, True, True)
        assert (display.size_mm, display.distance_mm, display.cone_deg) == ((300.0, 225.0), 650.0, 25.0)
        assert (display.comfort, display.fov_y, display.source) == (3.5, 20.0, "my own measurement")
        assert display.quilt == Quilt(3, 3, 600, 450, 1.3333)


@pytest.mark.parametrize("kind", [k for k in MASKS if k not in ("slanted",)])
def test_own_display_of_every_kind(kind: str, tmp_path: Path) -> None:
    arguments = {
        "lenticular": "views = 5\nper = 'subpixel'",
        "sloped": "views = 5\nstep = 1\nrow_step = 2",
        "table": "views = 2\ntable = [[[0, 1, 0]], [[1, 0, 1]]]",
        "stereo": "layout = 'checkerboard'",
    }
    path = tmp_path / "own.toml"
    mask = f"[mask]\nkind = '{kind}'\n" + arguments.get(kind, "")
    path.write_text("source = 'test'\nwidth = 10\nheight = 10\n" + mask, encoding="utf-8")
    assert Display.preset(path).width == 10


HEAD = "source = 'x'\nwidth = 10\nheight = 10\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "width: missing"),
        ("source = ", "expected a display as TOML"),
        ("\xff\xfe\x00", "expected a display as TOML"),
        ("[" * 20000, "expected a display as TOML"),
        ("width = 10\nheight = 10\n[mask]\nkind = 'anaglyph'", "source: missing"),
        (HEAD, r"expected either a \[mask\] or a \[calibration\]"),
        (HEAD + "mask = 3", "mask: expected a table, found 3"),
        (HEAD + "depth = 3\n[mask]\nkind = 'anaglyph'", "unknown field 'depth'"),
        (HEAD + "[mask]\nkind = 'hologram'", "mask kind: expected one of lenticular, .*found 'hologram'"),
        (HEAD + "[mask]\nkind = 'lenticular'", "mask views: missing"),
        (HEAD + "[mask]\nkind = 'lenticular'\nviews = 2\npitch = 3", "unknown field 'pitch'; there are views, per"),
        (HEAD + "reverse = 1\n[mask]\nkind = 'anaglyph'", "reverse: expected True or False, got 1"),
        (HEAD.replace("10", "'a'") + "[mask]\nkind = 'anaglyph'", "width: expected a whole number"),
        (HEAD + "[calibration]\npitch = 50", "slope: expected a number .*found nothing"),
        (HEAD + "[mask]\nkind = 'anaglyph'\n[optics]\nlens = 3", "optics: unknown field 'lens'; there are size_mm"),
        (HEAD + "[mask]\nkind = 'anaglyph'\n[quilt]\ncolumns = 3", "quilt rows: missing"),
    ],
)
def test_bad_preset_files_name_the_file(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(aus.FileError, match=message) as error:
        Display.preset(path)
    assert str(error.value).startswith(str(path)) and "\n" not in str(error.value).strip()


def test_missing_preset_file(tmp_path: Path) -> None:
    with pytest.raises(aus.FileError, match=r"nowhere\.toml: cannot be read"):
        Display.preset(str(tmp_path / "nowhere.toml"))
    with pytest.raises(aus.FileError, match="cannot be read"):
        Display.preset(tmp_path)
