"""Depth-image-based rendering: views made of the pictures and depths of a few others, row by row.

Cameras stand on one line, so a pixel stays in its row, and slides by fx·Δv·(1/fd − 1/d) (DESIGN section 1): warping is
a matter of rows. Neighbours in a row that lie on one surface span a segment, which slides with its ends; where depth
jumps, each keeps its half of the pixel between. The nearest segment is seen. The two nearest references that see a
sample at about the same depth are blended by their distances; others, in turn, fill what both do not see; what nobody
sees is taken from the farther of its two sides, or at the picture's border from the references' own. PMR 2020, section
4.2, compares with it as MDIBR (Guan et al. 2019).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..engine import Camera, Target
from .jit import inlined, kernel
from .threads import run_rows

SAME = 0.01  # share of inverse depth by which pixels of one surface may part
HALF = 0.5


@inlined
def inverse_of(depth):
    """1/d; 0 of what is infinitely far."""
    return 1.0 / depth if np.isfinite(depth) else 0.0


@inlined
def are_joined(inverse, i):
    """Whether pixels i and i + 1 lie on one surface: alike in depth, or where its slope on either side leads to."""
    width = inverse.shape[0]
    a, b = inverse[i], inverse[i + 1]
    if a == 0.0 or b == 0.0:
        return a == b
    error = abs(a - b)
    if i > 0 and inverse[i - 1] > 0.0:
        error = min(error, abs(2.0 * a - inverse[i - 1] - b))
    if i + 2 < width and inverse[i + 2] > 0.0:
        error = min(error, abs(2.0 * b - inverse[i + 2] - a))
    return error <= SAME * max(a, b)


@inlined
def put(pixel, first, last, ends, found, near):
    """Draw a segment of a row that slides to first … last, between the pixels `ends`, where nothing nearer is.

    pixel: colours and inverse depth (W, 5) of the reference's row.
    """
    width = near.shape[0]
    length = last - first
    if not length > 0.0:
        return
    start, stop = max(np.ceil(first - HALF), 0.0), min(np.ceil(last - HALF), np.float64(width))
    for j in range(int(start), int(stop)):
        t = (j + HALF - first) / length
        w = pixel[ends[0], 4] + t * (pixel[ends[1], 4] - pixel[ends[0], 4])
        if w > near[j]:
            near[j] = w
            for c in range(4):
                found[j, c] = pixel[ends[0], c] + t * (pixel[ends[1], c] - pixel[ends[0], c])


@kernel
def warp_row(color, depth, slide, inverse_focal, pixel, found, near):
    """Fill found (W, 4) and near (W,), inverse depths, with what a reference's row shows to a camera `slide` away.

    color (W, 4) uint8, depth (W,) float32; slide = fx·(offset of the camera − that of the reference); pixel (W, 5) is
    memory. Where nothing is seen `near` is −1.
    """
    width = near.shape[0]
    for i in range(width):
        near[i] = -1.0
        for c in range(4):
            pixel[i, c] = color[i, c]
        pixel[i, 4] = inverse_of(depth[i])
    inverse = pixel[:, 4]
    at = HALF + slide * (inverse_focal - inverse[0])
    put(pixel, at - HALF, at, (0, 0), found, near)
    for i in range(width):
        if i + 1 == width:
            put(pixel, at, at + HALF, (i, i), found, near)
            break
        after = i + 1 + HALF + slide * (inverse_focal - inverse[i + 1])
        if are_joined(inverse, i):
            put(pixel, at, after, (i, i + 1), found, near)
        else:
            put(pixel, at, at + HALF, (i, i), found, near)
            put(pixel, after - HALF, after, (i + 1, i + 1), found, near)
        at = after


@inlined
def mix_rows(found, near, other, other_near, share, blend):
    """Complete a row by what another reference shows of it, `share` of the colour where both see the same."""
    for j in range(near.shape[0]):
        a, b = near[j], other_near[j]
        if b < 0.0 or (a >= 0.0 and not blend):
            continue
        same = a >= 0.0 and abs(a - b) <= SAME * max(a, b)
        if not same and b <= a:
            continue
        part = share if same else 1.0
        near[j] = a + part * (b - a)
        for c in range(4):
            found[j, c] += part * (other[j, c] - found[j, c])


@inlined
def fill_border(colors, depths, r, ends, found, near):
    """Take what lies beyond all references, columns ends[0] … ends[1], from the farthest of their outermost pixels."""
    column = 0 if ends[0] == 0 else near.shape[0] - 1
    best, inverse = 0, inverse_of(depths[0, r, column])
    for k in range(1, colors.shape[0]):
        other = inverse_of(depths[k, r, column])
        if other < inverse:
            best, inverse = k, other
    for j in range(ends[0], ends[1]):
        near[j] = inverse
        for c in range(4):
            found[j, c] = colors[best, r, column, c]


@inlined
def fill_holes(colors, depths, r, found, near):
    """Take what nobody sees within a row from the farther of its two sides."""
    width = near.shape[0]
    start = 0
    while start < width:
        if near[start] >= 0.0:
            start += 1
            continue
        stop = start
        while stop < width and near[stop] < 0.0:
            stop += 1
        if start == 0 or stop == width:
            fill_border(colors, depths, r, (start, stop), found, near)
        else:
            source = start - 1 if near[start - 1] <= near[stop] else stop
            for j in range(start, stop):
                near[j] = near[source]
                for c in range(4):
                    found[j, c] = found[source, c]
        start = stop


@kernel
def warp_rows(span, colors, depths, slides, inverse_focal, out, out_depth):
    """Fill rows span[0] … span[1] of a view from references (R, H, W, …), the nearest first.

    slides (R,): as in `warp_row`. out (H, W, 4) uint8; out_depth (H, W) float32, or of no rows.
    """
    count, width = colors.shape[0], colors.shape[2]
    pixel = np.empty((width, 5))
    found, near = np.zeros((width, 4)), np.empty(width)
    other, other_near = np.zeros((width, 4)), np.empty(width)
    for r in range(span[0], span[1]):
        warp_row(colors[0, r], depths[0, r], slides[0], inverse_focal, pixel, found, near)
        for k in range(1, count):
            warp_row(colors[k, r], depths[k, r], slides[k], inverse_focal, pixel, other, other_near)
            share = abs(slides[0]) / (abs(slides[0]) + abs(slides[k]))
            mix_rows(found, near, other, other_near, share, k == 1)
        fill_holes(colors, depths, r, found, near)
        for j in range(width):
            for c in range(4):
                out[r, j, c] = np.uint8(found[j, c] + HALF)
            if out_depth.shape[0] > 0:
                out_depth[r, j] = 1.0 / near[j] if near[j] > 0.0 else np.inf


def warp(references: Target, offsets: NDArray[np.float64], camera: Camera, offset: float, view: Target) -> None:
    """Fill a view from references.

    Parameters
    ----------
    references : Target
        color (R, H, W, 4) and depth (R, H, W).
    offsets : ndarray of shape (R,), float64
        Their camera offsets, and that of the view.
    camera : Camera
    offset : float
    view : Target
        color (1, H, W, 4); depth (1, H, W) or None.
    """
    assert references.depth is not None
    order = np.argsort(np.abs(offsets - offset), kind="stable")
    nearest = order[0]
    if offsets[nearest] == offset:
        view.color[0] = references.color[nearest]
        if view.depth is not None:
            view.depth[0] = references.depth[nearest]
        return
    colors, depths = references.color[order], references.depth[order]
    slides = camera.fx * (offset - offsets[order])
    depth = np.empty((0, camera.width), np.float32) if view.depth is None else view.depth[0]

    def draw(start: int, stop: int) -> None:
        warp_rows((start, stop), colors, depths, slides, 1.0 / camera.focal, view.color[0], depth)

    run_rows(camera.height, draw)
