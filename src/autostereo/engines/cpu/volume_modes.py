"""The greatest value along rays, and isosurfaces: what volumes show besides emission and absorption."""

from __future__ import annotations

import numpy as np

from .jit import inlined, lean
from .volume_rays import (
    BACK,
    FRONT,
    HALF,
    ONE,
    ORIGIN,
    SHARE,
    TURN,
    ZERO,
    B,
    G,
    R,
    T,
    block_bounds,
    index_at,
    sample_volume,
    scalar_at,
    seen,
    share_of_slab,
    slab_ends,
    trim_ends,
)

LEVELS = 4096  # of the colours of mip
REFINEMENTS = 24
NONE = np.float32(-1.0)


@inlined
def sample_ends(n, base, k, fresh, cut, row, slices, planes, rays):
    """Scalars at both ends of slab k into FRONT and BACK; a ray that enters or leaves within it has its ends there."""
    depth = slices.first + k * slices.distance
    if fresh:
        for i in range(n):
            rays[base + FRONT + i] = rays[base + BACK + i]
    else:
        sample_volume(n, base, depth, cut, row, planes, FRONT, rays)
    sample_volume(n, base, depth + slices.distance, cut, row, planes, BACK, rays)
    share_of_slab(n, base, depth, slices.distance, rays)
    trim_ends(n, base, cut, row, depth, slices.distance, rays)


@lean
def march_mip(n, base, cut, row, slices, first, last, planes, rays):
    """Keep the greatest scalar (as a row of the table) of slabs first … last in R, −1 so far, and its depth in HALF."""
    bounds, fresh = block_bounds(n, base, rays), False
    for k in range(first, last):
        depth = slices.first + k * slices.distance
        if not seen(bounds, cut, slices, k, planes.marks):
            fresh = False
            continue
        sample_ends(n, base, k, fresh, cut, row, slices, planes, rays)
        for i in range(n):
            front, back = rays[base + FRONT + i], rays[base + BACK + i]
            near, far = slab_ends(base + i, depth, slices.distance, rays)
            most, inside = rays[base + R + i], rays[base + SHARE + i] > ZERO
            rays[base + HALF + i] = near if inside & (front > most) else rays[base + HALF + i]
            most = max(most, front) if inside else most
            rays[base + HALF + i] = far if inside & (back > most) else rays[base + HALF + i]
            rays[base + R + i] = max(most, back) if inside else most
        fresh = True


@inlined
def resolve_mip(n, base, colors, rays):
    """Colours of the greatest scalars: colors (LEVELS, 4) float32, opacity last."""
    scale = np.float32((LEVELS - 1) / 255.0)
    for i in range(n):
        most = rays[base + R + i]
        if most < ZERO:
            rays[base + R + i] = ZERO
            continue
        k = min(max(int(most * scale + np.float32(0.5)), 0), LEVELS - 1)
        a = colors[k, 3]
        rays[base + R + i], rays[base + G + i], rays[base + B + i] = (
            a * colors[k, 0],
            a * colors[k, 1],
            a * colors[k, 2],
        )
        rays[base + T + i] = ONE - a
        if a < np.float32(0.5):
            rays[base + HALF + i] = np.float32(np.inf)


@lean
def march_iso(n, base, cut, row, slices, first, last, level, planes, rays):
    """Find in which slab of first … last a ray first crosses `level`, a row of the table; HALF becomes its depth."""
    bounds, fresh, iso = block_bounds(n, base, rays), False, np.float32(level)
    for k in range(first, last):
        depth = slices.first + k * slices.distance
        if not seen(bounds, cut, slices, k, planes.marks):
            fresh = False
            continue
        sample_ends(n, base, k, fresh, cut, row, slices, planes, rays)
        for i in range(n):
            front, back = rays[base + FRONT + i] - iso, rays[base + BACK + i] - iso
            near, far = slab_ends(base + i, depth, slices.distance, rays)
            at = near + front / (front - back if front != back else ONE) * (far - near)
            crosses = ((front >= ZERO) != (back >= ZERO)) & (rays[base + SHARE + i] > ZERO)
            crosses = crosses & (rays[base + HALF + i] > at)
            rays[base + HALF + i] = at if crosses else rays[base + HALF + i]
        fresh = True


@inlined
def scalar_along(cut, x, y, z, axis, i):
    """Scalar at x, y, z, but for one coordinate."""
    return scalar_at(cut, i if axis == 0 else x, i if axis == 1 else y, i if axis == 2 else z)


@inlined
def slope_along(cut, x, y, z, axis):
    """Voxels' central differences along an axis, one-sided at the borders, interpolated."""
    last = cut.shape[axis] - 1
    at = min(max((x, y, z)[axis], 0.0), np.float64(last))
    i = min(np.int64(at), last - 1)
    a, b, c, d = max(i - 1, 0), i, i + 1, min(i + 2, last)
    first = (scalar_along(cut, x, y, z, axis, c) - scalar_along(cut, x, y, z, axis, a)) / (c - a)
    second = (scalar_along(cut, x, y, z, axis, d) - scalar_along(cut, x, y, z, axis, b)) / (d - b)
    return first + (at - i) * (second - first)


@inlined
def slope_at(cut, x, y, z, axis):
    """Interpolated gradient of the voxels (volume_setup.gradient_at) along an index axis.

    Smoothing by (¼, ½, ¼) and trilinear interpolation may change places.
    """
    if not cut.sobel:
        return slope_along(cut, x, y, z, axis)
    u, v, w = min(max(x, 0.0), cut.shape[0] - 1.0), min(max(y, 0.0), cut.shape[1] - 1.0), z
    w = min(max(w, 0.0), cut.shape[2] - 1.0)
    total = 0.0
    for c in range(-1, 2):
        for b in range(-1, 2):
            weight = (2 - abs(b)) * (2 - abs(c)) / 16.0
            p = u if axis == 0 else u + b
            q = v if axis == 1 else (v + b if axis == 0 else v + c)
            r = w if axis == 2 else w + c
            total += weight * slope_along(cut, p, q, r, axis)
    return total


@inlined
def refine_hit(cut, row, origin, turn, depth, near, far, level):
    """Depth between near and far, about `depth`, where a ray crosses the level, by regula falsi (Illinois)."""
    a, b = near, far
    p, q, r = index_at(cut, row, origin + a * turn, a)
    fa = scalar_at(cut, p, q, r) - level
    p, q, r = index_at(cut, row, origin + b * turn, b)
    fb = scalar_at(cut, p, q, r) - level
    if fa * fb > 0.0:
        return depth
    d, side = depth, 0
    for _ in range(REFINEMENTS):
        d = b - fb * (b - a) / (fb - fa) if fb != fa else 0.5 * (a + b)
        p, q, r = index_at(cut, row, origin + d * turn, d)
        f = scalar_at(cut, p, q, r) - level
        if abs(f) < 1e-4:
            break
        if f * fb > 0.0:
            b, fb = d, f
            fa = 0.5 * fa if side == 1 else fa
            side = 1
        else:
            a, fa = d, f
            fb = 0.5 * fb if side == 2 else fb
            side = 2
    return d


@lean
def resolve_iso(n, base, cut, row, slices, level, color, material, shade, own_eyes, rays):
    """Refine the hits of rays, and shade them: Blinn–Phong, the normal turned to the viewer."""
    m = cut.from_eye
    ambient, diffuse, specular = material
    for i in range(n):
        ray = base + np.uint64(i)
        if not rays[ray + HALF] < np.float32(1e30):
            continue
        origin, turn = np.float64(rays[ray + ORIGIN]), np.float64(rays[ray + TURN])
        depth = np.float64(rays[ray + HALF])
        k = np.floor((depth - slices.first) / slices.distance)
        near, far = slab_ends(ray, slices.first + k * slices.distance, slices.distance, rays)
        depth = refine_hit(cut, row, origin, turn, depth, np.float64(near), np.float64(far), level)
        x, y = origin + depth * turn, row[1] + depth * row[0]
        red, green, blue = color[0], color[1], color[2]
        if shade:
            u, v, w = index_at(cut, row, x, depth)
            gu, gv, gw = slope_at(cut, u, v, w, 0), slope_at(cut, u, v, w, 1), slope_at(cut, u, v, w, 2)
            nx = m[0, 0] * gu + m[1, 0] * gv + m[2, 0] * gw
            ny = m[0, 1] * gu + m[1, 1] * gv + m[2, 1] * gw
            nz = m[0, 2] * gu + m[1, 2] * gv + m[2, 2] * gw
            vx, vy, vz = (origin if own_eyes else 0.0) - x, row[1] - y, -depth
            length = np.sqrt(nx * nx + ny * ny + nz * nz)
            if length > 0.0:
                facing = turn * nx + row[0] * ny + nz
                sign = (-1.0 if facing > 0.0 else 1.0) / length
                nx, ny, nz = nx * sign, ny * sign, nz * sign
                inverse = 1.0 / np.sqrt(vx * vx + vy * vy + vz * vz)
                vx, vy, vz = vx * inverse, vy * inverse, vz * inverse
                light = (ambient, ambient, ambient)
                shine = (0.0, 0.0, 0.0)
                for k in range(cut.lights.shape[0]):
                    p = cut.lights[k, 0]
                    lx, ly, lz = cut.lights[k, 1] - p * x, cut.lights[k, 2] - p * y, cut.lights[k, 3] - p * depth
                    inverse = 1.0 / max(np.sqrt(lx * lx + ly * ly + lz * lz), 1e-20)
                    lx, ly, lz = lx * inverse, ly * inverse, lz * inverse
                    nl = nx * lx + ny * ly + nz * lz
                    if nl <= 0.0:
                        continue
                    hx, hy, hz = lx + vx, ly + vy, lz + vz
                    inverse = 1.0 / max(np.sqrt(hx * hx + hy * hy + hz * hz), 1e-20)
                    nh = max((nx * hx + ny * hy + nz * hz) * inverse, 0.0)
                    s = specular * nh**cut.shininess if specular > 0.0 else 0.0
                    a, b, c = np.float64(cut.lights[k, 4]), np.float64(cut.lights[k, 5]), np.float64(cut.lights[k, 6])
                    d = diffuse * nl
                    light = (light[0] + d * a, light[1] + d * b, light[2] + d * c)
                    shine = (shine[0] + s * a, shine[1] + s * b, shine[2] + s * c)
                red = red * light[0] + shine[0]
                green = green * light[1] + shine[1]
                blue = blue * light[2] + shine[2]
        rays[ray + R] = np.float32(min(max(red, 0.0), 1.0))
        rays[ray + G] = np.float32(min(max(green, 0.0), 1.0))
        rays[ray + B] = np.float32(min(max(blue, 0.0), 1.0))
        rays[ray + T] = ZERO
        rays[ray + HALF] = np.float32(depth)
