"""Tiles of 16 samples: the layout of a band of rows, and the SIMD steps that work on one tile at a time.

A tile is 16 samples next to each other in memory: 16 inverse depths (as bits of float32: positive floats order
like integers; 0 = empty) and then 16 colours, one cache line each. In a stack of views a tile is `views` ×
`columns` (4×4 as a rule): a triangle slides from view to view, so its short segment touches few tiles. Loops over
a tile run 16 steps at a constant stride, which LLVM turns into straight SIMD code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .mesh_shade import ADDRESS, ALPHA, COLOR, COLUMN, LEFT, ONE, RIGHT, TILE_U, TILE_Z, quantize

LANES = np.uint64(16)
TILE = np.uint64(32)  # int32 words


class Grid(NamedTuple):
    """A row of tiles: `groups` of `views` views, `across` tiles of `columns` pixels. `lanes` is 16.

    (As a field, `lanes` is known only at run time: loops over a constant 16 are sometimes unrolled before LLVM
    looks for SIMD.)
    """

    views: int
    columns: int
    groups: int
    across: int
    lanes: int


@inlined
def hit(x, left, right, z1, z2):
    """Whether a segment covers the sample at x, with its inverse depth and perspective parameter.

    With w = right − left and n = x − left: 1/depth = z1 + (n/w)·(z2 − z1) = q/w for q = z1·w + n·(z2 − z1), and
    the parameter is u = n·z2/q; one division serves both. Every draw uses this one expression.
    """
    w = right - left
    n = x - left
    q = z1 * w + n * (z2 - z1)
    r = ONE / (w * q)
    return (left <= x) & (x < right), q * q * r, n * z2 * (w * r)


@inlined
def plain_color(u, color):
    """Interpolated colour as RGBA bytes; color = (r, g, b at the left end, differences to the right end)."""
    r, g, b, dr, dg, db = color
    return quantize(r + u * dr) | (quantize(g + u * dg) << np.int32(8)) | (quantize(b + u * db) << np.int32(16)) | ALPHA


@inlined
def draw_tile_plain(tile, x, depths, color, band, lists):
    """Depth test and interpolated colour of one tile, ends of the segment from the LEFT and RIGHT lanes."""
    z1, z2 = depths
    o = np.uint64(tile) * TILE
    for i in range(LANES):
        covered, z, u = hit(x + lists[COLUMN + i], lists[LEFT + i], lists[RIGHT + i], z1, z2)
        bits = np.float32(z).view(np.int32)
        visible = covered & (bits > band[o + i])
        rgba = plain_color(u, color)
        band[o + i] = bits if visible else band[o + i]
        band[o + LANES + i] = rgba if visible else band[o + LANES + i]


@inlined
def test_tile(tile, x, depths, band, lists):
    """Depth test of one tile; returns a bit for each visible lane. Depth and parameter go to TILE_Z and TILE_U."""
    z1, z2 = depths
    o = np.uint64(tile) * TILE
    mask = np.int32(0)
    for i in range(LANES):
        covered, z, u = hit(x + lists[COLUMN + i], lists[LEFT + i], lists[RIGHT + i], z1, z2)
        bits = np.float32(z).view(np.int32)
        visible = covered & (bits > band[o + i])
        band[o + i] = bits if visible else band[o + i]
        lists[TILE_Z + i] = z
        lists[TILE_U + i] = u
        mask |= np.int32(1) << np.int32(i) if visible else np.int32(0)
    return mask


@inlined
def lowest_lane(mask):
    """Index of the lowest set bit of a mask ≠ 0 (from the exponent of that bit as a float)."""
    return np.uint64((np.float32(mask & -mask).view(np.int32) >> np.int32(23)) - np.int32(127))


@inlined
def scatter(n, band, ints):
    """Write the colours of the sample lists into the band."""
    for i in range(n):
        band[np.uint64(ints[ADDRESS + i])] = ints[COLOR + i]


@kernel
def clear_tiles(tiles, background, band):
    """Empty tiles: infinitely far, the background's colour."""
    for k in range(np.uint64(tiles)):
        o = k * TILE
        for i in range(LANES):
            band[o + i] = np.int32(0)
            band[o + LANES + i] = background
