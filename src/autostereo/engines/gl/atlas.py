"""Where pictures are drawn: an atlas of tiles, laid out as the final quilt, with one depth buffer.

One texture holds the views of a pass side by side, as de Sorbier 2008, section 3.2 proposes ("one single texture shared
between the multiple viewpoints"); shaders cut each view's triangles at its tile with clip distances, so that nothing
overlaps and every view has true depth. Views that one texture cannot hold are spread over several atlases, one
after the other. The same layout serves the three channels of a panel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..constants import ATLAS_VIEWS
from .context import CLIP_DISTANCES, Device, Limits

MAX_PIXELS = 2**26  # of an atlas: with colour and depth half a gigabyte


@dataclass(frozen=True)
class Layout:
    """`count` tiles of width × height pixels in columns × rows; tile 0 at the bottom left, as in quilts."""

    count: int
    columns: int
    width: int
    height: int

    @property
    def rows(self) -> int:
        """Rows of tiles."""
        return -(-self.count // self.columns)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the atlas in pixels."""
        return self.columns * self.width, self.rows * self.height

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """Width and height of the atlas and of a tile."""
        return (*self.size, self.width, self.height)

    @property
    def tiles(self) -> NDArray[np.int64]:
        """First column and row, from the top, of every tile, (count, 2)."""
        row, column = np.divmod(np.arange(self.count), self.columns)
        return np.stack([column * self.width, (self.rows - 1 - row) * self.height], axis=1)

    @staticmethod
    def fitting(views: int, size: tuple[int, int], limits: Limits) -> Layout:
        """The layout of as many of `views` tiles as an atlas may hold, one at least, as square as can be."""
        width, height = size  # one that is too large is refused where its texture is made
        most_columns, most_rows = (max(1, limits.texture // side) for side in size)
        count = max(1, min(views, ATLAS_VIEWS, MAX_PIXELS // (width * height), most_columns * most_rows))
        square = round((count * height / width) ** 0.5)
        columns = min(max(square, -(-count // most_rows), 1), most_columns, count)
        return Layout(count, columns, width, height)


class Atlas:
    """Textures of a layout: colour (RGBA, 8 bits) and depth, and framebuffers over them.

    Attributes
    ----------
    layout : Layout
    color, depth : moderngl.Texture
        `depth` as in lib/frame.glsl.
    target : moderngl.Framebuffer
        Of both.
    over : moderngl.Framebuffer
        Of the colour alone, for what reads the depth.
    """

    def __init__(self, device: Device, layout: Layout) -> None:
        ctx = device.ctx
        device.check_texture((layout.width, layout.height), "a picture")
        self.layout = layout
        self.color = ctx.texture(layout.size, 4)
        self.depth = ctx.depth_texture(layout.size)
        self.depth.compare_func = ""
        for texture in (self.color, self.depth):
            texture.filter = (ctx.NEAREST, ctx.NEAREST)
        self.target = ctx.framebuffer([self.color], self.depth)
        self.over = ctx.framebuffer([self.color])

    def clear(self, background: NDArray[np.float64]) -> None:
        """Everything infinitely far, in the background's colour, transparent."""
        self.target.clear(*background, 0.0, depth=1.0)

    def read_color(self, tile: int, out: NDArray[np.uint8]) -> None:
        """Fill out (H, W, 4) from a tile."""
        read_into(self.over, out, self._box(tile))

    def read_depth(self, tile: int) -> NDArray[np.float32]:
        """Values (H, W) of a tile's depth buffer."""
        out = np.empty((self.layout.height, self.layout.width), np.float32)
        self.target.read_into(out, self._box(tile), components=1, attachment=-1, dtype="f4")
        return out

    def _box(self, tile: int) -> tuple[int, int, int, int]:
        x, y = self.layout.tiles[tile]
        return int(x), int(y), self.layout.width, self.layout.height


def read_into(framebuffer: Any, out: NDArray[np.uint8], box: tuple[int, int, int, int] | None = None) -> None:
    """Fill a contiguous picture (H, W, 3 | 4) from a framebuffer, whose row 0 is the picture's."""
    framebuffer.read_into(out, box, components=out.shape[-1], alignment=1)


def enable_clipping(ctx: Any, on: bool) -> None:
    """Switch the four clip distances that cut tiles."""
    for distance in CLIP_DISTANCES:
        (ctx.enable_direct if on else ctx.disable_direct)(distance)
