"""Masks as view maps: which view each sub-pixel shows (DESIGN section 3).

Row r counts from the top, column x from the left, channel c ∈ {0, 1, 2}; s = 3x + c is the sub-pixel index.
Rational masks are tables: evaluated as floats, a third of the sub-pixels of a slanted table come out wrong.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..checks import check_choice, check_number, check_views, real_array
from ..errors import InputError
from ..viewmap import ViewMap

PITCHES = ("pixel", "subpixel")
WAVELENGTH_VIEWS = 8
MAX_SIZE = 32768  # pixels a side


def check_size(name: str, value: Any) -> int:
    """Return `value` as a whole number of pixels, or raise InputError."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or not 1 <= value <= MAX_SIZE:
        raise InputError(f"{name}: expected a whole number of pixels 1…{MAX_SIZE}, got {value!r}")
    return int(value)


def check_flag(name: str, value: Any) -> bool:
    """Return `value` as a bool, or raise InputError."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name}: expected True or False, got {value!r}")
    return bool(value)


def lenticular(views: int, per: str) -> ViewMap:
    """Lenses along the columns: view = x mod V per pixel, s mod V per sub-pixel (de Sorbier 2008, Fig. 4a)."""
    views = check_views(views)
    if check_choice("per", per, PITCHES) == "subpixel":
        return sloped(views, 1, 0)
    return ViewMap(views, np.repeat(np.arange(views)[None, :, None], 3, axis=2))


def sloped(views: int, step: int, row_step: int) -> ViewMap:
    """Table view = (step·s − row_step·r) mod V, the rational slanted masks.

    V = 6, step 2, row_step 1 is de Sorbier 2008, Fig. 4b; 8, 1, 1 is Alioscopy (displays.md 3.3); 9, 2, 1 has the
    lens of 4½ sub-pixels at tan α = 1/6 of van Berkel 1999.
    """
    views = check_views(views)
    for name, value in (("step", step), ("row_step", row_step)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or abs(value) > 4096:
            raise InputError(f"{name}: expected a whole number, got {value!r}")
    w = views // math.gcd(3 * int(step), views)
    h = views // math.gcd(int(row_step), views)
    r, x, c = np.ogrid[:h, :w, :3]
    return ViewMap(views, (step * (3 * x + c) - row_step * r) % views)


def wavelength_selective() -> ViewMap:
    """Wavelength-selective filter array of 8 views, period 8×12 (Hübner 2007b, equations 4–6, as corrected).

    The printed shader counts fragments from the bottom at half-integer positions; here x and r are whole and r counts
    from the top (DESIGN, erratum 4).
    """
    r, x, c = np.ogrid[:12, :8, :3]
    y_offset = (r + 1) % 12
    return ViewMap(WAVELENGTH_VIEWS, ((1 + y_offset + y_offset // 3) // 2 + 3 * x % 8 + c) % 8)


def slanted(
    views: int, lens_pitch: float, subpixel_pitch: float, slant_deg: float, phase: float, continuous: bool
) -> ViewMap:
    """Physical slanted lenticular: φ = frac((3x + c − 3r·tan α)/L + phase), L = p_u/(p_h·cos α).

    PMR 2020, equations 14–15; van Berkel 1999. Square pixels are assumed.
    """
    views = check_views(views)
    p_u = check_number("lens_pitch", lens_pitch, 1e-9, 1e9)
    p_h = check_number("subpixel_pitch", subpixel_pitch, 1e-9, 1e9)
    alpha = math.radians(check_number("slant_deg", slant_deg, -89.9, 89.9))
    start = check_number("phase", phase, -1e6, 1e6)
    period = p_u / (p_h * math.cos(alpha))
    if not 1e-3 < period < 1e9:
        raise InputError(f"lens_pitch/subpixel_pitch: one lens covers {period:g} sub-pixels, expected 0.001…1e9")
    offsets = np.array([[c / period + start for c in range(3)]])
    return ViewMap(
        views,
        a=3 / period,
        b=-3 * math.tan(alpha) / period,
        offsets=offsets,
        continuous=check_flag("continuous", continuous),
    )


def table(views: int, values: Any) -> ViewMap:
    """View map of a user's table (h, w, 3) of view indices, repeated over the panel."""
    views = check_views(views)
    return ViewMap(views, real_array("table", values, "an array of integers of shape (h, w, 3)"))


TWO_VIEW_TABLES: dict[str, list[list[int]]] = {  # (h, w): 0 is the left eye's picture
    "row-interleaved": [[0], [1]],
    "column-interleaved": [[0, 1]],
    "checkerboard": [[0, 1], [1, 0]],
}


def two_view(layout: str) -> ViewMap:
    """Row interleaved, column interleaved or checkerboard, the left eye first."""
    return ViewMap(2, np.repeat(np.array(TWO_VIEW_TABLES[layout])[:, :, None], 3, axis=2))
