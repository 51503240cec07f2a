"""Chords: where a surfel's disc meets an image row, in every view at once.

Technique. All cameras lie in the plane of an image row, so a disc meets a row in one chord that is the same 3-D
segment in every view: its ends lie at x1 + o·p1 and x2 + o·p2 for camera offset o, at depths that do not depend on
the view. With n and m the distances of a sample from the left and the right end in pixels, and z1, z2 the inverse
depths of the ends (relative to that of the disc's centre), the ray meets the disc

    at depth d·w/q,  q = z1·m + z2·n,  w = n + m,  a fraction u = z2·n/q along the chord,

and the disc's weight there is w = 1 − |X − P|²/r² = 4·S²·u·(1 − u), S the chord's half length / r: positive where
n > 0 and m > 0. That is all of the ray–splat intersection (Hübner 2007b, section 3.3.2) that is left per sample.

A disc that appears less than a pixel wide in a view, and one without a normal, lies in the plane of constant depth:
its chords have z1 = z2, and move with its centre.

Discs have two sides. A record's normal is turned to one of the cameras; those who look at the other side see the
chord the other way round (BACK), and the disc lit from there.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined
from .points_setup import BACK, DEPTH, INVERSE, LEAST_RADIUS, ND, NX, NY, REACH, SMALL, A, B, X, Y
from .scalars import ONE, TINY, ZERO, exp2_fast, log2_fast

FOUR, HALF, QUARTER = np.float32(4.0), np.float32(0.5), np.float32(0.25)
LEAST = np.float32(LEAST_RADIUS)
FLOOR = np.float32(1e-12)
CLOSEST = np.float32(1e-6)  # least depth relative to the centre's: 1 + d has no digits below
NO_CHORD = (ZERO,) * 9


@inlined
def lens_of(camera):
    """The camera as chords need it: fx, fy, fx/focal, near, in float32."""
    return np.float32(camera.fx), np.float32(camera.fy), np.float32(camera.fx / camera.focal), np.float32(camera.near)


@inlined
def is_small(offset, record, lens):
    """Whether a disc appears less than a pixel wide from the camera at `offset` (reference.points.is_thin).

    The squares of the projection's half axes are the roots of t² − S·t + A² for S the sum of the squares of the
    projected axes, A·π the area. The lesser is below ¼ if the polynomial is negative at ¼, or both are.
    """
    nx, ny, nd, b = record[NX], record[NY], record[ND], record[B]
    rx, ry = lens[0] * record[REACH], lens[1] * record[REACH]
    a = record[A] - offset * record[INVERSE]
    along, down = nx - a * nd, ny - b * nd
    squares = rx * rx * (ONE + a * a - along * along) + ry * ry * (ONE + b * b - down * down)
    area = rx * ry * (nx * a + ny * b + nd)
    return (np.float32(0.0625) - QUARTER * squares + area * area < ZERO) | (squares < HALF)


@inlined
def cut_disc(record, y, lens, back):
    """The chord of a disc in the row of samples at y; `back`: as those see it who look at its other side."""
    fx, fy, scale, near = lens
    nx, ny, nd, reach, a, inverse = record[NX], record[NY], record[ND], record[REACH], record[A], record[INVERSE]
    down = (y - record[Y]) / fy
    b = record[B] - down  # the row is the plane Y − lens offset = b·depth; q = (0, 1, −b) is normal to it
    tx = -(b * ny + nd)  # n × q = (tx, b·nx, nx) runs along the chord
    square = ONE / max(tx * tx + nx * nx * (ONE + b * b), FLOOR)
    across = down / reach
    share = ONE - across * across * square  # S²
    if not share > ZERO:
        return False, NO_CHORD
    # the foot of the perpendicular from the centre, then both ends, relative to the centre and in units of its depth
    c = ny - b * nd
    k = -down * square
    foot_x, foot_d = -k * c * nx, -k * (b + c * nd)
    half = reach * np.sqrt(share * square)
    half_x, half_d = half * tx, half * nx
    if back:
        half_x, half_d = -half_x, -half_d
    s1, s2, plane = -ONE, ONE, max(near * inverse, CLOSEST)
    if ONE + foot_d - abs(half_d) < plane:  # an end lies before the near plane
        if ONE + foot_d + abs(half_d) < plane:
            return False, NO_CHORD
        cut = (plane - ONE - foot_d) / half_d
        s1, s2 = (max(cut, s1), s2) if half_d > ZERO else (s1, min(cut, s2))
    # an end on the near plane is there to within a rounding of the disc's size, which may be the other side of the eye
    d1, d2 = max(foot_d + s1 * half_d, plane - ONE), max(foot_d + s2 * half_d, plane - ONE)
    z1, z2 = ONE / (ONE + d1), ONE / (ONE + d2)
    x1 = record[X] + fx * (foot_x + s1 * half_x - a * d1) * z1
    x2 = record[X] + fx * (foot_x + s2 * half_x - a * d2) * z2
    slide = fx * inverse
    # the part drawn runs from u1 to u2 of the whole chord: u·(1 − u) ∝ (n + first·m)·(m + last·n)
    u1, u2 = HALF * (s1 + ONE), HALF * (s2 + ONE)
    first, last = z1 * u1 / (z2 * u2), z2 * (ONE - u2) / (z1 * (ONE - u1))
    weight = FOUR * share * z1 * z2 * u2 * (ONE - u1)
    return True, (x1, scale - slide * z1, x2, scale - slide * z2, z1, z2, weight, first, last)


@inlined
def cut_circle(record, y, lens):
    """The chord of a disc of constant depth whose radius is at least LEAST_RADIUS pixels."""
    fx, fy, scale, _ = lens
    rx, ry = max(fx * record[REACH], LEAST), max(fy * record[REACH], LEAST)
    across = (y - record[Y]) / ry
    share = ONE - across * across
    if not share > ZERO:
        return False, NO_CHORD
    half = rx * np.sqrt(share)
    p = scale - fx * record[INVERSE]
    return True, (record[X] - half, p, record[X] + half, p, ONE, ONE, FOUR * share, ZERO, ZERO)


@inlined
def cut(record, part, y, lens):
    """Whether the samples at y meet this shape of a surfel, and the chord.

    chord = (x1, p1, x2, p2, z1, z2, weight, first, last), see above and `cut_disc`.
    """
    if part >= SMALL:
        return cut_circle(record, y, lens)
    return cut_disc(record, y, lens, part == BACK)


@inlined
def depth_of(n, m, across, chord):
    """Depth and 1/q of a sample n pixels right of a chord's left end and m left of its right end.

    across = (n + m)·depth of the centre.
    """
    inverse = ONE / (chord[4] * m + chord[5] * n)
    return across * inverse, inverse


@inlined
def weight_of(n, m, inverse, chord):
    """Weight of a sample."""
    return chord[6] * (n + chord[7] * m) * (m + chord[8] * n) * (inverse * inverse)


@inlined
def shine_of(offset, place, normal, light, shininess):
    """(N·H)^shininess of a surfel for the eye at `offset`; light: the unit vector towards it.

    place: of the centre relative to an eye at offset 0.
    """
    px, py, d = place
    vx = offset - px
    scale = ONE / np.sqrt(vx * vx + py * py + d * d)
    hx, hy, hd = light[0] + vx * scale, light[1] - py * scale, light[2] - d * scale
    scale = ONE / np.sqrt(max(hx * hx + hy * hy + hd * hd, TINY))
    cosine = (normal[0] * hx + normal[1] * hy + normal[2] * hd) * scale
    return exp2_fast(shininess * log2_fast(min(max(cosine, TINY), ONE)))


@inlined
def sees_front(offset, record):
    """Whether the camera at `offset` looks at the side of a disc that its record's normal points to."""
    across = record[NY] * record[B] + record[ND]
    return record[NX] * (record[A] - offset * record[INVERSE]) + across <= ZERO


@inlined
def light_at(k, record, lens_offset, lights):
    """Unit vector from a surfel's centre towards light k, and on which side of the surfel it is: > 0 in front."""
    tx, ty, td = lights[k, 1], lights[k, 2], lights[k, 3]
    if lights[k, 0] != ZERO:
        d = record[DEPTH]
        tx, ty, td = tx - record[A] * d, ty - (record[B] * d + lens_offset), td - d
        scale = ONE / np.sqrt(max(tx * tx + ty * ty + td * td, TINY))
        tx, ty, td = tx * scale, ty * scale, td * scale
    return (tx, ty, td), record[NX] * tx + record[NY] * ty + record[ND] * td
