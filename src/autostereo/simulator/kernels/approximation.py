"""Approximate pixel shader evaluation (Hasselgren 2006, section 4.3): which shaded fragments make another one.

A fragment of an approximated view maps to the same row of the exact view. Its point on the triangle has depth d, so

    x_e = x_a + fx·(v_e − v_a)·(1/focal − 1/d),

which is equation (5) after homogenisation. The fragments to its left and right there are mixed, if the shader output
cache still has them.
"""

from __future__ import annotations

import math

import numpy as np

from .buffers import block_of
from .compiling import inlined
from .geometry import slope_a, slope_b
from .state import BASE, MAX_TAPS


@inlined
def _cached(x, row, group, plan, view, color, fragments, scratch):
    """The fragment at column x of the exact view, −1 if the output cache has it no more."""
    if x < 0 or x >= view.width:
        return np.int64(-1)
    if scratch.stamp[group, x // plan.tile_w] <= 0:
        return np.int64(-1)  # not visited in this row of tiles
    source = np.int64(scratch.entry[group, row, x])
    if source < 0:
        return source
    if plan.from_buffer:
        y = fragments.y[source]
        block = block_of(color, scratch.exact[group], x, y)
        if color.cache.slot_of[block] < 0 or fragments.cursor[BASE] + source < scratch.since[block]:
            return np.int64(-1)
    elif scratch.stamp[group, x // plan.tile_w] <= scratch.clock[group] - plan.entries:
        return np.int64(-1)
    return source


@inlined
def _add_tap(n, source, weight, fragments):
    at = fragments.tap_first[n] + fragments.tap_count[n]
    fragments.tap_source[at] = source
    fragments.tap_weight[at] = weight
    fragments.tap_count[n] += 1


@inlined
def _position(x, y, v, exact, edges, det, view):
    """Where the triangle's point at (x, y) of view v is in the exact view."""
    a, b = slope_a(view, x, view.offsets[v]), slope_b(view, y)
    inverse = 0.0
    for k in range(3):
        inverse += edges[k, 0] * a + edges[k, 1] * b + edges[k, 2]
    return x + view.fx * (view.offsets[exact] - view.offsets[v]) * (1.0 / view.focal - inverse / det)


@inlined
def find_taps(n, inverse_depth, edges, y0, view, plan, color, fragments, scratch):
    """Give fragment n its taps. False, and none, where it has to be shaded."""
    v, x, y = fragments.camera[n], fragments.x[n], fragments.y[n]
    group = plan.group[v]
    exact = scratch.exact[group]
    if exact < 0:
        return False
    fragments.tap_first[n] = MAX_TAPS * n
    shift = view.fx * (view.offsets[exact] - view.offsets[v]) * (1.0 / view.focal - inverse_depth)
    position = x + shift  # in columns: column j is sampled at j
    row = y - y0
    left = np.int64(math.floor(position))
    part = position - left
    first = _cached(left, row, group, plan, view, color, fragments, scratch)
    second = _cached(left + 1, row, group, plan, view, color, fragments, scratch)
    if first < 0 and second < 0:
        return False
    if (first < 0 or second < 0) and not plan.lone:
        return False
    if plan.tent:
        det = scratch.det[v]
        # the kernel reaches one pixel to either side
        start = _position(x - 0.5, y + 0.5, v, exact, edges, det, view) - 0.5
        stop = _position(x + 1.5, y + 0.5, v, exact, edges, det, view) - 0.5
        if stop - start > 2.0 and stop - start < MAX_TAPS - 1:
            total = 0.0
            for j in range(np.int64(math.ceil(start)), np.int64(math.floor(stop)) + 1):
                source = _cached(j, row, group, plan, view, color, fragments, scratch)
                reach = (position - start) if j < position else (stop - position)
                weight = 1.0 - abs(j - position) / reach
                if source >= 0 and weight > 0.0:
                    _add_tap(n, source, weight, fragments)
                    total += weight
            for i in range(fragments.tap_first[n], fragments.tap_first[n] + fragments.tap_count[n]):
                fragments.tap_weight[i] /= total
            if fragments.tap_count[n] > 0:
                return True
    if first < 0:
        _add_tap(n, second, 1.0, fragments)
    elif second < 0:
        _add_tap(n, first, 1.0, fragments)
    else:
        _add_tap(n, first, 1.0 - part, fragments)
        _add_tap(n, second, part, fragments)
    return True
