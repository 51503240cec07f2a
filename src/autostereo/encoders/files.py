"""One door to write what a render returned: the file's name says what becomes of it."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import InputError
from ..frame import Panel, ViewStack
from ..image import IMAGE_SUFFIXES, as_path, write_image
from .quilt import pack_quilt, parse_quilt_name
from .video import ANIMATION_SUFFIXES, save_animation


def save(picture: Panel | ViewStack, path: str | os.PathLike[str], fps: float | None = None) -> Path:
    """Write a panel or a view stack as its file name asks.

    ============================  =======================================================
    panel to an image suffix      that image (png and webp are lossless)
    views to no suffix            a folder of view_000.png, view_001.png, …
    views to .npz                 arrays `color` and `depth`
    views to …_qs8x6a0.75.png     a quilt of 8 × 6 tiles (any image suffix)
    views to .gif .webp .mp4      a looping animation at `fps` frames a second
    ============================  =======================================================

    Returns
    -------
    Path
        What was written.

    Raises
    ------
    InputError
        A suffix that does not go with the picture.
    FileError
        The file cannot be written; nothing is left behind.
    """
    path = as_path(path)
    suffix = path.suffix.lower()
    if isinstance(picture, Panel):
        return picture.save(path)
    if not isinstance(picture, ViewStack):
        raise InputError(f"save: expected a Panel or a ViewStack, got {type(picture).__name__}")
    quilt = parse_quilt_name(path) if suffix in IMAGE_SUFFIXES else None
    if quilt is not None:
        return write_image(path, pack_quilt(picture, quilt.columns, quilt.rows))
    if suffix in ANIMATION_SUFFIXES:
        return save_animation(path, picture, fps)
    if suffix in ("", ".npz"):
        return picture.save(path)
    raise InputError(
        f"{path}: expected for views a folder, .npz, {' '.join(ANIMATION_SUFFIXES)}, or a quilt's name such as "
        f"bunny_qs8x6a0.75.png, got {path.suffix!r}"
    )
