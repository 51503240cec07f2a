"""Light on eight samples of a surface at a time (SIMD over samples)."""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .scalars import ONE, TINY, ZERO
from .simd import bits, floor, from_bits, greater, lesser, select, sqrt, to_float, to_int

LIGHT_POINT = ONE


@inlined
def log2_lanes(x):
    """Base-2 logarithm of x > 0, relative error below 3e-7 (atanh series around 1, exact at 1)."""
    word = bits(x)
    exponent = (word - np.int32(0x3F3504F3)) >> np.int32(23)
    m = from_bits(word - (exponent << np.int32(23)))
    s = (m - ONE) / (m + ONE)
    q = s * s
    series = q * (q * (q * (q * np.float32(0.3205989) + np.float32(0.4121986)) + np.float32(0.5770780)) + np.float32(
        0.9617967
    )) + np.float32(2.8853901)
    return to_float(exponent) + s * series


@inlined
def exp2_lanes(x):
    """2 to the power x ≤ 0, relative error below 2e-7."""
    x = greater(x, np.float32(-120.0))
    whole = floor(x)
    f = x - whole
    p = f * np.float32(0.000216138082) + np.float32(0.00124673764)
    p = f * (f * p + np.float32(0.00967553263)) + np.float32(0.0554852202)
    p = f * (f * (f * p + np.float32(0.240229325)) + np.float32(0.693147042)) + ONE
    return from_bits((to_int(whole) + np.int32(127)) << np.int32(23)) * p


@inlined
def locate(x, z, offset, row):
    """Eye-space position (X, Y, depth) relative to the centre camera.

    row = (1/fx, W/2, 1/focal, Y/depth without lens offset, lens offset, focal).
    """
    inverse_fx, centre, inverse_focal, slope, lens, focal = row
    depth = focal / z
    return depth * ((x - centre) * inverse_fx - offset * inverse_focal) + offset, depth * slope + lens, depth


@inlined
def unit(x, y, z):
    """A vector of length 1."""
    scale = ONE / sqrt(greater(x * x + y * y + z * z, TINY))
    return x * scale, y * scale, z * scale


@inlined
def diffuse_light(normal, lights, k):
    """Directional light k on a surface."""
    x, y, z = normal
    nl = greater(x * lights[k, 1] + y * lights[k, 2] + z * lights[k, 3], ZERO)
    return nl * lights[k, 4], nl * lights[k, 5], nl * lights[k, 6]


@inlined
def full_light(normal, place, eye, lights, k, shininess):
    """Diffuse and specular light k, a directional or a point light, on a surface at `place` seen from (eye x, y)."""
    (nx, ny, nz), (px, py, pz) = normal, place
    p = ONE if lights[k, 0] == LIGHT_POINT else ZERO
    lx, ly, lz = unit(px * -p + lights[k, 1], py * -p + lights[k, 2], pz * -p + lights[k, 3])
    nl = greater(nx * lx + ny * ly + nz * lz, ZERO)
    vx, vy, vz = unit(eye[0] - px, eye[1] - py, pz)
    hx, hy, hz = unit(lx + vx, ly + vy, lz - vz)
    nh = greater(nx * hx + ny * hy + nz * hz, TINY)
    shine = exp2_lanes(log2_lanes(lesser(nh, ONE)) * shininess)
    shine = select(nl > ZERO, shine, ZERO)
    r, g, b = lights[k, 4], lights[k, 5], lights[k, 6]
    return nl * r, nl * g, nl * b, shine * r, shine * g, shine * b
