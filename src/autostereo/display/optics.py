"""Optics of `observe`: which phase of the mask an eye in front of the panel selects.

Phases here are those of `ViewMap.phase`, after its reversal: they count zones from left to right as the viewer sees
them, 0…1 over the cone. An eye at (X, Z) selects at panel position x_p (mm, from the centre, to the viewer's right)

    parallel zones               f = ½ + (X − x_p)/(2·Z·tan(cone/2))
    zones that meet at D         f = ½ + (x_p + (X − x_p)·D/Z)/(2·D·tan(cone/2))

where 2·D·tan(cone/2) = V · zone width at D, and φ = frac(f): beyond the cone the zones repeat. D → ∞ gives the first
form. The view at camera coordinate u has φ = (u + ½)/V over the whole panel, as seen by an eye at infinity, or at D.

What a viewer sees of a panel with `flip_x` is its mirror image: column x stands at the place of column W − 1 − x.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import check_number, check_pair
from ..errors import InputError, UnsupportedError
from ..wording import an
from .display import Display


def wanted_phase(
    display: Display, *, view: float | None = None, eye: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Phase that an eye selects at each column and channel of the panel.

    Parameters
    ----------
    display : Display
        With a mask.
    view : float
        Camera coordinate u of the zone the eye is in; −½…V − ½, zones repeat beyond.
    eye : (float, float)
        Or its place instead: X to the right of the panel's centre and Z > 0 in front of it, mm. Needs `size_mm`.

    Returns
    -------
    ndarray of shape (W, 3), float64, in [0, 1)
        Compare with `ViewMap.phase`, or (view + ½)/V for a table.
    """
    if display.viewmap is None:
        raise UnsupportedError(f"{display.name}: {an(display.layout)} picture has no zones to look from")
    if (view is None) == (eye is None):
        raise InputError("observe: expected either view (a camera coordinate) or eye (x, z in mm)")
    if view is not None:
        phase = (check_number("view", view, -1e6, 1e6) + 0.5) / display.views
        return np.full((display.width, 3), _fraction(np.float64(phase)))
    return _fraction(zone_coordinate(display, eye))


def zone_coordinate(display: Display, eye: Any) -> NDArray[np.float64]:
    """Zone coordinate f (W, 3) that an eye at (X, Z) mm selects, 0…1 in the central cone (DESIGN section 5)."""
    x, z = check_pair("eye", eye, "(x, z) in mm")
    x_eye, z_eye = check_number("eye x", x, -1e9, 1e9), check_number("eye z", z, 1e-3, 1e9)
    slope = (x_eye - column_mm(display)) / z_eye
    if display.distance_mm is not None:
        slope = slope + column_mm(display) / display.distance_mm
    return 0.5 + slope / (2 * math.tan(math.radians(display.cone_deg) / 2))


def column_mm(display: Display) -> NDArray[np.float64]:
    """Where the viewer sees each sub-pixel, shape (W, 3): mm to the right of the panel's centre. RGB stripes."""
    if display.size_mm is None:
        raise InputError(f"eye: {display.name} has no size; give it one with .physical(size_mm=(width, height))")
    s = np.arange(3 * display.width).reshape(display.width, 3)
    x = ((s + 0.5) / (3 * display.width) - 0.5) * display.size_mm[0]
    return -x if display.flip_x else x


def eye_at(display: Display, view: float, z: float | None = None) -> tuple[float, float]:
    """Place (X, Z) mm from which the panel's centre shows camera coordinate `view`.

    Z None: where the zones meet, or three panel diagonals for parallel zones.
    """
    u = check_number("view", view, -1e6, 1e6)
    if z is None:
        if display.distance_mm is None and display.size_mm is None:
            raise InputError(f"eye: {display.name} has no size; give it one with .physical(size_mm=(width, height))")
        z = display.distance_mm or 3 * math.hypot(*(display.size_mm or (0.0, 0.0)))
    z = check_number("eye z", z, 1e-3, 1e9)
    return ((2 * (u + 0.5) / display.views - 1) * math.tan(math.radians(display.cone_deg) / 2) * z, z)


def _fraction(value: Any) -> Any:
    phi = value - np.floor(value)
    return np.where(phi >= 1.0, 0.0, phi)  # −1e-17 rounds to 1
