"""Before rasterising: project vertices, light them, clip at the near plane, cull, sort into bands of rows.

Everything here happens once per frame for all views, in float64: image rows and depths are the same in every
view, and x is affine in the camera offset (DESIGN section 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..engine import Camera
from .jit import kernel
from .scalars import quotient

LIGHT_POINT = 1.0


class CameraNumbers(NamedTuple):
    """The centre camera as plain numbers; see engines.engine.Camera. (centre_x, centre_y): where it looks."""

    width: float
    height: float
    fx: float
    fy: float
    focal: float
    near: float
    offset_y: float
    centre_x: float
    centre_y: float
    spread: float


def camera_numbers(camera: Camera) -> CameraNumbers:
    """Return a camera's numbers."""
    return CameraNumbers(
        float(camera.width),
        float(camera.height),
        camera.fx,
        camera.fy,
        camera.focal,
        camera.near,
        camera.offset_y,
        0.5 * camera.width + camera.shift[0],
        0.5 * camera.height + camera.shift[1],
        camera.spread,
    )


@kernel
def project_vertices(first, last, positions, eye_from_world, camera, vertices):
    """Fill vertices[first:last] = (x at the centre camera, y, focal/depth) from world positions (N, 3).

    The third is −1 for a vertex before the near plane; their number is returned.
    """
    e = eye_from_world
    behind = 0
    for i in range(first, last):
        px, py, pz = positions[i, 0], positions[i, 1], positions[i, 2]
        depth = e[2, 0] * px + e[2, 1] * py + e[2, 2] * pz + e[2, 3]
        x = e[0, 0] * px + e[0, 1] * py + e[0, 2] * pz + e[0, 3]
        y = e[1, 0] * px + e[1, 1] * py + e[1, 2] * pz + e[1, 3]
        if depth < camera.near:
            vertices[i, 0], vertices[i, 1], vertices[i, 2] = 0.0, 0.0, -1.0
            behind += 1
            continue
        inverse = 1.0 / depth
        vertices[i, 0] = camera.centre_x + camera.fx * x * inverse
        vertices[i, 1] = (
            camera.centre_y
            - camera.fy * (y - camera.offset_y) * inverse
            - camera.fy * camera.offset_y / camera.focal
        )
        vertices[i, 2] = camera.focal * inverse
    return behind


@kernel
def turn_normals(first, last, normals, colors, eye_from_world, attributes):
    """Fill attributes[first:last] = (colour, eye-space normal, 0, 0) for lighting per sample."""
    e = eye_from_world
    for i in range(first, last):
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        for c in range(3):
            attributes[i, c] = colors[i, c]
            attributes[i, 3 + c] = e[c, 0] * nx + e[c, 1] * ny + e[c, 2] * nz
        attributes[i, 6], attributes[i, 7] = 0.0, 0.0


@kernel
def light_vertices(first, last, scene, eye_from_world, camera, lights, attributes):
    """Fill attributes[first:last] = (light·colour, highlight, 0, 0), of the front then, if there, of the back side."""
    e = eye_from_world
    sides = attributes.shape[1] // 8
    for i in range(first, last):
        px, py, pz = scene.positions[i, 0], scene.positions[i, 1], scene.positions[i, 2]
        nx, ny, nz = scene.normals[i, 0], scene.normals[i, 1], scene.normals[i, 2]
        x = e[0, 0] * px + e[0, 1] * py + e[0, 2] * pz + e[0, 3]
        y = e[1, 0] * px + e[1, 1] * py + e[1, 2] * pz + e[1, 3]
        z = e[2, 0] * px + e[2, 1] * py + e[2, 2] * pz + e[2, 3]
        ex = e[0, 0] * nx + e[0, 1] * ny + e[0, 2] * nz
        ey = e[1, 0] * nx + e[1, 1] * ny + e[1, 2] * nz
        ez = e[2, 0] * nx + e[2, 1] * ny + e[2, 2] * nz
        vy = camera.offset_y - y
        material = scene.materials[scene.vertex_material[i]]
        v = 1.0 / max(np.sqrt(x * x + vy * vy + z * z), 1e-30) if material[2] > 0.0 else 0.0
        for side in range(sides):
            sign = 1.0 - 2.0 * side
            dr, dg, db, sr, sg, sb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(lights.shape[0]):
                lx, ly, lz = lights[k, 1], lights[k, 2], lights[k, 3]
                if lights[k, 0] == LIGHT_POINT:
                    lx, ly, lz = lx - x, ly - y, lz - z
                    length = 1.0 / max(np.sqrt(lx * lx + ly * ly + lz * lz), 1e-30)
                    lx, ly, lz = lx * length, ly * length, lz * length
                nl = sign * (ex * lx + ey * ly + ez * lz)
                if nl <= 0.0:
                    continue
                dr, dg, db = dr + lights[k, 4] * nl, dg + lights[k, 5] * nl, db + lights[k, 6] * nl
                if material[2] > 0.0:
                    hx, hy, hz = lx - x * v, ly + vy * v, lz - z * v
                    h = 1.0 / max(np.sqrt(hx * hx + hy * hy + hz * hz), 1e-30)
                    nh = max(sign * (ex * hx + ey * hy + ez * hz) * h, 0.0) ** material[3]
                    sr, sg, sb = sr + lights[k, 4] * nh, sg + lights[k, 5] * nh, sb + lights[k, 6] * nh
            o = 8 * side
            attributes[i, o] = scene.colors[i, 0] * (material[0] + material[1] * dr)
            attributes[i, o + 1] = scene.colors[i, 1] * (material[0] + material[1] * dg)
            attributes[i, o + 2] = scene.colors[i, 2] * (material[0] + material[1] * db)
            attributes[i, o + 3] = material[2] * sr
            attributes[i, o + 4] = material[2] * sg
            attributes[i, o + 5] = material[2] * sb
            attributes[i, o + 6], attributes[i, o + 7] = 0.0, 0.0


@kernel
def count_crossing(faces, vertices):
    """Number of triangles with vertices on both sides of the near plane."""
    crossing = 0
    for f in range(faces.shape[0]):
        behind = 0
        for k in range(3):
            behind += vertices[faces[f, k], 2] < 0.0
        crossing += behind == 1 or behind == 2
    return crossing


@kernel
def clip_near(faces, face_ids, positions, eye_from_world, camera, vertices, attributes, uv, out_faces, out_ids):
    """Clip triangles at the near plane; new vertices go behind the first N rows of the vertex arrays.

    An edge is always cut from its inner to its outer end, so that neighbours get the same new vertex.
    Returns the number of triangles written.
    """
    e = eye_from_world
    new = positions.shape[0]
    count = 0
    polygon = np.empty(4, np.int32)
    for f in range(faces.shape[0]):
        corners = 0
        for k in range(3):
            i, j = faces[f, k], faces[f, (k + 1) % 3]
            i_in, j_in = vertices[i, 2] > 0.0, vertices[j, 2] > 0.0
            if i_in:
                polygon[corners] = i
                corners += 1
            if i_in != j_in:
                if not i_in:
                    i, j = j, i
                ax = e[0, 0] * positions[i, 0] + e[0, 1] * positions[i, 1] + e[0, 2] * positions[i, 2] + e[0, 3]
                ay = e[1, 0] * positions[i, 0] + e[1, 1] * positions[i, 1] + e[1, 2] * positions[i, 2] + e[1, 3]
                ad = e[2, 0] * positions[i, 0] + e[2, 1] * positions[i, 1] + e[2, 2] * positions[i, 2] + e[2, 3]
                bx = e[0, 0] * positions[j, 0] + e[0, 1] * positions[j, 1] + e[0, 2] * positions[j, 2] + e[0, 3]
                by = e[1, 0] * positions[j, 0] + e[1, 1] * positions[j, 1] + e[1, 2] * positions[j, 2] + e[1, 3]
                bd = e[2, 0] * positions[j, 0] + e[2, 1] * positions[j, 1] + e[2, 2] * positions[j, 2] + e[2, 3]
                t = (ad - camera.near) / (ad - bd)
                inverse = 1.0 / camera.near
                x, y = ax + t * (bx - ax), ay + t * (by - ay)
                vertices[new, 0] = camera.centre_x + camera.fx * x * inverse
                vertices[new, 1] = (
                    camera.centre_y
                    - camera.fy * (y - camera.offset_y) * inverse
                    - camera.fy * camera.offset_y / camera.focal
                )
                vertices[new, 2] = camera.focal * inverse
                for c in range(attributes.shape[1]):
                    attributes[new, c] = attributes[i, c] + t * (attributes[j, c] - attributes[i, c])
                for c in range(uv.shape[1]):
                    uv[new, c] = uv[i, c] + t * (uv[j, c] - uv[i, c])
                polygon[corners] = new
                corners += 1
                new += 1
        for k in range(1, corners - 1):
            out_faces[count, 0], out_faces[count, 1], out_faces[count, 2] = polygon[0], polygon[k], polygon[k + 1]
            out_ids[count] = face_ids[f]
            count += 1
    return count


@kernel
def cull_and_count(chunk, faces, face_ids, vertices, scene, camera, span, bins, out, counts):
    """Keep the triangles of one chunk that some view may see, and count them per bin.

    A bin is a row × a block of columns; bins = (first and last sample of a row, columns per block, blocks). out[k] =
    (top, middle, bottom vertex, 2·material + side of the long edge, first and last pixel, first row, end row); the
    triangles of chunk (first, last) are written from out[first] on, in the order of faces. counts[bin] is increased.

    Culling is conservative over all camera offsets in `span`: x is affine and the signed area too, so both
    ends of the span decide. Returns the number kept.
    """
    first, last = chunk
    first_sample, last_sample, columns, blocks = bins
    kept = first
    scale, inverse = camera.fx / camera.focal, 1.0 / columns
    for f in range(first, last):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ya, yb, yc = vertices[a, 1], vertices[b, 1], vertices[c, 1]
        top, bottom = min(ya, yb, yc), max(ya, yb, yc)
        row0 = max(np.ceil(top - last_sample), 0.0)
        row1 = min(np.ceil(bottom - first_sample), camera.height)
        if not row0 < row1:
            continue
        xa, xb, xc = vertices[a, 0], vertices[b, 0], vertices[c, 0]
        pa = scale * (1.0 - vertices[a, 2])
        pb = scale * (1.0 - vertices[b, 2])
        pc = scale * (1.0 - vertices[c, 2])
        left, right = np.inf, -np.inf
        facing = 0
        for end in range(2):
            o = span[end]
            xa_o, xb_o, xc_o = xa + o * pa, xb + o * pb, xc + o * pc
            left = min(left, xa_o, xb_o, xc_o)
            right = max(right, xa_o, xb_o, xc_o)
            area = (xb_o - xa_o) * (yc - ya) - (xc_o - xa_o) * (yb - ya)
            facing += area > 1e-3 * (bottom - top)  # rows run downwards: positive is a back side
        margin = 1.0 + 1e-6 * (abs(left) + abs(right))
        if right < -margin or left > camera.width + margin:
            continue
        material = scene.face_material[face_ids[f]]
        if facing == 2 and scene.materials[material, 4] == 0.0:
            continue
        # sort by y; an odd permutation mirrors the triangle
        odd = 0
        if yb < ya:
            a, b, ya, yb, odd = b, a, yb, ya, 1 - odd
        if yc < yb:
            b, c, yb, yc, odd = c, b, yc, yb, 1 - odd
        if yb < ya:
            a, b, ya, yb, odd = b, a, yb, ya, 1 - odd
        out[kept, 0], out[kept, 1], out[kept, 2], out[kept, 3] = a, b, c, 2 * material + odd
        out[kept, 4] = max(left - margin, 0.0)
        out[kept, 5] = min(right + margin, camera.width - 1.0)
        out[kept, 6], out[kept, 7] = row0, row1
        block0, block1 = quotient(out[kept, 4], inverse), quotient(out[kept, 5], inverse)
        for row in range(out[kept, 6], out[kept, 7]):
            for block in range(row * blocks + block0, row * blocks + block1 + 1):
                counts[block] += 1
        kept += 1
    return kept - first


@kernel
def fill_bins(first, count, triangles, columns, blocks, cursor, bins):
    """Write the indices of triangles first…first+count into their bins, from cursor[bin] on."""
    inverse = 1.0 / columns
    for k in range(first, first + count):
        block0, block1 = quotient(triangles[k, 4], inverse), quotient(triangles[k, 5], inverse)
        for row in range(triangles[k, 6], triangles[k, 7]):
            for block in range(row * blocks + block0, row * blocks + block1 + 1):
                bins[cursor[block]] = k
                cursor[block] += 1
