"""Displays that take packed pictures: right side up, and every view in its place (displays.md 3.7)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo.display.layouts import PACKED, STEREO
from autostereo.encoders.stereo import LAYOUTS, pack
from commandline import Run, files, pixels, refused

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def square(color, bottom, depth):
    corners = [(-0.2, bottom, depth), (0.2, bottom, depth), (0.2, bottom + 0.4, depth), (-0.2, bottom + 0.4, depth)]
    return aus.Mesh(corners, [(0, 1, 2), (0, 2, 3)], colors=[color] * 4, material=aus.Material(1, 0))


SCENE = aus.Scene([square(RED, 0.4, 1.0), square(BLUE, -0.8, -1.0)])  # red: above and in front; blue: below and behind
PLACES = {  # layout: (views across, views down) and black rows between
    "side-by-side": (2, 1, 0),
    "top-bottom": (1, 2, 0),
    "frame-packing-720p": (1, 2, 30),
    "frame-packing-1080p": (1, 2, 45),
    "leia-2x2": (2, 2, 0),
}


def tiles(picture, layout):
    """Views (V, h, w, 3) cut from a picture, in reading order."""
    across, down, gap = PLACES[layout]
    height, width = (picture.shape[0] - gap * (down - 1)) // down, picture.shape[1] // across
    starts = [(k // across * (height + gap), k % across * width) for k in range(across * down)]
    return np.stack([picture[y : y + height, x : x + width] for y, x in starts])


def place(view, channel):
    """Mean row and column of what shines in one channel only."""
    return np.argwhere(view[..., channel].astype(int) - view[..., 2 - channel] > 99).mean(axis=0)


@pytest.mark.parametrize("layout", PLACES)
def test_views_stand_upright_and_in_their_order(layout):
    width, height = STEREO[layout].size or (120, 90)
    display = aus.Display.stereo(width, height, layout)
    panel = aus.render(SCENE, display, aus.Rig(baseline=0.5))
    assert (panel.width, panel.height) == display.picture_size
    shown = tiles(panel.pixels, layout)
    assert shown.shape == (display.views, *display.view_size[::-1], 3)
    red, blue = (np.array([place(view, channel) for view in shown]) for channel in (0, 2))
    assert (red[:, 0] < blue[:, 0]).all()  # up is up
    assert (np.diff(red[:, 1]) < 0).all() and (np.diff(blue[:, 1]) > 0).all()  # from left to right
    rig = aus.Rig(baseline=0.5, views=display.views, aspect=display.aspect)
    assert np.array_equal(shown, aus.render_views(SCENE, rig, display.view_size).color[..., :3])
    swapped = aus.render(SCENE, display.swapped(), aus.Rig(baseline=0.5))
    assert np.array_equal(tiles(swapped.pixels, layout), shown[::-1])
    assert panel.pixels.any(axis=(1, 2)).sum() <= panel.height - PLACES[layout][2]


def test_display_and_encoder_know_the_same_layouts():
    assert set(STEREO) == {name for name in LAYOUTS if name in PACKED} - {"anaglyph"}
    assert set(PACKED) == {*STEREO, "anaglyph", "rgbd"}
    for name, packing in STEREO.items():
        width, height = packing.size or (8, 6)
        views = np.zeros((packing.views, *packing.view_size(width, height)[::-1], 3), np.uint8)
        assert pack(views, name, anamorphic=True).shape[1::-1] == packing.picture_size(width, height)


@pytest.mark.parametrize(
    ("name", "views", "picture"),
    [
        ("leia-4-view", 4, (2560, 1600)),
        ("frame-packing-720p", 2, (1280, 1470)),
        ("frame-packing-1080p", 2, (1920, 2205)),
    ],
)
def test_presets(name, views, picture):
    display = aus.Display.preset(name)
    assert (display.views, display.picture_size, display.viewmap, display.quilt) == (views, picture, None, None)
    assert aus.Rig.frame(SCENE, display).views == views


def test_leia_is_a_row_of_cameras_not_two_eyes():
    leia, eyes = aus.Display.preset("leia-4-view"), aus.Display.preset("side-by-side")
    assert leia.cone_deg == 30 and eyes.cone_deg == 6
    assert leia.comfort == 5 and leia.comfort_size == leia.view_size == (1280, 800)


@pytest.mark.parametrize(
    ("layout", "size", "words"),
    [
        ("frame-packing-720p", (1920, 1080), "frame-packing-720p: expected 1280×720 pixels, got 1920×1080"),
        ("frame-packing-1080p", (1280, 720), "frame-packing-1080p: expected 1920×1080 pixels, got 1280×720"),
        ("leia-2x2", (121, 90), "leia-2x2: expected an even number of pixels to halve, got 121"),
        ("leia-2x2", (120, 91), "leia-2x2: expected an even number of pixels to halve, got 91"),
    ],
)
def test_sizes_that_a_layout_does_not_have(layout, size, words):
    with pytest.raises(aus.InputError, match=words):
        aus.Display.stereo(*size, layout)
    with pytest.raises(aus.InputError, match=words):
        replace(aus.Display.stereo(*(STEREO[layout].size or (120, 90)), layout), width=size[0], height=size[1])


def test_the_command_line_names_leia_s_pictures(cli: Run, folder: Path) -> None:
    leia = ("render", "square.off", "-d", "leia-4-view", "--size", "48x32")
    result = cli(*leia)
    assert (result.status, files(folder)) == (0, {"square.off", "square_leia-4-view_2x2.png"})
    assert pixels("square_leia-4-view_2x2.png").shape == (32, 48, 3) and "wants a name" not in result.err
    assert "out.png: its device wants a name that ends in _2x2, such as out_2x2.png" in cli(*leia, "-o", "out.png").err
    assert "p.png: its device wants a name that ends in _2x2" in cli("pattern", *leia[2:], "-o", "p.png").err
    assert "wants a name" not in cli("pattern", *leia[2:], "-o", "p_2x2.png").err
    refused(cli("weave", "out.png", "--grid", "2x2", "-d", "leia-4-view", "-o", "p.png"), "is not woven from a quilt")


def test_leia_s_side_by_side_pictures_end_in_2x1(cli: Run, folder: Path) -> None:
    leia = ("-d", "leia-lume-pad-2", "--size", "48x32")
    result = cli("render", "square.off", *leia)
    assert (result.status, files(folder)) == (0, {"square.off", "square_leia-lume-pad-2_2x1.png"})
    assert "wants a name" not in result.err
    words = "out.png: its device wants a name that ends in _2x1, such as out_2x1.png"
    assert words in cli("render", "square.off", *leia, "-o", "out.png").err
    assert words in cli("pattern", *leia, "-o", "out.png").err
    assert "wants a name" not in cli("render", "square.off", "-d", "side-by-side", "--size", "48x32").err


def test_the_ending_of_names_is_a_field_of_display_files(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    text = 'source = "me"\nwidth = 48\nheight = 32\n{}[mask]\nkind = "stereo"\nlayout = "{}"\n'
    for ending, layout, expected in (
        ("", "side-by-side", ""), ("", "leia-2x2", "_2x2"), ('ending = "_x"\n', "leia-2x2", "_x"),
        ('ending = "_x"\n', "checkerboard", "_x"),
    ):  # fmt: skip
        path.write_text(text.format(ending, layout))
        assert aus.Display.preset(path).ending == aus.Display.preset(path).swapped().ending == expected
    path.write_text(text.format("ending = 3\n", "side-by-side"))
    with pytest.raises(aus.FileError, match="ending: expected a string, found 3"):
        aus.Display.preset(path)


def test_the_command_line_packs_frames(cli: Run, folder: Path) -> None:
    assert cli("pattern", "-d", "frame-packing-720p", "--kind", "eyes", "-o", "eyes.png").status == 0
    left, right = tiles(pixels("eyes.png"), "frame-packing-720p")
    assert place(left, 0).size == place(right, 2).size == 2 and not pixels("eyes.png")[720:750].any()
    refused(cli("render", "square.off", "-d", "frame-packing-720p", "--size", "64x64"), "expected 1280×720")


def test_a_reversed_map_of_depth_is_dark_in_front():
    """2D + depth: `reverse` inverts the depth, and leaves the picture and the header as they are."""
    display = aus.Display.rgbd(320, 160)
    plain, turned = (aus.render(SCENE, d, aus.Rig(baseline=0.5)).pixels for d in (display, display.swapped()))
    assert np.array_equal(plain[:, :160], turned[:, :160])
    light, dark = plain[1:, 160:].astype(int), turned[1:, 160:].astype(int)
    assert np.abs(light + dark - 255).max() <= 1 and np.ptp(light) > 10
    assert light[-1].max() < 128 < light.max()  # red, above, is in front; what is below lies behind
