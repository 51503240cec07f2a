"""Textures, as a specification: mip levels, trilinear filtering, level of detail.

Texture coordinates (0, 0) are the bottom left of the image and repeat; texel i of n has its centre at (i + ½)/n.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def box_weights(size: int) -> Array:
    """Weights (size', size) of the box filter to the next level, size' = max(1, ⌊size/2⌋).

    Each texel of the next level averages the size/size' texels it covers: two where the size is even, else
    also shares of a third (Guthe and Heckbert 2005), so that no level is displaced against the one before.
    """
    smaller = max(1, size // 2)
    edges = np.arange(smaller + 1) * (size / smaller)
    texel = np.arange(size)
    overlap = np.minimum(edges[1:, None], texel + 1) - np.maximum(edges[:-1, None], texel)
    return np.maximum(overlap, 0.0) * (smaller / size)


def mip_levels(texture: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
    """Mip levels of an image (h, w, 3) down to one texel, values 0…1."""
    levels = [(texture / 255.0).astype(np.float32)]
    while levels[-1].shape[:2] != (1, 1):
        h, w, _ = levels[-1].shape
        smaller = np.einsum("yh,xw,hwc->yxc", box_weights(h), box_weights(w), levels[-1], optimize=True)
        levels.append(smaller.astype(np.float32))
    return levels


def bilinear(level: NDArray[np.float32], uv: Array) -> Array:
    """Colours (M, 3) of one mip level (h, w, 3) at texture coordinates (M, 2)."""
    h, w, _ = level.shape
    position = uv * (w, h) - 0.5
    first = np.floor(position).astype(np.int64)
    s, t = (position - first).T[..., None]

    def texel(right: int, up: int) -> Array:
        column = (first[:, 0] + right) % w
        row = h - 1 - (first[:, 1] + up) % h
        return level[row, column].astype(np.float64)

    below = (1 - s) * texel(0, 0) + s * texel(1, 0)
    above = (1 - s) * texel(0, 1) + s * texel(1, 1)
    return (1 - t) * below + t * above


def level_of_detail(levels: list[NDArray[np.float32]], uv_dx: Array, uv_dy: Array) -> Array:
    """Mip level (M,) from the change (M, 2) of texture coordinates per pixel (OpenGL 4.6, 8.14.1).

    λ = log2 ρ, ρ the longer of the two footprint axes in texels of level 0; clamped to the levels there are.
    """
    h, w, _ = levels[0].shape
    rho = np.maximum(np.linalg.norm(uv_dx * (w, h), axis=1), np.linalg.norm(uv_dy * (w, h), axis=1))
    return np.clip(np.log2(np.maximum(rho, 1.0)), 0.0, len(levels) - 1.0)


def trilinear(levels: list[NDArray[np.float32]], uv: Array, detail: Array) -> Array:
    """Colours (M, 3) at texture coordinates (M, 2) and levels of detail (M,)."""
    lower = np.floor(detail).astype(np.int64)
    upper = np.minimum(lower + 1, len(levels) - 1)
    fraction = (detail - lower)[:, None]
    color = np.zeros((len(uv), 3))
    for k, level in enumerate(levels):
        for chosen, share in ((lower == k, 1 - fraction), (upper == k, fraction)):
            color[chosen] += share[chosen] * bilinear(level, uv[chosen])
    return color
