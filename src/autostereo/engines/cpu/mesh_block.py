"""The triangles of one bin, row by row: what every draw of meshes does before it comes to samples."""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .mesh_raster import cut_edge, edge_through, fill_segment, fill_uv, row_geometry, rows_of, uv_gradient
from .mesh_shade import ZERO

NO_GRADIENT = (ZERO,) * 11


@inlined
def draw_block(draw_segment, place, rows, bin_index, surface, camera, shader, sample, scratch):
    """Call draw_segment(place, row, ends, depths, plain, shader, shading, scratch) for every segment of a bin.

    rows = (first, end); sample = (x, y) of the sample in its pixel; row counts from the first; ends, depths: see
    samples.hit; shading = (material, side, row_geometry, uv_gradient); attributes are in scratch.segment.
    """
    vertices, attributes, uv, wanted = surface.vertices, surface.attributes, surface.uv, surface.columns
    triangles, bins, face_material = surface.triangles, surface.bins, surface.face_material
    materials, segment = surface.materials, scratch.segment
    scale, sample_y = camera.fx / camera.focal, sample[1]
    for entry in range(surface.bin_start[bin_index], surface.bin_start[bin_index + 1]):
        index = np.uint64(bins[entry])
        code = triangles[index, 3]
        corners = (np.uint64(triangles[index, 0]), np.uint64(triangles[index, 1]), np.uint64(triangles[index, 2]))
        row0, row1 = rows_of(vertices, corners, sample_y, rows[0], rows[1])
        if row0 >= row1:
            continue
        m = np.uint64(face_material[code >> 1])
        sides = 2 if materials[m, 4] != ZERO else 1
        material = (materials[m, 0], materials[m, 1], materials[m, 2], materials[m, 3], materials[m, 5])
        textured, plain = materials[m, 5] >= ZERO, not shader.per_sample and materials[m, 6] != ZERO
        gradient = uv_gradient(vertices, uv, corners, camera) if textured else NO_GRADIENT
        middle = vertices[corners[1], 1]
        whole = edge_through(vertices, corners[0], corners[2])
        upper = edge_through(vertices, corners[0], corners[1])
        lower = edge_through(vertices, corners[1], corners[2])
        for r in range(row0, row1):
            y = r + sample_y
            left, right = cut_edge(whole, y, scale), cut_edge(upper if y < middle else lower, y, scale)
            if code & 1 == 0:
                left, right = right, left
            geometry = row_geometry(y, camera)
            for side in range(sides):
                if side == 1:
                    left, right = right, left
                ends, depths = (left[0], left[2], right[0], right[2]), (left[1], right[1])
                first = 6 if side == 1 and not shader.per_sample else 0
                fill_segment(attributes, left, right, first, wanted, segment)
                if textured:
                    fill_uv(uv, corners, left, right, segment)
                shading = (material, side, geometry, gradient)
                draw_segment(place, r - rows[0], ends, depths, plain, shader, shading, scratch)
