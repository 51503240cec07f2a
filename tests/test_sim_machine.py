"""Machine files, the formulas, and the verb: what comes out, and one clear sentence for what cannot be."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo.errors import FileError, InputError
from autostereo.simulator import Machine, model, simulate
from autostereo.simulator.output import approximation_picture
from autostereo.simulator.study import lens
from commandline import Run
from sim_scenes import MULTI, RIG, SIZE, wall


def test_built_in_machines_are_those_of_the_paper():
    assert Machine.names() == ["bf-dc", "bf-tx", "by-triangle", "multi-view", "multi-view-approximate", "scanline"]
    for name in Machine.names():
        machine = Machine.load(name)
        assert machine.name == name
        assert "EGSR 2006" in machine.source
        assert machine.cache_bytes(2) == 8192  # "a stereo system will use 8 kB cache memory in total"
    assert Machine.load("multi-view") == Machine(name="multi-view", source=MULTI.source)


BAD = {
    "colour = 1": "unknown field 'colour'",
    "[texture]\nsize = 3": "unknown field texture.size; expected",
    "[texture]\nbytes = 0": "texture.bytes: expected a whole number from 1",
    "[texture]\nbytes = 100": "texture.bytes: expected a multiple of 64",
    "[texture]\nbytes = true": "texture.bytes: expected a whole number",
    "[texture]\nline_bytes = 48": "power of two, got 48",
    "[texture]\nways = 5": "expected a multiple of 320",
    '[texture]\ncompression = "dxt9"': "texture.compression: expected one of none, bc1, got 'dxt9'",
    '[texture]\ncompression = "bc1"\nline_bytes = 32': "bc1 has blocks of 64 bytes",
    "[depth]\nbytes = 0": "depth.bytes: expected a whole number from 1",
    "[depth]\nblock = [16, 16]": "depth.block: expected at most 64 pixels",
    "[depth]\nblock = [8]": "depth.block: expected [width, height]",
    "[color]\nbytes = 300": "color.bytes: expected a multiple of 256",
    "[color]\nz_max = true": "z_max and z_min are fields of depth",
    "[color]\nfast_clear = 1": "color.fast_clear: expected true or false",
    '[traversal]\norder = "random"': "traversal.order: expected one of by-view, by-triangle, sorted",
    "[traversal]\ntile = [0, 8]": "traversal.tile: expected a whole number from 1",
    "[traversal]\ntile = [16, 16]\n[depth]\nz_max = true": "need tiles that blocks consist of; got tiles 16×16",
    "[shading]\ntiles = 0": "shading.tiles: expected a whole number from 1",
    '[shading]\napproximate = true\n[traversal]\norder = "by-view"': "shading.approximate: needs order",
    "traversal = 3": "expected a table [traversal], got 3",
    "name = 3": "machine name: expected text",
    "[texture": "expected TOML",
}


@pytest.mark.parametrize("text", BAD)
def test_bad_machine_files(tmp_path: Path, text: str):
    path = tmp_path / "machine.toml"
    path.write_text(text)
    with pytest.raises(FileError) as error:
        Machine.load(path)
    assert BAD[text] in str(error.value)
    assert str(error.value).startswith(str(path))


def test_missing_machines(tmp_path: Path):
    with pytest.raises(InputError, match="expected one of bf-dc"):
        Machine.load("gpu")
    with pytest.raises(FileError, match="cannot be read"):
        Machine.load(tmp_path / "none.toml")


# --- the formulas -----------------------------------------------------------------------------------------------------
def test_figures_of_section_2():
    """d = 4: o = 25/12, depth 24 and colour 8 bytes; the ocean's seven look-ups 112 bytes, the soft shadows' 109."""
    assert model.overdraw(4) == pytest.approx(25 / 12)
    assert model.overdraw(0) == 0
    rounded = model.predict(4, 0.25, model.Costs(t_read=7 * 32), overdrawn=2)
    assert (rounded.depth, rounded.color, rounded.texture) == (24, 8, 112)
    shadows = model.predict(4, 0.25, model.Costs(t_read=0.9 * 128 + 0.1 * 1024), overdrawn=2)
    assert shadows.texture == pytest.approx(108.8)
    assert rounded.total(16) == 16 * (24 + 8 + 112)
    with pytest.raises(InputError, match="depth_complexity"):
        model.overdraw(-1)


def test_the_texture_term_with_measured_rates_is_what_was_measured():
    table = model.compare(simulate(wall(0.2), RIG, MULTI, size=SIZE))
    assert table["fitted"]["texture"] == pytest.approx(table["measured"]["texture"])
    assert table["measured"]["overdraw"] == pytest.approx(1.0, abs=0.05)
    assert table["predicted"]["color"] == pytest.approx(4 * model.overdraw(table["measured"]["depth_complexity"]))


def test_a_lens_is_a_centred_grid():
    rigs = lens(aus.Rig(), (4, 2), 0.8)
    np.testing.assert_allclose([rig.offset_y for rig in rigs], [-0.2, 0.2])
    np.testing.assert_allclose(rigs[0].camera_offsets, [-0.3, -0.1, 0.1, 0.3])


def test_bc1_textures_take_an_eighth_of_the_bandwidth():
    raw, packed = (
        simulate(wall(0.2), RIG, MULTI.with_(texture={"compression": kind}), size=SIZE) for kind in ("none", "bc1")
    )
    assert packed.texture_bytes * 8 == raw.texture_bytes > 0
    assert packed.psnr(raw).min() > 22  # channels that vary on their own fit no line of colours


def test_approximated_pixels_are_green():
    machine = MULTI.with_(shading={"approximate": True})
    report = simulate(wall(0.2), RIG, machine, size=SIZE, maps=True)
    picture = approximation_picture(report)
    assert picture.shape == (SIZE[1], 5 * SIZE[0], 3)
    tinted = np.floor(0.5 * report.color[0, ..., :3] + 0.5 * np.array([40, 220, 60]) + 0.5)
    expected = np.where((report.how[0] == 2)[..., None], tinted, report.color[0, ..., :3])
    np.testing.assert_array_equal(picture[:, : SIZE[0]], expected)
    assert (report.how[0] == 2).mean() > 0.8
    np.testing.assert_array_equal(picture[:, 2 * SIZE[0] : 3 * SIZE[0]], report.color[2, ..., :3])


# --- the verb ---------------------------------------------------------------------------------------------------------
SMALL = ("--size", "64x48", "--every", "100", "--views", "1,2")


def test_simulate_a_scene(cli: Run, folder: Path):
    result = cli("simulate", "level", *SMALL, "--json", "out.json", "--picture", "out.png")
    assert result.status == 0, result.err
    assert "multi-view-approximate" in result.out and "measured" in result.out
    rows = json.loads((folder / "out.json").read_text())["rows"]
    assert [(row["machine"], row["views"]) for row in rows] == [
        (machine, views) for views in (1, 2) for machine in ("bf-tx", "multi-view", "multi-view-approximate")
    ]
    assert all(row["total"] == pytest.approx(row["texture"] + row["depth"] + row["color"]) for row in rows)
    assert all(row["frames"] == 2 for row in rows)
    for row in rows:  # per view, and all counters
        approximates = row["machine"] == "multi-view-approximate" and row["views"] == 2
        assert [share > 0 for share in row["share_of_view"]] == [False, approximates][: row["views"]]
        assert [psnr is not None for psnr in row["psnr_of_view"]] == [False, approximates][: row["views"]]
        counters = row["counters"]
        assert counters["depth_read"] + counters["depth_written"] == pytest.approx(row["depth"])
        assert counters["texture_misses"] * 64 == pytest.approx(row["texture"])
    assert (folder / "out.png").stat().st_size > 1000


def test_simulate_files_a_machine_of_ones_own_and_a_chart(cli: Run, folder: Path):
    pytest.importorskip("matplotlib")
    (folder / "mine.toml").write_text('name = "mine"\n[texture]\nbytes = 128\n')
    result = cli("simulate", "square.off", "-m", "mine.toml", "-m", "bf-tx", *SMALL, "--chart", "chart.svg")
    assert result.status == 0, result.err
    assert "mine" in result.out
    assert "<svg" in (folder / "chart.svg").read_text()


def test_simulate_depth_of_field(cli: Run, folder: Path):
    result = cli("simulate", "atrium", "--depth-of-field", "4x2", *SMALL, "--json", "out.json")
    assert result.status == 0, result.err
    rows = json.loads((folder / "out.json").read_text())["rows"]
    assert [(row["machine"], row["views"]) for row in rows] == [
        (machine, views) for views in (1, 2) for machine in ("bf-dc", "multi-view")
    ]
    assert all(row["frames"] == 2 for row in rows)
    assert [row["optimum"] for row in rows[::2]] == [None, None]
    one, two = rows[1], rows[3]
    assert one["optimum"] == pytest.approx(one["total"])
    assert two["optimum"] == pytest.approx(one["depth"] + (one["texture"] + one["color"]) / 2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("levle",), "expected level, soft-shadows, ocean, atrium, relief or a file, got 'levle'"),
        (("none.obj",), "none.obj"),
        (("level", "-m", "gpu"), "machine: expected one of"),
        (("level", "--views", "0"), "--views: expected numbers from 1 to 256"),
        (("level", "--size", "4x4"), "8×8 is larger than the frame of 4×4"),
        (("level", "--size", "8192x8192", "--views", "8"), "268435456 pixels in all views, got 8 of 8192×8192"),
        (("level", "--aperture", "inf"), "--aperture: expected a number > 0"),
        (("level", "--every", "0"), "--every: expected a number from 1 to 200"),
        (("level", "--camera", "rig.json"), "level has its own camera path"),
        (("level", "--json", "out.txt"), "expected a name ending in .json"),
        (("level", "--depth-of-field", "16"), "--depth-of-field: expected two whole numbers"),
        (("level", "--aperture", "0"), "--aperture: expected a number > 0"),
        (("level", "--depth-of-field", "2x2", "--picture", "x.png"), "--picture: shows views"),
    ],
)
def test_mistakes(cli: Run, folder: Path, arguments: tuple[str, ...], message: str):
    before = sorted(folder.iterdir())
    result = cli("simulate", *arguments)
    assert result.status == 2
    assert message in result.err
    assert result.err.count("\n") == 1
    assert sorted(folder.iterdir()) == before
