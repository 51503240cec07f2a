"""Which kernels a scene takes: so that one can tell whether they have to be compiled first."""

from __future__ import annotations

from ...scene.scene import Scene
from ..options import Options


def kernels_for(scene: Scene, panel: bool, options: Options) -> tuple[str, ...]:
    """Names of the kernels that draw a scene, to panels or to views; see jit.is_compiled."""
    drawn = [type(item).__name__ for item in scene.objects]
    shared = drawn == ["Volume"] and options.volume == "shared"
    names = {
        "Mesh": ("draw_views", "draw_panel"),
        "Points": ("splat_views", "splat_panel"),
        "Volume": ("draw_shared_rows", "draw_panel_rows") if shared else ("draw_rows", "draw_panel_rays"),
    }
    return tuple(f"{names[kind][panel]}-" for kind in sorted(set(drawn)))  # "-": the whole name
