"""Volumes of VTK: image data in XML (.vti) and legacy structured points (.vtk).

Reference: VTK file formats, https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

import base64
import lzma
import re
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, UnsupportedError
from ..scene.volume import Volume
from .files import PathLike, numbers, read_bytes, read_text, whole_numbers
from .volume import NO_HINTS, Hints, make_volume

_LEGACY = {
    "unsigned_char": "u1",
    "char": "i1",
    "signed_char": "i1",
    "unsigned_short": "u2",
    "short": "i2",
    "unsigned_int": "u4",
    "int": "i4",
    "float": "f4",
    "double": "f8",
}
_XML = {
    "UInt8": "u1", "Int8": "i1", "UInt16": "u2", "Int16": "i2", "UInt32": "u4", "Int32": "i4",
    "UInt64": "u8", "Int64": "i8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_UNPACK: dict[str, Callable[[bytes], bytes]] = {
    "vtkZLibDataCompressor": zlib.decompress,
    "vtkLZMADataCompressor": lzma.decompress,
}


# --- legacy --------------------------------------------------------------------------------------------------------
def load_vtk(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read a legacy .vtk file that holds STRUCTURED_POINTS with one scalar a point, binary or text.

    Raises
    ------
    FileError
        The file is missing, truncated, or holds something else.
    """
    data = read_text(path)
    if not data.startswith(b"# vtk DataFile"):
        raise FileError(f"{path}: is not a legacy VTK file, it does not begin with '# vtk DataFile'")
    start = re.search(rb"^\s*(SCALARS[ \t]+.*)\n(?:[ \t]*LOOKUP_TABLE.*\n)?", data, re.MULTILINE | re.IGNORECASE)
    head = data[: start.start() if start else 4096].decode("latin-1").splitlines()
    words = {line.split()[0].upper(): line.split()[1:] for line in head[2:] if line.split()}
    kind = words.get("DATASET", ["nothing"])[:1]
    if kind != ["STRUCTURED_POINTS"]:
        raise FileError(f"{path}: holds {' '.join(kind)}, expected STRUCTURED_POINTS; convert it to .vti or .nrrd")
    if start is None:
        raise FileError(f"{path}: has no SCALARS of points, expected one number a point")
    shape = whole_numbers(_three(words, ("DIMENSIONS",), "1 1 1"), path, "DIMENSIONS")
    spacing = numbers(_three(words, ("SPACING", "ASPECT_RATIO"), "1 1 1"), path, "SPACING")
    origin = numbers(_three(words, ("ORIGIN",), "0 0 0"), path, "ORIGIN")
    if len(shape) != 3 or shape.min() < 1 or len(spacing) != 3 or len(origin) != 3:
        raise FileError(f"{path}: expected three numbers for DIMENSIONS (≥ 1), SPACING and ORIGIN")
    fields = start.group(1).decode("latin-1").split()
    type_name = fields[2].lower() if len(fields) > 2 else ""
    if type_name not in _LEGACY or (len(fields) > 3 and fields[3] != "1") or "CELL_DATA" in words:
        raise FileError(f"{path}: expected one number a point ({', '.join(_LEGACY)}), found {' '.join(fields)}")
    count = int(np.prod(shape))
    if "ASCII" in words:
        text = data[start.end() :].split(None, count)[:count]
        if len(text) < count:
            raise FileError(f"{path}: truncated: expected {count:,} numbers, found {len(text):,}")
        values = numbers(text, path, "scalars").astype(_LEGACY[type_name])
    else:
        dtype = np.dtype(">" + _LEGACY[type_name])
        wanted, found = count * dtype.itemsize, len(data) - start.end()
        if found < wanted:
            raise FileError(f"{path}: truncated: expected {wanted:,} bytes of scalars, found {found:,}")
        values = np.frombuffer(data, dtype, count, start.end())
    hints.choose(1, path)
    return [make_volume(values.reshape(shape[::-1]), hints, spacing, origin=origin)]


def _three(words: dict[str, list[str]], names: tuple[str, ...], default: str) -> list[bytes]:
    found = next((words[name] for name in names if name in words), default.split())
    return [word.encode() for word in found]


# --- XML -----------------------------------------------------------------------------------------------------------
def load_vti(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read a .vti file: the active (else the first) scalars of the points of one piece of image data.

    Text, base64 and appended data are read, compressed by zlib or LZMA or not at all.

    Raises
    ------
    UnsupportedError
        The data are in several pieces, or compressed by LZ4.
    FileError
        The file is missing, damaged, truncated, or holds something else.
    """
    data = read_bytes(path)
    root, appended = _parse(data, path)
    image = root.find("ImageData")
    if root.get("type") != "ImageData" or image is None:
        raise FileError(f"{path}: holds {root.get('type') or root.tag}, expected ImageData")
    pieces = image.findall("Piece")
    if len(pieces) != 1:
        raise UnsupportedError(f"{path}: holds {len(pieces)} pieces, expected one; save it unpartitioned")
    points = pieces[0].find("PointData")
    arrays = [] if points is None else points.findall("DataArray")
    scalars = [array for array in arrays if array.get("NumberOfComponents", "1") == "1" and array.get("type") in _XML]
    if not scalars or points is None:
        raise FileError(f"{path}: has no array of one number a point")
    chosen = next((array for array in scalars if array.get("Name") == points.get("Scalars")), scalars[0])
    extent = whole_numbers(_words(pieces[0].get("Extent")), path, "Extent")
    spacing, origin, direction = (
        numbers(_words(image.get(name, default)), path, name)
        for name, default in (("Spacing", "1 1 1"), ("Origin", "0 0 0"), ("Direction", "1 0 0 0 1 0 0 0 1"))
    )
    if [len(x) for x in (extent, spacing, origin, direction)] != [6, 3, 3, 9] or (extent[1::2] < extent[::2]).any():
        raise FileError(f"{path}: expected Extent, Spacing, Origin and Direction of 6, 3, 3 and 9 numbers")
    shape = extent[1::2] - extent[::2] + 1
    values = _array(chosen, root, appended, path)
    if len(values) < np.prod(shape):
        raise FileError(f"{path}: truncated: expected {np.prod(shape):,} voxels, found {len(values):,}")
    hints.choose(1, path)
    matrix = direction.reshape(3, 3)
    first = origin + matrix @ (extent[::2] * spacing)  # Origin is where index 0 would be
    values = values[: np.prod(shape)].reshape(shape[::-1])
    return [make_volume(values, hints, spacing, origin=first, direction=matrix)]


def _parse(data: bytes, path: PathLike) -> tuple[ET.Element, tuple[str, bytes]]:
    """The XML tree, and the encoding and bytes of the appended data (which need not be XML)."""
    appended = ("raw", b"")
    found = re.search(rb"<AppendedData([^>]*)>\s*_", data)
    if found:
        encoding = b"base64" if b"base64" in found.group(1) else b"raw"
        end = data.rfind(b"</AppendedData>")
        appended = (encoding.decode(), data[found.end() : end if end > 0 else len(data)])
        data = data[: found.start()] + b"</VTKFile>"
    try:
        root = ET.fromstring(data)
    except ET.ParseError as error:
        raise FileError(f"{path}: is not XML, damaged or truncated ({error})") from None
    if root.tag != "VTKFile":
        raise FileError(f"{path}: is not a VTK file, its first element is {root.tag}")
    return root, appended


def _words(text: str | None) -> list[bytes]:
    return (text or "").encode().split()


def _array(element: ET.Element, root: ET.Element, appended: tuple[str, bytes], path: PathLike) -> NDArray:
    """The numbers of a DataArray (N,)."""
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    dtype = np.dtype(order + _XML[element.get("type", "")])
    kind = element.get("format", "ascii")
    if kind == "ascii":
        return numbers(_words(element.text), path, "the data").astype(dtype)
    header = np.dtype(order + ("u8" if root.get("header_type") == "UInt64" else "u4"))
    encoding, block = "base64", "".join((element.text or "").split()).encode()
    if kind == "appended":
        encoding, whole = appended
        block = whole[int(element.get("offset", "0")) :]
    decode = _base64 if encoding == "base64" else _raw
    compressor = root.get("compressor")
    if compressor and compressor not in _UNPACK:
        raise UnsupportedError(f"{path}: is compressed by {compressor}; save it with zlib or none")
    try:
        raw = _blocks(block, decode, header, _UNPACK[compressor]) if compressor else _whole(block, decode, header)
        return np.frombuffer(raw, dtype, len(raw) // dtype.itemsize)
    except (ValueError, zlib.error, lzma.LZMAError) as error:
        raise FileError(f"{path}: its data are damaged or truncated ({error})") from None


Decode = Callable[[bytes, int], tuple[bytes, int]]


def _raw(data: bytes, size: int) -> tuple[bytes, int]:
    """The first `size` bytes, and how many bytes of `data` they took."""
    if len(data) < size:
        raise ValueError(f"{size:,} bytes expected, {len(data):,} found")
    return data[:size], size


def _base64(data: bytes, size: int) -> tuple[bytes, int]:
    """The same where the bytes are encoded."""
    used = -(-size // 3) * 4
    part, _ = _raw(base64.b64decode(data[:used]), size)
    return part, used


def _whole(data: bytes, decode: Decode, header: np.dtype) -> bytes:
    """Uncompressed data: their size and they, encoded together."""
    size = int(np.frombuffer(decode(data, header.itemsize)[0], header)[0])
    return decode(data, header.itemsize + size)[0][header.itemsize :]


def _blocks(data: bytes, decode: Decode, header: np.dtype, unpack: Callable[[bytes], bytes]) -> bytes:
    """Compressed data: count, size, last size and packed sizes of the blocks, encoded together; then all blocks."""
    count = int(np.frombuffer(decode(data, header.itemsize)[0], header)[0])
    head, used = decode(data, header.itemsize * (3 + count))
    sizes = np.frombuffer(head, header)[3:].astype(np.int64)
    packed, _ = decode(data[used:], int(sizes.sum()))
    ends = np.cumsum(sizes)
    return b"".join(unpack(packed[end - size : end]) for size, end in zip(sizes.tolist(), ends.tolist(), strict=True))
