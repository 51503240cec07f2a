"""Wavefront OBJ files with MTL materials (Alias|Wavefront, Advanced Visualizer manual, appendices B1 and B2)."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..scene.appearance import Material
from ..scene.mesh import Mesh
from .files import PathLike, numbers, read_text, whole_numbers
from .image import read_image
from .mesh import usable_normals
from .polygons import triangulate, weld

FARTHEST_UV = 1e6  # repeats of a texture
# options of map_Kd and how many words follow them; the file name is what comes after
_MAP_OPTIONS = {
    b"-blendu": 1, b"-blendv": 1, b"-bm": 1, b"-boost": 1, b"-cc": 1, b"-clamp": 1, b"-imfchan": 1,
    b"-mm": 2, b"-texres": 1, b"-type": 1, b"-o": 3, b"-s": 3, b"-t": 3,
}  # fmt: skip


@dataclass
class _Surface:
    """One MTL material: kd, its texture file and where that lies, and the reflection weights."""

    kd: NDArray[np.float64] = field(default_factory=lambda: np.ones(3))
    texture: Path | None = None
    scale: tuple[float, ...] = (1.0, 1.0)  # the texture is looked up at uv · scale + offset
    offset: tuple[float, ...] = (0.0, 0.0)
    specular: float = 0.0
    shininess: float = 32.0
    illum: int = 2

    @property
    def material(self) -> Material:
        if self.illum == 0:  # colour without light
            return Material(ambient=1.0, diffuse=0.0)
        if self.illum == 1 or not self.specular:  # no highlight
            return Material()
        return Material(specular=self.specular, shininess=self.shininess)


@dataclass
class _Text:
    """Statements of an OBJ file, sorted by kind."""

    v: list[bytes] = field(default_factory=list)
    vt: list[bytes] = field(default_factory=list)
    vn: list[bytes] = field(default_factory=list)
    f: list[bytes] = field(default_factory=list)
    used: list[tuple[int, bytes]] = field(default_factory=list)  # (face, material from there on)
    known: list[tuple[int, int, int, int]] = field(default_factory=list)  # (face, v, vt, vn defined by then)
    libraries: list[bytes] = field(default_factory=list)


def load_obj(path: PathLike) -> list[Mesh]:
    """Read an OBJ file: one Mesh for each material, in the order of first use.

    Polygons are cut into triangles; lines, points, groups and smoothing groups are ignored. Where the file has
    no normals, they are computed over the whole file, so that a border between materials stays smooth.

    Raises
    ------
    FileError
        The file is not OBJ, its faces have no triangles, it names vertices it does not have, a texture is missing, or
        a material library is something else.

    Warns
    -----
    UserWarning
        A material library or a material does not exist; its faces are drawn white.
    """
    text = _statements(read_text(path))
    if not text.f:
        if not text.v:
            raise FileError(f"{path}: is not an OBJ file, it has no vertices")
        raise FileError(f"{path}: has no triangles, its {len(text.v)} vertices are in no face (f)")
    vertices, colors = _vertices(text.v, path)
    uv = _rows(text.vt, 1, path, "texture coordinates (vt)")
    uv = np.pad(uv, ((0, 0), (0, max(0, 2 - uv.shape[1]))))[:, :2]
    normals = usable_normals(_rows(text.vn, 3, path, "normals (vn)")[:, :3])
    counts, corners = _corners(text, (len(vertices), len(uv), len(text.vn)), path)
    triangles = triangulate(counts, corners[:, 0], vertices)
    if not len(triangles):
        raise FileError(f"{path}: has no triangles, every face has fewer than three corners")
    if normals is None:
        corners[:, 2] = -1
    surfaces = _libraries(text, path)
    polygon = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    names, part = _parts(text, len(counts))
    # faces with and without texture coordinates or normals cannot share a Mesh
    lacks = np.asarray((corners[triangles, 1:] < 0).any(axis=1))  # (F, 2)
    first, group = weld(part[polygon], lacks[:, 0], lacks[:, 1])
    meshes, textures = [], {}
    for k, example in enumerate(first):
        name = names[part[polygon[example]]]
        surface = surfaces.get(name, _Surface())
        chosen = corners[triangles[group == k]].reshape(-1, 3)
        chosen[:, 1:][:, lacks[example]] = -1
        rows, index = weld(*chosen.T)
        v, t, n = chosen[rows].T
        mesh_uv = None if lacks[example, 0] else uv[t]
        texture = None
        if surface.texture is not None and mesh_uv is not None:
            if surface.texture not in textures:
                pixels = read_image(surface.texture, asked_by=path)[..., :3]
                textures[surface.texture] = np.ascontiguousarray(pixels)  # one array for all that wear it
            texture = textures[surface.texture]
            mesh_uv = mesh_uv * surface.scale + surface.offset
        kd = np.ones((len(v), 3)) if colors is None else colors[v]
        mesh = Mesh(
            vertices[v],
            index.reshape(-1, 3),
            normals=None if lacks[example, 1] or normals is None else normals[n],
            colors=kd * surface.kd if colors is not None or (surface.kd != 1).any() else None,
            uv=mesh_uv,
            texture=texture,
            material=surface.material,
        )
        meshes.append((mesh, v))
    return _share_normals(meshes, vertices, corners[triangles, 0])


def _share_normals(
    parts: list[tuple[Mesh, NDArray[np.int64]]], vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> list[Mesh]:
    """Give several parts of one surface the smooth normals, and the closedness, of the whole."""
    if len(parts) == 1:
        return [parts[0][0]]
    whole = Mesh(vertices, faces)
    result = []
    for mesh, v in parts:
        material = replace(mesh.material, two_sided=not whole.is_closed)
        normals = whole.shading_normals[v] if mesh.normals is None else mesh.normals
        result.append(replace(mesh, material=material, normals=normals))
    return result


def _statements(data: bytes) -> _Text:
    """Sort the lines of an OBJ file by their first word."""
    text = _Text()
    lists = {b"v": text.v, b"vt": text.vt, b"vn": text.vn}
    current, grown = None, True
    for line in data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
        words = line.split(None, 1)
        if len(words) < 2:
            continue
        word, rest = words
        if word == b"f":
            if grown:
                text.known.append((len(text.f), len(text.v), len(text.vt), len(text.vn)))
                grown = False
            text.f.append(rest)
        elif word in lists:
            lists[word].append(rest)
            grown = True
        elif word == b"usemtl" and rest.strip() != current:
            current = rest.strip()
            text.used.append((len(text.f), current))
        elif word == b"mtllib":
            text.libraries.append(rest.strip())
    return text


def _words(lines: list[bytes]) -> list[list[bytes]]:
    """Words of each line, without comments."""
    return [(line.partition(b"#")[0] if b"#" in line else line).split() for line in lines]


def _rows(lines: list[bytes], least: int, path: PathLike, what: str) -> NDArray[np.float64]:
    """Numbers (n, k), k ≥ least the words of the shortest line."""
    if not lines:
        return np.zeros((0, least))
    rows = _words(lines)
    width = min(map(len, rows))
    if width < least:
        raise FileError(f"{path}: expected {least} numbers or more for {what}, found {width} (truncated?)")
    return numbers([word for row in rows for word in row[:width]], path, what).reshape(len(rows), width)


def _vertices(lines: list[bytes], path: PathLike) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Positions (N, 3), and colours (N, 3) where every vertex carries x y z r g b."""
    rows = _rows(lines, 3, path, "vertices (v)")
    colors = rows[:, 3:6] if rows.shape[1] in (6, 7) else None
    if colors is not None and colors.max(initial=0.0) > 1:  # some programs write 0…255
        colors = colors / 255.0
    return rows[:, :3], colors


def _corners(text: _Text, sizes: tuple[int, int, int], path: PathLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners of each face (P,), and v, vt, vn of every corner (C, 3) counted from 0; −1: not given."""
    faces = _words(text.f)
    counts = np.array([len(words) for words in faces], dtype=np.int64)
    words = [word for face in faces for word in face]
    corners = _corner_indices(words, path)
    if (corners[:, 0] == 0).any():
        raise FileError(f"{path}: found vertex 0 in a face, OBJ counts from 1")
    if (corners < 0).any():  # relative to what is defined by then
        starts = np.array([row[0] for row in text.known])
        run = np.searchsorted(starts, np.repeat(np.arange(len(counts)), counts), side="right") - 1
        known = np.array([row[1:] for row in text.known], dtype=np.int64)[run]
        corners = np.where(corners < 0, corners + known + 1, corners)
        if (corners < 0).any() or (corners[:, 0] == 0).any():
            raise FileError(f"{path}: a negative face index reaches before the first vertex")
    for k, what in enumerate(("vertex", "texture coordinate", "normal")):
        if corners[:, k].max(initial=0) > sizes[k]:
            raise FileError(f"{path}: a face asks for {what} {corners[:, k].max()}, the file has {sizes[k]}")
    return counts, corners - 1


def _corner_indices(words: list[bytes], path: PathLike) -> NDArray[np.int64]:
    """Indices v, vt, vn (C, 3) as written in words v, v/vt, v//vn or v/vt/vn; 0: not given."""
    corners = np.zeros((len(words), 3), dtype=np.int64)
    joined = b" ".join(words)
    if b"/" not in joined:
        corners[:, 0] = whole_numbers(words, path, "face indices")
        return corners
    # v//n and v/ leave an index out: 0 stands for it, no index is 0
    filled = joined.replace(b"//", b"/0/").replace(b"/ ", b"/0 ") + (b"0" if joined.endswith(b"/") else b"")
    raw = np.frombuffer(filled, np.uint8)
    marks = raw[(raw == ord(" ")) | (raw == ord("/"))]
    given = np.bincount(np.cumsum(marks == ord(" "))[marks == ord("/")], minlength=len(words)) + 1
    values = whole_numbers(filled.replace(b"/", b" ").split(), path, "face indices")
    if len(values) != given.sum() or given.max() > 3:
        raise FileError(f"{path}: expected face corners of the form v, v/vt, v//vn or v/vt/vn")
    corner = np.repeat(np.arange(len(words)), given)
    corners[corner, np.arange(len(values)) - np.repeat(np.cumsum(given) - given, given)] = values
    return corners


def _parts(text: _Text, n_faces: int) -> tuple[list[bytes], NDArray[np.int64]]:
    """Names of the materials used, and for every face (P,) which of them it wears."""
    names = [b"", *dict.fromkeys(name for _, name in text.used)]
    index = {name: k for k, name in enumerate(names)}
    starts = np.array([0, *(face for face, _ in text.used)])
    values = np.array([0, *(index[name] for _, name in text.used)])
    return names, values[np.searchsorted(starts, np.arange(n_faces), side="right") - 1]


def _libraries(text: _Text, path: PathLike) -> dict[bytes, _Surface]:
    """All materials of the libraries that the file names."""
    surfaces: dict[bytes, _Surface] = {}
    folder, libraries = Path(path).parent, 0
    for line in text.libraries:
        # one name that may hold blanks, or several names
        names = [line] if os.path.isfile(folder / line.decode("utf-8", "replace")) else line.split()
        for name in names:
            library = folder / name.decode("utf-8", "replace").replace("\\", "/")
            if os.path.exists(library):  # False for names that none can have
                surfaces.update(_read_mtl(library))
                libraries += 1
            elif text.used:
                warnings.warn(f"{path}: the material library {library} does not exist", stacklevel=3)
    missing = sorted({name for _, name in text.used if name and name not in surfaces})
    if libraries and missing:
        listed = ", ".join(name.decode("utf-8", "replace") for name in missing[:5])
        warnings.warn(f"{path}: no library defines the materials {listed}", stacklevel=3)
    return surfaces


def _read_mtl(path: Path) -> dict[bytes, _Surface]:
    """Materials of one MTL file by name."""
    surfaces: dict[bytes, _Surface] = {}
    surface, content = _Surface(), False
    for line in read_text(path).splitlines():
        word, _, rest = line.strip().replace(b"\t", b" ").partition(b" ")
        words = rest.split()
        key = word.lower()
        content = content or (key != b"" and not key.startswith(b"#"))
        if key == b"newmtl":
            surface = surfaces.setdefault(rest.strip(), _Surface())
        elif key == b"kd" and words and words[0] not in (b"spectral", b"xyz"):
            surface.kd = _rgb(words, path, "Kd")
        elif key == b"ks" and words and words[0] not in (b"spectral", b"xyz"):
            surface.specular = float(_rgb(words, path, "Ks").mean())
        elif key == b"ns" and words:
            surface.shininess = float(np.clip(numbers(words[:1], path, "Ns")[0], 0.0, 1e4))
        elif key == b"illum" and words:
            surface.illum = int(whole_numbers(words[:1], path, "illum")[0])
        elif key == b"map_kd" and words:
            name, given = _map(rest.strip(), path)
            surface.texture = path.parent / name.decode("utf-8", "replace").replace("\\", "/")
            surface.scale, surface.offset = (*given[b"-s"], 1.0, 1.0)[:2], (*given[b"-o"], 0.0, 0.0)[:2]
    if not surfaces and content:
        raise FileError(f"{path}: is not a library of materials (MTL), no line begins with newmtl")
    for surface in surfaces.values():
        if surface.texture is not None and not surface.kd.any():
            surface.kd = np.ones(3)  # exporters write Kd 0 beside a texture and do not mean black
    return surfaces


def _rgb(words: list[bytes], path: PathLike, what: str) -> NDArray[np.float64]:
    """Three numbers clipped to 0…1; one number counts for all three."""
    value = numbers(words[:3], path, what)
    if not np.isfinite(value).all():
        raise FileError(f"{path}: expected finite numbers for {what}")
    return np.clip(value if len(value) == 3 else np.full(3, value[0]), 0.0, 1.0)


def _map(rest: bytes, path: PathLike) -> tuple[bytes, dict[bytes, list[float]]]:
    """The file name of a map statement, which may hold blanks, and the numbers given (none to three) for -s and -o."""
    given: dict[bytes, list[float]] = {b"-s": [], b"-o": []}
    while rest.startswith(b"-"):
        option, _, rest = rest.partition(b" ")
        option, words = option.lower(), []
        for _ in range(_MAP_OPTIONS.get(option, 0)):
            head, _, tail = rest.lstrip().partition(b" ")
            if option in (b"-o", b"-s", b"-t") and not _looks_numeric(head):
                break  # one to three numbers
            words.append(head)
            rest = tail
        if option in given:
            given[option] = numbers(words, path, f"map_Kd {option.decode()}").tolist()
            if not (np.abs(given[option]) <= FARTHEST_UV).all():
                raise FileError(f"{path}: expected numbers within ±{FARTHEST_UV:g} for map_Kd {option.decode()}")
        rest = rest.lstrip()
    return rest.strip().strip(b'"'), given


def _looks_numeric(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
