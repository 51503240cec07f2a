"""Two views (or four) in one picture, as stereo displays take them (displays.md 3.7)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import check_choice
from ..display.layouts import STEREO, Packing
from ..errors import InputError
from ..wording import counted

Pixels = NDArray[np.uint8]

# Dubois, "A projection method to generate anaglyph stereo images", ICASSP 2001: least squares for red/cyan glasses,
# applied to display values; rows are the R, G, B of the result
DUBOIS_LEFT = np.array([[0.4561, 0.5005, 0.1764], [-0.0401, -0.0378, -0.0158], [-0.0152, -0.0206, -0.0055]])
DUBOIS_RIGHT = np.array([[-0.0435, -0.0879, -0.0016], [0.3785, 0.7336, -0.0185], [-0.0722, -0.1130, 1.2264]])


def _beside(views: Pixels) -> Pixels:
    return np.concatenate(list(views), axis=1)


def _above(views: Pixels) -> Pixels:
    return np.concatenate(list(views), axis=0)


def _rows(views: Pixels) -> Pixels:
    out = views[0].copy()
    out[1::2] = views[1, 1::2]
    return out


def _columns(views: Pixels) -> Pixels:
    out = views[0].copy()
    out[:, 1::2] = views[1, :, 1::2]
    return out


def _checkerboard(views: Pixels) -> Pixels:
    out = views[0].copy()
    out[0::2, 1::2] = views[1, 0::2, 1::2]
    out[1::2, 0::2] = views[1, 1::2, 0::2]
    return out


def _anaglyph(views: Pixels) -> Pixels:
    out = np.empty_like(views[0])
    for r in range(len(out)):  # one row at a time: float64 pictures would take eight times the memory
        mixed = views[0, r] @ DUBOIS_LEFT.T + views[1, r] @ DUBOIS_RIGHT.T
        out[r] = np.clip(mixed, 0, 255) + 0.5
    return out


def _two_by_two(views: Pixels) -> Pixels:
    return np.concatenate([_beside(views[:2]), _beside(views[2:])])


@dataclass(frozen=True)
class Layout:
    """How views share one picture.

    Attributes
    ----------
    about : str
        One line for people.
    arrange : callable
        From views (V, H, W, 3) to the picture.
    views : int
        V.
    halves : {None, 1, 2}
        Axis of the views along which pairs of pixels are averaged first: 1 rows, 2 columns.
    size : (width, height), optional
        The only size of a view that the format has.
    """

    about: str
    arrange: Callable[[Pixels], Pixels]
    views: int = 2
    halves: int | None = None
    size: tuple[int, int] | None = None


def _packed_frame(about: str, packing: Packing) -> Layout:
    def arrange(views: Pixels) -> Pixels:
        return np.concatenate([views[0], np.zeros((packing.gap, *views.shape[2:]), np.uint8), views[1]])

    return Layout(about, arrange, size=packing.size)


LAYOUTS: dict[str, Layout] = {
    "side-by-side": Layout("left | right, each at full width", _beside),
    "side-by-side-half": Layout("left | right, each at half width", _beside, halves=2),
    "top-bottom": Layout("left above right, each at full height", _above),
    "top-bottom-half": Layout("left above right, each at half height", _above, halves=1),
    "row-interleaved": Layout("even rows left, odd rows right", _rows),
    "column-interleaved": Layout("even columns left, odd columns right", _columns),
    "checkerboard": Layout("pixels of even x + y left, of odd x + y right", _checkerboard),
    "anaglyph": Layout("red/cyan glasses, Dubois", _anaglyph),
    "frame-packing-720p": _packed_frame("HDMI 1280×1470: left, 30 black lines, right", STEREO["frame-packing-720p"]),
    "frame-packing-1080p": _packed_frame("HDMI 1920×2205: left, 45 black lines, right", STEREO["frame-packing-1080p"]),
    "leia-2x2": Layout("four views, 0 1 above 2 3 (name files *_2x2)", _two_by_two, views=4),
}


def halve(pixels: Pixels, axis: int) -> Pixels:
    """Average pairs of neighbours along `axis`, ⌊(a + b + 1)/2⌋; that axis must have an even length."""
    if pixels.shape[axis] % 2:
        raise InputError(f"half format: expected an even number of pixels to average, got {pixels.shape[axis]}")
    before = (slice(None),) * axis
    even, odd = (*before, slice(0, None, 2)), (*before, slice(1, None, 2))
    return ((pixels[even].astype(np.uint16) + pixels[odd] + 1) // 2).astype(np.uint8)


def pack(views: Pixels, layout: str, *, swap: bool = False, anamorphic: bool = False) -> Pixels:
    """Pack views into the one picture that a stereo display takes.

    Parameters
    ----------
    views : ndarray of shape (V, H, W, 3 | 4), uint8
        From left to right: two, four for "leia-2x2".
    layout : str
        A key of LAYOUTS.
    swap : bool
        Take the views from right to left.
    anamorphic : bool
        The views already have the half width or height of a "-half" layout.

    Returns
    -------
    ndarray of shape (H', W', 3), uint8

    Raises
    ------
    InputError
        Unknown layout, wrong number or size of views, an odd size to halve.
    """
    check_choice("layout", layout, LAYOUTS)
    views, rule = np.asarray(views), LAYOUTS[layout]
    if views.ndim != 4 or views.shape[3] not in (3, 4) or views.dtype != np.uint8 or 0 in views.shape:
        raise InputError(f"{layout}: expected views (V, H, W, 3 or 4) uint8, got {views.shape} {views.dtype}")
    if len(views) != rule.views:
        raise InputError(f"{layout}: expected {counted(rule.views, 'view')}, got {len(views)}")
    if rule.size is not None and (views.shape[2], views.shape[1]) != rule.size:
        raise InputError(
            f"{layout}: expected views of {rule.size[0]}×{rule.size[1]}, got {views.shape[2]}×{views.shape[1]}"
        )
    views = views[::-1, ..., :3] if swap else views[..., :3]
    if rule.halves is not None and not anamorphic:
        views = halve(views, rule.halves)
    return np.ascontiguousarray(rule.arrange(views))
