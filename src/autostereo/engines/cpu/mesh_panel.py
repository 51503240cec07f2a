"""Meshes straight to an interlaced panel: every sub-pixel its own camera offset, no stack of views in between.

Technique. In a row of the panel every sub-pixel has a place x and a camera offset o. Sub-pixels of similar offset
are grouped, and each group, in order of x, is cut into tiles of 16 (tiles): the ragged cousin of a stack of views.
A segment visits, group by group, the tiles between its ends. This asks nothing of the mask but the offset of every
sub-pixel, so tables, slanted lenses, cells and continuous phases are one case, and the cost does not depend on V.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .gather import row_camera
from .jit import inlined, kernel
from .mesh_raster import (
    cut_triangle, fill_segment, fill_uv, is_plain, row_geometry, rows_of, segment_columns, shade, uv_gradient,
)
from .mesh_shade import ADDRESS, CAPACITY, COLUMN, LEFT, OFFSET, RIGHT, TILE_U, TILE_Z, U, X, Z, ZERO
from .mesh_views import NO_GRADIENT
from .tiles import LANES, TILE, clear_tiles, draw_tile_plain, lowest_lane, scatter, test_tile

CELL = 4  # pixels per entry of the table from x to tiles
NOWHERE = np.float32(-3e38)


class Panel(NamedTuple):
    """How the panel is sampled: its map (gather.map_args), camera offsets (V,), groups, flips, sub-pixel sampling."""

    map: tuple
    offsets: np.ndarray
    groups: int
    flip_x: bool
    flip_y: bool
    subpixel: bool


class RowPlan(NamedTuple):
    """Where the sub-pixels of one row are in its tiles; one thread's own memory.

    camera (W, 3) float64; offset, x (tiles·16,) float32 per lane; place (3W,) int32 index of each sub-pixel's colour
    in the band; group (3W,) int32; begin (groups + 1,) first lane of each group; cells (W/CELL + 2, groups) int32: first
    lane at or right of a place; bounds (2, groups) float32: least and greatest offset of a group.
    """

    camera: np.ndarray
    offset: np.ndarray
    x: np.ndarray
    place: np.ndarray
    group: np.ndarray
    begin: np.ndarray
    cells: np.ndarray
    bounds: np.ndarray


@inlined
def offset_at(offsets, u):
    """viewmap.offset_at for one camera coordinate."""
    if offsets.shape[0] == 1:
        return offsets[0]
    k = int(min(max(np.floor(u), 0.0), offsets.shape[0] - 2.0))
    return offsets[k] + (u - k) * (offsets[k + 1] - offsets[k])


@inlined
def plan_row(row, width, panel, sample_x, plan):
    """Sort the sub-pixels of a row (of the picture, not yet flipped) into groups and tiles; returns the tiles."""
    m = panel.map
    row_camera(
        row, width, m.table, m.a, m.b, m.offsets, m.cell_mode, m.height, m.views, m.continuous, m.reverse, plan.camera
    )
    groups = panel.groups
    last = panel.offsets.shape[0] - 1
    low = offset_at(panel.offsets, -0.5)
    high = offset_at(panel.offsets, last + 0.5)
    per_offset = np.float32(groups / max(high - low, 1e-30))
    first_offset = np.float32(low)
    begin = plan.begin
    for g in range(groups + 1):
        begin[g] = 0
    for g in range(groups):
        plan.bounds[0, g], plan.bounds[1, g] = np.float32(np.inf), np.float32(-np.inf)
    offset_of = plan.offset  # unsorted first, in the upper half
    upper = np.uint64(plan.offset.shape[0] // 2)
    for x in range(width):
        from_x = width - 1 - x if panel.flip_x else x
        for c in range(3):
            offset = np.float32(offset_at(panel.offsets, plan.camera[from_x, c]))
            g = min(max(int((offset - first_offset) * per_offset), 0), groups - 1)
            s = np.uint64(3 * x + c)
            offset_of[upper + s] = offset
            plan.group[s] = g
            begin[g + 1] += 1
            plan.bounds[0, g] = min(plan.bounds[0, g], offset)
            plan.bounds[1, g] = max(plan.bounds[1, g], offset)
    # whole tiles for each group
    for g in range(groups):
        begin[g + 1] = begin[g] + (begin[g + 1] + 15) // 16 * 16
    tiles = begin[groups] // 16
    for k in range(begin[groups]):
        plan.x[np.uint64(k)] = NOWHERE
    cursor = plan.cells[plan.cells.shape[0] - 1]
    for g in range(groups):
        cursor[g] = begin[g]
    for x in range(width):
        if x % CELL == 0:
            for g in range(groups):
                plan.cells[x // CELL, g] = cursor[g]
        for c in range(3):
            s = np.uint64(3 * x + c)
            g = plan.group[s]
            k = np.uint64(cursor[g])
            cursor[g] += 1
            plan.offset[k] = offset_of[upper + s]
            plan.x[k] = np.float32(x) + (np.float32((c + sample_x) / 3.0) if panel.subpixel else np.float32(sample_x))
            plan.place[s] = np.int32((k // LANES) * TILE + LANES + k % LANES)
    cell = (width + CELL - 1) // CELL
    for g in range(groups):
        plan.cells[cell, g] = cursor[g]
    return tiles


@inlined
def tiles_of_group(g, ends, width, plan):
    """Tiles of group g that the segment may touch: (first, end)."""
    if plan.begin[g] == plan.begin[g + 1]:
        return 0, 0
    x1, p1, x2, p2 = ends
    low, high = plan.bounds[0, g], plan.bounds[1, g]
    left = min(x1 + low * p1, x1 + high * p1)
    right = max(x2 + low * p2, x2 + high * p2)
    limit = np.float32(width)
    start = np.int32(min(max(left - np.float32(1.5), ZERO), limit))
    end = np.int32(np.ceil(min(max(right + np.float32(0.5), ZERO), limit)))
    if end <= start:
        return 0, 0
    return plan.cells[start // CELL, g] // 16, (plan.cells[(end + CELL - 1) // CELL, g] + 15) // 16


@inlined
def set_tile(lanes, tile, ends, plan, lists):
    """Places of the tile's samples, and the segment's ends for each one's own offset."""
    x1, p1, x2, p2 = ends
    first = np.uint64(tile) * LANES
    offsets, places = plan.offset, plan.x
    for i in range(lanes):
        offset = offsets[first + i]
        lists[LEFT + i] = x1 + offset * p1
        lists[RIGHT + i] = x2 + offset * p2
    for i in range(lanes):
        lists[COLUMN + i] = places[first + i]


@inlined
def draw_segment_plain(ends, depths, width, lanes, groups, plan, scratch):
    """Draw one segment in every sub-pixel; its colour is interpolated."""
    band, segment, lists = scratch.band, scratch.segment, scratch.lists
    color = (segment[0], segment[1], segment[2], segment[16], segment[17], segment[18])
    for g in range(groups):
        tile0, tile1 = tiles_of_group(g, ends, width, plan)
        for tile in range(tile0, tile1):
            set_tile(lanes, tile, ends, plan, lists)
            draw_tile_plain(tile, ZERO, depths, color, band, lists)


@inlined
def draw_segment_listed(ends, depths, width, lanes, groups, shape, surface, lighting, plan, scratch):
    """Draw one segment in every sub-pixel; visible samples are listed and then shaded."""
    band, lists, ints = scratch.band, scratch.lists, scratch.ints
    n = np.uint64(0)
    for g in range(groups):
        tile0, tile1 = tiles_of_group(g, ends, width, plan)
        for tile in range(tile0, tile1):
            set_tile(lanes, tile, ends, plan, lists)
            mask = test_tile(tile, ZERO, depths, band, lists)
            address = np.int32(tile * 32 + 16)
            first = np.uint64(tile) * LANES
            while mask != 0:
                i = lowest_lane(mask)
                mask &= mask - np.int32(1)
                lists[U + n] = lists[TILE_U + i]
                lists[Z + n] = lists[TILE_Z + i]
                lists[X + n] = lists[COLUMN + i]
                lists[OFFSET + n] = plan.offset[first + i]
                ints[ADDRESS + n] = address + np.int32(i)
                n += np.uint64(1)
            if n > np.uint64(CAPACITY - 16):
                shade(n, surface, lighting, shape, scratch)
                scatter(n, band, ints)
                n = np.uint64(0)
    if n > np.uint64(0):
        shade(n, surface, lighting, shape, scratch)
        scatter(n, band, ints)


@inlined
def draw_row(r, bin_index, surface, camera, lighting, lanes, sample_y, groups, plan, scratch):
    """Draw row r of the picture into its tiles."""
    columns = segment_columns(surface, lighting)
    triangles = surface.triangles
    width = int(camera.width)
    y = r + sample_y
    for entry in range(surface.bin_start[bin_index], surface.bin_start[bin_index + 1]):
        index = surface.bins[entry]
        code = triangles[index, 3]
        corners = (triangles[index, 0], triangles[index, 1], triangles[index, 2], code & 1)
        row0, row1 = rows_of(surface.vertices, corners, sample_y, r, r + 1)
        if row0 >= row1:
            continue
        m = surface.face_material[code >> 1]
        textured = surface.materials[m, 5] >= ZERO
        plain = is_plain(surface, lighting, m)
        left, right = cut_triangle(surface.vertices, corners, y, camera)
        for side in range(2 if surface.materials[m, 4] != ZERO else 1):
            if side == 1:
                left, right = right, left
            ends, depths = (left[0], left[2], right[0], right[2]), (left[1], right[1])
            first = 6 if side == 1 and not lighting.per_sample else 0
            fill_segment(surface, lighting, left, right, first, columns, scratch.segment)
            if plain:
                draw_segment_plain(ends, depths, width, lanes, groups, plan, scratch)
            else:
                gradient = NO_GRADIENT
                if textured:
                    gradient = uv_gradient(surface, corners, camera)
                    fill_uv(surface, corners, left, right, scratch.segment)
                shape = (m, side, row_geometry(y, camera), gradient)
                draw_segment_listed(
                    ends, depths, width, lanes, groups, shape, surface, lighting, plan, scratch
                )


@inlined
def store_row(row, panel, side, place, band, sums, last, out):
    """Write the row's sub-pixels to the panel, or add them to the sums of sub-samples."""
    width = out.shape[1]
    samples = side * side
    for x in range(width):
        to_x = width - 1 - x if panel.flip_x else x
        for c in range(3):
            s = np.uint64(3 * x + c)
            value = (band[np.uint64(place[s])] >> np.int32(8 * c)) & np.int32(255)
            if samples == 1:
                out[row, to_x, c] = np.uint8(value)
            else:
                sums[s] += np.uint16(value)
                if last:
                    out[row, to_x, c] = np.uint8((np.int64(sums[s]) + samples // 2) // samples)
                    sums[s] = np.uint16(0)


@kernel
def draw_panel(bands, surface, camera, lighting, panel, background, lanes, side, plan, scratch, out):
    """Draw bands (first, end, rows per band) of the panel into out (H, W, 3) uint8, side² samples a sub-pixel."""
    height, width, _ = out.shape
    for band in range(bands[0], bands[1]):
        for r in range(band * bands[2], min((band + 1) * bands[2], height)):
            row = height - 1 - r if panel.flip_y else r
            for sample in range(side * side):
                sample_x, sample_y = (sample % side + 0.5) / side, (sample // side + 0.5) / side
                tiles = plan_row(row, width, panel, sample_x, plan)
                clear_tiles(tiles, background, scratch.band)
                draw_row(r, band, surface, camera, lighting, lanes, sample_y, panel.groups, plan, scratch)
                store_row(row, panel, side, plan.place, scratch.band, scratch.sums, sample == side * side - 1, out)
