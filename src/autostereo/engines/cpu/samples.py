"""Samples: what is the same in every draw of meshes, and how a sample is kept.

A sample is one 64-bit word: the bits of its inverse depth above, its colour (RGBA) below; 0 above is empty.
Positive floats order like integers, so depth test, depth and colour are one comparison and one store.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .simd import (
    LANES,
    bits,
    fused,
    high_halves,
    high_pairs,
    iota,
    keep_greater,
    low_halves,
    low_pairs,
    reciprocal,
    select,
    splat,
    store,
)

DEPTH_SHIFT = np.int64(32)
COLOR_MASK = np.int64(0xFFFFFFFF)
EMPTY = np.int32(0)
WORD = tuple(k // 4 * 2 + k % 2 + (LANES // 2) * (k % 4 // 2) for k in range(LANES))  # place of a lane's word
PAIR = tuple(k // 4 * 2 + (LANES // 2) * (k % 4) for k in range(LANES))  # place of a lane's two words


@inlined
def hit(x, offset, ends, depths):
    """Which of LANES samples a segment covers from the cameras at `offset`, inverse depths, perspective parameters.

    With t = (x − left)/(right − left): 1/depth = z = z1 + t·(z2 − z1), and the parameter is u = t·z2/z. Every draw
    uses this one expression.
    """
    x1, p1, x2, p2 = ends
    z1, z2 = depths
    left = fused(offset, p1, x1)
    right = fused(offset, p2, x2)
    t = (x - left) * reciprocal(right - left)
    z = fused(t, z2 - z1, z1)
    return (left <= x) & (x < right), z, t * z2 * reciprocal(z)


@inlined
def depth_bits(covered, z):
    """The upper half of words of samples: the bits of the inverse depth where covered, else empty."""
    return select(covered, bits(z), EMPTY)


@inlined
def store_words(depth, color, word_halves):
    """Words from their halves; that of a lane at WORD[lane]."""
    store(word_halves, 0, low_halves(color, depth))
    store(word_halves, LANES, high_halves(color, depth))


@inlined
def keep_nearer(a, new, band):
    """Depth test and store of one sample: strictly nearer; of equally near ones the earlier stays."""
    old = band[a]
    band[a] = new if new > (old | COLOR_MASK) else old


@inlined
def store_pairs(first, second, word_halves):
    """Words of two samples of each lane, side by side at PAIR[lane]; first, second: halves (depth, color)."""
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

    addresses: of all lanes, twice (see keep_greater).
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
    """LANES / 2 empty samples, infinitely far and of the background's colour, as halves."""
    return select((iota() & np.int32(1)) == np.int32(0), splat(background), EMPTY)


@inlined
def clear_samples(first, count, background, halves):
    """Empty samples from `first` on; up to LANES / 2 − 1 more are cleared, too."""
    empty = empty_samples(background)
    for k in range(2 * np.uint64(first), 2 * np.uint64(first + count), LANES):
        store(halves, k, empty)
