"""Laser scans: LAS and LAZ files, read by laspy."""

from __future__ import annotations

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
    try:
        import laspy
    except ImportError:
        raise DependencyError(f"{path}: LAS and LAZ need laspy: pip install autostereo[las]") from None
    packed = len(data) > 104 and bool(data[104] & 0x80)  # LASzip sets this bit of the point format
    if packed and not laspy.LazBackend.detect_available():
        raise DependencyError(f"{path}: LAZ needs lazrs: pip install autostereo[las]")
    try:
        scan = laspy.read(BytesIO(data))
        announced = scan.header.point_count
        withheld = np.asarray(scan.withheld, dtype=bool)
        scan.points = scan.points[~withheld]
        positions = np.stack([scan.x, scan.y, scan.z], axis=1)
    except MemoryError:
        raise
    except Exception as error:  # laspy and its decoders raise many kinds, also of their own
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
