"""Options: every switch of a render, validated in one place."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import FARTHEST, check_number
from ..errors import InputError

CHOICES: dict[str, tuple[object, ...]] = {
    "shading": ("exact", "center", "reuse"),
    "lighting": ("sample", "vertex"),
    "sampling": ("pixel", "subpixel"),
    "samples": (1, 4, 16, 64),
    "depth": (False, True),
    "alpha": ("exact", "averaged", "minimal"),
    "volume": ("shared", "exact"),
    "proxy": ("march", "slices"),
}


@dataclass(frozen=True)
class Options:
    """Switches of a render.

    Parameters
    ----------
    shading : {"exact", "center", "reuse"}
        Shade every sample for its own eye, for the centre eye, or reuse the colour of a nearby view
        (Hasselgren 2006, section 4.3).
    lighting : {"sample", "vertex"}
        Light every sample, or light vertices (for the centre eye) and interpolate.
    sampling : {"pixel", "subpixel"}
        Panels: sample the scene at the pixel's centre or at the sub-pixel's own centre.
    samples : {1, 4, 16, 64}
        Samples per pixel, on a regular grid.
    depth : bool
        Also return eye depth (view stacks only).
    alpha : {"exact", "averaged", "minimal"}
        Panels in a single pass, for comparison with 2007's hardware, which had one opacity and one depth for the three
        sub-pixels of a pixel (Hübner 2007b, section 3.6). "averaged": volumes' opacities, and the depths of triangles
        and points drawn by `covering-quad`, are the mean of the three; "minimal": those depths are the least.
    volume, step
        For volumes.
    views_per_pass : int, optional
        Method geometry-shader: views that one pass draws; None: as many as the device can.
    small_size : (int, int), optional
        Method n-pass-subres: width and height of its small views, at most the panel's; None: the panel's, each
        divided by √V, so that all views have as many pixels as the panel.
    groups : int
        Points by `covering-quad` on the OpenGL engine with an `alpha` that is not "exact": drawn once, in so many
        groups that each keep the nearest (Hübner 2007b, section 3.5.2). More lose fewer points; each costs a tile of
        memory the size of the panel, and time to blend it.
    aperture : float
        Views: side of a square lens, world units; 0 is a pinhole. What lies in the focal plane is in focus.
    lens : (int, int)
        Samples of that lens, columns and rows, 1 … 64.
    references : int
        Method dibr: how many of the views are drawn; the others are warped from them.
    proxy : {"march", "slices"}
        Volumes on the OpenGL engine: a ray march, or view-aligned slices blended back to front (Hübner 2007a).
    """

    shading: str = "exact"
    lighting: str = "sample"
    sampling: str = "pixel"
    samples: int = 1
    depth: bool = False
    alpha: str = "exact"
    volume: str = "shared"
    step: float = 1.0
    views_per_pass: int | None = None
    small_size: tuple[int, int] | None = None
    groups: int = 8
    references: int = 2
    proxy: str = "march"
    aperture: float = 0.0
    lens: tuple[int, int] = (4, 4)

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            value = getattr(self, name)
            if not any(value == c and type(value) is type(c) for c in choices):
                wanted = ", ".join(repr(c) for c in choices)
                raise InputError(f"options {name}: expected one of {wanted}, got {value!r}")
        if isinstance(self.step, bool) or not isinstance(self.step, (int, float)) or not 0 < self.step < 1e6:
            raise InputError(f"options step: expected a number > 0, got {self.step!r}")
        check_number("options aperture", self.aperture, 0.0, FARTHEST)
        lens = self.lens
        whole = isinstance(lens, tuple) and len(lens) == 2 and all(type(n) is int and 1 <= n <= 64 for n in lens)
        if not whole:
            raise InputError(f"options lens: expected two whole numbers from 1 to 64, got {lens!r}")
        small = self.small_size
        if small is not None and not (isinstance(small, tuple) and len(small) == 2 and all(map(is_count, small))):
            raise InputError(f"options small_size: expected two whole numbers ≥ 1, got {small!r}")
        if self.aperture and self.depth:
            raise InputError("options depth: means through a lens of some aperture have no one depth")
        for name in ("views_per_pass", "groups", "references"):
            value = getattr(self, name)
            if name == "views_per_pass" and value is None:
                continue
            if not is_count(value):
                raise InputError(f"options {name}: expected a whole number ≥ 1, got {value!r}")


def is_count(value: object) -> bool:
    """Whether it is a whole number ≥ 1."""
    return type(value) is int and value >= 1
