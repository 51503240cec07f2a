"""Quilt: how a device wants its views tiled into one picture (displays.md 3.1)."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import ASPECT_RANGE, check_number
from ..errors import InputError
from .masks import check_size


@dataclass(frozen=True)
class Quilt:
    """A tiled picture of all views: `columns` × `rows` tiles in `width` × `height` pixels.

    `aspect` is that of the display, not of a tile's pixels: tiles may be anamorphic (displays.md 3.1).
    """

    columns: int
    rows: int
    width: int
    height: int
    aspect: float

    def __post_init__(self) -> None:
        for name in ("columns", "rows", "width", "height"):
            object.__setattr__(self, name, check_size(f"quilt {name}", getattr(self, name)))
        object.__setattr__(self, "aspect", check_number("quilt aspect", self.aspect, *ASPECT_RANGE))
        if self.columns > self.width or self.rows > self.height:
            raise InputError(f"quilt: {self.columns}×{self.rows} tiles do not fit {self.width}×{self.height} pixels")

    @property
    def views(self) -> int:
        """Number of tiles."""
        return self.columns * self.rows

    @property
    def tile(self) -> tuple[int, int]:
        """Width and height of a tile in pixels."""
        return (self.width // self.columns, self.height // self.rows)
