"""Point clouds from tables: columns that a header, a file format or the numbers themselves name.

PCD and LAS files have files of their own; PLY files are read beside the meshes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..scene.points import Points
from .files import PathLike, read_bytes
from .table import read_table

_NAMES = {
    "position": (("x", "y", "z"), ("position_x", "position_y", "position_z"), ("px", "py", "pz")),
    "normal": (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"), ("normalx", "normaly", "normalz")),
    "color": (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b")),
}
_RADIUS = ("radius", "radii", "r")
_GREY = ("intensity", "scalar_intensity", "i", "reflectance", "gray", "grey")


def load_table(path: PathLike) -> list[Points]:
    """Read points from text: .xyz, .txt, .asc, .pts, .csv.

    One point a line; fields are separated by blanks, tabs, commas or semicolons; lines that begin with #, // or % are
    comments. A first line with the number of points is checked against those that follow.

    A header (also in a comment) names the columns: x y z, nx ny nz, red green blue or r g b, radius, intensity. Without
    one, columns 1–3 are the position; of those that follow, the first three in a row that are unit vectors are the
    normal and the first three in a row within 0…1 or whole numbers within 0…255 the colour. So x y z · r g b,
    x y z · nx ny nz · r g b, x y z · r g b · nx ny nz and x y z · intensity · r g b (with intensities beyond 0…255)
    are understood. Other columns are not used.

    Raises
    ------
    FileError
        A row has more or fewer fields than the first, holds no number, or there are fewer than three columns.
    """
    names, rows = read_table(read_bytes(path), path)
    if names is None:
        return [points_of_rows(rows, path)]
    return [points_of_columns({name: rows[:, k] for k, name in enumerate(names)}, path)]


def points_of_rows(rows: NDArray, path: PathLike) -> Points:
    """Points from columns without names (N, ≥ 3), by the rules of `load_table`."""
    normals = colors = None
    at = 3
    while at + 3 <= rows.shape[1]:
        triple = rows[:, at : at + 3]
        if normals is None and _is_unit(triple):
            normals, at = triple, at + 3
        elif colors is None and _is_color(triple):
            colors, at = triple, at + 3
        else:
            at += 1
    return make_points(rows[:, :3], normals, None if colors is None else unit_colors(colors, path))


def points_of_columns(columns: Mapping[str, NDArray], path: PathLike) -> Points:
    """Points from columns (N,) by their names, in upper or lower case."""
    columns = {name.strip().lower(): values for name, values in columns.items()}
    positions, normals, colors = (_pick(columns, _NAMES[what]) for what in ("position", "normal", "color"))
    if positions is None:
        found = ", ".join(columns)[:80] or "none"
        raise FileError(f"{path}: expected columns x, y and z, found {found}")
    radii = next((columns[n] for n in _RADIUS if n in columns and not (n == "r" and "g" in columns)), None)
    if colors is not None:
        colors = unit_colors(colors, path)
    elif (grey := next((columns[name] for name in _GREY if name in columns), None)) is not None:
        colors = grey_colors(grey)
    return make_points(positions, normals, colors, radii)


def make_points(
    positions: NDArray, normals: NDArray | None = None, colors: NDArray | None = None, radii: NDArray | None = None
) -> Points:
    """Points of a file: normals that are missing, NaN or of zero length are estimated, so are missing radii."""
    if normals is not None:
        normals = np.where(np.isfinite(normals).all(axis=1, keepdims=True), normals, 0.0)
        normals = normals if normals.any() else None
    return Points(positions, normals, radii, colors).with_normals()  # type: ignore[arg-type]  # None is welcome


def unit_colors(colors: NDArray, path: PathLike) -> NDArray[np.float64]:
    """Scale colours (N, 3 or 4) to 0…1 by the smallest of 1 (not for integers), 255 and 65535 that holds them.

    Fields of 16 bits are often filled with 8-bit colours.
    """
    values = np.asarray(colors, dtype=np.float64)[:, :3]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    if bad := np.count_nonzero(np.isnan(values)):
        raise FileError(f"{path}: expected colours in 0…1, 0…255 or 0…65535, found NaN in {bad:,} of {values.size:,}")
    if not (low >= 0 and high <= 65535):
        raise FileError(f"{path}: expected colours in 0…1, 0…255 or 0…65535, found {low:g}…{high:g}")
    if high <= 1.001 and colors.dtype.kind not in "iu":
        return np.minimum(values, 1.0)
    return values / (255.0 if high <= 255 else 65535.0)


def grey_colors(values: NDArray) -> NDArray[np.float64] | None:
    """Greys (N, 3) that show the 2nd to the 98th percentile of some measured values; None where they are all equal."""
    values = np.asarray(values, dtype=np.float64)
    low, high = np.nanpercentile(values, (2, 98)) if np.isfinite(values).any() else (0.0, 0.0)
    if not high > low:
        return None
    grey = 0.1 + 0.9 * np.clip(np.nan_to_num((values - low) / (high - low), nan=0.0), 0.0, 1.0)
    return np.repeat(grey[:, None], 3, axis=1)


def _pick(columns: Mapping[str, NDArray], choices: tuple[tuple[str, ...], ...]) -> NDArray | None:
    """The first complete choice of columns as an array (N, 3)."""
    for names in choices:
        if all(name in columns for name in names):
            return np.stack([columns[name] for name in names], axis=1)
    return None


def _is_unit(triple: NDArray) -> bool:
    """Whether the rows (N, 3) are unit vectors but for rounding; some may be zero or NaN."""
    length = np.linalg.norm(triple, axis=1)
    length = length[length > 0]
    return len(length) > 0 and bool((np.abs(length - 1.0) < 0.02).all())


def _is_color(triple: NDArray) -> bool:
    """Whether the rows (N, 3) can be colours: within 0…1, or whole numbers within 0…255."""
    if not (triple.size and triple.min() >= 0 and triple.max() <= 255):
        return False
    return bool(triple.max() <= 1 or (triple == np.floor(triple)).all())
