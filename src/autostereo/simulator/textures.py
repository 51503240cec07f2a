"""Textures of the simulated machine: mip levels, their place in memory, compression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .kernels.lru import make_lru
from .kernels.textures import TextureMemory

TEXEL_BYTES = 4
BC1_BLOCK, BC1_BYTES = 4, 8  # 4×4 texels in 8 bytes: an eighth of the 64 they take raw
Bytes = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Texture:
    """An image with its mip levels.

    Parameters
    ----------
    image : ndarray of shape (h, w, 3 or 4), uint8
        Rows from the top; without alpha it is opaque.
    mipmaps : bool
        False: one level, as for shadow maps and other data that must not be averaged.
    """

    image: Bytes
    mipmaps: bool = True

    def __post_init__(self) -> None:
        image = np.asarray(self.image)
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4) or 0 in image.shape:
            raise InputError(f"texture: expected (h, w, 3 or 4) uint8, got {image.shape} {image.dtype}")
        if image.shape[2] == 3:
            image = np.concatenate([image, np.full((*image.shape[:2], 1), 255, np.uint8)], axis=2)
        object.__setattr__(self, "image", image)

    def levels(self, compressed: bool = False) -> list[Bytes]:
        """Mip levels (h, w, 4) down to one texel; as they come out of compression, if asked."""
        made = [self.image]
        exact = self.image.astype(np.float32)
        while self.mipmaps and exact.shape[:2] != (1, 1):
            exact = _halved(_halved(exact, 0), 1)
            made.append(np.floor(exact + 0.5).astype(np.uint8))
        if compressed and self.mipmaps:
            made = [decode_bc1(encode_bc1(level), level.shape[:2]) for level in made]
        return made


def _halved(values: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """The next level along one axis: max(1, ⌊n/2⌋) boxes of equal width, so that no level is displaced."""
    n = values.shape[axis]
    smaller = max(1, n // 2)
    if n == 1:
        return values
    moved = np.moveaxis(values, axis, 0)
    if n % 2 == 0:
        result = 0.5 * (moved[0::2] + moved[1::2])
    else:  # every box shares its outer texels with its neighbours (Guthe and Heckbert 2005)
        i = np.arange(smaller)
        share = [(smaller - i) / n, np.full(smaller, smaller / n), (i + 1) / n]
        shape = (-1, *(1,) * (moved.ndim - 1))
        result = sum(moved[2 * i + k] * share[k].astype(np.float32).reshape(shape) for k in range(3))
    return np.moveaxis(np.asarray(result, np.float32), 0, axis)


# --- texture compression (BC1, S3TC DXT1): lossy, four colours of a line for each block of 4×4 ------------------------
def encode_bc1(level: Bytes) -> NDArray[np.uint32]:
    """Blocks (n, 2) of 32-bit words: two colours of 5, 6, 5 bits, then 16 indices of two bits; alpha is dropped.

    The end points are the extremes along the diagonal of the block's range of colours.
    """
    h, w = level.shape[:2]
    padded = np.pad(level[..., :3], ((0, -h % BC1_BLOCK), (0, -w % BC1_BLOCK), (0, 0)), mode="edge").astype(np.float32)
    down, across = padded.shape[0] // BC1_BLOCK, padded.shape[1] // BC1_BLOCK
    blocks = padded.reshape(down, BC1_BLOCK, across, BC1_BLOCK, 3).swapaxes(1, 2).reshape(-1, 16, 3)
    middle = blocks.mean(axis=1, keepdims=True)
    spread = blocks - middle
    axis = spread.max(axis=1) - spread.min(axis=1)
    # the diagonal of the box has four directions: take the one the texels follow
    sign = np.sign(np.einsum("nkc,nk->nc", spread, spread[:, :, 1]))
    axis = axis * np.where(sign == 0, 1.0, sign)
    along = np.einsum("nkc,nc->nk", spread, axis)
    rows = np.arange(len(blocks))
    ends = np.stack([blocks[rows, along.argmax(axis=1)], blocks[rows, along.argmin(axis=1)]], axis=1)
    packed = _to_565(ends)
    high, low = packed.max(axis=1), packed.min(axis=1)
    palette = _palette(high, low)
    distance = np.square(blocks[:, :, None, :] - palette[:, None, :, :]).sum(axis=3)
    index = np.where((high == low)[:, None], 0, distance.argmin(axis=2)).astype(np.uint32)
    bits = (index << (2 * np.arange(16, dtype=np.uint32))).sum(axis=1, dtype=np.uint32)
    return np.stack([high | low << np.uint32(16), bits], axis=1)


def decode_bc1(words: NDArray[np.uint32], size: tuple[int, int]) -> Bytes:
    """The level (h, w, 4) that blocks (n, 2) stand for."""
    h, w = size
    down, across = -(-h // BC1_BLOCK), -(-w // BC1_BLOCK)
    palette = _palette(words[:, 0] & np.uint32(0xFFFF), words[:, 0] >> np.uint32(16))
    index = words[:, 1:2] >> (2 * np.arange(16, dtype=np.uint32)) & np.uint32(3)
    colors = np.take_along_axis(palette, index[:, :, None].astype(np.int64), axis=1)
    image = colors.reshape(down, across, 4, 4, 3).swapaxes(1, 2).reshape(4 * down, 4 * across, 3)[:h, :w]
    image = np.floor(image + 0.5).astype(np.uint8)
    return np.concatenate([image, np.full((h, w, 1), 255, np.uint8)], axis=2)


def _to_565(colors: NDArray[np.float32]) -> NDArray[np.uint32]:
    scaled = np.floor(colors * (np.array([31, 63, 31], np.float32) / 255) + 0.5).astype(np.uint32)
    return scaled[..., 0] << np.uint32(11) | scaled[..., 1] << np.uint32(5) | scaled[..., 2]


def _palette(high: NDArray[np.uint32], low: NDArray[np.uint32]) -> NDArray[np.float32]:
    """The four colours (n, 4, 3) between two packed ones."""
    ends = []
    for packed in (high, low):
        five = np.stack([packed >> np.uint32(11), packed & np.uint32(31)], axis=1)
        red_blue = five << np.uint32(3) | five >> np.uint32(2)
        six = packed >> np.uint32(5) & np.uint32(63)
        green = six << np.uint32(2) | six >> np.uint32(4)
        ends.append(np.stack([red_blue[:, 0], green, red_blue[:, 1]], axis=1).astype(np.float32))
    a, b = ends
    return np.stack([a, b, (2 * a + b) / 3, (a + 2 * b) / 3], axis=1)


# --- memory -----------------------------------------------------------------------------------------------------------
def block_shape(line_bytes: int) -> tuple[int, int]:
    """Log2 of width and height of the block of texels that a line holds: square, or twice as wide as high."""
    bits = (line_bytes // TEXEL_BYTES).bit_length() - 1
    return (bits + 1) // 2, bits // 2


@dataclass(frozen=True, eq=False)
class TextureStore:
    """Textures as they lie in memory: shared by all frames that are simulated; `memory` puts a cache before them."""

    texels: Bytes
    levels: NDArray[np.int64]
    textures: NDArray[np.int64]
    lines: int

    @staticmethod
    def of(textures: Sequence[Texture], line_bytes: int, compressed: bool) -> TextureStore:
        """Lay out textures in lines of `line_bytes`."""
        wide, high = block_shape(line_bytes)
        texels: list[Bytes] = []
        rows: list[tuple[int, ...]] = []
        places: list[tuple[int, int]] = []
        texel = line = 0
        for texture in textures:
            levels = texture.levels(compressed)
            places.append((len(rows), len(levels)))
            for level in levels:
                h, w = level.shape[:2]
                pitch = (w + (1 << wide) - 1) >> wide
                rows.append((texel, w, h, line, pitch, wide << 8 | high))
                texels.append(level.reshape(-1, 4))
                texel += h * w
                line += pitch * ((h + (1 << high) - 1) >> high)
        return TextureStore(
            np.concatenate([np.zeros((0, 4), np.uint8), *texels]),
            np.array(rows, np.int64).reshape(-1, 6),
            np.array(places, np.int64).reshape(-1, 2),
            line,
        )

    def memory(self, slots: int, ways: int) -> TextureMemory:
        """The textures behind an empty cache."""
        cache = make_lru(max(self.lines, 1), slots, ways)
        return TextureMemory(self.texels, self.levels, self.textures, cache, np.zeros(3, np.int64), np.zeros((4, 4)))
