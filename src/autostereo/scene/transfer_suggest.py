"""A transfer function for data that nothing is known about."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..checks import check_number
from ..errors import InputError

SIDE = 96  # voxels along an axis that are looked at
OPACITY = 0.75  # mean over the axis-parallel rays that meet something

# part of the way from the background to the greatest values, r, g, b, relative opacity
RAMP = (
    (0.0, 0.20, 0.38, 0.80, 0.0),
    (0.15, 0.30, 0.65, 0.85, 0.02),
    (0.4, 1.00, 0.80, 0.45, 0.12),
    (0.65, 1.00, 0.55, 0.30, 0.45),
    (1.0, 1.00, 0.95, 0.88, 1.0),
)


def suggest_points(values: NDArray, diagonal: float | None) -> NDArray[np.float64]:
    """Return points (K, 5): a colour ramp from the end of the background's peak to the greatest values.

    Opacity is scaled so that rays along the three axes which meet anything are `OPACITY` opaque on average.
    """
    if values.ndim != 3 or values.size == 0 or values.dtype.kind not in "biuf":
        raise InputError(f"values: expected numbers of shape (nz, ny, nx), got {values.dtype} {values.shape}")
    low, high = float(values.min()), float(values.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        raise InputError("values: expected finite numbers, found NaN or infinity")
    lattice = float(np.linalg.norm(np.asarray(values.shape) - 1.0)) or 1.0
    diagonal = lattice if diagonal is None else check_number("diagonal", diagonal, np.finfo(float).tiny)
    if high - low <= 512 * np.spacing(max(abs(low), abs(high))):  # no room for the edges of a histogram
        return np.array([(low, 0.8, 0.8, 0.8, 1 / diagonal)])
    stride = [max(1, -(-n // SIDE)) for n in values.shape]
    sample = values[:: stride[0], :: stride[1], :: stride[2]].astype(np.float64)
    start, top = _foreground(sample, low, high)
    points = np.array(RAMP)
    relative = np.interp(sample, start + points[:, 0] * (top - start), points[:, 4])
    step = diagonal / lattice
    depth = np.concatenate([(relative.sum(axis=a) * (stride[a] * step)).ravel() for a in range(3)])
    points[:, 0] = start + points[:, 0] * (top - start)
    points[:, 4] *= _scale(depth[depth > 0], diagonal)
    if start > low:
        points = np.concatenate([[(low, *points[0, 1:])], points])
    return points


def _foreground(sample: NDArray[np.float64], low: float, high: float) -> tuple[float, float]:
    """Where the background's peak of the histogram ends, and the value that few voxels exceed."""
    counts, edges = np.histogram(sample, 256, range=(low, high))
    # the background is the tallest peak of the lower half, if it holds a good part of the voxels
    peak = int(np.argmax(counts[:128]))
    end = peak
    while end < 254 and counts[end] > 0.02 * counts[peak]:
        end += 1
    begin = peak
    while begin > 0 and counts[begin - 1] > 0.02 * counts[peak]:
        begin -= 1
    start = low
    if counts[begin:end].sum() > 0.1 * sample.size and end < 128:
        start = float(edges[end])
    elif counts[peak] > 0.1 * sample.size:  # a spike within other values, such as a mask's zero
        start = float(edges[peak + 1])
    above = sample[sample > start]
    top = float(np.quantile(above, 0.995)) if above.size else high
    return start, top if top > start else high


def _scale(depth: NDArray[np.float64], diagonal: float) -> float:
    """The factor k for which the mean of 1 − exp(−k·depth) is `OPACITY`."""
    if depth.size == 0:
        return 100.0 / diagonal  # what there is lies between the voxels looked at: few and thin
    low, high = -60.0, 60.0  # of log(k·mean depth)
    for _ in range(60):
        middle = (low + high) / 2
        opacity = -np.expm1(-np.exp(middle) * (depth / depth.mean())).mean()
        low, high = (middle, high) if opacity < OPACITY else (low, middle)
    return float(np.exp(low) / depth.mean())
