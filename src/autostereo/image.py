"""Image files, written to a temporary name beside the target and then renamed."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .checks import shown
from .errors import FileError, InputError
from .temporary import holding
from .wording import no_folder

IMAGE_SUFFIXES = (".png", ".webp", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
MAX_SIDE = {".webp": 16383, ".jpg": 65500, ".jpeg": 65500, ".gif": 65535, ".mp4": 16384}  # pixels that encoders take


def as_path(path: object) -> Path:
    """Return the name of a file, which need not exist, as a Path.

    Raises
    ------
    InputError
        It is of a type that names no file, or an empty text, which `Path` takes for the current folder.
    FileError
        The system refuses the name: it is too long, has a NUL or half a surrogate pair, or leads where none may look.
    """
    if isinstance(path, str) and not path:
        raise InputError("path: expected the name of a file, got an empty text")
    try:
        name = Path(path)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(f"path: expected the name of a file, got {type(path).__name__}") from None
    try:
        os.stat(name)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "reason", None) or error
        expected = "expected the name of a file, which the system refuses"
        raise FileError(f"{shown(str(name))}: {expected} ({reason})") from None
    return name


def write_atomic(path: str | os.PathLike[str], write: Callable[[BinaryIO], object]) -> Path:
    """Let `write` fill a temporary file in the folder of `path`, then rename it to `path`.

    Raises
    ------
    FileError
        The folder does not exist or cannot be written. Nothing is left behind.
    """
    path = as_path(path)
    folder = path.parent
    if not folder.is_dir():
        raise FileError(f"{path}: {no_folder(folder)}")
    if path.is_dir():
        raise FileError(f"{path}: expected a file name, found a folder")
    try:
        with holding(folder / f".{path.name[:32]}.{secrets.token_hex(4)}.part") as temporary:
            with open(temporary, "wb") as file:
                write(file)
            os.replace(temporary, path)
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror or error})") from error
    return path


def check_side(path: Path, width: int, height: int) -> None:
    """Raise InputError for a picture that is larger than its format allows."""
    limit = MAX_SIDE.get(path.suffix.lower())
    if limit is not None and max(width, height) > limit:
        raise InputError(f"{path}: {path.suffix} takes at most {limit} pixels a side, got {width}×{height}")


def write_image(path: str | os.PathLike[str], pixels: NDArray[np.uint8]) -> Path:
    """Write (H, W, 3|4) uint8 pixels, rows from the top; the suffix chooses the format.

    PNG is compressed at level 1: at panel sizes a higher level costs seconds and saves a few per cent.
    """
    from PIL import Image

    path = as_path(path)
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise InputError(f"{path}: expected an image suffix ({' '.join(IMAGE_SUFFIXES)}), got {path.suffix!r}")
    pixels = np.ascontiguousarray(pixels)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] not in (3, 4):
        raise InputError(f"pixels: expected (H, W, 3 or 4) uint8, got {pixels.shape} {pixels.dtype}")
    check_side(path, pixels.shape[1], pixels.shape[0])
    image = Image.fromarray(pixels)
    of_kind: dict[str, dict[str, Any]] = {".png": {"compress_level": 1}, ".webp": {"lossless": True, "method": 0}}
    options = of_kind.get(path.suffix.lower(), {"quality": 95})
    if path.suffix.lower() in (".jpg", ".jpeg"):
        image = image.convert("RGB")
        options["subsampling"] = 0  # chroma subsampling would mix neighbouring views
    kind = Image.registered_extensions()[path.suffix.lower()]
    return write_atomic(path, lambda file: image.save(file, format=kind, **options))  # type: ignore[arg-type]
