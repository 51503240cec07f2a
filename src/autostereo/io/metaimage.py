"""Checks of MetaImage files, whose reader in ITK takes its defaults for numbers without sense, ignores broken zlib, and
believes a wrong CompressedDataSize.

Fields are those of the MetaIO documentation: https://itk.org/Wiki/ITK/MetaIO/Documentation.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..errors import FileError
from ..temporary import scratch_folder
from .files import check_start, numbers, whole_numbers

HEADER = 1 << 20  # bytes of a file in which its header must end
SIZES = {"CHAR": 1, "SHORT": 2, "INT": 4, "LONG": 4, "LONG_LONG": 8, "FLOAT": 4, "DOUBLE": 8}


@contextmanager
def checked_metaimage(path: Path) -> Iterator[Path]:
    """Give the header by which ITK reads `path` right: itself, or one with the true size of its compressed voxels.

    Raises
    ------
    FileError
        The header has no sense, or there is less data than it says.
    """
    fields, start, listed = _read_header(path)
    size = _check_fields(path, fields)
    channels = fields.get("ElementNumberOfChannels", b"1").split()
    wanted = math.prod(size) * math.prod(map(int, channels)) * _bytes_of(path, fields)
    name = fields["ElementDataFile"].decode("utf-8", "replace")
    local = name.upper() == "LOCAL"
    files = [path] if local else [path.parent / other for other in _names(path, name, listed, size)]
    start = start if local else 0
    binary = fields.get("BinaryData", b"True")[:1] in b"Tt1"
    packed = binary and fields.get("CompressedData", b"False")[:1] in b"Tt1"
    part = wanted // len(files)
    length = 0
    for file in files:
        if not os.path.isfile(file):  # so for names that none can have
            state = "is a folder" if os.path.isdir(file) else "does not exist"
            raise FileError(f"{path}: needs {file}, which {state}")
        length, found = _unpack(path, file, start) if packed else (0, file.stat().st_size - start)
        if binary and (found < part or (packed and found > part)):
            sizes = f"{part:,} bytes of voxels expected, found {found:,}"
            raise FileError(f"{_where(path, file)} is damaged or truncated: {sizes}")
    if not packed or len(files) > 1 or fields.get("CompressedDataSize") == str(length).encode():
        yield path
        return
    with scratch_folder() as folder:
        header = folder / "header.mhd"
        del fields["ElementDataFile"]  # which ends the header
        fields |= {"CompressedDataSize": str(length).encode(), "ElementDataFile": b"voxels.zraw"}
        lines = [key.encode() + b" = " + value for key, value in fields.items()]
        header.write_bytes(b"\n".join(lines) + b"\n")
        with files[0].open("rb") as source, (folder / "voxels.zraw").open("wb") as target:
            source.seek(start)
            shutil.copyfileobj(source, target)
        yield header


def _read_header(path: Path) -> tuple[dict[str, bytes], int, list[bytes]]:
    """Fields up to the last, ElementDataFile; where it ends, and the lines after it."""
    check_start(path)
    with path.open("rb") as file:
        data = file.read(HEADER)
    fields: dict[str, bytes] = {}
    end = 0
    for line in data.splitlines(keepends=True):
        end += len(line)
        if not (found := re.match(rb"\s*(\w+)\s*[=:]\s*(.*?)\s*$", line, re.DOTALL)):
            if line.strip():
                break
            continue
        fields[found.group(1).decode("latin-1")] = found.group(2)
        if found.group(1) == b"ElementDataFile":
            return fields, end, data[end:].split(b"\n")
    raise FileError(f"{path}: is not a MetaImage file, damaged, or truncated: its header has no ElementDataFile")


def _check_fields(path: Path, fields: dict[str, bytes]) -> list[int]:
    """Refuse numbers without sense; returns DimSize."""
    whole = {}
    for name in ("NDims", "DimSize", "ElementNumberOfChannels"):
        if name not in fields and name != "ElementNumberOfChannels":
            raise FileError(f"{path}: its header has no {name}")
        whole[name] = whole_numbers(fields.get(name, b"1").split(), path, name).tolist()
        if not whole[name] or min(whole[name]) < 1 or (name != "DimSize" and len(whole[name]) > 1):
            raise FileError(f"{path}: cannot use its {_shown(name, fields[name])}")
    (axes,) = whole["NDims"]
    if len(whole["DimSize"]) != axes:
        raise FileError(f"{path}: expected {axes} numbers (NDims), found {_shown('DimSize', fields['DimSize'])}")
    square = ("TransformMatrix", "Rotation", "Orientation")
    for name in ("ElementSpacing", "ElementSize", "Offset", "Position", "Origin", *square):
        if name not in fields:
            continue
        value = numbers(fields[name].split(), path, name)
        good = len(value) == (axes * axes if name in square else axes) and bool(np.isfinite(value).all())
        if good and name in square:
            good = abs(float(np.linalg.det(value.reshape(axes, axes)))) > 0
        if not good or (name.startswith("Element") and value.min() <= 0):
            raise FileError(f"{path}: cannot use its {_shown(name, fields[name])}")
    return list(whole["DimSize"])


def _where(path: Path, file: Path) -> str:
    return f"{path}:" if file == path else f"{path}: {file.name}"


def _shown(name: str, value: bytes) -> str:
    return f"{name} = {value[:60].decode('ascii', 'replace')}"


def _bytes_of(path: Path, fields: dict[str, bytes]) -> int:
    """Bytes of a number."""
    name = fields.get("ElementType", b"").decode("latin-1").upper()
    found = re.fullmatch(r"MET_(U?)(\w+?)(_ARRAY)?", name)
    if not found or found.group(2) not in SIZES:
        raise FileError(f"{path}: expected a type such as MET_FLOAT, found {_shown('ElementType', name.encode())}")
    return SIZES[found.group(2)]


def _names(path: Path, name: str, listed: list[bytes], size: list[int]) -> list[str]:
    """Files of the voxels: one, a list of one a slice, or numbered ones, as "name%03d.raw first last step"."""
    if re.match(r"LIST\b", name):
        names = [line.decode("utf-8", "replace").strip() for line in listed if line.strip()]
        inner = re.search(r"\d+", name)
        wanted = math.prod(size[int(inner.group()) if inner else len(size) - 1 :])
        if len(names) < wanted:
            raise FileError(f"{path}: expected a list of {wanted} files, found {len(names)}")
        return names[:wanted]
    if "%" not in name:
        return [name]
    pattern, *limits = name.split()
    try:
        first, last, step = [int(word) for word in limits] + [1, size[-1], 1][len(limits) :]
        return [pattern % k for k in range(first, last + 1, step)][: size[-1]] or [pattern]
    except (TypeError, ValueError):
        raise FileError(f"{path}: cannot use its {_shown('ElementDataFile', name.encode())}") from None


def _unpack(path: Path, file: Path, start: int) -> tuple[int, int]:
    """Bytes of the compressed voxels of a file from `start` on, and of what they unpack to."""
    packed = zlib.decompressobj(wbits=47)  # zlib or gzip
    length = size = 0
    with file.open("rb") as opened:
        opened.seek(start)
        try:
            while not packed.eof and (part := opened.read(1 << 16)):
                length += len(part)
                size += len(packed.decompress(part))
        except zlib.error as error:
            raise FileError(f"{_where(path, file)} holds damaged compressed voxels ({error})") from None
    if not packed.eof:
        raise FileError(f"{_where(path, file)} is truncated within its compressed voxels")
    return length - len(packed.unused_data), size
