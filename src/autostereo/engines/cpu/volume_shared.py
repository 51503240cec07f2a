"""Volumes for all views at once: every slab is classified and lit once, for the centre camera, then only slides.

Between views a slab moves by `offset · parallax` pixels (DESIGN section 1), so a view's slab is that of the centre
camera, shifted and linearly interpolated: contiguous loads, no tables, no gathers. Against blur the centre camera's
slabs are sampled `fine` times as densely as pixels. Position m of a slab lies at x = begin + m/fine; it is kept at
[m mod fine][m div fine]: each such phase, of what lies a pixel apart, is contiguous.

Slabs are as long here as the centre camera sees them. A view sees them a few percent longer or shorter, by about the
same factor all along a ray: its transmittance is the product to that power, its colour is scaled alike (even_out).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, lean
from .scalars import exp2_fast
from .simd import (
    LANES,
    append,
    first_in_turn,
    iota,
    last_in_turn,
    load,
    mask_word,
    splat,
    store,
)
from .volume_rays import (
    BACK,
    BLOCK_ROWS,
    END,
    ENTER,
    FRONT,
    HALF_WAY,
    LEAVE,
    LENGTH,
    ONE,
    OPTICAL,
    ORIGIN,
    RAYS,
    ROW,
    SHARE,
    TURN,
    ZERO,
    B,
    G,
    R,
    T,
    blend,
    block_bounds,
    classify,
    light_slab,
    ray_stretch,
    sample_volume,
    seen,
    share_of_slab,
    trim_ends,
)

MAX_LENGTH = 16384  # positions of a phase
LINE = MAX_LENGTH + 80  # room for the positions of one phase, a constant so that rows are known not to overlap
RED, GREEN, BLUE, ALPHA = (np.uint64(k * LINE) for k in range(4))
LESS = ALPHA  # of slabs: opacity, negative, so that one fused operation takes it away
SLAB_ROWS = 4
POSITION, NEAR, BESIDE = 0, 1, 2
PAIRS = RAYS - LANES  # of positions that are handled together: one sampled, one between that and the next
BEND, THREE = np.float32(0.016), np.float32(3.0)  # 16 times how far a value may depart from what it is interpolated to
SPAN = 4 * LANES  # positions of a phase of which it is known whether something is seen


class Shared(NamedTuple):
    """Classified slabs of one chunk, one thread's memory.

    begin: x of position 0; fine: positions a pixel; paired: see classify_pairs, for no more than two a pixel; length:
    positions of a phase, in whole blocks; values (SLABS · fine · 4 · LINE,) float32: colour times opacity, and LESS;
    shown (SLABS, length / SPAN) uint8: in which spans something is seen; the others are zero; places (SLABS, 3) int64,
    parts (SLABS,) float32: of pixel 0 of a view, its position, where its left and right neighbours are kept, and how
    far it is from the left one to the right; front, back, picked (ROW,) int32: scratch for what lies between sampled
    positions.
    """

    begin: float
    fine: int
    paired: bool
    length: int
    values: np.ndarray
    shown: np.ndarray
    places: np.ndarray
    parts: np.ndarray
    front: np.ndarray
    back: np.ndarray
    picked: np.ndarray


@inlined
def shift_of(camera, slices, k):
    """Pixels by which slab k moves per unit of camera offset, as seen in its middle."""
    depth = slices.first + (k + 0.5) * slices.distance
    return camera.fx / camera.focal - camera.fx / depth


@inlined
def start_positions(n, base, first, step, camera, row, far, rays):
    """Rays of the centre camera through x = first + i·step."""
    inverse, half = np.float32(1.0 / camera.fx), np.float32(camera.centre_x - 0.5 - first)
    slope = np.float32(row[0] * row[0] + 1.0)
    by = np.float32(step)
    for i in range(n):
        rays[base + ORIGIN + i] = ZERO
        turn = (np.float32(i) * by - half) * inverse
        rays[base + TURN + i] = turn
        rays[base + LENGTH + i] = np.sqrt(slope + turn * turn)
        rays[base + END + i] = np.float32(far)


@lean
def classify_block(n, base, cut, row, depth, distance, fresh, look, planes, rays, packed):
    """Classify and light a slab on a block of rays, into R, G, B and SHARE; fresh: FRONT is known already."""
    table, material, light = look
    after = depth + distance
    if not fresh:
        sample_volume(n, base, depth, cut, row, planes, FRONT, rays)
    sample_volume(n, base, after, cut, row, planes, BACK, rays)
    share_of_slab(n, base, depth, distance, rays)
    trim_ends(n, base, cut, row, depth, distance, rays)
    classify(n, base, table, planes.place, rays, packed)
    for i in range(n):
        optical = rays[base + OPTICAL + i] * rays[base + SHARE + i] * rays[base + LENGTH + i]
        rays[base + SHARE + i] = ONE - exp2_fast(-optical)
        rays[base + T + i] = ONE
        rays[base + R + i] = ZERO
        rays[base + G + i] = ZERO
        rays[base + B + i] = ZERO
    if light_slab(n, base, 0.5 * (depth + after), cut, row, False, planes, rays):
        blend(n, base, material, light, rays, packed)


@inlined
def look_up_plain(n, scalar, plain, numbers, found, rays):
    """Whether the transfer function is plain from each ray's scalar to the next one's."""
    for i in range(np.uint64(RAYS)):
        numbers[i] = np.int32(rays[scalar + i] + HALF_WAY)
    for i in range(n):
        found[i] = np.int32(plain[np.uint64((numbers[i] << np.int32(8)) + numbers[i + np.uint64(1)])])


@inlined
def smooth_between(i, row, rays):
    """Middle of LANES neighbouring values and the next ones; where it may be far from what lies between.

    Four values in a row tell how far a cubic through them departs from a straight line, and whether they jump.
    """
    a, b = load(rays, row + i - np.uint64(1)), load(rays, row + i)
    c, d = load(rays, row + i + np.uint64(1)), load(rays, row + i + np.uint64(2))
    bend, jump = (b + c) - (a + d), (c - b) * splat(THREE) - (d - a)
    middle = (b + c) * splat(HALF_WAY)
    least, most = splat(-BEND), splat(BEND)
    return middle, (bend < least) | (bend > most) | (jump < least) | (jump > most)


@inlined
def extend(row, rays):
    """Give a row of values one more before the first."""
    rays[row - np.uint64(1)] = rays[row] + rays[row] - rays[row + np.uint64(1)]


@lean
def fill_between(n, front, back, picked, between, rays):
    """Interpolate n positions between rays of block 0 into a block `between`; pick those that must be sampled.

    front, back: where the transfer function is plain. Returns how many positions are picked.
    """
    extend(R, rays)
    extend(G, rays)
    extend(B, rays)
    extend(SHARE, rays)
    m = np.uint64(0)
    for i in range(np.uint64(0), n, np.uint64(LANES)):
        red, a = smooth_between(i, R, rays)
        green, b = smooth_between(i, G, rays)
        blue, c = smooth_between(i, B, rays)
        share, d = smooth_between(i, SHARE, rays)
        store(rays, between + R + i, red)
        store(rays, between + G + i, green)
        store(rays, between + B + i, blue)
        store(rays, between + SHARE + i, share)
        curved = (load(front, i) & load(back, i)) < splat(np.int32(1))
        m = append(picked, m, iota() + np.int32(i), a | b | c | d | curved)
    return m


@lean
def sample_picked(m, picked, cut, row, depth, distance, look, planes, between, spare, rays, packed):
    """Classify picked positions of block `between` by themselves, with block `spare` as scratch."""
    whole = (m + np.uint64(LANES - 1)) & ~np.uint64(LANES - 1)
    for j in range(m, whole):
        picked[j] = picked[m - np.uint64(1)]
    for j in range(whole):
        i = between + np.uint64(picked[j])
        rays[spare + ORIGIN + j] = ZERO
        rays[spare + TURN + j] = rays[TURN + i]
        rays[spare + LENGTH + j] = rays[LENGTH + i]
        rays[spare + ENTER + j] = rays[ENTER + i]
        rays[spare + LEAVE + j] = rays[LEAVE + i]
    classify_block(whole, spare, cut, row, depth, distance, False, look, planes, rays, packed)
    for j in range(m):
        i = between + np.uint64(picked[j])
        rays[R + i] = rays[spare + R + j]
        rays[G + i] = rays[spare + G + j]
        rays[B + i] = rays[spare + B + j]
        rays[SHARE + i] = rays[spare + SHARE + j]


@inlined
def keep_block(n, base, place, values, rays):
    """Keep a classified slab."""
    minus = splat(-ONE)
    for i in range(np.uint64(0), n, np.uint64(LANES)):
        store(values, place + RED + i, load(rays, base + R + i))
        store(values, place + GREEN + i, load(rays, base + G + i))
        store(values, place + BLUE + i, load(rays, base + B + i))
        store(values, place + LESS + i, load(rays, base + SHARE + i) * minus)


@inlined
def keep_row_of_both(n, row, between, sign, place, values, rays):
    """Keep a row of values and of those between them, in turn."""
    for i in range(np.uint64(0), n, np.uint64(LANES)):
        a, b = load(rays, row + i) * sign, load(rays, between + row + i) * sign
        to = place + i + i
        store(values, to, first_in_turn(a, b))
        store(values, to + np.uint64(LANES), last_in_turn(a, b))


@inlined
def clear_block(n, place, values):
    """A slab in which nothing is seen."""
    for c in range(4):
        clear = place + np.uint64(c * LINE)
        for i in range(n):
            values[clear + i] = ZERO


@inlined
def note_shown(shown, k, place, n, values):
    """Note in which spans of n positions from `place` on slab k is seen."""
    row = np.uint64(SLAB_ROWS * LINE)
    for i in range(np.uint64(0), n, np.uint64(LANES)):
        if mask_word(load(values, place + LESS + i) < ZERO) != 0:
            shown[k, (place + i) % row // np.uint64(SPAN)] = np.uint8(1)


@lean
def classify_pairs(cut, camera, row, slices, first, last, look, plain, planes, shared, rays, packed):
    """classify_slabs in pairs of positions: the first is sampled, the second interpolated where that is near enough."""
    n, more = np.uint64(PAIRS), np.uint64(RAYS)
    between, spare, base = np.uint64(BLOCK_ROWS * ROW), np.uint64(2 * BLOCK_ROWS * ROW), np.uint64(0)
    front, back, picked = shared.front, shared.back, shared.picked
    distance, one = slices.distance, splat(ONE)
    far, wide = slices.first + slices.slabs * distance, 2.0 / shared.fine
    groups = shared.length * shared.fine // (2 * PAIRS)
    for g in range(groups):
        x = shared.begin + g * PAIRS * wide
        start_positions(more, base, x, wide, camera, row, far, rays)
        start_positions(n, between, x + 0.5 * wide, wide, camera, row, far, rays)
        ray_stretch(more, base, cut, row, slices.first, rays)
        ray_stretch(n, between, cut, row, slices.first, rays)
        bounds, fresh = block_bounds(more, base, rays), False
        for k in range(first, last):
            depth = slices.first + k * distance
            slab = (k - first) * shared.fine
            place = np.uint64(slab * SLAB_ROWS * LINE + g * PAIRS * 2 // shared.fine)
            beside = place + np.uint64(SLAB_ROWS * LINE)
            if not seen(bounds, cut, slices, k, planes.marks):
                fresh = False
                if shared.fine == 1:
                    clear_block(n + n, place, shared.values)
                else:
                    clear_block(n, place, shared.values)
                    clear_block(n, beside, shared.values)
                continue
            classify_block(more, base, cut, row, depth, distance, fresh, look, planes, rays, packed)
            if fresh:
                front, back = back, front
            else:
                look_up_plain(n, FRONT, plain, packed, front, rays)
            look_up_plain(n, BACK, plain, packed, back, rays)
            m = fill_between(n, front, back, picked, between, rays)
            if m > np.uint64(0):
                sample_picked(m, picked, cut, row, depth, distance, look, planes, between, spare, rays, packed)
            if shared.fine == 1:
                keep_row_of_both(n, R, between, one, place + RED, shared.values, rays)
                keep_row_of_both(n, G, between, one, place + GREEN, shared.values, rays)
                keep_row_of_both(n, B, between, one, place + BLUE, shared.values, rays)
                keep_row_of_both(n, SHARE, between, splat(-ONE), place + LESS, shared.values, rays)
                note_shown(shared.shown, k - first, place, n + n, shared.values)
            else:
                keep_block(n, base, place, shared.values, rays)
                keep_block(n, between, beside, shared.values, rays)
                note_shown(shared.shown, k - first, place, n, shared.values)
                note_shown(shared.shown, k - first, beside, n, shared.values)
            for i in range(more):
                rays[FRONT + i] = rays[BACK + i]
            fresh = True


@lean
def classify_all(cut, camera, row, slices, first, last, look, planes, shared, rays, packed):
    """classify_slabs where every position is sampled."""
    far, distance = slices.first + slices.slabs * slices.distance, slices.distance
    n, base = np.uint64(RAYS), np.uint64(0)
    for g in range(-(-shared.length // RAYS)):
        for phase in range(shared.fine):
            x = shared.begin + g * RAYS + phase / shared.fine
            start_positions(n, base, x, 1.0, camera, row, far, rays)
            ray_stretch(n, base, cut, row, slices.first, rays)
            bounds, fresh = block_bounds(n, base, rays), False
            for k in range(first, last):
                depth = slices.first + k * distance
                place = np.uint64(((k - first) * shared.fine + phase) * SLAB_ROWS * LINE + g * RAYS)
                if not seen(bounds, cut, slices, k, planes.marks):
                    fresh = False
                    clear_block(n, place, shared.values)
                    continue
                classify_block(n, base, cut, row, depth, distance, fresh, look, planes, rays, packed)
                keep_block(n, base, place, shared.values, rays)
                note_shown(shared.shown, k - first, place, n, shared.values)
                for i in range(n):
                    rays[base + FRONT + i] = rays[base + BACK + i]
                fresh = True


@inlined
def classify_slabs(cut, camera, row, slices, first, last, ways, planes, shared, rays, packed):
    """Fill shared.values with slabs first … last."""
    m = ways.material
    look = (ways.table, (np.float32(m[0]), np.float32(m[1]), np.float32(m[2])), ways.light)
    shared.shown[:, :] = np.uint8(0)
    if shared.paired:
        args = (cut, camera, row, slices, first, last, look, ways.plain, planes, shared, rays, packed)
        classify_pairs(*args)
    else:
        classify_all(cut, camera, row, slices, first, last, look, planes, shared, rays, packed)
