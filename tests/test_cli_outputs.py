"""The command line: where a picture goes, and that it never takes an input's place."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commandline import Run, files, pixels, refused

GRID = ("--grid", "2x1", "--view-size", "8x8")


def test_a_quilt_goes_into_a_folder(cli: Run, folder: Path) -> None:
    Path("out").mkdir()
    for k, output in enumerate(("out/", "out", "./out")):
        assert cli("quilt", "square.off", *GRID, "-o", output).status == 0
        assert files(folder) == {"square.off", "out/square_qs2x1a1.png"}, k


def test_a_folder_for_a_quilt_has_to_exist(cli: Run, folder: Path) -> None:
    refused(cli("quilt", "square.off", *GRID, "-o", "new/"), "new/: no such folder")
    refused(cli("quilt", "square.off", *GRID, "-o", "square.off/"), "square.off/: no such folder")
    assert files(folder) == {"square.off"}


LENSES = ("-d", "lenticular-8")
VERBS = {
    "weave": ("weave", "a.png", "--grid", "4x2", *LENSES, "-o"),
    "observe": ("observe", "a.png", *LENSES, "--view", "1", "-o"),
    "warp": ("warp", "a.png", "d.png", *LENSES, "-o"),
    "warp depth": ("warp", "d.png", "a.png", *LENSES, "-o"),
    "render": ("render", "a.png", *LENSES, "-o"),
    "views": ("views", "a.webp", "-o"),
    "quilt": ("quilt", "a_qs2x1a1.png", *GRID, "-o"),
}


@pytest.mark.parametrize("verb", VERBS)
def test_an_input_is_never_overwritten(cli: Run, folder: Path, verb: str) -> None:
    """By its own name, by another way to it, and through links."""
    rng = np.random.default_rng(1)
    own = {"views": "a.webp", "quilt": "a_qs2x1a1.png"}.get(verb, "a.png")
    for name in (own, "d.png"):
        Image.fromarray(rng.integers(0, 256, (16, 16, 3), np.uint8)).save(name)
    Path("sub").mkdir()
    before = Path(own).read_bytes()
    link = own.replace("a", "l", 1)
    os.symlink(own, link)
    for output in (own, f"sub/../{own}", str(folder / own), link):
        refused(cli(*VERBS[verb], output), "is also an input, which would be lost")
    assert Path(own).read_bytes() == before and Path(link).is_symlink()


def test_observe_says_when_a_picture_is_of_another_size(cli: Run, folder: Path) -> None:
    Image.new("RGB", (40, 30)).save("p.png")
    common = ("observe", "p.png", *LENSES, "--view", "1", "-o", "seen.png")
    result = cli(*common)
    assert (result.status, pixels("seen.png").shape) == (0, (30, 40, 3))
    assert "p.png: 40×30 pixels, where lenticular-8 has 1920×1080: taken for a display of 40×30 pixels\n" in result.err
    assert "taken for" not in cli(*common, "--quiet").err
    Image.new("RGB", (1920, 1080)).save("p.png")
    assert "taken for" not in cli(*common).err
