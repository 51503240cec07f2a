"""Volumes from folders: a series of DICOM slices, or numbered pictures."""

from __future__ import annotations

import math
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..scene.volume import Volume
from .files import PathLike, check_start
from .volume import NO_HINTS, Hints, check_unicode, clean, make_volume, silenced, simpleitk

PICTURES = (".tif", ".tiff", ".png")
NATIVE = ("1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2")  # transfer syntaxes that do not compress
PLACE = {"0020|0032": "ImagePositionPatient", "0020|0037": "ImageOrientationPatient", "0028|0030": "PixelSpacing"}
SCALE = {"0028|1052": "RescaleIntercept", "0028|1053": "RescaleSlope"}
EVEN = 0.05  # gaps between slices may differ by this part of the usual gap


@dataclass(frozen=True)
class _Slice:
    """Where a slice lies: its file, first pixel (3,), axes (3, 2) along a row and a column, spacing and number."""

    file: str
    origin: NDArray[np.float64]
    axes: NDArray[np.float64]
    spacing: tuple[float, float]
    size: tuple[int, int]
    instance: int
    missing: tuple[str, ...]  # what the file does not say of PLACE

    @property
    def normal(self) -> NDArray[np.float64]:
        return np.cross(self.axes[:, 0], self.axes[:, 1])


def load_folder(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read a folder: its DICOM series of most slices, else its TIFF or PNG pictures in the order of their numbers.

    Slices of DICOM are sorted along their normal; the world frame is LPS (see io/volume.py). Slices that share
    positions (a sequence in time, or several echoes) are frames, in the order of their instance numbers. A warning
    says so where there are several series, or files that are no slices or broken ones.

    Raises
    ------
    DependencyError
        SimpleITK is not installed.
    FileError
        There is no series; slices are missing, of different orientation, spacing or size, or cannot be read.
    """
    path = Path(path)
    if not any(path.iterdir()):
        raise FileError(f"{path}: is a folder, an empty one")
    sitk = simpleitk(path)
    with silenced(sitk):
        find = sitk.ImageSeriesReader
        series = {name: find.GetGDCMSeriesFileNames(str(path), name) for name in find.GetGDCMSeriesIDs(str(path))}
    for file in (file for files in series.values() for file in files):
        check_unicode(file)
    known = {Path(file).name for files in series.values() for file in files}
    lost = _left_out(path, known)
    if not series:
        return [_load_pictures(path, hints, lost)]
    longest = max(series.values(), key=len)
    if len(series) > 1:
        counts = ", ".join(str(len(files)) for files in sorted(series.values(), key=len, reverse=True))
        warnings.warn(f"{path}: holds {len(series)} series of {counts} slices; the longest is read", stacklevel=2)
    try:
        volume = _load_series(sitk, path, list(longest), hints)
    except FileError as error:
        raise FileError(f"{error} ({lost})" if lost else str(error)) from error
    if lost:
        warnings.warn(f"{path}: {lost}", stacklevel=2)
    return [volume]


def load_dicom(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read one DICOM file that holds several slices (enhanced CT or MR)."""
    check_start(path)
    sitk = simpleitk(path)
    return [_load_multiframe(sitk, Path(path), str(path), hints)]


def _left_out(path: Path, known: set[str]) -> str:
    """Which DICOM files of a folder are not among the `known` ones of its series, as a sentence; "" for none."""
    lost = sorted(file.name for file in path.iterdir() if file.name not in known and _is_dicom(file))
    more = f" and {len(lost) - 1} more are" if len(lost) > 1 else " is"
    return f"{lost[0]}{more} left out: no picture, damaged or truncated" if lost else ""


def _is_dicom(file: Path) -> bool:
    """Whether a file says, or its name does, that it is DICOM; the table of contents of a disc does not count."""
    if not file.is_file() or file.name.upper() == "DICOMDIR":
        return False
    if file.suffix.lower() == ".dcm":
        return True
    with file.open("rb") as opened:
        return opened.read(132)[128:] == b"DICM"


def _load_series(sitk: Any, path: Path, files: list[str], hints: Hints) -> Volume:
    with silenced(sitk):
        slices = [_locate(sitk, file) for file in files]
    if len(slices) == 1:
        return _load_multiframe(sitk, path, files[0], hints)
    first = slices[0]
    missing = {name: Path(item.file).name for item in reversed(slices) for name in item.missing}
    if "ImagePositionPatient" in missing:
        raise FileError(f"{path}: {missing['ImagePositionPatient']} does not say where it lies (ImagePositionPatient)")
    defaults = {"ImageOrientationPatient": "the patient's axes are", "PixelSpacing": f"{first.spacing[0]:g} is"}
    for name, default in defaults.items():
        if name in missing:
            warnings.warn(f"{path}: {missing[name]} has no {name}; {default} taken", stacklevel=2)
    for other in slices:
        if other.size != first.size:
            raise FileError(
                f"{path}: slices differ in size: {_times(first.size)} in {Path(first.file).name}, "
                f"{_times(other.size)} in {Path(other.file).name}"
            )
        if np.abs(other.axes - first.axes).max() > 1e-3:
            raise FileError(
                f"{path}: mixed orientations: {Path(first.file).name} and {Path(other.file).name} are not parallel"
            )
        if not np.allclose(other.spacing, first.spacing, rtol=1e-3):
            raise FileError(
                f"{path}: slices differ in spacing: {first.spacing} in {Path(first.file).name}, "
                f"{other.spacing} in {Path(other.file).name}"
            )
    frames = _sort(slices, path)
    chosen = frames[hints.choose(len(frames), path)]
    step = (chosen[-1].origin - chosen[0].origin) / (len(chosen) - 1)
    gap = float(np.linalg.norm(step))
    values = _read_slices(sitk, path, chosen)
    direction = np.column_stack([first.axes, step / gap])  # of a tilted gantry the third is not the normal
    place = {"origin": chosen[0].origin, "direction": direction, "anatomical": True}
    return make_volume(values, hints, (*first.spacing, gap), **place)


def _locate(sitk: Any, file: str) -> _Slice:
    """Read the header of a slice."""
    reader = sitk.ImageFileReader()
    reader.SetFileName(file)
    reader.SetImageIO("GDCMImageIO")
    try:
        reader.ReadImageInformation()
    except RuntimeError as error:
        raise FileError(f"{file}: is damaged or truncated ({clean(error)})") from None
    _check_pixels(reader, file)
    _check_place(reader, file)
    direction = np.reshape(reader.GetDirection(), (reader.GetDimension(), -1))[:3, :2]
    instance = reader.GetMetaData("0020|0013").strip() if reader.HasMetaDataKey("0020|0013") else ""
    size, spacing = reader.GetSize(), reader.GetSpacing()
    return _Slice(
        file,
        np.array(reader.GetOrigin()[:3]),
        direction,
        (spacing[0], spacing[1]),
        (size[0], size[1]),
        int(instance) if re.fullmatch(r"[+-]?\d+", instance) else 0,
        tuple(name for key, name in PLACE.items() if not reader.HasMetaDataKey(key)),
    )


def _check_pixels(reader: Any, file: str) -> None:
    """Refuse a file that holds fewer pixels than its header says: GDCM leaves the memory of the others as it is."""
    keys = ("0028|0010", "0028|0011", "0028|0100", "0028|0002", "0028|0008")  # rows, columns, bits, samples, frames
    told = [reader.GetMetaData(key).strip() if reader.HasMetaDataKey(key) else "1" for key in keys]
    data = Path(file).read_bytes()
    syntax = re.search(rb"\x02\x00\x10\x00UI..([0-9.]+)", data[:4096], re.DOTALL)
    if not syntax or syntax.group(1).decode() not in NATIVE or not all(re.fullmatch(r"\d+", word) for word in told):
        return
    wanted = (math.prod(map(int, told)) + 7) // 8
    # the element (7FE0,0010), which small pictures (icons) have too: with a type, or without one (the first syntax)
    little = [int.from_bytes(n, "little") for n in re.findall(rb"\xe0\x7f\x10\x00(?:O[BW]..)?(.{4})", data, re.DOTALL)]
    big = [int.from_bytes(n, "big") for n in re.findall(rb"\x7f\xe0\x00\x10O[BW]..(.{4})", data, re.DOTALL)]
    found = max((n for n in little + big if n <= len(data)), default=wanted)
    if found < wanted:
        raise FileError(f"{file}: is damaged or truncated: {wanted:,} bytes of pixels expected, found {found:,}")


def _check_place(reader: Any, file: str) -> None:
    """Refuse numbers without sense for place, spacing and scale, for which GDCM would take its defaults."""
    for key, name in {**PLACE, **SCALE}.items():
        text = reader.GetMetaData(key).strip(" \0") if reader.HasMetaDataKey(key) else ""
        if not text:
            continue
        try:
            value = np.array(text.split("\\"), dtype=np.float64)
        except ValueError:
            value = np.array([np.nan])
        good = len(value) == {"ImagePositionPatient": 3, "ImageOrientationPatient": 6, "PixelSpacing": 2}.get(name, 1)
        good = good and bool(np.isfinite(value).all())
        if good and name == "ImageOrientationPatient":
            good = float(np.linalg.norm(np.cross(value[:3], value[3:]))) > 0.5
        if not good or (name == "PixelSpacing" and value.min() <= 0) or (name == "RescaleSlope" and not value[0]):
            raise FileError(f"{file}: cannot use its {name}, '{' '.join(text.split())[:60]}'")


def _sort(slices: list[_Slice], path: Path) -> list[list[_Slice]]:
    """Frames of slices in ascending position along the normal; gaps must be even."""
    along = np.array([item.origin @ slices[0].normal for item in slices])
    order = np.lexsort((np.array([item.instance for item in slices]), along))
    sorted_along = along[order]
    new = np.concatenate([[True], np.diff(sorted_along) > 1e-3 * min(slices[0].spacing)])
    position = sorted_along[new]
    counts = np.diff(np.append(np.nonzero(new)[0], len(slices)))
    if len(position) == 1:
        raise FileError(f"{path}: its {len(slices)} slices all lie at one position")
    if (counts != counts[0]).any():
        raise FileError(
            f"{path}: slices are missing: {counts.max()} share a position, but only {counts.min()} "
            f"at {position[counts.argmin()]:g} along the normal"
        )
    gaps = np.diff(position)
    usual = float(np.sort(gaps)[(len(gaps) - 1) // 2])
    uneven = np.nonzero(np.abs(gaps - usual) > EVEN * usual)[0]
    if len(uneven):
        k = uneven[np.argmax(gaps[uneven])]
        raise FileError(
            f"{path}: slices are missing: after {position[k]:g} along the normal the next one is {gaps[k]:g} away, "
            f"usual are {usual:g}"
        )
    table = order.reshape(len(position), -1)
    return [[slices[k] for k in column] for column in table.T]


def _read_slices(sitk: Any, path: Path, slices: list[_Slice]) -> NDArray:
    """Values (nz, ny, nx) of slices of one size, each rescaled as its own header says."""
    planes = []
    for item in slices:
        try:
            with silenced(sitk):
                plane = sitk.GetArrayFromImage(sitk.ReadImage(item.file, imageIO="GDCMImageIO"))
        except RuntimeError as error:
            raise FileError(f"{item.file}: is damaged or truncated ({clean(error)})") from None
        plane = plane[0] if plane.ndim > 2 and len(plane) == 1 else plane
        if plane.shape != item.size[::-1]:
            raise FileError(f"{item.file}: expected one number a pixel of one slice, found an array {plane.shape}")
        planes.append(plane.astype(np.float32) if plane.dtype == np.float64 else plane)
    return np.stack(planes)


def _load_multiframe(sitk: Any, path: Path, file: str, hints: Hints) -> Volume:
    try:
        with silenced(sitk):
            _locate(sitk, file)
            image = sitk.ReadImage(file, imageIO="GDCMImageIO")
    except RuntimeError as error:
        raise FileError(f"{file}: is not DICOM, damaged or truncated ({clean(error)})") from None
    if image.GetNumberOfComponentsPerPixel() != 1:
        raise FileError(f"{file}: holds colours, expected one number a voxel")
    if image.GetDimension() != 3 or image.GetDepth() < 2:
        more = "expected a series" if path.is_dir() else "give the folder of its series"
        raise FileError(f"{path}: is one DICOM slice, {more}")
    hints.choose(1, path)
    direction = np.reshape(image.GetDirection(), (3, 3))
    values = sitk.GetArrayFromImage(image)
    place = {"origin": image.GetOrigin(), "direction": direction, "anatomical": True}
    return make_volume(values, hints, image.GetSpacing(), **place)


def _load_pictures(path: Path, hints: Hints, lost: str) -> Volume:
    """Read a folder of grey pictures: x along a row, y downwards in the picture, z from picture to picture.

    An error says `lost`, which DICOM files there are that cannot be used.
    """
    by_kind = {kind: [f for f in path.iterdir() if f.suffix.lower() == kind] for kind in PICTURES}
    files = max(by_kind.values(), key=len)
    if len(files) < 2:
        if lost:
            raise FileError(f"{path}: has no DICOM series that can be read ({lost})")
        raise FileError(f"{path}: is a folder without a DICOM series or a stack of pictures ({' '.join(PICTURES)})")
    files.sort(key=lambda file: [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", file.name.lower())])
    import SimpleITK as sitk  # noqa: N813

    planes = []
    for file in files:
        check_start(file)
        try:
            with silenced(sitk):
                planes.append(sitk.GetArrayFromImage(sitk.ReadImage(str(file))))
        except RuntimeError as error:
            raise FileError(f"{file}: cannot be read ({clean(error)})") from None
        if planes[-1].ndim != 2:
            raise FileError(f"{file}: expected a grey picture, found an array {planes[-1].shape}")
        if planes[-1].shape != planes[0].shape:
            raise FileError(
                f"{file}: is {_times(planes[-1].shape[::-1])}, but {files[0].name} {_times(planes[0].shape[::-1])}"
            )
    hints.choose(1, path)
    return make_volume(np.stack(planes), hints)


def _times(size: tuple[int, ...]) -> str:
    return "×".join(map(str, size))
