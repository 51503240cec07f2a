"""Reading depths: arrays, and grey pictures of 16 bits or of floats."""

import numpy as np
import pytest
from PIL import Image

from autostereo import FileError
from autostereo.io.depth import read_depth

DEPTH = np.array([[1, 2, 0], [30000, 4, 65535]], np.uint16)
EXPECTED = np.where(DEPTH > 0, DEPTH / 1000, np.inf).astype(np.float32)


@pytest.mark.parametrize("name", ["a.png", "a.tif", "f.tif", "i.tif", "a.npy", "f.npy", "i.npy"])
def test_numbers_times_the_unit_and_nothing_is_infinitely_far(tmp_path, name):
    path, array = tmp_path / name, DEPTH.astype({"a": np.uint16, "f": np.float32, "i": np.int32}[name[0]])
    if path.suffix == ".npy":
        np.save(path, array)
    else:
        Image.fromarray(array).save(path)
    found = read_depth(path, 0.001)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, EXPECTED)


def test_what_is_no_number_is_none(tmp_path):
    np.save(tmp_path / "a.npy", np.array([[np.nan, np.inf, 1e300, 1e-300, 2.0]]))
    np.testing.assert_array_equal(read_depth(tmp_path / "a.npy"), [[np.inf, np.inf, np.inf, np.inf, 2.0]])


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.ones(5), r"expected depths \(H, W\), found shape \(5,\) float64"),
        (np.ones((2, 3, 1)), r"found shape \(2, 3, 1\)"),
        (np.ones((0, 3)), r"found shape \(0, 3\)"),
        (np.ones((2, 3), bool), "found shape .* bool"),
        (np.ones((2, 3), complex), "found shape .* complex128"),
        (np.array([[1.0, -0.5]]), r"expected depths ≥ 0 \(0: none\), found -0.5"),
        (np.array([[1.0, -np.inf]]), "found -inf"),
    ],
)
def test_other_arrays_are_refused(tmp_path, array, words):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(FileError, match=f"a.npy: .*{words}"):
        read_depth(tmp_path / "a.npy")


@pytest.mark.parametrize(("kind", "found"), [("uint8", "8 bits"), ("bool", "1 bit"), ("rgb", "RGB")])
def test_other_pictures_are_refused(tmp_path, kind, found):
    array = np.zeros((2, 3, 3), np.uint8) if kind == "rgb" else np.zeros((2, 3), kind)
    Image.fromarray(array).save(tmp_path / "a.png")
    with pytest.raises(FileError, match=f"a.png: expected a grey picture of 16 bits or of floats, found {found}"):
        read_depth(tmp_path / "a.png")


def test_damaged_files_are_refused(tmp_path):
    Image.fromarray(np.random.default_rng(0).integers(0, 65536, (64, 64)).astype(np.uint16)).save(tmp_path / "a.png")
    whole = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(FileError, match="damaged or truncated"):
        read_depth(tmp_path / "a.png")
    (tmp_path / "b.npy").write_bytes(b"no array")
    with pytest.raises(FileError, match="b\\.npy: is not a NumPy file"):
        read_depth(tmp_path / "b.npy")
    with pytest.raises(FileError, match="no such file"):
        read_depth(tmp_path / "c.png")
