"""glTF 2.0 files, .gltf and .glb (Khronos Group, glTF 2.0 Specification, 2021)."""

from __future__ import annotations

import base64
import json
import urllib.parse
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import AutostereoError, FileError
from ..scene.appearance import Material
from ..scene.mesh import Mesh
from .files import PathLike, read_bytes
from .gltf_types import check_types
from .image import decode_image, read_image
from .mesh import check_indices, usable_normals

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_KNOWN_EXTENSIONS = ("KHR_mesh_quantization", "KHR_texture_transform", "EXT_texture_webp", "KHR_lights_punctual")
_NETWORK = ("http://", "https://", "ftp://")
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True)
class _Look:
    """What of a glTF material is drawn."""

    factor: NDArray[np.float64]  # linear RGB
    material: Material
    texture: dict[str, Any] | None  # a textureInfo


def load_gltf(path: PathLike) -> list[Mesh]:
    """Read a glTF file: one Mesh for every triangle primitive of every node of the scene.

    Drawn are positions, normals, COLOR_0, the base colour (factor and texture), doubleSided, and the extensions
    KHR_materials_unlit, KHR_texture_transform, KHR_mesh_quantization and EXT_texture_webp. Animations, skins and
    morph targets are shown at rest; alpha, cameras and lights are ignored.

    Raises
    ------
    FileError
        The file or one it refers to is missing, truncated or invalid, needs an extension that is not supported
        (Draco, meshopt, Basis), or has no triangles.
    """
    try:
        file = _File(Path(path))
        meshes = [mesh for node, world in file.placed() for mesh in file.mesh(node["mesh"], world)]
    except AutostereoError:
        raise
    except KeyError as error:
        raise FileError(f"{path}: is not valid glTF, an entry lacks its {error.args[0]!r}") from error
    except (IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise FileError(f"{path}: is not valid glTF, an entry is of another type or size than expected") from error
    if not meshes:
        raise FileError(f"{path}: has no triangles in its scene")
    return meshes


def srgb_from_linear(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Display (sRGB) values of linear light, both 0…1 (IEC 61966-2-1)."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


class _File:
    """A glTF file: its JSON tree, and its buffers and pictures read on demand."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.chunk: bytes | None = None
        data = read_bytes(path)
        text = self._split_glb(data) if data[:4] == b"glTF" else data
        try:
            self.tree = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise FileError(f"{path}: is not glTF: its JSON cannot be parsed ({error})") from None
        if not isinstance(self.tree, dict) or "asset" not in self.tree:
            raise FileError(f"{path}: is not glTF: its JSON has no 'asset'")
        check_types(self.tree, path)
        version = self.tree["asset"].get("version", "of no version")
        if version.split(".")[0] != "2":
            raise FileError(f"{path}: is glTF {version}, expected 2.0")
        for name in self.tree.get("extensionsRequired", []):
            if name not in _KNOWN_EXTENSIONS and not name.startswith("KHR_materials_"):
                raise FileError(f"{path}: needs the glTF extension {name}, which is not supported")
        self.buffers: dict[int, bytes] = {}
        self.images: dict[int, NDArray[np.uint8]] = {}

    def _split_glb(self, data: bytes) -> bytes:
        """Return the JSON chunk of a GLB and keep its binary chunk."""
        version, length = (int(n) for n in np.frombuffer(data[4:12].ljust(8, b"\0"), "<u4"))
        if version != 2:
            raise FileError(f"{self.path}: is GLB version {version}, expected 2")
        if length > len(data):
            raise FileError(f"{self.path}: truncated: {length} bytes announced, {len(data)} found")
        chunks, at = [], 12
        while at + 8 <= length:
            size = int.from_bytes(data[at : at + 4], "little")
            if at + 8 + size > length:
                raise FileError(f"{self.path}: truncated: a chunk of {size} bytes ends behind the file")
            chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + size]))
            at += 8 + size
        if not chunks or chunks[0][0] != b"JSON":
            raise FileError(f"{self.path}: is not GLB: its first chunk is not JSON")
        self.chunk = next((body for kind, body in chunks[1:] if kind == b"BIN\0"), None)
        return chunks[0][1]

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """Entry `index` of the top-level list `kind`; unlike Python, no negative index."""
        entries = self.tree.get(kind, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise FileError(f"{self.path}: refers to {kind}[{json.dumps(index)}], the file has {len(entries)}")
        return entries[index]

    # --- bytes ---------------------------------------------------------------------------------

    def uri(self, uri: str) -> bytes | Path:
        """The data that a URI holds, or the file it names beside this one."""
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            if head.endswith(";base64"):
                return base64.b64decode(body, validate=False)
            return urllib.parse.unquote_to_bytes(body)
        if uri.lower().startswith(_NETWORK):
            raise FileError(f"{self.path}: needs {uri!r}, expected a file beside it: uris of the network are not read")
        return self.path.parent / urllib.parse.unquote(uri)

    def buffer(self, index: int) -> bytes:
        entry = self.item("buffers", index)
        if index not in self.buffers:
            if "uri" in entry:
                source = self.uri(entry["uri"])
                data = source if isinstance(source, bytes) else read_bytes(source, asked_by=self.path)
            elif index == 0 and self.chunk is not None:
                data = self.chunk
            else:
                raise FileError(f"{self.path}: buffer {index} has no data")
            if len(data) < entry["byteLength"]:
                raise FileError(
                    f"{self.path}: truncated: buffer {index} needs {entry['byteLength']} bytes, found {len(data)}"
                )
            self.buffers[index] = data
        return self.buffers[index]

    def view(self, index: int) -> tuple[memoryview, int | None]:
        """Bytes of a bufferView and its stride."""
        entry = self.item("bufferViews", index)
        data, start, size = self.buffer(entry["buffer"]), entry.get("byteOffset", 0), entry["byteLength"]
        if start < 0 or size < 0 or start + size > len(data):
            raise FileError(f"{self.path}: truncated: bufferView {index} ends behind its buffer")
        return memoryview(data)[start : start + size], entry.get("byteStride")

    def _table(self, view: int, offset: int, kind: str, shape: tuple[int, int]) -> NDArray:
        """Numbers (count, columns) of a bufferView from a byte offset on."""
        data, stride = self.view(view)
        dtype = np.dtype(kind)
        row = dtype.itemsize * shape[1]
        stride = stride or row
        if shape[0] and (offset < 0 or stride < row or offset + (shape[0] - 1) * stride + row > len(data)):
            raise FileError(f"{self.path}: truncated: {shape[0]} numbers do not fit into bufferView {view}")
        return np.ndarray(shape, dtype, data, offset, (stride, dtype.itemsize)).copy()

    def _kind(self, entry: dict[str, Any]) -> str:
        """NumPy's type of an entry's numbers."""
        if entry["componentType"] not in _COMPONENTS:
            wanted = ", ".join(map(str, _COMPONENTS))
            raise FileError(f"{self.path}: expected a componentType of {wanted}, found {entry['componentType']}")
        return _COMPONENTS[entry["componentType"]]

    def accessor(self, index: int, columns: tuple[int, ...] = (1,)) -> NDArray:
        """Numbers (count, columns) of an accessor; normalised integers become 0…1 or −1…1."""
        entry = self.item("accessors", index)
        kind, width, count = self._kind(entry), _COLUMNS.get(entry["type"]), entry["count"]
        if width is None or width not in columns or count < 0:
            raise FileError(f"{self.path}: accessor {index} has {count} of {entry['type']}, which is not expected")
        if "bufferView" in entry:
            table = self._table(entry["bufferView"], entry.get("byteOffset", 0), kind, (count, width))
        elif "sparse" in entry and count <= 2**27:
            table = np.zeros((count, width), kind)
        else:
            raise FileError(f"{self.path}: accessor {index} of {count} has no data")
        if sparse := entry.get("sparse"):
            n, where, what = sparse["count"], sparse["indices"], sparse["values"]
            index_kind = self._kind(where)
            rows = self._table(where["bufferView"], where.get("byteOffset", 0), index_kind, (n, 1))
            check_indices(rows, count, self.path)
            table[rows[:, 0]] = self._table(what["bufferView"], what.get("byteOffset", 0), kind, (n, width))
        if entry.get("normalized") and table.dtype.kind in "iu":
            return np.maximum(table / float(np.iinfo(table.dtype).max), -1.0)
        return table

    # --- materials -------------------------------------------------------------------------------

    def look(self, index: int | None) -> _Look:
        entry = {} if index is None else self.item("materials", index)
        extensions = entry.get("extensions", {})
        pbr = entry.get("pbrMetallicRoughness", {})
        factor, texture = pbr.get("baseColorFactor"), pbr.get("baseColorTexture")
        old = extensions.get("KHR_materials_pbrSpecularGlossiness")
        if old is not None and "pbrMetallicRoughness" not in entry:
            factor, texture = old.get("diffuseFactor"), old.get("diffuseTexture")
        two_sided = bool(entry.get("doubleSided", False))
        unlit = "KHR_materials_unlit" in extensions
        material = Material(ambient=1.0, diffuse=0.0, two_sided=two_sided) if unlit else Material(two_sided=two_sided)
        rgb = np.ones(3) if factor is None else np.array(factor, dtype=np.float64)[:3]
        if rgb.shape != (3,) or not np.isfinite(rgb).all():
            raise FileError(f"{self.path}: a base colour factor is not four finite numbers")
        return _Look(rgb, material, texture)

    def texture(self, index: int) -> NDArray[np.uint8]:
        """Pixels of a texture; a picture that several materials use is decoded once."""
        entry = self.item("textures", index)
        webp = entry.get("extensions", {}).get("EXT_texture_webp", {})
        source = webp.get("source", entry.get("source"))
        if source is None:
            raise FileError(f"{self.path}: texture {index} has no PNG, JPEG or WebP picture (a KTX2 texture?)")
        image = self.item("images", source)
        if source not in self.images:
            name = f"{self.path}: texture picture {source}"
            if "bufferView" in image:
                pixels = decode_image(bytes(self.view(image["bufferView"])[0]), name)
            else:
                data = self.uri(image["uri"])
                pixels = decode_image(data, name) if isinstance(data, bytes) else read_image(data, asked_by=self.path)
            self.images[source] = np.ascontiguousarray(pixels[..., :3])
        return self.images[source]

    def uv(self, attributes: dict[str, Any], info: dict[str, Any]) -> NDArray[np.float64] | None:
        """Texture coordinates (N, 2) from the bottom left; glTF counts v from the top."""
        move = info.get("extensions", {}).get("KHR_texture_transform", {})
        name = f"TEXCOORD_{move.get('texCoord', info.get('texCoord', 0))}"
        if name not in attributes:
            return None
        uv = self.accessor(attributes[name], (2,)).astype(np.float64)
        if move:
            # The matrix that the extension prints turns the wrong way; its text, its example and all viewers
            # turn this way (Khronos glTF issue 1563).
            c, s = np.cos(move.get("rotation", 0.0)), np.sin(move.get("rotation", 0.0))
            scaled = uv * np.array(move.get("scale", (1.0, 1.0)))
            uv = scaled @ np.array([[c, -s], [s, c]]) + np.array(move.get("offset", (0.0, 0.0)))
        return uv * (1.0, -1.0) + (0.0, 1.0)

    # --- meshes and nodes --------------------------------------------------------------------------

    @cached_property
    def _meshes(self) -> dict[int, list[Mesh]]:
        return {}

    def mesh(self, index: int, world: NDArray[np.float64]) -> list[Mesh]:
        """Triangle primitives of a mesh, placed by `world`, the 4×4 world_from_node."""
        if index not in self._meshes:
            primitives = self.item("meshes", index)["primitives"]
            self._meshes[index] = [m for p in primitives if (m := self._primitive(p)) is not None]
        return [replace(mesh, transform=world) for mesh in self._meshes[index]]

    def _primitive(self, primitive: dict[str, Any]) -> Mesh | None:
        mode, attributes = primitive.get("mode", _TRIANGLES), primitive["attributes"]
        if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in attributes:
            return None
        vertices = self.accessor(attributes["POSITION"], (3,))
        if "indices" in primitive:
            flat = self.accessor(primitive["indices"])[:, 0].astype(np.int64)
            check_indices(flat, len(vertices), self.path)
        else:
            flat = np.arange(len(vertices))
        faces = _triangles(flat, mode)
        if not len(faces):
            return None
        look = self.look(primitive.get("material"))
        uv = self.uv(attributes, look.texture or {})
        texture = self.texture(look.texture["index"]) if look.texture is not None and uv is not None else None
        linear = look.factor
        if "COLOR_0" in attributes:
            colors = self.accessor(attributes["COLOR_0"], (3, 4))[:, :3]
            if colors.dtype.kind in "iu":  # some writers forget to say that these are normalised
                colors = colors / float(np.iinfo(colors.dtype).max)
            linear = colors * look.factor
        white = linear.ndim == 1 and (linear == 1).all()
        normals = usable_normals(self.accessor(attributes["NORMAL"], (3,)) if "NORMAL" in attributes else None)
        return Mesh(
            vertices,
            faces,
            normals=normals,
            colors=None if white else np.broadcast_to(srgb_from_linear(linear), vertices.shape),
            uv=uv,
            texture=texture,
            material=look.material,
        )

    def placed(self) -> list[tuple[dict[str, Any], NDArray[np.float64]]]:
        """Nodes of the scene that carry a mesh, each with its world_from_node."""
        nodes = self.tree.get("nodes", [])
        if "scenes" in self.tree:
            roots = self.item("scenes", self.tree.get("scene", 0)).get("nodes", [])
        else:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [k for k in range(len(nodes)) if k not in children]
        found, seen = [], set()
        waiting = [(index, np.eye(4)) for index in reversed(roots)]
        while waiting:
            index, world_from_parent = waiting.pop()
            if index in seen:
                raise FileError(f"{self.path}: node {index} has two parents or contains itself")
            seen.add(index)
            node = self.item("nodes", index)
            world = world_from_parent @ _parent_from_node(node)
            if "mesh" in node:
                found.append((node, world))
            waiting += [(child, world) for child in reversed(node.get("children", []))]
        return found


def _parent_from_node(node: dict[str, Any]) -> NDArray[np.float64]:
    """The 4×4 matrix of a node: given by columns, or translation · rotation (quaternion x y z w) · scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    m = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    n = x * x + y * y + z * z + w * w
    s = 2.0 / n if n > 0 else 0.0
    m[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
        [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
        [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
    ]
    m[:3, :3] *= np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    m[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return m


def _triangles(flat: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Faces (F, 3) of a list, strip or fan of vertex indices (glTF 2.0, section 3.7.2.1)."""
    if mode == _TRIANGLES:
        return flat[: len(flat) // 3 * 3].reshape(-1, 3)
    k = np.arange(max(len(flat) - 2, 0))
    if mode == _STRIP:
        return np.stack([flat[k], flat[k + 1 + k % 2], flat[k + 2 - k % 2]], axis=1)
    return np.stack([flat[k + 1], flat[k + 2], flat[np.zeros_like(k)]], axis=1)
