"""Looking Glass calibrations: the phase against two other forms, symmetries, cells, and files that are wrong."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.display.calibration import Calibration, read_calibration
from autostereo.display.display import Display
from autostereo.viewmap import cell_index

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "quilts"
REAL = ["visual_LKG-PORT-05935_v1.json", "visual_LKG-J00133_v3.json"]

# the numbers of two real units, so that the tests need no files
PORTRAIT = dict(
    pitch=52.56046553048362, slope=-7.1423088016812, center=0.47345216539737284, DPI=324.0, screenW=1536, screenH=2048,
    viewCone=40.0, invView=1, serial="LKG-PORT-05935",
)  # fmt: skip
GEN3 = dict(
    pitch=44.74761962890625, slope=-6.855094909667969, center=-0.26516956090927126, DPI=283.0, screenW=3840,
    screenH=2160, viewCone=50.0, invView=0, serial="LKG-J00133", CellPatternMode=2,
    subpixelCells=[
        dict(ROffsetX=-0.31, ROffsetY=0.25, GOffsetX=0.28, GOffsetY=0.25, BOffsetX=0.0, BOffsetY=-0.25),
        dict(ROffsetX=-0.31, ROffsetY=-0.25, GOffsetX=0.28, GOffsetY=-0.25, BOffsetX=0.0, BOffsetY=0.25),
    ],
)  # fmt: skip
STRIPED = {k: v for k, v in GEN3.items() if k not in ("CellPatternMode", "subpixelCells")}
BOTH = pytest.mark.parametrize("numbers", [PORTRAIT, GEN3], ids=["portrait", "gen3"])


def wrapped(difference: np.ndarray) -> float:
    """Largest circular distance of a difference of phases."""
    return float(np.abs(difference - np.round(difference)).max())


def phase(numbers: dict, columns: np.ndarray | None = None, **changes: object) -> np.ndarray:
    """Phase of 40 rows and of 50 columns, or those given."""
    c = read_calibration({**numbers, **changes})
    return c.viewmap(48).phase(np.arange(40), np.arange(50) if columns is None else columns)


def printed_phase(c: Calibration, y: np.ndarray, x: np.ndarray, channel: int) -> np.ndarray:
    """displays.md 3.3 as it stands: u, v, P, T, y from the bottom, stripes or cells; no flips, no inversion."""
    p = c.pitch * (c.width / c.dpi) * math.cos(math.atan(1 / c.slope))
    t = c.height / (c.width * c.slope)
    u, v = (x + 0.5) / c.width, (y + 0.5) / c.height
    if not c.cells:
        return (u + channel / (3 * c.width) + v * t) * p - c.center
    cell = np.array(c.cells)[cell_index(c.cell_mode, x, y) % len(c.cells), channel]
    return ((u + cell[..., 0] / c.width) + (v + cell[..., 1] / c.height) * t) * p - c.center


def van_berkel(c: Calibration) -> Display:
    """The same panel by DESIGN section 3's slanted rule, rows from the top (displays.md 3.3)."""
    tan, lens = 1 / c.slope, 3 * c.width / c.lenses
    start = (1.5 * (1 + tan) + 3 * (c.height - 1) * tan) / lens - c.center
    alpha = math.degrees(math.atan(tan))
    return Display.slanted(
        c.width, c.height, 48, lens_pitch=lens * math.cos(math.radians(alpha)), subpixel_pitch=1.0, slant_deg=alpha,
        phase=start,
    )  # fmt: skip


# --- phase -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("numbers", [PORTRAIT, STRIPED], ids=["portrait", "16 inch"])
def test_phase_is_van_berkels_over_the_whole_panel(numbers: dict) -> None:
    c = read_calibration({**numbers, "invView": 0})
    ours, other = c.viewmap(48), van_berkel(c).viewmap
    assert other is not None
    columns = np.arange(c.width)
    for top in range(0, c.height, 128):
        rows = np.arange(top, min(top + 128, c.height))
        assert wrapped(ours.phase(rows, columns) - other.phase(rows, columns)) < 1e-9


@pytest.mark.parametrize("name", REAL)
def test_phase_of_real_units_is_van_berkels_over_the_whole_panel(name: str) -> None:
    if not (DATA / name).exists():
        pytest.skip(f"{DATA / name} is not here")
    fields = json.loads((DATA / name).read_text(encoding="utf-8"))
    fields = {k: v for k, v in fields.items() if k not in ("subpixelCells", "CellPatternMode")}
    fields["invView"] = {"value": 0}
    test_phase_is_van_berkels_over_the_whole_panel(fields)


@BOTH
def test_phase_is_the_printed_one(numbers: dict) -> None:
    c = read_calibration({**numbers, "invView": 0})
    rows, columns = np.arange(0, c.height, 7), np.arange(0, c.width, 5)
    phi = c.viewmap(48).phase(rows, columns)
    for channel in range(3):
        printed = printed_phase(c, c.height - 1 - rows[:, None], columns[None, :], channel)
        assert wrapped(phi[..., channel] - printed) < 1e-9


def test_lens_counts_are_the_published_ones() -> None:
    portrait, landscape = (Display.preset(f"looking-glass-{n}").calibration for n in ("portrait", "16-landscape"))
    assert portrait is not None and landscape is not None
    assert round(portrait.lenses, 3) == 244.041 and round(portrait.lens_subpixels, 3) == 18.882
    assert round(landscape.lenses, 3) == 600.527 and round(landscape.lens_subpixels, 3) == 19.183
    known = read_calibration({**PORTRAIT, "pitch": 52.5944, "slope": -7.21153, "center": 0.402774})
    assert round(known.lenses, 3) == 246.973 and round(known.lens_subpixels, 3) == 18.658


@BOTH
def test_inv_view_mirrors_the_phase(numbers: dict) -> None:
    phi = phase(numbers, invView=0)
    assert np.array_equal(phase(numbers, invView=1), np.where(phi == 0, 0, 1 - phi))


@BOTH
def test_flip_subp_exchanges_red_and_blue(numbers: dict) -> None:
    assert np.array_equal(phase(numbers, flipSubp=1), phase(numbers)[..., ::-1])


def test_flip_image_x_mirrors_the_pattern() -> None:
    # the mirrored panel's column x lies where column W−1−x was, with its sub-pixels in the opposite order; the slope
    # turns round with it, and of the step c/3W only the sum over a pixel is fixed by the published rule
    w = PORTRAIT["screenW"]
    columns = np.arange(50)
    flipped = phase(PORTRAIT, invView=0, flipImageX=1)
    mirrored = phase(PORTRAIT, invView=0, flipSubp=1, slope=-PORTRAIT["slope"], columns=w - 1 - columns)
    c = read_calibration({**PORTRAIT, "slope": -PORTRAIT["slope"]})
    assert wrapped(flipped - (mirrored - 2 / 3 * c.lenses / w)) < 1e-9


@BOTH
def test_flip_image_x_negates_every_step(numbers: dict) -> None:
    c = read_calibration({**numbers, "invView": 0})
    total = phase(numbers, invView=0, flipImageX=1) + phase(numbers, invView=0)
    assert wrapped(total - (c.lenses - 2 * c.center)) < 1e-9


@BOTH
def test_flips_of_the_picture_are_the_displays(numbers: dict) -> None:
    display = Display.from_calibration({**numbers, "flipImageX": 1, "flipImageY": 1})
    assert (display.flip_x, display.flip_y) == (True, True)
    assert np.array_equal(phase(numbers, flipImageY=1), phase(numbers))


@pytest.mark.parametrize("mode", range(5))
def test_cell_patterns_on_a_block_of_4_by_4(mode: int) -> None:
    cells = [
        {k: 0.1 * (i + 1) * (1 + j) for j, k in enumerate(GEN3["subpixelCells"][0])}  # type: ignore[index]
        for i in range(4)
    ]
    fields = {**GEN3, "CellPatternMode": mode, "subpixelCells": cells, "screenW": 4, "screenH": 4}
    c = read_calibration(fields)
    index = [
        [[0] * 4] * 4,
        [[(x + y) % 2 for x in range(4)] for y in range(4)],
        [[x % 2 for x in range(4)] for _ in range(4)],
        [[(y + 2 * (x % 2)) % 4 for x in range(4)] for y in range(4)],
        [[y % 2] * 4 for y in range(4)],
    ][mode]
    phi = c.viewmap(48).phase(np.arange(4), np.arange(4))
    for y in range(4):
        for x in range(4):
            o = list(cells[index[y][x]].values())
            for channel in range(3):
                u = (x + 0.5 + o[2 * channel]) / 4
                v = (y + 0.5 + o[2 * channel + 1]) / 4
                expected = (u + v * 4 / (4 * c.slope)) * c.lenses - c.center
                assert wrapped(phi[3 - y, x, channel] - expected) < 1e-12


def test_cells_against_stripes_differ_as_measured_on_a_unit() -> None:
    """displays.md 3.3: of 48 views, R is off by 2 (median; 3 at most), B by 5 (6 at most), G by at most 1 in 40 %."""
    rows, columns = np.arange(0, 2160, 11), np.arange(0, 3840, 7)
    vm = [read_calibration(f).viewmap(48) for f in (GEN3, STRIPED)]
    difference = np.abs(vm[0].view(rows, columns) - vm[1].view(rows, columns))
    difference = np.minimum(difference, 48 - difference)
    assert np.median(difference[..., 0]) == 2 and difference[..., 0].min() >= 1 and difference[..., 0].max() <= 3
    assert difference[..., 1].max() <= 1 and abs((difference[..., 1] > 0).mean() - 0.4) < 0.02
    assert np.median(difference[..., 2]) == 5 and difference[..., 2].min() >= 1 and difference[..., 2].max() <= 6


@pytest.mark.parametrize("mode", range(5))
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_pattern_of_few_cells_repeats_them(mode: int, count: int) -> None:
    """displays.md 3.3: the index of the pattern, then mod the number of cells."""
    fields = {**GEN3, "CellPatternMode": mode, "screenW": 4, "screenH": 4}
    cells = [{key: i / 8 for key in GEN3["subpixelCells"][0]} for i in range(4)]  # type: ignore[index]
    few, every = (
        read_calibration({**fields, "subpixelCells": given}).viewmap(48).phase(np.arange(4), np.arange(4))
        for given in (cells[:count], [cells[i % count] for i in range(4)])
    )
    assert np.array_equal(few, every)


def test_without_cells_the_pattern_mode_has_no_meaning() -> None:
    assert np.array_equal(phase(STRIPED, CellPatternMode=2), phase(STRIPED))


@settings(deadline=None)
@given(st.floats(1, 200), st.sampled_from([-12.0, -6.3, -0.7, 0.9, 5.48]), st.floats(-2, 2), st.booleans())
def test_steps_are_those_of_the_lens(pitch: float, slope: float, center: float, flip: bool) -> None:
    c = Calibration(640, 480, pitch, slope, center, dpi=300, flip_x=flip)
    vm = c.viewmap(30)
    assert abs(vm.a) == pytest.approx(c.lenses / 640) and abs(vm.b) == pytest.approx(abs(c.lenses / (640 * slope)))
    assert vm.offsets is not None
    assert np.diff(vm.offsets[0]) == pytest.approx([vm.a / 3] * 2)  # sub-pixels step like pixels, flipped or not


# --- the display -----------------------------------------------------------------------------------------------


def test_display_of_a_calibration() -> None:
    display = Display.from_calibration(PORTRAIT)
    assert (display.name, display.width, display.height, display.views) == ("LKG-PORT-05935", 1536, 2048, 48)
    assert display.quilt is not None and display.quilt.tile == (420, 560)
    assert display.reverse and not display.continuous and display.fov_y == 14 and display.cone_deg == 40
    assert display.size_mm == pytest.approx((1536 / 324 * 25.4, 2048 / 324 * 25.4))
    assert not Display.from_calibration(PORTRAIT, reverse=True).reverse
    assert not Display.from_calibration(GEN3).reverse and Display.from_calibration(GEN3, reverse=True).reverse


def test_views_default_to_the_models_quilt() -> None:
    def views(**changes: object) -> int:
        return Display.from_calibration({**PORTRAIT, "serial": "", **changes}).views

    assert Display.from_calibration(GEN3).views == 48
    assert Display.from_calibration({**PORTRAIT, "serial": "LKG-E00001"}).views == 66  # Go, by serial
    assert views() == 48  # Portrait, by its panel
    assert views(screenW=3840, screenH=2160, DPI=283) == 45
    assert views(screenW=7680, screenH=4320, DPI=281) == 45
    assert views(screenW=7680, screenH=4320, DPI=130) == 72  # the 65", by its DPI
    assert views(screenW=1000, screenH=1000) == 48
    assert Display.from_calibration(PORTRAIT, views=96).views == 96
    assert Display.from_calibration(PORTRAIT, views=96).quilt is None


def test_continuous_calibration() -> None:
    display = Display.from_calibration(PORTRAIT, continuous=True)
    rows, columns = np.arange(9), np.arange(9)
    vm = display.viewmap
    assert vm is not None and np.array_equal(vm.camera(rows, columns), vm.phase(rows, columns) * 48 - 0.5)


def test_bridge_form_with_its_own_quilt() -> None:
    quilt = dict(quiltAspect=0.75, quiltX=4092, quiltY=4092, tileX=11, tileY=6)
    for wrap in (lambda v: v, lambda v: {"value": v}, lambda v: {"value": json.dumps(v)}, json.dumps):
        display = Display.from_calibration({"calibration": wrap(PORTRAIT), "defaultQuilt": wrap(quilt)})
        assert display.views == 66 and display.quilt is not None and display.quilt.columns == 11
        assert display.calibration is not None and display.calibration.pitch == PORTRAIT["pitch"]


@pytest.mark.parametrize("name", REAL)
def test_real_files_are_read(name: str) -> None:
    if not (DATA / name).exists():
        pytest.skip(f"{DATA / name} is not here")
    numbers = PORTRAIT if "PORT" in name else GEN3
    display = Display.from_calibration(DATA / name)
    assert display.name == numbers["serial"] and display.views == 48
    ours, inline = display.viewmap, read_calibration(numbers).viewmap(48)
    assert ours is not None
    rows, columns = np.arange(0, display.height, 97), np.arange(0, display.width, 89)
    assert wrapped(ours.phase(rows, columns) - inline.phase(rows, columns)) < 1e-7
    assert Display.preset(str(DATA / name)).name == display.name


# --- files that are wrong --------------------------------------------------------------------------------------

REQUIRED = ("pitch", "slope", "center", "DPI", "screenW", "screenH")


@pytest.mark.parametrize("field", REQUIRED)
def test_missing_fields_are_named(field: str, tmp_path: Path) -> None:
    path = tmp_path / "visual.json"
    path.write_text(json.dumps({k: v for k, v in PORTRAIT.items() if k != field}), encoding="utf-8")
    with pytest.raises(aus.FileError) as error:
        Display.from_calibration(path)
    assert str(error.value).startswith(f"{path}: {field}: expected a number")
    assert str(error.value).endswith("found nothing")


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("pitch", "52", "pitch: expected a number .* found '52'"),
        ("pitch", {"value": None}, "pitch: expected a number .* found nothing"),
        ("pitch", {"valeu": 52}, "pitch: expected a number .* found {'valeu': 52}"),
        ("pitch", True, "pitch: expected a number .* found True"),
        ("pitch", [52], "pitch: expected a number"),
        ("pitch", 0, "pitch: expected a number .* found 0"),
        ("pitch", math.nan, "pitch: expected a number .* found nan"),
        ("pitch", -math.inf, "pitch: expected a number"),
        ("slope", 0.0, "slope: expected a number other than 0"),
        ("center", math.inf, "center: expected a number .* found inf"),
        ("DPI", 0, "DPI: expected a number"),
        ("screenW", 0, "screenW: expected a number 1…32768, found 0"),
        ("screenW", 1536.5, "screenW: expected a whole number 1…32768, found 1536.5"),
        ("screenH", 1e9, "screenH: expected a number 1…32768, found 1000000000.0"),
        ("screenH", 10**400, "screenH: expected a number 1…32768, found 1000"),
        ("viewCone", 180, "viewCone: expected a number"),
        ("invView", 2, "invView: expected 0 or 1, found 2"),
        ("flipImageX", "yes", "flipImageX: expected 0 or 1, found 'yes'"),
        ("flipSubp", {"value": None}, "flipSubp: expected 0 or 1"),
        ("CellPatternMode", 5, "CellPatternMode: expected a number 0…4, found 5"),
        ("CellPatternMode", 1.5, "CellPatternMode: expected a whole number 0…4"),
        ("subpixelCells", {"a": 1}, "subpixelCells: expected a list"),
        ("subpixelCells", [3], r"subpixelCells\[0\]: expected a JSON object, found 3"),
        ("subpixelCells", [{"ROffsetX": 0}], r"subpixelCells\[0\]: ROffsetY: expected a number .* found nothing"),
        ("serial", 5, "serial: expected a string, found 5"),
        ("defaultQuilt", "{", "defaultQuilt: expected a Looking Glass calibration as JSON"),
        ("defaultQuilt", {"tileX": 8}, "defaultQuilt: tileY: expected a number"),
    ],
)
def test_wrong_fields_are_named(field: str, value: object, message: str, tmp_path: Path) -> None:
    path = tmp_path / "visual.json"
    path.write_text(json.dumps({**PORTRAIT, field: value}), encoding="utf-8")
    with pytest.raises(aus.FileError, match=message) as error:
        Display.from_calibration(path)
    assert str(error.value).startswith(str(path)) and len(str(error.value)) < len(str(path)) + 200
    with pytest.raises(aus.InputError, match=message):
        Display.from_calibration({**PORTRAIT, field: value})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b" \n ", "the file is empty"),
        (json.dumps(PORTRAIT).encode()[:60], "expected a Looking Glass calibration as JSON"),
        (b"<!DOCTYPE html><html></html>", "expected a Looking Glass calibration as JSON"),
        (bytes(range(128, 256)) * 4, "as JSON, found no text"),
        (b"[1, 2]", r"calibration: expected a JSON object, found \[1, 2\]"),
        (b"null", "calibration: expected a JSON object, found nothing"),
        (b'{"calibration": 3}', "calibration: expected a JSON object, found 3"),
        (b"[" * 100_000, "expected a Looking Glass calibration as JSON"),
        (b'{"pitch": ' + b"9" * 5000 + b"}", "expected a "),  # a limit of newer Pythons
        (b" " * 1_100_000 + b"{}", "the file is larger than"),
    ],
)
def test_files_that_are_no_calibration(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "visual.json"
    path.write_bytes(content)
    with pytest.raises(aus.FileError, match=message) as error:
        Display.from_calibration(path)
    assert str(error.value).startswith(str(path))


def test_a_byte_order_mark_is_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "visual.json"
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps(PORTRAIT).encode())
    assert Display.from_calibration(path).width == 1536


def test_paths_that_lead_nowhere(tmp_path: Path) -> None:
    for path in (tmp_path / "none.json", tmp_path, "a\0b"):
        with pytest.raises(aus.FileError, match=r"cannot be read|the system refuses"):
            Display.from_calibration(path)
    with pytest.raises(aus.InputError, match="expected a path or a dict, got int"):
        Display.from_calibration(3)  # type: ignore[arg-type]
