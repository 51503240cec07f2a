"""Traversal: a triangle to all views before the next, tile by tile, in the order that the texture cache likes best.

Hasselgren 2006, sections 4.1 to 4.3 and 5. All the tiles of a row of tiles are visited in all views before the next
row: always that of the view with the least efficiency measure. Tiles of one pixel are the paper's scanline traversal.
The depth test comes before shading, so that a list of the fragments that pass, in order, is all that shading needs;
where shaders give the depths it comes after, and the list holds all that is covered.

Errata, checked in tests/test_sim_raster.py: the one-axis measure of section 5, "simply the component of t", needs the
sign of the traversal direction along that axis; without it (`UNSIGNED`) views whose coordinate falls along the row are
finished one after the other.
"""

from __future__ import annotations

import numpy as np

from .approximation import find_taps
from .buffers import HITS, block_of, enter, passes
from .compiling import inlined, kernel
from .geometry import evaluate, is_inside, set_edges, slope_a, slope_b
from .lru import HIT, touch
from .state import (
    AXIS,
    BASE,
    COUNT,
    COVERED,
    CULLED,
    DOT,
    EQUAL,
    HORIZON,
    IN_TURN,
    LESS,
    PASSED,
    REUSED,
    ROW,
    ROWS,
    TILES,
    TRIANGLE,
    Z_MAX,
    Z_SCALE,
)  # fmt: skip


@inlined
def _clip_near(corners, near, polygon):
    """The part of the triangle with d ≥ near into polygon (4, 3). Returns how many corners it has."""
    n = 0
    for i in range(3):
        j = (i + 1) % 3
        d0, d1 = corners[i, 2], corners[j, 2]
        if d0 >= near:
            for c in range(3):
                polygon[n, c] = corners[i, c]
            n += 1
        if (d0 >= near) != (d1 >= near):
            t = (near - d0) / (d1 - d0)
            for c in range(3):
                polygon[n, c] = corners[i, c] + t * (corners[j, c] - corners[i, c])
            n += 1
    return n


@inlined
def _overlaps(edges, side, a, b, half_a, half_b):
    """Whether a tile with centre (a, b) may meet the triangle: no edge has all of it outside."""
    for k in range(3):
        reach = abs(edges[k, 0]) * half_a + abs(edges[k, 1]) * half_b
        if side * evaluate(edges, k, a, b) + reach < 0.0:
            return False
    return True


@inlined
def _pb(edges, k, a, b):
    """Barycentric coordinate of corner k at (a, b)."""
    total = evaluate(edges, 0, a, b) + evaluate(edges, 1, a, b) + evaluate(edges, 2, a, b)
    return evaluate(edges, k, a, b) / total


@inlined
def _sum(edges, a, b):
    return evaluate(edges, 0, a, b) + evaluate(edges, 1, a, b) + evaluate(edges, 2, a, b)


@kernel
def set_up(corners, facing, view, plan, scratch):
    """Edges of a triangle in all views of the pass, and its rows (first, last) of pixels; (0, −1) if out of sight."""
    n = _clip_near(corners, view.near, scratch.polygon)
    if n == 0:
        return 0, -1
    polygon = scratch.polygon
    low, high = np.inf, -np.inf
    for i in range(n):
        y = view.height / 2 - view.fy * (polygon[i, 1] - view.offset_y) / polygon[i, 2]
        y -= view.fy * view.offset_y / view.focal
        low, high = min(low, y), max(high, y)
    first = np.int64(max(np.floor(low) - 1.0, 0.0)) if low < view.height + 2 else view.height
    last = np.int64(min(np.ceil(high) + 1.0, view.height - 1.0)) if high > -2 else -1
    for g in range(len(plan.exact)):
        scratch.exact[g] = plan.exact[g]
    any_view = False
    for v in range(plan.first, plan.last):
        det = set_edges(view, corners, view.offsets[v], scratch.edges[v])
        scratch.det[v] = det
        side = 0
        if det > 0.0 and facing >= 0:
            side = 1
        elif det < 0.0 and facing <= 0:
            side = -1
        scratch.side[v] = side
        any_view |= side != 0
        if plan.approximate and plan.exact[plan.group[v]] < 0 and side != 0:
            # depths are the same in all views, so areas are as determinants
            best = scratch.exact[plan.group[v]]
            if best < 0 or abs(det) > abs(scratch.det[best]):
                scratch.exact[plan.group[v]] = v
    scratch.clock[:] = 0
    if not any_view:
        return 0, -1
    return first, last


@inlined
def _columns(n, view, plan, scratch, y0):
    """Tiles left … right of each view that may meet the triangle in the row of tiles from y0. Returns their number."""
    tw, th = plan.tile_w, plan.tile_h
    half_a, half_b = tw / 2.0 / view.fx, th / 2.0 / view.fy
    b = slope_b(view, y0 + th / 2.0)
    total = 0
    for v in range(plan.first, plan.last):
        scratch.left[v], scratch.right[v] = 0, -1
        side = scratch.side[v]
        if side == 0:
            continue
        offset = view.offsets[v]
        low, high = np.inf, -np.inf
        for i in range(n):
            d = scratch.polygon[i, 2]
            x = view.width / 2 + view.fx * scratch.polygon[i, 0] / d + view.fx * offset * (1 / view.focal - 1 / d)
            low, high = min(low, x), max(high, x)
        if low > view.width + 1 or high < -1:
            continue
        left = np.int64(max(low - 1.0, 0.0)) // tw
        right = np.int64(min(high + 1.0, view.width - 1.0)) // tw
        edges = scratch.edges[v]
        while left <= right and not _overlaps(
            edges, side, slope_a(view, left * tw + tw / 2.0, offset), b, half_a, half_b
        ):
            left += 1
        while right > left and not _overlaps(
            edges, side, slope_a(view, right * tw + tw / 2.0, offset), b, half_a, half_b
        ):
            right -= 1
        scratch.left[v], scratch.right[v] = left, right
        total += max(0, right - left + 1)
    return total


@kernel
def _direction(view, plan, scratch, y0, totals):
    """Barycentric traversal direction (d_u, d_v) of a row of tiles, from its two ends in the first view that has
    any."""
    for v in range(plan.first, plan.last):
        if scratch.left[v] <= scratch.right[v]:
            b = slope_b(view, y0 + plan.tile_h / 2.0)
            edges = scratch.edges[v]
            start = slope_a(view, float(scratch.left[v] * plan.tile_w), view.offsets[v])
            stop = slope_a(view, float((scratch.right[v] + 1) * plan.tile_w), view.offsets[v])
            if _sum(edges, start, b) * _sum(edges, stop, b) <= 0.0:
                totals[HORIZON] += 1
            return _pb(edges, 1, stop, b) - _pb(edges, 1, start, b), _pb(edges, 2, stop, b) - _pb(edges, 2, start, b)
    return 0.0, 0.0


@inlined
def _measure(view, plan, scratch, v, y0, du, dv):
    """Efficiency measure E of view v's next tile, at its centre; k − 1 tiles further on in approximated views."""
    if plan.order == IN_TURN:
        return float(v)
    tile = scratch.left[v]
    if plan.approximate and scratch.exact[plan.group[v]] != v:
        tile += plan.entries - 1
    a = slope_a(view, tile * plan.tile_w + plan.tile_w / 2.0, view.offsets[v])
    b = slope_b(view, y0 + plan.tile_h / 2.0)
    edges = scratch.edges[v]
    if plan.order == DOT:
        return du * _pb(edges, 1, a, b) + dv * _pb(edges, 2, a, b)
    along, axis = du, 1
    if abs(dv) > abs(du):
        along, axis = dv, 2
    e = _pb(edges, axis, a, b)
    if plan.order == AXIS and along < 0.0:
        return -e
    return e


@inlined
def _visit(v, tile, y0, triangle, view, plan, depth, color, fragments, scratch):
    """One tile of one view: coverage, depth test, and what becomes of the fragments that pass."""
    edges, side, det = scratch.edges[v], scratch.side[v], scratch.det[v]
    x0 = tile * plan.tile_w
    x1, y1 = min(x0 + plan.tile_w, view.width), min(y0 + plan.tile_h, view.height)
    a_row, b_column = view.a[v], view.b
    z_of_sum = view.near * Z_SCALE / det
    fragments.totals[TILES] += 1
    block = block_of(depth, v, x0, y0)
    trusted = False  # Z-min: everything passes, nothing need be read
    if plan.z_max or plan.z_min:  # the tile lies within one block (machine.py)
        low, high = np.inf, -np.inf
        for corner in range(4):
            a = a_row[x0 if corner & 1 == 0 else x1 - 1]
            b = b_column[y0 if corner & 2 == 0 else y1 - 1]
            z = _sum(edges, a, b) * z_of_sum
            low, high = min(low, z), max(high, z)
        if plan.z_max and high + 2.0 <= depth.farthest[block]:
            fragments.totals[CULLED] += 1
            return
        trusted = plan.z_min and plan.depth_test == LESS and low - 2.0 > depth.nearest[block]
    group = plan.group[v]
    is_exact = plan.approximate and scratch.exact[group] == v
    if is_exact:
        scratch.clock[group] += 1
        scratch.stamp[group, tile] = scratch.clock[group]
        scratch.entry[group, :, x0:x1] = -1
    n = fragments.cursor[COUNT]
    of_view = fragments.of_view[v]
    current, slot = np.int64(-1), np.int64(-1)
    for y in range(y0, y1):
        b = b_column[y]
        for x in range(x0, x1):
            a = a_row[x]
            e0 = evaluate(edges, 0, a, b)
            if not is_inside(e0, side, edges, 0):
                continue
            e1 = evaluate(edges, 1, a, b)
            if not is_inside(e1, side, edges, 1):
                continue
            e2 = evaluate(edges, 2, a, b)
            if not is_inside(e2, side, edges, 2):
                continue
            total = e0 + e1 + e2
            depth_z = total * z_of_sum
            if not 0.0 < depth_z <= Z_SCALE:
                continue  # nearer than the near plane
            of_view[COVERED] += 1
            if not plan.late:
                z = np.uint32(min(depth_z, Z_MAX))
                block = block_of(depth, v, x, y)
                if block != current:
                    slot = np.int64(enter(depth, block))
                    current = block
                else:
                    depth.counts[HITS] += 1
                if not passes(depth, block, slot, v, x, y, z, plan.depth_test == EQUAL, plan.depth_write, trusted):
                    continue
                of_view[PASSED] += 1
            fragments.triangle[n] = triangle
            fragments.camera[n] = v
            fragments.x[n] = x
            fragments.y[n] = y
            fragments.tap_count[n] = 0
            if plan.from_buffer:
                written = block_of(color, v, x, y)
                if touch(color.cache, written) != HIT:
                    scratch.since[written] = fragments.cursor[BASE] + n
            if is_exact:
                scratch.entry[group, y - y0, x] = n
            elif plan.approximate and find_taps(n, total / det, edges, y0, view, plan, color, fragments, scratch):
                of_view[REUSED] += 1
            n += 1
    fragments.cursor[COUNT] = n


@kernel
def rasterize(corners, facing, view, plan, depth, color, fragments, scratch):
    """Traverse triangles (F, 3, 3) from where `fragments.cursor` says, until all are done or the list is full.

    Parameters
    ----------
    corners : ndarray of shape (F, 3, 3)
        In the centre camera's eye space.
    facing : int
        The side that is seen: 1 counter-clockwise, −1 clockwise, 0 both.
    view : View
    plan : Plan
    depth : Buffer
    color : Buffer
        With `plan.from_buffer`: a copy whose cache goes the way that the colour buffer's will go.
    fragments : Fragments
    scratch : Scratch

    Returns
    -------
    bool
        True when all triangles are done.
    """
    cursor = fragments.cursor
    while cursor[TRIANGLE] < len(corners):
        triangle = cursor[TRIANGLE]
        first, last = set_up(corners[triangle], facing, view, plan, scratch)
        n = _clip_near(corners[triangle], view.near, scratch.polygon)
        row = max(cursor[ROW], first // plan.tile_h)
        while first <= last and row <= last // plan.tile_h:
            y0 = row * plan.tile_h
            tiles = _columns(n, view, plan, scratch, y0)
            if cursor[COUNT] + tiles * plan.tile_w * plan.tile_h > len(fragments.x):
                cursor[ROW] = row
                return False
            if tiles > 0:
                _row(triangle, y0, view, plan, depth, color, fragments, scratch)
            row += 1
        cursor[ROW] = 0
        cursor[TRIANGLE] += 1
    return True


@inlined
def _row(triangle, y0, view, plan, depth, color, fragments, scratch):
    """All tiles of a row of tiles, in all views (TRAVERSESCANLINE of section 4.1)."""
    fragments.totals[ROWS] += 1
    du, dv = 0.0, 0.0
    if plan.order != IN_TURN and plan.last - plan.first > 1:
        du, dv = _direction(view, plan, scratch, y0, fragments.totals)
    if plan.approximate:
        scratch.stamp[:] = -1  # nothing of this row is in the output cache
    left, right, measure = scratch.left, scratch.right, scratch.measure
    for v in range(plan.first, plan.last):
        if left[v] <= right[v]:
            measure[v] = _measure(view, plan, scratch, v, y0, du, dv)
    while True:
        k = -1
        for v in range(plan.first, plan.last):
            if left[v] <= right[v] and (k < 0 or measure[v] < measure[k]):
                k = v
        if k < 0:
            return
        _visit(k, left[k], y0, triangle, view, plan, depth, color, fragments, scratch)
        left[k] += 1
        if left[k] <= right[k]:
            measure[k] = _measure(view, plan, scratch, k, y0, du, dv)
