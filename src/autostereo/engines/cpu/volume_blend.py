"""Views from shared slabs: every view is a sum of slabs, each shifted by the view's disparity at the slab's depth.

Neighbouring views shift neighbouring slabs nearly alike. So a few slabs are blended once for a group of views, as its
middle view sees them, into one **bundle**, and the group's views are sums of bundles: with V views in G groups and b
slabs in a bundle, a slab is blended G + V/b times instead of V. None of a bundle is off by more than volume_plan.SLIP.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, lean
from .scalars import exp2_fast, log2_fast
from .simd import LANES, fused, load, mask_word, splat, store
from .volume_rays import HIDDEN, ONE, ZERO
from .volume_shared import ALPHA, BESIDE, BLUE, GREEN, LESS, LINE, NEAR, POSITION, RED, SLAB_ROWS, SPAN, shift_of

STEP = 3 * LANES  # pixels whose sums stay in registers while they go through all slabs


@inlined
def add_positions(near, beside, part, values, sums):
    """Add LANES positions of a slab, between two neighbours, to the sums (red, green, blue, transmittance)."""
    through = sums[3]
    right = through * part
    left = through - right
    red = fused(left, load(values, near + RED), fused(right, load(values, beside + RED), sums[0]))
    green = fused(left, load(values, near + GREEN), fused(right, load(values, beside + GREEN), sums[1]))
    blue = fused(left, load(values, near + BLUE), fused(right, load(values, beside + BLUE), sums[2]))
    return red, green, blue, fused(left, load(values, near + LESS), fused(right, load(values, beside + LESS), through))


@inlined
def load_sums(i, line):
    """Sums of LANES pixels."""
    return load(line, i + RED), load(line, i + GREEN), load(line, i + BLUE), load(line, i + ALPHA)


@inlined
def store_sums(i, sums, line):
    """Keep sums of LANES pixels."""
    store(line, i + RED, sums[0])
    store(line, i + GREEN, sums[1])
    store(line, i + BLUE, sums[2])
    store(line, i + ALPHA, sums[3])


@inlined
def place_slab(k, at, slabs):
    """Where what pixel 0 sees of slab k, position `at`, is kept."""
    phases = slabs.fine
    m = np.int64(np.floor(at))
    q, phase, slab = m // phases, m % phases, k * phases
    beside = (slab + phase + 1) * SLAB_ROWS * LINE if phase + 1 < phases else slab * SLAB_ROWS * LINE + 1
    slabs.places[k, POSITION] = q
    slabs.places[k, NEAR] = (slab + phase) * SLAB_ROWS * LINE + q
    slabs.places[k, BESIDE] = beside + q
    slabs.parts[k] = np.float32(at - m)


@inlined
def add_slabs(first, last, x, slabs, sums):
    """Add placed slabs first … last to the sums of STEP pixels from x on; returns the sums and whether any shows."""
    values, places, parts, shown = slabs.values, slabs.places, slabs.parts, slabs.shown
    one, span = np.uint64(LANES), np.uint64(SPAN)
    two, three = one + one, one + one + one
    a, b, c = sums
    some = False
    for k in range(np.uint64(first), np.uint64(last)):
        position = np.uint64(places[k, POSITION] + x)
        if shown[k, position // span] | shown[k, (position + three) // span] == 0:
            continue
        near, beside = np.uint64(places[k, NEAR] + x), np.uint64(places[k, BESIDE] + x)
        part = splat(parts[k])
        a = add_positions(near, beside, part, values, a)
        b = add_positions(near + one, beside + one, part, values, b)
        c = add_positions(near + two, beside + two, part, values, c)
        some = True
    return (a, b, c), some


@lean
def blend_view(width, count, slabs, t, line):
    """Add `count` placed slabs to the pixels of one view, whose sums are rows of `line` from place t on."""
    one = np.uint64(LANES)
    two = one + one
    for x in range(0, width, STEP):
        i = np.uint64(t + x)
        a, b, c = load_sums(i, line), load_sums(i + one, line), load_sums(i + two, line)
        if mask_word((a[3] >= HIDDEN) | (b[3] >= HIDDEN) | (c[3] >= HIDDEN)) == 0:
            continue
        (a, b, c), some = add_slabs(0, count, x, slabs, (a, b, c))
        if some:
            store_sums(i, a, line)
            store_sums(i + one, b, line)
            store_sums(i + two, c, line)


@inlined
def less_of(sums):
    """Sums with their transmittance as LESS."""
    return sums[0], sums[1], sums[2], sums[3] - splat(ONE)


@lean
def merge_slabs(first, last, bundle, begin, end, slabs, bundles):
    """Blend placed slabs first … last into positions begin … end of a phase of a bundle, which is a slab again."""
    one = np.uint64(LANES)
    two = one + one
    phase = bundle % slabs.fine
    bundle //= slabs.fine
    zero, whole = splat(ZERO), splat(ONE)
    clear = (zero, zero, zero, whole)
    for q in range(begin, end, STEP):
        sums, some = add_slabs(first, last, q, slabs, (clear, clear, clear))
        i = np.uint64((bundle * slabs.fine + phase) * SLAB_ROWS * LINE + q)
        store_sums(i, less_of(sums[0]), bundles.values)
        store_sums(i + one, less_of(sums[1]), bundles.values)
        store_sums(i + two, less_of(sums[2]), bundles.values)
        if some:
            bundles.shown[bundle, q // SPAN] = np.uint8(1)
            bundles.shown[bundle, (q + STEP - 1) // SPAN] = np.uint8(1)


@inlined
def middle_shift(camera, slices, begin, end):
    """Pixels by which slabs begin … end together move per unit of camera offset."""
    return 0.5 * (shift_of(camera, slices, begin) + shift_of(camera, slices, end - 1))


@inlined
def make_bundles(offsets, width, camera, slices, first, last, size, shared, bundles):
    """Blend slabs first … last, `size` at a time, as the middle camera of a group at `offsets` sees them."""
    low, high = offsets[0], offsets[len(offsets) - 1]
    for b in range(-(-(last - first) // size)):
        begin, end = first + b * size, min(first + (b + 1) * size, last)
        middle = middle_shift(camera, slices, begin, end)
        bundles.shown[b, :] = np.uint8(0)
        left = (min(-low * middle, -high * middle) - shared.begin) * shared.fine
        right = (max(-low * middle, -high * middle) + width - shared.begin) * shared.fine
        left, right = np.int64(np.floor(left)) // shared.fine, np.int64(np.ceil(right)) // shared.fine + 2
        for phase in range(shared.fine):
            for k in range(begin, end):
                slip = 0.5 * (low + high) * (middle - shift_of(camera, slices, k))
                place_slab(k - first, phase + slip * shared.fine, shared)
            merge_slabs(begin - first, end - first, b * shared.fine + phase, left, right, shared, bundles)


@lean
def blend_group(offsets, width, camera, slices, first, last, size, shared, bundles, t, line):
    """Add slabs first … last to a group of views, whose sums are rows of `line` from place t on.

    size: slabs in a bundle; if 1, the slabs themselves are added.
    """
    count, slabs = -(-(last - first) // size), shared
    if size > 1:
        make_bundles(offsets, width, camera, slices, first, last, size, shared, bundles)
        slabs = bundles
    for v in range(len(offsets)):
        for b in range(count):
            begin, end = first + b * size, min(first + (b + 1) * size, last)
            at = (-offsets[v] * middle_shift(camera, slices, begin, end) - slabs.begin) * slabs.fine
            place_slab(b, at, slabs)
        blend_view(width, count, slabs, t + v * SLAB_ROWS * LINE, line)


@inlined
def even_out(width, offset, middle, camera, row, t, line):
    """Turn sums over slabs of the centre camera's lengths into those of a view's own.

    The centre camera's rays are those through the same points at depth `middle`.
    """
    inverse, half = np.float32(1.0 / camera.fx), np.float32(camera.centre_x - 0.5)
    turn, slope = np.float32(offset / camera.focal), np.float32(row[0] * row[0] + 1.0)
    moved = np.float32(offset / middle)
    for i in range(np.uint64(width)):
        own = (np.float32(i) - half) * inverse - turn
        centre = own + moved
        through = line[t + ALPHA + i]
        ratio = np.sqrt((slope + own * own) / (slope + centre * centre))
        even = exp2_fast(ratio * log2_fast(max(through, np.float32(1e-30))))
        scale = (ONE - even) / max(ONE - through, np.float32(1e-6))
        line[t + RED + i] *= scale
        line[t + GREEN + i] *= scale
        line[t + BLUE + i] *= scale
        line[t + ALPHA + i] = even


@inlined
def clear_line(n, t, line):
    """Sums of a view's pixels before anything is seen."""
    for i in range(n):
        line[t + RED + i] = ZERO
        line[t + GREEN + i] = ZERO
        line[t + BLUE + i] = ZERO
        line[t + ALPHA + i] = ONE
