"""Volumes along rays of their own: one view, or sub-pixels one by one (`volume="exact"`, n-pass, every isosurface).

Rays are handled in blocks of RAYS, whose state lies in rows a fixed distance apart, so that every loop is SIMD (see
scalars). A slab is the stretch of a ray between two slices; its scalars at both ends are looked up in the table of
pre-integrated slabs (Engel, Kraus and Ertl 2001).
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, lean
from .scalars import exp2_fast, log2_fast, whole_steps
from .simd import LANES, append, iota, load
from .volume_sample import (
    AT,
    EYE,
    LAST_ROW,
    LIGHT,
    LIST,
    TINY,
    VALUE,
    any_marked,
    light_points,
    on_slice,
    part_of,
    scalar_points,
)

RAYS = 128  # of a block
ROW = 144  # distance of a block's rows
(
    ORIGIN, TURN, ENTER, LEAVE, LENGTH, T, R, G, B, HALF, FRONT, BACK, OPTICAL, SHARE,
    END, LIT, TOTAL, DONE, KEPT, BEFORE, BEGIN, FINISH,
) = (np.uint64(k * ROW) for k in (*range(16), *range(21, 27)))  # fmt: skip
BLOCK_ROWS = 27
ZERO, ONE, HALF_WAY = np.float32(0.0), np.float32(1.0), np.float32(0.5)
TEN_BITS, COLOR_STEP = np.int32(1023), np.float32(1.0 / 1023.0)
OPAQUE = 128  # transmittance in 65536ths, below which a ray has seen enough
HIDDEN = np.float32(OPAQUE / 65536.0)


@inlined
def ray_stretch(n, base, cut, row, near, rays):
    """Depths where rays of a block enter and leave what is seen of a volume before END.

    ORIGIN is the X of a ray's eye, TURN its X per depth.
    """
    for i in range(n):
        rays[base + ENTER + i] = np.float32(near)
        rays[base + LEAVE + i] = rays[base + END + i]
    m, slope, lens = cut.from_eye, row[0], row[1]
    for h in range(cut.halves.shape[0]):
        a, b, c, d = cut.halves[h, 0], cut.halves[h, 1], cut.halves[h, 2], cut.halves[h, 3]
        gx = np.float32(a * m[0, 0] + b * m[1, 0] + c * m[2, 0])
        gy = a * m[0, 1] + b * m[1, 1] + c * m[2, 1]
        gz = a * m[0, 2] + b * m[1, 2] + c * m[2, 2]
        at_eye = np.float32(a * m[0, 3] + b * m[1, 3] + c * m[2, 3] + d + gy * lens)
        deeper = np.float32(gz + gy * slope)
        for i in range(n):
            start = at_eye + gx * rays[base + ORIGIN + i]
            step = deeper + gx * rays[base + TURN + i]
            crossing = -start / (step if step != ZERO else ONE)
            enter, leave = rays[base + ENTER + i], rays[base + LEAVE + i]
            enter = max(enter, crossing) if step > ZERO else enter
            leave = min(leave, crossing) if step < ZERO else leave
            rays[base + ENTER + i] = enter
            rays[base + LEAVE + i] = leave if (step != ZERO) | (start >= ZERO) else np.float32(-1.0)


@inlined
def lower_half(pair):
    """The first of two float32 that `simd.adjacent` brought."""
    return np.int32(pair & np.int64(0xFFFFFFFF)).view(np.float32)


@inlined
def mix_pair(pair, part):
    """Between two float32 that `simd.adjacent` brought."""
    left = lower_half(pair)
    return left + part * (np.int32(pair >> np.int64(32)).view(np.float32) - left)


@inlined
def sample_volume(n, base, depth, cut, row, planes, scalar, rays):
    """Scalars of the volume itself where rays cross a depth, into row `scalar`."""
    lists, d = planes.lists, np.float32(depth)
    for i in range(n):
        lists[AT + i] = rays[base + ORIGIN + i] + d * rays[base + TURN + i]
    scalar_points(n, cut, on_slice(cut, row, depth), planes.place, planes.words, lists)
    for i in range(n):
        rays[base + scalar + i] = lists[VALUE + i]


@inlined
def light_slab(n, base, middle, cut, row, own_eyes, planes, rays):
    """Light at the middle of a slab into LIT, on rays that see it: SHARE is its opacity. Returns whether any does."""
    lists, chosen, d, own = planes.lists, planes.chosen, np.float32(middle), ONE if own_eyes else ZERO
    m = np.uint64(0)
    for i in range(np.uint64(0), n, np.uint64(LANES)):
        m = append(chosen, m, iota() + np.int32(i), load(rays, base + SHARE + i) > ZERO)
    if m == np.uint64(0) or cut.channels == 0:
        return m > np.uint64(0)
    whole = whole_steps(m)
    for j in range(m, whole):
        chosen[j] = chosen[m - np.uint64(1)]
    for j in range(whole):
        i = base + np.uint64(chosen[j])
        lists[AT + j] = rays[ORIGIN + i] + d * rays[TURN + i]
        lists[EYE + j] = own * rays[ORIGIN + i]
    y = row[1] + middle * row[0]
    light_points(whole, cut, y, middle, on_slice(cut, row, middle), planes.place, planes.words, lists)
    for f in range(cut.channels):
        to, of = base + LIT + np.uint64(f * ROW), LIGHT + np.uint64(f * LIST)
        for j in range(m):
            rays[to + np.uint64(chosen[j])] = lists[of + j]
    return True


@inlined
def share_of_slab(n, base, depth, distance, rays):
    """How much of the slab from `depth` on lies on each ray between ENTER and LEAVE, in lengths of a slab."""
    near, far, inverse = np.float32(depth), np.float32(depth + distance), np.float32(1.0 / distance)
    for i in range(n):
        part = min(far, rays[base + LEAVE + i]) - max(near, rays[base + ENTER + i])
        rays[base + SHARE + i] = max(part, ZERO) * inverse


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
    return min(max(np.float32(scalar_at(cut, x, y, z)), ZERO), LAST_ROW)


@inlined
def slab_ends(ray, depth, distance, rays):
    """Depths between which a ray is in a volume within the slab from `depth` on."""
    return max(np.float32(depth), rays[ray + ENTER]), min(np.float32(depth + distance), rays[ray + LEAVE])


@inlined
def trim_ends(n, base, cut, row, depth, distance, rays):
    """Scalars where rays enter or leave within a slab, instead of those of its slices."""
    near, far, some = np.float32(depth), np.float32(depth + distance), np.int32(0)
    for i in range(n):
        ends = (rays[base + ENTER + i] > near) | (rays[base + LEAVE + i] < far)
        some |= np.int32(ends & (rays[base + SHARE + i] > ZERO))
    if some == 0:
        return
    for i in range(n):
        if rays[base + SHARE + i] > ZERO:
            enter, leave = rays[base + ENTER + i], rays[base + LEAVE + i]
            if enter > near:
                rays[base + FRONT + i] = scalar_on_ray(cut, row, base + i, enter, rays)
            if leave < far:
                rays[base + BACK + i] = scalar_on_ray(cut, row, base + i, leave, rays)


@inlined
def classify(n, base, table, entries, rays, packed):
    """Optical depth of a slab of nominal length, and its packed colour, from the scalars at its two ends."""
    for i in range(n):
        front, back = np.int32(rays[base + FRONT + i] + HALF_WAY), np.int32(rays[base + BACK + i] + HALF_WAY)
        packed[i] = np.int32(np.int32(front << np.int32(8)) + back)
    for i in range(n):
        entries[i] = table[np.uint64(packed[i])]
    for i in range(n):
        rays[base + OPTICAL + i] = lower_half(entries[i])
        packed[i] = np.int32(entries[i] >> np.int64(32))


@inlined
def reflect(light, material, colors, specular, base, i, c, rays):
    """What light makes of colour channel c: (factor, added highlight)."""
    ambient, diffuse, shine = material
    row = np.uint64(ROW)
    d = np.uint64(c if colors == 3 else 0) * row
    s = np.uint64(colors + (c if colors == 3 else 0)) * row
    factor = ambient + diffuse * rays[base + LIT + d + i]
    added = ZERO
    if specular:
        added = shine * rays[base + LIT + s + i]
    return factor, added


@inlined
def blend(n, base, material, light, rays, packed):
    """Add a slab to the rays: SHARE is its opacity; light = (channels, colours)."""
    ambient, diffuse, _ = material
    channels, colors = light
    if channels <= 1:
        a, d = (ambient, diffuse) if channels == 1 else (ONE, ZERO)
        for i in range(n):
            w = rays[base + T + i] * rays[base + SHARE + i]
            factor = w * COLOR_STEP * (a + d * rays[base + LIT + i])
            c = packed[i]
            rays[base + R + i] += factor * part_of(c, np.int32(0), TEN_BITS)
            rays[base + G + i] += factor * part_of(c, np.int32(10), TEN_BITS)
            rays[base + B + i] += factor * part_of(c, np.int32(20), TEN_BITS)
            rays[base + T + i] -= w
        return
    specular = channels > colors
    for i in range(n):
        w = rays[base + T + i] * rays[base + SHARE + i]
        c = packed[i]
        factor, added = reflect(light, material, colors, specular, base, i, 0, rays)
        rays[base + R + i] += w * (factor * part_of(c, np.int32(0), TEN_BITS) * COLOR_STEP + added)
        factor, added = reflect(light, material, colors, specular, base, i, 1, rays)
        rays[base + G + i] += w * (factor * part_of(c, np.int32(10), TEN_BITS) * COLOR_STEP + added)
        factor, added = reflect(light, material, colors, specular, base, i, 2, rays)
        rays[base + B + i] += w * (factor * part_of(c, np.int32(20), TEN_BITS) * COLOR_STEP + added)
        rays[base + T + i] -= w


@inlined
def find_half(n, base, rays):
    """Note where opacity reaches ½, optical depth growing evenly from BEGIN to FINISH; T was BEFORE."""
    for i in range(n):
        before, after = rays[base + BEFORE + i], rays[base + T + i]
        enter, leave = rays[base + BEGIN + i], rays[base + FINISH + i]
        left = log2_fast(max(before, TINY))
        part = (left + ONE) / max(left - log2_fast(max(after, TINY)), np.float32(1e-9))
        if (before > HALF_WAY) & (after <= HALF_WAY):
            rays[base + HALF + i] = enter + part * (leave - enter)


@inlined
def block_bounds(n, base, rays):
    """Least and greatest ORIGIN and TURN of a block's rays."""
    low, high = rays[base + ORIGIN], rays[base + ORIGIN]
    least, most = rays[base + TURN], rays[base + TURN]
    for i in range(n):
        low, high = min(low, rays[base + ORIGIN + i]), max(high, rays[base + ORIGIN + i])
        least, most = min(least, rays[base + TURN + i]), max(most, rays[base + TURN + i])
    return np.float64(low), np.float64(high), np.float64(least), np.float64(most)


@inlined
def slice_seen(bounds, depth, cut, marks, k):
    """Whether rays within block_bounds pass near marked samples of slice k."""
    low, high, least, most = bounds
    inverse, count = 1.0 / cut.step, np.float64(1 << 24)
    first = min(max((low + depth * least - cut.first) * inverse, -1.0), count)
    last = min(max((high + depth * most - cut.first) * inverse, -1.0), count)
    return any_marked(marks, k, np.int64(first), np.int64(last) + 1)


@inlined
def seen(bounds, cut, slices, k, marks):
    """Whether rays within block_bounds may meet something in slab k."""
    depth = slices.first + k * slices.distance
    return slice_seen(bounds, depth, cut, marks, k) or slice_seen(bounds, depth + slices.distance, cut, marks, k + 1)


@lean
def add_optical(n, base, cut, row, slices, k, way, planes, rays, packed):
    """Add the optical depth of slab k of one of several volumes to TOTAL; BEGIN … FINISH is what they fill of it."""
    depth = slices.first + k * slices.distance
    sample_volume(n, base, depth, cut, row, planes, FRONT, rays)
    sample_volume(n, base, depth + slices.distance, cut, row, planes, BACK, rays)
    share_of_slab(n, base, depth, slices.distance, rays)
    trim_ends(n, base, cut, row, depth, slices.distance, rays)
    classify(n, base, way.table, planes.place, rays, packed)
    near, far = np.float32(depth), np.float32(depth + slices.distance)
    for i in range(n):
        own = rays[base + OPTICAL + i] * rays[base + SHARE + i] * rays[base + LENGTH + i]
        enter, leave = max(near, rays[base + ENTER + i]), min(far, rays[base + LEAVE + i])
        rays[base + TOTAL + i] += own
        rays[base + BEGIN + i] = min(rays[base + BEGIN + i], enter if own > ZERO else rays[base + BEGIN + i])
        rays[base + FINISH + i] = max(rays[base + FINISH + i], leave if own > ZERO else rays[base + FINISH + i])


@inlined
def part_of_total(n, base, rays):
    """Opacity (SHARE) that makes a volume's part of a slab that it shares with others; SHARE holds its optical depth.

    All volumes together have opacity 1 − 2^−TOTAL, each its part by optical depth; the sum of the parts so far is DONE.
    """
    for i in range(n):
        total = rays[base + TOTAL + i]
        part = (ONE - exp2_fast(-total)) * rays[base + SHARE + i] / max(total, TINY)
        rays[base + SHARE + i] = min(part / max(ONE - rays[base + DONE + i], TINY), ONE)
        rays[base + DONE + i] += part


@lean
def march(n, base, cut, row, slices, first, last, way, wants_half, among, planes, rays, packed):
    """Take a block of rays through slabs first … last; way: see volume_views.Ways.

    among: other volumes share the slab, TOTAL is their optical depth together, and half of it is found elsewhere.
    """
    fresh = False
    material = (np.float32(way.material[0]), np.float32(way.material[1]), np.float32(way.material[2]))
    bounds = block_bounds(n, base, rays)
    for k in range(first, last):
        through = np.int32(0)
        for i in range(n):  # in whole numbers, for a maximum of floats is not SIMD
            through = max(through, np.int32(rays[base + T + i] * np.float32(65536.0)))
        if through < OPAQUE:
            return
        depth = slices.first + k * slices.distance
        after = depth + slices.distance
        if not seen(bounds, cut, slices, k, planes.marks):
            fresh = False
            continue
        if not fresh:
            sample_volume(n, base, depth, cut, row, planes, FRONT, rays)
        sample_volume(n, base, after, cut, row, planes, BACK, rays)
        share_of_slab(n, base, depth, slices.distance, rays)
        trim_ends(n, base, cut, row, depth, slices.distance, rays)
        classify(n, base, way.table, planes.place, rays, packed)
        for i in range(n):
            rays[base + SHARE + i] *= rays[base + OPTICAL + i] * rays[base + LENGTH + i]
        if among:
            part_of_total(n, base, rays)
        else:
            for i in range(n):
                rays[base + SHARE + i] = ONE - exp2_fast(-rays[base + SHARE + i])
        if light_slab(n, base, 0.5 * (depth + after), cut, row, way.own_eyes, planes, rays):
            if wants_half and not among:
                near, far = np.float32(depth), np.float32(after)
                for i in range(n):
                    rays[base + BEFORE + i] = rays[base + T + i]
                    rays[base + BEGIN + i] = max(near, rays[base + ENTER + i])
                    rays[base + FINISH + i] = min(far, rays[base + LEAVE + i])
            blend(n, base, material, way.light, rays, packed)
            if wants_half and not among:
                find_half(n, base, rays)
        for i in range(n):
            rays[base + FRONT + i] = rays[base + BACK + i]
        fresh = True
