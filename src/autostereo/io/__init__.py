"""Files to scenes and pictures. LOADERS lists every format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ..errors import FileError, InputError
from ..scene.scene import Scene, SceneObject
from .files import PathLike
from .gltf import load_gltf
from .las import load_las
from .mesh import load_off, load_ply, load_stl
from .npy import load_npy, load_npz
from .obj import load_obj
from .pcd import load_pcd
from .points import load_table

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
    ".npy": load_npy,
    ".npz": load_npz,
}


def load(*paths: PathLike) -> Scene:
    """Read one or more files into one Scene.

    Parameters
    ----------
    *paths : str or path
        Files of the formats that LOADERS lists; their objects share one world.

    Returns
    -------
    Scene
        The objects of all files in order, with the default light and background.

    Raises
    ------
    FileError
        A file is missing, of an unknown kind, truncated, or holds something that cannot be drawn. The message
        names the file.
    """
    if not paths:
        raise InputError("load: expected at least one path")
    objects: list[SceneObject] = []
    for path in paths:
        if not isinstance(path, (str, Path)) and not hasattr(path, "__fspath__"):
            raise InputError(f"load: expected a path, got {type(path).__name__}")
        path = Path(path)
        loader = LOADERS.get(path.suffix.lower())
        if loader is None:
            if not path.exists():
                raise FileError(f"{path}: no such file")
            if path.is_dir():
                raise FileError(f"{path}: is a folder, not a file")
            raise FileError(f"{path}: unknown kind of file {path.suffix!r}; known are {' '.join(LOADERS)}")
        try:
            with np.errstate(all="ignore"):  # broken numbers are found by the checks of the objects
                objects += loader(path)
        except InputError as error:  # objects do not know where their arrays came from
            raise FileError(f"{path}: {error}") from error
        except MemoryError:
            raise FileError(f"{path}: there is not enough memory to read it") from None
    return Scene(tuple(objects))
