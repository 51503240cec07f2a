"""Displays by name: one TOML file each, built in or the user's own.

A file holds `source`, `width`, `height`, a `[mask]` or a `[calibration]`, and, as it likes, `title`, `note`, `views`,
`reverse`, `fov_y`, `comfort`, `serial` (start of a model's serial numbers), `[quilt]` (columns, rows, width, height,
aspect) and `[optics]` (size_mm, distance_mm, cone_deg). `[mask]` has a `kind` of MASKS and that constructor's
arguments; `[calibration]` has the fields of a visual.json but the panel's size.
"""

from __future__ import annotations

import difflib
import inspect
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from ..checks import check_views
from ..errors import AutostereoError, FileError, InputError
from ..image import as_path
from . import masks
from .calibration import Calibration, read_calibration
from .display import Display, looking_glass
from .masks import check_size
from .quilt import Quilt

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def _sloped(width: int, height: int, views: int, step: int, row_step: int) -> Display:
    return Display(f"sloped-{views}", width, height, viewmap=masks.sloped(views, step, row_step))


MASKS: dict[str, Callable[..., Display]] = {
    "lenticular": Display.lenticular,  # views, per
    "sloped": _sloped,  # views, step, row_step: view = (step·s − row_step·r) mod V
    "slanted": Display.slanted,  # views, lens_pitch, subpixel_pitch, slant_deg, phase, continuous
    "wavelength-selective": Display.wavelength_selective,
    "table": Display.from_table,  # views, table
    "stereo": Display.stereo,  # layout
    "anaglyph": Display.anaglyph,
    "rgbd": Display.rgbd,
}
FIELDS = {
    "title", "source", "note", "width", "height", "views", "reverse", "fov_y", "comfort", "serial", "ending",
    "mask", "calibration", "quilt", "optics",
}  # fmt: skip
TABLES = {"mask", "calibration", "quilt", "optics"}
TEXTS = {"title", "source", "note", "serial", "ending"}
EXPECTED = {
    "width": "the panel's columns of pixels",
    "height": "the panel's rows of pixels",
    "source": 'where the numbers come from, such as source = "measured, 2026-01"',
}  # fields that every file has
MAX_BYTES = 1 << 20


def _files() -> Iterator[Any]:
    for entry in resources.files(__package__).joinpath("presets").iterdir():
        if entry.name.endswith(".toml"):
            yield entry


@lru_cache(maxsize=1)
def _built_in() -> dict[str, dict[str, Any]]:
    """Parsed fields of every built-in preset by name, in alphabetical order."""
    texts = {entry.name[: -len(".toml")]: entry.read_bytes() for entry in _files()}
    return {name: _parse(f"preset {name}", texts[name]) for name in sorted(texts)}


def preset_names() -> list[str]:
    """Names of the built-in displays, in alphabetical order."""
    return list(_built_in())


def preset_title(name: str) -> str:
    """What a built-in display, or that of a .toml, is called in full; "" where its file does not say."""
    fields = _built_in().get(name)
    if fields is None:
        fields = _parse(name, _read(Path(name))) if name.lower().endswith(".toml") else {}
    return str(fields.get("title", ""))


def load_preset(name: str | os.PathLike[str]) -> Display:
    """Return the display `name`: a built-in one, or a path to a .toml or a visual.json.

    Raises
    ------
    InputError
        There is no such preset; the message lists the closest names.
    FileError
        A file cannot be read, or a field of it is unknown, missing or wrong.
    """
    if not isinstance(name, (str, os.PathLike)):
        raise InputError(f"display: expected a preset's name or a path, got {type(name).__name__}")
    text = os.fspath(name)
    if text in _built_in():
        return _build(f"preset {text}", text, _built_in()[text])
    path = Path(text)
    if path.suffix.lower() == ".json":
        return Display.from_calibration(path)
    if path.suffix.lower() == ".toml" or isinstance(name, os.PathLike):
        return _build(str(path), path.stem, _parse(str(path), _read(path)))
    close = difflib.get_close_matches(text.lower(), preset_names(), n=4, cutoff=0.4)
    hint = f"close matches: {', '.join(close)}" if close else f"there are {', '.join(preset_names())}"
    raise InputError(f"display {text!r}: no such preset; {hint}")


def _read(path: Path) -> bytes:
    path = as_path(path)
    try:
        with open(path, "rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from error
    if len(raw) > MAX_BYTES:
        raise FileError(f"{path}: expected a display as TOML, the file is larger than {MAX_BYTES} bytes")
    return raw


def _parse(where: str, raw: bytes) -> dict[str, Any]:
    """Parse a preset and check the names and types of its fields."""
    try:
        fields: dict[str, Any] = tomllib.loads(raw.decode("utf-8-sig").replace("\r\n", "\n"))
    except (ValueError, RecursionError) as error:  # TOMLDecodeError and UnicodeDecodeError are ValueErrors
        raise FileError(f"{where}: expected a display as TOML ({error})") from error
    unknown = sorted(set(fields) - FIELDS)
    if unknown:
        raise FileError(f"{where}: unknown field {unknown[0]!r}; there are {', '.join(sorted(FIELDS))}")
    for key, value in fields.items():
        kind = dict if key in TABLES else str if key in TEXTS else None
        if kind is not None and not isinstance(value, kind):
            raise FileError(f"{where}: {key}: expected {'a table' if kind is dict else 'a string'}, found {value!r}")
    for key in EXPECTED:
        if key not in fields:
            raise FileError(f"{where}: {key}: missing, expected {EXPECTED[key]}")
    if ("mask" in fields) == ("calibration" in fields):
        raise FileError(f"{where}: expected either a [mask] or a [calibration]")
    return fields


def _build(where: str, name: str, fields: dict[str, Any]) -> Display:
    """Make the display of checked `fields`; errors name `where`."""
    try:
        width, height = check_size("width", fields["width"]), check_size("height", fields["height"])
        quilt = _call("quilt", Quilt, (), fields["quilt"]) if "quilt" in fields else None
        if "calibration" in fields:
            display = _calibrated(name, fields, (width, height), quilt)
        else:
            display = _from_mask(fields, width, height)
        changes: dict[str, Any] = {key: fields[key] for key in ("fov_y", "comfort", "note", "ending") if key in fields}
        display = replace(display, name=name, source=fields["source"], quilt=quilt, **changes)
        display = _call("optics", display.physical, (), fields.get("optics", {}))
        return display.swapped() if masks.check_flag("reverse", fields.get("reverse", False)) else display
    except AutostereoError as error:
        raise FileError(f"{where}: {error}") from error


def _calibrated(name: str, fields: dict[str, Any], size: tuple[int, int], quilt: Quilt | None) -> Display:
    calibration = read_calibration({"screenW": size[0], "screenH": size[1], **fields["calibration"]})
    views = fields.get("views", quilt.views if quilt is not None else 48)
    return looking_glass(calibration, calibration.viewmap(check_views(views)), name=name)


def _from_mask(fields: dict[str, Any], width: int, height: int) -> Display:
    arguments = dict(fields["mask"])
    kind = arguments.pop("kind", None)
    if not isinstance(kind, str) or kind not in MASKS:
        raise InputError(f"mask kind: expected one of {', '.join(MASKS)}, found {kind!r}")
    if "views" in fields:
        arguments["views"] = fields["views"]
    return _call("mask", MASKS[kind], (width, height), arguments)


def _call(table: str, make: Callable[..., Any], given: tuple[Any, ...], fields: dict[str, Any]) -> Any:
    """make(*given, **fields), where a field too many or too few is an error that names the table."""
    parameters = list(inspect.signature(make).parameters.values())[len(given) :]
    for key in fields:
        if key not in [p.name for p in parameters]:
            raise InputError(f"{table}: unknown field {key!r}; there are {', '.join(p.name for p in parameters)}")
    for p in parameters:
        if p.default is p.empty and p.name not in fields:
            raise InputError(f"{table} {p.name}: missing")
    return make(*given, **fields)


def model_of(calibration: Calibration) -> Display | None:
    """The built-in Looking Glass that a calibration is of: by its serial number, else by its panel and cells."""
    models = {name: fields for name, fields in _built_in().items() if "serial" in fields}
    for name, fields in models.items():
        if calibration.serial.startswith(fields["serial"]):
            return load_preset(name)
    panel = (calibration.width, calibration.height, bool(calibration.cells))
    alike = {
        abs(fields["calibration"]["DPI"] - calibration.dpi): name
        for name, fields in models.items()
        if (fields["width"], fields["height"], bool(fields["calibration"].get("subpixelCells"))) == panel
    }
    return load_preset(alike[min(alike)]) if alike else None
