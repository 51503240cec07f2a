"""Reading point clouds of sensors: PCD and LAS files, and real scans."""

import struct
import sys

import numpy as np
import pytest

from autostereo import DependencyError, Points
from autostereo.io import load
from autostereo.io.pcd import unpack_lzf
from io_files import DATA, needs_data, only, refused
from point_files import GREY, RGB, UP, XYZ, check, write

# --- PCD ------------------------------------------------------------------------------------------

PCD = "# .PCD v0.7\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {}\nHEIGHT {}\nPOINTS {}\nDATA {}\n"
PACKED = [(r << 16) + (g << 8) + b for r, g, b in RGB.tolist()]


def pcd_header(fields, sizes, kinds, data, counts=None, height=1, points=4):
    n = len(fields.split())
    return PCD.format(fields, sizes, kinds, counts or " ".join("1" * n), 4 // height, height, points, data).encode()


def lzf_literals(raw):
    """LZF that only holds literals."""
    return b"".join(bytes([len(raw[k : k + 32]) - 1]) + raw[k : k + 32] for k in range(0, len(raw), 32))


def test_ascii_pcd_with_packed_colors_and_normals(tmp_path):
    floats = np.array(PACKED, np.uint32).view(np.float32)
    rows = [f"{p[0]:g} {p[1]:g} {p[2]:g} 0 1 0 {c!r}" for p, c in zip(XYZ, floats.tolist(), strict=True)]
    header = pcd_header("x y z normal_x normal_y normal_z rgb", "4 4 4 4 4 4 4", "F F F F F F F", "ascii")
    check(only(write(tmp_path, "a.pcd", header + "\n".join(rows).encode())), RGB / 255, [(0, 1, 0)] * 4)
    rows = [f"{p[0]:g} {p[1]:g} {p[2]:g} {c}" for p, c in zip(XYZ, PACKED, strict=True)]
    header = pcd_header("x y z rgba", "8 8 8 4", "F F F U", "ascii")
    check(only(write(tmp_path, "b.pcd", header + "\n".join(rows).encode())), RGB / 255)


def test_binary_pcd_with_padding_and_histograms(tmp_path):
    body = b"".join(
        struct.pack("<fff4sI3fH", *p, b"\xff" * 4, c, 7, 8, 9, 5) for p, c in zip(XYZ, PACKED, strict=True)
    )
    header = pcd_header("x y z _ rgba histogram ring", "4 4 4 1 4 4 2", "F F F U U F U", "binary", "1 1 1 4 1 3 1")
    check(only(write(tmp_path, "a.pcd", header + body)), RGB / 255)
    refused(write(tmp_path, "b.pcd", header + body[:-1]), "the PCD header announces 4 points, found 3")


def test_compressed_pcd(tmp_path):
    raw = XYZ.T.astype("<f4").tobytes() + np.array(PACKED, "<u4").tobytes()
    packed = lzf_literals(raw)
    header = pcd_header("x y z rgb", "4 4 4 4", "F F F F", "binary_compressed")
    whole = header + struct.pack("<II", len(packed), len(raw)) + packed
    check(only(write(tmp_path, "a.pcd", whole)), RGB / 255)
    refused(write(tmp_path, "b.pcd", whole[:-1]), "truncated")
    refused(write(tmp_path, "c.pcd", header), "truncated")
    refused(write(tmp_path, "d.pcd", header + struct.pack("<II", len(packed), 60) + packed), "announces 64 bytes")
    refused(write(tmp_path, "e.pcd", header + struct.pack("<II", 9, 64) + packed[:9]), "compressed points are damaged")


@pytest.mark.parametrize(
    ("data", "unpacked"),
    [
        (b"\x02abc", b"abc"),
        (b"\x02abc\x20\x02", b"abcabc"),  # length 3, back 3
        (b"\x00a\x60\x00", b"aaaaaa"),  # length 5, back 1: it reads what it writes
        (b"\x01ab\xe0\x03\x01", b"ab" + b"ab" * 6),  # length 7 + 3 + 2
        (b"\x1f" + bytes(range(32)) + b"\x20\x1f", bytes(range(32)) + b"\0\1\2"),
    ],
)
def test_lzf(data, unpacked):
    assert unpack_lzf(data, len(unpacked)) == unpacked
    assert unpack_lzf(data, len(unpacked) + 1) is None
    assert unpack_lzf(data[:-1], len(unpacked)) is None


def test_lzf_reaches_far_back():
    raw = bytes(np.random.default_rng(2).integers(0, 256, 8192, np.uint8))
    assert unpack_lzf(lzf_literals(raw) + b"\x3f\xff", 8195) == raw + raw[:3]
    assert unpack_lzf(lzf_literals(raw[:-1]) + b"\x3f\xff", 8194) is None  # before the beginning


def test_nan_in_an_organised_pcd_is_left_out_and_refused_elsewhere(tmp_path):
    rows = b"0 0 0\nnan nan nan\n1 1 0\n0 1 0\n"
    organised = pcd_header("x y z", "4 4 4", "F F F", "ascii", height=2)
    check(only(write(tmp_path, "a.pcd", organised + rows)), GREY[1:], UP[1:], XYZ[[0, 2, 3]])
    flat = pcd_header("x y z", "4 4 4", "F F F", "ascii")
    refused(write(tmp_path, "b.pcd", flat + rows), "positions:", "NaN or infinity in 1 of 4")
    refused(write(tmp_path, "c.pcd", organised + b"nan nan nan\n" * 4), "none of its 4 points has a position")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"no header", "is not a PCD file"),
        (pcd_header("x y z", "4 4", "F F F", "ascii"), "header is not understood"),
        (pcd_header("x y z", "4 4 3", "F F F", "ascii"), "header is not understood"),
        (pcd_header("x y z", "4 4 4", "F F Q", "ascii"), "header is not understood"),
        (pcd_header("x y z", "4 4 4", "F F F", "ascii", points=0), "no points"),
        (pcd_header("x y z", "4 4 4", "F F F", "zipped"), "found 'zipped'"),
        (pcd_header("x y z", "4 4 4", "F F F", "ascii") + b"0 0 0\n1 0 0", "announces 4 points, found 2"),
        (pcd_header("x y q", "4 4 4", "F F F", "ascii") + b"0 0 0\n" * 4, "expected columns x, y and z, found x, y, q"),
        (pcd_header("x y z", "4 4 4", "F F F", "ascii") + b"0 0 0\n" * 3 + b"0 0 o", "found 'o'"),
        (pcd_header("x y z", "4 4 4", "F F F", "ascii") + b"0 0 0\n" * 4, "4 points that are all at one position"),
    ],
)
def test_bad_pcd(tmp_path, data, words):
    refused(write(tmp_path, "a.pcd", data), words)


# --- LAS ------------------------------------------------------------------------------------------

FAR = XYZ * 0.25 + (636000.5, 849000.25, 400.0)


def las(tmp_path, name="a.las", colors=RGB, point_format=3, **fields):
    laspy = pytest.importorskip("laspy", reason="laspy is not installed")
    if name.endswith("z"):
        pytest.importorskip("lazrs", reason="lazrs is not installed")
    header = laspy.LasHeader(point_format=point_format, version="1.4" if point_format > 5 else "1.2")
    header.offsets, header.scales = (636000, 849000, 0), (0.25, 0.25, 0.25)
    scan = laspy.LasData(header)
    scan.x, scan.y, scan.z = FAR.T
    if colors is not None:
        scan.red, scan.green, scan.blue = np.asarray(colors, np.uint16).T
    for field, values in fields.items():
        scan[field] = np.array(values)
    scan.write(str(tmp_path / name))
    return tmp_path / name


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@pytest.mark.parametrize("scale", [1, 257])
@pytest.mark.parametrize("point_format", [3, 7])
def test_las_in_full_precision_with_colors_of_either_range(tmp_path, name, scale, point_format):
    path = las(tmp_path, name, RGB * scale, point_format)
    check(only(path), RGB / 255, positions=FAR)


def test_las_without_colors_shows_the_intensity(tmp_path):
    for colors, point_format in ((None, 1), (RGB * 0, 3)):
        points = only(las(tmp_path, colors=colors, point_format=point_format, intensity=[1, 100, 200, 900]))
        assert (np.diff(points.colors[:, 0]) > 0).all() and (points.colors == points.colors[:, :1]).all()
    check(only(las(tmp_path, colors=None, point_format=1)), positions=FAR)


def test_withheld_las_points_are_left_out(tmp_path):
    path = las(tmp_path, withheld=[0, 1, 0, 0])
    check(only(path), (RGB / 255)[[0, 2, 3]], UP[1:], FAR[[0, 2, 3]])
    refused(las(tmp_path, withheld=[1] * 4), "has no points")


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_bad_las(tmp_path, name):
    whole = las(tmp_path, name).read_bytes()
    for end in (len(whole) - 1, len(whole) - 40, 300, 120, 20):
        refused(write(tmp_path, f"b{name}", whole[:end]), "truncated")
    refused(write(tmp_path, f"c{name}", b"nothing"), "is not a LAS or LAZ file")


@pytest.mark.parametrize(
    ("name", "at", "value", "words"),
    [
        ("a.las", 100, 2**31, "variable length records do not fit"),
        ("a.las", 107, 2**31, "cannot hold the 2147483648 points that are announced"),
        ("a.laz", 107, 2**31, "cannot hold the 2147483648 points that are announced"),
        ("a.laz", 96, 2**31, "truncated"),
    ],
)
def test_las_headers_that_announce_too_much(tmp_path, name, at, value, words):
    data = bytearray(las(tmp_path, name).read_bytes())
    struct.pack_into("<I", data, at, value)
    refused(write(tmp_path, f"b{name}", bytes(data)), words)


def test_las_of_a_format_that_does_not_exist(tmp_path):
    path = las(tmp_path)
    data = bytearray(path.read_bytes())
    data[104] = 16
    path.write_bytes(data)
    refused(path, "has points of format 16, expected 0 to 10")


def test_laz_with_a_damaged_table_of_chunks(tmp_path):
    data = bytearray(las(tmp_path, "a.laz").read_bytes())
    start = struct.unpack_from("<I", data, 96)[0]
    table = struct.unpack_from("<q", data, start)[0]
    struct.pack_into("<I", data, table + 4, 2**31)
    refused(write(tmp_path, "b.laz", bytes(data)), "table of its compressed points is missing")
    struct.pack_into("<q", data, start, 10**9)
    refused(write(tmp_path, "c.laz", bytes(data)), "table of its compressed points is missing")


def test_las_without_laspy_names_the_extra(tmp_path, monkeypatch):
    path = las(tmp_path)
    monkeypatch.setitem(sys.modules, "laspy", None)
    with pytest.raises(DependencyError, match=r"pip install autostereo\[las\]"):
        load(path)


# --- files of the field ------------------------------------------------------------------------------


@needs_data
def test_real_text_and_ply():
    for name, count in (("kitten.xyz", 5210), ("ball.ply", 31374)):
        points = only(DATA / "points" / name)
        assert len(points) == count
        estimated = Points(points.positions).with_normals().normals
        assert np.median(np.abs((estimated * points.normals).sum(axis=1))) > 0.98


@needs_data
def test_real_depth_picture():
    points = only(DATA / "points" / "region_growing_rgb_tutorial.pcd")
    assert len(points) == 259847  # those of 640 × 480 that are not NaN
    assert points.colors.max() == 1 and points.colors.std() > 0.1


@needs_data
def test_real_photogrammetry():
    points = only(DATA / "points" / "test_garden.npz")
    assert len(points) == 138766
    with np.load(DATA / "points" / "test_garden.npz") as file:
        np.testing.assert_array_equal(points.colors, np.float32(file["colors"] / 255.0))


@needs_data
def test_real_airborne_scan():
    pytest.importorskip("lazrs", reason="lazrs is not installed")
    points = only(DATA / "points" / "autzen_trim.laz")
    assert len(points) == 110000 and points.colors.max() == np.float32(236 / 255)
    hundredths = points.positions * 100  # the file counts in 0.01 feet
    np.testing.assert_allclose(hundredths, np.round(hundredths), atol=1e-5)
