"""Files to scenes and pictures. LOADERS and VOLUME_LOADERS list every format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ..errors import FileError, InputError
from ..image import as_path
from ..scene.scene import Scene, SceneObject
from .dicom import load_dicom, load_folder
from .files import PathLike
from .gltf import load_gltf
from .las import load_las
from .mesh import load_off, load_ply, load_stl
from .npy import load_npy, load_npz
from .obj import load_obj
from .pcd import load_pcd
from .points import load_table
from .raw import load_raw, load_vol
from .tiff import load_tiff
from .volume import NO_HINTS, Hints, load_itk
from .vtk import load_vti, load_vtk

LOADERS: dict[str, Callable[[PathLike], Sequence[SceneObject]]] = {
    ".ply": load_ply,
    ".obj": load_obj,
    ".stl": load_stl,
    ".off": load_off,
    ".glb": load_gltf,
    ".gltf": load_gltf,
    ".las": load_las,
    ".laz": load_las,
    ".pcd": load_pcd,
    ".xyz": load_table,
    ".pts": load_table,
    ".asc": load_table,
    ".txt": load_table,
    ".csv": load_table,
}
VOLUME_LOADERS: dict[str, Callable[[PathLike, Hints], Sequence[SceneObject]]] = {
    ".nrrd": load_itk,
    ".nhdr": load_itk,
    ".nii": load_itk,
    ".nii.gz": load_itk,
    ".mha": load_itk,
    ".mhd": load_itk,
    ".dcm": load_dicom,
    ".tif": load_tiff,
    ".tiff": load_tiff,
    ".vti": load_vti,
    ".vtk": load_vtk,
    ".vol": load_vol,
    ".raw": load_raw,
    ".npy": load_npy,
    ".npz": load_npz,
}


def load(
    *paths: PathLike,
    shape: tuple[int, int, int] | None = None,
    dtype: str | None = None,
    frame: int | None = None,
    spacing: tuple[float, float, float] | None = None,
) -> Scene:
    """Read one or more files into one Scene.

    Parameters
    ----------
    *paths : str or path
        Files of the formats that LOADERS and VOLUME_LOADERS list, or folders of DICOM slices or pictures; their
        objects share one world.
    shape, dtype : (3,) int and str, optional
        Voxels along x, y, z of .raw files, and their type, such as "uint8".
    frame : int, optional
        Which volume of a file that holds several, from 0.
    spacing : (3,) float, optional
        Distance of voxels along x, y, z, instead of the files'.

    Returns
    -------
    Scene
        The objects of all files in order, with the default light and background.

    Raises
    ------
    FileError
        A file is missing, of an unknown kind, truncated, or holds something that cannot be drawn. The message
        names the file.
    DependencyError
        The format needs a package that is not installed.
    """
    if not paths:
        raise InputError("load: expected at least one path")
    hints = Hints(shape, dtype, frame, spacing)
    objects: list[SceneObject] = []
    for path in paths:
        if not isinstance(path, (str, Path)) and not hasattr(path, "__fspath__"):
            raise InputError(f"load: expected a path, got {type(path).__name__}")
        if path == "":  # which Path takes for the current folder
            raise InputError("load: expected a path, got an empty text")
        path = as_path(path)
        try:
            with np.errstate(all="ignore"):  # broken numbers are found by the checks of the objects
                objects += _read(path, hints)
        except InputError as error:  # objects do not know where their arrays came from
            raise FileError(f"{path}: {error}") from error
        except MemoryError:
            raise FileError(f"{path}: there is not enough memory to read it") from None
    _check_used(hints, [Path(path) for path in paths])
    return Scene(tuple(objects))


def _read(path: Path, hints: Hints) -> Sequence[SceneObject]:
    """The objects of one file or folder."""
    if path.is_dir():
        return load_folder(path, hints)
    for suffix in ("".join(path.suffixes[-2:]).lower(), path.suffix.lower()):
        if suffix in VOLUME_LOADERS:
            return VOLUME_LOADERS[suffix](path, hints)
        if suffix in LOADERS:
            return LOADERS[suffix](path)
    if not path.exists():
        raise FileError(f"{path}: no such file")
    known = " ".join([*LOADERS, *VOLUME_LOADERS])
    raise FileError(f"{path}: unknown kind of file {path.suffix!r}; known are {known}")


def _check_used(hints: Hints, paths: list[Path]) -> None:
    """Refuse hints that no file has asked for."""
    suffixes = {path.suffix.lower() for path in paths}
    for name in ("shape", "dtype"):
        if getattr(hints, name) is not None and ".raw" not in suffixes:
            raise InputError(f"{name}: only .raw files need it")
    volumes = any(path.is_dir() or path.suffix.lower() in (*VOLUME_LOADERS, ".gz") for path in paths)
    if hints != NO_HINTS and not volumes:
        raise InputError("frame and spacing: only files of volumes take them")
