"""Explicit SIMD for kernels: vectors of sixteen lanes where the processor has AVX-512, elsewhere of eight.

What a loop vectoriser must prove, a kernel can simply say here: `x = load(a, i)` brings LANES float32, float64 or
int32, operators work lane by lane, comparisons give masks, `select(mask, a, b)` chooses. LLVM makes one AVX or a few
SSE or NEON instructions of each. Scalars beside a vector are repeated over the lanes; they must be of its kind.

Every function here is plain Python on NumPy arrays of LANES elements: that is its definition, and what runs when
Numba's JIT is off. Compiled, the same call becomes LLVM vector instructions (simd_types, simd_compiled). No operation
is reordered, and none but `fused`, `reciprocal` and `inverse_sqrt` approximated, so a lane holds the bits that the
scalar expression would.
"""

from __future__ import annotations

import numpy as np
from llvmlite import binding
from numba import config


def has_feature(name: str) -> bool:
    """Whether kernels are compiled for this machine, with AVX, and its processor has a feature by LLVM's name."""
    if config.CPU_NAME not in (None, "host") or config.CPU_FEATURES is not None or not config.ENABLE_AVX:
        return False
    return "x86_64" in binding.get_process_triple() and bool(binding.get_host_cpu_features().get(name))


def _lanes() -> int:
    """Sixteen where kernels are compiled for this machine and it has AVX-512, else eight."""
    return 16 if all(has_feature(f"avx512{part}") for part in ("f", "vl", "bw", "dq")) else 8


LANES = _lanes()


def load(array, index):
    """LANES elements of a float32, float64 or int32 array from `index` on."""
    return array[index : index + LANES].copy()


def load_eight(array, index):
    """Eight elements of a float32 array from `index` on, however many lanes other vectors have."""
    return array[index : index + 8].copy()


def store(array, index, vector):
    """Write a vector's elements from `index` on."""
    array[index : index + len(vector)] = vector


def stream(array, index, vector):
    """`store` past the caches, for what is not read again soon; the address must be a multiple of 16 bytes."""
    array[index : index + LANES] = vector


def gather(array, indices):
    """array[i] for each of the int32 indices, not negative."""
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

    Returns the index behind the last one written; what follows, up to LANES elements in all, may change, too.
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
    """A float32 or int32 in every lane."""
    return np.full(LANES, value)


def iota():
    """0, 1, …, LANES − 1 as int32."""
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


def reciprocal(a):
    """1/a within an ulp or two, so not the same bits everywhere; of 0 and of what has no reciprocal, any number."""
    with np.errstate(divide="ignore"):
        return np.float32(1.0) / a


def inverse_sqrt(a):
    """1/√a of normal numbers above 0, likewise near."""
    return np.float32(1.0) / np.sqrt(a)


def pack_bytes(r, g, b):
    """RGBA words of red, green and blue as int32, each clamped to 0…255; opaque."""
    r, g, b = (np.clip(c, 0, 255) for c in (r, g, b))
    return r | (g << 8) | (b << 16) | np.int32(-1 << 24)


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
    """Element k, a constant or variable from 0 to LANES − 1."""
    return vector[k]


def low_halves(a, b):
    """Of every four lanes of a and b the first two, in turn: a0 b0 a1 b1 a4 b4 a5 b5 … (AVX's unpacklo)."""
    a, b = a.reshape(-1, 4), b.reshape(-1, 4)
    return np.stack([a[:, 0], b[:, 0], a[:, 1], b[:, 1]], axis=1).ravel()


def high_halves(a, b):
    """a2 b2 a3 b3 a6 b6 a7 b7 … (AVX's unpackhi)."""
    a, b = a.reshape(-1, 4), b.reshape(-1, 4)
    return np.stack([a[:, 2], b[:, 2], a[:, 3], b[:, 3]], axis=1).ravel()


def low_pairs(a, b):
    """a0 a1 b0 b1 a4 a5 b4 b5 …"""
    return np.concatenate([a.reshape(-1, 4)[:, :2], b.reshape(-1, 4)[:, :2]], axis=1).ravel()


def high_pairs(a, b):
    """a2 a3 b2 b3 a6 a7 b6 b7 …"""
    return np.concatenate([a.reshape(-1, 4)[:, 2:], b.reshape(-1, 4)[:, 2:]], axis=1).ravel()


def first_in_turn(a, b):
    """The lower halves in turn: a0 b0 a1 b1 …"""
    return np.stack([a, b], axis=1).ravel()[:LANES]


def last_in_turn(a, b):
    """The upper halves in turn."""
    return np.stack([a, b], axis=1).ravel()[LANES:]


def even_lanes(a, b):
    """a0 a2 a4 … b0 b2 b4 …"""
    return np.array([*a[::2], *b[::2]])
