"""Reading files: round trips, STL and OFF, real files, and what `load` refuses."""

import base64
import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo import AutostereoError, InputError, Points
from autostereo.io import LOADERS, load
from autostereo.scene import shapes
from io_files import DATA, needs_data, only, refused

TETRA = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.5)])
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def corners(mesh):
    """Triangle corners (F, 3, 3) in world space: what is left when the order of vertices does not matter."""
    points = mesh.vertices @ mesh.transform[:3, :3].T + mesh.transform[:3, 3]
    return points[mesh.faces]


def sample(tmp_path, name):
    """A small valid file of some kind, written by trimesh."""
    path = tmp_path / name
    source = trimesh.Trimesh(TETRA, FACES, process=False)
    options = {"a.stl": {"file_type": "stl_ascii"}, "a.ply": {"encoding": "ascii"}}.get(name, {})
    source.export(path, **options)
    return path


# --- round trips through trimesh's writers --------------------------------------------------------


@pytest.mark.parametrize(
    ("suffix", "options"),
    [
        (".ply", {"encoding": "ascii"}),
        (".ply", {"encoding": "binary"}),
        (".stl", {"file_type": "stl"}),
        (".stl", {"file_type": "stl_ascii"}),
        (".off", {}),
        (".obj", {}),
        (".glb", {}),
    ],
)
def test_what_trimesh_writes_comes_back(tmp_path, suffix, options):
    path = tmp_path / f"mesh{suffix}"
    wanted = shapes.icosphere(2)
    trimesh.Trimesh(wanted.vertices, wanted.faces, process=False).export(path, **options)
    mesh = only(path)
    np.testing.assert_allclose(corners(mesh), corners(wanted), atol=1e-6)
    assert mesh.normals is None and mesh.colors is None and mesh.texture is None
    assert len(mesh.vertices) == len(wanted.vertices)  # shared vertices stay, or become, shared
    assert mesh.is_closed


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply_keeps_normals_colors_and_uv(tmp_path, encoding):
    colors = np.array([(255, 0, 0, 255), (0, 128, 0, 255), (0, 0, 51, 255), (1, 2, 3, 255)], np.uint8)
    normals = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0.6, 0.8)])
    source = trimesh.Trimesh(TETRA, FACES, vertex_normals=normals, vertex_colors=colors, process=False)
    source.vertex_attributes = {"s": np.array([0.0, 0.25, 0.5, 1.0]), "t": np.array([1.0, 0.0, 0.5, 0.75])}
    source.export(tmp_path / "a.ply", encoding=encoding, vertex_normal=True)
    mesh = only(tmp_path / "a.ply")
    np.testing.assert_array_equal(mesh.vertices, TETRA)
    np.testing.assert_array_equal(mesh.faces, FACES)
    np.testing.assert_allclose(mesh.normals, normals, atol=1e-7)
    np.testing.assert_array_equal(mesh.colors, (colors[:, :3] / 255).astype(np.float32))
    np.testing.assert_array_equal(mesh.uv, [(0, 1), (0.25, 0), (0.5, 0.5), (1, 0.75)])


# --- STL and OFF --------------------------------------------------------------------------------------


def test_stl_of_equal_corners_becomes_a_smooth_closed_mesh(tmp_path):
    record = np.zeros(4, np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
    record["v"] = TETRA[FACES]
    path = tmp_path / "a.stl"
    path.write_bytes(b"solid is no sign of text".ljust(80) + struct.pack("<I", 4) + record.tobytes())
    mesh = only(path)
    assert len(mesh.vertices) == 4 and mesh.is_closed and mesh.normals is None
    np.testing.assert_array_equal(corners(mesh), TETRA[FACES])


def test_off_with_normals_colors_uv_comments_and_polygons(tmp_path):
    path = tmp_path / "a.off"
    path.write_text(
        "STCNOFF # everything\n\n4 2 0\n"
        "0 0 0  0 0 1  255 0 0  0 0\n1 0 0  0 0 1  0 255 0  1 0 # one\n1 1 0  0 0 1  0 0 255  1 1\n"
        "0 1 0  0 0 1  51 51 51  0 1\n4 0 1 2 3  0.5 0.5 0.5\n3 0 1 2\n"
    )
    mesh = only(path)
    np.testing.assert_array_equal(mesh.faces, [(0, 1, 2), (0, 2, 3), (0, 1, 2)])
    np.testing.assert_array_equal(mesh.normals, [(0, 0, 1)] * 4)
    np.testing.assert_array_equal(mesh.uv, [(0, 0), (1, 0), (1, 1), (0, 1)])
    np.testing.assert_allclose(mesh.colors, [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.2, 0.2, 0.2)])
    path.write_text("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")  # counts on the first line
    assert len(only(path).faces) == 1


# --- texts --------------------------------------------------------------------------------------------

THREE = "0 0 0\n1 0 0\n0 1 0\n"
GLTF = {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36}]}  # fmt: skip


def gltf(uri):
    """A triangle whose buffer is at `uri`."""
    return json.dumps(GLTF | {"buffers": [{"byteLength": 36, "uri": uri}]})


INLINE = "data:;base64," + base64.b64encode(np.array(THREE.split(), "<f4").tobytes()).decode()
TEXTS = {
    "a.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "a.ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    f"element face 1\nproperty list uchar int vertex_index\nend_header\n{THREE}3 0 1 2\n",
    "a.off": f"OFF\n3 1 0\n{THREE}3 0 1 2\n",
    "a.stl": "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid\n",
    "a.gltf": gltf(INLINE),
    "a.xyz": THREE,
    "a.csv": "x,y,z\n0,0,0\n1,0,0\n0,1,0\n",
    "a.pcd": f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 3\nHEIGHT 1\nDATA ascii\n{THREE}",
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_byte_order_mark_is_read_over(tmp_path, name):
    (tmp_path / name).write_text(TEXTS[name], encoding="utf-8-sig")
    thing = only(tmp_path / name)
    points = thing.positions if isinstance(thing, Points) else thing.vertices[thing.faces[0]]
    np.testing.assert_array_equal(points, np.array(THREE.split(), float).reshape(3, 3))


@pytest.mark.parametrize("uri", ["http://x.y/z.bin", "https://x.y/a%20b.png?c=d", "HTTP://x.y/z", "ftp://x.y/z"])
def test_gltf_does_not_read_from_the_network(tmp_path, uri):
    (tmp_path / "a.gltf").write_text(gltf(uri))
    refused(tmp_path / "a.gltf", f"a.gltf: needs '{uri}', expected a file beside it: uris of the network are not read")
    tree = json.loads(gltf(INLINE)) | {"images": [{"uri": uri}], "textures": [{"source": 0}]}
    tree["accessors"].append(tree["accessors"][0] | {"type": "VEC2"})
    tree["meshes"][0]["primitives"][0] |= {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}
    tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    refused(tmp_path / "a.gltf", f"a.gltf: needs '{uri}', expected a file beside it: uris of the network are not read")


# --- real files ----------------------------------------------------------------------------------------


@needs_data
@pytest.mark.parametrize(
    ("name", "vertices", "triangles", "closed"),
    [
        ("bun_zipper.ply", 35_947, 69_451, False),
        ("bunny_low.off", 3_485, 6_966, True),
        ("dragon.ply", 50_002, 100_000, False),
        ("lucy.ply", 49_987, 99_970, True),
        ("turbineblade.ply", 99_519, 199_034, True),
    ],
)
def test_real_meshes_have_the_counts_of_their_readme(name, vertices, triangles, closed):
    mesh = only(DATA / "meshes" / name)
    assert (len(mesh.vertices), len(mesh.faces), mesh.is_closed) == (vertices, triangles, closed)
    oracle = trimesh.load(DATA / "meshes" / name, process=False)
    np.testing.assert_array_equal(mesh.faces, oracle.faces)
    np.testing.assert_allclose(mesh.vertices, oracle.vertices, rtol=1e-7)
    assert (mesh.normals is not None) == (name == "dragon.ply")


# --- load ------------------------------------------------------------------------------------------------


def test_several_files_merge_into_one_scene(tmp_path):
    a, b = sample(tmp_path, "a.ply"), tmp_path / "b.off"
    b.write_text("OFF\n3 1 0\n0 0 5\n1 0 5\n0 1 5\n3 0 1 2\n")
    scene = aus.load(a, str(b))
    assert [len(mesh.faces) for mesh in scene.objects] == [4, 1] and scene.lights is None
    np.testing.assert_array_equal(scene.bounds, [(0, 0, 0), (1, 1, 5)])


def test_importing_and_loading_needs_neither_trimesh_nor_pillow(tmp_path):
    path = sample(tmp_path, "a.ply")
    heavy = {"trimesh", "PIL", "scipy", "numba"}
    code = f"import sys, autostereo.io as io; io.load({str(path)!r}); print(sorted({heavy!r} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_load_wants_paths():
    with pytest.raises(InputError, match="at least one path"):
        load()
    with pytest.raises(InputError, match="expected a path, got an empty text"):
        load("")
    with pytest.raises(InputError, match="expected a path, got int"):
        load(5)


def test_missing_folder_unknown_and_empty(tmp_path):
    refused(tmp_path / "none.ply", "no such file")
    refused(tmp_path / "none.xyz", "no such file")
    refused(tmp_path, "is a folder")
    (tmp_path / "folder.ply").mkdir()
    refused(tmp_path / "folder.ply", "is a folder")
    (tmp_path / "a.doc").write_text("x")
    refused(tmp_path / "a.doc", "unknown kind of file '.doc'", ".ply .obj .stl .off .glb .gltf")
    refused(tmp_path / "a.doc" / "b.ply", "b.ply")
    for suffix in LOADERS:
        path = tmp_path / f"empty{suffix}"
        path.touch()
        refused(path, "is empty")
        path.write_text("\n  \n")
        refused(path)


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    def forbidden(self):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "read_bytes", forbidden)  # root may read everything, so chmod would not do
    refused(tmp_path / "a.ply", "no permission to read it")


@pytest.mark.parametrize("suffix", LOADERS)
def test_other_contents_than_the_name_says(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_text("<!DOCTYPE html>\n<html><body>404</body></html>")
    refused(path, "web page")
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 12\n")
    refused(path, "Git LFS")
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    refused(path)
    path.write_text("hello world\n")
    refused(path)


def test_absurd_counts_in_stl_and_off(tmp_path):
    (tmp_path / "a.stl").write_bytes(bytes(80) + b"\xff\xff\xff\xff" + bytes(100))
    refused(tmp_path / "a.stl", "4294967295 triangles need 214748364834 bytes, found 184")
    (tmp_path / "a.off").write_text("OFF\n99999999999 1 0\n0 0 0\n")
    refused(tmp_path / "a.off", "99999999999 vertices")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("OFF\n", "counts"),
        ("OFF BINARY\n3 1 0\n", "binary OFF"),
        ("OFF\n3\n", "counts"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n", "truncated"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", "shorter"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "faces ask for vertices 0…3"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 x\n3 0 1 2\n", "found 'x'"),
        ("OFF\n3 1 0\n0 0\n1 0\n0 1\n3 0 1 2\n", "three numbers for every vertex, found 2"),
        ("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no triangles"),
        ("NOFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "expected 6 numbers"),
    ],
)
def test_bad_off(tmp_path, text, word):
    (tmp_path / "a.off").write_text(text)
    refused(tmp_path / "a.off", word)


@pytest.mark.parametrize("name", ["b.ply", "b.stl", "b.glb"])
def test_a_binary_file_cut_anywhere_is_an_error(tmp_path, name):
    path = sample(tmp_path, name)
    data = path.read_bytes()
    for size in range(len(data)):
        path.write_bytes(data[:size])
        refused(path)


@pytest.mark.parametrize("name", ["a.ply", "a.stl", "b.off"])
def test_a_text_file_cut_by_lines_is_an_error(tmp_path, name):
    path = sample(tmp_path, name)
    lines = path.read_bytes().strip().splitlines(keepends=True)
    for size in range(len(lines)):
        path.write_bytes(b"".join(lines[:size]))
        refused(path)


@pytest.mark.filterwarnings("ignore:.*material")
@pytest.mark.parametrize("name", ["a.ply", "b.ply", "a.stl", "b.stl", "b.off", "b.obj", "b.glb"])
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=6))
def test_damaged_files_raise_nothing_but_our_errors(tmp_path, name, changes):
    path = tmp_path / name if (tmp_path / name).exists() else sample(tmp_path, name)
    original = path.read_bytes()
    data = bytearray(original)
    for at, byte in changes:
        data[at % len(data)] = byte
    path.write_bytes(data)
    try:
        load(path)
    except AutostereoError as error:
        assert str(path) in str(error)
    finally:
        path.write_bytes(original)
