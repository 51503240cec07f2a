"""Shading of a list of samples that lie on one segment (one triangle in one row).

Technique: all lists live in one float32 array, each in a row of fixed length STRIDE. The distance between two
lists is then a compile-time constant, so LLVM proves that loads and stores do not overlap and every loop here
becomes SIMD without run-time checks. Indices are unsigned: no test for Python's negative indexing.

Every colour is a direct function of (sample, camera offset): the same in single-pass, n-pass and panel draws.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel

STRIDE = 1040  # list capacity: 1024 + one cache line, so that lists do not fall onto the same cache set
CAPACITY = 1024

# rows of the float32 scratch: lanes of samples at hand …
START, RUN, LANE_U, LANE_Z, LANE_X, LANE_OFFSET = (np.uint64(k * STRIDE) for k in range(6))
# … and the list of visible samples
U, Z, OFFSET, X = (np.uint64((6 + k) * STRIDE) for k in range(4))
KR, KG, KB, NX, NY, NZ = (np.uint64((10 + k) * STRIDE) for k in range(6))
DR, DG, DB, SR, SG, SB = (np.uint64((16 + k) * STRIDE) for k in range(6))
PX, PY, PZ, LOD, TS, TT = (np.uint64((22 + k) * STRIDE) for k in range(6))
FLOAT_ROWS = 28
# rows of the int32 scratch
ADDRESS, COLOR, BASE, END, PLACE = (np.uint64(k * STRIDE) for k in range(5))
INT_ROWS = 5

ZERO, HALF, ONE, BYTE = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(255.0)
TINY = np.float32(1e-20)
ALPHA = np.int32(-0x1000000)

LIGHT_POINT = np.float32(1.0)


@inlined
def whole_steps(n):
    """A count rounded up to whole SIMD steps: what lies beyond it does no harm, a remainder would be slow."""
    return (n + np.uint64(15)) & ~np.uint64(15)


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


@kernel
def interpolate(n, segment, k, row, lists):
    """List `row` = attribute k of the segment."""
    first, step = segment[k], segment[k + 16]
    for i in range(n):
        lists[row + i] = first + lists[U + i] * step


@kernel
def normalize_normals(n, sign, lists):
    """Normals to unit length, turned towards the viewer on back sides (sign −1)."""
    for i in range(n):
        x, y, z = lists[NX + i], lists[NY + i], lists[NZ + i]
        scale = sign / np.sqrt(max(x * x + y * y + z * z, TINY))
        lists[NX + i] = x * scale
        lists[NY + i] = y * scale
        lists[NZ + i] = z * scale


@kernel
def locate(n, row, lists):
    """Eye-space positions relative to the centre camera: P = (X, Y, depth) of every sample.

    `row` = (1/fx, W/2, 1/focal, Y/depth without lens offset, lens offset, focal).
    """
    inverse_fx, centre, inverse_focal, slope, lens, focal = row
    for i in range(n):
        offset = lists[OFFSET + i]
        depth = focal / lists[Z + i]
        lists[PX + i] = depth * ((lists[X + i] - centre) * inverse_fx - offset * inverse_focal) + offset
        lists[PY + i] = depth * slope + lens
        lists[PZ + i] = depth


@kernel
def add_light(n, k, lights, highlight, view, lists):
    """Add light k to the diffuse and specular sums.

    highlight = (specular, shininess); view = (1 for each sample's own eye or 0 for the centre's, lens offset).
    """
    point = lights[k, 0] == LIGHT_POINT
    lx, ly, lz = lights[k, 1], lights[k, 2], lights[k, 3]
    r, g, b = lights[k, 4], lights[k, 5], lights[k, 6]
    own, lens = view
    specular, shininess = highlight
    if not point and specular == ZERO:
        for i in range(n):
            nl = max(lists[NX + i] * lx + lists[NY + i] * ly + lists[NZ + i] * lz, ZERO)
            lists[DR + i] += r * nl
            lists[DG + i] += g * nl
            lists[DB + i] += b * nl
        return
    p = ONE if point else ZERO
    for i in range(n):
        px, py, pz = lists[PX + i], lists[PY + i], lists[PZ + i]
        nx, ny, nz = lists[NX + i], lists[NY + i], lists[NZ + i]
        tx, ty, tz = lx - p * px, ly - p * py, lz - p * pz
        scale = ONE / np.sqrt(max(tx * tx + ty * ty + tz * tz, TINY))
        tx, ty, tz = tx * scale, ty * scale, tz * scale
        nl = max(nx * tx + ny * ty + nz * tz, ZERO)
        vx, vy = own * lists[OFFSET + i] - px, lens - py
        scale = ONE / np.sqrt(max(vx * vx + vy * vy + pz * pz, TINY))
        hx, hy, hz = tx + vx * scale, ty + vy * scale, tz - pz * scale
        scale = ONE / np.sqrt(max(hx * hx + hy * hy + hz * hz, TINY))
        nh = max((nx * hx + ny * hy + nz * hz) * scale, TINY)
        shine = exp2_fast(shininess * log2_fast(min(nh, ONE)))
        shine = shine if nl > ZERO else ZERO
        lists[DR + i] += r * nl
        lists[DG + i] += g * nl
        lists[DB + i] += b * nl
        lists[SR + i] += r * shine
        lists[SG + i] += g * shine
        lists[SB + i] += b * shine


@kernel
def clear_sums(n, lists):
    """Set the sums of light to zero."""
    for i in range(n):
        lists[DR + i] = ZERO
        lists[DG + i] = ZERO
        lists[DB + i] = ZERO
        lists[SR + i] = ZERO
        lists[SG + i] = ZERO
        lists[SB + i] = ZERO


@kernel
def modulate(n, ambient, diffuse, specular, lists):
    """Colour k·(ambient + diffuse·D) and highlight specular·S, in place of the sums."""
    for i in range(n):
        lists[KR + i] *= ambient + diffuse * lists[DR + i]
        lists[KG + i] *= ambient + diffuse * lists[DG + i]
        lists[KB + i] *= ambient + diffuse * lists[DB + i]
        lists[SR + i] *= specular
        lists[SG + i] *= specular
        lists[SB + i] *= specular


@kernel
def pack(n, lists, ints):
    """Quantised colours k + s as RGBA bytes in an int32."""
    for i in range(n):
        ints[COLOR + i] = (
            quantize(lists[KR + i] + lists[SR + i])
            | (quantize(lists[KG + i] + lists[SG + i]) << np.int32(8))
            | (quantize(lists[KB + i] + lists[SB + i]) << np.int32(16))
            | ALPHA
        )
