"""Presets: every built-in one, the nominal figures of the Looking Glass models, and a user's own files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo.display.display import Display
from autostereo.display.presets import MASKS, preset_title
from autostereo.display.quilt import Quilt

PRESETS = Display.presets()


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
        ("width = 10\nheight = 10\n[mask]\nkind = 'anaglyph'", "source: missing, expected where the numbers come from"),
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
