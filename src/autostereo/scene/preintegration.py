"""2-D pre-integration tables with attenuation inside the slab.

A path from scalar f to scalar b is cut at the table's grid and at the transfer function's points; on each piece
colour and extinction are linear. The pieces of all paths of one scalar width are the same (only their optical depth
per scalar depends on that width), and two stretches of path compose to one: T = T₁T₂, E = E₁ + T₁E₂. So stretches of
1, 2, 4, … pieces are made by doubling, and every path is put together from one of each, as its count of pieces says.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..checks import LARGEST, check_number
from ..errors import InputError

if TYPE_CHECKING:
    from .transfer import TransferFunction

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2  # on 0…1
THIN = 1e-6  # of an alpha below this, attenuation inside the slab does not change the colour


def preintegrate(
    transfer: TransferFunction, low: float, high: float, size: int, length: float
) -> NDArray[np.float32]:
    """Return the table that `TransferFunction.table` describes."""
    low, high = check_number("table low", low, -LARGEST, LARGEST), check_number("table high", high, -LARGEST, LARGEST)
    length = check_number("table length", length, 0.0, LARGEST)
    if isinstance(size, bool) or not isinstance(size, (int, np.integer)) or not 2 <= size <= 4096:
        raise InputError(f"table size: expected a whole number 2…4096, got {size!r}")
    if high < low:
        raise InputError(f"table: expected low ≤ high, got {low:g} and {high:g}")
    grid = np.linspace(low, high, size)
    cells, first = np.nonzero(np.arange(size - 1)[:, None] + np.arange(1, size) < size)
    cells += 1
    last = first + cells  # a path leads from grid value `first` over `cells` cells, or back
    mean = transfer.mean(grid[first], grid[last]).astype(np.float32)
    table = np.empty((size, size, 4), np.float32)
    table[first, last] = table[last, first] = mean
    table[np.arange(size), np.arange(size)] = transfer.evaluate(grid)
    alpha = -np.expm1(-mean[:, 3] * np.float32(length))
    thick = np.nonzero(alpha > THIN)[0]
    if high > low and len(thick):
        first, last = first[thick], last[thick]
        with np.errstate(over="ignore"):  # an infinite optical depth is opaque
            ahead, back = _emission(transfer, grid, length, (first, cells[thick])) / alpha[thick]
        table[first, last, :3] = np.clip(ahead.T, 0.0, 1.0)
        table[last, first, :3] = np.clip(back.T, 0.0, 1.0)
    return table


def _emission(
    transfer: TransferFunction, grid: NDArray, length: float, paths: tuple[NDArray, NDArray]
) -> NDArray[np.float32]:
    """Emission (2, 3, P) of P paths (grid index of the lower end, cells), seen from the lower and the upper end."""
    first, cells = paths
    knots = transfer.points[:, 0]
    edges = np.unique(np.concatenate([grid, knots[(knots > grid[0]) & (knots < grid[-1])]]))
    place = np.searchsorted(edges, grid)  # of the grid's values among the edges
    rate = length / (grid[1:] - grid[0])  # scene units per scalar, for paths over 1, 2, … cells
    through, ahead, back = _pieces(transfer, edges, rate)

    # what is put together so far of each path
    position = place[first]
    count = place[first + cells] - position
    t = np.ones(len(first), np.float32)
    done = np.zeros((2, 3, len(first)), np.float32)
    step = 1
    while True:
        now = np.nonzero(count & step)[0]
        flat = (cells[now] - 1) * through.shape[1] + position[now]
        t_new = through.ravel()[flat]
        done[0][:, now] += t[now] * ahead.reshape(3, -1)[:, flat]
        done[1][:, now] = back.reshape(3, -1)[:, flat] + t_new * done[1][:, now]
        t[now] *= t_new
        position[now] += step
        if 2 * step > count.max():
            return done
        near, far = through[:, :-step], through[:, step:]
        ahead = ahead[:, :, :-step] + near * ahead[:, :, step:]
        back = back[:, :, step:] + far * back[:, :, :-step]
        through = near * far
        step *= 2


def _pieces(
    transfer: TransferFunction, edges: NDArray, rate: NDArray
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Transmittance (M, n) of the n pieces between edges at M rates, and emission (3, M, n) seen from either end."""
    first, last = transfer.limit(edges[:-1], "right"), transfer.limit(edges[1:], "left")
    measure = (rate[:, None] * np.diff(edges)).astype(np.float32)  # length of the path in each piece
    tau_first, tau_last = first[:, 3].astype(np.float32), last[:, 3].astype(np.float32)
    alpha = -np.expm1(-measure * (tau_first + tau_last) / 2)
    emission = []
    for a, b, tau_a, tau_b in ((first, last, tau_first, tau_last), (last, first, tau_last, tau_first)):
        # ∫ x dα(x) over the piece, x from 0 to 1: colour is linear in x
        moment = alpha.copy()
        for x, weight in zip(NODES.astype(np.float32), WEIGHTS.astype(np.float32), strict=True):
            moment += weight * np.expm1(-measure * (tau_a * x + (tau_b - tau_a) * (x * x / 2)))
        c_a, c_b = a[:, :3].T.astype(np.float32), b[:, :3].T.astype(np.float32)
        emission.append(c_a[:, None] * alpha + (c_b - c_a)[:, None] * moment)
    return 1 - alpha, emission[0], emission[1]
