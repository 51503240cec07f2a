"""Tables of numbers in text files: the separator and a header are found by looking."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from .files import PathLike, numbers

_COMMENT = (b"#", b"//", b"%")


def read_table(data: bytes, path: PathLike) -> tuple[list[str] | None, NDArray[np.float64]]:
    """Return the names of the columns in lower case, None without a header, and the rows (N, C).

    Raises
    ------
    FileError
        The text is empty or binary, a row has more or fewer fields than the first, or a field is not a number.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", "replace").encode()
    if b"\0" in data[:4096]:
        raise FileError(f"{path}: expected a table of numbers in text, found binary data")
    lines = data.removeprefix(b"\xef\xbb\xbf").splitlines()
    first, comment = _first_row(lines)
    if first == len(lines):
        raise FileError(f"{path}: has no rows of numbers")
    names, announced = None, None
    head = _fields(lines[first], _separator(lines[first]))
    if not any(map(_is_number, head)):
        names, first = _names(head), first + 1
    elif len(head) == 1 and head[0].isdigit():
        announced, first = int(head[0]), first + 1
    body = [line for line in lines[first:] if line.strip() and not line.lstrip().startswith(_COMMENT)]
    if not body:
        raise FileError(f"{path}: has no rows of numbers" + (f", {announced} are announced" if announced else ""))
    if announced is not None and re.match(rb"\s*[A-Z][a-z]?\s", body[-1]):
        raise FileError(f"{path}: is a list of atoms (the XYZ format of chemistry), expected points")
    rows = _rows(body, _separator(body[0]), path)
    if announced is not None and announced != len(rows):
        raise FileError(f"{path}: truncated: the first line announces {announced} points, found {len(rows)}")
    if names is None and comment is not None:
        names = _names(_fields(comment, _separator(comment)))
        names = names if len(names) == rows.shape[1] and {"x", "y", "z"} <= set(names) else None
    if names is not None and len(names) != rows.shape[1]:
        raise FileError(f"{path}: the header names {len(names)} columns, the rows have {rows.shape[1]}")
    if rows.shape[1] < 3:
        raise FileError(f"{path}: expected at least three columns (x, y, z), found {rows.shape[1]}")
    return names, rows


def _first_row(lines: list[bytes]) -> tuple[int, bytes | None]:
    """Index of the first line that is neither blank nor a comment, and the last comment before it, unmarked."""
    comment = None
    for k, line in enumerate(lines):
        line = line.strip()
        if line.startswith(_COMMENT):
            comment = line.lstrip(b"#/% \t")
        elif line:
            return k, comment
    return len(lines), comment


def _separator(line: bytes) -> bytes | None:
    """The separator of a line's fields; None for blanks."""
    return next((mark for mark in (b";", b",") if mark in line), None)


def _fields(line: bytes, separator: bytes | None) -> list[bytes]:
    if separator is not None:
        line = line.strip().removesuffix(separator)
    return [field.strip(b" \t\"'") for field in line.split(separator)]


def _names(fields: list[bytes]) -> list[str]:
    """Column names without their units: 'X [m]' is 'x'."""
    return [re.sub(r"\s*[\[(].*", "", field.decode("utf-8", "replace")).strip().lower() for field in fields]


def _rows(lines: list[bytes], separator: bytes | None, path: PathLike) -> NDArray[np.float64]:
    """Rows (N, C) of lines that all have as many fields as the first."""
    width = len(_fields(lines[0], separator))
    if separator is not None:
        wrong = [line for line in lines if len(_fields(line, separator)) != width]
    else:
        wrong = [line for line in lines if len(line.split()) != width]
    if wrong:
        found = len(_fields(wrong[0], separator))
        raise FileError(f"{path}: expected {width} fields in every row, found {found} in {_shown(wrong[0])}")
    text = b"\n".join(lines)
    if separator is not None:
        if separator == b";":
            text = text.replace(b",", b".")  # where ; separates fields, decimals may have a comma
        text = text.replace(separator, b" ").replace(b'"', b"")
    words = text.split()
    if len(words) != width * len(lines):
        wrong = [line for line in lines if any(len(field.split()) != 1 for field in _fields(line, separator))]
        raise FileError(f"{path}: expected one number in every field, found {_shown(wrong[0])}")
    return numbers(words, path, "points").reshape(len(lines), width)


def _shown(line: bytes) -> str:
    return repr(line.strip()[:60].decode("utf-8", "replace"))


def _is_number(word: bytes) -> bool:
    try:
        float(word.replace(b",", b"."))
    except ValueError:
        return False
    return True
