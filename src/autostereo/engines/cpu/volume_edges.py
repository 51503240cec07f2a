"""Sharp edges in views from shared slabs: pixels beside a jump are drawn again, along rays of their own.

Shared slabs are interpolated between positions a pixel apart, and slide as one, so that an edge in a transfer function
comes out as wide as a pixel, and off by up to half of one. Both shift or blur along rows only: where no two neighbours
of a row differ by much, neither changes much. So only what jumps needs a ray, a few percent of the pixels.
"""

from __future__ import annotations

import numpy as np

from .jit import inlined, kernel
from .volume_rays import END, RAYS
from .volume_views import finish_rays, mark_volumes, start_rays, trace_rays

JUMP = 6  # of 255: what two neighbours differ by at an edge


@inlined
def find_edges(color, jumps, chosen):
    """Write the pixels of a row, color (V, W, 4), of all views that are beside a jump into chosen, as v·W + x.

    jumps (W + 1,) uint8: scratch. Returns their number.
    """
    views, width, _ = color.shape
    count = 0
    for v in range(views):
        line = color[v]
        for x in range(width - 1):
            most = np.int32(0)
            for c in range(4):
                most = max(most, abs(np.int32(line[x + 1, c]) - np.int32(line[x, c])))
            jumps[x + 1] = most > JUMP
        for x in range(width):
            chosen[count] = v * width + x
            count += jumps[x] | jumps[x + 1]
    return count


@kernel
def draw_edges(rows, cuts, camera, slices, ways, offsets, planes, scratch, behind, color):
    """Draw pixels beside jumps in rows (first, end) of every view, color (V, H, W, 4), again.

    cuts, ways, planes: of one volume, in tuples; scratch = (rays, packed, jumps (W + 1,) uint8, chosen (V·W + 1,)
    int32); behind (V, end − first, W, 4): what was there before.
    """
    rays, packed, jumps, chosen = scratch
    width = color.shape[2]
    far, one = np.float32(slices.first + slices.slabs * slices.distance), np.uint64(1)
    for r in range(rows[0], rows[1]):
        row = ((camera.centre_y - (r + 0.5)) / camera.fy - camera.offset_y / camera.focal, camera.offset_y)
        count = find_edges(color[:, r], jumps, chosen)
        if count == 0 or mark_volumes(cuts, row, slices, planes) == 0:
            continue
        for first in range(0, count, RAYS):
            for i in range(RAYS):
                v, x = divmod(chosen[min(first + i, count - 1)], width)
                start_rays(one, np.uint64(i), x, offsets[v], camera, row, rays)
                rays[END + np.uint64(i)] = far
            trace_rays(cuts, row, slices, ways, False, False, planes, rays, packed)
            for i in range(min(count - first, RAYS)):
                v, x = divmod(chosen[first + i], width)
                for c in range(4):
                    color[v, r, x, c] = behind[v, r - rows[0], x, c]
                finish_rays(one, np.uint64(i), rays, color[v, r, x : x + 1])
