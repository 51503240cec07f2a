"""PLY files: any elements with any properties, ASCII and binary (Turk 1994)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from .files import PathLike, numbers, read_text

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class Ragged(NamedTuple):
    """A list property: `counts` (N,) entries in each row, and all entries (counts.sum(),) one after the other."""

    counts: NDArray[np.int64]
    values: NDArray


@dataclass(frozen=True)
class _Property:
    name: str
    kind: np.dtype
    count_kind: np.dtype | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


@dataclass(frozen=True)
class Ply:
    """Contents of a PLY file: elements[element][property], an array (N,) or a Ragged; and the comment lines."""

    elements: dict[str, dict[str, NDArray | Ragged]]
    comments: list[str]


def read_ply(path: PathLike) -> Ply:
    """Read a PLY file.

    Raises
    ------
    FileError
        The header is not PLY, or the data end before what the header announces.
    """
    data = read_text(path)
    order, elements, comments, body = _header(data, path)
    for element in elements:
        if element.count and not element.properties:
            raise FileError(f"{path}: the PLY header gives element {element.name!r} no property")
        smallest = sum((p.count_kind or p.kind).itemsize if order else 2 for p in element.properties)
        if element.count * smallest > len(body) + 1:
            raise FileError(
                f"{path}: truncated: the header announces {element.count} of element {element.name!r}, "
                f"{len(body)} bytes of data cannot hold them"
            )
    reader = _Binary(body, path) if order else _Ascii(body, path)
    return Ply({element.name: reader.read(element) for element in elements}, comments)


def _header(data: bytes, path: PathLike) -> tuple[str, list[_Element], list[str], memoryview]:
    """Byte order ('' for ASCII), the elements, the comments and the data that follow."""
    if not re.match(rb"ply\s", data):
        raise FileError(f"{path}: is not a PLY file, it does not begin with 'ply'")
    end = re.search(rb"[\r\n]end_header[ \t]*(\r\n|\n|\r)", data)
    if end is None:
        raise FileError(f"{path}: truncated: the PLY header has no end_header line")
    order, elements, comments = None, [], []
    for line in data[: end.start()].decode("utf-8", "replace").splitlines()[1:]:
        words = line.split()
        try:
            match words:
                case []:
                    pass
                case ["comment" | "obj_info", *_]:
                    comments.append(line.strip().partition(" ")[2])
                case ["format", name, _]:
                    order = _FORMATS[name]
                case ["element", name, count]:
                    elements.append(_Element(name, int(count)))
                    if int(count) < 0:
                        raise ValueError
                case ["property", "list", count_kind, kind, name]:
                    entry = _Property(name, _kind(kind, order), _kind(count_kind, order))
                    if entry.count_kind is not None and entry.count_kind.kind == "f":
                        raise ValueError
                    elements[-1].properties.append(entry)
                case ["property", kind, name]:
                    elements[-1].properties.append(_Property(name, _kind(kind, order)))
                case _:
                    raise ValueError
        except (KeyError, ValueError, IndexError):
            raise FileError(f"{path}: the PLY header line {line.strip()[:60]!r} is not understood") from None
    if order is None:
        raise FileError(f"{path}: the PLY header has no format line")
    return order, elements, comments, memoryview(data)[end.end() :]


def _kind(name: str, order: str | None) -> np.dtype:
    return np.dtype((order or "<") + _TYPES[name])


class _Binary:
    """Reads elements from binary data, one after the other."""

    def __init__(self, body: memoryview, path: PathLike) -> None:
        self.body, self.path, self.at = body, path, 0

    def read(self, element: _Element) -> dict[str, NDArray | Ragged]:
        # lists are mostly of one length throughout (triangles): then rows are records
        sizes = self._sizes_at(element, self.at) if element.count else None
        if sizes is None and element.count:
            raise self._short(element)
        record = _record(element, sizes or [0] * len(element.properties))
        if element.count * record.itemsize <= len(self.body) - self.at:
            rows = np.frombuffer(self.body, record, element.count, self.at)
            if all((rows[f"n{k}"] == n).all() for k, n in enumerate(sizes or []) if n is not None):
                self.at += element.count * record.itemsize
                return _columns(element, rows)
        elif all(p.count_kind is None for p in element.properties):
            raise self._short(element)
        return self._walk(element)

    def _sizes_at(self, element: _Element, at: int) -> list[int | None] | None:
        """Length of each list in the row at `at` (None: no list); None where the data end."""
        sizes: list[int | None] = []
        for entry in element.properties:
            size = 1
            if entry.count_kind is not None:
                if at + entry.count_kind.itemsize > len(self.body):
                    return None
                size = int(np.frombuffer(self.body, entry.count_kind, 1, at)[0])
                if size < 0:
                    raise FileError(f"{self.path}: a list of {size} entries in element {element.name!r}")
                at += entry.count_kind.itemsize
            at += size * entry.kind.itemsize
            sizes.append(None if entry.count_kind is None else size)
        return sizes if at <= len(self.body) else None

    def _walk(self, element: _Element) -> dict[str, NDArray | Ragged]:
        """Rows whose lists differ in length: gather rows of the same lengths and read those as records."""
        starts: dict[tuple[int | None, ...], list[tuple[int, int]]] = {}
        lengths: dict[tuple[int | None, ...], int] = {}
        for row in range(element.count):
            sizes = self._sizes_at(element, self.at)
            if sizes is None:
                raise self._short(element)
            key = tuple(sizes)
            if key not in starts:
                starts[key], lengths[key] = [], _record(element, sizes).itemsize
            starts[key].append((row, self.at))
            self.at += lengths[key]
        raw = np.frombuffer(self.body, np.uint8)
        parts = []
        for key, found in starts.items():
            where = np.array(found, dtype=np.int64)
            block = np.ascontiguousarray(raw[where[:, 1, None] + np.arange(lengths[key])])
            rows = block.view(_record(element, list(key))).reshape(-1)
            parts.append((where[:, 0], _columns(element, rows)))
        return _interleave(element, parts)

    def _short(self, element: _Element) -> FileError:
        return FileError(f"{self.path}: truncated: the data end inside element {element.name!r} of {element.count}")


def _record(element: _Element, sizes: list[int | None]) -> np.dtype:
    """Record type of one row; field pK holds property K, field nK the length of its list."""
    fields: list[tuple] = []
    for k, (entry, size) in enumerate(zip(element.properties, sizes, strict=True)):
        if entry.count_kind is not None:
            fields.append((f"n{k}", entry.count_kind))
            fields.append((f"p{k}", entry.kind, (size or 0,)))
        else:
            fields.append((f"p{k}", entry.kind))
    return np.dtype(fields)


def _columns(element: _Element, rows: NDArray) -> dict[str, NDArray | Ragged]:
    """Native-endian properties of rows that are records."""
    columns: dict[str, NDArray | Ragged] = {}
    for k, entry in enumerate(element.properties):
        values = rows[f"p{k}"].astype(entry.kind.newbyteorder("="))
        if entry.count_kind is not None:
            columns[entry.name] = Ragged(rows[f"n{k}"].astype(np.int64), values.reshape(-1))
        else:
            columns[entry.name] = values
    return columns


def _interleave(
    element: _Element, parts: list[tuple[NDArray[np.int64], dict[str, NDArray | Ragged]]]
) -> dict[str, NDArray | Ragged]:
    """Put parts, each with the row numbers (n,) it holds, back into the order of the file."""
    columns: dict[str, NDArray | Ragged] = {}
    for entry in element.properties:
        kind = entry.kind.newbyteorder("=")
        if entry.count_kind is None:
            whole = np.empty(element.count, kind)
            for rows, part in parts:
                whole[rows] = part[entry.name]
            columns[entry.name] = whole
            continue
        counts = np.zeros(element.count, np.int64)
        for rows, part in parts:
            counts[rows] = part[entry.name].counts  # type: ignore[union-attr]
        first = np.cumsum(counts) - counts
        values = np.empty(int(counts.sum()), kind)
        for rows, part in parts:
            ragged = part[entry.name]
            each = int(ragged.counts[0])  # type: ignore[union-attr]
            values[first[rows, None] + np.arange(each)] = ragged.values.reshape(len(rows), each)  # type: ignore[union-attr]
        columns[entry.name] = Ragged(counts, values)
    return columns


class _Ascii:
    """Reads elements from text, one after the other."""

    def __init__(self, body: memoryview, path: PathLike) -> None:
        self.path, self.at = path, 0
        self.words = numbers(bytes(body).split(), path, "the PLY data")

    def read(self, element: _Element) -> dict[str, NDArray | Ragged]:
        # lists are mostly of one length throughout (triangles): then rows form a matrix
        sizes = self._sizes_at(element, self.at) if element.count else [0] * len(element.properties)
        lists = [entry.count_kind is not None for entry in element.properties]
        start = np.cumsum([0] + [size + is_list for size, is_list in zip(sizes, lists, strict=True)])
        rows = self.words[self.at : self.at + element.count * int(start[-1])]
        if rows.size < element.count * start[-1]:
            return self._walk(element)
        rows = rows.reshape(element.count, int(start[-1]))
        if not all((rows[:, start[k]] == sizes[k]).all() for k in range(len(sizes)) if lists[k]):
            return self._walk(element)
        self.at += rows.size
        columns: dict[str, NDArray | Ragged] = {}
        for k, entry in enumerate(element.properties):
            values = self._cast(rows[:, start[k] + lists[k] : start[k + 1]].reshape(-1), entry)
            columns[entry.name] = Ragged(np.full(element.count, sizes[k]), values) if lists[k] else values
        return columns

    def _sizes_at(self, element: _Element, at: int) -> list[int]:
        """Entries of each property in the row that begins at word `at`."""
        sizes = []
        for entry in element.properties:
            size = 1.0
            if entry.count_kind is not None:
                size = float(self._word(element, at))
                if not 0 <= size <= len(self.words) - at or size != int(size):
                    raise FileError(f"{self.path}: a list of {size:g} entries in element {element.name!r}")
                at += 1
            at += int(size)
            sizes.append(int(size))
        return sizes

    def _word(self, element: _Element, at: int) -> float:
        if at >= len(self.words):
            raise self._short(element)
        return self.words[at]

    def _walk(self, element: _Element) -> dict[str, NDArray | Ragged]:
        counts: list[list[int]] = [[] for _ in element.properties]
        chunks: list[list[NDArray[np.float64]]] = [[np.empty(0)] for _ in element.properties]
        for _ in range(element.count):
            for k, (size, entry) in enumerate(zip(self._sizes_at(element, self.at), element.properties, strict=True)):
                self.at += entry.count_kind is not None
                counts[k].append(size)
                chunks[k].append(self.words[self.at : self.at + size])
                self.at += size
            if self.at > len(self.words):
                raise self._short(element)
        columns: dict[str, NDArray | Ragged] = {}
        for k, entry in enumerate(element.properties):
            values = self._cast(np.concatenate(chunks[k]), entry)
            columns[entry.name] = Ragged(np.array(counts[k], np.int64), values) if entry.count_kind else values
        return columns

    def _short(self, element: _Element) -> FileError:
        return FileError(f"{self.path}: truncated: the data end inside element {element.name!r} of {element.count}")

    def _cast(self, values: NDArray[np.float64], entry: _Property) -> NDArray:
        """The declared type; a whole-number property must hold whole numbers within its range."""
        kind = entry.kind.newbyteorder("=")
        if kind.kind == "f":
            return np.ascontiguousarray(values)
        info = np.iinfo(kind)
        if not ((values >= info.min) & (values <= info.max) & (values == np.floor(values))).all():
            raise FileError(f"{self.path}: property {entry.name!r} holds numbers that are not of its type ({kind})")
        return values.astype(kind)
