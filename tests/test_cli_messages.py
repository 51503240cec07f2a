"""The command line: what an error says is what is wrong, and what would be right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import autostereo as aus
from autostereo.io.depth import read_depth
from autostereo.wording import an, counted
from commandline import SMALL, Run, files, refused

LENSES = ("-d", "lenticular-8")
RENDER = ("render", "square.off", *LENSES, *SMALL, "-o", "o.png")


def test_numbers_and_articles() -> None:
    assert [counted(n, "view") for n in (0, 1, 2)] == ["0 views", "1 view", "2 views"]
    assert [an(word) for word in ("anaglyph", "rgbd", "side-by-side")] == ["an anaglyph", "an rgbd", "a side-by-side"]


@pytest.mark.parametrize(
    ("option", "value", "wanted"),
    [("-n", "abc", "--views: expected a whole number, got 'abc'"), ("-n", "2.5", "a whole number, got '2.5'"),
     ("--step", "x", "--step: expected a number, got 'x'"),
     ("--background", "pink", "R,G,B in 0…1, black, grey or white"),
     ("--background", "#12345", "expected #rrggbb, R,G,B"), ("--background", "#12345g", "got '#12345g'"),
     ("--background", "2,0,0", "expected #rrggbb, R,G,B"),
     ("-o", "square.off/o.png", "square.off is a file, expected a"),
     ("-o", "none/o.png", "the folder none does not exist")],
)  # fmt: skip
def test_values_of_render(cli: Run, folder: Path, option: str, value: str, wanted: str) -> None:
    refused(cli(*RENDER, option, value), wanted)
    assert files(folder) == {"square.off"}


def test_a_folder_below_a_file_is_named_by_the_api_too(folder: Path) -> None:
    with pytest.raises(aus.FileError, match=r"square\.off is a file, expected a folder"):
        aus.Rig().save("square.off/rig.json")


def test_spacing_too_small_is_quoted_as_it_was_given(cli: Run, folder: Path) -> None:
    np.save("v.npy", np.arange(8.0).reshape(2, 2, 2))
    spaced = ("render", "v.npy", *LENSES, "--spacing")
    refused(cli(*spaced, "1e-300,1,1"), "spacing: expected numbers ≥ 1e-30, got (1e-300")
    refused(cli(*spaced, "0,1,1"), "spacing: expected numbers > 0, got (0.0")


def test_built_in_scenes_stand_alone(cli: Run, folder: Path) -> None:
    refused(cli("simulate", "level", "ocean"), "the built-in level stands alone", "got 2 names")
    refused(cli("simulate", "square.off", "ocean"), "the built-in ocean stands alone")


def test_depths_out_of_range_are_quoted(cli: Run, folder: Path) -> None:
    Image.new("RGB", (16, 9)).save("c.png")
    warp = ("warp", "c.png", "d.npy", "-o", "x.webp")
    for value in (1e300, 1e-300):
        np.save("d.npy", np.full((9, 16), value))
        refused(cli(*warp), f"expected depths from 1e-30 to 1e+15 (0: none), found {value:g}")
    np.save("d.npy", np.ones((9, 16)))
    refused(cli(*warp, "--unit", "1e29"), "from 1e-59 to 1e-14", "found 1 and")
    for unit in ("1e300", "0", "nan"):
        refused(cli(*warp, "--unit", unit), "--unit: expected a number from 1e-30 to")
    with pytest.raises(aus.InputError, match=r"^unit: expected a number"):
        read_depth("d.npy", 0)


def test_folders_may_have_dots(cli: Run, folder: Path) -> None:
    views = ("views", "square.off", "--size", "8x8", "-n", "2", "-o")
    refused(cli(*views, "v1.0"), "or a folder (v1.0/), got .0")
    assert cli(*views, "v1.0/").status == 0
    assert "v1.0/view_001.png" in files(folder)
    assert cli(*views, "v1.0").status == 0  # it is there now
    assert cli(*views, "v.npz/").status == 0 and Path("v.npz/rig.json").exists()
    refused(cli(*views, "v.npz"), "expected a file name, found a folder")
    Image.new("RGB", (16, 9)).save("c.png")
    np.save("d.npy", np.ones((9, 16)))
    assert cli("warp", "c.png", "d.npy", "-o", "w1.0/").status == 0 and Path("w1.0/rig.json").exists()
    assert "1 view of 8×8" in cli("views", "square.off", "--size", "8x8", "-n", "1", "-o", "one.webp").out


def test_pattern_says_what_a_display_has(cli: Run, folder: Path) -> None:
    size = ("--size", "160x96", "-o", "p.png")
    for display in ("anaglyph", "side-by-side", "wavelength-selective-8"):
        result = cli("pattern", "-d", display, *size)
        assert "numbers should count up" in result.err and "--kind phase" not in result.err
    assert "Two at once? See --kind phase." in cli("pattern", "-d", "looking-glass-portrait", *size).err
    refused(cli("pattern", "-d", "anaglyph", "--kind", "pitch", *size), "an anaglyph picture has no lenses")
    refused(cli("pattern", "-d", "philips-wowvx", *size), "an rgbd picture has no views")
    refused(cli("pattern", *LENSES, "--kind", "pitch", "--step", "1", *size), "other than 0 and within ±0.222, got 1")
    refused(cli("weave", "p.png", "--grid", "2x1", "-d", "anaglyph", "-o", "w.png"), "an anaglyph picture is not woven")
