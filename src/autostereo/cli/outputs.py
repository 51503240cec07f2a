"""Where the verbs write: checks before the long work, and folders that appear whole."""

from __future__ import annotations

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FileError, InputError
from ..temporary import holding
from ..wording import no_folder
from .common import note

if TYPE_CHECKING:
    from ..display.display import Display

LOSSY = (".jpg", ".jpeg")


def check_output(path: Path, suffixes: tuple[str, ...] = ()) -> Path:
    """Refuse, before the long work, a path that could not be written after it.

    With `suffixes` it is to be a file, without them a folder.
    """
    if suffixes and path.is_dir():
        raise FileError(f"{path}: expected a file name, found a folder")
    if not suffixes and path.exists() and not path.is_dir():
        raise FileError(f"{path}: expected a folder, found a file")
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(f"{path}: expected a name ending in {' '.join(suffixes)}, got {path.suffix or 'no suffix'}")
    folder = path.parent
    if not folder.is_dir():
        raise FileError(f"{path}: {no_folder(folder)}")
    _check_writable(path, folder)
    return path


def _check_writable(path: Path, folder: Path) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise FileError(f"{path}: the folder {folder} is not writable ({error.strerror or error})") from error


def folder_or_file(output: str, suffixes: tuple[str, ...]) -> tuple[Path, str]:
    """Where to write, and its suffix in small letters: "" for a folder.

    One is a name without a suffix or that ends in a slash, and what is a folder already but for its suffix.
    """
    path = Path(output)
    suffix = path.suffix.lower()
    folder = output.endswith(("/", os.sep)) or (path.is_dir() and suffix not in suffixes)
    return path, "" if folder else suffix


def check_folder(path: Path) -> Path:
    """`check_output` for a folder that is made with all those above it."""
    nearest = next(place for place in (path, *path.parents) if place.exists())
    if not nearest.is_dir():
        raise FileError(f"{path}: expected a folder, {'found' if nearest == path else f'{nearest} is'} a file")
    _check_writable(path, nearest)
    return path


def check_apart(output: Path, *inputs: Path) -> None:
    """Refuse an output that is one of the inputs, whatever it is called."""
    if output.exists() and any(path.exists() and path.samefile(output) for path in inputs):
        raise InputError(f"{output}: is also an input, which would be lost; give the output another name")


def check_image(path: Path, size: tuple[int, int] | None = None) -> Path:
    """`check_output` for an image file, of so many pixels across and down if that is known."""
    from ..image import IMAGE_SUFFIXES, check_side

    check_output(path, IMAGE_SUFFIXES)
    if size is not None:
        check_side(path, *size)
    return path


def note_ending(path: Path, ending: str) -> None:
    """Say so when the device would not know a picture by its name; see `Display.ending`."""
    if not path.stem.endswith(ending):
        note(f"{path}: its device wants a name that ends in {ending}, such as {path.stem}{ending}{path.suffix}")


def note_lossy(path: Path, display: Display | None) -> None:
    """Say what a lossy format does to a picture that was written for a display; None: to a quilt."""
    if path.suffix.lower() not in LOSSY:
        return
    mixed = display is not None and display.viewmap is not None
    does = "mixes the views" if mixed else "changes the picture a little"
    note(f"{path}: {path.suffix} is lossy and {does}; .png and .webp keep every pixel")


@contextmanager
def whole_folder(path: Path, stale: str = "") -> Iterator[Path]:
    """Give a temporary folder to fill; when all went well its files appear in `path`, else nothing does.

    In a folder that exists, files of the same name are replaced, and in a folder of views (it holds a rig.json)
    others that match the pattern `stale` are removed.
    """
    check_output(path)
    try:
        with holding(path.parent / f".part-{secrets.token_hex(4)}") as temporary:  # no suffix: it is a folder
            temporary.mkdir()
            yield temporary
            if path.is_dir():
                _move_into(path, temporary, stale)
            else:
                os.replace(temporary, path)
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path}: cannot be written ({error.strerror or error})") from error


def _move_into(path: Path, temporary: Path, stale: str) -> None:
    """Move what a folder holds into another; see `whole_folder`."""
    made = sorted(temporary.iterdir())
    ours = (path / "rig.json").exists()  # a folder of this program's
    leftovers = list(path.glob(stale)) if stale and ours else []
    for item in made:
        os.replace(item, path / item.name)
    for old in leftovers:
        if old.name not in {item.name for item in made}:
            old.unlink()
