"""From frames to what a device eats: quilts, stereo pictures, 2D+depth, animations."""

from .files import save

__all__ = ["save"]
