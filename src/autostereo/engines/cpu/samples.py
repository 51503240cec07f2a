"""Samples: what is the same in every draw, and how a sample is kept.

A sample is one 64-bit word: the bits of its inverse depth above, its colour (RGBA) below; 0 above is empty.
Positive floats order like integers, so depth test, depth and colour are one comparison and one store.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_shade import ADDRESS, ALPHA, COLOR, ONE, quantize

DEPTH_SHIFT = np.int64(32)
COLOR_MASK = np.int64(0xFFFFFFFF)


@inlined
def hit(x, offset, ends, depths):
    """Whether a segment covers the sample at x of the camera at `offset`, its inverse depth and perspective parameter.

    With w = right − left and n = x − left: 1/depth = z1 + (n/w)·(z2 − z1) = q/w for q = z1·w + n·(z2 − z1), and
    the parameter is u = n·z2/q; one division serves both. Every draw uses this one expression.
    """
    x1, p1, x2, p2 = ends
    z1, z2 = depths
    left = x1 + offset * p1
    right = x2 + offset * p2
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
def word(z, color):
    """A sample's word."""
    return (np.int64(np.float32(z).view(np.int32)) << DEPTH_SHIFT) | (np.int64(color) & COLOR_MASK)


@inlined
def nearer(new, old):
    """Whether a sample is strictly nearer than another: of equally near ones the earlier stays."""
    return new > (old | COLOR_MASK)


@inlined
def scatter(n, band, ints):
    """Write the colours of the sample lists into the band."""
    for i in range(n):
        a = np.uint64(ints[ADDRESS + i])
        band[a] = (band[a] & ~COLOR_MASK) | (np.int64(ints[COLOR + i]) & COLOR_MASK)


@kernel
def clear_samples(count, background, band):
    """Empty samples: infinitely far, the background's colour."""
    empty = np.int64(background) & COLOR_MASK
    for k in range(np.uint64(count)):
        band[k] = empty
