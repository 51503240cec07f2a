"""Light on LANES samples of a surface at a time (SIMD over samples)."""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .scalars import ONE, TINY, ZERO
from .simd import (
    bits,
    floor,
    from_bits,
    fused,
    greater,
    inverse_sqrt,
    lesser,
    reciprocal,
    select,
    splat,
    to_float,
    to_int,
)

LIGHT_POINT = ONE


@inlined
def log2_lanes(x):
    """Base-2 logarithm of x > 0, relative error below 3e-7 (atanh series around 1, exact at 1)."""
    word = bits(x)
    exponent = (word - np.int32(0x3F3504F3)) >> np.int32(23)
    m = from_bits(word - (exponent << np.int32(23)))
    s = (m - ONE) * reciprocal(m + ONE)
    q = s * s
    series = fused(q, np.float32(0.3205989), splat(np.float32(0.4121986)))
    for factor in (0.5770780, 0.9617967, 2.8853901):
        series = fused(q, series, splat(np.float32(factor)))
    return fused(s, series, to_float(exponent))


@inlined
def exp2_lanes(x):
    """2 to the power x ≤ 0, relative error below 2e-7."""
    x = greater(x, np.float32(-120.0))
    whole = floor(x)
    f = x - whole
    p = fused(f, np.float32(0.000216138082), splat(np.float32(0.00124673764)))
    for factor in (0.00967553263, 0.0554852202, 0.240229325, 0.693147042, 1.0):
        p = fused(f, p, splat(np.float32(factor)))
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
def dot(a, b):
    """Scalar product; components of `b` may be scalars."""
    return fused(a[0], b[0], fused(a[1], b[1], a[2] * b[2]))


@inlined
def unit(x, y, z):
    """A vector of length 1."""
    scale = inverse_sqrt(greater(dot((x, y, z), (x, y, z)), TINY))
    return x * scale, y * scale, z * scale


@inlined
def diffuse_light(normal, lights, k):
    """Directional light k on a surface."""
    nl = greater(dot(normal, (lights[k, 1], lights[k, 2], lights[k, 3])), ZERO)
    return nl * lights[k, 4], nl * lights[k, 5], nl * lights[k, 6]


@inlined
def full_light(normal, place, eye, lights, k, shininess):
    """Diffuse and specular light k, a directional or a point light, on a surface at `place` seen from (eye x, y)."""
    px, py, pz = place
    p = ONE if lights[k, 0] == LIGHT_POINT else ZERO
    lx, ly, lz = unit(px * -p + lights[k, 1], py * -p + lights[k, 2], pz * -p + lights[k, 3])
    nl = greater(dot(normal, (lx, ly, lz)), ZERO)
    vx, vy, vz = unit(eye[0] - px, eye[1] - py, pz)
    nh = greater(dot(normal, unit(lx + vx, ly + vy, lz - vz)), TINY)
    shine = exp2_lanes(log2_lanes(lesser(nh, ONE)) * shininess)
    shine = select(nl > ZERO, shine, ZERO)
    r, g, b = lights[k, 4], lights[k, 5], lights[k, 6]
    return nl * r, nl * g, nl * b, shine * r, shine * g, shine * b
