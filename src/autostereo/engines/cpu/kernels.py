"""Which kernels draw a panel, by its view map and the options."""

from __future__ import annotations

from ...viewmap import ViewMap
from ..options import Options

WOVEN_VIEWS = 12  # of a panel; with more it is cheaper to look up every sub-pixel by itself


def is_joined(viewmap: ViewMap, options: Options) -> bool:
    """Whether a pixel's three sub-pixels share their ray: a view's worth of rays, so that exact ones cost no more."""
    return viewmap.per_pixel and options.sampling == "pixel"


def is_woven(viewmap: ViewMap, options: Options) -> bool:
    """Whether sub-pixels are picked from lines of the panel's few views, where volumes share slabs."""
    few = viewmap.views <= WOVEN_VIEWS and not viewmap.continuous
    return few and options.sampling == "pixel" and options.alpha == "exact"
