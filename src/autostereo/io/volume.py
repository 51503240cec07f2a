"""Volumes from medical and microscopy files: NRRD, NIfTI and MetaImage by SimpleITK.

World frame. NIfTI and NRRD files say where patient left, posterior and superior are; ITK turns every such file into
one frame, LPS: x to the patient's left, y to posterior, z to superior (a NIfTI header itself is written for RAS: its
x and y are negated); their volumes are `anatomical`. Lengths are what the file says, usually millimetres. Files that
know of no patient (MetaImage, VTK, TIFF, raw) keep their own axes: x along a row, y from row to row, z from slice to
slice.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Vector, check_vector
from ..errors import DependencyError, FileError, InputError
from ..scene.volume import Volume
from ..temporary import scratch_folder
from .files import PathLike, check_start, read_bytes
from .metaimage import checked_metaimage
from .nifti import check_nifti

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")


def parse_dtype(text: str) -> np.dtype:
    """Return the type of a voxel: uint8 … float64, little-endian unless it is called like ">u2" or "uint16be"."""
    name = str(text).strip().lower()
    order = "<"
    if name.endswith(("be", "le")):
        name, order = name[:-2], ">" if name.endswith("be") else "<"
    try:
        found = np.dtype(name)
    except (TypeError, ValueError):
        found = np.dtype(bool)
    if found.name not in TYPES:
        raise InputError(f"dtype: expected one of {', '.join(TYPES)} (big-endian: uint16be), got {text!r}")
    return found if name[0] in "<>" else found.newbyteorder(order)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Hints:
    """What a file of voxels may not say itself.

    Parameters
    ----------
    shape : (3,) int, optional
        Voxels along x, y, z of a .raw file.
    dtype : str, optional
        Type of its voxels, such as "uint8", "int16" or ">u2".
    frame : int, optional
        Which volume of a file that holds several (4-D), from 0.
    spacing : (3,) float, optional
        Distance of voxels along x, y, z, instead of the file's.
    """

    shape: tuple[int, int, int] | None = None
    dtype: str | None = None
    frame: int | None = None
    spacing: Vector | None = None

    def __post_init__(self) -> None:
        if self.shape is not None:
            shape = np.asarray(self.shape)
            if shape.shape != (3,) or shape.dtype.kind not in "iu" or shape.min() < 1:
                raise InputError(f"shape: expected three whole numbers ≥ 1 (x, y, z), got {self.shape!r}")
            object.__setattr__(self, "shape", tuple(int(n) for n in shape))
        if self.dtype is not None:
            parse_dtype(self.dtype)
        if self.frame is not None and (
            isinstance(self.frame, bool) or not isinstance(self.frame, (int, np.integer)) or self.frame < 0
        ):
            raise InputError(f"frame: expected a whole number from 0, got {self.frame!r}")
        if self.spacing is not None:
            object.__setattr__(self, "spacing", check_vector("spacing", self.spacing))
            if min(self.spacing) <= 0:
                raise InputError(f"spacing: expected numbers > 0, got {self.spacing}")

    def choose(self, frames: int, path: PathLike) -> int:
        """Return the index of the frame to read of `frames`."""
        if frames == 0:
            raise FileError(f"{path}: holds no voxels")
        if self.frame is None:
            if frames == 1:
                return 0
            raise FileError(f"{path}: holds {frames} frames; choose one, --frame 0 … {frames - 1}")
        if self.frame >= frames:
            raise FileError(f"{path}: has no frame {self.frame}, it holds {frames} (from 0)")
        return self.frame


NO_HINTS = Hints()


def make_volume(values: NDArray, hints: Hints, spacing: Any = (1.0, 1.0, 1.0), **place: Any) -> Volume:
    """Return a Volume of values (nz, ny, nx) from a file, in a type that volumes have.

    float64 becomes float32 (scaled integers come as float64), and so do integers that need more than 16 bits.
    """
    if values.dtype.kind == "f" and values.dtype.itemsize > 4:
        values = values.astype(np.float32)  # what is too large for it becomes infinite, which Volume refuses
    elif values.dtype.kind in "iu" and values.dtype.itemsize > 2 and values.size:
        low, high = int(values.min()), int(values.max())
        if high - max(low, 0) > 65535 or high > 65535 or low < -32768 or (low < 0 and high > 32767):
            values = values.astype(np.float32)
    spacing = tuple(float(x) for x in spacing) if hints.spacing is None else hints.spacing
    return Volume(values, spacing=spacing, **place)


def simpleitk(path: PathLike) -> Any:
    """Return SimpleITK to read `path` with, or say how to install it."""
    check_unicode(path)
    try:
        import SimpleITK
    except ImportError:
        raise DependencyError(f"{path}: needs SimpleITK: pip install autostereo[volumes]") from None
    return SimpleITK


def check_unicode(path: PathLike) -> None:
    """Raise a FileError for a name that is no Unicode: SimpleITK ends the process over it."""
    try:
        os.fspath(path).encode()
    except UnicodeEncodeError:
        raise FileError(f"{str(path)!r}: expected a name in UTF-8, as SimpleITK does; rename the file") from None


@contextmanager
def silenced(sitk: Any) -> Iterator[None]:
    """Keep ITK and the C libraries below it from writing to stderr; what they say comes as an exception too."""
    shown = sitk.ProcessObject.GetGlobalWarningDisplay()
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        saved, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    except OSError:  # there is no stderr
        saved = nowhere = -1
    try:
        if saved >= 0:
            os.dup2(nowhere, 2)
        yield
    finally:
        if saved >= 0:
            os.dup2(saved, 2)
            os.close(saved)
            os.close(nowhere)
        sitk.ProcessObject.SetGlobalWarningDisplay(shown)


def clean(error: Exception) -> str:
    """The last sentence of a SimpleITK error, without addresses, source lines and names of functions."""
    lines = [line.strip() for line in str(error).split("ERROR:")[-1].splitlines() if line.strip()]
    text = lines[-1] if lines else str(error)
    text = re.sub(r"^(\[\w+\]|\w+\(0x[0-9a-f]+\):|_?nrrd\w*:|Read\w*:|Reason:|\s)+", "", text)
    return text[:200] or "unknown reason"


# --- SimpleITK -----------------------------------------------------------------------------------------------------
def load_itk(path: PathLike, hints: Hints = NO_HINTS) -> list[Volume]:
    """Read a .nrrd, .nhdr, .nii, .nii.gz, .mha or .mhd file.

    The world frame is ITK's (see above). Files of more than three axes hold frames: `hints.frame` chooses.

    Raises
    ------
    DependencyError
        SimpleITK is not installed.
    FileError
        The file is missing, damaged, truncated, holds colours, or several frames and none is chosen.
    """
    path = Path(path)
    check_start(path)
    sitk = simpleitk(path)
    same = checked_metaimage if path.suffix.lower() in (".mha", ".mhd") else nullcontext
    try:
        with same(path) as header, silenced(sitk):
            return [_read_itk(sitk, header, path, hints)]
    except RuntimeError as error:
        if "ScalarWithSpace" not in str(error):
            raise FileError(f"{path}: {_reason(path, error)}") from None
    try:
        with without_space(path) as header, silenced(sitk):
            return [_read_itk(sitk, header, path, hints)]
    except RuntimeError as error:
        raise FileError(f"{path}: {_reason(path, error)}") from None


def _read_itk(sitk: Any, file: Path, path: Path, hints: Hints) -> Volume:
    """Read `file` by SimpleITK; errors name `path`."""
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(file))
    reader.ReadImageInformation()
    size, axes = list(reader.GetSize()), reader.GetDimension()
    if (numbers := reader.GetNumberOfComponents()) != 1:
        raise FileError(f"{path}: holds {numbers} numbers a voxel (colours or vectors), expected one")
    if axes < 3:
        raise FileError(f"{path}: is a picture of {'×'.join(map(str, size))}, expected a volume")
    frames = int(np.prod(size[3:]))
    frame = hints.choose(frames, path)
    if path.name.lower().endswith((".nii", ".nii.gz")):
        check_nifti(path, reader)
    if axes > 3:
        later = np.unravel_index(frame, size[3:], order="F")
        reader.SetExtractSize([*size[:3], *[0] * (axes - 3)])
        reader.SetExtractIndex([0, 0, 0, *map(int, later)])
    values = sitk.GetArrayFromImage(reader.Execute())
    direction = np.reshape(reader.GetDirection(), (axes, axes))[:3, :3]
    place = {"origin": reader.GetOrigin()[:3], "direction": direction, "anatomical": _is_anatomical(reader)}
    return make_volume(values, hints, reader.GetSpacing()[:3], **place)


def _is_anatomical(reader: Any) -> bool:
    """Whether a file says how its axes lie in a patient."""
    known = {name: reader.GetMetaData(name) for name in reader.GetMetaDataKeys()}
    if "NRRD_space" in known:
        return bool(re.match(r"(left|right)-(anterior|posterior)-|[LR][AP]S", known["NRRD_space"]))
    return any(known.get(name, "0").strip() not in ("", "0") for name in ("qform_code", "sform_code"))


def _reason(path: Path, error: Exception) -> str:
    """What is wrong with a file, from SimpleITK's error."""
    if "Unable to determine ImageIO reader" in str(error):
        return f"is not a {'.nii.gz' if path.suffix.lower() == '.gz' else path.suffix} file, damaged, or truncated"
    if "determinant is 0" in str(error):
        return "cannot use the directions of its axes, which are not independent"
    return f"cannot be read ({clean(error)})"


@contextmanager
def without_space(path: Path) -> Iterator[Path]:
    """Give an NRRD header that reads the data of `path`, without the field `space`.

    A header with a space and per-axis spacings is against the format, but it is found; ITK refuses it.
    """
    data = read_bytes(path)
    header = re.split(rb"\r?\n\r?\n", data, maxsplit=1)[0].decode("latin-1").splitlines()
    lines = [line for line in header if not re.match(r"space( dimension)?:", line)]
    detached = next((k for k, line in enumerate(lines) if re.match(r"data ?file:", line)), None)
    if detached is None:
        lines += [f"line skip: {len(header) + 1}", f"data file: {path.resolve()}"]
    else:
        name = lines[detached].split(":", 1)[1].strip()
        lines[detached] = f"data file: {path.parent.resolve() / name}"
    with scratch_folder() as folder:
        patched = folder / "header.nhdr"
        patched.write_text("\n".join(lines) + "\n\n", encoding="latin-1")
        yield patched
