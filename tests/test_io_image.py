"""Reading pictures, and cutting polygons into triangles."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autostereo import FileError
from autostereo.io.image import read_image
from autostereo.io.polygons import triangulate, weld
from io_files import DATA, needs_data

# --- polygons ----------------------------------------------------------------------------------------


@given(st.integers(3, 12), st.randoms(use_true_random=False), st.integers(0, 2))
def test_star_shaped_polygons_are_cut_without_overlap(n, random, axis):
    angle = 2 * np.pi * np.arange(n) / n
    radius = np.array([random.uniform(0.2, 1.0) for _ in range(n)])
    ring = np.roll(np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1), axis, axis=1)
    cut = triangulate(np.array([n]), np.arange(n), ring)
    a, b, c = np.moveaxis(ring[cut], 1, 0)
    area = np.cross(b - a, c - a) @ np.roll((0, 0, 1), axis) / 2
    assert len(cut) == n - 2 and area.min() > -1e-12  # no triangle is turned over, and so none overlap
    shoelace = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0) @ np.roll((0, 0, 1), axis) / 2
    assert area.sum() == pytest.approx(shoelace, rel=1e-9)


def test_polygons_keep_their_order_and_short_ones_vanish():
    corner = np.array([0, 1, 2, 3, 9, 8, 4, 5, 6, 7])
    cut = triangulate(np.array([4, 2, 3, 1]), corner, np.eye(10)[:, :3])
    np.testing.assert_array_equal(corner[cut], [(0, 1, 2), (0, 2, 3), (4, 5, 6)])


@given(st.lists(st.tuples(st.integers(-3, 3), st.sampled_from([0.0, 0.5, -1e9])), min_size=1, max_size=50))
def test_weld_numbers_distinct_rows_in_order_of_appearance(rows):
    a, b = (np.array(column) for column in zip(*rows, strict=True))
    first, group = weld(a, b)
    distinct = list(dict.fromkeys(rows))
    assert [rows[k] for k in first] == distinct and group.tolist() == [distinct.index(row) for row in rows]


@pytest.mark.parametrize("high", [3, 10**4, 10**15])
def test_weld_of_many_rows(high):
    rows = np.random.default_rng(4).integers(-high, high, (3000, 3)).repeat(2, axis=0)[::-1]
    first, group = weld(*rows.T)
    assert (np.diff(first) > 0).all() and len(first) == len(np.unique(rows, axis=0))
    np.testing.assert_array_equal(rows[first[group]], rows)
    np.testing.assert_array_equal(group[first], np.arange(len(first)))


# --- pictures ------------------------------------------------------------------------------------------


def test_pictures_of_every_mode_become_rgb_or_rgba(tmp_path):
    path = tmp_path / "a.png"
    rgb = np.random.default_rng(1).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    grey = rgb[..., 0]
    Image.fromarray(rgb).save(path)
    np.testing.assert_array_equal(read_image(path), rgb)
    Image.fromarray(grey).save(path)
    np.testing.assert_array_equal(read_image(path), np.repeat(grey[..., None], 3, axis=2))
    Image.fromarray(grey > 127).save(path)
    np.testing.assert_array_equal(read_image(path)[..., 2], np.where(grey > 127, 255, 0))
    Image.fromarray(np.dstack([rgb, grey])).save(path)
    np.testing.assert_array_equal(read_image(path), np.dstack([rgb, grey]))
    Image.fromarray(np.dstack([grey, 255 - grey])).save(path)
    np.testing.assert_array_equal(read_image(path), np.dstack([grey, grey, grey, 255 - grey]))
    Image.fromarray(grey.astype(np.uint16) * 257).save(path)
    np.testing.assert_array_equal(read_image(path), np.repeat(grey[..., None], 3, axis=2))
    palette = Image.fromarray(rgb).quantize(16)
    palette.save(path)
    np.testing.assert_array_equal(read_image(path), np.asarray(palette.convert("RGB")))


def test_bad_pictures(tmp_path):
    path = tmp_path / "a.png"
    with pytest.raises(FileError, match=r"a\.png: no such file"):
        read_image(path)
    Image.fromarray(np.random.default_rng(1).integers(0, 256, (50, 50, 3), dtype=np.uint8)).save(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(FileError, match=r"a\.png: the picture is damaged or truncated"):
        read_image(path)
    tiff = tmp_path / "a.tif"
    Image.fromarray(np.ones((4, 4), np.float32)).save(tiff)
    with pytest.raises(FileError, match=r"a\.tif: holds floats, which have no fixed range as colours; expected 8"):
        read_image(tiff)
    Image.fromarray(np.ones((4, 4), np.int32)).save(tiff)
    with pytest.raises(FileError, match=r"a\.tif: holds integers of 32 bits, which"):
        read_image(tiff)
    tiff.write_bytes(b"II*\0" + bytes(99))
    with pytest.raises(FileError, match=r"a\.tif: is damaged, or is no TIFF of 8 or 16 bits a colour \(floats are not"):
        read_image(tiff)
    path.write_bytes(b"no picture at all")
    with pytest.raises(FileError, match=r"a\.png: is not a picture"):
        read_image(path)
    chunks = [b"IHDR" + struct.pack(">IIBBBBB", 2**20, 2**20, 8, 2, 0, 0, 0), b"IDAT" + zlib.compress(b""), b"IEND"]
    framed = [struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(framed))
    with pytest.raises(FileError, match=r"a\.png: a picture of 1048576×1048576 pixels is too large"):
        read_image(path)


def test_a_picture_above_the_limit_of_pillow_is_read_without_a_warning(tmp_path, monkeypatch):
    path = tmp_path / "quilt.png"
    pixels = np.random.default_rng(2).integers(0, 256, (2500, 3, 3), dtype=np.uint8)
    Image.fromarray(pixels).save(path)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1000)  # it warns above once, and refuses above twice the limit
    found = read_image(path)
    np.testing.assert_array_equal(found, pixels)
    assert found.flags.writeable and Image.MAX_IMAGE_PIXELS == 1000


@needs_data
def test_a_real_quilt():
    assert read_image(DATA / "quilts" / "kirurobo_example01.png").shape == (2048, 2048, 3)
