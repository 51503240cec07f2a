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

from ..errors import InputError
from .appearance import check_number

if TYPE_CHECKING:
    from .transfer import TransferFunction

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2  # on 0…1
THIN = 1e-6  # of an alpha below this, attenuation inside the slab does not change the colour


def preintegrate(
    transfer: TransferFunction, low: float, high: float, size: int, length: float
) -> NDArray[np.float32]:
    """Return the table that `TransferFunction.table` describes."""
    low, high = check_number("table low", low), check_number("table high", high)
    length = check_number("table length", length, 0.0)
    if isinstance(size, bool) or not isinstance(size, (int, np.integer)) or not 2 <= size <= 4096:
        raise InputError(f"table size: expected a whole number 2…4096, got {size!r}")
    if high < low:
        raise InputError(f"table: expected low ≤ high, got {low:g} and {high:g}")
    grid = np.linspace(low, high, size)
    result = transfer.mean(grid[:, None], grid[None, :])
    if length > 0 and high > low:
        emission = _emission(transfer, grid, length)
        alpha = -np.expm1(-result[..., 3] * length)
        thick = alpha > THIN
        result[thick, :3] = np.clip(emission[thick] / alpha[thick, None], 0.0, 1.0)
        diagonal = np.arange(size)
        result[diagonal, diagonal] = transfer.evaluate(grid)
    return result.astype(np.float32)


def _emission(transfer: TransferFunction, grid: NDArray, length: float) -> NDArray[np.float32]:
    """Emission (size, size, 3) of slabs [front, back]; the diagonal is left 0."""
    size = len(grid)
    knots = transfer.points[:, 0]
    edges = np.unique(np.concatenate([grid, knots[(knots > grid[0]) & (knots < grid[-1])]]))
    place = np.searchsorted(edges, grid)  # of the grid's values among the edges
    span = np.arange(1, size)
    rate = length / (grid[span] - grid[0])  # scene units per scalar, for paths over 1, 2, … grid cells
    through, ahead, back = _pieces(transfer, edges, rate)

    # state of the path from grid value i over `span` cells: what is put together so far
    start = np.arange(size)
    valid = span[:, None] + start < size
    row, column = np.nonzero(valid)
    position = place[column]
    count = place[column + span[row]] - position
    t = np.ones(len(row), np.float32)
    e_ahead, e_back = np.zeros((3, len(row)), np.float32), np.zeros((3, len(row)), np.float32)
    step = 1
    while True:
        chosen = np.nonzero(count & step)[0]
        flat = row[chosen] * through.shape[1] + position[chosen]
        t_new = through.ravel()[flat]
        e_ahead[:, chosen] += t[chosen] * ahead.reshape(3, -1)[:, flat]
        e_back[:, chosen] = back.reshape(3, -1)[:, flat] + t_new * e_back[:, chosen]
        t[chosen] *= t_new
        position[chosen] += step
        if 2 * step > count.max():
            break
        near, far = through[:, :-step], through[:, step:]
        ahead = ahead[:, :, :-step] + near * ahead[:, :, step:]
        back = back[:, :, step:] + far * back[:, :, :-step]
        through = near * far
        step *= 2

    result = np.zeros((size, size, 3), np.float32)
    result[column, column + span[row]] = e_ahead.T
    result[column + span[row], column] = e_back.T
    return result


def _pieces(
    transfer: TransferFunction, edges: NDArray, rate: NDArray
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Transmittance (M, n) of the n pieces between edges at M rates, and emission (3, M, n) seen from either end."""
    first, last = transfer._limit(edges[:-1], "right"), transfer._limit(edges[1:], "left")
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
