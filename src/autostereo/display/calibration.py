"""Looking Glass calibrations (visual.json): read, check, turn into a view map.

Phase of channel c of pixel (x, y), y counted from the bottom (displays.md 3.3):

    φ = (u + dx/W + (v + dy/H)·T)·P − center,   u = (x + ½)/W,  v = (y + ½)/H
    P = pitch·(W/DPI)·cos(atan(1/slope)),  T = H/(W·slope)

with (dx, dy) = (c/3, 0) for stripes, or the channel's place in its cell for generation 3. View maps count rows from
the top: y = H − 1 − r.

Flips. `flipImageX` is set when the panel is seen in a mirror. Players disagree on the phase: some mirror u in it, some
only negate the sub-pixel step and the tilt. Here the whole pattern is mirrored, u + dx/W → 1 − u − dx/W and T → −T,
because that keeps a sub-pixel's step and a pixel's step of one sign, as they are in the panel. `flipImageY` mirrors
the picture only. `flipSubp` swaps red and blue. Where a unit disagrees, its owner has `center` and swapped zones.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np

from ..errors import FileError, InputError
from ..image import as_path
from ..viewmap import CELL_MODES, ViewMap
from .masks import MAX_SIZE

MAX_BYTES = 1 << 20
CELL_FIELDS = ("ROffsetX", "ROffsetY", "GOffsetX", "GOffsetY", "BOffsetX", "BOffsetY")
QUILT_FIELDS = ("tileX", "tileY", "quiltX", "quiltY", "quiltAspect")
STRIPES = (((0.0, 0.0), (1 / 3, 0.0), (2 / 3, 0.0)),)

Cell = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Calibration:
    """The numbers of one Looking Glass.

    Attributes
    ----------
    width, height : int
        Panel pixels (screenW, screenH).
    pitch, slope, center, dpi, cone_deg : float
        Lenses per inch across the lens; tilt; phase offset in lenses; pixels per inch; viewCone in degrees.
    invert, flip_x, flip_y, flip_subpixels : bool
        invView, flipImageX, flipImageY, flipSubp.
    cell_mode : int
        CellPatternMode 0…4 (`viewmap.cell_index`, then mod the number of cells).
    cells : tuple of cells, each ((dx, dy) of R, of G, of B) in pixels, y upwards
        Empty: RGB stripes.
    serial : str
    quilt : (columns, rows, width, height, aspect), optional
        The device's own defaultQuilt, where the file has one.
    """

    width: int
    height: int
    pitch: float
    slope: float
    center: float
    dpi: float
    cone_deg: float = 40.0
    invert: bool = False
    flip_x: bool = False
    flip_y: bool = False
    flip_subpixels: bool = False
    cell_mode: int = 0
    cells: tuple[Cell, ...] = ()
    serial: str = ""
    quilt: tuple[int, int, int, int, float] | None = None

    @property
    def lenses(self) -> float:
        """P: lens periods over the panel's width."""
        return self.pitch * (self.width / self.dpi) * math.cos(math.atan(1 / self.slope))

    @property
    def lens_subpixels(self) -> float:
        """X = 3W/P: horizontal width of a lens in sub-pixels."""
        return 3 * self.width / self.lenses

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the panel in millimetres."""
        return (25.4 * self.width / self.dpi, 25.4 * self.height / self.dpi)

    def resized(self, width: int, height: int) -> Calibration:
        """The same lens sheet on a panel of another number of pixels; both are measured from the bottom left."""
        return replace(self, width=width, height=height)

    def viewmap(self, views: int, continuous: bool = False, reverse: bool = False) -> ViewMap:
        """The view map of this panel; `reverse` swaps the zones once more than invView does."""
        p, w, h = self.lenses, self.width, self.height
        sign, start = (-1.0, p) if self.flip_x else (1.0, 0.0)
        per_row = p / (w * self.slope)  # P·T/H
        cells = np.array(self.cells or STRIPES)  # (cells, channel, xy)
        if self.flip_subpixels:
            cells = cells[:, ::-1]
        first = (0.5 + cells[..., 0]) * (p / w) + (h - 0.5 + cells[..., 1]) * per_row
        return ViewMap(
            views,
            a=sign * p / w,
            b=-sign * per_row,
            offsets=start + sign * first - self.center,
            cell_mode=self.cell_mode if self.cells else 0,
            height=h,
            continuous=continuous,
            reverse=self.invert != reverse,
        )


def read_calibration(source: str | os.PathLike[str] | dict[str, Any]) -> Calibration:
    """Read a visual.json, or a dict with its fields.

    Bridge's form, an object with `calibration` and `defaultQuilt` (each perhaps a JSON string), is read too.

    Raises
    ------
    FileError
        The file cannot be read, is no JSON, or a field is missing, of a wrong type or out of range; the message
        names file, field, what was expected and what was found.
    InputError
        The same for a dict.
    """
    if isinstance(source, dict):
        return _Reader("calibration", InputError).calibration(source)
    if not isinstance(source, (str, os.PathLike)):
        raise InputError(f"calibration: expected a path or a dict, got {type(source).__name__}")
    path = as_path(source)
    try:
        with open(path, "rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from error
    if len(raw) > MAX_BYTES:
        raise FileError(f"{path}: expected a Looking Glass calibration, the file is larger than {MAX_BYTES} bytes")
    if not raw.strip():
        raise FileError(f"{path}: expected a Looking Glass calibration as JSON, the file is empty")
    reader = _Reader(str(path), FileError)
    return reader.calibration(reader.parse(raw))


class _Reader:
    """Takes fields out of a parsed file; errors name the file and the field."""

    def __init__(self, name: str, error: type[FileError] | type[InputError]) -> None:
        self.name = name
        self.error = error

    def fail(self, field: str, expected: str, found: object) -> NoReturn:
        text = "nothing" if found is None else repr(found)
        text = text if len(text) <= 60 else text[:57] + "..."
        raise self.error(f"{self.name}: {field}: expected {expected}, found {text}")

    def parse(self, raw: bytes | str) -> Any:
        try:
            return json.loads(raw.decode("utf-8-sig") if isinstance(raw, bytes) else raw)
        except UnicodeDecodeError:
            raise self.error(f"{self.name}: expected a Looking Glass calibration as JSON, found no text") from None
        except (ValueError, RecursionError) as error:
            raise self.error(f"{self.name}: expected a Looking Glass calibration as JSON ({error})") from None

    def unwrap(self, data: dict[str, Any], field: str) -> Any:
        entry = data.get(field)
        return entry["value"] if isinstance(entry, dict) and "value" in entry else entry

    def number(self, data: dict[str, Any], field: str, low: float, high: float, default: float | None = None) -> float:
        expected = f"a number {low:g}…{high:g}"
        if field not in data:
            return default if default is not None else self.fail(field, expected, None)
        value = self.unwrap(data, field)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
            self.fail(field, expected, value)
        return float(value)

    def whole(self, data: dict[str, Any], field: str, high: int) -> int:
        value = self.number(data, field, 1, high)
        if value != int(value):
            self.fail(field, f"a whole number 1…{high}", value)
        return int(value)

    def flag(self, data: dict[str, Any], field: str) -> bool:
        value = self.unwrap(data, field) if field in data else 0
        if not isinstance(value, (bool, int, float)) or value not in (0, 1):
            self.fail(field, "0 or 1", value)
        return bool(value)

    def object(self, data: Any, field: str, key: str | None = None) -> dict[str, Any]:
        value = data if key is None else self.unwrap(data, key)
        if key is not None and isinstance(value, str):
            value = _Reader(f"{self.name}: {key}", self.error).parse(value)
        if not isinstance(value, dict):
            self.fail(field, "a JSON object", value)
        return value

    def calibration(self, data: Any) -> Calibration:
        data = self.object(data, "calibration")
        if "calibration" in data:
            quilt = {k: data[k] for k in ("defaultQuilt",) if k in data}
            data = {**self.object(data, "calibration", "calibration"), **quilt}
        slope = self.number(data, "slope", -1e6, 1e6)
        if abs(slope) < 1e-6:
            self.fail("slope", "a number other than 0", slope)
        serial = data.get("serial", "")
        if not isinstance(serial, str):
            self.fail("serial", "a string", serial)
        mode = self.number(data, "CellPatternMode", 0, max(CELL_MODES), default=0.0)
        if mode != int(mode):
            self.fail("CellPatternMode", f"a whole number 0…{max(CELL_MODES)}", mode)
        return Calibration(
            width=self.whole(data, "screenW", MAX_SIZE),
            height=self.whole(data, "screenH", MAX_SIZE),
            pitch=self.number(data, "pitch", 1e-3, 1e6),
            slope=slope,
            center=self.number(data, "center", -1e6, 1e6),
            dpi=self.number(data, "DPI", 1e-3, 1e6),
            cone_deg=self.number(data, "viewCone", 0.1, 179.0, default=40.0),
            invert=self.flag(data, "invView"),
            flip_x=self.flag(data, "flipImageX"),
            flip_y=self.flag(data, "flipImageY"),
            flip_subpixels=self.flag(data, "flipSubp"),
            cell_mode=int(mode),
            cells=self.cells(data),
            serial=serial,
            quilt=self.quilt(data),
        )

    def cells(self, data: dict[str, Any]) -> tuple[Cell, ...]:
        entries = self.unwrap(data, "subpixelCells") if "subpixelCells" in data else []
        if not isinstance(entries, list) or len(entries) > 16:
            self.fail("subpixelCells", "a list of at most 16 cells", entries)
        cells = []
        for i, entry in enumerate(entries):
            cell = self.object(entry, f"subpixelCells[{i}]")
            reader = _Reader(f"{self.name}: subpixelCells[{i}]", self.error)
            rx, ry, gx, gy, bx, by = (reader.number(cell, field, -16, 16) for field in CELL_FIELDS)
            cells.append(((rx, ry), (gx, gy), (bx, by)))
        return tuple(cells)

    def quilt(self, data: dict[str, Any]) -> tuple[int, int, int, int, float] | None:
        if "defaultQuilt" not in data:
            return None
        entry = self.object(data, "defaultQuilt", "defaultQuilt")
        reader = _Reader(f"{self.name}: defaultQuilt", self.error)
        columns, rows, width, height = (reader.whole(entry, field, MAX_SIZE) for field in QUILT_FIELDS[:4])
        return (columns, rows, width, height, reader.number(entry, "quiltAspect", 1e-3, 1e3))
