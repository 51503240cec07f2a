"""Layouts of displays without a mask: how many views share their picture, and how large it is (displays.md 3.6, 3.7).

How views become that picture is `encoders.stereo`'s business.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError

EYES_DEG = 6.0  # two eyes 63 mm apart, seen from 600 mm
CONE_DEG = 30.0  # of a multi-view panel whose optics are not given


@dataclass(frozen=True)
class Packing:
    """How views share a picture.

    Attributes
    ----------
    views : int
        V.
    across, down : int
        How many views stand beside and above each other; without such places they are mixed.
    shrink : (int, int)
        Columns and rows of the panel that one of a view's covers.
    gap : int
        Black rows between views that stand above each other.
    size : (width, height), optional
        The only panel that has this layout.
    cone_deg : float
        Angle in which all views lie, where nothing else is known.
    ending : str
        See `Display.ending`.
    """

    views: int = 2
    across: int = 1
    down: int = 1
    shrink: tuple[int, int] = (1, 1)
    gap: int = 0
    size: tuple[int, int] | None = None
    cone_deg: float = EYES_DEG
    ending: str = ""

    def check(self, name: str, width: int, height: int) -> None:
        """Raise InputError unless a panel of that size can have this layout, called `name`."""
        if self.size is not None and (width, height) != self.size:
            raise InputError(f"{name}: expected {self.size[0]}×{self.size[1]} pixels, got {width}×{height}")
        for pixels, share in ((width, self.shrink[0]), (height, self.shrink[1])):
            if pixels % share:
                raise InputError(f"{name}: expected an even number of pixels to halve, got {pixels}")

    def view_size(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of one view for a panel of that size."""
        return (width // self.shrink[0], height // self.shrink[1])

    def picture_size(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of the picture for a panel of that size."""
        width, height = self.view_size(width, height)
        return (self.across * width, self.down * height + (self.down - 1) * self.gap)


STEREO: dict[str, Packing] = {
    "side-by-side": Packing(across=2),
    "side-by-side-half": Packing(across=2, shrink=(2, 1)),
    "top-bottom": Packing(down=2),
    "top-bottom-half": Packing(down=2, shrink=(1, 2)),
    "frame-packing-720p": Packing(down=2, gap=30, size=(1280, 720)),
    "frame-packing-1080p": Packing(down=2, gap=45, size=(1920, 1080)),
    "leia-2x2": Packing(views=4, across=2, down=2, shrink=(2, 2), cone_deg=CONE_DEG, ending="_2x2"),
}
PACKED: dict[str, Packing] = {
    **STEREO,
    "anaglyph": Packing(),
    "rgbd": Packing(views=1, across=2, shrink=(2, 1), cone_deg=CONE_DEG),
}
