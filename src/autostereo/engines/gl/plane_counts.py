"""How many multiplications the plane rasteriser does, counted while its formulas run (PMR 2020, section 3).

The paper has 38·m·n multiplications for n views of a triangle of m pixels view by view, and 30·m + 8·m·n in one pass.
Here the formulas of lib/plane_triangle.glsl, lib/plane_tile.glsl and plane_setup.comp run on numbers that count.
A division counts as a multiplication.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Number = Any  # a float, or one that counts


@dataclass
class Tally:
    """Multiplications so far."""

    count: int = 0


@dataclass(frozen=True)
class Counted:
    """A number whose products are counted."""

    value: float
    tally: Tally

    def __add__(self, other: Number) -> Counted:
        return Counted(self.value + _value(other), self.tally)

    def __sub__(self, other: Number) -> Counted:
        return Counted(self.value - _value(other), self.tally)

    def __mul__(self, other: Number) -> Counted:
        self.tally.count += 1
        return Counted(self.value * _value(other), self.tally)

    def __truediv__(self, other: Number) -> Counted:
        self.tally.count += 1
        return Counted(self.value / _value(other), self.tally)


def _value(number: Number) -> float:
    return number.value if isinstance(number, Counted) else float(number)


Corner = tuple[Number, Number, Number, Number]  # column at offset 0, row, change per offset, window depth


def projected(point: Sequence[Number], lens: tuple[float, float, float]) -> Corner:
    """A corner in pixels of an eye-space point; lens: fx, fy, 1/focal distance (plane_setup.comp: projected)."""
    x, y, d = point
    inverse = Counted(1.0, d.tally) / d
    return x * lens[0] * inverse, y * -lens[1] * inverse, (Counted(lens[2], d.tally) - inverse) * lens[0], inverse


def samples_of(corners: Sequence[Corner], offset: float, attributes: int) -> int:
    """Draw one view of a triangle at its samples; returns how many it covers."""
    tally = corners[0][0].tally
    columns = [x + p * offset for x, _, p, _ in corners]
    rows = [y for _, y, _, _ in corners]
    edges = [(i, j) for i, j in ((1, 2), (2, 0), (0, 1))]
    a = [n[1] - n[0] for n in (columns, rows, [c[3] for c in corners])]
    b = [n[2] - n[0] for n in (columns, rows, [c[3] for c in corners])]
    area = a[0] * b[1] - b[0] * a[1]
    right, down = (a[2] * b[1] - b[2] * a[1]) / area, (a[0] * b[2] - b[0] * a[2]) / area
    covered = 0
    ys, xs = [_value(y) for y in rows], [_value(x) for x in columns]
    for r in range(int(min(ys)) - 1, int(max(ys)) + 1):
        y = Counted(r + 0.5, tally)
        falls = [(columns[j] - columns[i]) * (y - rows[i]) for i, j in edges]
        for c in range(int(min(xs)) - 1, int(max(xs)) + 1):
            x = Counted(c + 0.5, tally)
            e = [(rows[i] - rows[j]) * (x - columns[i]) + fall for (i, j), fall in zip(edges, falls, strict=True)]
            if not (all(v.value > 0 for v in e) or all(v.value < 0 for v in e)):
                continue
            covered += 1
            _ = right * (x - columns[0]) + down * (y - rows[0])  # depth
            near = [v * corner[3] for v, corner in zip(e, corners, strict=True)]  # perspective-correct weights
            total = Counted(1.0, tally) / (near[0] + near[1] + near[2])
            weights = [n * total for n in near]
            for _ in range(attributes):
                _ = weights[0] * 0.5 + weights[1] * 0.5 + weights[2] * 0.5
    return covered


def multiplications(
    triangle: Sequence[Sequence[float]], offsets: Sequence[float], lens: tuple[float, float, float], attributes: int = 9
) -> tuple[int, int, int]:
    """Multiplications of drawing a triangle in all views.

    Parameters
    ----------
    triangle : three corners (X, Y, d) in eye space
    offsets : camera offsets of the views
    lens : fx, fy in pixels, 1/focal distance
    attributes : numbers that are interpolated; 9: colour, normal, position

    Returns
    -------
    (view by view, in one pass, samples covered in all views) : int
    """

    def corners(tally: Tally) -> list[Corner]:
        return [projected([Counted(v, tally) for v in point], lens) for point in triangle]

    many, one, covered = Tally(), Tally(), 0
    for offset in offsets:
        samples_of(corners(many), offset, attributes)
    shared = corners(one)
    for offset in offsets:
        covered += samples_of(shared, offset, attributes)
    return many.count, one.count, covered
