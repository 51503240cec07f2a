"""NumPy files: tables are point clouds, arrays of three axes are volumes."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..scene.points import Points
from ..scene.volume import Volume
from .files import PathLike, read_bytes
from .points import make_points, points_of_columns, points_of_rows, unit_colors
from .volume import NO_HINTS, Hints, make_volume

_POSITIONS = ("positions", "points", "means3d", "means", "xyz", "vertices")
_NORMALS = ("normals", "normal")
_COLORS = ("colors", "colours", "color", "rgb", "rgbs")
_RADII = ("radii", "radius")


def load_npy(path: PathLike, hints: Hints = NO_HINTS) -> list[Points | Volume]:
    """Read a .npy file.

    (N, 3…10) is a point cloud with the columns that `load_table` describes, a structured array (N,) one with named
    columns; (nz, ny, nx) is a volume of unit spacing, (frames, nz, ny, nx) several.
    """
    array = read_arrays(path)
    if array.dtype.names is not None:
        if array.ndim != 1 or not len(array):
            raise FileError(f"{path}: expected a structured array (N,), got {array.shape}")
        return [points_of_columns({name: array[name] for name in array.dtype.names}, path)]
    return [_object(array, path, hints)]


def load_npz(path: PathLike, hints: Hints = NO_HINTS) -> list[Points | Volume]:
    """Read a .npz file.

    Points have a key positions, points, means3d, means, xyz or vertices, (N, 3), and may have normals (N, 3),
    colors or rgb (N, 3 or 4) and radii (N,) or a number. A file without such a key must hold one array, read as from
    .npy, or one with three axes: a volume.
    """
    arrays = {name.lower(): array for name, array in read_arrays(path).items()}
    positions, normals, colors, radii = (
        next((arrays[name] for name in names if name in arrays), None)
        for names in (_POSITIONS, _NORMALS, _COLORS, _RADII)
    )
    if positions is None:
        volumes = {name: array for name, array in arrays.items() if array.ndim in (3, 4)}
        only = list((volumes or arrays).values())
        if len(only) == 1:
            return [_object(only[0], path, hints)]
        found = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise FileError(f"{path}: expected an array positions (N, 3), or one volume; found {found[:160] or 'nothing'}")
    for name, array in (("normals", normals), ("colors", colors)):
        if array is not None and (array.ndim != 2 or len(array) != len(positions) or array.shape[1] not in (3, 4)):
            raise FileError(f"{path}: {name}: expected shape ({len(positions)}, 3), got {array.shape}")
    return [make_points(positions, normals, None if colors is None else unit_colors(colors, path), radii)]


def _object(array: NDArray, path: PathLike, hints: Hints) -> Points | Volume:
    """A point cloud or a volume, by the number of axes."""
    if array.dtype.kind not in "biuf":
        raise FileError(f"{path}: expected numbers, found an array of {array.dtype}")
    if array.ndim == 2 and 3 <= array.shape[1] <= 10:
        return points_of_rows(array, path)
    if array.ndim in (3, 4):
        frames = array if array.ndim == 4 else array[None]
        return make_volume(frames[hints.choose(len(frames), path)], hints)
    raise FileError(
        f"{path}: expected points (N, 3…10) or a volume (nz, ny, nx), found an array of shape {array.shape}"
    )


def read_arrays(path: PathLike) -> Any:
    """Read the array of a .npy file, or those of a .npz file by name."""
    data = read_bytes(path)
    if data[:6] != b"\x93NUMPY" and data[:2] != b"PK":
        raise FileError(f"{path}: is not a NumPy file")
    try:
        found = np.load(BytesIO(data), allow_pickle=False)
        return found if isinstance(found, np.ndarray) else {name: found[name] for name in found.files}
    except MemoryError:
        raise
    except Exception as error:  # zip, zlib and NumPy raise many kinds
        if "allow_pickle" in str(error):
            raise FileError(f"{path}: holds Python objects, expected numbers") from None
        raise FileError(f"{path}: is damaged or truncated ({' '.join(str(error).split())[:120]})") from error
