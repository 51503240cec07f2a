"""Depth-image-based rendering: views made of the pictures and depths of a few others, row by row.

Cameras stand on one line, so a pixel stays in its row, and slides by fx·Δv·(1/fd − 1/d) (DESIGN section 1): warping is
a matter of rows. Neighbours in a row that lie on one surface span a segment, which slides with its ends; where depth
jumps, each keeps its half of the pixel between. The nearest segment is seen. The two nearest references that see a
sample at about the same depth are blended by their distances; others, in turn, fill what both do not see. What nobody
sees is guessed: where depth jumps and its two sides part, the farther goes on to where it is seen; beyond the pictures,
their borders do. PMR 2020, section 4.2, compares with it as MDIBR (Guan et al. 2019).
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
    return 1.0 / np.float64(depth) if np.isfinite(depth) else 0.0


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


@kernel
def prepare_row(color, depth, pixel, joined):
    """Fill pixel (W, 5), colours and inverse depths of a reference's row, and joined (W,): whether i and i + 1 are."""
    width = depth.shape[0]
    for i in range(width):
        for c in range(4):
            pixel[i, c] = color[i, c]
        pixel[i, 4] = inverse_of(depth[i])
    inverse = pixel[:, 4]
    for i in range(width - 1):
        joined[i] = are_joined(inverse, i)
    joined[width - 1] = False


@inlined
def put(pixel, first, last, ends, found, near):
    """Draw a segment of a row that slides to first … last, between the pixels `ends`, where nothing nearer is.

    pixel: of `prepare_row`.
    """
    width = np.float64(near.shape[0])
    length = last - first
    if not length > 0.0:
        return
    start = min(max(np.ceil(first - HALF), 0.0), width)  # both ends: what is very near slides beyond all integers
    stop = min(max(np.ceil(last - HALF), 0.0), width)
    for j in range(int(start), int(stop)):
        t = (j + HALF - first) / length
        w = pixel[ends[0], 4] + t * (pixel[ends[1], 4] - pixel[ends[0], 4])
        if w > near[j]:
            near[j] = w
            for c in range(4):
                found[j, c] = pixel[ends[0], c] + t * (pixel[ends[1], c] - pixel[ends[0], c])


@kernel
def warp_row(pixel, joined, slide, inverse_focal, found, near):
    """Fill found (W, 4) and near (W,), inverse depths, with what a reference's row shows to a camera `slide` away.

    pixel, joined: of `prepare_row`; slide = fx·(offset of the camera − that of the reference). Where nothing is seen
    `near` is −1.
    """
    width = near.shape[0]
    for j in range(width):
        near[j] = -1.0
    at = HALF + slide * (inverse_focal - pixel[0, 4])
    put(pixel, at - HALF, at, (0, 0), found, near)
    for i in range(width - 1):
        after = i + 1 + HALF + slide * (inverse_focal - pixel[i + 1, 4])
        if joined[i]:
            put(pixel, at, after, (i, i + 1), found, near)
        else:
            put(pixel, at, at + HALF, (i, i), found, near)
            put(pixel, after - HALF, after, (i + 1, i + 1), found, near)
        at = after
    put(pixel, at, at + HALF, (width - 1, width - 1), found, near)


@kernel
def guess_row(pixel, joined, slide, inverse_focal, found, near):
    """Fill found, near as `warp_row` with what may be where a row shows nothing: the farther side of each gap."""
    width = near.shape[0]
    for j in range(width):
        near[j] = -1.0
    for i in range(width - 1):
        if not joined[i]:
            at = i + HALF + slide * (inverse_focal - pixel[i, 4])
            after = i + 1 + HALF + slide * (inverse_focal - pixel[i + 1, 4])
            far = i if pixel[i, 4] < pixel[i + 1, 4] else i + 1
            put(pixel, at + HALF, after - HALF, (far, far), found, near)


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
def fill_border(pixels, order, ends, found, near):
    """Take what lies beyond all references, columns ends[0] … ends[1], from the farthest of their outermost pixels."""
    column = 0 if ends[0] == 0 else near.shape[0] - 1
    best = order[0]
    for k in order[1:]:
        if pixels[k, column, 4] < pixels[best, column, 4]:
            best = k
    for j in range(ends[0], ends[1]):
        near[j] = pixels[best, column, 4]
        for c in range(4):
            found[j, c] = pixels[best, column, c]


@inlined
def fill_holes(pixels, order, found, near):
    """Take what lies beyond the pictures from their borders, and between two that do not meet from the farther side."""
    width = near.shape[0]
    start = 0
    while start < width:
        if near[start] >= 0.0:
            start += 1
            continue
        stop = start + 1
        while stop < width and near[stop] < 0.0:
            stop += 1
        if start == 0 or stop == width:
            fill_border(pixels, order, (start, stop), found, near)
        else:
            source = start - 1 if near[start - 1] <= near[stop] else stop
            for j in range(start, stop):
                near[j] = near[source]
                for c in range(4):
                    found[j, c] = found[source, c]
        start = stop


@kernel
def warp_rows(span, colors, depths, order, slides, inverse_focal, out, out_depth):
    """Fill rows span[0] … span[1] of V views from references (R, H, W, …).

    order (V, R): each view's references, the nearest first; slides (V, R) in that order, as in `warp_row`. out
    (V, H, W, 4) uint8; out_depth (V, H, W) float32, or of no views.
    """
    count, width = colors.shape[0], colors.shape[2]
    pixels, joined = np.empty((count, width, 5)), np.empty((count, width), np.bool_)
    found, near = np.zeros((width, 4)), np.empty(width)
    other, other_near = np.zeros((width, 4)), np.empty(width)
    for r in range(span[0], span[1]):
        for k in range(count):
            prepare_row(colors[k, r], depths[k, r], pixels[k], joined[k])
        for v in range(order.shape[0]):
            first = order[v, 0]
            if slides[v, 0] == 0.0:  # the reference itself
                out[v, r] = colors[first, r]
                if out_depth.shape[0] > 0:
                    out_depth[v, r] = depths[first, r]
                continue
            warp_row(pixels[first], joined[first], slides[v, 0], inverse_focal, found, near)
            for k in range(1, count):
                if k > 1 and near.min() >= 0.0:
                    break
                other_one = order[v, k]
                warp_row(pixels[other_one], joined[other_one], slides[v, k], inverse_focal, other, other_near)
                share = abs(slides[v, 0]) / (abs(slides[v, 0]) + abs(slides[v, k]))
                mix_rows(found, near, other, other_near, share, k == 1)
            for k in range(count):
                if near.min() >= 0.0:
                    break
                other_one = order[v, k]
                guess_row(pixels[other_one], joined[other_one], slides[v, k], inverse_focal, other, other_near)
                mix_rows(found, near, other, other_near, 1.0, False)
            fill_holes(pixels, order[v], found, near)
            for j in range(width):
                for c in range(4):
                    out[v, r, j, c] = np.uint8(found[j, c] + HALF)
                if out_depth.shape[0] > 0:
                    out_depth[v, r, j] = 1.0 / near[j] if near[j] > 0.0 else np.inf


def warp(
    references: Target, offsets: NDArray[np.float64], camera: Camera, wanted: NDArray[np.float64], views: Target
) -> None:
    """Fill views from references.

    Parameters
    ----------
    references : Target
        color (R, H, W, 4) and depth (R, H, W).
    offsets : ndarray of shape (R,), float64
        Their camera offsets.
    camera : Camera
    wanted : ndarray of shape (V,), float64
        Camera offsets of the views; one that is a reference's is that reference, bit for bit.
    views : Target
        color (V, H, W, 4); depth (V, H, W) or None.
    """
    color, depth = references.color, references.depth
    assert depth is not None
    order = np.argsort(np.abs(wanted[:, None] - offsets), axis=1, kind="stable")
    slides = camera.fx * (wanted[:, None] - offsets[order])
    out_depth = np.empty((0, camera.height, camera.width), np.float32) if views.depth is None else views.depth

    def draw(start: int, stop: int) -> None:
        warp_rows((start, stop), color, depth, order, slides, 1.0 / camera.focal, views.color, out_depth)

    run_rows(camera.height, draw)
