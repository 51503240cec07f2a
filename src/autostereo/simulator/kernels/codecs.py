"""Lossless compression of blocks of depths and colours, as hardware does it: sizes, and the codes themselves.

Depths (after Morein 2000, as described by Hasselgren and Akenine-Möller, Efficient Depth Buffer Compression, 2006):
differential pulse code modulation. A triangle's depths 1/d are affine in the picture, so second differences of the
rounded values are −1, 0 or 1: two bits each. A block that is one plane takes an eighth; one that two planes share, each
predicted from its own corner, takes three eighths; all others are stored as they are.

Colours (after Rasmusson et al., Exact and Error-bounded Approximate Color Buffer Compression and Decompression, 2007):
reversible YCoCg, the median predictor, Golomb–Rice codes with one parameter a channel; in steps of 32 bytes. The
machine of 2006 cites a patent on multi-sampled colours [MSM*04], which has nothing to gain at one sample a pixel.
"""

from __future__ import annotations

import numpy as np

from .compiling import inlined, kernel

PLANE_RESIDUAL = 15  # two-plane mode: five bits, −15 … 15
BURST = 32  # bytes: sizes are multiples of what memory gives at once


@inlined
def _round_up(size):
    return (size + BURST - 1) // BURST * BURST


@kernel
def second_differences(values, x0, y0, w, h, out):
    """Differences that are small where depths are affine, into out (h, w). False where the block leaves the buffer.

    out[0, 0] is the value itself, out[0, 1] and out[1, 0] are first differences; along the first two rows differences
    of neighbouring differences, below them second differences down the columns.
    """
    if x0 + w > values.shape[1] or y0 + h > values.shape[0]:
        return False
    for y in range(h):
        for x in range(w):
            z = np.int64(values[y0 + y, x0 + x])
            if y >= 2:
                z -= 2 * np.int64(values[y0 + y - 1, x0 + x]) - np.int64(values[y0 + y - 2, x0 + x])
            elif y == 1:
                z -= np.int64(values[y0, x0 + x])
                if x >= 1:
                    z -= np.int64(values[y0 + 1, x0 + x - 1]) - np.int64(values[y0, x0 + x - 1])
            elif x >= 2:
                z -= 2 * np.int64(values[y0, x0 + x - 1]) - np.int64(values[y0, x0 + x - 2])
            elif x == 1:
                z -= np.int64(values[y0, x0])
            out[y, x] = z
    return True


@kernel
def from_second_differences(differences, out):
    """The values (h, w) again."""
    h, w = differences.shape
    for y in range(h):
        for x in range(w):
            z = differences[y, x]
            if y >= 2:
                z += 2 * out[y - 1, x] - out[y - 2, x]
            elif y == 1:
                z += out[0, x]
                if x >= 1:
                    z += out[1, x - 1] - out[0, x - 1]
            elif x >= 2:
                z += 2 * out[0, x - 1] - out[0, x - 2]
            elif x == 1:
                z += out[0, 0]
            out[y, x] = z


@inlined
def _anchor(values, x0, y0, w, h, which, x, y):
    """Prediction at (x, y) of a block from its top-left (0) or bottom-right (1) corner and that one's neighbours."""
    cx, cy, step = x0, y0, 1
    if which == 1:
        cx, cy, step = x0 + w - 1, y0 + h - 1, -1
    z = np.int64(values[cy, cx])
    dx = np.int64(values[cy, cx + step]) - z
    dy = np.int64(values[cy + step, cx]) - z
    return z + dx * step * (x0 + x - cx) + dy * step * (y0 + y - cy)


@kernel
def two_planes(values, x0, y0, w, h, plane, residual):
    """The plane (h, w) that predicts each pixel and its residual (h, w). False where five bits are not enough."""
    if w < 2 or h < 2 or x0 + w > values.shape[1] or y0 + h > values.shape[0]:
        return False
    for y in range(h):
        for x in range(w):
            z = np.int64(values[y0 + y, x0 + x])
            first = z - _anchor(values, x0, y0, w, h, 0, x, y)
            second = z - _anchor(values, x0, y0, w, h, 1, x, y)
            plane[y, x] = 1 if abs(second) < abs(first) else 0
            residual[y, x] = second if abs(second) < abs(first) else first
            if abs(residual[y, x]) > PLANE_RESIDUAL:
                return False
    return True


@kernel
def depth_size(values, x0, y0, w, h, memory):
    """Bytes of a block of depths (H, W), 4 a pixel if it cannot be compressed; `memory` (≥ 2, h, w) is for the work."""
    raw = w * h * 4
    scratch, plane = memory[0], memory[1]
    if w >= 2 and h >= 2 and second_differences(values, x0, y0, w, h, scratch):
        small = True
        for y in range(h):
            for x in range(w):
                if y + x >= 2 or (y == 1 and x == 1):
                    small = small and abs(scratch[y, x]) <= 1
        if small:  # one value, two differences of 33 bits, two bits for each other pixel; two bits for the mode
            return min(raw, _round_up((2 + 32 + 2 * 33 + 2 * (w * h - 3) + 7) // 8))
    if two_planes(values, x0, y0, w, h, plane, scratch):
        return min(raw, _round_up((2 + 2 * (32 + 2 * 33) + 6 * w * h + 7) // 8))
    return raw


@inlined
def _median(left, up, corner):
    """Prediction from three neighbours (LOCO-I): the median of left, up and left + up − corner."""
    low, high = min(left, up), max(left, up)
    if corner >= high:
        return low
    if corner <= low:
        return high
    return left + up - corner


@kernel
def color_residuals(values, x0, y0, w, h, out):
    """Residuals (4, h, w) of the reversible Y, Co, Cg and of alpha, after prediction."""
    for y in range(h):
        for x in range(w):
            p = np.int64(values[y0 + y, x0 + x])
            r, g, b = p & 255, p >> 8 & 255, p >> 16 & 255
            co = r - b
            t = b + (co >> 1)
            cg = g - t
            out[0, y, x] = t + (cg >> 1)
            out[1, y, x] = co
            out[2, y, x] = cg
            out[3, y, x] = p >> 24
    for c in range(4):
        for y in range(h - 1, -1, -1):  # from the end, so that the neighbours are still values
            for x in range(w - 1, -1, -1):
                if y > 0 and x > 0:
                    out[c, y, x] -= _median(out[c, y, x - 1], out[c, y - 1, x], out[c, y - 1, x - 1])
                elif x > 0:
                    out[c, y, x] -= out[c, y, x - 1]
                elif y > 0:
                    out[c, y, x] -= out[c, y - 1, x]


@kernel
def from_color_residuals(residuals, out):
    """The colours (h, w) again; `residuals` is overwritten."""
    _, h, w = residuals.shape
    for c in range(4):
        for y in range(h):
            for x in range(w):
                if y > 0 and x > 0:
                    residuals[c, y, x] += _median(
                        residuals[c, y, x - 1], residuals[c, y - 1, x], residuals[c, y - 1, x - 1]
                    )
                elif x > 0:
                    residuals[c, y, x] += residuals[c, y, x - 1]
                elif y > 0:
                    residuals[c, y, x] += residuals[c, y - 1, x]
    for y in range(h):
        for x in range(w):
            t = residuals[0, y, x] - (residuals[2, y, x] >> 1)
            g = residuals[2, y, x] + t
            b = t - (residuals[1, y, x] >> 1)
            r = b + residuals[1, y, x]
            out[y, x] = r | g << 8 | b << 16 | residuals[3, y, x] << 24


@inlined
def fold(residual):
    """0, −1, 1, −2, 2 … as 0, 1, 2, 3, 4 …"""
    return 2 * residual if residual >= 0 else -2 * residual - 1


@kernel
def rice_bits(residuals):
    """Bits of residuals (h, w) in a Golomb–Rice code, with its parameter k (four bits; 15: all are zero).

    k is the whole part of log2 of the mean, as in LOCO-I.
    """
    h, w = residuals.shape
    total = np.int64(0)
    for y in range(h):
        for x in range(w):
            total += fold(residuals[y, x])
    if total == 0:
        return np.int64(4)
    k = 0
    while (h * w) << (k + 1) <= total:
        k += 1
    bits = np.int64(4 + h * w * (k + 1))
    for y in range(h):
        for x in range(w):
            bits += fold(residuals[y, x]) >> k
    return bits


@kernel
def color_size(values, x0, y0, w, h, memory):
    """Bytes of a block of colours (H, W), 4 a pixel if it cannot be compressed; `memory` (4, h, w) is for the work."""
    raw = w * h * 4
    wide, high = min(w, values.shape[1] - x0), min(h, values.shape[0] - y0)
    residuals = memory[:, :high, :wide]
    color_residuals(values, x0, y0, wide, high, residuals)
    bits = np.int64(1)
    for c in range(4):
        bits += rice_bits(residuals[c])
    return min(raw, _round_up((bits + 7) // 8))
