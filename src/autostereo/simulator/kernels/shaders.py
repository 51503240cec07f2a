"""The built-in pixel shaders. What they read of textures goes through the texture cache, dependent reads too.

A shader is a function (at, dx, dy, eye, uniforms, memory, units, out):

at, dx, dy : ndarray of shape (A,)
    Attributes at the sample, perspective-correct, and the changes per pixel in x and y of the first `derivatives`.
eye : ndarray of shape (5,)
    The eye (x, y, 0) to shade for, in the centre camera's eye space; eye[3] = 1 if the front is seen, −1 the back;
    eye[4] the depth of the near plane.
uniforms : ndarray of shape (U,)
memory : TextureMemory
units : ndarray of shape (number of textures,), int64
    The draw's textures.
out : ndarray of shape (5,)
    Colour and opacity, 0…1; clamped afterwards. out[4] comes in as near/depth of the sample; in draws with
    `depth_output` what it is afterwards, clamped to 0…1, is the fragment's depth.
"""

from __future__ import annotations

import math

import numpy as np

from .compiling import inlined, kernel
from .textures import compare_depth, trilinear

SURFACE, LEVEL, SHADOWS, OCEAN, PLAIN, RELIEF = range(6)

# Poisson-like points of the unit disc for soft shadows: the first eight are its rim (Uralsky 2005), 56 fill it
_turns = np.arange(56) * 2.399963229728653  # golden angle
_radii = np.sqrt((np.arange(56) + 0.5) / 56) * 0.9
_rim = (np.arange(8) + 0.5) * math.pi / 4
DISC = np.concatenate(
    [
        np.stack([np.cos(_rim), np.sin(_rim)], axis=1),
        np.stack([_radii * np.cos(_turns), _radii * np.sin(_turns)], axis=1),
    ]
)


@inlined
def _filtered(memory, texture, at, dx, dy, i, out):
    """Texture at the coordinates in attributes i, i + 1."""
    trilinear(memory, texture, at[i], at[i + 1], dx[i], dx[i + 1], dy[i], dy[i + 1], out)


@inlined
def _unit(x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        return x / length, y / length, z / length
    return x, y, z


@kernel
def surface(at, dx, dy, eye, uniforms, memory, units, out):
    """A Mesh of the package: Blinn–Phong times texture. Attributes uv, colour, normal, position.

    uniforms: ambient, diffuse, specular, shininess, then 7 for each light (homogeneous position, colour).
    """
    sign = eye[3]
    nx, ny, nz = _unit(at[5], at[6], at[7])
    nx, ny, nz = sign * nx, sign * ny, sign * nz
    vx, vy, vz = _unit(eye[0] - at[8], eye[1] - at[9], eye[2] - at[10])
    r = g = b = uniforms[0]
    hr = hg = hb = 0.0
    for i in range(4, len(uniforms), 7):
        w = uniforms[i + 3]
        lx, ly, lz = _unit(uniforms[i] - w * at[8], uniforms[i + 1] - w * at[9], uniforms[i + 2] - w * at[10])
        cosine = nx * lx + ny * ly + nz * lz
        if cosine <= 0.0:
            continue
        r += uniforms[1] * cosine * uniforms[i + 4]
        g += uniforms[1] * cosine * uniforms[i + 5]
        b += uniforms[1] * cosine * uniforms[i + 6]
        if uniforms[2] > 0.0:
            hx, hy, hz = _unit(lx + vx, ly + vy, lz + vz)
            gloss = uniforms[2] * max(nx * hx + ny * hy + nz * hz, 0.0) ** uniforms[3]
            hr += gloss * uniforms[i + 4]
            hg += gloss * uniforms[i + 5]
            hb += gloss * uniforms[i + 6]
    for c in range(4):
        out[c] = 1.0
    if len(units) > 0:
        _filtered(memory, units[0], at, dx, dy, 0, out)
    out[0] = out[0] * at[2] * r + hr
    out[1] = out[1] * at[3] * g + hg
    out[2] = out[2] * at[4] * b + hb
    out[3] = 1.0


@inlined
def level(at, dx, dy, eye, uniforms, memory, units, out):
    """Decal times light map, as games of 2000: two texture units. Attributes uv of both."""
    light = memory.colors[0]
    _filtered(memory, units[0], at, dx, dy, 0, out)
    _filtered(memory, units[1], at, dx, dy, 2, light)
    for c in range(3):
        out[c] *= 2.0 * light[c]
    out[3] = uniforms[0]


@kernel
def relief(at, dx, dy, eye, uniforms, memory, units, out):
    """Stones that stand out of a plane surface: as `level`, and with the depth of the raised surface.

    A polygon with a depth for each texel (Schaufler, Nailboards, 1997). The decal's alpha is the height, ½ the surface
    itself; the ray that meets the plane N·(X − eye) = c meets it at 1 + h/c times the depth where it is raised by h.
    Attributes: uv of both, normal, position. uniforms: opacity, height from 0 to 1.
    """
    light = memory.colors[0]
    _filtered(memory, units[0], at, dx, dy, 0, out)
    _filtered(memory, units[1], at, dx, dy, 2, light)
    height = (out[3] - 0.5) * uniforms[1]
    for c in range(3):
        out[c] *= 2.0 * light[c]
    out[3] = uniforms[0]
    nx, ny, nz = _unit(at[4], at[5], at[6])
    distance = nx * (at[7] - eye[0]) + ny * (at[8] - eye[1]) + nz * (at[9] - eye[2])
    if distance != 0.0:
        out[4] /= min(max(1.0 + height / distance, 0.5), 2.0)


@kernel
def shadows(at, dx, dy, eye, uniforms, memory, units, out):
    """Adaptive soft shadows (Uralsky 2005) with bump and gloss maps.

    Attributes: uv, normal, tangent, position, place seen from the light (X, Y in widths of the map at depth 1, depth).
    Units: colour, bump, gloss, shadow map. uniforms: unit vector to the light, radius of the penumbra in the map,
    relative bias, near plane of the light. 8 samples on the rim; only where they disagree 56 more, so penumbras alone
    are dear. Four texels a sample.
    """
    bump, gloss = memory.colors[0], memory.colors[1]
    _filtered(memory, units[0], at, dx, dy, 0, out)
    _filtered(memory, units[1], at, dx, dy, 0, bump)
    _filtered(memory, units[2], at, dx, dy, 0, gloss)
    nx, ny, nz = _unit(at[2], at[3], at[4])
    tx, ty, tz = _unit(at[5], at[6], at[7])
    bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    p, q, s = 2.0 * bump[0] - 1.0, 2.0 * bump[1] - 1.0, 2.0 * bump[2] - 1.0
    nx, ny, nz = _unit(p * tx + q * bx + s * nx, p * ty + q * by + s * ny, p * tz + q * bz + s * nz)
    lx, ly, lz = uniforms[0], uniforms[1], uniforms[2]
    cosine = nx * lx + ny * ly + nz * lz
    u, v = 0.5 + at[11] / at[13], 0.5 + at[12] / at[13]
    depth = uniforms[5] * (1.0 - uniforms[4]) / at[13] * 4294967296.0
    lit = 0.0
    for i in range(8):
        lit += compare_depth(
            memory, units[3], u + uniforms[3] * DISC[i, 0], v + uniforms[3] * DISC[i, 1], depth
        )
    share = lit / 8.0
    if 0.0 < lit < 8.0:
        for i in range(8, 64):
            lit += compare_depth(
                memory, units[3], u + uniforms[3] * DISC[i, 0], v + uniforms[3] * DISC[i, 1], depth
            )
        share = lit / 64.0
    diffuse, highlight = 0.0, 0.0
    if cosine > 0.0:
        vx, vy, vz = _unit(eye[0] - at[8], eye[1] - at[9], eye[2] - at[10])
        hx, hy, hz = _unit(lx + vx, ly + vy, lz + vz)
        diffuse = 0.8 * cosine * share
        highlight = share * gloss[0] * max(nx * hx + ny * hy + nz * hz, 0.0) ** 24.0
    for c in range(3):
        out[c] = out[c] * (0.2 + diffuse) + highlight
    out[3] = 1.0


@kernel
def ocean(at, dx, dy, eye, uniforms, memory, units, out):
    """Water after Pelzer 2004: four bump look-ups, then reflection and refraction at coordinates that depend on them
    and on the eye, then foam: seven trilinear look-ups, of which two are dependent.

    Attributes: place on the water (x, z; world), position (eye space), world height. Units: bump, sky, sea floor, foam.
    uniforms: time, eye height above the water, then world_from_eye rotation (9).
    """
    bump, floor, foam = memory.colors[0], memory.colors[1], memory.colors[2]
    sx, sz = 0.0, 0.0
    time = uniforms[0]
    footprint = math.sqrt(max(dx[0] * dx[0] + dx[1] * dx[1], dy[0] * dy[0] + dy[1] * dy[1]))
    for k in range(4):
        scale = 0.03 * 1.7**k
        u = at[0] * scale + time * 0.03 * (k + 1)
        v = at[1] * scale + time * 0.02 * (2 - k)
        trilinear(memory, units[0], u, v, dx[0] * scale, dx[1] * scale, dy[0] * scale, dy[1] * scale, bump)
        sx += (2.0 * bump[0] - 1.0) * 0.5
        sz += (2.0 * bump[1] - 1.0) * 0.5
    scale = 0.05
    trilinear(
        memory, units[3], at[0] * scale, at[1] * scale,
        dx[0] * scale, dx[1] * scale, dy[0] * scale, dy[1] * scale, foam,
    )  # fmt: skip
    nx, ny, nz = _unit(-0.35 * sx, 1.0, -0.35 * sz)
    # the incident ray in the world: y up
    ex, ey, ez = at[2] - eye[0], at[3] - eye[1], at[4]
    ix = uniforms[2] * ex + uniforms[3] * ey + uniforms[4] * ez
    iy = uniforms[5] * ex + uniforms[6] * ey + uniforms[7] * ez
    iz = uniforms[8] * ex + uniforms[9] * ey + uniforms[10] * ez
    ix, iy, iz = _unit(ix, iy, iz)
    cosine = -(ix * nx + iy * ny + iz * nz)
    rx, ry, rz = ix + 2.0 * cosine * nx, iy + 2.0 * cosine * ny, iz + 2.0 * cosine * nz
    up = max(ry, 0.08)
    # bumps that pass between neighbouring pixels turn the rays apart: what finite differences would have found
    rough = min(1.0, footprint * 4.0) * 0.06
    sky_u, sky_v = 0.15 * rx / up, 0.15 * rz / up
    spread = rough * 0.15 / up
    trilinear(memory, units[1], sky_u, sky_v, spread, 0.0, 0.0, spread, out)
    eta = 0.75
    inside = max(1.0 - eta * eta * (1.0 - cosine * cosine), 0.0)
    bend = eta * cosine - math.sqrt(inside)
    fx, fy, fz = eta * ix + bend * nx, eta * iy + bend * ny, eta * iz + bend * nz
    reach = 2.5 / max(-fy, 0.2)
    scale = 0.06
    spread = rough * reach * scale
    trilinear(
        memory, units[2], (at[0] + fx * reach) * scale, (at[1] + fz * reach) * scale,
        dx[0] * scale + spread, dx[1] * scale, dy[0] * scale, dy[1] * scale + spread, floor,
    )  # fmt: skip
    fresnel = 0.04 + 0.96 * (1.0 - min(max(cosine, 0.0), 1.0)) ** 5
    crest = min(max(at[5] * 1.2 - 0.25, 0.0), 1.0) * foam[0]
    for c in range(3):
        out[c] = (fresnel * out[c] + (1.0 - fresnel) * floor[c]) * (1.0 - crest) + crest
    out[3] = 1.0


@inlined
def built_in(kind, at, dx, dy, eye, uniforms, memory, units, out):
    """The shader of that number. Those that are built in share one kernel, so that it can be kept compiled."""
    if kind == LEVEL:
        level(at, dx, dy, eye, uniforms, memory, units, out)
    elif kind == SHADOWS:
        shadows(at, dx, dy, eye, uniforms, memory, units, out)
    elif kind == OCEAN:
        ocean(at, dx, dy, eye, uniforms, memory, units, out)
    elif kind == RELIEF:
        relief(at, dx, dy, eye, uniforms, memory, units, out)
    elif kind == SURFACE:
        surface(at, dx, dy, eye, uniforms, memory, units, out)
    else:  # PLAIN: the first uniforms
        for c in range(4):
            out[c] = uniforms[c]
