"""Files and folders that are made on the way: what is left of them when the process is stopped is removed."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_held: set[Path] = set()


@contextmanager
def holding(path: Path) -> Iterator[Path]:
    """Remove `path`, a file or a folder, at the end of the block, or when the process is stopped before."""
    _held.add(path)
    try:
        yield path
    finally:
        _remove(path)
        _held.discard(path)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """An empty folder, elsewhere, for the block."""
    with holding(Path(tempfile.mkdtemp(prefix="autostereo-"))) as folder:
        yield folder


def remove_all() -> None:
    """Remove all that is held, for a process that ends at once."""
    for path in list(_held):
        _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):  # there may be none
            path.unlink()
