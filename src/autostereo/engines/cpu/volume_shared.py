"""Volumes for all views at once: every slab is classified and lit once, for the centre camera, then only slides.

Between views a slab moves by `offset · parallax` pixels (DESIGN section 1), so a view's slab is that of the centre
camera, shifted and linearly interpolated: contiguous loads, no tables, no gathers. Against blur the centre camera's
slabs are sampled `fine` times as densely as pixels. Position m of a slab lies at x = begin + m/fine; it is kept at
[m mod phases][m div phases], so that what lies `phases` positions apart, such as a view's pixels, is contiguous.

Slabs are as long here as the centre camera sees them. A view sees them a few percent longer or shorter, by about the
same factor all along a ray: its transmittance is the product to that power, its colour is scaled alike (even_out).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, lean
from .scalars import exp2_fast
from .simd import LANES, load, mask_word
from .volume_rays import (
    BACK,
    END,
    FRONT,
    LENGTH,
    ONE,
    OPTICAL,
    ORIGIN,
    RAYS,
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
SPAN = 32  # positions of a phase of which it is known whether something is seen


class Shared(NamedTuple):
    """Classified slabs of one chunk, one thread's memory.

    begin: x of position 0; fine, phases: see above; length: positions of a phase, in whole blocks; values
    (SLABS · phases · 4 · LINE,) float32: colour times opacity, and LESS; shown (SLABS, length / SPAN) uint8: in
    which spans something is seen; the others are zero; places (SLABS, 3) int64, parts (SLABS,) float32: of pixel 0 of a
    view, its position, where its left and right neighbours are kept, and how far it is from the left one to the right.
    """

    begin: float
    fine: int
    phases: int
    length: int
    values: np.ndarray
    shown: np.ndarray
    places: np.ndarray
    parts: np.ndarray


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


@inlined
def note_shown(base, shown, slab, group, rays):
    """Note in which spans of a group of positions a slab is seen: SHARE is its opacity."""
    for part in range(RAYS // SPAN):
        first, seen = base + SHARE + np.uint64(part * SPAN), np.int32(0)
        for i in range(np.uint64(0), np.uint64(SPAN), np.uint64(LANES)):
            seen |= mask_word(load(rays, first + i) > ZERO)
        if seen != 0:
            shown[slab, group * (RAYS // SPAN) + part] = np.uint8(1)


@lean
def classify_slabs(cut, camera, row, slices, first, last, table, material, light, planes, shared, rays, packed):
    """Fill shared.values with slabs first … last."""
    far = slices.first + slices.slabs * slices.distance
    n = np.uint64(RAYS)
    groups = shared.length // RAYS
    base = np.uint64(0)
    material = (np.float32(material[0]), np.float32(material[1]), np.float32(material[2]))
    for g in range(groups):
        for k in range(last - first):
            for part in range(g * (RAYS // SPAN), (g + 1) * (RAYS // SPAN)):
                shared.shown[k, part] = np.uint8(0)
        for phase in range(shared.phases):
            x = shared.begin + (g * RAYS * shared.phases + phase) / shared.fine
            start_positions(n, base, x, shared.phases / shared.fine, camera, row, far, rays)
            ray_stretch(n, base, cut, row, slices.first, rays)
            bounds, fresh = block_bounds(n, base, rays), False
            for k in range(first, last):
                depth = slices.first + k * slices.distance
                after = depth + slices.distance
                place = np.uint64(((k - first) * shared.phases + phase) * SLAB_ROWS * LINE + g * RAYS)
                if not (seen(bounds, depth, cut, planes.marks, k) or seen(bounds, after, cut, planes.marks, k + 1)):
                    fresh = False
                    for c in range(4):
                        clear = place + np.uint64(c * LINE)
                        for i in range(n):
                            shared.values[clear + i] = ZERO
                    continue
                if not fresh:
                    sample_volume(n, base, depth, cut, row, planes, FRONT, rays)
                sample_volume(n, base, after, cut, row, planes, BACK, rays)
                share_of_slab(n, base, depth, slices.distance, rays)
                trim_ends(n, base, cut, row, depth, slices.distance, rays)
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
                for i in range(n):
                    shared.values[place + RED + i] = rays[base + R + i]
                    shared.values[place + GREEN + i] = rays[base + G + i]
                    shared.values[place + BLUE + i] = rays[base + B + i]
                    shared.values[place + LESS + i] = -rays[base + SHARE + i]
                    rays[base + FRONT + i] = rays[base + BACK + i]
                note_shown(base, shared.shown, k - first, g, rays)
                fresh = True
