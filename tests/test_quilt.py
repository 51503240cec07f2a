"""Quilts: names, grids, order of the tiles, padding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autostereo.display.quilt import Quilt
from autostereo.encoders import quilt as q
from autostereo.errors import InputError
from autostereo.frame import ViewStack

QUILTS = Path(__file__).parent.parent.parent / "shared" / "data" / "quilts"


def random_pixels(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def stack(views: int, height: int, width: int) -> ViewStack:
    return ViewStack(random_pixels(views, height, width, 4))


def read(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


# --- quilt names ---------------------------------------------------------------------------------------------


def test_quilt_name_is_the_documented_one():
    assert q.quilt_name("bunny", 8, 6, 0.75) == "bunny_qs8x6a0.75.png"
    assert q.quilt_name("a.b", 5, 9, 16 / 9, ".jpg") == "a.b_qs5x9a1.778.jpg"
    assert q.quilt_name("go", 11, 6, 0.5625, ".mp4") == "go_qs11x6a0.5625.mp4"


@given(st.integers(1, 32), st.integers(1, 32), st.floats(0.001, 1000), st.sampled_from([".png", ".webp", ".mp4", ""]))
def test_names_read_back(columns, rows, aspect, suffix):
    name = q.parse_quilt_name("folder/a_qs1x1a1_" + q.quilt_name("stem", columns, rows, aspect, suffix))
    assert name is not None
    assert name[:2] == (columns, rows)
    assert name.aspect == pytest.approx(aspect, rel=1e-3)


@pytest.mark.parametrize("name", ["bunny.png", "_qs8x6.png", "a_qs8x6a.png", "a_qs-8x6a1.png", "qs8x6a0.75.png"])
def test_other_names_say_nothing(name):
    assert q.parse_quilt_name(name) is None


def test_columns_come_before_rows():
    assert q.parse_quilt_name("x_qs8x6a0.75.png") == (8, 6, 0.75)


@pytest.mark.parametrize("name", ["a_qs0x6a1.png", "a_qs8x33a1.png", "a_qs8x6a0.png"])
def test_names_with_impossible_numbers_are_errors(name):
    with pytest.raises(InputError):
        q.parse_quilt_name(name)


@pytest.mark.parametrize("aspect", [0.0, -1.0, float("nan"), float("inf"), 1e-5])
def test_name_needs_an_aspect(aspect):
    with pytest.raises(InputError, match="aspect"):
        q.quilt_name("a", 2, 2, aspect)


def test_quilt_path_names_a_file_once():
    layout = Quilt(8, 6, 3360, 3360, 0.75)
    for given_name in ("dir/bunny.webp", "dir/bunny_qs8x6a0.75.webp", "dir/bunny_qs5x9a1.778.webp"):
        assert q.quilt_path(given_name, layout) == Path("dir/bunny_qs8x6a0.75.webp")
    assert q.quilt_path("bunny", layout) == Path("bunny_qs8x6a0.75.png")


# --- quilts --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("views", "tile", "grid"),
    [  # the grids of displays.md 4, from their tiles
        (48, (420, 560), (8, 6)),
        (45, (819, 455), (5, 9)),
        (66, (372, 682), (11, 6)),
        (72, (1024, 910), (8, 9)),
        (1, (512, 512), (1, 1)),
        (47, (420, 560), (8, 6)),  # 47 tiles in one row are more than 32
        (8, (512, 512), (2, 4)),
    ],
)
def test_choose_grid(views, tile, grid):
    assert q.choose_grid(views, *tile) == grid


@given(st.integers(1, 128), st.integers(1, 500), st.integers(1, 500))
def test_chosen_grids_fit(views, width, height):
    columns, rows = q.choose_grid(views, width, height)
    assert columns * rows >= views
    assert max(columns, rows) <= 32
    assert max(columns * width, rows * height) <= 16384


def test_no_grid_is_an_error():
    with pytest.raises(InputError, match="1025 views of 8×8"):
        q.choose_grid(1025, 8, 8)
    with pytest.raises(InputError, match="100 views of 3000×3000"):
        q.choose_grid(100, 3000, 3000)
    with pytest.raises(InputError, match="0 views"):
        q.choose_grid(0, 8, 8)


def test_pack_quilt_is_the_stacks_quilt():
    views = stack(5, 8, 11)
    assert np.array_equal(q.pack_quilt(views, 2, 3), views.quilt(2, 3)[..., :3])


@pytest.mark.parametrize("size", [(22, 16), (23, 17), (22, 17), (23, 16)])
def test_pack_quilt_pads_at_the_right_and_top_and_reads_back(size):
    views = stack(4, 8, 11)
    quilt = q.pack_quilt(views, 2, 2, size)
    assert quilt.shape == (size[1], size[0], 3)
    assert np.array_equal(quilt[-16:, :22], views.quilt(2, 2)[..., :3])
    assert not quilt[:-16].any() and not quilt[:, 22:].any()
    assert np.array_equal(ViewStack.from_quilt(quilt, 2, 2).color[..., :3], views.color[..., :3])


def test_tile_0_is_at_the_bottom_left_and_rows_go_up():
    colours = np.arange(6, dtype=np.uint8)[:, None, None, None] * np.ones((1, 2, 3, 4), np.uint8)
    quilt = q.pack_quilt(ViewStack(colours), 3, 2)
    assert quilt[::2, ::3, 0].tolist() == [[3, 4, 5], [0, 1, 2]]


def test_pack_quilt_rejects_what_a_reader_would_cut_wrong():
    with pytest.raises(InputError, match=r"2×2 tiles of a 24×16 quilt are 12×8 pixels, got views of 11×8"):
        q.pack_quilt(stack(4, 8, 11), 2, 2, (24, 16))
    with pytest.raises(InputError, match="2×2 tiles cannot hold 5 views"):
        q.pack_quilt(stack(5, 8, 11), 2, 2)
    with pytest.raises(InputError, match=r"columns: .* from 1 to 32, got 33"):
        q.pack_quilt(stack(5, 8, 11), 33, 1)
    with pytest.raises(InputError, match=r"at most 16384 pixels a side, got 17600×1"):
        q.pack_quilt(stack(2, 1, 550), 32, 1)
    with pytest.raises(InputError, match="rows"):
        q.tile_size((100, 100), 2, 0)
    with pytest.raises(InputError, match="cannot be 8×1 tiles"):
        q.tile_size((7, 100), 8, 1)


def test_save_quilt_writes_the_padded_picture(tmp_path):
    layout = Quilt(2, 2, 23, 17, 0.75)
    views = stack(4, 8, 11)
    path = q.save_quilt(q.quilt_path(tmp_path / "a.png", layout), views, layout)
    assert path.name == "a_qs2x2a0.75.png"
    assert np.array_equal(read(path), q.pack_quilt(views, 2, 2, (23, 17)))


@pytest.mark.skipif(not QUILTS.is_dir(), reason="no ../shared/data/quilts beside the repository")
def test_a_real_quilt_survives_cutting_and_packing():
    quilt = read(QUILTS / "kirurobo_example02.png")[..., :3]
    views = ViewStack.from_quilt(quilt, 4, 8)
    assert np.array_equal(q.pack_quilt(views, 4, 8), quilt)
    assert q.choose_grid(32, 512, 256) == (4, 8)
