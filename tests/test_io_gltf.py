"""Reading glTF 2.0, as .gltf and as .glb."""

import base64
import copy
import io
import json
import re
import struct

import numpy as np
import pytest
import trimesh
from PIL import Image

from autostereo import AutostereoError
from autostereo.io import load
from autostereo.io.gltf import srgb_from_linear
from autostereo.transforms import apply, rotation, scaling, translation
from io_files import DATA, needs_data, only, refused

MESHES = DATA / "meshes"
POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
UV = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)  # glTF counts v from the top
MARKED = np.zeros((4, 4, 3), np.uint8)
MARKED[0, 0], MARKED[3, 0], MARKED[0, 3] = (255, 0, 0), (0, 0, 255), (0, 255, 0)

_COMPONENT = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_KIND = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class Builder:
    """Collects a glTF tree and its one buffer."""

    def __init__(self):
        self.data = b""
        self.tree = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "scene": 0,
                     "bufferViews": [], "accessors": [], "meshes": [{"primitives": []}]}  # fmt: skip

    def view(self, data, **extra):
        self.data += bytes(-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **extra}
        self.tree["bufferViews"].append(entry)
        self.data += data
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, array, **extra):
        array = np.asarray(array)
        columns = 1 if array.ndim == 1 else array.shape[1]
        entry = {"bufferView": self.view(array.tobytes()), "componentType": _COMPONENT[array.dtype.str[1:]],
                 "count": len(array), "type": _KIND[columns], **extra}  # fmt: skip
        self.tree["accessors"].append(entry)
        return len(self.tree["accessors"]) - 1

    def picture(self, pixels):
        file = io.BytesIO()
        Image.fromarray(pixels).save(file, "png")
        self.tree.setdefault("images", []).append({"bufferView": self.view(file.getvalue()), "mimeType": "image/png"})
        self.tree.setdefault("textures", []).append({"source": len(self.tree["images"]) - 1})
        return len(self.tree["textures"]) - 1

    def primitive(self, indices=(0, 1, 2, 0, 2, 3), mode=None, material=None, **attributes):
        attributes = {"POSITION": POINTS} | attributes
        entry = {"attributes": {k: v if isinstance(v, int) else self.accessor(v) for k, v in attributes.items()}}
        if indices is not None:
            entry["indices"] = self.accessor(np.array(indices, np.uint16))
        if mode is not None:
            entry["mode"] = mode
        if material is not None:
            self.tree.setdefault("materials", []).append(material)
            entry["material"] = len(self.tree["materials"]) - 1
        self.tree["meshes"][0]["primitives"].append(entry)
        return self

    def glb(self, tmp_path):
        tree = self.tree | {"buffers": [{"byteLength": len(self.data)}]}
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        body = self.data + bytes(-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
        path = tmp_path / "a.glb"
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path

    def gltf(self, tmp_path, uri):
        path = tmp_path / "a.gltf"
        path.write_text(json.dumps(self.tree | {"buffers": [{"byteLength": len(self.data), "uri": uri}]}))
        return path


# --- geometry ----------------------------------------------------------------------------------------


def test_glb_gltf_with_a_file_and_gltf_with_data_agree(tmp_path):
    b = Builder().primitive(NORMAL=np.broadcast_to(np.float32((0, 0, 1)), (4, 3)).copy(), TEXCOORD_0=UV)
    (tmp_path / "my data.bin").write_bytes(b.data)
    inline = "data:application/octet-stream;base64," + base64.b64encode(b.data).decode()
    paths = [lambda: b.glb(tmp_path), lambda: b.gltf(tmp_path, "my%20data.bin"), lambda: b.gltf(tmp_path, inline)]
    for path in paths:
        mesh = only(path())
        np.testing.assert_array_equal(mesh.vertices, POINTS)
        np.testing.assert_array_equal(mesh.faces, [(0, 1, 2), (0, 2, 3)])
        np.testing.assert_array_equal(mesh.normals, [(0, 0, 1)] * 4)
        np.testing.assert_array_equal(mesh.uv, POINTS[:, :2])  # v turned: (0, 0) is the bottom left
        assert mesh.colors is None and mesh.texture is None


@pytest.mark.parametrize(
    ("mode", "indices", "faces"),
    [
        (None, None, [(0, 1, 2)]),  # four vertices: the last is left over
        (4, (0, 1, 2, 0, 2, 3, 1), [(0, 1, 2), (0, 2, 3)]),
        (5, (0, 1, 3, 2), [(0, 1, 3), (1, 2, 3)]),
        (6, (0, 1, 2, 3), [(1, 2, 0), (2, 3, 0)]),
    ],
)
def test_lists_strips_and_fans(tmp_path, mode, indices, faces):
    mesh = only(Builder().primitive(indices, mode).glb(tmp_path))
    np.testing.assert_array_equal(mesh.faces, faces)
    np.testing.assert_array_equal(mesh.shading_normals[mesh.faces], np.broadcast_to((0, 0, 1), (len(faces), 3, 3)))


def test_interleaved_sparse_and_quantised_numbers(tmp_path):
    b = Builder()
    rows = np.zeros(4, np.dtype([("p", "<i2", 3), ("pad", "<u2"), ("uv", "<u2", 2)]))
    rows["p"], rows["uv"] = POINTS * 100, UV * 65535
    view = b.view(rows.tobytes(), byteStride=12)
    position = {"bufferView": view, "componentType": 5122, "count": 4, "type": "VEC3"}
    uv = {"bufferView": view, "byteOffset": 8, "componentType": 5123, "count": 4, "type": "VEC2", "normalized": True}
    moved = {"count": 1, "indices": {"bufferView": b.view(b"\x02"), "componentType": 5121},
             "values": {"bufferView": b.view(np.int16([7, 8, 9]).tobytes())}}  # fmt: skip
    normal = {"bufferView": b.view(np.int8([(0, 0, 127, 0)] * 4).tobytes(), byteStride=4), "componentType": 5120,
              "count": 4, "type": "VEC3", "normalized": True}  # fmt: skip
    b.tree["accessors"] += [position | {"sparse": moved}, uv, normal]
    b.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    mesh = only(b.primitive(POSITION=0, TEXCOORD_0=1, NORMAL=2).glb(tmp_path))
    np.testing.assert_array_equal(mesh.vertices, [(0, 0, 0), (100, 0, 0), (7, 8, 9), (0, 100, 0)])
    np.testing.assert_array_equal(mesh.uv, POINTS[:, :2])
    np.testing.assert_array_equal(mesh.normals, [(0, 0, 1)] * 4)


def test_sparse_numbers_without_a_base_are_zero(tmp_path):
    b = Builder()
    sparse = {"count": 2, "indices": {"bufferView": b.view(np.uint16([1, 3]).tobytes()), "componentType": 5123},
              "values": {"bufferView": b.view(POINTS[[1, 3]].tobytes())}}  # fmt: skip
    b.tree["accessors"].append({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse})
    mesh = only(b.primitive((0, 1, 3), POSITION=0).glb(tmp_path))
    np.testing.assert_array_equal(mesh.vertices, POINTS * [[0], [1], [0], [1]])


def test_nodes_place_instances_by_their_transforms(tmp_path):
    b = Builder().primitive()
    half = np.sin(np.pi / 4)
    b.tree["nodes"] = [
        {"children": [1, 2, 4], "translation": [10, 0, 0]},
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 3, 4], "translation": [0, 5, 0]},
        {"matrix": (translation(1, 2, 3) @ rotation((1, 0, 0), 90)).T.ravel().tolist(), "children": [3]},
        {"mesh": 0, "scale": [1, 1, -1]},
        {"camera": 0, "mesh": 0},
        {"mesh": 0},  # not in the scene
    ]
    meshes = load(b.glb(tmp_path)).objects
    wanted = [
        translation(10, 0, 0) @ translation(0, 5, 0) @ rotation((0, 0, 1), 90) @ scaling(2, 3, 4),
        translation(10, 0, 0) @ translation(1, 2, 3) @ rotation((1, 0, 0), 90) @ scaling(1, 1, -1),
        translation(10, 0, 0),
    ]
    assert len(meshes) == 3
    for mesh, world in zip(meshes, wanted, strict=True):
        np.testing.assert_allclose(mesh.transform, world, atol=1e-15)
        np.testing.assert_array_equal(mesh.vertices, POINTS)


def test_the_default_scene_the_first_scene_or_all_roots(tmp_path):
    b = Builder().primitive()
    b.tree["nodes"] = [{"mesh": 0, "translation": [k, 0, 0]} for k in range(3)]
    b.tree["scenes"], b.tree["scene"] = [{"nodes": [0]}, {"nodes": [1, 2]}], 1
    assert [m.transform[0, 3] for m in load(b.glb(tmp_path)).objects] == [1, 2]
    del b.tree["scene"]
    assert [m.transform[0, 3] for m in load(b.glb(tmp_path)).objects] == [0]
    del b.tree["scenes"]
    assert [m.transform[0, 3] for m in load(b.glb(tmp_path)).objects] == [0, 1, 2]


# --- materials -------------------------------------------------------------------------------------------


def test_factors_and_vertex_colors_become_display_values(tmp_path):
    linear = np.array([(0, 0.0031308, 0.5), (1, 0.2, 0.04), (1, 1, 1), (0.18, 0.18, 0.18)])
    colors = np.round(linear * 65535).astype(np.uint16)
    b = Builder()
    b.primitive(material={"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.04, 0, 0.3]}})
    normalised = b.accessor(np.column_stack([colors, colors[:, :1]]), normalized=True)
    b.primitive(COLOR_0=normalised)
    half_red = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1]}}
    b.primitive(COLOR_0=linear.astype(np.float32), material=half_red)
    factor, vertex, both = load(b.glb(tmp_path)).objects
    # IEC 61966-2-1 by other means: invert the decoding curve by search
    grid = np.linspace(0, 1, 1_000_001)
    decoded = np.where(grid <= 0.04045, grid / 12.92, ((grid + 0.055) / 1.055) ** 2.4)

    def display(values):
        return np.interp(values, decoded, grid)

    np.testing.assert_allclose(factor.colors, np.broadcast_to(display([0.5, 0.04, 0]), (4, 3)), atol=1e-5)
    np.testing.assert_allclose(vertex.colors, display(colors / 65535), atol=1e-5)
    np.testing.assert_allclose(both.colors, display(linear * (0.5, 1, 1)), atol=1e-5)
    assert srgb_from_linear(np.array([-1.0, 0.0, 1.0, 7.0])).tolist() == [0.0, 0.0, pytest.approx(1), pytest.approx(1)]


def test_materials_say_two_sided_and_unlit(tmp_path):
    b = Builder()
    b.primitive(material={}).primitive(material={"doubleSided": True})
    b.primitive(material={"extensions": {"KHR_materials_unlit": {}}}).primitive()
    plain, double, unlit, default = (m.material for m in load(b.glb(tmp_path)).objects)
    assert (plain.two_sided, double.two_sided, unlit.two_sided, default.two_sided) == (False, True, False, False)
    assert (unlit.ambient, unlit.diffuse, unlit.specular) == (1, 0, 0) and plain.diffuse == 0.8


def test_the_bottom_left_uv_meets_the_bottom_left_of_a_marked_texture(tmp_path):
    b = Builder()
    index = b.picture(MARKED)
    look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}}
    b.primitive(material=look, TEXCOORD_0=UV).primitive(material=look, TEXCOORD_0=UV)
    first, second = load(b.glb(tmp_path)).objects
    np.testing.assert_array_equal(first.texture, MARKED)
    assert first.texture is second.texture
    # glTF: uv (0, 1) is the bottom left of the picture; on this square it is at the point (0, 0)
    np.testing.assert_array_equal(first.uv[0], (0, 0))
    np.testing.assert_array_equal(first.texture[-1, 0], (0, 0, 255))
    # and trimesh, which turns v as well, agrees
    oracle = next(iter(trimesh.load(tmp_path / "a.glb").geometry.values()))
    np.testing.assert_array_equal(first.uv, oracle.visual.uv)


def test_second_uv_set_texture_transform_and_specular_glossiness(tmp_path):
    b = Builder()
    index = b.picture(MARKED)
    quadrant = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]}  # the example of the extension
    info = {"index": index, "texCoord": 0, "extensions": {"KHR_texture_transform": quadrant | {"texCoord": 1}}}
    old = {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": info, "diffuseFactor": [1, 0, 0, 1]}}
    mesh = only(b.primitive(material={"extensions": old}, TEXCOORD_0=UV * 0, TEXCOORD_1=UV).glb(tmp_path))
    # "utilises only the lower left quadrant of the source image, rotated clockwise 90°"
    np.testing.assert_allclose(mesh.uv, [(0.5, 0), (0.5, 0.5), (0, 0.5), (0, 0)], atol=1e-12)
    np.testing.assert_array_equal(mesh.colors, np.broadcast_to(np.float32((1, 0, 0)), (4, 3)))
    np.testing.assert_array_equal(mesh.texture, MARKED)


def test_a_texture_without_coordinates_is_not_asked_for(tmp_path):
    look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    assert only(Builder().primitive(material=look).glb(tmp_path)).texture is None


# --- bad input ---------------------------------------------------------------------------------------------


def textured(uri):
    b = Builder()
    b.tree |= {"images": [{"uri": uri}], "textures": [{"source": 0}]}
    return b.primitive(material={"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, TEXCOORD_0=UV)


def test_pictures_beside_the_file_or_inside_a_uri(tmp_path):
    Image.fromarray(MARKED).save(tmp_path / "my marks.png")
    np.testing.assert_array_equal(only(textured("my%20marks.png").glb(tmp_path)).texture, MARKED)
    inline = "data:image/png;base64," + base64.b64encode((tmp_path / "my marks.png").read_bytes()).decode()
    np.testing.assert_array_equal(only(textured(inline).glb(tmp_path)).texture, MARKED)
    refused(textured("none.png").glb(tmp_path), "needs", "none.png, which does not exist")
    refused(textured("data:image/png;base64,AAAA").glb(tmp_path), "texture picture 0: is not a picture")


def changed(change):
    """A valid file's tree after `change`."""
    b = Builder().primitive(TEXCOORD_0=UV)
    b.tree = copy.deepcopy(b.tree)
    change(b.tree)
    return b


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda t: t["asset"].update(version="1.0"), "is glTF 1.0, expected 2.0"),
        (lambda t: t.pop("asset"), "no 'asset'"),
        (lambda t: t.update(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        (lambda t: t["accessors"][0].update(count=99999999999), "truncated"),
        (lambda t: t["accessors"][0].pop("bufferView"), "has no data"),
        (lambda t: t["accessors"][0].update(bufferView=-1), "bufferViews[-1]"),
        (lambda t: t["accessors"][0].update(type="VEC2"), "VEC2"),
        (lambda t: t["accessors"][0].update(byteOffset=-12), "truncated"),
        (lambda t: t["accessors"][0].update(componentType=1), "expected a componentType of 5120, 5121"),
        (lambda t: t["accessors"][0].update(componentType="5126"), "accessors[0].componentType: expected a whole"),
        (lambda t: t["accessors"][0].pop("count"), "an entry lacks its 'count'"),
        (lambda t: t.update(asset=None), "asset: expected an object, found null"),
        (lambda t: t.update(nodes=None), "nodes: expected a list, found null"),
        (lambda t: t["meshes"][0].update(primitives=[None]), "meshes[0].primitives[0]: expected an object, found null"),
        (lambda t: t["bufferViews"][0].update(byteLength=10**12), "truncated"),
        (lambda t: t["bufferViews"][0].update(buffer=1), "buffers[1]"),
        (lambda t: t["meshes"][0]["primitives"][0].update(indices=0), "VEC3"),
        (lambda t: t["meshes"][0]["primitives"][0].update(mode=1), "no triangles"),
        (lambda t: t["meshes"][0]["primitives"][0].update(material=3), "materials[3], the file has 0"),
        (lambda t: t["meshes"][0].update(primitives=5), "meshes[0].primitives: expected a list, found 5"),
        (lambda t: t["nodes"].append({"children": [1]}) or t["scenes"][0].update(nodes=[1]), "contains itself"),
        (lambda t: t["scenes"][0].update(nodes=[7]), "nodes[7]"),
        (lambda t: t["scenes"][0].update(nodes=[]), "no triangles"),
        (lambda t: t["nodes"][0].update(matrix=[1] * 15), "not valid glTF"),
        (lambda t: t["nodes"][0].update(matrix=[1] * 16), "affine"),
        (lambda t: t["nodes"][0].update(rotation="x"), 'nodes[0].rotation: expected a list, found "x"'),
        (lambda t: t.update(scene="first"), 'scene: expected a whole number, found "first"'),
    ],
)
def test_bad_trees(tmp_path, change, word):
    refused(changed(change).glb(tmp_path), word.replace("['first']", "[first]"))


def test_bad_indices_and_vertices(tmp_path):
    refused(Builder().primitive((0, 1, 4)).glb(tmp_path), "faces ask for vertices 0…4, the file has 4")
    points = POINTS.copy()
    points[2, 1] = np.nan
    refused(Builder().primitive(POSITION=points).glb(tmp_path), "vertices", "NaN or infinity in 1 of 4 rows")


def test_bad_containers(tmp_path):
    path = Builder().primitive().glb(tmp_path)
    data = path.read_bytes()
    for damaged, word in [
        (data[:4] + struct.pack("<I", 1) + data[8:], "GLB version 1"),
        (data[:-1], "truncated"),
        (data[:16] + b"BIN\0" + data[20:], "first chunk is not JSON"),
        (data[:20] + b"{,}" + data[23:], "JSON cannot be parsed"),
        (b"[1, 2]", "no 'asset'"),
        (b"[" * 100_000, "JSON cannot be parsed"),
    ]:
        path.write_bytes(damaged)
        refused(path, word)
    refused(Builder().primitive().gltf(tmp_path, "none.bin"), "needs", "none.bin, which does not exist")
    (tmp_path / "short.bin").write_bytes(b"abc")
    refused(Builder().primitive().gltf(tmp_path, "short.bin"), "truncated: buffer 0 needs")


@pytest.mark.parametrize("value", [None, -1, 10**30, "x", [], {}, 1.5, True])
def test_any_entry_of_any_wrong_type_is_our_error_or_harmless(tmp_path, value):
    b = textured("none.png")
    b.tree["images"], b.tree["textures"] = [], []
    b.picture(MARKED)

    def places(node, at=()):
        items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
        for key, child in items:
            yield (*at, key)
            yield from places(child, (*at, key))

    original = copy.deepcopy(b.tree)
    for place in list(places(original)):
        b.tree = copy.deepcopy(original)
        parent = b.tree
        for key in place[:-1]:
            parent = parent[key]
        parent[place[-1]] = value
        try:
            load(b.glb(tmp_path))
        except AutostereoError as error:
            assert "a.glb" in str(error)
            assert not re.search(r"[a-z]Error|None|True|object has|must be|indices|int\(", str(error))  # Python's words


# --- real files --------------------------------------------------------------------------------------------


@needs_data
@pytest.mark.parametrize(
    ("name", "meshes", "vertices", "triangles", "textures"),
    [
        ("Duck.glb", 1, 2_399, 4_212, 1),
        ("CesiumMilkTruck.glb", 5, 2_978 + 586, 2_856 + 768, 1),  # the wheels are drawn twice
        ("DamagedHelmet.glb", 1, 14_556, 15_452, 1),
        ("vr-gallery.glb", 1, 2_582, 1_930, 1),
    ],
)
def test_real_scenes_agree_with_trimesh(name, meshes, vertices, triangles, textures):
    scene = load(MESHES / name)
    assert len(scene.objects) == meshes
    assert sum(len(m.vertices) for m in scene.objects) == vertices
    assert sum(len(m.faces) for m in scene.objects) == triangles
    assert len({id(m.texture) for m in scene.objects if m.texture is not None}) == textures
    oracle = trimesh.load(MESHES / name, process=False)
    np.testing.assert_allclose(scene.bounds, oracle.bounds, rtol=1e-6, atol=1e-9)
    placed = [oracle.graph[node] for node in oracle.graph.nodes_geometry]
    theirs = [apply(world, oracle.geometry[key].triangles_center) for world, key in placed]
    ours = [apply(m.transform, m.vertices[m.faces].mean(axis=1)) for m in scene.objects]
    np.testing.assert_allclose(*(np.sort(np.concatenate(c).sum(axis=1)) for c in (ours, theirs)), atol=1e-6)


@needs_data
def test_real_materials():
    gallery = load(MESHES / "vr-gallery.glb").objects[0]
    assert (gallery.material.ambient, gallery.material.diffuse) == (1, 0)
    truck = load(MESHES / "CesiumMilkTruck.glb").objects
    glass = next(m for m in truck if m.colors is not None and m.colors[0, 0] == 0)
    linear = ((glass.colors[0, 1:] + 0.055) / 1.055) ** 2.4  # decoded (IEC 61966-2-1)
    np.testing.assert_allclose(linear, [0.04050629958510399, 0.021240700036287308], atol=1e-6)
