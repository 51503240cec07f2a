"""Shading of a list of fragments, in order, and their way into the colour buffer."""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .buffers import block_of, enter, mark, need, passes, pixel_bit
from .compiling import inlined, kernel
from .geometry import evaluate, set_edges
from .shaders import built_in as shader
from .state import COUNT, PASSED, Z_MAX, Z_SCALE
from .textures import MISSES

REPLACE, ALPHA, ADD, MULTIPLY, ACCUMULATE = range(5)  # Work.blend
SHADED, APPROXIMATED = 1, 2  # values of Target.how


class Work(NamedTuple):
    """One draw, for the shading of its fragments.

    Attributes
    ----------
    corners : ndarray of shape (F, 3, 3)
    attributes : ndarray of shape (F, 3, A), float64
    derivatives : int
        So many attributes get their changes per pixel.
    mirrored : bool
    shader : int
    uniforms : ndarray of shape (U,), float64
    units : ndarray of shape (T,), int64
    blend : int
    weight : float
        Of a sample in ACCUMULATE.
    unified : bool
        Shade for the centre camera in all views.
    from_buffer : bool
        Approximations take what is in the colour buffer, not what the shader gave.
    late, equal, depth_write : bool
        The depth test that follows shading where the shader gives the depth.
    color : bool
        False: depths alone are drawn.
    sample : ndarray of shape (3, A); small : (5, 5); edges : (3, 3)
        Memory to work in.
    """

    corners: Any
    attributes: Any
    derivatives: int
    mirrored: bool
    shader: int
    uniforms: Any
    units: Any
    blend: int
    weight: float
    unified: bool
    from_buffer: bool
    late: bool
    equal: bool
    depth_write: bool
    color: bool
    sample: Any
    small: Any
    edges: Any


class Target(NamedTuple):
    """Where colours go.

    Attributes
    ----------
    buffer, depth : Buffer
    total : ndarray of shape (H, W, 4), float32
        ACCUMULATE: the common colour buffer; else empty.
    colors : ndarray of shape (N, 4), float32
        What the shader, or the approximation, gave for each fragment of the list.
    depths : ndarray of shape (N,), float64
        The same of depth, as near/depth, where the shader gives it.
    runs : ndarray of shape (V,), int64
        Shader runs of each view.
    how : ndarray of shape (V, H, W), uint8
        How each pixel's last fragment was made; or empty.
    misses : ndarray of shape (V, H, W), int32
        Texture cache misses while a pixel was shaded; or empty.
    """

    buffer: Any
    depth: Any
    total: Any
    colors: Any
    depths: Any
    runs: Any
    how: Any
    misses: Any


@inlined
def put(color, v, x, y, blend, weight, target):
    """One fragment into the colour buffer; color (4,) becomes what a view's buffer holds then."""
    buffer = target.buffer
    plane = 0 if blend == ACCUMULATE else v
    block = block_of(buffer, plane, x, y)
    slot = enter(buffer, block)
    bit = pixel_bit(buffer, x, y)
    if blend != REPLACE:
        need(buffer, block, slot, bit)
    mark(buffer, slot, bit)
    if blend == ACCUMULATE:
        for c in range(3):
            target.total[y, x, c] += np.float32(weight * color[c])
        target.total[y, x, 3] += np.float32(weight)  # what is seen of a sample is opaque
        return
    old = np.int64(buffer.values[v, y, x])
    word = np.int64(0)
    alpha = color[3]
    for c in range(4):
        value = color[c]
        before = (old >> (8 * c) & 255) / 255.0
        if blend == REPLACE:
            value = value if c < 3 else 1.0
        elif blend == ALPHA:
            value = alpha * value + (1.0 - alpha) * before if c < 3 else alpha + (1.0 - alpha) * before
        elif blend == ADD:
            value += before
        else:
            value = value * before if c < 3 else before
        byte = np.int64(255.0 * min(max(value, 0.0), 1.0) + 0.5)
        word |= byte << (8 * c)
        color[c] = byte / 255.0
    buffer.values[v, y, x] = word


@inlined
def _shown(n, v, x, y, fragments, work, target):
    """Late depth test: whether fragment n is seen, at the depth that its shader gave."""
    depth = target.depth
    z = np.uint32(min(min(max(target.depths[n], 0.0), 1.0) * Z_SCALE, Z_MAX))
    block = block_of(depth, v, x, y)
    slot = enter(depth, block)
    if not passes(depth, block, slot, v, x, y, z, work.equal, work.depth_write, False):
        return False
    fragments.of_view[v, PASSED] += 1
    return True


def _shade_fragments(fragments, work, view, memory, target):
    """Shade, or put together from their taps, all fragments of the list, and write them."""
    attributes = work.attributes
    count = attributes.shape[2]
    at, dx, dy = work.sample[0], work.sample[1], work.sample[2]
    out, eye = work.small[0], work.small[1]
    weights, wx, wy = work.small[2], work.small[3], work.small[4]
    edges = work.edges
    triangle, v = -1, -1
    with_map, with_misses = len(target.how) > 0, len(target.misses) > 0
    for n in range(fragments.cursor[COUNT]):
        x, y = fragments.x[n], fragments.y[n]
        if fragments.triangle[n] != triangle or fragments.camera[n] != v:
            triangle, v = np.int64(fragments.triangle[n]), np.int64(fragments.camera[n])
            det = set_edges(view, work.corners[triangle], view.offsets[v], edges)
            eye[0] = 0.0 if work.unified else view.offsets[v]
            eye[1] = view.offset_y
            eye[3] = 1.0 if (det > 0.0) != work.mirrored else -1.0
            eye[4] = view.near
        if fragments.tap_count[n] > 0:
            out[:] = 0.0
            first = fragments.tap_first[n]
            for i in range(first, first + fragments.tap_count[n]):
                for c in range(4):
                    out[c] += fragments.tap_weight[i] * target.colors[fragments.tap_source[i], c]
            if work.late:
                base = target.depths[fragments.tap_source[first]]
                out[4] = base
                for i in range(first + 1, first + fragments.tap_count[n]):
                    out[4] += fragments.tap_weight[i] * (target.depths[fragments.tap_source[i]] - base)
        else:
            a, b = view.a[v, x], view.b[y]
            total = 0.0
            for k in range(3):
                weights[k] = evaluate(edges, k, a, b)
                total += weights[k]
            sum_x = (edges[0, 0] + edges[1, 0] + edges[2, 0]) / view.fx
            sum_y = -(edges[0, 1] + edges[1, 1] + edges[2, 1]) / view.fy
            for k in range(3):
                weights[k] /= total
                wx[k] = (edges[k, 0] / view.fx - weights[k] * sum_x) / total
                wy[k] = (-edges[k, 1] / view.fy - weights[k] * sum_y) / total
            for j in range(count):
                p, q, r = attributes[triangle, 0, j], attributes[triangle, 1, j], attributes[triangle, 2, j]
                at[j] = weights[0] * p + weights[1] * q + weights[2] * r
                if j < work.derivatives:
                    dx[j] = wx[0] * p + wx[1] * q + wx[2] * r
                    dy[j] = wy[0] * p + wy[1] * q + wy[2] * r
            out[4] = total * (view.near / det)
            before = memory.counts[MISSES]
            shader(work.shader, at, dx, dy, eye, work.uniforms, memory, work.units, out)
            for c in range(4):
                out[c] = min(max(out[c], 0.0), 1.0)
            target.runs[v] += 1
            if with_misses:
                target.misses[v, y, x] += memory.counts[MISSES] - before
        for c in range(4):
            target.colors[n, c] = out[c]
        if work.late:
            target.depths[n] = out[4]
            if not _shown(n, v, x, y, fragments, work, target) or not work.color:
                continue
        if with_map:
            target.how[v, y, x] = APPROXIMATED if fragments.tap_count[n] > 0 else SHADED
        put(out, v, x, y, work.blend, work.weight, target)
        if work.from_buffer:
            for c in range(4):
                target.colors[n, c] = out[c]


shade_fragments = kernel(_shade_fragments)


def shading_with(own_shader: Callable[..., Any]) -> Callable[..., Any]:
    """The same kernel around a shader of one's own, a function that Numba compiles (not kept between runs)."""
    from numba import njit

    compiled = own_shader if hasattr(own_shader, "py_func") else njit(nogil=True, error_model="numpy")(own_shader)

    def called(kind, at, dx, dy, eye, uniforms, memory, units, out):
        compiled(at, dx, dy, eye, uniforms, memory, units, out)

    names = {**globals(), "shader": njit(nogil=True, error_model="numpy")(called)}
    copy = types.FunctionType(_shade_fragments.__code__, names, "shade_fragments_own")
    return njit(nogil=True, error_model="numpy")(copy)
