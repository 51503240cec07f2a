"""Samples: what is the same in every draw of meshes, and how a sample is kept.

A sample is one 64-bit word: the bits of its inverse depth above, its colour (RGBA) below; 0 above is empty.
Positive floats order like integers, so depth test, depth and colour are one comparison and one store.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .scalars import ONE
from .simd import (
    LANES,
    bits,
    first_fours,
    high_halves,
    high_pairs,
    iota,
    keep_greater,
    last_fours,
    low_halves,
    low_pairs,
    select,
    splat,
    store,
)

DEPTH_SHIFT = np.int64(32)
COLOR_MASK = np.int64(0xFFFFFFFF)
EMPTY = np.int32(0)
PAIR = (0, 4, 8, 12, 2, 6, 10, 14)  # place of a lane's two words


@inlined
def hit(x, offset, ends, depths):
    """Which of eight samples a segment covers from the cameras at `offset`, inverse depths, perspective parameters.

    With w = right − left and n = x − left: 1/depth = z1 + (n/w)·(z2 − z1) = q/w for q = z1·w + n·(z2 − z1), and
    the parameter is u = n·z2/q; one division serves both. Every draw uses this one expression. Rounding must not part
    what lies at one depth for all cameras, so that coplanar triangles tie.
    """
    x1, p1, x2, p2 = ends
    z1, z2 = depths
    left = offset * p1 + x1
    right = offset * p2 + x2
    w = right - left
    n = x - left
    q = w * z1 + n * (z2 - z1)
    r = ONE / (w * q)
    z = splat(z1) if z1 == z2 else q * q * r
    return (left <= x) & (x < right), z, n * z2 * (w * r)


@inlined
def depth_bits(covered, z):
    """The upper half of words of samples: the bits of the inverse depth where covered, else empty."""
    return select(covered, bits(z), EMPTY)


@inlined
def store_words(depth, color, word_halves):
    """Eight words in order, from their halves."""
    low, high = low_halves(color, depth), high_halves(color, depth)
    store(word_halves, 0, first_fours(low, high))
    store(word_halves, LANES, last_fours(low, high))


@inlined
def keep_nearer(a, new, band):
    """Depth test and store of one sample: strictly nearer; of equally near ones the earlier stays."""
    old = band[a]
    band[a] = new if new > (old | COLOR_MASK) else old


@inlined
def store_pairs(first, second, word_halves):
    """Words of two samples of each of eight lanes, side by side at PAIR[lane]; first, second: halves (depth, color)."""
    (depth, color), (depth2, color2) = first, second
    low, high = low_halves(color, depth), high_halves(color, depth)
    low2, high2 = low_halves(color2, depth2), high_halves(color2, depth2)
    store(word_halves, 0, low_pairs(low, low2))
    store(word_halves, LANES, high_pairs(low, low2))
    store(word_halves, 2 * LANES, low_pairs(high, high2))
    store(word_halves, 3 * LANES, high_pairs(high, high2))


@inlined
def keep_nearer_pairs(k, lanes, addresses, words, band):
    """Depth test and store of the words of store_pairs, from k samples after each of so many addresses.

    addresses: eight, twice (see keep_greater).
    """
    if lanes == LANES:
        for j in range(LANES):
            places = (np.uint64(addresses[j] + k), np.uint64(addresses[LANES + j] + k))
            keep_greater(band, places, words, PAIR[j], COLOR_MASK)
    else:
        for j in range(lanes):
            places = (np.uint64(addresses[j] + k), np.uint64(addresses[LANES + j] + k))
            keep_greater(band, places, words, PAIR[j], COLOR_MASK)


@inlined
def empty_samples(background):
    """Four empty samples, infinitely far and of the background's colour, as halves."""
    return select((iota() & np.int32(1)) == np.int32(0), splat(background), EMPTY)


@inlined
def clear_samples(first, count, background, halves):
    """Empty samples from `first` on; up to seven more are cleared, too."""
    empty = empty_samples(background)
    for k in range(2 * np.uint64(first), 2 * np.uint64(first + count), LANES):
        store(halves, k, empty)
