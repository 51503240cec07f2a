"""What the tests of the command line share."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

SQUARE = "OFF\n4 2 0\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n3 0 1 2\n3 0 2 3\n"
SMALL = ("--size", "48x64")


class Result:
    """What a command line returned and printed."""

    def __init__(self, status: int, out: str, err: str) -> None:
        self.status, self.out, self.err = status, out, err


Run = Callable[..., Result]


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def pixels(path: Path | str) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


def refused(result: Result, *words: str) -> None:
    """One line on stderr (but for the remark of a first run), exit 2, nothing on stdout."""
    assert result.status == 2
    assert result.out == ""
    assert re.fullmatch(r"(compiling kernels [^\n]*\n)?autostereo: error: [^\n]+\n", result.err), result.err
    for word in words:
        assert word in result.err
