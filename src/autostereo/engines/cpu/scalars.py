"""Constants of kernels, in the types that keep arithmetic in 32 bits, and small scalar functions."""

from __future__ import annotations

import numpy as np

from .jit import inlined

ZERO, HALF, ONE, BYTE = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(255.0)
TINY = np.float32(1e-20)
ALPHA = np.int32(-0x1000000)


@inlined
def whole_steps(n):
    """A count rounded up to whole SIMD steps: what lies beyond it does no harm, a remainder would be slow."""
    return (n + np.uint64(15)) & ~np.uint64(15)


@inlined
def quotient(whole, inverse):
    """whole // size of whole numbers, `inverse` = 1/size in float64: exact, and faster than their division."""
    return int((whole + 0.5) * inverse)


@inlined
def quantize(value):
    """⌊255·v + ½⌋ of a value clamped to 0…1."""
    return np.int32(min(max(value, ZERO), ONE) * BYTE + HALF)


@inlined
def log2_fast(x):
    """Base-2 logarithm of x > 0, relative error below 3e-7 (atanh series around 1, exact at 1)."""
    bits = np.float32(x).view(np.int32)
    exponent = (bits - np.int32(0x3F3504F3)) >> np.int32(23)
    m = np.int32(bits - (exponent << np.int32(23))).view(np.float32)
    s = (m - ONE) / (m + ONE)
    q = s * s
    series = np.float32(2.8853901) + q * (
        np.float32(0.9617967) + q * (np.float32(0.5770780) + q * (np.float32(0.4121986) + q * np.float32(0.3205989)))
    )
    return np.float32(exponent) + s * series


@inlined
def exp2_fast(x):
    """2 to the power x ≤ 0, relative error below 2e-7."""
    x = max(x, np.float32(-120.0))
    whole = np.floor(x)
    f = x - whole
    p = np.float32(0.00124673764) + f * np.float32(0.000216138082)
    p = np.float32(0.0554852202) + f * (np.float32(0.00967553263) + f * p)
    p = ONE + f * (np.float32(0.693147042) + f * (np.float32(0.240229325) + f * p))
    return np.int32((np.int32(whole) + np.int32(127)) << np.int32(23)).view(np.float32) * p
