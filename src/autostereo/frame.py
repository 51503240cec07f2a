"""What a render returns: a stack of views, or one interlaced panel."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .checks import check_count, check_unmasked
from .errors import FileError, InputError
from .image import as_path, write_atomic, write_image
from .memory import check_memory
from .wording import counted


@dataclass(frozen=True, eq=False)
class ViewStack:
    """V pictures of one scene, from left to right.

    Attributes
    ----------
    color : ndarray of shape (V, H, W, 4), uint8
        RGB composited over the background, A = opacity; rows from the top, view 0 the leftmost camera.
    depth : ndarray of shape (V, H, W), float32, optional
        Eye depth; inf where nothing was hit.
    reused : float, optional
        Share of the covered samples whose colour was reused from a nearby view (`shading="reuse"` on engine cpu only).
    """

    color: NDArray[np.uint8]
    depth: NDArray[np.float32] | None = None
    reused: float | None = None

    def __post_init__(self) -> None:
        check_unmasked("color", self.color, "pixels")
        check_unmasked("depth", self.depth, "depths")
        color = np.asarray(self.color)
        if color.ndim != 4 or color.shape[3] != 4 or color.dtype != np.uint8 or 0 in color.shape:
            raise InputError(f"color: expected (V, H, W, 4) uint8, got {color.shape} {color.dtype}")
        if self.depth is not None and np.shape(self.depth) != color.shape[:3]:
            raise InputError(f"depth: expected shape {color.shape[:3]}, got {np.shape(self.depth)}")

    @property
    def views(self) -> int:
        """Number of views V."""
        return self.color.shape[0]

    @property
    def height(self) -> int:
        """Rows H of one view."""
        return self.color.shape[1]

    @property
    def width(self) -> int:
        """Columns W of one view."""
        return self.color.shape[2]

    def quilt(self, columns: int, rows: int) -> NDArray[np.uint8]:
        """Tile the views into one picture, view 0 at the bottom left, row by row upwards.

        Parameters
        ----------
        columns, rows : int
            C and R; C·R ≥ V. Tiles without a view stay black and opaque.

        Returns
        -------
        ndarray of shape (R·H, C·W, 4), uint8
        """
        columns, rows = check_count("quilt columns", columns), check_count("quilt rows", rows)
        if columns * rows < self.views:
            raise InputError(f"quilt: {columns}×{rows} tiles cannot hold {counted(self.views, 'view')}")
        check_memory(4 * rows * self.height * columns * self.width, f"a quilt of {columns}×{rows} tiles")
        quilt = np.zeros((rows, self.height, columns, self.width, 4), dtype=np.uint8)
        quilt[..., 3] = 255
        for k in range(self.views):
            quilt[rows - 1 - k // columns, :, k % columns] = self.color[k]
        return quilt.reshape(rows * self.height, columns * self.width, 4)

    @staticmethod
    def from_quilt(quilt: NDArray[np.uint8], columns: int, rows: int, views: int | None = None) -> ViewStack:
        """Cut a quilt (H', W', 3|4) into its views; rows and columns left over at the right and top are padding.

        The used part of the picture is C·⌊W'/C⌋ × R·⌊H'/R⌋ pixels, counted from the bottom left (displays.md 3.1).
        """
        check_unmasked("quilt", quilt, "pixels")
        quilt = np.asarray(quilt)
        if quilt.ndim != 3 or quilt.shape[2] not in (3, 4) or quilt.dtype != np.uint8:
            raise InputError(f"quilt: expected (H, W, 3 or 4) uint8, got {quilt.shape} {quilt.dtype}")
        columns, rows = check_count("quilt columns", columns), check_count("quilt rows", rows)
        height, width = quilt.shape[0] // rows, quilt.shape[1] // columns
        if height < 1 or width < 1:
            raise InputError(f"quilt: {quilt.shape[1]}×{quilt.shape[0]} pixels cannot be {columns}×{rows} tiles")
        count = columns * rows if views is None else check_count("views", views, columns * rows)
        color = np.full((count, height, width, 4), 255, dtype=np.uint8)
        bottom = quilt.shape[0]
        for k in range(count):
            top, left = bottom - (k // columns + 1) * height, (k % columns) * width
            color[k, :, :, : quilt.shape[2]] = quilt[top : top + height, left : left + width]
        return ViewStack(color)

    def psnr(self, exact: ViewStack) -> float:
        """Peak signal-to-noise ratio in dB of the RGB of all views against another stack's; inf where they are equal.

        What approximations cost, such as `shading="reuse"` or `method="dibr"`: 10·log10(255² / mean squared error).

        Raises
        ------
        InputError
            That is no stack of as many views of the same size.
        """
        if not isinstance(exact, ViewStack) or exact.color.shape != self.color.shape:
            raise InputError(f"exact: expected {_what(self)}, got {_what(exact)}")
        errors = [squared_error(a[..., :3], b[..., :3]) for a, b in zip(self.color, exact.color, strict=True)]
        return decibels(float(np.mean(errors)))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write `path`.npz (arrays `color`, `depth`), or a folder of view_000.png, view_001.png, …

        A folder is created when its parent exists.
        """
        path = as_path(path)
        if path.suffix == ".npz":
            arrays = {"color": self.color} | ({} if self.depth is None else {"depth": self.depth})
            return write_atomic(path, lambda file: np.savez_compressed(file, allow_pickle=False, **arrays))
        if path.suffix:
            raise InputError(f"{path}: expected a folder or a .npz file for a view stack")
        try:
            path.mkdir(exist_ok=True)
        except OSError as error:
            raise FileError(f"{path}: cannot be created ({error.strerror})") from error
        for k in range(self.views):
            write_image(path / f"view_{k:03d}.png", self.color[k])
        return path


@dataclass(frozen=True, eq=False)
class Panel:
    """The picture a panel shows, every sub-pixel from its own camera.

    Attributes
    ----------
    pixels : ndarray of shape (H, W, 3), uint8
        Rows from the top.
    reused : float, optional
        Share of the covered samples whose colour was reused (`shading="reuse"` on engine cpu only).
    """

    pixels: NDArray[np.uint8]
    reused: float | None = None

    def __post_init__(self) -> None:
        check_unmasked("pixels", self.pixels, "pixels")
        pixels = np.asarray(self.pixels)
        if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint8 or 0 in pixels.shape:
            raise InputError(f"pixels: expected (H, W, 3) uint8, got {pixels.shape} {pixels.dtype}")

    @property
    def height(self) -> int:
        """Rows H."""
        return self.pixels.shape[0]

    @property
    def width(self) -> int:
        """Columns W."""
        return self.pixels.shape[1]

    def psnr(self, exact: Panel) -> float:
        """Peak signal-to-noise ratio in dB against another panel; see `ViewStack.psnr`."""
        if not isinstance(exact, Panel) or exact.pixels.shape != self.pixels.shape:
            raise InputError(f"exact: expected a panel of {self.width}×{self.height}, got {_what(exact)}")
        return decibels(squared_error(self.pixels, exact.pixels))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write an image file; png and webp are lossless, others blur neighbouring views into each other."""
        return write_image(path, self.pixels)


def squared_error(picture: NDArray[np.uint8], exact: NDArray[np.uint8]) -> float:
    """Mean squared difference of two pictures or stacks, a row or a view at a time: no copies of the size of all."""
    parts = (np.square(a.astype(np.int32) - b).sum(dtype=np.int64) for a, b in zip(picture, exact, strict=True))
    return float(sum(parts)) / picture.size


def decibels(error: float) -> float:
    """Peak signal-to-noise ratio of a mean squared difference; inf for none."""
    return float("inf") if error == 0 else float(10 * np.log10(255.0**2 / error))


def _what(picture: object) -> str:
    """A picture, or what is none, in words."""
    if isinstance(picture, ViewStack):
        return f"{counted(picture.views, 'view')} of {picture.width}×{picture.height}"
    if isinstance(picture, Panel):
        return f"a panel of {picture.width}×{picture.height}"
    return type(picture).__name__
