"""The command line: what it remarks on when a picture was made that is likely not the one that was meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commandline import SMALL, Run, pixels, refused

LENSES = ("-d", "lenticular-8")


def test_a_quilt_of_another_aspect_is_remarked_on(cli: Run, folder: Path) -> None:
    Image.new("RGB", (64, 32)).save("q_qs4x2a0.5625.png")
    Image.new("RGB", (64, 32)).save("q_qs4x2a1.778.png")
    result = cli("weave", "q_qs4x2a0.5625.png", *LENSES, "-o", "p.png", "--size", "160x90")
    words = "q_qs4x2a0.5625.png: was made for a display of aspect 0.5625, lenticular-8 has 1.778: "
    assert result.status == 0 and f"{words}the picture is squashed\n" in result.err
    assert pixels("p.png").shape == (90, 160, 3)
    assert "squashed" not in cli("weave", "q_qs4x2a1.778.png", *LENSES, "-o", "p.png", "--size", "160x90").err


LOSSY = {
    "render": ("render", "square.off", *LENSES, *SMALL, "-o"),
    "weave": ("weave", "q_qs4x2a1.778.png", *LENSES, "--size", "160x90", "-o"),
    "pattern": ("pattern", *LENSES, "--size", "160x90", "-o"),
    "warp": ("warp", "c.png", "d.npy", *LENSES, "--size", "160x90", "-o"),
    "render packed": ("render", "square.off", "-d", "side-by-side", *SMALL, "-o"),
    "quilt": ("quilt", "square.off", "--grid", "2x1", "--view-size", "8x8", "-o"),
}


@pytest.mark.parametrize("verb", LOSSY)
def test_a_lossy_format_is_remarked_on(cli: Run, folder: Path, verb: str) -> None:
    Image.new("RGB", (64, 32)).save("q_qs4x2a1.778.png")
    Image.new("RGB", (16, 9)).save("c.png")
    np.save("d.npy", np.ones((9, 16), np.float32))
    path = "o_qs2x1a1.jpg" if verb == "quilt" else "o.jpg"
    result = cli(*LOSSY[verb], path)
    does = "changes the picture a little" if verb in ("quilt", "render packed") else "mixes the views"
    assert result.status == 0
    assert f"\n{path}: .jpg is lossy and {does}; .png and .webp keep every pixel\n" in "\n" + result.err
    assert Path(path).exists()
    assert "lossy" not in cli(*LOSSY[verb], path, "--quiet").err
    assert "lossy" not in cli(*LOSSY[verb], path.replace("jpg", "png")).err


def test_observe_checks_its_arguments_before_it_remarks(cli: Run, folder: Path) -> None:
    """A picture of another size, about which a line is said, and one of the arguments wrong: the error alone."""
    Image.new("RGB", (40, 30)).save("p.png")
    common = ("observe", "p.png", "-d", "looking-glass-portrait", "-o", "seen.png")
    for wrong in (("--view", "nan"), ("--view", "1e9"), ("--eye", "0,0"), ("--eye", "1e12,500")):
        refused(cli(*common, *wrong), f"{wrong[0]}")
    for share in ("1", "-0.1", "nan", "2"):
        refused(cli(*common, "--view", "3", "--crosstalk", share), "--crosstalk: expected a number from 0", share)
    assert not Path("seen.png").exists()


def test_eye_needs_a_display_with_a_size(cli: Run, folder: Path) -> None:
    Image.new("RGB", (40, 30)).save("p.png")
    result = cli("observe", "p.png", *LENSES, "--eye", "0,500", "-o", "seen.png")
    refused(result, "lenticular-8 has none; give a .toml of your own with size_mm below [optics], or --view U")
    assert "physical" not in result.err


def test_options_that_nothing_in_the_picture_asks_for_are_named(cli: Run, folder: Path) -> None:
    render = ("render", "square.off", *LENSES, *SMALL, "-o", "p.png")
    result = cli(*render, "--references", "3", "--step", "0.5", "--small-size", "8x8", "--alpha", "averaged")
    assert result.status == 0 and "without effect here: --alpha, --step, --small-size, --references\n" in result.err
    assert "without effect" not in cli(*render, "--method", "n-pass-subres", "--small-size", "8x8").err
    assert "without effect" not in cli(*render, "--method", "dibr", "--references", "3").err
    views = ("views", "square.off", "--views", "2", "--size", "16x16", "-o", "v.npz")
    assert "without effect here: --volume\n" in cli(*views, "--volume", "exact").err
    quilt = ("quilt", "square.off", "--grid", "2x1", "--view-size", "8x8", "-o", "q.png")
    assert "without effect here: --references\n" in cli(*quilt, "--references", "1").err
    np.save("v.npy", np.ones((3, 3, 3), np.uint8))
    assert "without effect" not in cli("views", "v.npy", *views[2:], "--volume", "exact", "--step", "0.5").err
