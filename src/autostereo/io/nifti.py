"""Checks of NIfTI files, of whose header ITK's reader mends what has no sense, and takes zeros for what is missing."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import FileError

# size of the header → where pixdim and vox_offset are, and their types (nifti1.h, nifti2.h)
LAYOUT = {348: (76, "f4", 108, "f4"), 540: (104, "f8", 168, "i8")}


def check_nifti(path: Path, reader: Any) -> None:
    """Refuse a damaged or truncated NIfTI file, NaN in it, and a header without sense; `reader` has read the latter."""
    start, order = _check_header(path)
    bits = int(reader.GetMetaData("bitpix"))
    wanted = start + int(np.prod(reader.GetSize())) * bits // 8
    floats = int(reader.GetMetaData("datatype")) in (16, 64)
    if not floats and path.suffix.lower() != ".gz":
        found, bad = path.stat().st_size, 0
    else:
        found, bad = _scan(path, start, np.dtype(f"{order}f{bits // 8}") if floats else None)
    if found < wanted:
        raise FileError(f"{path}: truncated: {wanted:,} bytes expected, found {found:,}")
    if bad:
        raise FileError(f"{path}: expected finite numbers, found NaN or infinity in {bad:,} voxels")


def _open(path: Path) -> BinaryIO:
    return gzip.open(path) if path.suffix.lower() == ".gz" else open(path, "rb")  # type: ignore[return-value]


def _check_header(path: Path) -> tuple[int, str]:
    """Where the voxels begin, and the order of bytes."""
    try:
        with _open(path) as file:
            header = file.read(540)
    except (OSError, EOFError, zlib.error) as error:
        raise FileError(f"{path}: is damaged or truncated ({error})") from None
    order = "<" if header[:1] in (b"\x5c", b"\x1c") else ">"  # the low byte of the header's size
    size = int(np.frombuffer(header, f"{order}i4", 1)[0])
    if size not in LAYOUT or len(header) < size:
        raise FileError(f"{path}: is damaged or truncated, its header is not one of NIfTI")
    at, kind, start_at, start_kind = LAYOUT[size]
    pixdim = np.frombuffer(header, order + kind, 4, at)[1:]
    start = np.frombuffer(header, order + start_kind, 1, start_at)[0]
    if not np.isfinite(pixdim).all() or not pixdim.all():
        raise FileError(f"{path}: cannot use its voxels' size (pixdim), {', '.join(f'{x:g}' for x in pixdim)}")
    if not np.isfinite(start) or start < 0:
        raise FileError(f"{path}: cannot use the place of its voxels (vox_offset), {start:g}")
    return max(int(start), size), order


def _scan(path: Path, start: int, kind: np.dtype | None) -> tuple[int, int]:
    """Bytes of a file, as far as it can be unpacked, and how many numbers of `kind` from `start` on are not finite.

    Raises
    ------
    FileError
        What is compressed is damaged; the sums at its end are compared too.
    """
    bad = 0
    try:
        with _open(path) as file:
            size = len(file.read(start))
            while part := file.read(1 << 22):
                size += len(part)
                if kind:
                    numbers = np.frombuffer(part, kind, len(part) // kind.itemsize)
                    bad += int(np.count_nonzero(~np.isfinite(numbers)))
    except EOFError:
        pass  # truncated
    except (OSError, zlib.error) as error:
        raise FileError(f"{path}: is damaged ({error})") from None
    return size, bad
