"""Reading PLY: every kind of element, property and line ending, and what is refused."""

import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autostereo import FileError
from autostereo.io import load
from autostereo.io.ply import Ragged, read_ply
from autostereo.io.polygons import unroll_strips
from io_files import only, refused


def ply(tmp_path, header, body, kind="ascii", newline="\n"):
    lines = ["ply", f"format {kind} 1.0", *header, "end_header", ""]
    path = tmp_path / "hand.ply"
    path.write_bytes(newline.join(lines).encode() + (body if isinstance(body, bytes) else body.encode()))
    return path


VERTEX = ["element vertex 4", "property float x", "property float y", "property float z"]
FACE = ["element face 2", "property list uchar int vertex_indices"]
STRIPS = ["element tristrips 2", "property list int int vertex_indices"]
POINTS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_ply_of_any_line_ending_with_mixed_polygons(tmp_path, newline):
    body = (POINTS + "3 0 1 2\n4 0 1 2 3\n").replace("\n", newline)
    mesh = only(ply(tmp_path, VERTEX + FACE, body, newline=newline))
    np.testing.assert_array_equal(mesh.faces, [(0, 1, 2), (0, 1, 2), (0, 2, 3)])


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_with_mixed_lists_scalars_between_and_data_behind(tmp_path, order):
    header = [*VERTEX, "property uchar flag", "element face 3", "property short before"]
    header += ["property list uchar ushort vertex_index", "property double after"]
    body = b"".join(struct.pack(order + "fffB", *p, 7) for p in [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    for face in [(0, 1, 2), (0, 1, 2, 3), (1, 2, 3)]:
        body += struct.pack(f"{order}hB{len(face)}Hd", -5, len(face), *face, 0.5)
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    path = ply(tmp_path, header, body + b"behind the data", kind)
    np.testing.assert_array_equal(only(path).faces, [(0, 1, 2), (0, 1, 2), (0, 2, 3), (1, 2, 3)])
    element = read_ply(path).elements["face"]
    np.testing.assert_array_equal(element["before"], [-5] * 3)
    np.testing.assert_array_equal(element["after"], [0.5] * 3)
    assert isinstance(element["vertex_index"], Ragged) and element["vertex_index"].counts.tolist() == [3, 4, 3]


def test_ply_text_and_binary_readers_agree_on_random_elements(tmp_path):
    rng = np.random.default_rng(3)
    header = ["element thing 50", "property int a", "property list uchar float b", "property list uchar int c"]
    text, binary = "", b""
    for _ in range(50):
        b, c = rng.integers(-9, 9, rng.integers(0, 4)), rng.integers(-9, 9, rng.integers(0, 3))
        text += " ".join(map(str, [5, len(b), *b, len(c), *c])) + "\n"
        binary += struct.pack(f"<iB{len(b)}fB{len(c)}i", 5, len(b), *b, len(c), *c)
    one = read_ply(ply(tmp_path, header, text)).elements["thing"]
    two = read_ply(ply(tmp_path, header, binary, "binary_little_endian")).elements["thing"]
    for name in ("b", "c"):
        np.testing.assert_array_equal(one[name].counts, two[name].counts)
        np.testing.assert_array_equal(one[name].values, two[name].values)
    np.testing.assert_array_equal(one["a"], two["a"])


def test_ply_face_colors_make_flat_colored_faces(tmp_path):
    header = [*VERTEX, *FACE, "property uchar red", "property uchar green", "property uchar blue"]
    mesh = only(ply(tmp_path, header, POINTS + "3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n"))
    np.testing.assert_array_equal(mesh.colors[mesh.faces], [[(1, 0, 0)] * 3, [(0, 0, 1)] * 3])
    np.testing.assert_array_equal(mesh.shading_normals, [(0, 0, 1)] * 6)


def test_ply_wedge_uv_and_texture_file(tmp_path):
    Image.new("RGB", (2, 1), (10, 20, 30)).save(tmp_path / "my picture.png")
    header = ["comment TextureFile my picture.png", *VERTEX, *FACE, "property list uchar float texcoord"]
    path = ply(tmp_path, header, POINTS + "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 .5 .5 1 1 0 1\n")
    mesh = only(path)
    np.testing.assert_array_equal(mesh.uv[mesh.faces], [[(0, 0), (1, 0), (1, 1)], [(0.5, 0.5), (1, 1), (0, 1)]])
    assert len(mesh.vertices) == 5  # only the corner with two uv is split
    np.testing.assert_array_equal(mesh.texture, np.broadcast_to((10, 20, 30), (1, 2, 3)))
    (tmp_path / "my picture.png").unlink()
    with pytest.raises(FileError, match=r"hand\.ply: needs .*my picture\.png, which does not exist"):
        load(path)


STRIP_FILE = "9 0 1 3 2 -1 1 2 3 -1\n6 0 1 1 2 3 3\n"
UNROLLED = [(0, 1, 3), (1, 2, 3), (1, 2, 3), (1, 2, 3)]  # the second list: 0 1 1, 1 2 1 and 2 3 3 are no triangles


@pytest.mark.parametrize("kind", ["ascii", "binary_big_endian"])
def test_ply_strips_become_triangles_beside_the_faces(tmp_path, kind):
    def packed(text):
        return text if kind == "ascii" else np.array(text.split(), ">i4").tobytes()

    vertex = POINTS if kind == "ascii" else np.array(POINTS.split(), ">f4").tobytes()
    mesh = only(ply(tmp_path, VERTEX + STRIPS, vertex + packed(STRIP_FILE), kind))
    np.testing.assert_array_equal(mesh.faces, UNROLLED)
    np.testing.assert_array_equal(mesh.shading_normals, [(0, 0, 1)] * 4)
    face = ["element face 1", "property list int int vertex_index"]
    for faces, own in (("4 0 1 2 3\n", [(0, 1, 2), (0, 2, 3)]), ("2 0 1\n", [])):
        mesh = only(ply(tmp_path, VERTEX + face + STRIPS, vertex + packed(faces) + packed(STRIP_FILE), kind))
        np.testing.assert_array_equal(mesh.faces, own + UNROLLED)


@given(st.lists(st.lists(st.integers(-1, 5), max_size=12), max_size=5))
def test_strips_are_unrolled_as_one_would_by_hand(lists):
    wanted = []
    for entries in lists:
        strip = []
        for entry in entries:
            strip = [] if entry == -1 else [*strip, entry]
            if len(strip) > 2 and len(set(strip[-3:])) == 3:
                a, b, c = strip[-3:]
                wanted.append((a, c, b) if len(strip) % 2 == 0 else (a, b, c))
    flat = np.array([entry for entries in lists for entry in entries], np.int64)
    found = unroll_strips(np.array([len(entries) for entries in lists], np.int64), flat)
    assert found.tolist() == [list(face) for face in wanted]


def test_ply_colors_are_scaled_by_their_type(tmp_path):
    for kind, full in (("uchar", 255), ("ushort", 65535), ("float", 1)):
        header = [*VERTEX, *(f"property {kind} {c}" for c in ("red", "green", "blue")), *FACE]
        rows = "".join(f"{p} {full} 0 0\n" for p in POINTS.splitlines())
        mesh = only(ply(tmp_path, header, rows + "3 0 1 2\n3 0 2 3\n"))
        np.testing.assert_array_equal(mesh.colors, [(1, 0, 0)] * 4)


@pytest.mark.parametrize("normal", ["0 0 0", "nan 0 1"])
def test_useless_normals_in_a_file_are_computed_instead(tmp_path, normal):
    header = [*VERTEX, *(f"property float n{c}" for c in "xyz"), *FACE]
    rows = "".join(f"{p} {normal}\n" for p in POINTS.splitlines())
    mesh = only(ply(tmp_path, header, rows + "3 0 1 2\n3 0 2 3\n"))
    np.testing.assert_array_equal(mesh.shading_normals, [(0, 0, 1)] * 4)


@pytest.mark.parametrize(
    ("header", "body", "word"),
    [
        (["element vertex 4", "property float x"], "1 2 3 4", "no element 'vertex' with x, y, z"),
        (["element vertex 0", *VERTEX[1:]], "", "no vertices"),
        ([*VERTEX, "property float rot_0"], "0 0 0 1\n" * 4, "holds Gaussian splats"),
        (VERTEX + FACE, POINTS + "2 0 1\n2 1 2\n", "fewer than three corners"),
        (VERTEX + STRIPS, POINTS + "4 0 1 1 0\n3 0 1 -1\n", "fewer than three corners"),
        (VERTEX + STRIPS, POINTS + "4 0 1 2 4\n3 0 1 2\n", "faces ask for vertices 0…4, the file has 4"),
        (VERTEX + STRIPS, POINTS + "4 0 1 2 -2\n3 0 1 2\n", "faces ask for vertices -2…2"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n3 0 1 4\n", "faces ask for vertices 0…4, the file has 4"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n3 0 -1 2\n", "faces ask for vertices -1…2"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n", "truncated"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n3 0 1", "truncated"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n4 0 1 2", "truncated"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n-3 0 1 2", "list of -3 entries"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n3 0 1 2.5\n", "property 'vertex_indices' holds numbers that are not"),
        (VERTEX + FACE, POINTS + "3 0 1 2\n3 0 1 two\n", "found 'two'"),
        (VERTEX + FACE, POINTS.replace("1 1", "nan 1") + "3 0 1 2\n3 0 2 3\n", "found NaN or infinity in 1 of 4"),
        (VERTEX + FACE, POINTS.replace("1 1", "inf 1") + "3 0 1 2\n3 0 2 3\n", "found NaN or infinity in 1 of 4"),
        ([*VERTEX, "property flaot q"], POINTS, "header line 'property flaot q'"),
        (["element vertex many"], "", "header line 'element vertex many'"),
        (["element vertex -4", *VERTEX[1:]], "", "header line 'element vertex -4'"),
        (["property float x"], "", "header line 'property float x'"),
        (["element vertex 4"], POINTS, "no property"),
    ],
)
def test_bad_ply(tmp_path, header, body, word):
    refused(ply(tmp_path, header, body), word)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("what", ["vertex", "face"])
def test_absurd_counts_in_a_ply_header_cost_no_memory(tmp_path, kind, what):
    header = [line.replace(f"element {what} {n}", f"element {what} 99999999999")
              for line, n in zip(VERTEX + FACE, [4, 4, 4, 4, 2, 2], strict=True)]  # fmt: skip
    path = ply(tmp_path, header, b"1 2 3\n" * 100, kind)
    tracemalloc.start()
    refused(path, "99999999999")
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()
