"""Display: where a picture goes. Its mask, its input layout, its quilt and its optics."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import FOV_RANGE, check_choice, check_number, check_pair, check_views
from ..errors import InputError, UnsupportedError
from ..viewmap import ViewMap
from ..wording import an, counted
from . import masks
from .calibration import Calibration, read_calibration
from .layouts import CONE_DEG, EYES_DEG, PACKED, STEREO, Packing
from .masks import check_flag, check_size
from .quilt import Quilt

LAYOUTS = ("interlaced", *PACKED)
STEREO_LAYOUTS = (*STEREO, *masks.TWO_VIEW_TABLES)

COMFORT = 5.0  # px between adjacent views (displays.md 3.4)
FOV_Y = 36.0
LOOKING_GLASS_FOV_Y = 14.0


@dataclass(frozen=True, eq=False)
class Display:
    """A display.

    Attributes
    ----------
    name : str
    width, height : int
        W, H: pixels of the panel.
    viewmap : ViewMap, optional
        The mask of an interlaced panel; None for the other layouts. It holds V, `continuous` and `reverse`.
    layout : str
        "interlaced", or how the views of a display without a mask are packed: a key of `layouts.PACKED`.
    eyes_swapped : bool
        The right eye's picture comes first; for layouts without a mask (see `reverse`).
    flip_x, flip_y : bool
        The panel shows the picture mirrored; the mask is that of the panel's own pixels.
    quilt : Quilt, optional
        The quilt that the device prefers.
    fov_y : float
        Vertical field of view in degrees that `Rig.frame` gives the focal-plane window.
    comfort : float
        Largest comfortable disparity between adjacent views, in pixels of `comfort_size`.
    cone_deg : float
        Angle in which all views lie, degrees.
    size_mm : (float, float), optional
        Width and height of the panel in millimetres.
    distance_mm : float, optional
        Distance where the zones of all lenses meet; None: parallel zones (Looking Glass).
    source : str
        Where the numbers come from.
    note : str
        Conflicts and doubts about them.
    ending : str
        What the name of a picture's file ends in, before its suffix, by which the device knows it; "": anything.
    calibration : Calibration, optional
        The Looking Glass calibration behind the mask.
    subpixel_pitch : float
        Width of a sub-pixel in the unit that the lenses of `slanted` were given in; masks do not depend on it.
    """

    name: str
    width: int
    height: int
    viewmap: ViewMap | None = None
    layout: str = "interlaced"
    eyes_swapped: bool = False
    flip_x: bool = False
    flip_y: bool = False
    quilt: Quilt | None = None
    fov_y: float = FOV_Y
    comfort: float = COMFORT
    cone_deg: float = CONE_DEG
    size_mm: tuple[float, float] | None = None
    distance_mm: float | None = None
    source: str = ""
    note: str = ""
    ending: str = ""
    calibration: Calibration | None = None
    subpixel_pitch: float = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "width", check_size("width", self.width))
        put(self, "height", check_size("height", self.height))
        check_choice("layout", self.layout, LAYOUTS)
        if (self.layout == "interlaced") != (self.viewmap is not None):
            problem = "a view map is missing" if self.viewmap is None else "takes no view map"
            raise InputError(f"layout {self.layout}: {problem}")
        for name in ("eyes_swapped", "flip_x", "flip_y"):
            put(self, name, check_flag(name, getattr(self, name)))
        if self.viewmap is not None and self.eyes_swapped:
            raise InputError("eyes_swapped: an interlaced display is reversed by its view map")
        self._packing.check(self.layout, self.width, self.height)
        put(self, "fov_y", check_number("fov_y", self.fov_y, *FOV_RANGE))
        put(self, "comfort", check_number("comfort", self.comfort, 1e-3, 1e6))
        put(self, "cone_deg", check_number("cone_deg", self.cone_deg, 0.001, 179.0))
        if self.size_mm is not None:
            put(self, "size_mm", _pair_mm(self.size_mm))
        if self.distance_mm is not None:
            put(self, "distance_mm", check_number("distance_mm", self.distance_mm, 1e-3, 1e9))
        put(self, "subpixel_pitch", check_number("subpixel_pitch", self.subpixel_pitch, 1e-9, 1e9))
        if self.quilt is not None and self.quilt.views < self.views:
            held = counted(self.views, "view")
            raise InputError(f"quilt: {self.quilt.columns}×{self.quilt.rows} tiles cannot hold {held}")

    # --- what it is ------------------------------------------------------------------------------------

    @property
    def _packing(self) -> Packing:
        return PACKED.get(self.layout, Packing())

    @property
    def views(self) -> int:
        """V: number of views a picture for this display is made of."""
        if self.viewmap is not None:
            return self.viewmap.views
        return self._packing.views

    @property
    def continuous(self) -> bool:
        """Whether every sub-pixel has its own camera coordinate instead of one of V views."""
        return self.viewmap is not None and self.viewmap.continuous

    @property
    def reverse(self) -> bool:
        """Whether zones run the other way: right to left, or the right eye's picture first."""
        return self.viewmap.reverse if self.viewmap is not None else self.eyes_swapped

    @property
    def aspect(self) -> float:
        """Width/height of the window that every view shows: W/H, as panel pixels are square."""
        return self.width / self.height

    @property
    def view_size(self) -> tuple[int, int]:
        """Width and height in pixels of one view as this layout packs it; half formats and rgbd are anamorphic."""
        return self._packing.view_size(self.width, self.height)

    @property
    def picture_size(self) -> tuple[int, int]:
        """Width and height of the device's picture: more than a panel's where views lie beside or above each other."""
        return self._packing.picture_size(self.width, self.height)

    @property
    def comfort_size(self) -> tuple[int, int]:
        """Pixels of a view in which `comfort` counts: a quilt's tile (displays.md 3.4), else the panel's own.

        A mask leaves each view fewer pixels than the panel has, so that the limit is on the careful side there.
        """
        if self._packing.views > 2:  # tiles too
            return self.view_size
        return self.quilt.tile if self.quilt is not None else (self.width, self.height)

    def view_of_subpixel(self) -> NDArray[np.int32] | NDArray[np.float64]:
        """What each sub-pixel of the panel shows, shape (H, W, 3): view index, or camera coordinate u if continuous.

        For people and tests: engines evaluate the view map row by row.
        """
        if self.viewmap is None:
            raise UnsupportedError(f"{self.name}: {an(self.layout)} picture has no mask; interlaced displays have one")
        rows, columns = np.arange(self.height), np.arange(self.width)
        return (self.viewmap.camera if self.continuous else self.viewmap.view)(rows, columns)

    # --- variants --------------------------------------------------------------------------------------

    def physical(
        self,
        size_mm: Sequence[float] | None = None,
        distance_mm: float | None = None,
        cone_deg: float | None = None,
    ) -> Display:
        """The same display with optics; None keeps what it has (zones that meet can be set, not unset)."""
        changes = {"size_mm": size_mm, "distance_mm": distance_mm, "cone_deg": cone_deg}
        return replace(self, **{name: value for name, value in changes.items() if value is not None})  # type: ignore[arg-type]

    def swapped(self) -> Display:
        """The same display with zones running the other way (`--swap`)."""
        if self.viewmap is None:
            return replace(self, eyes_swapped=not self.eyes_swapped)
        return replace(self, viewmap=replace(self.viewmap, reverse=not self.viewmap.reverse))

    def with_views(self, views: int) -> Display:
        """The same optics sampled at another number of views; a quilt of another number of tiles is dropped.

        Raises
        ------
        InputError
            The mask is a table, which fixes V, or the layout has no mask.
        """
        views = check_views(views)
        if views == self.views:
            return self
        if self.viewmap is None or self.viewmap.table is not None:
            raise InputError(f"views: {self.name} ({self.layout}) has {self.views} by its mask or layout, not {views}")
        quilt = self.quilt if self.quilt is not None and self.quilt.views == views else None
        return replace(self, viewmap=replace(self.viewmap, views=views), quilt=quilt)

    def resized(self, width: int, height: int) -> Display:
        """The same mask at the same pixel pitch on a panel of another size.

        Tables and slanted masks are measured from the top left, Looking Glass sheets from the bottom left.
        """
        width, height = check_size("width", width), check_size("height", height)
        viewmap, calibration, quilt = self.viewmap, self.calibration, self.quilt
        if calibration is not None and viewmap is not None:
            calibration = calibration.resized(width, height)
            swapped = viewmap.reverse != calibration.invert
            viewmap = calibration.viewmap(viewmap.views, viewmap.continuous, reverse=swapped)
        elif viewmap is not None and viewmap.height:
            viewmap = replace(viewmap, height=height)
        if quilt is not None and width * self.height != height * self.width:
            quilt = replace(quilt, aspect=width / height)
        size_mm = None
        if self.size_mm is not None:
            size_mm = (self.size_mm[0] * width / self.width, self.size_mm[1] * height / self.height)
        return replace(
            self,
            width=width,
            height=height,
            viewmap=viewmap,
            calibration=calibration,
            quilt=quilt,
            size_mm=size_mm,
        )

    # --- where it comes from ---------------------------------------------------------------------------

    @staticmethod
    def presets() -> list[str]:
        """Names of the built-in displays."""
        from .presets import preset_names

        return preset_names()

    @staticmethod
    def preset(name: str | os.PathLike[str], reverse: bool = False) -> Display:
        """A built-in display by name, or one of your own: a path to a .toml like those, or to a visual.json.

        `reverse` swaps the zones against what the preset says.
        """
        from .presets import load_preset

        return _maybe_swapped(load_preset(name), reverse)

    @staticmethod
    def lenticular(width: int, height: int, views: int, per: str = "pixel", reverse: bool = False) -> Display:
        """Lenses along the columns, V pixels or (`per="subpixel"`) V sub-pixels wide (de Sorbier 2008, Fig. 4a)."""
        return _masked(f"lenticular-{views}-{per}", (width, height), masks.lenticular(views, per), reverse)

    @staticmethod
    def wavelength_selective(width: int, height: int, reverse: bool = False) -> Display:
        """Wavelength-selective filter array of 8 views, period 8×12 (Hübner 2007b, equations 4–6, corrected)."""
        return _masked("wavelength-selective", (width, height), masks.wavelength_selective(), reverse)

    @staticmethod
    def slanted(
        width: int,
        height: int,
        views: int,
        *,
        lens_pitch: float,
        subpixel_pitch: float,
        slant_deg: float,
        phase: float = 0.0,
        continuous: bool = False,
        reverse: bool = False,
    ) -> Display:
        """Slanted lenticular by its physical numbers (PMR 2020, equations 14–15; van Berkel 1999).

        Parameters
        ----------
        lens_pitch, subpixel_pitch : float
            Width of a lens across its axis, and of a sub-pixel along the row, in one unit.
        slant_deg : float
            Angle of the lens axes to the columns; > 0 leans like a backslash.
        phase : float
            Phase, in lenses, of the top left red sub-pixel.
        continuous : bool
            Give each sub-pixel its own camera coordinate instead of one of V views.
        """
        viewmap = masks.slanted(views, lens_pitch, subpixel_pitch, slant_deg, phase, continuous)
        made = _masked(f"slanted-{views}", (width, height), viewmap, reverse)
        return replace(made, subpixel_pitch=float(subpixel_pitch))

    @staticmethod
    def from_table(width: int, height: int, views: int, table: Any, reverse: bool = False) -> Display:
        """Any (h, w, 3) table of view indices 0…V−1, rows from the top, repeated over the panel."""
        return _masked(f"table-{views}", (width, height), masks.table(views, table), reverse)

    @staticmethod
    def from_calibration(
        source: str | os.PathLike[str] | dict[str, Any],
        views: int | None = None,
        continuous: bool = False,
        reverse: bool = False,
    ) -> Display:
        """A Looking Glass by its visual.json, or by a dict with its fields.

        Parameters
        ----------
        views : int, optional
            V; None: as many as the device's own quilt has tiles, else its model's (by serial number or panel), else 48.
        reverse : bool
            Swap the zones against what the file's invView says.
        """
        from .presets import model_of

        calibration = read_calibration(source)
        model = model_of(calibration)
        quilt = model.quilt if model is not None else None
        if calibration.quilt is not None:
            quilt = Quilt(*calibration.quilt)
        count = check_views(views) if views is not None else (quilt.views if quilt is not None else 48)
        name = calibration.serial or ("calibration" if isinstance(source, dict) else Path(source).stem)
        return looking_glass(
            calibration,
            calibration.viewmap(count, check_flag("continuous", continuous), check_flag("reverse", reverse)),
            name=name,
            quilt=quilt if quilt is not None and quilt.views == count else None,
            source="calibration" if isinstance(source, dict) else str(source),
        )

    @staticmethod
    def stereo(width: int, height: int, layout: str = "side-by-side", reverse: bool = False) -> Display:
        """Two views for a panel of `width` × `height` pixels; `reverse` puts the right eye's picture first.

        Full "side-by-side" and "top-bottom" pictures are twice the panel's size (`picture_size`), the "-half" ones have
        anamorphic views. "frame-packing-720p" and "-1080p" are HDMI's, for 1280×720 and 1920×1080 pixels. "leia-2x2"
        is four views of half the panel's size, the two left ones above. "row-interleaved", "column-interleaved" and
        "checkerboard" are masks.
        """
        if check_choice("layout", layout, STEREO_LAYOUTS) in masks.TWO_VIEW_TABLES:
            display = _masked(layout, (width, height), masks.two_view(layout), reverse)
            return replace(display, cone_deg=EYES_DEG, comfort=_two_view_comfort(width))
        return _packed(layout, layout, (width, height), reverse)

    @staticmethod
    def anaglyph(width: int, height: int, reverse: bool = False) -> Display:
        """Red/cyan glasses, after Dubois."""
        return _packed("anaglyph", "anaglyph", (width, height), reverse)

    @staticmethod
    def rgbd(width: int, height: int, reverse: bool = False) -> Display:
        """Picture and depth, each half of `width` × `height` pixels (displays.md 3.6); `reverse` inverts the depth."""
        return _packed("rgbd", "rgbd", (width, height), reverse)


def _pair_mm(value: Any) -> tuple[float, float]:
    width, height = check_pair("size_mm", value, "(width, height) in millimetres")
    return (check_number("size_mm width", width, 1e-3, 1e9), check_number("size_mm height", height, 1e-3, 1e9))


def _two_view_comfort(width: Any) -> float:
    """2 % of the width, a rule of thumb: two eyes fuse what adjacent views of a multi-view panel show as a ghost."""
    return max(1.0, 0.02 * check_size("width", width))


def _maybe_swapped(display: Display, reverse: Any) -> Display:
    return display.swapped() if check_flag("reverse", reverse) else display


def _masked(name: str, size: tuple[Any, Any], viewmap: ViewMap, reverse: Any) -> Display:
    return _maybe_swapped(Display(name, *size, viewmap=viewmap), reverse)


def _packed(name: str, layout: str, size: tuple[Any, Any], reverse: Any) -> Display:
    packing = PACKED[layout]
    comfort = _two_view_comfort(size[0]) if packing.views == 2 else COMFORT
    known = {"cone_deg": packing.cone_deg, "comfort": comfort, "ending": packing.ending}
    return Display(name, *size, layout=layout, eyes_swapped=reverse, **known)  # type: ignore[arg-type]


def looking_glass(calibration: Calibration, viewmap: ViewMap, **fields: Any) -> Display:
    """A display with the flips, size and cone of `calibration`; further `fields` are Display's."""
    return Display(
        width=calibration.width,
        height=calibration.height,
        viewmap=viewmap,
        flip_x=calibration.flip_x,
        flip_y=calibration.flip_y,
        fov_y=fields.pop("fov_y", LOOKING_GLASS_FOV_Y),
        cone_deg=calibration.cone_deg,
        size_mm=calibration.size_mm,
        calibration=calibration,
        **fields,
    )
