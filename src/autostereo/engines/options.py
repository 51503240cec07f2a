"""Options: every switch of a render, validated in one place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import FARTHEST, check_count, check_counts, check_number, shown
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
        Method geometry-shader: most views that one pass draws; fewer where the device can do no more, and None: as
        many as it can.
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
        put = object.__setattr__
        for name, choices in CHOICES.items():
            put(self, name, _choice(name, getattr(self, name), choices))
        step = check_number("options step", self.step)
        if not 0 < step < 1e6:
            raise InputError(f"options step: expected a number > 0 (and < 1e6), got {self.step!r}")
        put(self, "step", step)
        put(self, "aperture", check_number("options aperture", self.aperture, 0.0, FARTHEST))
        put(self, "lens", check_counts("options lens", self.lens, 64))
        if self.small_size is not None:
            put(self, "small_size", check_counts("options small_size", self.small_size))
        if self.aperture and self.depth:
            raise InputError("options depth: means through a lens of some aperture have no one depth")
        for name in ("views_per_pass", "groups", "references"):
            if name != "views_per_pass" or self.views_per_pass is not None:
                put(self, name, check_count(f"options {name}", getattr(self, name)))


def _choice(name: str, value: object, choices: tuple[object, ...]) -> object:
    """Return the choice that a value is, whichever type of NumPy's it has, or raise InputError."""
    kinds = {bool: (bool, np.bool_), int: (int, np.integer), str: (str,)}
    for choice in choices:
        flag_for_number = isinstance(value, bool) and not isinstance(choice, bool)
        if isinstance(value, kinds[type(choice)]) and not flag_for_number and value == choice:
            return choice
    raise InputError(f"options {name}: expected one of {', '.join(map(repr, choices))}, got {shown(value)}")
