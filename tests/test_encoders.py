"""Stereo pictures, 2D+depth, and the one door that writes files."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autostereo import encoders
from autostereo.encoders import rgbd
from autostereo.encoders.quilt import pack_quilt
from autostereo.encoders.stereo import DUBOIS_LEFT, DUBOIS_RIGHT, LAYOUTS, halve, pack
from autostereo.errors import FileError, InputError
from autostereo.frame import Panel, ViewStack


def random_pixels(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def stack(views: int, height: int, width: int) -> ViewStack:
    return ViewStack(random_pixels(views, height, width, 4))


def read(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


# --- stereo --------------------------------------------------------------------------------------------------

LEFT, RIGHT = random_pixels(6, 8, 3, seed=1), random_pixels(6, 8, 3, seed=2)
PAIR = np.stack([LEFT, RIGHT])


def mean_of_pairs(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.floor((a.astype(float) + b) / 2 + 0.5)


def test_full_layouts():
    assert np.array_equal(pack(PAIR, "side-by-side"), np.hstack([LEFT, RIGHT]))
    assert np.array_equal(pack(PAIR, "top-bottom"), np.vstack([LEFT, RIGHT]))


def test_half_layouts_average_pairs_of_pixels():
    beside = pack(PAIR, "side-by-side-half")
    assert beside.shape == (6, 8, 3)
    assert np.array_equal(beside[:, :4], mean_of_pairs(LEFT[:, ::2], LEFT[:, 1::2]))
    assert np.array_equal(beside[:, 4:], mean_of_pairs(RIGHT[:, ::2], RIGHT[:, 1::2]))
    above = pack(PAIR, "top-bottom-half")
    assert above.shape == (6, 8, 3)
    assert np.array_equal(above[:3], mean_of_pairs(LEFT[::2], LEFT[1::2]))
    assert np.array_equal(above[3:], mean_of_pairs(RIGHT[::2], RIGHT[1::2]))


@pytest.mark.parametrize(("half", "full"), [("side-by-side-half", "side-by-side"), ("top-bottom-half", "top-bottom")])
def test_anamorphic_views_are_not_halved_again(half, full):
    assert np.array_equal(pack(PAIR, half, anamorphic=True), pack(PAIR, full))


@pytest.mark.parametrize(
    ("layout", "is_right"),
    [
        ("row-interleaved", lambda r, x: r % 2),
        ("column-interleaved", lambda r, x: x % 2),
        ("checkerboard", lambda r, x: (r + x) % 2),
    ],
)
def test_interleaved_layouts(layout, is_right):
    r, x = np.mgrid[:6, :8]
    assert np.array_equal(pack(PAIR, layout), np.where(is_right(r, x)[..., None] == 1, RIGHT, LEFT))


def test_anaglyph_is_duboiss():
    expected = np.clip(LEFT @ DUBOIS_LEFT.T + RIGHT @ DUBOIS_RIGHT.T, 0, 255)
    assert np.array_equal(pack(PAIR, "anaglyph"), np.floor(expected + 0.5))


def test_anaglyph_keeps_greys():
    """Both eyes the same grey: the columns of the two matrices sum to 1 within their four digits."""
    greys = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    assert np.array_equal(pack(np.stack([greys, greys]), "anaglyph"), greys)


def test_anaglyph_by_hand():
    red, cyan = np.array([255, 0, 0], np.uint8), np.array([0, 255, 255], np.uint8)
    pixel = pack(np.array([[[red]], [[cyan]]]), "anaglyph")[0, 0]
    # left red: .4561·255 − (.0879 + .0016)·255 = 93.5; right cyan: (.7336 − .0185 − .0401)·255; …
    assert pixel.tolist() == [93, 172, 255]


@pytest.mark.parametrize(("layout", "size", "rows"), [("720p", (1280, 720), 1470), ("1080p", (1920, 1080), 2205)])
def test_frame_packing(layout, size, rows):
    views = random_pixels(2, size[1], size[0], 3)
    frame = pack(views, f"frame-packing-{layout}")
    assert frame.shape == (rows, size[0], 3)
    assert np.array_equal(frame[: size[1]], views[0])
    assert np.array_equal(frame[-size[1] :], views[1])
    assert not frame[size[1] : -size[1]].any()
    with pytest.raises(InputError, match=f"expected views of {size[0]}×{size[1]}, got 8×6"):
        pack(PAIR, f"frame-packing-{layout}")


def test_leia_2x2():
    views = random_pixels(4, 6, 8, 4)
    top, bottom = np.hstack(list(views[:2])), np.hstack(list(views[2:]))
    assert np.array_equal(pack(views, "leia-2x2"), np.vstack([top, bottom])[..., :3])


@pytest.mark.parametrize("layout", [name for name, rule in LAYOUTS.items() if rule.size is None])
def test_swap_reverses_the_views_and_alpha_is_ignored(layout):
    views = random_pixels(LAYOUTS[layout].views, 6, 8, 4)
    picture = pack(views, layout)
    assert picture.dtype == np.uint8 and picture.shape[2] == 3 and picture.flags.c_contiguous
    assert np.array_equal(pack(views, layout, swap=True), pack(views[::-1], layout))
    assert not np.array_equal(pack(views, layout, swap=True), picture)
    assert np.array_equal(pack(views[..., :3], layout), picture)


def test_pack_leaves_its_input_alone():
    views = PAIR.copy()
    for layout, rule in LAYOUTS.items():
        if rule.views == 2 and rule.size is None:
            pack(views, layout)[...] = 7
    assert np.array_equal(views, PAIR)


def test_halve_rounds_up():
    assert halve(np.array([[0, 1], [254, 255]], np.uint8), 1).tolist() == [[1], [255]]


def test_pack_rejects_what_does_not_fit():
    with pytest.raises(InputError, match=r"layout: expected one of side-by-side, .*, got 'cross-eyed'"):
        pack(PAIR, "cross-eyed")
    with pytest.raises(InputError, match="expected 2 views, got 3"):
        pack(random_pixels(3, 6, 8, 3), "anaglyph")
    with pytest.raises(InputError, match="even number of pixels to average, got 7"):
        pack(random_pixels(2, 6, 7, 3), "side-by-side-half")
    with pytest.raises(InputError, match="even number"):
        pack(random_pixels(2, 5, 8, 3), "top-bottom-half")
    with pytest.raises(InputError, match="uint8, got"):
        pack(PAIR.astype(float), "side-by-side")
    with pytest.raises(InputError, match="expected views"):
        pack(LEFT, "side-by-side")


# --- 2D + depth ----------------------------------------------------------------------------------------------


def test_wowvx_header_is_the_test_vector():
    assert rgbd.wowvx_header() == bytes.fromhex("F1 02 40 80 00 00 1F 3A 7B 38")


@given(st.binary(min_size=1, max_size=20))
def test_crc_is_zlibs_in_another_form(data):
    """zlib's CRC-32 reflects bits, starts at all ones and inverts; undo each of these."""
    mirrored = bytes(int(f"{byte:08b}"[::-1], 2) for byte in data)
    start = zlib.crc32(b"\xff\xff\xff\xff" + mirrored)  # the state after these four bytes is 0
    assert rgbd.crc32(data) == int(f"{start ^ 0xFFFFFFFF:032b}"[::-1], 2)


def decode(frame: np.ndarray) -> bytes:
    """Read a header by the rule of displays.md 3.6."""
    byte = [sum((frame[0, 16 * b + 2 * (7 - k), 2] == 255) << k for k in range(8)) for b in range(10)]
    return bytes(int(b) for b in byte)


def test_wowvx_frame():
    color, disparity = random_pixels(4, 320, 4), random_pixels(4, 320, seed=5)
    frame = rgbd.wowvx(color, disparity)
    assert frame.shape == (4, 320, 3)
    assert decode(frame) == rgbd.wowvx_header()
    assert set(np.unique(frame[0, :160:2, 2])) == {0, 255}
    expected = np.concatenate(
        [
            mean_of_pairs(color[:, ::2, :3], color[:, 1::2, :3]),
            np.repeat(np.maximum(disparity[:, ::2], disparity[:, 1::2])[..., None], 3, axis=2),
        ],
        axis=1,
    )
    expected[0, :160:2, 2] = frame[0, :160:2, 2]  # and nothing but the header differs
    assert np.array_equal(frame, expected)


def test_wowvx_of_halves():
    color, disparity = random_pixels(4, 160, 3), random_pixels(4, 160)
    frame = rgbd.wowvx(color, disparity, rgbd.wowvx_header(7, 20, 255), anamorphic=True)
    assert decode(frame)[:4] == bytes([0xF1, 7, 20, 255])
    assert np.array_equal(frame[1:], rgbd.rgbd(color, disparity)[1:])


@pytest.mark.parametrize(
    ("side", "where"),
    [
        ("right", np.s_[:, 7:]),
        ("left", np.s_[:, :7]),
        ("top", np.s_[:5]),
        ("bottom", np.s_[5:]),
    ],
)
def test_rgbd_sides(side, where):
    color, disparity = random_pixels(5, 7, 4), random_pixels(5, 7)
    frame = rgbd.rgbd(color, disparity, side)
    assert frame.shape == ((5, 14, 3) if side in ("left", "right") else (10, 7, 3))
    assert np.array_equal(frame[where], np.repeat(disparity[..., None], 3, axis=2))
    assert sum(np.array_equal(part, color[..., :3]) for axis in (0, 1) for part in np.array_split(frame, 2, axis)) == 1


def test_disparity_map_values():
    """fd = 2, scale = 20: parallax 20·(½ − 1/d) px. White where it pops out by 5 px, 128 on the screen."""
    depth = np.array([[0.5, 4 / 3, 1.6, 2.0, 8 / 3, 4.0, np.inf]], np.float32)
    parallax = 20 * (0.5 - 1 / depth.astype(float))
    expected = np.floor(127.5 * (1 - np.clip(parallax / 5, -1, 1)) + 0.5)
    assert expected.tolist() == [[255, 255, 191, 128, 64, 0, 0]]
    assert rgbd.disparity_map(depth, 2.0, 20.0).tolist() == expected.tolist()
    assert rgbd.disparity_map(depth, 2.0, 20.0, invert=True).tolist() == [[0, 0, 64, 128, 191, 255, 255]]


@given(st.floats(0.01, 100), st.floats(0, 1e4), st.floats(0.1, 50))
def test_disparity_map_falls_with_depth(focal, scale, comfort):
    depth = np.geomspace(1e-3, 1e3, 200).reshape(10, 20)
    shade = rgbd.disparity_map(depth, focal, scale, comfort).ravel().astype(int)
    assert (np.diff(shade) <= 0).all()
    assert (shade[depth.ravel() < focal] >= 127).all() and (shade[depth.ravel() > focal] <= 128).all()


def test_rgbd_rejects_what_does_not_fit():
    color, disparity, depth = random_pixels(5, 320, 3), random_pixels(5, 320), np.ones((5, 320), np.float32)
    with pytest.raises(InputError, match=r"map \(5, 320\) uint8, got \(5, 319\)"):
        rgbd.rgbd(color, disparity[:, 1:])
    with pytest.raises(InputError, match="float32"):
        rgbd.rgbd(color, depth)
    with pytest.raises(InputError, match="side"):
        rgbd.rgbd(color, disparity, "behind")
    with pytest.raises(InputError, match="picture"):
        rgbd.rgbd(disparity, disparity)
    with pytest.raises(InputError, match="at least 160 pixels wide, got 100"):
        rgbd.wowvx(color[:, :100], disparity[:, :100])
    with pytest.raises(InputError, match="even number"):
        rgbd.wowvx(color[:, :319], disparity[:, :319])
    with pytest.raises(InputError, match="10 bytes, got 3"):
        rgbd.wowvx(color, disparity, b"abc")
    with pytest.raises(InputError, match=r"factor: .* got 256"):
        rgbd.wowvx_header(factor=256)
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="depth"):
            rgbd.disparity_map(np.full((2, 2), bad), 1.0, 1.0)
    with pytest.raises(InputError, match=r"depth: expected \(H, W\) floats"):
        rgbd.disparity_map(np.ones((2, 2), int), 1.0, 1.0)
    for arguments in ((0.0, 1.0), (1.0, -1.0), (1.0, 1.0, 0.0), (np.nan, 1.0), (1.0, np.inf)):
        with pytest.raises(InputError, match="expected a number"):
            rgbd.disparity_map(depth, *arguments)


# --- the one door --------------------------------------------------------------------------------------------


def test_save_follows_the_name(tmp_path):
    views, panel = stack(4, 6, 8), Panel(random_pixels(6, 8, 3))
    assert np.array_equal(read(encoders.save(panel, tmp_path / "panel.png")), panel.pixels)
    quilt = encoders.save(views, tmp_path / "a_qs2x2a1.333.png")
    assert np.array_equal(read(quilt), pack_quilt(views, 2, 2))
    folder = encoders.save(views, tmp_path / "views")
    assert sorted(p.name for p in folder.iterdir()) == [f"view_{k:03d}.png" for k in range(4)]
    assert np.array_equal(read(folder / "view_003.png"), views.color[3])
    with np.load(encoders.save(views, tmp_path / "views.npz")) as arrays:
        assert np.array_equal(arrays["color"], views.color)
    with Image.open(encoders.save(views, tmp_path / "views.webp")) as image:
        assert image.n_frames == 6


def test_save_rejects_what_it_cannot_name(tmp_path):
    views = stack(4, 6, 8)
    for name in ("views.png", "views.xyz", "a_qs2x2a1.mp3"):
        with pytest.raises(InputError, match="expected for views a folder"):
            encoders.save(views, tmp_path / name)
    with pytest.raises(InputError, match="expected an image suffix"):
        encoders.save(Panel(random_pixels(6, 8, 3)), tmp_path / "panel.gif")
    with pytest.raises(InputError, match="3×1 tiles cannot hold 4 views"):
        encoders.save(views, tmp_path / "a_qs3x1a1.png")
    with pytest.raises(InputError, match="Panel or a ViewStack, got ndarray"):
        encoders.save(views.color, tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a_qs2x2a1.png", "a.npz", "a.gif", "a.webp", "views"])
def test_a_missing_folder_is_named(tmp_path, name):
    with pytest.raises(FileError, match="nowhere"):
        encoders.save(stack(4, 6, 8), tmp_path / "nowhere" / name)


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no /proc, where nobody can create files")
@pytest.mark.parametrize("name", ["a_qs2x2a1.png", "a.npz", "a.gif", "a.webp", "a.mp4", "views"])
def test_a_folder_that_takes_no_files_is_named(name):
    with pytest.raises(FileError, match=rf"/proc/{name}: cannot be"):
        encoders.save(stack(4, 6, 8), f"/proc/{name}")


@pytest.mark.parametrize(("suffix", "limit"), [(".webp", 16383), (".jpg", 65500), (".JPEG", 65500)])
def test_pictures_are_as_large_as_their_format_holds(tmp_path: Path, suffix: str, limit: int) -> None:
    path = tmp_path / f"a{suffix}"
    for shape in ((1, limit, 3), (limit, 1, 3)):
        assert read(Panel(np.zeros(shape, np.uint8)).save(path)).shape == shape
        path.unlink()
    for shape in ((1, limit + 1, 3), (limit + 1, 1, 3)):
        message = rf"{suffix} takes at most {limit} pixels a side, got {shape[1]}×{shape[0]}$"
        with pytest.raises(InputError, match=message):
            Panel(np.zeros(shape, np.uint8)).save(path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp"])
def test_other_formats_hold_larger_ones(tmp_path: Path, suffix: str) -> None:
    picture = random_pixels(1, 66000, 3)
    assert np.array_equal(read(Panel(picture).save(tmp_path / f"a{suffix}")), picture)
