"""Laser scans: LAS and LAZ files, read by laspy."""

from __future__ import annotations

import struct
from io import BytesIO

import numpy as np

from ..errors import DependencyError, FileError
from ..scene.points import Points
from .files import PathLike, read_bytes
from .points import grey_colors, make_points, unit_colors


def load_las(path: PathLike) -> list[Points]:
    """Read a LAS or LAZ file: positions in full precision; colours, else greys of the intensity.

    Points that the file marks as withheld are left out. Colours that fill 8 of their 16 bits are scaled as such.

    Raises
    ------
    DependencyError
        laspy, or its decoder lazrs, is not installed.
    FileError
        The file is not LAS, damaged or truncated, or holds no points.
    """
    data = read_bytes(path)
    if data[:4] != b"LASF":
        raise FileError(f"{path}: is not a LAS or LAZ file, it does not begin with 'LASF'")
    packed = _is_packed(data, path)
    try:
        import laspy
    except ImportError:
        raise DependencyError(f"{path}: LAS and LAZ need laspy: pip install autostereo[las]") from None
    # the parallel decoder sets aside what a damaged header says, and aborts the process where that is too much
    decoders = tuple(kind for kind in laspy.LazBackend.detect_available() if kind != laspy.LazBackend.LazrsParallel)
    if packed and not decoders:
        raise DependencyError(f"{path}: LAZ needs lazrs: pip install autostereo[las]")
    try:
        scan = laspy.read(BytesIO(data), laz_backend=decoders)
        announced = scan.header.point_count
        withheld = np.asarray(scan.withheld, dtype=bool)
        scan.points = scan.points[~withheld]
        positions = np.stack([scan.x, scan.y, scan.z], axis=1)
    except (MemoryError, KeyboardInterrupt, SystemExit):
        raise
    except laspy.errors.PointFormatNotSupported as error:
        raise FileError(f"{path}: has points of format {error}, expected 0 to 10; damaged?") from None
    except BaseException as error:  # laspy raises many kinds, and a panic of lazrs is no Exception
        reason = " ".join(str(error).split())[:120]
        raise FileError(f"{path}: is damaged or truncated ({reason})") from error
    if len(withheld) < announced:
        raise FileError(f"{path}: truncated: {announced} points are announced, found {len(withheld)}")
    if not len(positions):
        raise FileError(f"{path}: has no points")
    colors = None
    if "red" in scan.point_format.dimension_names:
        colors = np.stack([np.asarray(scan[name]) for name in ("red", "green", "blue")], axis=1)
    if colors is None or not colors.any():  # often a scan has the fields, but no colours
        return [make_points(positions, colors=grey_colors(np.asarray(scan.intensity)))]
    return [make_points(positions, colors=unit_colors(colors, path))]


def _is_packed(data: bytes, path: PathLike) -> bool:
    """Whether the points are compressed; raise a FileError where the header announces more than the file can hold.

    Otherwise laspy would read on for hours. Offsets are those of the public header block (LAS 1.4 R15, table 3),
    which 1.0 to 1.3 share as far as they go.
    """
    if len(data) < 227:
        raise FileError(f"{path}: truncated: the LAS header alone takes 227 bytes, found {len(data)}")
    header, start, records = struct.unpack_from("<HII", data, 94)
    kind, size, count = struct.unpack_from("<BHI", data, 104)
    more_at = more = 0
    if data[25] >= 4 and len(data) >= 255:
        more_at, more, count = struct.unpack_from("<QIQ", data, 235)
    packed = bool(kind & 0x80)  # LASzip sets this bit of the point format
    # a chunk of 50,000 points begins with one that is not packed, so that 100,000 to one is out of reach
    if start > len(data) or count * size > (len(data) - start) * (100_000 if packed else 1):
        raise FileError(f"{path}: truncated: {len(data)} bytes cannot hold the {count} points that are announced")
    if header + 54 * records > start or (more and more_at + 60 * more > len(data)):
        raise FileError(f"{path}: is damaged or truncated, {records + more} variable length records do not fit")
    if packed:
        _check_chunks(data, start, path)
    return packed


def _check_chunks(data: bytes, start: int, path: PathLike) -> None:
    """Raise a FileError unless the table of compressed chunks is in the file; lazrs aborts the process for a huge one.

    Its place is told by the first 8 bytes of the points, or by the last of the file where those hold −1.
    """
    end = len(data) - 8
    at = struct.unpack_from("<q", data, start)[0] if start <= end else -2
    if at == -1:
        at = struct.unpack_from("<q", data, end)[0]
    if not start <= at <= end or struct.unpack_from("<I", data, at + 4)[0] > len(data):
        raise FileError(f"{path}: is damaged or truncated, the table of its compressed points is missing")
