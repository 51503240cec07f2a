"""Explicit SIMD for kernels: vectors of eight lanes, whatever registers the processor has.

What a loop vectoriser must prove, a kernel can simply say here: `x = load(a, i)` brings eight float32, float64 or
int32, operators work lane by lane, comparisons give masks, `select(mask, a, b)` chooses. LLVM makes one AVX or two SSE
or NEON instructions of each. Scalars beside a vector are repeated over the lanes; they must be of the vector's kind.

Every function here is plain Python on NumPy arrays of eight elements: that is its definition, and what runs when
Numba's JIT is off. Compiled, the same call becomes LLVM vector instructions (simd_compiled). No operation is reordered,
fused or approximated, so a lane holds the same bits as the scalar expression would.
"""

from __future__ import annotations

import numpy as np

LANES = 8


def load(array, index):
    """Eight elements of a float32, float64 or int32 array from `index` on."""
    return array[index : index + LANES].copy()


def store(array, index, vector):
    """Write eight elements from `index` on."""
    array[index : index + LANES] = vector


def stream(array, index, vector):
    """`store` past the caches, for what is not read again soon; the address must be a multiple of 16 bytes."""
    array[index : index + LANES] = vector


def gather(array, indices):
    """array[i] for each of eight int32 indices, not negative."""
    return array[indices]


def adjacent(array, index):
    """Elements `index` and the next of an unsigned or float32 array as one int64, the first in its lower half.

    One load for both.
    """
    size = 8 * array.itemsize
    first, second = (int(array[k : k + 1].view(f"u{array.itemsize}")[0]) for k in (int(index), int(index) + 1))
    return np.uint64(first | second << size).view(np.int64)


def append(array, index, vector, mask):
    """Write the lanes of an int32 vector where the mask holds from `index` on.

    Returns the index behind the last one written; what follows, up to eight elements in all, may change, too.
    """
    kept = vector[mask]
    array[index : index + len(kept)] = kept
    return index + np.uint64(len(kept))


def keep_greater(array, places, words, k, mask):
    """array[i] = words[k + i - p] where that is > array[i] | mask, for i = p and p + 1; p = places[0] = places[1].

    The place is given twice so that LLVM cannot make one masked store of load and store: AMD's are ten times as slow.
    """
    first = places[0]
    old, new = array[first : first + 2], words[k : k + 2]
    array[first : first + 2] = np.where(new > (old | mask), new, old)


def prefetch(array, index):
    """Bring what lies at `index` of a contiguous array near, without waiting; any index in or close to it will do."""


def splat(value):
    """Eight times a float32 or int32."""
    return np.full(LANES, value)


def iota():
    """0, 1, …, 7 as int32."""
    return np.arange(LANES, dtype=np.int32)


def select(mask, a, b):
    """Lanes of `a` where the mask holds, else of `b`."""
    return np.where(mask, a, b)


def lesser(a, b):
    """Minimum, lane by lane."""
    return np.where(a < b, a, b)


def greater(a, b):
    """Maximum, lane by lane."""
    return np.where(a > b, a, b)


def floor(a):
    """Greatest whole number ≤ a."""
    return np.floor(a)


def ceil(a):
    """Least whole number ≥ a."""
    return np.ceil(a)


def fused(a, b, c):
    """a·b + c, rounded once where the processor can, so not the same bits everywhere: for what need not be."""
    return a * b + c


def sqrt(a):
    """Square root."""
    return np.sqrt(a)


def to_int(a):
    """float32 to int32, towards zero; values that do not fit give any number."""
    with np.errstate(invalid="ignore"):
        return a.astype(np.int32)


def to_float(a):
    """int32, or float64 rounded, to float32."""
    return a.astype(np.float32)


def bits(a):
    """The bits of float32 as int32."""
    return a.view(np.int32)


def from_bits(a):
    """The float32 whose bits these are."""
    return a.view(np.float32)


def mask_word(mask):
    """A mask as a whole number: bit k is lane k."""
    return np.int32(sum(1 << k for k in range(LANES) if mask[k]))


def lane(vector, k):
    """Element k, a constant or variable from 0 to 7."""
    return vector[k]


def low_halves(a, b):
    """Lanes 0, 1 and 4, 5 of a and b, in turn: a0 b0 a1 b1 a4 b4 a5 b5 (AVX's unpacklo)."""
    return np.array([a[0], b[0], a[1], b[1], a[4], b[4], a[5], b[5]])


def high_halves(a, b):
    """a2 b2 a3 b3 a6 b6 a7 b7 (AVX's unpackhi)."""
    return np.array([a[2], b[2], a[3], b[3], a[6], b[6], a[7], b[7]])


def low_pairs(a, b):
    """a0 a1 b0 b1 a4 a5 b4 b5."""
    return np.array([a[0], a[1], b[0], b[1], a[4], a[5], b[4], b[5]])


def high_pairs(a, b):
    """a2 a3 b2 b3 a6 a7 b6 b7."""
    return np.array([a[2], a[3], b[2], b[3], a[6], a[7], b[6], b[7]])


def first_fours(a, b):
    """a0 a1 a2 a3 b0 b1 b2 b3."""
    return np.array([*a[:4], *b[:4]])


def last_fours(a, b):
    """a4 a5 a6 a7 b4 b5 b6 b7."""
    return np.array([*a[4:], *b[4:]])


def even_lanes(a, b):
    """a0 a2 a4 a6 b0 b2 b4 b6."""
    return np.array([*a[::2], *b[::2]])
