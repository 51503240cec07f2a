"""What the rasteriser is told, what it keeps, and the list of fragments that it hands to shading."""

from __future__ import annotations

from typing import Any, NamedTuple

IN_TURN, AXIS, DOT, UNSIGNED = range(4)  # Plan.order
LESS, EQUAL = range(2)  # Plan.depth_test
COVERED, PASSED, REUSED = range(3)  # columns of Fragments.of_view
TILES, CULLED, ROWS, HORIZON = range(4)  # Fragments.totals
COUNT, TAPS, TRIANGLE, ROW, BASE = range(5)  # Fragments.cursor
MAX_TAPS = 8
Z_SCALE = 4294967296.0
Z_MAX = 4294967295.0


class Plan(NamedTuple):
    """What the machine does, for one pass over the scene; views first … last − 1."""

    tile_w: int
    tile_h: int
    order: int
    first: int
    last: int
    z_max: bool
    z_min: bool
    depth_test: int
    depth_write: bool
    late: bool  # shaders give the depths: all that is covered is listed, and tested when it has been shaded
    approximate: bool
    group: Any  # (V,) int64: the set of each view
    exact: Any  # (groups,) int64: its exact view; −1: the one in which the triangle is largest
    entries: int  # tiles in the shader output cache
    tent: bool  # the filter of higher quality
    lone: bool  # a single neighbour is used
    from_buffer: bool  # the colour buffer's cache serves as output cache


class Fragments(NamedTuple):
    """What passed the depth test, in order (capacity N), and where to resume.

    Attributes
    ----------
    triangle, camera, x, y : ndarray of shape (N,), int32
        The camera is the number of the view.
    tap_first, tap_count : ndarray of shape (N,), int32
        Which taps make an approximated fragment; no taps: it is to be shaded.
    tap_source : ndarray of shape (8·N,), int32
        Fragments of this list.
    tap_weight : ndarray of shape (8·N,), float32
    cursor : ndarray of shape (5,), int64
    of_view : ndarray of shape (V, 3), int64
    totals : ndarray of shape (4,), int64
    """

    triangle: Any
    camera: Any
    x: Any
    y: Any
    tap_first: Any
    tap_count: Any
    tap_source: Any
    tap_weight: Any
    cursor: Any
    of_view: Any
    totals: Any


class Scratch(NamedTuple):
    """The rasteriser's own memory.

    Attributes
    ----------
    edges : ndarray of shape (V, 3, 3)
    det, measure : ndarray of shape (V,)
    side, left, right : ndarray of shape (V,), int64
    exact : ndarray of shape (groups,), int64
        The present triangle's exact views.
    entry : ndarray of shape (groups, tile_h, W), int32
        Shader output cache: the fragment at each pixel of the row of tiles; −1 none.
    stamp : ndarray of shape (groups, tiles), int64
        When a tile was allocated in it.
    clock : ndarray of shape (groups,), int64
    polygon : ndarray of shape (4, 3)
    since : ndarray of shape (blocks of colour,), int64
        With `from_buffer`: the first fragment since the block came into the cache.
    """

    edges: Any
    det: Any
    measure: Any
    side: Any
    left: Any
    right: Any
    exact: Any
    entry: Any
    stamp: Any
    clock: Any
    polygon: Any
    since: Any
