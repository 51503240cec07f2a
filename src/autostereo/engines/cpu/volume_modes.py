"""The greatest value along rays, and isosurfaces: what volumes show besides emission and absorption."""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .volume_rays import (
    BACK,
    ENTER,
    FRONT,
    FRONT_LIGHT,
    HALF,
    LEAVE,
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
    sample_volume,
    seen,
    share_of_slab,
)

LEVELS = 4096  # of the colours of mip
REFINEMENTS = 24
NONE = np.float32(-1.0)


@inlined
def scalar_at(cut, x, y, z):
    """Scalar at index coordinates, as a row of the table."""
    nx, ny, nz = cut.shape[0], cut.shape[1], cut.shape[2]
    x, y, z = min(max(x, 0.0), nx - 1.0), min(max(y, 0.0), ny - 1.0), min(max(z, 0.0), nz - 1.0)
    i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
    u, v, w = x - i, y - j, z - k
    s, p = cut.scalars, (k * ny + j) * nx + i
    q = p + nx * ny
    a = s[p] + u * (np.float64(s[p + 1]) - s[p])
    b = s[p + nx] + u * (np.float64(s[p + nx + 1]) - s[p + nx])
    c = s[q] + u * (np.float64(s[q + 1]) - s[q])
    d = s[q + nx] + u * (np.float64(s[q + nx + 1]) - s[q + nx])
    a, c = a + v * (b - a), c + v * (d - c)
    return (a + w * (c - a) - cut.low) * cut.scale


@inlined
def index_at(cut, row, x, depth):
    """Index coordinates of the point at X and depth of a row's plane."""
    m, y = cut.from_eye, row[1] + depth * row[0]
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * depth + m[0, 3],
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * depth + m[1, 3],
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * depth + m[2, 3],
    )


@inlined
def scalar_on_ray(cut, row, ray, depth, rays):
    """Scalar at a depth of one ray, as a row of the table."""
    d = np.float64(depth)
    x, y, z = index_at(cut, row, rays[ray + ORIGIN] + d * rays[ray + TURN], d)
    return np.float32(scalar_at(cut, x, y, z))


@inlined
def slab_ends(ray, depth, distance, rays):
    """Depths between which a ray is in a volume within the slab from `depth` on."""
    return max(np.float32(depth), rays[ray + ENTER]), min(np.float32(depth + distance), rays[ray + LEAVE])


@inlined
def sample_ends(n, base, k, fresh, cut, row, slices, planes, rays):
    """Scalars at both ends of slab k into FRONT and BACK; a ray that enters or leaves within it has its ends there."""
    depth = slices.first + k * slices.distance
    if fresh:
        for i in range(n):
            rays[base + FRONT + i] = rays[base + BACK + i]
    else:
        sample_volume(n, base, depth, cut, row, False, planes, FRONT, FRONT_LIGHT, rays)
    sample_volume(n, base, depth + slices.distance, cut, row, False, planes, BACK, FRONT_LIGHT, rays)
    share_of_slab(n, base, depth, slices.distance, rays)
    near, far = np.float32(depth), np.float32(depth + slices.distance)
    for i in range(n):
        if rays[base + SHARE + i] > ZERO:
            enter, leave = rays[base + ENTER + i], rays[base + LEAVE + i]
            if enter > near:
                rays[base + FRONT + i] = scalar_on_ray(cut, row, base + i, enter, rays)
            if leave < far:
                rays[base + BACK + i] = scalar_on_ray(cut, row, base + i, leave, rays)


@kernel
def march_mip(n, base, cut, row, slices, first, last, planes, rays):
    """Keep the greatest scalar (as a row of the table) of slabs first … last in R, −1 so far, and its depth in HALF."""
    bounds, fresh = block_bounds(n, base, rays), False
    for k in range(first, last):
        depth = slices.first + k * slices.distance
        if not (
            seen(bounds, depth, cut, planes.marks, k) or seen(bounds, depth + slices.distance, cut, planes.marks, k + 1)
        ):
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


@kernel
def march_iso(n, base, cut, row, slices, first, last, level, planes, rays):
    """Find in which slab of first … last a ray first crosses `level`, a row of the table; HALF becomes its depth."""
    bounds, fresh, iso = block_bounds(n, base, rays), False, np.float32(level)
    for k in range(first, last):
        depth = slices.first + k * slices.distance
        if not (
            seen(bounds, depth, cut, planes.marks, k) or seen(bounds, depth + slices.distance, cut, planes.marks, k + 1)
        ):
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
def slope_at(cut, x, y, z, axis):
    """Central difference of the interpolated field along an index axis, one-sided at the borders."""
    last = cut.shape[axis] - 1.0
    at = (x, y, z)[axis]
    low, high = max(at - 1.0, 0.0), min(at + 1.0, last)
    if axis == 0:
        return (scalar_at(cut, high, y, z) - scalar_at(cut, low, y, z)) / (high - low)
    if axis == 1:
        return (scalar_at(cut, x, high, z) - scalar_at(cut, x, low, z)) / (high - low)
    return (scalar_at(cut, x, y, high) - scalar_at(cut, x, y, low)) / (high - low)


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


@kernel
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
