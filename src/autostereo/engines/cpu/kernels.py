"""Which kernels a scene takes: so that one can tell whether they have to be compiled first."""

from __future__ import annotations

from ...scene.scene import Scene
from ...scene.volume import Volume
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


def kernels_for(
    scene: Scene, viewmap: ViewMap | None, options: Options, method: str = "single-pass", views: int = 2
) -> tuple[str, ...]:
    """Names of the kernels that draw a scene to a panel, or to views if there is no view map; see jit.is_compiled."""
    from .volume_setup import face_range, is_sharp

    panel = viewmap if method == "single-pass" else None
    together = method == "single-pass" and (views > 1 or panel is not None)
    kinds = {type(item).__name__ for item in scene.objects}
    names = {"draw_views" if panel is None else "draw_panel"} if "Mesh" in kinds else set()
    if "Points" in kinds:
        names.add("splat_views" if panel is None else "splat_panel")
    volumes = [item for item in scene.objects if isinstance(item, Volume)]
    modes = [item.mode for item in volumes]
    depth = kinds != {"Volume"} or "iso" in modes or method == "dibr" or (options.depth and panel is None)
    joined = panel is not None and is_joined(panel, options)
    if options.volume == "shared" and modes.count("composite") == 1 and together and not depth and not joined:
        volume = volumes[modes.index("composite")]
        sharp = is_sharp(volume, face_range(volume))
        if panel is None or not sharp:
            modes.remove("composite")
            woven = panel is not None and is_woven(panel, options)
            names.add("draw_shared_rows" if panel is None else "draw_woven_rows" if woven else "draw_panel_rows")
            if sharp:
                names.add("draw_edges")
    if modes:
        names.add("draw_rows" if panel is None else "draw_panel_rays")
    if method == "dibr":
        names.add("warp_rows")
    return tuple(f"{name}-" for name in sorted(names))  # "-": the whole name
