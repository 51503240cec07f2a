"""Reading point clouds: PLY, OBJ, tables in text and NumPy files, and what is refused."""

import struct

import numpy as np
import pytest

from autostereo import Mesh, Volume
from io_files import only, refused
from point_files import GREY, RGB, UP, XYZ, check, table, write

# --- PLY and OBJ -----------------------------------------------------------------------------------


def ply(tmp_path, properties, body, kind="ascii", more=()):
    lines = ["ply", f"format {kind} 1.0", "element vertex 4", *(f"property {p}" for p in properties), *more]
    data = "\n".join([*lines, "end_header", ""]).encode()
    return write(tmp_path, "cloud.ply", data + (body if isinstance(body, bytes) else body.encode()))


POSITION = ["float x", "float y", "float z"]


def test_ply_without_faces_is_points_with_estimated_normals(tmp_path):
    points = only(ply(tmp_path, POSITION, table(XYZ)))
    check(points)
    np.testing.assert_array_equal(points.radii, [1] * 4)  # distances 1, 1, √2


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_with_normals_bytes_and_radius(tmp_path, order):
    names = [*POSITION, "float nx", "float ny", "float nz", "uchar red", "uchar green", "uchar blue", "float radius"]
    body = b"".join(struct.pack(order + "6f3Bf", *p, 0, 3, 4, *c, 0.25) for p, c in zip(XYZ, RGB, strict=True))
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    points = only(ply(tmp_path, names, body, kind))
    check(points, RGB / 255, [(0, 0.6, 0.8)] * 4)
    np.testing.assert_array_equal(points.radii, [0.25] * 4)


@pytest.mark.parametrize(
    ("kind", "scale"), [("float", 1 / 255), ("float", 1), ("ushort", 257), ("ushort", 1), ("int", 1)]
)
def test_ply_colors_of_any_type_and_range(tmp_path, kind, scale):
    names = [*POSITION, f"{kind} red", f"{kind} green", f"{kind} blue"]
    check(only(ply(tmp_path, names, table(XYZ, RGB * scale))), RGB / 255)


def test_ply_intensity_becomes_grey(tmp_path):
    points = only(ply(tmp_path, [*POSITION, "float scalar_Intensity"], table(XYZ, [5, 5, 9, 13])))
    assert (points.colors[:, :1] == points.colors).all() and (np.diff(points.colors[1:, 0]) > 0).all()
    np.testing.assert_allclose(points.colors[0], 0.1, rtol=1e-6)


def test_ply_normals_that_are_missing_in_places_are_estimated(tmp_path):
    names = [*POSITION, "float nx", "float ny", "float nz"]
    normals = [(0, 1, 0), (np.nan, np.nan, np.nan), (0, 0, 0), (0, 1, 0)]
    check(only(ply(tmp_path, names, table(XYZ, normals))), normals=[(0, 1, 0), UP[0], UP[0], (0, 1, 0)])
    check(only(ply(tmp_path, names, table(XYZ, np.full((4, 3), np.nan)))))


def test_ply_with_faces_is_still_a_mesh(tmp_path):
    face = ["element face 1", "property list uchar int vertex_indices"]
    assert isinstance(only(ply(tmp_path, POSITION, table(XYZ) + "3 0 1 2\n", more=face)), Mesh)
    empty = ["element face 0", "property list uchar int vertex_indices"]
    check(only(ply(tmp_path, POSITION, table(XYZ), more=empty)))


def test_bad_ply_points(tmp_path):
    refused(ply(tmp_path, [*POSITION, "float radius"], table(XYZ, [1, 0, -1, 1])), "radii:", "found 2 of 4")
    refused(ply(tmp_path, POSITION, table(XYZ * [[1], [np.nan], [1], [1]])), "positions:", "in 1 of 4")
    refused(ply(tmp_path, POSITION, table(XYZ * 0 + 5)), "radii:", "4 points that are all at one position")
    refused(ply(tmp_path, POSITION, table(XYZ)[:-4]), "truncated")
    names = [*POSITION, "float red", "float green", "float blue"]
    refused(ply(tmp_path, names, table(XYZ, RGB - 9)), "expected colours in 0…1, 0…255 or 0…65535, found -9…246")
    colors = RGB * [[1, 1, np.nan], *[[1, 1, 1]] * 3]
    refused(ply(tmp_path, names, table(XYZ, colors)), "0…65535, found NaN in 1 of 12")


# --- text -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".xyz", ".txt", ".asc", ".csv", ".pts", ".XYZ"])
@pytest.mark.parametrize("separator", [" ", "\t", ",", ";", ", ", "  "])
def test_text_of_any_separator(tmp_path, suffix, separator):
    check(only(write(tmp_path, f"a{suffix}", table(XYZ, RGB, separator=separator))), RGB / 255)


@pytest.mark.parametrize(
    ("columns", "colors", "normals"),
    [
        ((XYZ,), GREY, UP),
        ((XYZ, RGB), RGB / 255, UP),
        ((XYZ, RGB / 255), RGB / 255, UP),
        ((XYZ, UP[:, ::-1]), GREY, UP[:, ::-1]),
        ((XYZ, -UP), GREY, -UP),
        ((XYZ, UP[:, ::-1], RGB), RGB / 255, UP[:, ::-1]),
        ((XYZ, RGB, UP[:, ::-1]), RGB / 255, UP[:, ::-1]),
        ((XYZ, [-900, 3, 4, 5], RGB), RGB / 255, UP),  # intensity first
        ((XYZ, [0.5, 700, 4, 5], RGB), RGB / 255, UP),
        ((XYZ, RGB, [7, 7, 7, 7]), RGB / 255, UP),
        ((XYZ, [1, 2, 3, 4]), GREY, UP),
        ((XYZ, [1, 2, 3, 4], [-9, 900, 0, 0]), GREY, UP),
        ((XYZ, 300 + RGB), GREY, UP),  # neither: not used
    ],
)
def test_text_without_a_header(tmp_path, columns, colors, normals):
    check(only(write(tmp_path, "a.xyz", table(*columns))), colors, normals)


@pytest.mark.parametrize(
    "header",
    [
        "x y z red green blue radius",
        "# x y z r g b radius",
        "//X Y Z R G B Radius",
        "% a comment\n# X[m] Y[m] Z[m] red green blue radius",
        '"x","y","z","r","g","b","radius"',
        "\ufeffx;y;z;red;green;blue;radius",
    ],
)
def test_text_with_a_header(tmp_path, header):
    points = only(write(tmp_path, "a.csv", header + "\n" + table(XYZ, RGB, [1, 2, 3, 4])))
    check(points, RGB / 255)
    np.testing.assert_array_equal(points.radii, [1, 2, 3, 4])


def test_a_header_may_order_columns_as_it_likes(tmp_path):
    text = "b,class,Z,nx,Y,ny,X,nz,g,r\n"
    for (x, y, z), (r, g, b) in zip(XYZ, RGB, strict=True):
        text += f"{b},2,{z},0,{y},1,{x},0,{g},{r}\n"
    check(only(write(tmp_path, "a.csv", text)), RGB / 255, [(0, 1, 0)] * 4)


def test_text_in_other_dialects(tmp_path):
    check(only(write(tmp_path, "a.csv", table(XYZ + 0.5, separator=";").replace(".", ","))), positions=XYZ + 0.5)
    check(only(write(tmp_path, "a.txt", table(XYZ).replace("\n", "\r\n"))))
    check(only(write(tmp_path, "a.txt", table(XYZ).replace("\n", "\r"))))
    check(only(write(tmp_path, "a.csv", table(XYZ, separator=",").replace("\n", ",\n"))))  # a separator at the end
    check(only(write(tmp_path, "a.txt", "\n\n# by hand\n" + table(XYZ).replace("\n", "\n\n"))))
    check(only(write(tmp_path, "a.txt", table(XYZ).encode("utf-16"))))
    check(only(write(tmp_path, "a.csv", '"0","0","0"\n"1","0","0"\n"1","1","0"\n"0","1","0"\n')))


def test_pts_with_a_count_and_intensity(tmp_path):
    path = write(tmp_path, "a.pts", "4\n" + table(XYZ, [-1000, 5, 2000, 3], RGB))
    check(only(path), RGB / 255)
    refused(write(tmp_path, "b.pts", "5\n" + table(XYZ)), "the first line announces 5 points, found 4")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0 0 0\n1 0\n", "expected 3 fields in every row, found 2 in '1 0'"),
        ("0 0 0\n1 0 zero\n", "found 'zero'"),
        ("0 0\n1 0\n", "expected at least three columns (x, y, z), found 2"),
        ("x y z\n", "no rows of numbers"),
        ("# nothing\n", "no rows of numbers"),
        ("once upon a time\n1 2 3 4\n2 3 4 5\n", "expected columns x, y and z, found once, upon, a, time"),
        ("x,y,z\n1,2,3,4\n", "the header names 3 columns, the rows have 4"),
        ("0,0,0\n1,,0\n", "expected one number in every field, found '1,,0'"),
        ("0,0,0\n1,0 5,0\n", "expected one number in every field, found '1,0 5,0'"),
        ("1 2 3\n", "radii: cannot be estimated from one point"),
        ("1 2 3\n1 2 3\n", "2 points that are all at one position"),
        ("0 0 0\n1 0 0\nnan 0 0\n", "NaN or infinity in 1 of 3"),
        ("<!DOCTYPE html><html>", "web page"),
        ("version https://git-lfs.github.com/spec/v1\n", "Git LFS"),
        ("3\nwater\nO 0 0 0\nH 1 0 0\nH 0 1 0\n", "list of atoms"),
        ("\0\1\2\3", "binary data"),
        ("x y z radius\n0 0 0 1\n1 0 0 0\n", "radii: expected finite numbers > 0, found 1 of 2"),
    ],
)
def test_bad_text(tmp_path, text, words):
    refused(write(tmp_path, "a.txt", text), words)


# --- NumPy ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["f4", "f8", "i4", "u1", ">f4"])
def test_npy_of_two_axes_is_points(tmp_path, kind):
    np.save(tmp_path / "a.npy", np.concatenate([XYZ, RGB], axis=1).astype(kind))
    check(only(tmp_path / "a.npy"), RGB / 255)
    np.save(tmp_path / "b.npy", XYZ.astype(kind))
    check(only(tmp_path / "b.npy"))


def test_npy_of_three_axes_is_a_volume(tmp_path):
    values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    np.save(tmp_path / "a.npy", values)
    volume = only(tmp_path / "a.npy")
    assert isinstance(volume, Volume)
    np.testing.assert_array_equal(volume.values, values)


def test_structured_npy(tmp_path):
    rows = np.zeros(4, [("X", "f4"), ("Y", "f4"), ("Z", "f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])
    for name, column in zip(rows.dtype.names, np.concatenate([XYZ, RGB], axis=1).T, strict=True):
        rows[name] = column
    np.save(tmp_path / "a.npy", rows)
    check(only(tmp_path / "a.npy"), RGB / 255)


@pytest.mark.parametrize("key", ["positions", "points", "means3d", "xyz"])
@pytest.mark.parametrize("scale", [np.uint8(1), np.uint16(257), 1 / 255])
def test_npz_by_keys(tmp_path, key, scale):
    other = {"viewmats": np.eye(4)[None], "height": np.array(3)}
    colors = RGB.astype(np.uint8) * scale if isinstance(scale, np.integer) else RGB * scale
    fields = {key: XYZ, "Colors": colors, "normals": UP[:, ::-1], "radii": np.arange(1, 5)}
    np.savez(tmp_path / "a.npz", **fields, **other)
    points = only(tmp_path / "a.npz")
    check(points, RGB / 255, UP[:, ::-1])
    np.testing.assert_array_equal(points.radii, [1, 2, 3, 4])


def test_npz_without_keys(tmp_path):
    np.savez(tmp_path / "a.npz", XYZ)
    check(only(tmp_path / "a.npz"))
    np.savez_compressed(tmp_path / "b.npz", np.zeros((2, 3, 4), np.int16), np.ones(3))
    assert only(tmp_path / "b.npz").values.shape == (2, 3, 4)
    np.savez(tmp_path / "c.npz", a=np.ones(3), b=np.ones(4))
    refused(tmp_path / "c.npz", "expected an array positions (N, 3)", "found a (3,), b (4,)")
    np.savez(tmp_path / "d.npz", points=XYZ, colors=RGB[:3])
    refused(tmp_path / "d.npz", "colors: expected shape (4, 3), got (3, 3)")


def test_bad_npy(tmp_path):
    path = tmp_path / "a.npy"
    for array, words in (
        (np.ones(5), "found an array of shape (5,)"),
        (np.ones((4, 2)), "found an array of shape (4, 2)"),
        (np.ones((4, 11)), "found an array of shape (4, 11)"),
        (np.array([["a", "b", "c"]]), "expected numbers, found an array of <U1"),
        (np.ones((0, 3)), "positions: expected at least one point"),
        (np.ones((3, 3)), "3 points that are all at one position"),
    ):
        np.save(path, array)
        refused(path, words)
    np.save(path, np.array([{}, None, {}], dtype=object))
    refused(path, "holds Python objects")
    np.save(path, XYZ)
    refused(write(tmp_path, "b.npy", path.read_bytes()[:-3]), "damaged or truncated")
    refused(write(tmp_path, "c.npy", b"not NumPy"), "is not a NumPy file")
    np.savez(tmp_path / "d.npz", points=XYZ)
    refused(write(tmp_path, "e.npz", (tmp_path / "d.npz").read_bytes()[:-30]), "damaged or truncated")
