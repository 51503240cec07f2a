"""Which kernels a scene takes: so that one can tell whether they have to be compiled first."""

from __future__ import annotations

from ...scene.scene import Scene
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


def kernels_for(scene: Scene, viewmap: ViewMap | None, options: Options) -> tuple[str, ...]:
    """Names of the kernels that draw a scene to a panel, or to views if there is no view map; see jit.is_compiled."""
    drawn = [type(item).__name__ for item in scene.objects]
    volume = ("draw_rows", "draw_panel_rays")
    if drawn == ["Volume"] and options.volume == "shared":
        woven = viewmap is not None and is_woven(viewmap, options)
        joined = viewmap is not None and is_joined(viewmap, options)
        volume = ("draw_shared_rows", volume[1] if joined else "draw_woven_rows" if woven else "draw_panel_rows")
    names = {
        "Mesh": ("draw_views", "draw_panel"),
        "Points": ("splat_views", "splat_panel"),
        "Volume": volume,
    }
    return tuple(f"{names[kind][viewmap is not None]}-" for kind in sorted(set(drawn)))  # "-": the whole name
