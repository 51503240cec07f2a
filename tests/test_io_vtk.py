"""VTK's image data, written by VTK and by hand."""

import numpy as np
import pytest

import autostereo as aus
from volume_files import MARK, ORIGIN, SHAPE, SPACING, TURN, check_phantom, load_one, phantom, refused


def write_vti(path, values, compressor=None, mode="appended", extent=None, encode=True):
    """Write by VTK, turned by TURN; `mode` is ascii, binary or appended."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import numpy_to_vtk

    image = vtk.vtkImageData()
    nz, ny, nx = values.shape
    image.SetExtent(*(extent or (0, nx - 1, 0, ny - 1, 0, nz - 1)))
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirectionMatrix(np.ravel(TURN))
    array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
    array.SetName("density")
    image.GetPointData().SetScalars(array)
    writer = vtk.vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    getattr(writer, f"SetDataModeTo{mode.title()}")()
    writer.SetEncodeAppendedData(encode)
    kind = {None: "None", "zlib": "ZLib", "lzma": "LZMA", "lz4": "LZ4"}[compressor]
    getattr(writer, f"SetCompressorTypeTo{kind}")()
    assert writer.Write() == 1
    return path


@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "float64"])
@pytest.mark.parametrize("compressor", [None, "zlib", "lzma"])
@pytest.mark.parametrize(
    ("mode", "encode"), [("ascii", True), ("binary", True), ("appended", True), ("appended", False)]
)
def test_vti(tmp_path, mode, encode, compressor, dtype):
    path = write_vti(tmp_path / "a.vti", phantom(dtype), compressor, mode, encode=encode)
    check_phantom(load_one(path), direction=TURN)


def test_vti_of_many_blocks(tmp_path):
    values = np.random.default_rng(0).integers(0, 9, (40, 50, 60)).astype(np.int16)
    for mode in ("binary", "appended"):
        assert np.array_equal(load_one(write_vti(tmp_path / "a.vti", values, "zlib", mode)).values, values)


def test_vti_whose_extent_does_not_begin_at_0(tmp_path):
    first = np.array((4, -2, 7))
    last = first + SHAPE - 1
    extent = [int(n) for pair in zip(first, last, strict=True) for n in pair]
    path = write_vti(tmp_path / "a.vti", phantom(), extent=extent)
    check_phantom(load_one(path), direction=TURN, origin=TURN @ (first * SPACING) + ORIGIN)


def test_vti_agrees_with_vtk_on_the_place_of_a_voxel(tmp_path):
    vtk = pytest.importorskip("vtk")
    path = write_vti(tmp_path / "a.vti", phantom())
    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    point = [0.0, 0.0, 0.0]
    reader.GetOutput().TransformIndexToPhysicalPoint(*MARK, point)
    volume = load_one(path)
    assert np.allclose(volume.world_from_index @ (*MARK, 1), (*point, 1), atol=1e-5)


def test_vti_that_cannot_be_read(tmp_path):
    path = write_vti(tmp_path / "a.vti", phantom(), "lz4")
    refused(path, "LZ4", error=aus.UnsupportedError)
    text = write_vti(tmp_path / "a.vti", phantom(), None, "ascii").read_text()
    for old, new, words in (
        ('type="ImageData"', 'type="PolyData"', "PolyData, expected ImageData"),
        ('Name="density"', 'Name="density" NumberOfComponents="3"', "one number a point"),
        ("<Piece ", "<Piece/><Piece ", "2 pieces"),
        ('Extent="0 8 0 6 0 4"', 'Extent="0 8 0 6"', "Extent"),
        ('Spacing="0.5 2 3"', 'Spacing="0.5 x 3"', "Spacing"),
        ("VTKFile", "Other", "first element is Other"),
        ("</VTKFile>", "", "is not XML"),
        (" 50 ", " ", "expected 315 voxels, found 314"),
    ):
        assert old in text
        path.write_text(text.replace(old, new))
        refused(path, words, error=aus.AutostereoError)


# --- legacy --------------------------------------------------------------------------------------------------------
HEAD = """# vtk DataFile Version 3.0
a title
{form}
DATASET STRUCTURED_POINTS
DIMENSIONS 9 7 5
{spacing} 0.5 2 3
ORIGIN 10 -20 30
POINT_DATA 315
SCALARS density {type}
"""


@pytest.mark.parametrize("table", ["LOOKUP_TABLE default\n", ""])
@pytest.mark.parametrize("spacing", ["SPACING", "ASPECT_RATIO"])
@pytest.mark.parametrize(
    ("kind", "dtype"),
    [("unsigned_char", ">u1"), ("short", ">i2"), ("unsigned_short 1", ">u2"), ("float", ">f4"), ("double", ">f8")],
)  # fmt: skip
def test_legacy(tmp_path, kind, dtype, spacing, table):
    path = tmp_path / "a.vtk"
    head = HEAD.format(form="BINARY", spacing=spacing, type=kind) + table
    path.write_bytes(head.encode() + phantom(dtype).tobytes() + b"\nMETADATA\n")
    check_phantom(load_one(path))
    head = HEAD.format(form="ASCII", spacing=spacing, type=kind) + table
    path.write_text(head + "\n".join(" ".join(map(str, row)) for row in phantom("int16").reshape(35, 9)) + "\n")
    check_phantom(load_one(path))
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    check_phantom(load_one(path))


def test_legacy_that_cannot_be_read(tmp_path):
    path = tmp_path / "a.vtk"
    good = HEAD.format(form="ASCII", spacing="SPACING", type="short") + "LOOKUP_TABLE default\n" + "1 " * 315
    for old, new, words in (
        ("STRUCTURED_POINTS", "POLYDATA", "POLYDATA, expected STRUCTURED_POINTS"),
        ("SCALARS", "VECTORS", "no SCALARS"),
        ("DIMENSIONS 9 7 5", "DIMENSIONS 9 7", "DIMENSIONS"),
        ("DIMENSIONS 9 7 5", "DIMENSIONS 9 0 5", "≥ 1"),
        ("DIMENSIONS 9 7 5", "DIMENSIONS 9 8 5", "expected 360 numbers, found 315"),
        ("density short", "density short 3", "one number a point"),
        ("density short", "density bit", "one number a point"),
        ("POINT_DATA", "CELL_DATA", "one number a point"),
        ("1 1 1 1", "1 1 x 1", "'x'"),
    ):
        assert old in good
        path.write_text(good.replace(old, new, 1))
        refused(path, words)
