"""The command line: what every verb makes."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import autostereo as aus
from autostereo.cli.app import VERBS
from autostereo.scene import shapes
from commandline import SMALL, SQUARE, Run, files, pixels, refused


# --- help ----------------------------------------------------------------------------------------------------------
def test_help_names_every_verb(cli: Run) -> None:
    for arguments in ((), ("--help",)):
        result = cli(*arguments)
        assert result.status == 0
        for verb in VERBS:
            assert re.search(rf"^  {verb.__name__} ", result.out, re.MULTILINE)


@pytest.mark.parametrize("verb", [verb.__name__ for verb in VERBS])
def test_help_of_a_verb_has_examples(cli: Run, verb: str) -> None:
    result = cli(verb, "--help")
    assert result.status == 0
    assert f"Examples:\n    autostereo {verb}" in result.out


def test_version(cli: Run) -> None:
    assert cli("--version").out == f"autostereo {aus.__version__}\n"


def test_python_m_is_the_command() -> None:
    done = subprocess.run([sys.executable, "-m", "autostereo", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"autostereo {aus.__version__}\n", "")


# --- the verbs -----------------------------------------------------------------------------------------------------
def test_render_is_the_library(cli: Run, folder: Path) -> None:
    result = cli("render", "square.off", "--display", "looking-glass-portrait", *SMALL)
    assert (result.status, files(folder)) == (0, {"square.off", "square_looking-glass-portrait.png"})
    display = aus.Display.preset("looking-glass-portrait").resized(48, 64)
    expected = aus.render(aus.load("square.off"), display).pixels
    assert expected.any()
    assert np.array_equal(pixels("square_looking-glass-portrait.png"), expected)


def test_render_takes_a_camera_a_background_and_options(cli: Run, folder: Path) -> None:
    rig = aus.Rig(position=(0, 0, 5), baseline=0.4, fov_y=40)
    rig.save("rig.json")
    result = cli(
        "render", "square.off", "-d", "lenticular-8", "-o", "out.png", "--camera", "rig.json", "--size", "40x30",
        "--background", "#ff0080", "--samples", "4", "--lighting", "vertex", "--swap",
    )  # fmt: skip
    assert result.status == 0, result.err
    scene = aus.Scene(aus.load("square.off").objects, background=(1.0, 0.0, 128 / 255))
    display = aus.Display.preset("lenticular-8", reverse=True).resized(40, 30)
    panel = aus.render(scene, display, rig, options=aus.Options(samples=4, lighting="vertex"))
    assert np.array_equal(pixels("out.png"), panel.pixels)


def test_reuse_says_what_it_saved_and_what_it_lost(cli: Run, folder: Path) -> None:
    """Of views as of a panel: the share, and the PSNR of what was written against exact shading."""
    rig = aus.Rig(position=(0, 0, 5), baseline=0.4, fov_y=40, views=8)
    rig.save("rig.json")
    ball = shapes.uv_sphere(12, 24)
    lines = ["OFF", f"{len(ball.vertices)} {len(ball.faces)} 0", *(" ".join(map(str, v)) for v in ball.vertices)]
    Path("ball.off").write_text("\n".join([*lines, *(f"3 {a} {b} {c}" for a, b, c in ball.faces)]), "utf-8")
    scene = aus.load("ball.off")
    result = cli("views", "ball.off", "-o", "v", "--size", "64x48", "--camera", "rig.json", "--shading", "reuse")
    many = [aus.render_views(scene, rig, (64, 48), options=aus.Options(shading=s)) for s in ("reuse", "exact")]
    assert f"{many[0].reused:.0%} of the samples" in result.err and f"PSNR {many[0].psnr(many[1]):.1f} dB" in result.err
    result = cli("render", "ball.off", "-d", "lenticular-8", "--size", "64x48", "--camera", "rig.json",
                 "--shading", "reuse")  # fmt: skip
    display = aus.Display.preset("lenticular-8").resized(64, 48)
    one = [aus.render(scene, display, rig, options=aus.Options(shading=s)) for s in ("reuse", "exact")]
    assert f"PSNR {one[0].psnr(one[1]):.1f} dB" in result.err
    assert np.array_equal(pixels("ball_lenticular-8.png"), one[0].pixels)
    with pytest.raises(aus.InputError, match="expected a panel of 64×48, got 8 views of 64×48"):
        one[0].psnr(many[0])


def test_render_takes_the_size_of_small_views(cli: Run, folder: Path) -> None:
    small = ("--method", "n-pass-subres", "--small-size", "9x7")
    assert cli("render", "square.off", "-d", "lenticular-8", "-o", "out.png", *SMALL, *small).status == 0
    display = aus.Display.preset("lenticular-8").resized(48, 64)
    options = aus.Options(small_size=(9, 7))
    panel = aus.render(aus.load("square.off"), display, method="n-pass-subres", options=options)
    assert np.array_equal(pixels("out.png"), panel.pixels)
    refused(cli("render", "square.off", "-d", "lenticular-8", *SMALL, *small[:3], "49x1"), "small_size", "48×64")


def test_render_merges_its_inputs(cli: Run, folder: Path) -> None:
    Path("other.off").write_text(SQUARE.replace("-1 -1 0", "-1 -1 1"))
    assert cli("render", "square.off", "other.off", "-d", "lenticular-8", "-o", "out.png", *SMALL).status == 0
    panel = aus.render(aus.load("square.off", "other.off"), aus.Display.preset("lenticular-8").resized(48, 64))
    assert np.array_equal(pixels("out.png"), panel.pixels)


@pytest.mark.parametrize("display", ["anaglyph", "side-by-side", "top-bottom-half", "philips-wowvx", "checkerboard"])
def test_render_for_other_layouts(cli: Run, folder: Path, display: str) -> None:
    result = cli("render", "square.off", "-d", display, "-o", "out.png", "--size", "200x80")
    assert result.status == 0, result.err
    width, height = aus.Display.preset(display).resized(200, 80).picture_size
    assert pixels("out.png").shape == (height, width, 3)


def test_views_and_rig_round_trip(cli: Run, folder: Path) -> None:
    assert cli("views", "square.off", "-o", "out", "--views", "3", "--size", "20x16").status == 0
    assert files(folder / "out") == {"view_000.png", "view_001.png", "view_002.png", "rig.json"}
    assert cli("views", "square.off", "-o", "b.npz", "--size", "20x16", "--camera", "out/rig.json").status == 0
    color = np.load("b.npz")["color"]
    assert color.shape == (3, 16, 20, 4)
    for k in range(3):
        assert np.array_equal(pixels(f"out/view_{k:03d}.png"), color[k])


def test_views_again_into_the_same_folder(cli: Run, folder: Path) -> None:
    """A second run replaces the views of the first, also when it has fewer, and leaves other files alone."""
    assert cli("views", "square.off", "-o", "out", "--views", "4", "--size", "20x16").status == 0
    Path("out/notes.txt").write_text("mine")
    assert cli("views", "square.off", "-o", "out", "--views", "2", "--size", "10x16").status == 0
    assert files(folder / "out") == {"view_000.png", "view_001.png", "rig.json", "notes.txt"}
    assert pixels("out/view_000.png").shape == (16, 10, 4)


def test_views_with_depth(cli: Run, folder: Path) -> None:
    assert cli("views", "square.off", "-o", "out.npz", "--depth", "--size", "16x16").status == 0
    assert np.load("out.npz")["depth"].shape == (8, 16, 16)
    refused(cli("views", "square.off", "-o", "out.gif", "--depth"), "--depth", ".npz")


@pytest.mark.parametrize("suffix", [".gif", ".webp", ".mp4"])
def test_views_as_animation(cli: Run, folder: Path, suffix: str) -> None:
    if suffix == ".mp4":
        pytest.importorskip("av")
    Path("deep.off").write_text(SQUARE.replace("-1 1 0", "-1 1 -2"))  # a flat square looks the same in every view
    assert cli("views", "deep.off", "-o", f"out{suffix}", "--views", "4", "--size", "64x64").status == 0
    if suffix != ".mp4":
        with Image.open(f"out{suffix}") as image:
            assert getattr(image, "n_frames", 1) == 6  # there and back


def test_quilt_then_weave(cli: Run, folder: Path) -> None:
    layout = ("--grid", "4x3", "--view-size", "24x32")
    assert cli("quilt", "square.off", "-d", "looking-glass-portrait", *layout, "-o", "q.png").status == 0
    assert files(folder) == {"square.off", "q_qs4x3a0.75.png"}
    quilt = pixels("q_qs4x3a0.75.png")
    assert quilt.shape[:2] == (96, 96) and quilt.any()
    woven = ("-d", "looking-glass-portrait", "--size", "24x32", "-o", "p.png")
    assert cli("weave", "q_qs4x3a0.75.png", *woven).status == 0
    display = aus.Display.preset("looking-glass-portrait").resized(24, 32).with_views(12)
    stack = aus.ViewStack.from_quilt(np.ascontiguousarray(quilt), 4, 3)
    assert np.array_equal(pixels("p.png"), aus.interlace(stack, display).pixels)
    Path("q_qs4x3a0.75.png").rename("plain.png")
    refused(cli("weave", "plain.png", *woven), "--grid")
    assert cli("weave", "plain.png", "--grid", "4x3", *woven).status == 0


def test_quilt_takes_the_layout_of_the_display(cli: Run, folder: Path) -> None:
    own = Path("small.toml")
    own.write_text(
        'source = "test"\nwidth = 60\nheight = 80\n[mask]\nkind = "lenticular"\nviews = 6\n'
        "[quilt]\ncolumns = 3\nrows = 2\nwidth = 62\nheight = 50\naspect = 0.75\n"
    )
    assert cli("quilt", "square.off", "-d", "small.toml").status == 0
    assert pixels("square_qs3x2a0.75.png").shape[:2] == (50, 62)  # padding included


def test_quilt_without_a_layout(cli: Run, folder: Path) -> None:
    refused(cli("quilt", "square.off"), "--grid", "--view-size")
    refused(cli("quilt", "square.off", "-d", "lenticular-8"), "--grid")


def test_observe_sees_the_views(cli: Run, folder: Path) -> None:
    """The eye test pattern: from left zones the picture is red with an L, from right ones blue."""
    portrait = ("-d", "looking-glass-portrait")
    assert cli("pattern", *portrait, "--kind", "eyes", "-o", "eyes.png", "--size", "300x400").status == 0
    common = ("observe", "eyes.png", *portrait, "-o", "seen.png")
    for view, channel in (("5", 0), ("42", 2)):
        assert cli(*common, "--view", view).status == 0
        mean = pixels("seen.png")[10:50, 20:-20].reshape(-1, 3).mean(axis=0)
        assert mean[channel] > 150 and np.delete(mean, channel).max() < 20
    assert cli(*common, "--eye", "-60,400").status == 0
    assert pixels("seen.png")[10:50, 140:160, 0].mean() > 150


def test_observe_needs_one_place(cli: Run, folder: Path) -> None:
    Image.new("RGB", (1536, 2048)).save("panel.png")
    common = ("observe", "panel.png", "-d", "looking-glass-portrait", "-o", "seen.png")
    refused(cli(*common), "--view", "--eye")
    refused(cli(*common, "--view", "3", "--eye", "0,500"), "--view", "--eye")
    refused(cli(*common, "--eye", "0"), "--eye")
    refused(cli(*common, "--eye", "0,-5"), "eye")
    refused(cli(*common, "--view", "3", "--crosstalk", "2"), "crosstalk")
    assert not Path("seen.png").exists()


@pytest.mark.parametrize("kind", ["numbers", "eyes", "pitch", "slope", "phase"])
@pytest.mark.parametrize("display", ["looking-glass-16-landscape", "light-field-8k"])
def test_pattern(cli: Run, folder: Path, kind: str, display: str) -> None:
    result = cli("pattern", "-d", display, "--kind", kind, "-o", "p.png", "--size", "320x200")
    assert result.status == 0, result.err
    assert pixels("p.png").shape == (200, 320, 3)
    assert len(result.out.splitlines()) == (10 if kind in ("pitch", "slope", "phase") else 1)


def test_pattern_numbers_shows_each_view_its_own_color(cli: Run, folder: Path) -> None:
    assert cli("pattern", "-d", "wavelength-selective-8", "-o", "p.png", "--size", "96x96").status == 0
    panel, view = pixels("p.png"), aus.Display.wavelength_selective(96, 96).view_of_subpixel()
    for k in range(8):  # the margin between the numbers is of the view's colour
        assert len(np.unique(panel[:2][view[:2] == k].reshape(-1, 1), axis=0)) <= 3


@pytest.mark.parametrize("kind", ["pitch", "slope", "phase"])
def test_pattern_strips_print_numbers_that_make_their_mask(cli: Run, folder: Path, kind: str) -> None:
    """A calibration written from a strip's printed numbers has that strip's phases."""
    from autostereo.cli.pattern import make_sweep

    display = aus.Display.preset("looking-glass-portrait").resized(300, 400)
    for strip in make_sweep(display, kind, 5, 0.01):
        pitch, slope, center = map(float, re.findall(r"(?:pitch|slope|center) (\S+?)(?:,|$)", strip.row))
        fields = {"pitch": pitch, "slope": slope, "center": center, "DPI": 324, "screenW": 300, "screenH": 400}
        again = aus.Display.from_calibration({**fields, "invView": 1}, views=48).viewmap
        assert again is not None
        rows, columns = np.arange(0, 400, 57), np.arange(0, 300, 31)
        apart = np.abs(again.phase(rows, columns) - strip.viewmap.phase(rows, columns))
        assert np.minimum(apart, 1 - apart).max() < 1e-3  # six printed digits


def test_pattern_of_a_table_has_no_pitch(cli: Run, folder: Path) -> None:
    refused(cli("pattern", "-d", "wavelength-selective-8", "--kind", "pitch", "-o", "p.png"), "table")
    refused(cli("pattern", "-d", "philips-wowvx", "-o", "p.png"), "views")
    refused(cli("pattern", "-d", "lenticular-8", "--kind", "colours", "-o", "p.png"), "numbers")
    assert cli("pattern", "-d", "anaglyph", "--kind", "eyes", "-o", "p.png", "--size", "64x48").status == 0


def test_displays(cli: Run) -> None:
    result = cli("displays")
    assert [line.split()[0] for line in result.out.splitlines()] == aus.Display.presets()
    one = cli("displays", "looking-glass-portrait").out
    assert "1536×2048" in one and "8×6 tiles" in one and "source" in one


def test_every_preset_can_be_described(cli: Run) -> None:
    for name in aus.Display.presets():
        result = cli("displays", name)
        assert result.status == 0 and result.out.startswith("name "), result.err


def test_info_says_whose_normals_they_are(cli: Run, folder: Path) -> None:
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n"
    for faces, words in (
        ("f 1 2 3\nf 1 3 4\n", ["computed"]),
        ("f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n", ["given"]),
        ("usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n", ["computed", "computed"]),  # over the border between both
        ("usemtl a\nf 1//1 2//1 3//1\nusemtl b\nf 1 3 4\n", ["given", "computed"]),
    ):
        (folder / "a.obj").write_text(square + faces)
        assert re.findall(r"normals (\w+)", cli("info", "a.obj").out) == words


def test_info(cli: Run, folder: Path) -> None:
    result = cli("info", "square.off", "-d", "looking-glass-portrait")
    assert result.status == 0
    assert "2 triangles, 4 vertices, open, two-sided" in result.out
    assert re.search(r"^verdict +fits$", result.out, re.MULTILINE)
    aus.Rig(position=(0, 0, 3), focal_distance=1.0, baseline=2.0).save("rig.json")
    assert "too deep" in cli("info", "square.off", "-d", "looking-glass-portrait", "--camera", "rig.json").out


def test_quiet_says_nothing(cli: Run, folder: Path) -> None:
    result = cli("render", "square.off", "-d", "lenticular-8", *SMALL, "--quiet")
    assert (result.status, result.out, result.err) == (0, "", "")


def test_bench_refuses_what_it_cannot_measure(cli: Run) -> None:
    refused(cli("bench", "weather"), "mesh")
    refused(cli("bench", "mesh", "nothing"), "nothing")
    refused(cli("bench", "mesh", "--only", "weave"), "--only")  # works have one way to be named


# --- demo ----------------------------------------------------------------------------------------------------------
def test_demo(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autostereo.cli.demo.WIDE", (96, 64))
    monkeypatch.setattr("autostereo.cli.demo.TILE", (24, 32))
    assert cli("demo", "-o", "demo").status == 0
    made = files(folder / "demo")
    assert {"index.html", "mesh_views.gif", "mesh_quilt_qs8x6a0.75.png", "mesh_panel_slanted.png"} <= made
    assert {"volume_panel_wavelength-selective.png", "points_panel_wavelength-selective.png"} <= made
    page = (folder / "demo" / "index.html").read_text(encoding="utf-8")
    assert set(re.findall(r'src="([^"]+)"', page)) == made - {"index.html"}
    for scene in ("mesh", "volume", "points", "mixed"):
        assert {f"{scene}_panel_looking-glass-portrait.png", f"{scene}_views.webp"} <= made
        left, right = (pixels(folder / "demo" / f"{scene}_eye_{side}.png").astype(int) for side in ("left", "right"))
        assert (left != right).any()
