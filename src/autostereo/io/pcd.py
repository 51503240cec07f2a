"""Point clouds in PCD files of the Point Cloud Library, version 0.5–0.7: ASCII, binary and compressed."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..scene.points import Points
from .files import PathLike, numbers, read_text
from .points import points_of_columns

_KINDS = {"F": "f", "I": "i", "U": "u"}


@dataclass(frozen=True)
class _Header:
    record: np.dtype  # of one point; fields that only fill space are named _0, _1 …
    count: int
    organised: bool
    data: str
    start: int


def load_pcd(path: PathLike) -> list[Points]:
    """Read a PCD file: positions, normals, rgb or rgba (packed), intensity and radius.

    An organised cloud (HEIGHT > 1) is a picture of a depth sensor, where NaN stands for "nothing measured": these
    points are left out. In other clouds NaN is an error. VIEWPOINT is not applied.

    Raises
    ------
    FileError
        The file is not PCD, ends before what its header announces, or holds no usable point.
    """
    data = read_text(path)
    header = _header(data, path)
    body = memoryview(data)[header.start :]
    if header.data == "ascii":
        columns = _ascii(bytes(body), header, path)
    elif header.data == "binary":
        columns = _binary(body, header, path)
    else:
        columns = _compressed(body, header, path)
    if header.organised and all(name in columns for name in "xyz"):
        seen = np.isfinite([columns[name] for name in "xyz"]).all(axis=0)
        if not seen.any():
            raise FileError(f"{path}: none of its {header.count} points has a position (all are NaN)")
        columns = {name: values[seen] for name, values in columns.items()}
    for name in ("rgb", "rgba"):
        if name in columns:
            columns |= dict(zip(("red", "green", "blue"), _unpacked(columns.pop(name)), strict=True))
    return [points_of_columns(columns, path)]


def _header(data: bytes, path: PathLike) -> _Header:
    found = re.search(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", data[:65536], re.MULTILINE)
    if found is None or not re.search(rb"^FIELDS[ \t]", data[: found.start()], re.MULTILINE):
        raise FileError(f"{path}: is not a PCD file, it has no header with FIELDS and DATA")
    lines = data[: found.start()].decode("ascii", "replace").splitlines()
    entries = {line.split()[0]: line.split()[1:] for line in lines if line.strip() and not line.startswith("#")}
    try:
        fields, sizes = entries["FIELDS"], entries["SIZE"]
        counts = [int(count) for count in entries.get("COUNT", ["1"] * len(fields))]
        kinds = [f"<{_KINDS[kind]}{int(size)}" for kind, size in zip(entries["TYPE"], sizes, strict=True)]
        width, height = int(entries["WIDTH"][0]), int(entries["HEIGHT"][0])
        count = int(entries.get("POINTS", [str(width * height)])[0])
        names = [name if fields.count(name) == 1 and name != "_" else f"_{k}" for k, name in enumerate(fields)]
        record = np.dtype(list(zip(names, kinds, [(n,) for n in counts], strict=True)))
    except (KeyError, ValueError, IndexError, TypeError):
        raise FileError(f"{path}: the PCD header is not understood (FIELDS SIZE TYPE COUNT WIDTH HEIGHT)") from None
    if count < 1:
        raise FileError(f"{path}: the PCD file has no points")
    kind = found[1].decode("ascii", "replace").lower()
    if kind not in ("ascii", "binary", "binary_compressed"):
        raise FileError(f"{path}: expected PCD data ascii, binary or binary_compressed, found {kind!r}")
    return _Header(record, count, height > 1, kind, found.end())


def _ascii(body: bytes, header: _Header, path: PathLike) -> dict[str, NDArray]:
    fields = [(name, header.record[name].base, header.record[name].shape[0]) for name in header.record.names or ()]
    width = sum(count for _, _, count in fields)
    words = body.split()
    if len(words) < header.count * width:
        raise _truncated(path, header.count, f"{len(words) // width}")
    rows = numbers(words[: header.count * width], path, "PCD points").reshape(header.count, width)
    columns, at = {}, 0
    for name, kind, count in fields:
        if count == 1:
            values = rows[:, at]
            if kind.kind in "iu":
                values = np.where(np.isfinite(values), values, 0)
            columns[name] = values.astype(kind)
        at += count
    return columns


def _binary(body: memoryview, header: _Header, path: PathLike) -> dict[str, NDArray]:
    if len(body) < header.count * header.record.itemsize:
        raise _truncated(path, header.count, f"{len(body) // header.record.itemsize}")
    rows = np.frombuffer(body, header.record, header.count)
    return {name: rows[name][:, 0] for name in header.record.names or () if rows[name].shape[1] == 1}


def _compressed(body: memoryview, header: _Header, path: PathLike) -> dict[str, NDArray]:
    """Columns one after the other, compressed as a whole, behind the sizes of both forms."""
    size = header.count * header.record.itemsize
    packed, unpacked = (int(n) for n in np.frombuffer(body[:8], "<u4")) if len(body) >= 8 else (1, size)
    if unpacked != size:
        raise FileError(f"{path}: the PCD header announces {size} bytes of points, the data {unpacked}")
    if len(body) < 8 + packed:
        raise FileError(f"{path}: truncated: {packed} bytes of compressed points are announced, found {len(body) - 8}")
    raw = bytes(body[8:]) if packed == size else unpack_lzf(bytes(body[8 : 8 + packed]), size)
    if raw is None:
        raise FileError(f"{path}: the compressed points are damaged")
    columns, at = {}, 0
    for name in header.record.names or ():
        kind, count = header.record[name].base, header.record[name].shape[0]
        if count == 1:
            columns[name] = np.frombuffer(raw, kind, header.count, at)
        at += header.count * count * kind.itemsize
    return columns


def unpack_lzf(data: bytes, size: int) -> bytes | None:
    """Unpack `size` bytes of LZF (M. Lehmann's LibLZF), None where the data are damaged."""
    out = bytearray()
    at, end = 0, len(data)
    try:
        while at < end:
            control = data[at]
            at += 1
            if control < 32:  # so many literals, less one
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            back = ((control & 31) << 8) + data[at] + 1
            at += 1
            length += 2
            start = len(out) - back
            if start < 0:
                return None
            if back >= length:
                out += out[start : start + length]
            else:  # it overlaps what it writes
                out += (out[start:] * (length // back + 1))[:length]
    except IndexError:
        return None
    return bytes(out) if len(out) == size else None


def _unpacked(packed: NDArray) -> NDArray[np.uint8]:
    """Red, green, blue (3, N) of 0xAARRGGBB in 32 bits, which PCL writes as a float of these bits."""
    bits = packed.astype(np.float32).view(np.uint32) if packed.dtype.kind == "f" else packed.astype(np.uint32)
    return np.stack([bits >> 16, bits >> 8, bits]).astype(np.uint8)


def _truncated(path: PathLike, wanted: int, found: str) -> FileError:
    return FileError(f"{path}: truncated: the PCD header announces {wanted} points, found {found}")
