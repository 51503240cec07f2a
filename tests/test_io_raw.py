"""Voxels without a header, or with a few lines of text; the real data sets."""

from pathlib import Path

import numpy as np
import pytest

from volume_files import SHAPE, SPACING, check_phantom, load_one, phantom, refused

DATA = Path(__file__).parent.parent.parent / "shared" / "data" / "volumes"


@pytest.mark.parametrize(
    ("name", "dtype"),
    [("uint8", "u1"), ("int8", "i1"), ("uint16", "<u2"), ("int16", "<i2"), ("uint16be", ">u2"), (">i2", ">i2"),
     ("<u2", "<u2"), ("float32", "<f4"), ("float64be", ">f8"), ("int32", "<i4"), (" Int16LE ", "<i2")],
)  # fmt: skip
def test_raw(tmp_path, name, dtype):
    path = tmp_path / "a.raw"
    path.write_bytes(phantom(dtype).tobytes())
    check_phantom(load_one(path, shape=SHAPE, dtype=name, spacing=SPACING), origin=(0, 0, 0))


def test_raw_named_like_the_open_scivis_data_sets(tmp_path):
    path = tmp_path / "thing_9x7x5_int16.raw"
    path.write_bytes(phantom("<i2").tobytes())
    check_phantom(load_one(path), (1, 1, 1), (0, 0, 0))
    turned = load_one(path, shape=(5, 7, 9))  # what is given counts more than the name
    assert turned.shape == (5, 7, 9) and turned.values.dtype == np.int16


def test_raw_of_several_frames(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(phantom("u1").tobytes() + (phantom("u1") * 2).tobytes())
    hints = {"shape": SHAPE, "dtype": "uint8"}
    check_phantom(load_one(path, frame=1, **hints), (1, 1, 1), (0, 0, 0), value=200)
    refused(path, "holds 2 frames", **hints)
    refused(path, "no frame 2", frame=2, **hints)


def test_raw_whose_size_does_not_fit(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(bytes(16**3))
    refused(path, "give --shape", "--dtype", "4,096 bytes", "16×16×16 uint8")
    refused(path, "give --dtype", shape=SHAPE)
    refused(path, "give --shape", dtype="uint8")
    refused(path, "9×7×5 int16 takes 630 bytes, the file has 4,096", shape=SHAPE, dtype="int16")
    refused(path, "takes 8,192 bytes", "16×16×16 uint8", shape=(16, 16, 16), dtype="uint16")
    refused(path, "at least 2 voxels", shape=(4096, 1, 1), dtype="uint8")
    refused(path, "takes 8,000,000,000,000,000,000 bytes", shape=(2_000_000,) * 3, dtype="uint8")


VOL = "X: 9\nY: 7\nZ: 5\nAlpha-Color: 0\nVoxel-Size: {size}\nInt-Endian: 0123\nVoxel-Endian: {endian}\nVersion: 2\n.\n"


@pytest.mark.parametrize(("size", "endian", "dtype"), [(1, 0, "u1"), (2, 0, "<u2"), (2, 1, ">u2")])
def test_vol(tmp_path, size, endian, dtype):
    path = tmp_path / "a.vol"
    path.write_bytes(VOL.format(size=size, endian=endian).encode() + phantom(dtype).tobytes())
    check_phantom(load_one(path), (1, 1, 1), (0, 0, 0))
    data = path.read_bytes()
    path.write_bytes(b"Dist-X: 0.5\nDist-Y: 2\nDist-Z: 3\n" + data)
    check_phantom(load_one(path), origin=(0, 0, 0))
    path.write_bytes(data[:-1])
    refused(path, "truncated", f"{315 * size} bytes, found {315 * size - 1}")


def test_vol_of_another_form(tmp_path):
    path = tmp_path / "a.vol"
    good = VOL.format(size=1, endian=0) + "x" * 315
    for old, new, words in (
        ("\n.\n", "\n", "up to a line '.'"),
        ("X: 9", "X: y", "whole numbers X, Y, Z"),
        ("X: 9\n", "", "whole numbers X, Y, Z"),
        ("X: 9", "X: 0", "≥ 1"),
        ("Voxel-Size: 1", "Voxel-Size: 4", "Voxel-Size 1 or 2"),
    ):
        path.write_text(good.replace(old, new, 1))
        refused(path, words)


# --- real files ----------------------------------------------------------------------------------------------------
REAL = {
    "Bucky.raw": ((32, 32, 32), "uint8", (1, 1, 1)),
    "fuel.vol": ((64, 64, 64), "uint8", (1, 1, 1)),
    "nucleon.vol": ((41, 41, 41), "uint8", (1, 1, 1)),
    "silicium.vol": ((98, 34, 34), "uint8", (1, 1, 1)),
    "neghip_64x64x64_uint8.raw": ((64, 64, 64), "uint8", (1, 1, 1)),
    "tooth_103x94x161_uint8.raw": ((103, 94, 161), "uint8", (1, 1, 1)),
    "hydrogen.vti": ((64, 64, 64), "float32", (1, 1, 1)),
    "ironProt.vtk": ((68, 68, 68), "uint8", (1, 1, 1)),
    "engine.nii.gz": ((256, 256, 128), "uint8", (1, 1, 1)),
    "AVM.nii.gz": ((337, 319, 154), "float32", (0.5469, 0.5469, 1)),
    "FLAIR.nrrd": ((124, 160, 140), "uint8", (1, 1, 1)),
    "stent.npz": ((128, 128, 256), "int16", (1, 1, 1)),
    "frogtissue.mhd": ((500, 470, 136), "uint8", (1, 1, 1.5)),
    "headsq/quarter.nhdr": ((64, 64, 93), "int16", (3.2, 3.2, 1.5)),
}


@pytest.mark.parametrize("name", REAL)
def test_real_files(name):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{path} is not there")
    if name.endswith((".gz", ".nrrd", ".mhd", ".nhdr")):
        pytest.importorskip("SimpleITK")
    shape, dtype, spacing = REAL[name]
    hints = {"shape": shape, "dtype": dtype} if name == "Bucky.raw" else {}
    volume = load_one(path, **hints)
    assert volume.shape == shape and volume.values.dtype == dtype
    assert np.allclose(volume.spacing, spacing, rtol=1e-4)
    assert volume.values.std() > 0
    tau = volume.transfer.evaluate(volume.values[:: max(1, shape[2] // 64)])[..., 3].mean() * volume.diagonal
    assert 0.05 < tau < 60  # neither empty nor opaque


def test_bucky_is_symmetric():
    """A check of the axes by the data: C60 has its centre of mass in the middle."""
    path = DATA / "Bucky.raw"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    values = load_one(path, shape=(32, 32, 32), dtype="uint8").values.astype(float)
    for axis in range(3):
        profile = values.sum(axis=tuple(a for a in range(3) if a != axis))
        assert (profile @ np.arange(32)) / profile.sum() == pytest.approx(15.5, abs=1)
