"""Procedural scenes with a camera path of 200 frames, after those of Hasselgren 2006, section 6; SCENES lists them.

Views are a fixed distance apart, so that more views see more of the scene, as in the paper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...display.rig import Rig
from ..workload import Workload
from . import atrium, level, ocean, relief, soft_shadows

FRAMES = 200


@dataclass(frozen=True)
class AnimatedScene:
    """A scene in motion.

    Attributes
    ----------
    name : str
    spacing : float
        Distance of neighbouring cameras, world units.
    frame : callable
        (frame number 0 … 199) → (Workload, Rig of one view).
    """

    name: str
    spacing: float
    frame: Callable[[int], tuple[Workload, Rig]]

    def at(self, number: int, views: int) -> tuple[Workload, Rig]:
        """One frame, seen by so many views."""
        workload, rig = self.frame(number)
        fields = {name: getattr(rig, name) for name in ("position", "target", "fov_y", "focal_distance", "near")}
        return workload, Rig(**fields, views=views, baseline=self.spacing * (views - 1))


SCENES = {
    "level": AnimatedScene("level", 0.03, level.frame),
    "soft-shadows": AnimatedScene("soft-shadows", 0.03, soft_shadows.frame),
    "ocean": AnimatedScene("ocean", 0.15, ocean.frame),
    "atrium": AnimatedScene("atrium", 0.03, atrium.frame),
    "relief": AnimatedScene("relief", 0.03, relief.frame),
}
