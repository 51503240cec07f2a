"""Triangle meshes from PLY, STL and OFF files, and points from PLY. (OBJ and glTF have files of their own.)"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..scene.mesh import Mesh, merge_positions
from ..scene.points import Points
from .files import BYTE_ORDER_MARK, PathLike, numbers, read_bytes, read_text, whole_numbers
from .image import read_image
from .ply import Ply, Ragged, read_ply
from .points import points_of_columns
from .polygons import triangulate, unroll_strips, weld

_COLOR_NAMES = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))


def check_indices(indices: NDArray[np.integer], count: int, path: PathLike) -> None:
    """Raise a FileError unless 0 ≤ indices < count."""
    if len(indices) and (indices.min() < 0 or indices.max() >= count):
        raise FileError(
            f"{path}: faces ask for vertices {indices.min()}…{indices.max()}, the file has {count} (0…{count - 1})"
        )


def usable_normals(normals: NDArray | None) -> NDArray | None:
    """Normals from a file, or None (to be computed) where they say nothing: NaN, infinite or all zero."""
    return normals if normals is not None and np.isfinite(normals).all() and normals.any() else None


def load_ply(path: PathLike) -> list[Mesh] | list[Points]:
    """Read a PLY file: a mesh, or points where it has no faces.

    Of a mesh positions, normals, colours and texture coordinates of vertices or of face corners are read, of points
    positions, normals, colours (else intensity, as greys) and radius. Strips of triangles (element 'tristrips', lists
    in which −1 ends a strip) follow the faces; colours and texture coordinates of faces are then not used.
    """
    ply = read_ply(path)
    vertex, face = ply.elements.get("vertex", {}), ply.elements.get("face", {})
    vertices = _pick(vertex, (("x", "y", "z"),))
    if vertices is None:
        raise FileError(f"{path}: the PLY file has no element 'vertex' with x, y, z")
    polygons, strips = _lists(face), _lists(ply.elements.get("tristrips", {}))
    if not len(polygons.counts) and not len(strips.counts):
        if "rot_0" in vertex:
            raise FileError(f"{path}: holds Gaussian splats, which cannot be drawn so far")
        if not len(vertices):
            raise FileError(f"{path}: has no vertices")
        columns = {name: values for name, values in vertex.items() if isinstance(values, np.ndarray)}
        return [points_of_columns(columns, path)]
    if len(strips.counts):
        triangles = unroll_strips(*strips)
        counts = np.concatenate([polygons.counts, np.full(len(triangles), 3)])
        polygons, face = Ragged(counts, np.concatenate([polygons.values, triangles.ravel()])), {}
    indices = polygons.values
    check_indices(indices, len(vertices), path)
    corner = triangulate(polygons.counts, indices, vertices)
    if not len(corner):
        raise FileError(f"{path}: has no triangles, every face or strip has fewer than three corners")
    normals = usable_normals(_pick(vertex, (("nx", "ny", "nz"),)))
    colors, uv = _colors(vertex), _pick(vertex, _UV_NAMES)
    faces, pick = indices[corner], np.arange(len(vertices))
    if (face_colors := _colors(face)) is not None and colors is None:
        owner = np.repeat(np.arange(len(polygons.counts)), polygons.counts)
        ids = weld(*face_colors.T)[1][owner]
        first, group = weld(indices, ids)
        faces, pick, colors = group[corner], indices[first], face_colors[owner[first]]
    elif uv is None and isinstance(wedge := face.get("texcoord"), Ragged):
        if not np.array_equal(wedge.counts, 2 * polygons.counts):
            raise FileError(f"{path}: expected two texture coordinates for every corner of a face")
        wedge_uv = wedge.values.reshape(-1, 2)
        first, group = weld(indices, *wedge_uv.T)
        faces, pick, uv = group[corner], indices[first], wedge_uv[first]
        colors = None if colors is None else colors[pick]
    return [
        Mesh(
            vertices[pick],
            faces,
            normals=None if normals is None else normals[pick],
            colors=colors,
            uv=uv,
            texture=_ply_texture(ply, path) if uv is not None else None,
        )
    ]


def _lists(element: dict[str, NDArray | Ragged]) -> Ragged:
    """Lists of vertex indices, int64; none where the element has no such property."""
    lists = element.get("vertex_indices", element.get("vertex_index"))
    if not isinstance(lists, Ragged):
        return Ragged(np.zeros(0, np.int64), np.zeros(0, np.int64))
    return Ragged(lists.counts, lists.values.astype(np.int64))


def _pick(element: dict[str, NDArray | Ragged], choices: tuple[tuple[str, ...], ...]) -> NDArray | None:
    """The first complete choice of scalar properties as columns (N, k)."""
    for names in choices:
        if all(isinstance(element.get(name), np.ndarray) for name in names):
            return np.stack([element[name] for name in names], axis=1)  # type: ignore[arg-type]
    return None


def _colors(element: dict[str, NDArray | Ragged]) -> NDArray[np.float64] | None:
    """Colours (N, 3) in 0…1; integers are scaled by the range of their type."""
    colors = _pick(element, _COLOR_NAMES)
    if colors is None:
        return None
    return colors / float(np.iinfo(colors.dtype).max if colors.dtype.kind in "iu" else 1)


def _ply_texture(ply: Ply, path: PathLike) -> NDArray[np.uint8] | None:
    """The picture that a line 'comment TextureFile NAME' names."""
    for comment in ply.comments:
        word, _, name = comment.partition(" ")
        if word.lower() == "texturefile" and name.strip():
            return read_image(Path(path).parent / name.strip(), asked_by=path)
    return None


def load_stl(path: PathLike) -> list[Mesh]:
    """Read an STL mesh, binary or ASCII. Equal positions become one vertex; facet normals follow from the winding."""
    data = read_bytes(path)
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if re.match(rb"(%b)?\s*solid\b" % BYTE_ORDER_MARK, data, re.IGNORECASE) and len(data) != 84 + 50 * count:
        corners = _stl_text(data, path)
    elif count < 0 or len(data) < 84 + 50 * count:
        raise FileError(
            f"{path}: truncated or not STL: {max(count, 0)} triangles need {84 + 50 * max(count, 0)} bytes, "
            f"found {len(data)}"
        )
    else:
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(data, record, count, 84)["corners"].astype(np.float64).reshape(-1, 3)
    if not len(corners):
        raise FileError(f"{path}: has no triangles")
    first, group = merge_positions(corners)
    order = np.argsort(first)  # keep the order of the file
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return [Mesh(corners[first[order]], rank[group].reshape(-1, 3))]


def _stl_text(data: bytes, path: PathLike) -> NDArray[np.float64]:
    """Corners (3F, 3) of an ASCII STL."""
    flags = re.IGNORECASE | re.MULTILINE
    found = re.findall(rb"^[ \t]*vertex[ \t]+([^\r\n]*)", data, flags)
    facets = len(re.findall(rb"^[ \t]*facet\b", data, flags))
    complete = len(re.findall(rb"^[ \t]*endfacet\b", data, flags))
    if facets != complete or not re.search(rb"^[ \t]*endsolid\b", data, flags):
        raise FileError(f"{path}: truncated: {complete} of {facets} facets are complete and 'endsolid' must follow")
    words = b" ".join(found).split()
    if len(found) != 3 * facets or len(words) != 9 * facets:
        raise FileError(f"{path}: expected {facets} triangles of three vertices of three numbers")
    return numbers(words, path, "STL vertices").reshape(-1, 3)


def load_off(path: PathLike) -> list[Mesh]:
    """Read an OFF mesh (text), with the vertex normals (N), colours (C) and texture coordinates (ST) of its header."""
    data = read_text(path)
    lines = [line for line in re.sub(rb"#[^\r\n]*", b"", data).splitlines() if line.strip()]
    header = re.fullmatch(rb"\s*(ST)?(C)?(N)?OFF\b(.*)", lines[0]) if lines else None
    if header is None:
        raise FileError(f"{path}: is not an OFF file, it does not begin with 'OFF'")
    has_uv, has_colors, has_normals, rest = header.groups()
    if b"BINARY" in rest:
        raise FileError(f"{path}: binary OFF is not supported, only text")
    at = 1
    if not rest.split():
        rest, at = (lines[1] if len(lines) > 1 else b""), 2
    sizes = whole_numbers(rest.split(), path, "the counts of vertices and faces")
    if len(sizes) < 2 or sizes[0] < 0 or sizes[1] < 0:
        raise FileError(f"{path}: expected the counts of vertices and faces after 'OFF'")
    n_vertices, n_faces = int(sizes[0]), int(sizes[1])
    if len(lines) < at + n_vertices + n_faces:
        raise FileError(
            f"{path}: truncated: {n_vertices} vertices and {n_faces} faces need as many lines, "
            f"{len(lines) - at} follow the counts"
        )
    rows = _table(lines[at : at + n_vertices], path)
    polygons = [line.split() for line in lines[at + n_vertices : at + n_vertices + n_faces]]
    counts = whole_numbers([line[0] for line in polygons], path, "the corners of faces")
    if any(n < 0 or len(line) <= n for n, line in zip(counts.tolist(), polygons, strict=True)):
        raise FileError(f"{path}: a face line is shorter than its count says (truncated?)")
    flat = [word for n, line in zip(counts.tolist(), polygons, strict=True) for word in line[1 : n + 1]]
    indices = whole_numbers(flat, path, "face indices")
    check_indices(indices, n_vertices, path)
    corner = triangulate(counts, indices, rows[:, :3])
    if not len(corner):
        raise FileError(f"{path}: has no triangles")
    wanted = 3 + 3 * bool(has_normals) + 3 * bool(has_colors) + 2 * bool(has_uv)
    if rows.shape[1] < wanted:
        raise FileError(f"{path}: expected {wanted} numbers for every vertex, found {rows.shape[1]}")
    normals = usable_normals(rows[:, 3:6]) if has_normals else None
    colors = rows[:, 3 + 3 * bool(has_normals) :][:, :3] if has_colors else None
    if colors is not None and colors.max(initial=0) > 1:
        colors = colors / 255.0
    return [Mesh(rows[:, :3], indices[corner], normals=normals, colors=colors, uv=rows[:, -2:] if has_uv else None)]


def _table(lines: list[bytes], path: PathLike) -> NDArray[np.float64]:
    """Rows of numbers (n, ≥ 3); all rows have the length of the first or are cut to the shortest."""
    if not lines:
        return np.zeros((0, 3))
    width = len(lines[0].split())
    words = b" ".join(lines).split()
    if len(words) != width * len(lines) or any(len(line.split()) != width for line in lines):
        rows = [line.split() for line in lines]
        width = min(map(len, rows))
        words = [word for row in rows for word in row[:width]]
    if width < 3:
        raise FileError(f"{path}: expected three numbers for every vertex, found {width}")
    return numbers(words, path, "vertices").reshape(len(lines), width)
