"""Volumes from TIFF stacks, by tifffile."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import DependencyError, FileError
from ..scene.appearance import Vector
from ..scene.volume import Volume
from .files import PathLike, check_start
from .volume import NO_HINTS, Hints, make_volume

# what tifffile logs about pages that it cannot find, or about a tag that pixels depend on (sizes, bits, offsets, …)
DAMAGE = re.compile(r"TiffPage|TiffFrame|TiffTag (25[6-9]|262|27[3789]|32[2-5]) ")


def load_tiff(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read a TIFF of several pages: x along a row, y downwards in the picture, z from page to page.

    Spacing comes from OME or ImageJ metadata, else it is 1. Times and channels of a hyperstack are frames.

    Raises
    ------
    DependencyError
        tifffile is not installed, or the file's compression needs imagecodecs.
    FileError
        The file is missing, damaged, truncated, a single or coloured picture, or none of its frames is chosen.
    """
    check_start(path)
    try:
        import tifffile
    except ImportError:
        raise DependencyError(f"{path}: needs tifffile: pip install autostereo[volumes]") from None
    try:
        with _logged() as damage, tifffile.TiffFile(path) as tiff:
            first = tiff.series[0]
            series = [first, *(one for one in tiff.series[1:] if not one.keyframe.is_reduced)]  # that is a thumbnail
            sizes = [f"{one.shape[-1]}×{one.shape[-2]}" for one in series]
            array, axes, read = first.asarray(), first.axes, 1
            page = (first.shape, first.dtype, "YX")
            if len(series) > 1 and all((one.shape, one.dtype, one.axes) == page for one in series):  # one by one
                array, axes, read = np.stack([one.asarray() for one in series]), "ZYX", len(series)
            spacing = _tiff_spacing(tiff)
    except MemoryError:
        raise
    except Exception as error:  # tifffile and its decoders raise many kinds
        if "imagecodecs" in str(error):
            raise DependencyError(f"{path}: its compression needs imagecodecs: pip install imagecodecs") from None
        reason = " ".join(str(error).split())[:160]
        raise FileError(f"{path}: is damaged, truncated or not a TIFF ({reason})") from error
    if damage:
        raise FileError(f"{path}: is damaged or truncated ({damage[0]})")
    if "S" in axes:
        raise FileError(f"{path}: is a picture in colour, expected one number a voxel")
    others = sorted(set(sizes[1:]) - {sizes[0]})
    if read < len(series) and first.kind in ("generic", "uniform", "shaped"):
        extra = f" beside {sizes[0]}: {', '.join(others[:3])}" if others else " or types"
        raise FileError(f"{path}: holds pictures of other sizes{extra}, expected a stack")
    if read < len(series):
        warnings.warn(f"{path}: holds {len(series)} series; the first is read", stacklevel=2)
    if array.ndim < 3:
        raise FileError(f"{path}: is one picture of {sizes[0]}, expected a stack")
    along = [k for k, axis in enumerate(axes) if axis not in "YX"]
    z = axes.index("Z") if "Z" in axes else along[-1]
    frames = [k for k in along if k != z]
    array = array.transpose([*frames, z, axes.index("Y"), axes.index("X")])
    array = array.reshape(-1, *array.shape[-3:])
    return [make_volume(array[hints.choose(len(array), path)], hints, spacing)]


@contextmanager
def _logged() -> Iterator[list[str]]:
    """Collect what tifffile logs of damage, instead of showing what it logs."""
    damage: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        text = " ".join(record.getMessage().split())
        if DAMAGE.search(text):
            damage.append(re.sub(r"<TiffTag.fromfile> raised \w+\('|'\)$|<tifffile\.|>", "", text)[:160])
        return False

    log = logging.getLogger("tifffile")
    log.addFilter(keep)
    try:
        yield damage
    finally:
        log.removeFilter(keep)


def _tiff_spacing(tiff: Any) -> Vector:
    """Spacing along x, y, z: OME's physical sizes, else ImageJ's, else 1."""
    if tiff.ome_metadata:
        sizes = [re.search(rf'PhysicalSize{axis}="([^"]+)"', tiff.ome_metadata) for axis in "XYZ"]
        x, y, z = (float(size.group(1)) if size else 0.0 for size in sizes)
    elif tiff.imagej_metadata:
        tags = tiff.pages[0].tags
        x, y = (_pixel_size(tags.get(name)) for name in ("XResolution", "YResolution"))
        z = float(tiff.imagej_metadata.get("spacing", 0.0))
    else:
        return 1.0, 1.0, 1.0
    x = x if x > 0 else 1.0
    return x, (y if y > 0 else x), (z if z > 0 else x)


def _pixel_size(tag: Any) -> float:
    """Units a pixel, from a tag of pixels a unit as a fraction; 0 if there is none."""
    above, below = tag.value if tag is not None else (0, 1)
    return below / above if above else 0.0
