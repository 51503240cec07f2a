"""Whole files into memory, with errors that name the file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ..image import as_path

PathLike = str | os.PathLike[str]
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # of UTF-8; editors on Windows write it


def read_bytes(path: PathLike, asked_by: PathLike | None = None, limit: int = -1) -> bytes:
    """Return the contents of a file that is not empty and not a web page.

    Parameters
    ----------
    path : path
        The file to read.
    asked_by : path, optional
        The file that refers to it; an error names it too.
    limit : int
        Read no more than these first bytes, ≥ 256; −1: all.

    Raises
    ------
    FileError
        The file is missing, a folder, unreadable, empty, or an HTML page or a Git LFS pointer in place of the data.
    """
    path = as_path(path) if asked_by is None else Path(path)
    name = f"{path}" if asked_by is None else f"{asked_by}: needs {path}, which"
    try:
        if path.is_dir():
            raise FileError(f"{name} is a folder, expected a file" if asked_by else f"{path}: is a folder, not a file")
        if limit < 0:
            data = path.read_bytes()
        else:
            with path.open("rb") as file:
                data = file.read(limit)
    except FileNotFoundError:
        raise FileError(f"{name} does not exist" if asked_by else f"{path}: no such file") from None
    except PermissionError:
        raise FileError(f"{name} may not be read" if asked_by else f"{path}: no permission to read it") from None
    except (OSError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        reason = getattr(error, "strerror", None) or error
        what = f"cannot be read ({reason})"
        raise FileError(f"{name} {what}" if asked_by else f"{path}: {what}") from None
    if not data:
        raise FileError(f"{name} is empty" if asked_by else f"{path}: the file is empty")
    start = data[:256].lstrip(BYTE_ORDER_MARK + b" \t\r\n").lower()
    if start.startswith((b"<!doctype html", b"<html")):
        raise FileError(f"{path}: is a web page (HTML), not the file itself; download it again")
    if start.startswith(b"version https://git-lfs"):
        raise FileError(f"{path}: is a Git LFS pointer, not the file itself; run git lfs pull")
    return data


def read_text(path: PathLike) -> bytes:
    """Return the contents of a file that is, or begins as, text: those of `read_bytes` without a byte order mark."""
    return read_bytes(path).removeprefix(BYTE_ORDER_MARK)


def check_start(path: PathLike) -> None:
    """Raise a FileError for a file that is missing, empty, a web page, …, without reading all of it."""
    read_bytes(path, limit=256)


def numbers(words: Sequence[bytes], path: PathLike, what: str) -> NDArray[np.float64]:
    """Return text words as float64 (N,); `what` is what they are, for the error."""
    try:
        return np.array(words, dtype=np.float64).reshape(len(words))
    except (ValueError, OverflowError) as error:
        bad = next((word for word in words if not _is_number(word)), b"")
        raise FileError(
            f"{path}: expected numbers for {what}, found {bad[:32].decode('ascii', 'replace')!r}"
        ) from error


def whole_numbers(words: Sequence[bytes], path: PathLike, what: str) -> NDArray[np.int64]:
    """Return text words as int64 (N,)."""
    try:
        return np.array(words, dtype=np.int64).reshape(len(words))
    except (ValueError, OverflowError):
        pass
    value = numbers(words, path, what)
    if not (np.abs(value) < 2**53).all() or (value != np.floor(value)).any():
        raise FileError(f"{path}: expected whole numbers for {what}")
    return value.astype(np.int64)


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
