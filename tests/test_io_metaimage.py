"""MetaImage: what ITK's reader would take without a word."""

import zlib

import numpy as np
import pytest

from volume_files import load_one, refused

sitk = pytest.importorskip("SimpleITK")

VALUES = np.random.default_rng(0).integers(0, 9, (6, 7, 8)).astype(np.int16)
RAW = VALUES.tobytes()
PACKED = zlib.compress(RAW)


def write(path, data=RAW, **fields):
    """Write a header, whose fields None leaves out, and data."""
    fields = {"NDims": 3, "DimSize": "8 7 6", "ElementType": "MET_SHORT", "ElementDataFile": "LOCAL", **fields}
    last = {"ElementDataFile": fields.pop("ElementDataFile")}
    lines = [f"{name} = {value}\n" for name, value in {**fields, **last}.items() if value is not None]
    path.write_bytes("".join(lines).encode() + data)
    return path


def packed(path, data, size=None):
    return write(path, data, CompressedData="True", CompressedDataSize=size or len(data))


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint32", "int32", "int64", "float32", "float64"])
@pytest.mark.parametrize("compress", [False, True])
def test_sizes_of_types(tmp_path, dtype, compress):
    path = tmp_path / "a.mha"
    sitk.WriteImage(sitk.GetImageFromArray(VALUES.astype(dtype)), str(path), useCompression=compress)
    assert np.array_equal(load_one(path).values, VALUES)


def test_damaged_compression(tmp_path):
    path = tmp_path / "a.mha"
    assert np.array_equal(load_one(packed(path, PACKED)).values, VALUES)
    middle = len(PACKED) // 2
    refused(packed(path, PACKED[:middle] + bytes(20) + PACKED[middle + 20 :]), "damaged compressed voxels")
    refused(packed(path, PACKED[:-1] + b"x"), "damaged compressed voxels")
    refused(packed(path, PACKED[:middle]), "truncated within its compressed voxels")
    refused(packed(path, RAW), "damaged compressed voxels")
    refused(packed(path, zlib.compress(RAW[:-2])), "672 bytes of voxels expected, found 670")
    refused(packed(path, zlib.compress(RAW + b"xx")), "672 bytes of voxels expected, found 674")


@pytest.mark.parametrize("size", [None, 17, len(PACKED) - 1, len(PACKED) + 5])
@pytest.mark.parametrize("local", [True, False])
def test_wrong_compressed_size(tmp_path, size, local):
    """Sound files have it; ITK unpacks no more than it says."""
    name = "LOCAL" if local else "a.zraw"
    (tmp_path / "a.zraw").write_bytes(PACKED)
    fields = {"CompressedData": "True", "CompressedDataSize": size, "ElementDataFile": name, "Offset": "1 2 3"}
    volume = load_one(write(tmp_path / "a.mhd", PACKED if local else b"", **fields))
    assert np.array_equal(volume.values, VALUES) and volume.origin == (1, 2, 3)


def test_damaged_compression_beside_the_header(tmp_path):
    path = write(tmp_path / "a.mhd", b"", CompressedData="True", ElementDataFile="a.zraw")
    (tmp_path / "a.zraw").write_bytes(PACKED)
    assert np.array_equal(load_one(path).values, VALUES)
    (tmp_path / "a.zraw").write_bytes(PACKED[: len(PACKED) // 2])
    refused(path, "a.zraw is truncated within its compressed voxels")


def test_lists_and_numbered_files(tmp_path):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"{k + 1}.raw").write_bytes(plane.tobytes())
    names = [f"{k + 1}.raw\n" for k in range(6)]
    path = tmp_path / "a.mhd"
    assert np.array_equal(load_one(write(path, "".join(names).encode(), ElementDataFile="LIST")).values, VALUES)
    assert np.array_equal(load_one(write(path, b"", ElementDataFile="%d.raw 1 6 1")).values, VALUES)
    refused(write(path, b"", ElementDataFile="LIST"), "expected a list of 6 files, found 0")
    refused(write(path, "".join(names[:5]).encode(), ElementDataFile="LIST"), "expected a list of 6 files, found 5")
    refused(write(path, b"", ElementDataFile="%d%s.raw 1 6 1"), "cannot use its ElementDataFile = %d%s.raw 1 6 1")
    (tmp_path / "4.raw").write_bytes(b"x")
    refused(write(path, b"", ElementDataFile="%d.raw 1 6 1"), "4.raw is damaged or truncated: 112 bytes of voxels exp")
    (tmp_path / "4.raw").unlink()
    refused(path, "4.raw, which does not exist")
    refused(write(path, b"", ElementDataFile="."), "which is a folder")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"DimSize": "8.5 7 6"}, "expected whole numbers for DimSize"),
        ({"DimSize": "a b c"}, "expected numbers for DimSize, found 'a'"),
        ({"DimSize": "8 7"}, "expected 3 numbers (NDims), found DimSize = 8 7"),
        ({"DimSize": "8 7 0"}, "cannot use its DimSize = 8 7 0"),
        ({"DimSize": None}, "its header has no DimSize"),
        ({"DimSize": "8 7 7"}, "784 bytes of voxels expected, found 672"),
        ({"NDims": "x"}, "expected numbers for NDims, found 'x'"),
        ({"Offset": "a b c"}, "expected numbers for Offset, found 'a'"),
        ({"Offset": "nan 0 0"}, "cannot use its Offset = nan 0 0"),
        ({"ElementSpacing": "0 1 1"}, "cannot use its ElementSpacing = 0 1 1"),
        ({"TransformMatrix": "0 0 0 0 0 0 0 0 0"}, "cannot use its TransformMatrix = 0 0 0"),
        ({"ElementNumberOfChannels": "x"}, "expected numbers for ElementNumberOfChannels"),
        ({"ElementType": "MET_BLAH"}, "expected a type such as MET_FLOAT, found ElementType = MET_BLAH"),
        ({"ElementDataFile": None}, "its header has no ElementDataFile"),
    ],
)
def test_headers_without_sense(tmp_path, fields, message):
    refused(write(tmp_path / "a.mha", **fields), message)
