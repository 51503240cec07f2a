"""Bandwidth predicted by formulas: Hasselgren 2006, section 2, equations (1) to (3)."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError
from .report import Report

EULER = 0.5772156649015329


def overdraw(depth_complexity: float) -> float:
    """o(d) = 1 + 1/2 + … + 1/d (1): how often a pixel is written if d surfaces come in random order.

    Between whole numbers the harmonic numbers are continued by the digamma function.
    """
    from scipy.special import digamma

    if not depth_complexity >= 0:
        raise InputError(f"depth_complexity: expected a number ≥ 0, got {depth_complexity!r}")
    return float(digamma(depth_complexity + 1.0) + EULER)


@dataclass(frozen=True)
class Costs:
    """Bytes of a fragment; T_r is what its shader asks textures for: 32 for one trilinear look-up."""

    z_read: float = 4.0
    z_write: float = 4.0
    c_write: float = 4.0
    t_read: float = 32.0


@dataclass(frozen=True)
class Prediction:
    """Bytes for each pixel of a view: depth B_d, colour B_c, texture B_t."""

    depth: float
    color: float
    texture: float

    def total(self, views: int = 1) -> float:
        """Bytes for a pixel of all views, n·(B_d + B_c + B_t)."""
        return views * (self.depth + self.color + self.texture)


def predict(
    depth_complexity: float, miss_rate: float = 0.25, costs: Costs | None = None, overdrawn: float | None = None
) -> Prediction:
    """Equation (3): B_d = d·Z_r + o·Z_w, B_c = o·C_w, B_t = o·m·T_r.

    Parameters
    ----------
    depth_complexity : float
        d, surfaces that cover a pixel.
    miss_rate : float
        m; Hakura and Gupta found a quarter.
    costs : Costs, optional
    overdrawn : float, optional
        o; None: o(d).
    """
    c = costs or Costs()
    o = overdraw(depth_complexity) if overdrawn is None else overdrawn
    return Prediction(depth_complexity * c.z_read + o * c.z_write, o * c.c_write, o * miss_rate * c.t_read)


def compare(report: Report) -> dict[str, dict[str, float]]:
    """What the formulas say beside what the machine did, in bytes for each pixel of a view.

    "predicted": from the measured d alone, with o(d) and m = 1/4. "measured": the machine's bytes, with all that it
    saves by caches and compression. "fitted": the formulas with measured overdraw and miss rate; its texture term is
    exact.
    """
    pixels = report.views * report.size[0] * report.size[1]
    d, o = float(report.covered.sum() / pixels), float(report.passed.sum() / pixels)
    shaded = max(1, int(report.shaded.sum()))
    costs = Costs(t_read=4.0 * report.counters["texels"] / shaded)
    share = float(report.shaded.sum() / max(1, report.passed.sum()))  # without approximation 1
    first = predict(d, 0.25, costs)
    fitted = predict(d, report.miss_rate * share, costs, o)
    rows = {"predicted": first, "fitted": fitted}
    table = {
        name: {"depth": p.depth, "color": p.color, "texture": p.texture, "overdraw": o, "miss_rate": report.miss_rate}
        for name, p in rows.items()
    }
    table["predicted"] |= {"overdraw": overdraw(d), "miss_rate": 0.25}
    table["measured"] = {
        "depth": report.depth_bytes / pixels, "color": report.color_bytes / pixels,
        "texture": report.texture_bytes / pixels, "overdraw": o, "miss_rate": report.miss_rate,
    }  # fmt: skip
    for row in table.values():
        row["depth_complexity"] = d
        row["total"] = row["depth"] + row["color"] + row["texture"]
    return table
