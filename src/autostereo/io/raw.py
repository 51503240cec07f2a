"""Volumes without a header that says enough, or with a few lines of text: .raw and .vol."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..errors import FileError
from ..scene.volume import Volume
from .files import PathLike, read_bytes
from .volume import NO_HINTS, TYPES, Hints, make_volume, parse_dtype

# as in tooth_103x94x161_uint8.raw, the names of the Open SciVis Datasets
NAME = re.compile(rf"(?P<x>\d+)x(?P<y>\d+)x(?P<z>\d+)_(?P<type>{'|'.join(TYPES)})(?![0-9a-z])", re.IGNORECASE)


def load_raw(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read voxels without a header, x fastest; shape and type from `hints` or a name like x_64x64x32_uint8.raw.

    A file that holds the shape several times over holds as many frames.

    Raises
    ------
    FileError
        The file is missing, its shape or type is not known, or its size does not fit them.
    """
    path = Path(path)
    data = read_bytes(path)
    shape, name = hints.shape, hints.dtype
    if (named := NAME.search(path.name)) is not None:
        shape = shape or (int(named["x"]), int(named["y"]), int(named["z"]))
        name = name or named["type"]
    if shape is None or name is None:
        missing = [] if shape else ["--shape, such as 64x64x32"]
        missing += [] if name else ["--dtype, such as uint8"]
        told = f"{len(data):,} bytes{_guess(len(data))}"
        raise FileError(f"{path}: a raw file ({told}) does not say what it holds: give {' and '.join(missing)}")
    dtype = parse_dtype(name)
    voxels = int(np.prod(shape, dtype=np.int64))
    size = voxels * dtype.itemsize
    frames = len(data) // size if len(data) % size == 0 else 0
    if frames == 0:
        told = f"{'×'.join(map(str, shape))} {dtype.name}"
        raise FileError(f"{path}: {told} takes {size:,} bytes, the file has {len(data):,}{_guess(len(data))}")
    frame = hints.choose(frames, path)
    values = np.frombuffer(data, dtype, voxels, frame * size).reshape(shape[::-1])
    return [make_volume(values, hints)]


def _guess(size: int) -> str:
    """A cube that would fit, for the error."""
    for name in ("uint8", "uint16", "float32"):
        side = round((size / np.dtype(name).itemsize) ** (1 / 3))
        if side**3 * np.dtype(name).itemsize == size:
            return f", as many as {side}×{side}×{side} {name} would take"
    return ""


def load_vol(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read a .vol file: lines "Name: value", a line ".", then voxels, x fastest (WebLego's form of the VolVis data).

    X, Y, Z are the shape, Voxel-Size the bytes of a voxel (1 or 2), Voxel-Endian 0 little, 1 big, Dist-X, -Y, -Z
    the spacing.

    Raises
    ------
    FileError
        The file is missing, of another form, or its size does not fit its header.
    """
    data = read_bytes(path)
    end = re.search(rb"^\.\r?\n", data[:4096], re.MULTILINE)
    if end is None:
        raise FileError(f"{path}: expected lines such as 'X: 64' up to a line '.', then voxels")
    header = dict(re.findall(r"^([\w-]+)\s*:\s*(.*?)\s*$", data[: end.start()].decode("latin-1"), re.MULTILINE))
    try:
        shape = tuple(int(header[name]) for name in "XYZ")
        size, big = int(header.get("Voxel-Size", 1)), header.get("Voxel-Endian", "0") not in ("0", "")
        spacing = tuple(float(header.get(f"Dist-{name}", 1.0)) for name in "XYZ")
    except (KeyError, ValueError):
        raise FileError(f"{path}: expected whole numbers X, Y, Z and Voxel-Size in the header") from None
    if min(shape) < 1 or size not in (1, 2):
        raise FileError(f"{path}: expected X, Y, Z ≥ 1 and Voxel-Size 1 or 2, got {shape} and {size}")
    wanted, found = int(np.prod(shape, dtype=np.int64)) * size, len(data) - end.end()
    if found < wanted:
        raise FileError(f"{path}: truncated: {'×'.join(map(str, shape))} voxels take {wanted:,} bytes, found {found:,}")
    dtype = np.dtype(np.uint8 if size == 1 else (">u2" if big else "<u2"))
    values = np.frombuffer(data, dtype, wanted // size, end.end()).reshape(shape[::-1])
    hints.choose(1, path)
    return [make_volume(values, hints, spacing)]
