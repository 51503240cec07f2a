"""Meshes to a stack of views: a band of rows of every view at a time, in cache.

For each triangle and row, its segment (mesh_raster) is drawn into all views before the next: group by group of
views, tile by tile (tiles). Plain colours are done within the tile; dearer shading collects the visible samples
of the segment in lists first, so that shading is SIMD over visible samples only.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .mesh_raster import (
    cut_triangle, fill_segment, fill_uv, is_plain, row_geometry, rows_of, segment_columns, shade, uv_gradient,
)
from .mesh_shade import ADDRESS, CAPACITY, COLUMN, LEFT, OFFSET, ONE, RIGHT, TILE_U, TILE_Z, U, X, Z, ZERO
from .tiles import LANES, TILE, clear_tiles, draw_tile_plain, lowest_lane, scatter, test_tile

NO_GRADIENT = (ZERO,) * 11


@inlined
def tiles_of_group(first, last, ends, grid):
    """Tiles that the segment may touch in a group of views with offsets first … last: (first, end)."""
    x1, p1, x2, p2 = ends
    per_column = ONE / np.float32(grid.columns)  # a power of two: exact
    left = min(x1 + first * p1, x1 + last * p1) * per_column
    right = max(x2 + first * p2, x2 + last * p2) * per_column
    limit = np.float32(grid.across)
    return np.int32(min(max(left, ZERO), limit)), np.int32(np.ceil(min(max(right, ZERO), limit)))


@inlined
def set_ends(lanes, lane_offsets, group, ends, lists):
    """Both ends of the segment for the 16 lanes of a group of views."""
    x1, p1, x2, p2 = ends
    first = np.uint64(group) * LANES
    for i in range(lanes):
        offset = lane_offsets[first + i]
        lists[LEFT + i] = x1 + offset * p1
        lists[RIGHT + i] = x2 + offset * p2


@inlined
def draw_segment_plain(lane_offsets, row_tile, ends, depths, grid, scratch):
    """Draw one segment in every view; its colour is interpolated."""
    band, segment, lists = scratch.band, scratch.segment, scratch.lists
    columns = np.float32(grid.columns)
    color = (segment[0], segment[1], segment[2], segment[16], segment[17], segment[18])
    for g in range(grid.groups):
        k = np.uint64(g) * LANES
        tile0, tile1 = tiles_of_group(lane_offsets[k], lane_offsets[k + np.uint64(15)], ends, grid)
        if tile0 >= tile1:
            continue
        set_ends(np.uint64(grid.lanes), lane_offsets, g, ends, lists)
        row = row_tile + g * grid.across
        for tile in range(tile0, tile1):
            draw_tile_plain(row + tile, np.float32(tile) * columns, depths, color, band, lists)


@inlined
def draw_segment_listed(lane_offsets, row_tile, ends, depths, grid, shape, surface, lighting, scratch):
    """Draw one segment in every view; visible samples are listed and then shaded."""
    band, lists, ints = scratch.band, scratch.lists, scratch.ints
    columns = np.float32(grid.columns)
    n = np.uint64(0)
    for g in range(grid.groups):
        k = np.uint64(g) * LANES
        tile0, tile1 = tiles_of_group(lane_offsets[k], lane_offsets[k + np.uint64(15)], ends, grid)
        if tile0 >= tile1:
            continue
        set_ends(np.uint64(grid.lanes), lane_offsets, g, ends, lists)
        row = row_tile + g * grid.across
        for tile in range(tile0, tile1):
            x = np.float32(tile) * columns
            mask = test_tile(row + tile, x, depths, band, lists)
            address = np.int32((row + tile) * 32 + 16)
            while mask != 0:
                i = lowest_lane(mask)
                mask &= mask - np.int32(1)
                lists[U + n] = lists[TILE_U + i]
                lists[Z + n] = lists[TILE_Z + i]
                lists[X + n] = x + lists[COLUMN + i]
                lists[OFFSET + n] = lane_offsets[k + i]
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
def draw_band(rows, bin_index, surface, camera, lighting, lane_offsets, sample_y, grid, scratch):
    """Draw rows (first, end) of every view into the band; sample_y is the sample's place within its row."""
    columns = segment_columns(surface, lighting)
    triangles = surface.triangles
    for entry in range(surface.bin_start[bin_index], surface.bin_start[bin_index + 1]):
        index = surface.bins[entry]
        code = triangles[index, 3]
        corners = (triangles[index, 0], triangles[index, 1], triangles[index, 2], code & 1)
        m = surface.face_material[code >> 1]
        sides = 2 if surface.materials[m, 4] != ZERO else 1
        textured = surface.materials[m, 5] >= ZERO
        plain = is_plain(surface, lighting, m)
        gradient = uv_gradient(surface, corners, camera) if textured else NO_GRADIENT
        row0, row1 = rows_of(surface.vertices, corners, sample_y, rows[0], rows[1])
        for r in range(row0, row1):
            y = r + sample_y
            left, right = cut_triangle(surface.vertices, corners, y, camera)
            row_tile = (r - rows[0]) * grid.groups * grid.across
            for side in range(sides):
                if side == 1:
                    left, right = right, left
                ends, depths = (left[0], left[2], right[0], right[2]), (left[1], right[1])
                first = 6 if side == 1 and not lighting.per_sample else 0
                fill_segment(surface, lighting, left, right, first, columns, scratch.segment)
                if plain:
                    draw_segment_plain(lane_offsets, row_tile, ends, depths, grid, scratch)
                else:
                    if textured:
                        fill_uv(surface, corners, left, right, scratch.segment)
                    shape = (m, side, row_geometry(y, camera), gradient)
                    draw_segment_listed(
                        lane_offsets, row_tile, ends, depths, grid, shape, surface, lighting, scratch
                    )


@inlined
def copy_row(source, stride, columns, target, first, width, out):
    """Copy one view's row out of its tiles, `columns` samples from each."""
    whole = width // columns
    if columns >= 4:
        for j in range(columns // 4):
            s, d = source + np.uint64(4 * j), np.uint64(first + 4 * j)
            for _ in range(whole):
                a, b = target[s], target[s + np.uint64(1)]
                c, e = target[s + np.uint64(2)], target[s + np.uint64(3)]
                out[d], out[d + np.uint64(1)], out[d + np.uint64(2)], out[d + np.uint64(3)] = a, b, c, e
                s += stride
                d += np.uint64(columns)
    else:
        for j in range(columns):
            s, d = source + np.uint64(j), np.uint64(first + j)
            for _ in range(whole):
                out[d] = target[s]
                s += stride
                d += np.uint64(columns)
    for j in range(width - whole * columns):
        out[np.uint64(first + whole * columns + j)] = target[source + np.uint64(whole) * stride + np.uint64(j)]


@inlined
def view_start(row, view, grid):
    """Index in the band of the first colour of a view's row."""
    tile = np.uint64((row * grid.groups + view // grid.views) * grid.across)
    return tile * TILE + LANES + np.uint64(view % grid.views * grid.columns)


@inlined
def store_views(rows, grid, band, out):
    """Copy the band's colours to the pictures (V, H, W) int32."""
    views, height, width = out.shape
    line = out.reshape(-1)
    for r in range(rows[0], rows[1]):
        for view in range(views):
            start = view_start(r - rows[0], view, grid)
            copy_row(start, TILE, grid.columns, band, (view * height + r) * width, width, line)


@inlined
def store_depth(rows, focal, grid, band, nearest, out):
    """Write eye depth (V, H, W), inf where empty; with `nearest`, keep what is nearer."""
    views, _, width = out.shape
    for r in range(rows[0], rows[1]):
        for view in range(views):
            start = view_start(r - rows[0], view, grid) - LANES
            for x in range(width):
                k = start + np.uint64(x // grid.columns) * TILE + np.uint64(x % grid.columns)
                depth = focal / np.int32(band[k]).view(np.float32)
                out[view, r, x] = min(depth, out[view, r, x]) if nearest else depth


@inlined
def add_samples(rows, views, width, grid, band, sums):
    """Add the band's colours to the sums, four channels a pixel."""
    k = 0
    for r in range(rows[1] - rows[0]):
        for view in range(views):
            start = view_start(r, view, grid)
            for x in range(width):
                rgba = band[start + np.uint64(x // grid.columns) * TILE + np.uint64(x % grid.columns)]
                for c in range(4):
                    sums[k + c] += np.uint16((rgba >> np.int32(8 * c)) & np.int32(255))
                k += 4


@inlined
def store_means(rows, samples, sums, out):
    """Write the rounded means of the sums to the pictures, and clear the sums."""
    views, _, width = out.shape
    k = 0
    half = samples // 2
    for r in range(rows[0], rows[1]):
        for view in range(views):
            for x in range(width):
                rgba = np.int32(0)
                for c in range(4):
                    rgba |= np.int32((np.int64(sums[k + c]) + half) // samples) << np.int32(8 * c)
                    sums[k + c] = np.uint16(0)
                out[view, r, x] = rgba
                k += 4


@kernel
def draw_views(bands, surface, camera, lighting, lane_offsets, background, grid, side, scratch, out, depth):
    """Draw bands (first, end, rows per band) of every view into out (V, H, W) int32.

    side² samples a pixel; depth (V, H, W) float32, or of no size when it is not wanted.
    """
    views, height, width = out.shape
    for k in range(bands[0], bands[1]):
        rows = (k * bands[2], min((k + 1) * bands[2], height))
        for sample in range(side * side):
            sample_x = np.float32((sample % side + 0.5) / side)
            for i in range(16):
                scratch.lists[COLUMN + np.uint64(i)] = np.float32(i % grid.columns) + sample_x
            clear_tiles((rows[1] - rows[0]) * grid.groups * grid.across, background, scratch.band)
            sample_y = (sample // side + 0.5) / side
            draw_band(rows, k, surface, camera, lighting, lane_offsets, sample_y, grid, scratch)
            if side > 1:
                add_samples(rows, views, width, grid, scratch.band, scratch.sums)
            if depth.size > 0:
                store_depth(rows, np.float32(camera.focal), grid, scratch.band, sample > 0, depth)
        if side > 1:
            store_means(rows, side * side, scratch.sums, out)
        else:
            store_views(rows, grid, scratch.band, out)
