"""Reading OBJ files with materials and textures."""

import numpy as np
import pytest
import trimesh
from PIL import Image

from autostereo import Material
from autostereo.io import load
from autostereo.io.image import read_image
from autostereo.io.obj import _map
from io_files import DATA, needs_data, only, refused

MESHES = DATA / "meshes"

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
UV = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def obj(tmp_path, text, mtl=None):
    path = tmp_path / "a.obj"
    path.write_text(text if mtl is None else "mtllib a.mtl\n" + text)
    if mtl is not None:
        (tmp_path / "a.mtl").write_text(mtl)
    return path


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 2 3\nf 1 3 4\n",
        "f 1 2 3 4\n",
        "f -4 -3 -2 -1\n",
        "f 1/1 2/2 3/3 4/4\n",
        "f 1//1 2//1 3//1 4//1\n",
        "f 1/1/1 2/2/1 3/3/1 4/4/1\n",
        "f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1\n",
        "f\t1/  2/\t3/ 4/\n",
        "f 1// 2// 3// 4//\n",
        "  f 1 2 \\\n 3 4 # a comment\n",
        "g part\ns 1\no thing\nl 1 2\np 1\nf 1 2 3 4\r\n",
    ],
)
def test_all_ways_to_write_the_same_faces(tmp_path, faces):
    mesh = only(obj(tmp_path, "# a square\n" + SQUARE + UV + "vn 0 0 2\n" + faces))
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])[
        [(0, 1, 2), (0, 2, 3)]
    ])  # fmt: skip
    corner = faces.split()[1]
    assert (mesh.uv is not None) == (corner.count("/") > 0 and corner.split("/")[1] != "")
    assert (mesh.normals is not None) == (corner.count("/") == 2 and corner.split("/")[2] != "")
    if mesh.uv is not None:
        np.testing.assert_array_equal(mesh.uv, mesh.vertices[:, :2])
    np.testing.assert_array_equal(mesh.shading_normals, [(0, 0, 1)] * 4)


def test_negative_indices_count_from_where_they_stand(tmp_path):
    shift = "v 5 0 0\nv 6 0 0\nv 6 1 0\n"
    mesh = only(obj(tmp_path, SQUARE + "f -4 -3 -2\n" + shift + "f -3 -2 -1\nf -7 -6 -5\n"))
    np.testing.assert_array_equal(mesh.vertices[mesh.faces][:, 0, 0], [0, 5, 0])


def test_faces_of_different_form_share_no_mesh_but_all_are_kept(tmp_path):
    mixed = SQUARE + UV + "vn 0 0 1\nf 1 2 3\nf 1/1 3/3 4/4\nf 1/1/1 2/2 3\nf 1//1 2//1 3//1\n"
    meshes = load(obj(tmp_path, mixed)).objects
    assert [(m.uv is not None, len(m.faces)) for m in meshes] == [(False, 2), (True, 1), (False, 1)]
    assert all((m.shading_normals == (0, 0, 1)).all() for m in meshes)


def test_vertices_split_only_where_uv_differ_and_seams_stay_smooth(tmp_path):
    cube = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    sides = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    faces = "".join("f " + " ".join(f"{v}/{k + 1}" for k, v in enumerate(side)) + "\n" for side in sides)
    mesh = only(obj(tmp_path, cube + UV + faces))
    assert 8 < len(mesh.vertices) <= 24 and mesh.is_closed
    assert len(np.unique(np.column_stack([mesh.vertices, mesh.uv]), axis=0)) == len(mesh.vertices)
    # angle weights make the corner normal independent of the cut: (±1, ±1, ±1)/√3
    np.testing.assert_allclose(mesh.shading_normals, (2 * mesh.vertices - 1) / np.sqrt(3), atol=1e-12)


@pytest.mark.parametrize("full", [1, 255])
def test_vertex_colors(tmp_path, full):
    text = "".join(f"{line} {full} 0 {full}\n" for line in SQUARE.splitlines())
    np.testing.assert_array_equal(only(obj(tmp_path, text + "f 1 2 3 4\n")).colors, [(1, 0, 1)] * 4)
    weights = "".join(f"{line} 1.0\n" for line in SQUARE.splitlines())  # x y z w
    assert only(obj(tmp_path, weights + "f 1 2 3 4\n")).colors is None


# --- materials -------------------------------------------------------------------------------------


def test_materials_split_the_faces_and_keep_the_surface_smooth_and_closed(tmp_path):
    tetra = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    faces = ["f 1 3 2", "usemtl red", "f 1 2 4", "usemtl blue", "f 2 3 4", "usemtl red", "f 3 1 4"]
    whole = only(obj(tmp_path, tetra + "\n".join(f for f in faces if f[0] == "f")))
    mtl = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 .2\n"
    meshes = load(obj(tmp_path, tetra + "\n".join(faces), mtl)).objects
    assert [len(m.faces) for m in meshes] == [1, 2, 1]
    assert meshes[0].colors is None
    np.testing.assert_array_equal(meshes[1].colors, np.broadcast_to(np.float32((1, 0, 0)), (4, 3)))
    np.testing.assert_array_equal(meshes[2].colors, np.broadcast_to(np.float32((0, 0, 0.2)), (3, 3)))
    assert whole.is_closed and not any(m.two_sided for m in meshes)
    normal_at = {tuple(p): n for p, n in zip(whole.vertices, whole.shading_normals, strict=True)}
    for mesh in meshes:
        np.testing.assert_allclose(mesh.shading_normals, [normal_at[tuple(p)] for p in mesh.vertices], atol=1e-15)


def test_textures_with_options_blanks_and_backslashes(tmp_path):
    (tmp_path / "tex").mkdir()
    marked = np.zeros((4, 4, 3), np.uint8)
    marked[0, 0], marked[3, 0] = (255, 0, 0), (0, 0, 255)  # top left, bottom left
    Image.fromarray(marked).save(tmp_path / "tex" / "my marks.png")
    mtl = "newmtl a\nKd 0 0 0\nmap_Kd -s 2 2 -clamp on tex\\my marks.png\n"
    mtl += "newmtl b\nKd .5 1 1\nmap_kd tex/my marks.png\n"
    text = SQUARE + UV + "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n"
    a, b = load(obj(tmp_path, text, mtl)).objects
    np.testing.assert_array_equal(a.texture, marked)
    assert a.texture is b.texture and a.colors is None  # black times a texture is not meant
    np.testing.assert_array_equal(b.colors, np.broadcast_to(np.float32((0.5, 1, 1)), (3, 3)))
    # uv (0, 0), the bottom left, must meet the bottom row of the picture: the last one
    corner = a.uv[(a.vertices == 0).all(axis=1)][0]
    np.testing.assert_array_equal(corner, (0, 0))
    np.testing.assert_array_equal(a.texture[-1, 0], (0, 0, 255))


@pytest.mark.parametrize(
    ("line", "name"),
    [
        (b"a.png", b"a.png"),
        (b"my file.png ", b"my file.png"),
        (b"-blendu off -mm 0 1 a.png", b"a.png"),
        (b"-o 0.5 a.png", b"a.png"),
        (b"-bm 0.5 a.png", b"a.png"),
        (b"-mm -0.1 2 a.png", b"a.png"),
        (b"-clamp on a.png", b"a.png"),
        (b"-t 1 2 3 a.png", b"a.png"),
        (b"-t 1 a.png", b"a.png"),
        (b"-blendu on -blendv off a.png", b"a.png"),
        (b"-imfchan r a.png", b"a.png"),
        (b"-texres 512 a.png", b"a.png"),
        (b"-cc on -boost 1.5 a.png", b"a.png"),
        (b"-type sphere a.png", b"a.png"),
        (b"-o 0.5 0 0 -s 1 1 1  -bm 2 a b.png", b"a b.png"),
        (b'"quoted name.png"', b"quoted name.png"),
    ],
)
def test_file_names_behind_map_options(line, name):
    assert _map(line, "a.mtl")[0] == name


@pytest.mark.parametrize(
    ("options", "scale", "offset"),
    [
        ("", (1, 1), (0, 0)),
        ("-s 2 3 1 -o .25 .5 0", (2, 3), (0.25, 0.5)),
        ("-o .25 .5 -mm 0 1 -s 2 3", (2, 3), (0.25, 0.5)),
        ("-s 2 -bm 3 -t 5 5 5", (2, 1), (0, 0)),
        ("-O -.5 -clamp on", (1, 1), (-0.5, 0)),
    ],
)
def test_scale_and_offset_of_a_texture_move_its_coordinates(tmp_path, options, scale, offset):
    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    mtl = f"newmtl plain\nmap_Kd a.png\nnewmtl moved\nmap_Kd {options} a.png\n"
    text = SQUARE + UV + "usemtl plain\nf 1/1 2/2 3/3\nusemtl moved\nf 1/1 3/3 4/4\n"
    plain, moved = load(obj(tmp_path, text, mtl)).objects
    np.testing.assert_array_equal(plain.uv, plain.vertices[:, :2])
    np.testing.assert_array_equal(moved.uv, moved.vertices[:, :2] * scale + offset)
    assert moved.texture is plain.texture


def test_reflection_follows_the_illumination_model(tmp_path):
    names = {
        "plain": ("", Material()),
        "dull": ("Ks 1 1 1\nillum 1\n", Material()),
        "shiny": ("Ks .2 .4 .6\nNs 96\nillum 2\n", Material(specular=0.4, shininess=96)),
        "grey": ("Ks .5\nNs 1e9\n", Material(specular=0.5, shininess=1e4)),
        "unlit": ("Ks 1 1 1\nillum 0\n", Material(ambient=1, diffuse=0)),
    }
    mtl = "".join(f"newmtl {name}\n{lines}" for name, (lines, _) in names.items())
    for name, (_, material) in names.items():
        found = only(obj(tmp_path, SQUARE + f"usemtl {name}\nf 1 2 3 4\n", mtl)).material
        assert (found.ambient, found.diffuse, found.shininess) == (
            material.ambient, material.diffuse, material.shininess)  # fmt: skip
        assert found.specular == pytest.approx(material.specular)


def test_a_texture_without_coordinates_is_not_asked_for(tmp_path):
    mesh = only(obj(tmp_path, SQUARE + "usemtl a\nf 1 2 3 4\n", "newmtl a\nmap_Kd none.png\n"))
    assert mesh.texture is None


def test_missing_libraries_and_materials_warn_and_draw_white(tmp_path):
    path = obj(tmp_path, "mtllib none.mtl\n" + SQUARE + "usemtl a\nf 1 2 3 4\n")
    with pytest.warns(UserWarning, match=r"a\.obj: the material library .*none\.mtl does not exist"):
        assert only(path).colors is None
    path = obj(tmp_path, SQUARE + "usemtl b\nf 1 2 3 4\n", "newmtl a\n")
    with pytest.warns(UserWarning, match=r"a\.obj: no library defines the materials b"):
        assert only(path).colors is None
    only(obj(tmp_path, "mtllib none.mtl\n" + SQUARE + "f 1 2 3 4\n"))  # not used: nothing to say


def test_a_missing_or_damaged_texture_is_named_with_the_file_that_asks(tmp_path):
    path = obj(tmp_path, SQUARE + UV + "usemtl a\nf 1/1 2/2 3/3\n", "newmtl a\nmap_Kd wood.png\n")
    refused(path, "a.obj: needs", "wood.png, which does not exist")
    (tmp_path / "wood.png").mkdir()
    refused(path, "a.obj: needs", "wood.png, which is a folder")
    (tmp_path / "wood.png").rmdir()
    (tmp_path / "wood.png").write_text("not a picture")
    refused(path, "a.obj: texture", "wood.png: is not a picture")
    (tmp_path / "wood.png").write_bytes(b"")
    refused(path, "a.obj: needs", "wood.png, which is empty")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("nothing here\n", "is not an OBJ file"),
        (SQUARE + "vn 0 0 1\n" * 4, "has no triangles, its 4 vertices are in no face"),
        (SQUARE + "l 1 2\np 3\n", "has no triangles, its 4 vertices are in no face"),
        (SQUARE + "f 1 2\n", "fewer than three corners"),
        (SQUARE + "f 1 2 5\n", "asks for vertex 5, the file has 4"),
        (SQUARE + "f 0 1 2\n", "vertex 0"),
        (SQUARE + "f -1 -2 -5\n", "negative"),
        (SQUARE + "f 1/1 2/1 3/1\n", "texture coordinate 1, the file has 0"),
        (SQUARE + UV + "f 1/1/1 2/2/1 3/3/1\n", "normal 1, the file has 0"),
        (SQUARE + "f 1/2/3/4 1 1\n", "expected face corners of the form"),
        (SQUARE + "f / 1 2\n", "expected face corners of the form"),
        (SQUARE + "f 1 2 x\n", "expected numbers for face indices, found 'x'"),
        (SQUARE + "f 1 2 2.5\n", "expected whole numbers for face indices"),
        (SQUARE + "v 1 2\nf 1 2 3\n", "expected 3 numbers or more for vertices (v), found 2"),
        (SQUARE + "v 1 2 NaN\nf 1 2 3\nf 1 2 5\n", "found NaN or infinity in 1 of 4"),
        (SQUARE + "v 1 2 z\nf 1 2 3\n", "expected numbers for vertices (v), found 'z'"),
    ],
)
def test_bad_obj(tmp_path, text, word):
    refused(obj(tmp_path, text), word)


def test_a_byte_order_mark_hides_neither_the_library_nor_its_first_material(tmp_path):
    path = obj(tmp_path, SQUARE + "usemtl a\nf 1 2 3 4\n", "newmtl a\nKd 1 0 0\n")
    for file in (path, tmp_path / "a.mtl"):
        file.write_text(file.read_text(), encoding="utf-8-sig")
    np.testing.assert_array_equal(only(path).colors, [(1, 0, 0)] * 4)


def test_bad_mtl(tmp_path):
    text = SQUARE + "usemtl a\nf 1 2 3 4\n"
    refused(obj(tmp_path, text, "newmtl a\nKd red\n"), "a.mtl: expected numbers for Kd, found 'red'")
    for far in ("inf", "1e300"):
        refused(obj(tmp_path, text, f"newmtl a\nmap_Kd -s 1 {far} a.png\n"), "a.mtl: expected numbers within ±1e+06")
    refused(obj(tmp_path, text, "newmtl a\nKd nan 0 0\n"), "a.mtl: expected finite numbers for Kd")
    refused(obj(tmp_path, text, "\x89PNG\r\n\x1a\n\x00\x00"), "a.mtl: is not a library of materials (MTL)")


def test_an_empty_library_is_one_without_materials(tmp_path):
    """Exporters write a header of comments where there are none."""
    path = obj(tmp_path, SQUARE + "usemtl a\nf 1 2 3 4\n", "# Blender MTL File\n\n# Material Count: 0\n")
    with pytest.warns(UserWarning, match="no library defines the materials a"):
        assert only(path).colors is None


# --- real files ---------------------------------------------------------------------------------------


@needs_data
@pytest.mark.parametrize(
    ("name", "vertices", "triangles"),
    [
        ("teapot.obj", 3_644, 6_320),
        ("suzanne.obj", 507, 968),
        ("cow.obj", 2_903, 5_804),
        ("spot/spot.obj", 3_225, 5_856),
    ],
)
def test_real_meshes_have_the_counts_of_their_readme(name, vertices, triangles):
    mesh = only(MESHES / name)
    assert (len(mesh.vertices), len(mesh.faces)) == (vertices, triangles)
    oracle = trimesh.load(MESHES / name, process=False, maintain_order=True)
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).area == pytest.approx(oracle.area, rel=1e-6)


@needs_data
def test_the_arena_has_all_its_materials_and_textures():
    path = MESHES / "cyanide" / "cyanide.obj"
    meshes = load(path).objects
    assert len(meshes) == 62 and sum(len(m.faces) for m in meshes) == 34_876
    assert all(m.texture is not None for m in meshes) and len({id(m.texture) for m in meshes}) == 18
    assert min(m.uv.min() for m in meshes) == -4096 and max(m.uv.max() for m in meshes) == 4097
    # every material wears the picture that the MTL names, in the order in which the OBJ first uses them
    picture, name = {}, ""
    for word, _, rest in (line.partition(" ") for line in path.with_suffix(".mtl").read_text().splitlines()):
        if word == "newmtl":
            name = rest
        elif word == "map_Kd":
            picture[name] = path.parent / rest
    used, faces = {}, 0
    for word, _, rest in (line.partition(" ") for line in path.read_text().splitlines()):
        if word == "usemtl":
            name = rest
        elif word == "f":
            used[name] = used.get(name, 0) + 1
            faces += 1
    assert [len(m.faces) for m in meshes] == list(used.values())
    for mesh, name in zip(meshes, used, strict=True):
        np.testing.assert_array_equal(mesh.texture, read_image(picture[name])[..., :3])
