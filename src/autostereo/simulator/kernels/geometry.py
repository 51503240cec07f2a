"""Triangles in homogeneous space, never clipped (Olano and Greer 1997; Hasselgren 2006, section 5).

The ray of sample (x, y) of the camera at offset v is (a, b, 1) from the eye (v, o_y, 0), with

    a = (x − W/2)/fx − v/focal,    b = (H/2 − y)/fy − o_y/focal.

With Q_k the corners seen from that eye, e_k = (a, b, 1)·(Q_i × Q_j) share one sign inside the triangle, e_k/Σe are the
perspective-correct barycentric coordinates (PBs), and Σe/det is 1/depth. Fill rule: top left.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from .compiling import inlined


class View(NamedTuple):
    """What every kernel knows of the cameras.

    Attributes
    ----------
    width, height : int
    fx, fy, focal, near, offset_y : float
    offsets : ndarray of shape (V,), float64
    a : ndarray of shape (V, W), float64
        Slope of the rays at the centres of columns.
    b : ndarray of shape (H,), float64
    """

    width: int
    height: int
    fx: float
    fy: float
    focal: float
    near: float
    offset_y: float
    offsets: Any
    a: Any
    b: Any


@inlined
def slope_a(view, x, v):
    return (x - view.width / 2) / view.fx - v / view.focal


@inlined
def slope_b(view, y):
    return (view.height / 2 - y) / view.fy - view.offset_y / view.focal


@inlined
def set_edges(view, corners, v, edges):
    """Edge functions of a triangle seen from offset v: edges (3, 3), e_k = edges[k]·(a, b, 1). Returns det."""
    oy = view.offset_y
    x0, y0, d0 = corners[0, 0] - v, corners[0, 1] - oy, corners[0, 2]
    x1, y1, d1 = corners[1, 0] - v, corners[1, 1] - oy, corners[1, 2]
    x2, y2, d2 = corners[2, 0] - v, corners[2, 1] - oy, corners[2, 2]
    edges[0, 0] = y1 * d2 - d1 * y2
    edges[0, 1] = d1 * x2 - x1 * d2
    edges[0, 2] = x1 * y2 - y1 * x2
    edges[1, 0] = y2 * d0 - d2 * y0
    edges[1, 1] = d2 * x0 - x2 * d0
    edges[1, 2] = x2 * y0 - y2 * x0
    edges[2, 0] = y0 * d1 - d0 * y1
    edges[2, 1] = d0 * x1 - x0 * d1
    edges[2, 2] = x0 * y1 - y0 * x1
    return x0 * edges[0, 0] + y0 * edges[0, 1] + d0 * edges[0, 2]


@inlined
def evaluate(edges, k, a, b):
    return edges[k, 0] * a + edges[k, 1] * b + edges[k, 2]


@inlined
def is_inside(e, side, edges, k):
    """Whether a sample with value e is on the inner side of edge k; exactly on it by the top-left rule."""
    if e == 0.0:
        along_x = edges[k, 0]  # ∂e/∂x = n_x/fx, ∂e/∂y = −n_y/fy
        if along_x != 0.0:
            return side * along_x > 0.0
        return side * -edges[k, 1] > 0.0
    return side * e > 0.0
