"""Files to scenes and pictures. LOADERS lists every format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import FileError, InputError
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from .files import PathLike
from .gltf import load_gltf
from .mesh import load_off, load_ply, load_stl
from .obj import load_obj

LOADERS: dict[str, Callable[[PathLike], list[Mesh]]] = {
    ".ply": load_ply,
    ".obj": load_obj,
    ".stl": load_stl,
    ".off": load_off,
    ".glb": load_gltf,
    ".gltf": load_gltf,
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
    objects: list[Mesh] = []
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
        except InputError as error:  # a Mesh does not know where its arrays came from
            raise FileError(f"{path}: {error}") from error
        except MemoryError:
            raise FileError(f"{path}: there is not enough memory to read it") from None
    return Scene(tuple(objects))
