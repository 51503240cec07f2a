"""Before splatting: bring surfels before the cameras, light them, sort them into blocks of the picture.

Everything here happens once per frame for all views. Surfels are blended in the order of their numbers: it is the same
in every view, so that sums of weights are the same bits however many views are drawn at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined, kernel
from .scalars import quotient

# what is kept of a surfel: 16 words, a cache line
X, Y, DEPTH, REACH, NX, NY, ND, RED, GREEN, BLUE, A, B, INVERSE = range(13)  # float32
PARTS, ROW0, ROW1 = 13, 14, 15  # int32
WORDS = 16

FRONT, BACK, SMALL, BARE = 1, 2, 4, 8  # which of its shapes a surfel takes in some view, see points_chord
SIDES = 16  # some views may see one side of it, some the other
MATERIAL = 5  # PARTS holds the number of its material from this bit on

LEAST_RADIUS = 0.71  # pixels: every disc of it, just over √½, holds a pixel's centre
LARGEST = 1e5  # radius as a multiple of depth: what is seen of a larger disc is seen of this one


class Grid(NamedTuple):
    """Blocks of the picture: rows of a band, columns of a block, blocks of a band."""

    rows: int
    columns: int
    blocks: int


class View(NamedTuple):
    """Eye space, and for whom surfels are seen and lit.

    eye_from_world (4, 4) and that of normals (3, 3), float64; range of camera offsets; lights (L, 8) float32, see
    scene_arrays.light_array; own_eye: every view sees its own side of a surfel, and highlights, which are left to those
    who know the view; else all see what the centre camera does.
    """

    eye_from_world: np.ndarray
    turn: np.ndarray
    low: float
    high: float
    lights: np.ndarray
    own_eye: bool


@inlined
def bounds_of(q0, q1, q2, low, high):
    """Least and greatest value of q0 + q1·t + q2·t² for t in low … high."""
    at_low, at_high = q0 + low * (q1 + low * q2), q0 + high * (q1 + high * q2)
    least, greatest = min(at_low, at_high), max(at_low, at_high)
    top = -0.5 * q1 / q2 if q2 != 0.0 else low
    if low < top < high:
        value = q0 + top * (q1 + top * q2)
        least, greatest = min(least, value), max(greatest, value)
    return least, greatest


@inlined
def parts_of(normal, a, b, radii, across):
    """Shapes that a disc takes in views that see it at a·d, b·d, a in a[0] … a[1], and whether SIDES.

    See points_chord.is_small; radii: in pixels, in x and y; across = n·(0, b, 1). Where rounding might decide, all
    shapes are possible.
    """
    nx, ny, nd = normal
    rx, ry = radii[0] * radii[0], radii[1] * radii[1]
    squares = (
        rx + ry * (1.0 + b * b - (ny - b * nd) ** 2) - rx * nx * nx,
        2.0 * rx * nx * nd,
        rx * (1.0 - nd * nd),
    )
    area = (rx * ry * across * across, 2.0 * rx * ry * nx * across, rx * ry * nx * nx)
    s0, s1 = bounds_of(squares[0], squares[1], squares[2], a[0], a[1])
    p0, p1 = bounds_of(
        0.0625 - 0.25 * squares[0] + area[0],
        -0.25 * squares[1] + area[1],
        -0.25 * squares[2] + area[2],
        a[0],
        a[1],
    )
    slack = 1e-5 * (1.0 + s1 + rx * ry * (across * across + nx * nx * max(a[0] * a[0], a[1] * a[1])))
    if s0 > 0.5 + slack and p0 > slack:
        return FRONT
    sides = 0 if max(nx * a[0] + across, nx * a[1] + across) < -1e-6 else SIDES
    if s1 < 0.5 - slack or p1 < -slack:
        return SMALL | sides
    return FRONT | SMALL | (BACK | sides if sides else 0)


@inlined
def extent(p, n, nd, reach):
    """How far a disc extends along one axis of the picture, in units of depth, from its centre at p.

    A plane through the eye and the picture's line at p + t meets the disc where |t| ≤ reach·|n × (its normal)|: the
    roots of a quadratic in t. Infinite where the disc reaches the plane of the eyes.
    """
    c = n - p * nd
    square = reach * reach
    lead = 1.0 - square * (1.0 - nd * nd)
    if lead <= 1e-9:
        return -np.inf, np.inf
    middle = square * (p + c * nd)
    root = np.sqrt(max(middle * middle + lead * square * (1.0 + p * p - c * c), 0.0))
    return (middle - root) / lead, (middle + root) / lead


@inlined
def light_surfel(place, normal, color, material, view, offset_y):
    """Colour of a surfel lit at its centre on one side; without highlights if every eye sees its own."""
    px, py, d = place
    nx, ny, nd = normal
    r, g, b = material[0], material[0], material[0]
    sr, sg, sb = 0.0, 0.0, 0.0
    lights = view.lights
    for k in range(lights.shape[0]):
        tx, ty, td = np.float64(lights[k, 1]), np.float64(lights[k, 2]), np.float64(lights[k, 3])
        if lights[k, 0] != 0.0:
            tx, ty, td = tx - px, ty - py, td - d
            scale = 1.0 / max(np.sqrt(tx * tx + ty * ty + td * td), 1e-30)
            tx, ty, td = tx * scale, ty * scale, td * scale
        cosine = nx * tx + ny * ty + nd * td
        if cosine <= 0.0:
            continue
        diffuse = material[1] * cosine
        r, g, b = r + diffuse * lights[k, 4], g + diffuse * lights[k, 5], b + diffuse * lights[k, 6]
        if material[2] > 0.0 and not view.own_eye:
            vy = offset_y - py
            scale = 1.0 / max(np.sqrt(px * px + vy * vy + d * d), 1e-30)
            hx, hy, hd = tx - px * scale, ty + vy * scale, td - d * scale
            scale = 1.0 / max(np.sqrt(hx * hx + hy * hy + hd * hd), 1e-30)
            shine = material[2] * max((nx * hx + ny * hy + nd * hd) * scale, 0.0) ** material[3]
            sr, sg, sb = sr + shine * lights[k, 4], sg + shine * lights[k, 5], sb + shine * lights[k, 6]
    return color[0] * r + sr, color[1] * g + sg, color[2] * b + sb


@kernel
def place_surfels(span, arrays, view, camera, grid, records, words, backs, ranges, counts):
    """Bring surfels span[0] … span[1] before the cameras, and count how many touch each block of the picture.

    records (N, 16) float32 and words, its bits as int32: see X, Y, …; backs (N, 3) float32: colours of the other sides,
    of surfels with SIDES; ranges (N, 4) int32: bands and blocks of the picture that they may touch from some camera,
    first and last + 1; none for those out of sight and those whose centre is in front of the near plane; counts
    (bands·blocks,).
    """
    e, m = view.eye_from_world, view.turn
    scale = 1.0 / camera.focal
    bands, columns = 1.0 / grid.rows, 1.0 / grid.columns
    for i in range(span[0], span[1]):
        ranges[i, 0], ranges[i, 1] = 0, 0
        wx, wy, wz = arrays.positions[i, 0], arrays.positions[i, 1], arrays.positions[i, 2]
        d = e[2, 0] * wx + e[2, 1] * wy + e[2, 2] * wz + e[2, 3]
        if not d >= camera.near:
            continue
        inverse = 1.0 / d
        px = e[0, 0] * wx + e[0, 1] * wy + e[0, 2] * wz + e[0, 3]
        py = e[1, 0] * wx + e[1, 1] * wy + e[1, 2] * wz + e[1, 3]
        a, b = px * inverse, (py - camera.offset_y) * inverse
        x = camera.centre_x + camera.fx * a
        y = camera.centre_y - camera.fy * (b + camera.offset_y * scale)
        reach = min(np.float64(arrays.radii[i]) * inverse, LARGEST)

        gx, gy, gz = arrays.normals[i, 0], arrays.normals[i, 1], arrays.normals[i, 2]
        nx = m[0, 0] * gx + m[0, 1] * gy + m[0, 2] * gz
        ny = m[1, 0] * gx + m[1, 1] * gy + m[1, 2] * gz
        nd = m[2, 0] * gx + m[2, 1] * gy + m[2, 2] * gz
        length = np.sqrt(nx * nx + ny * ny + nd * nd)
        bare = not length > 0.0
        turned = 1.0 / max(length, 1e-300)
        middle = min(max(0.0, view.low), view.high)  # two-sided: turned to the centre camera, or the one next to it
        if nx * (a - middle * inverse) + ny * b + nd > 0.0:
            turned = -turned
        nx, ny, nd = nx * turned, ny * turned, nd * turned
        if bare:
            nx, ny, nd = 0.0, 0.0, -1.0

        rx, ry = camera.fx * reach, camera.fy * reach
        left, right, top, bottom = -rx, rx, -ry, ry
        shift_low, shift_high = view.low * scale, view.high * scale
        a_low, a_high = a - view.high * inverse, a - view.low * inverse
        parts = BARE
        if not bare:
            parts = parts_of((nx, ny, nd), (a_low, a_high), b, (rx, ry), ny * b + nd)
        if parts & (SMALL | BARE):
            left, right = min(left, -LEAST_RADIUS), max(right, LEAST_RADIUS)
            top, bottom = min(top, -LEAST_RADIUS), max(bottom, LEAST_RADIUS)
        if parts & FRONT:
            low, high = extent(b, ny, nd, reach)
            top, bottom = min(top, -camera.fy * high), max(bottom, -camera.fy * low)
            for end in range(2):
                low, high = extent(a_low if end == 0 else a_high, nx, nd, reach)
                left, right = min(left, camera.fx * low), max(right, camera.fx * high)
        x_low = camera.centre_x + camera.fx * (a_high + shift_low)
        x_high = camera.centre_x + camera.fx * (a_low + shift_high)
        left, right = left + min(x_low, x_high) - 1.0, right + max(x_low, x_high) + 1.0
        row0 = max(np.ceil(y + top - 0.51), 0.0)
        row1 = min(np.floor(y + bottom - 0.49) + 1.0, camera.height)
        if not (row0 < row1 and right > 0.0 and left < camera.width):
            continue

        number = np.int64(arrays.material[i])
        material = (
            np.float64(arrays.materials[number, 0]),
            np.float64(arrays.materials[number, 1]),
            np.float64(arrays.materials[number, 2]),
            np.float64(arrays.materials[number, 3]),
        )
        color = (np.float64(arrays.colors[i, 0]), np.float64(arrays.colors[i, 1]), np.float64(arrays.colors[i, 2]))
        away = not view.own_eye and nx * a + ny * b + nd > 0.0  # lit on the side that the centre camera sees
        facing = (-nx, -ny, -nd) if away else (nx, ny, nd)
        red, green, blue = light_surfel((px, py, d), facing, color, material, view, camera.offset_y)
        if parts & SIDES:
            behind = (-nx, -ny, -nd) if view.own_eye else facing
            seen = light_surfel((px, py, d), behind, color, material, view, camera.offset_y)
            backs[i, 0], backs[i, 1], backs[i, 2] = seen
        records[i, X], records[i, Y], records[i, DEPTH], records[i, REACH] = x, y, d, reach
        records[i, NX], records[i, NY], records[i, ND] = nx, ny, nd
        records[i, RED], records[i, GREEN], records[i, BLUE] = red, green, blue
        records[i, A], records[i, B], records[i, INVERSE] = a, b, inverse
        words[i, PARTS] = parts | (number << MATERIAL)
        words[i, ROW0], words[i, ROW1] = int(row0), int(row1)
        ranges[i, 0], ranges[i, 1] = quotient(row0, bands), quotient(row1 - 1.0, bands) + 1
        ranges[i, 2] = quotient(np.floor(max(left, 0.0)), columns)
        ranges[i, 3] = min(quotient(np.floor(min(right, camera.width - 1.0)), columns) + 1, grid.blocks)
        for band in range(ranges[i, 0], ranges[i, 1]):
            for block in range(ranges[i, 2], ranges[i, 3]):
                counts[band * grid.blocks + block] += 1


@kernel
def fill_bins(span, ranges, blocks, cursor, bins):
    """Write the numbers of surfels span[0] … span[1] into the bins of the blocks that they touch."""
    for i in range(span[0], span[1]):
        for band in range(ranges[i, 0], ranges[i, 1]):
            for block in range(ranges[i, 2], ranges[i, 3]):
                bins[cursor[band * blocks + block]] = i
                cursor[band * blocks + block] += 1
