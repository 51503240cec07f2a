"""Named transfer functions and colour maps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..checks import LARGEST, check_choice, check_number, shown
from ..errors import DependencyError, InputError

CT = (-1000.0, 2000.0)  # Hounsfield units: air −1000, water 0, soft tissue 20…80, bone from about 200
UNIT = (0.0, 1.0)

Point = tuple[float, float, float, float, float]

# name: (range of the values, points). Opacities are optical depths along the diagonal of a volume's bounds: below
# about 3 something is a haze, from about 100 on it is a surface
PRESETS: dict[str, tuple[tuple[float, float], tuple[Point, ...]]] = {
    "generic": (
        UNIT,
        (
            (0.0, 0.10, 0.20, 0.50, 0.0),
            (0.1, 0.15, 0.30, 0.60, 0.0),
            (0.3, 0.20, 0.60, 0.70, 4.0),
            (0.5, 0.95, 0.75, 0.30, 12.0),
            (0.75, 0.90, 0.35, 0.15, 40.0),
            (1.0, 1.00, 0.95, 0.90, 100.0),
        ),
    ),
    "gray": (UNIT, ((0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0, 20.0))),
    "fire": (
        UNIT,
        (
            (0.0, 0.0, 0.0, 0.0, 0.0),
            (0.15, 0.2, 0.0, 0.0, 0.0),
            (0.35, 0.7, 0.1, 0.0, 4.0),
            (0.6, 1.0, 0.5, 0.0, 12.0),
            (0.85, 1.0, 0.9, 0.3, 30.0),
            (1.0, 1.0, 1.0, 0.9, 50.0),
        ),
    ),
    "x-ray": (UNIT, ((0.0, 1.0, 1.0, 1.0, 0.0), (0.05, 1.0, 1.0, 1.0, 0.0), (1.0, 1.0, 1.0, 1.0, 6.0))),
    "shells": (
        UNIT,
        (
            (0.0, 0.2, 0.4, 0.9, 0.0),
            (0.20, 0.2, 0.4, 0.9, 0.0),
            (0.25, 0.2, 0.4, 0.9, 20.0),
            (0.30, 0.2, 0.4, 0.9, 0.0),
            (0.45, 0.3, 0.8, 0.4, 0.0),
            (0.50, 0.3, 0.8, 0.4, 40.0),
            (0.55, 0.3, 0.8, 0.4, 0.0),
            (0.70, 1.0, 0.6, 0.2, 0.0),
            (0.75, 1.0, 0.6, 0.2, 80.0),
            (0.80, 1.0, 0.6, 0.2, 0.0),
            (1.0, 1.0, 0.6, 0.2, 0.0),
        ),
    ),
    "ct-bone": (
        CT,
        (
            (-1000, 0.75, 0.35, 0.20, 0.0),
            (150, 0.75, 0.35, 0.20, 0.0),
            (250, 0.85, 0.60, 0.40, 20.0),
            (400, 0.95, 0.87, 0.70, 120.0),
            (1000, 1.00, 0.97, 0.90, 400.0),
            (2000, 1.00, 1.00, 1.00, 600.0),
        ),
    ),
    "ct-soft": (
        CT,
        (
            (-1000, 0.80, 0.55, 0.42, 0.0),
            (-250, 0.80, 0.55, 0.42, 0.0),
            (-150, 0.90, 0.65, 0.50, 4.0),
            (-50, 0.95, 0.75, 0.55, 2.0),
            (20, 0.80, 0.30, 0.25, 3.0),
            (80, 0.85, 0.35, 0.30, 8.0),
            (150, 0.90, 0.60, 0.45, 4.0),
            (300, 1.00, 0.95, 0.85, 40.0),
            (1000, 1.00, 1.00, 0.95, 150.0),
            (2000, 1.00, 1.00, 1.00, 200.0),
        ),
    ),
    "ct-vessels": (
        CT,
        (
            (-1000, 0.60, 0.00, 0.00, 0.0),
            (120, 0.60, 0.00, 0.00, 0.0),
            (180, 0.80, 0.10, 0.05, 30.0),
            (300, 0.95, 0.30, 0.15, 120.0),
            (450, 1.00, 0.75, 0.50, 80.0),
            (700, 1.00, 0.95, 0.85, 40.0),
            (2000, 1.00, 1.00, 1.00, 60.0),
        ),
    ),
    "ct-lung": (
        CT,
        (
            (-1000, 0.30, 0.50, 0.80, 0.0),
            (-950, 0.30, 0.50, 0.80, 0.0),
            (-850, 0.40, 0.60, 0.85, 4.0),
            (-600, 0.60, 0.70, 0.80, 8.0),
            (-400, 0.80, 0.60, 0.50, 3.0),
            (-200, 0.85, 0.60, 0.50, 0.5),
            (150, 0.90, 0.70, 0.60, 0.5),
            (300, 1.00, 0.95, 0.85, 30.0),
            (2000, 1.00, 1.00, 1.00, 100.0),
        ),
    ),
    "mr": (
        UNIT,
        (
            (0.0, 0.35, 0.20, 0.15, 0.0),
            (0.08, 0.35, 0.20, 0.15, 0.0),
            (0.2, 0.50, 0.30, 0.22, 3.0),
            (0.45, 0.80, 0.60, 0.45, 12.0),
            (0.75, 0.95, 0.85, 0.75, 40.0),
            (1.0, 1.00, 1.00, 1.00, 80.0),
        ),
    ),
    "mr-brain": (
        UNIT,
        (
            (0.0, 0.30, 0.05, 0.05, 0.0),
            (0.12, 0.30, 0.05, 0.05, 0.0),
            (0.2, 0.50, 0.25, 0.22, 2.0),
            (0.35, 0.70, 0.45, 0.42, 30.0),
            (0.55, 0.90, 0.72, 0.66, 120.0),
            (0.8, 0.97, 0.92, 0.88, 200.0),
            (1.0, 1.00, 1.00, 1.00, 240.0),
        ),
    ),
}

# evenly spaced stops #rrggbb; those of matplotlib (CC0) in 17, which differ from the whole maps by up to 9/255
COLORMAPS = {
    "gray": "000000 ffffff",
    "viridis": (
        "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c "
        "1fa088 28ae80 3fbc73 5ec962 84d44b addc30 d8e219 fde725"
    ),
    "magma": (
        "000004 0a0822 1d1147 36106b 51127c 6a1c81 832681 9c2e7f b73779 "
        "d0416f e75263 f56b5c fc8961 fea772 fec488 fde2a3 fcfdbf"
    ),
    "inferno": (
        "000004 0b0724 210c4a 3d0965 57106e 71196e 8a226a a32c61 bc3754 "
        "d24644 e45a31 f1731d f98e09 fcac11 f9cb35 f2ea69 fcffa4"
    ),
    "plasma": (
        "0d0887 310597 4c02a1 6600a7 7e03a8 9511a1 aa2395 bc3587 cc4778 "
        "da5a6a e66c5c f0804e f89540 fdac33 fdc527 f8df25 f0f921"
    ),
    "turbo": (
        "30123b 4040a2 466be3 4294ff 28bceb 18ddc2 32f298 6dfe62 a4fc3c "
        "cdec34 eecf3a fdac34 fb7e21 eb500e d02f05 a91601 7a0403"
    ),
    "coolwarm": (
        "3b4cc0 4e68d8 6282ea 779af7 8db0fe a3c2fe b9d0f9 ccd9ed dddcdc "
        "ecd3c5 f5c4ac f7b093 f4987a eb7d62 dd5f4b ca3b37 b40426"
    ),
}
# maps whose corners are not evenly spaced: (position, r, g, b)
CORNERS = {
    "hot": ((0.0, 0.0416, 0.0, 0.0), (0.365079, 1.0, 0.0, 0.0), (0.746032, 1.0, 1.0, 0.0), (1.0, 1.0, 1.0, 1.0)),
    "bone": (
        (0.0, 0.0, 0.0, 0.0),
        (0.365079, 0.319444, 0.319444, 0.444444),
        (0.746032, 0.652778, 0.777778, 0.777778),
        (1.0, 1.0, 1.0, 1.0),
    ),
}


def _check_range(low: object, high: object) -> tuple[float, float]:
    low = check_number("transfer low", low, -LARGEST, LARGEST)
    high = check_number("transfer high", high, -LARGEST, LARGEST)
    if not low < high:
        raise InputError(f"transfer: expected low < high, got {low:g} and {high:g}")
    return low, high


def make_preset(name: str, low: float | None, high: float | None, scale: float) -> NDArray[np.float64]:
    """Return the points (K, 5) of a preset whose range is mapped on low…high and whose opacities are times `scale`."""
    check_choice("transfer preset", name, PRESETS)
    (first, last), rows = PRESETS[name]
    low, high = _check_range(first if low is None else low, last if high is None else high)
    points = np.array(rows, dtype=np.float64)
    points[:, 0] = low + (points[:, 0] - first) / (last - first) * (high - low)
    points[:, 4] *= check_number("transfer scale", scale, 0.0, LARGEST)
    return points


def make_colormap(name: str, low: float, high: float, opacity: float | Sequence[float]) -> NDArray[np.float64]:
    """Return the points (K, 5) of a colour map over low…high with opacities spread evenly."""
    low, high = _check_range(low, high)
    place, color = _stops(name)
    if np.ndim(opacity) == 0:
        given = np.array([0.0, check_number("transfer opacity", opacity, 0.0, LARGEST)])
    else:
        given = np.array([check_number("transfer opacity", x, 0.0, LARGEST) for x in opacity])  # type: ignore[union-attr]
        if len(given) == 0:
            raise InputError("transfer opacity: expected a number or some numbers, got none")
        given = np.repeat(given, 2) if len(given) == 1 else given
    knots = np.linspace(0.0, 1.0, len(given))
    every = np.unique(np.concatenate([place, knots]))
    columns = [np.interp(every, place, color[:, c]) for c in range(3)]
    return np.stack([low + every * (high - low), *columns, np.interp(every, knots, given)], axis=1)


def fit(name: str, value_range: tuple[float, float], diagonal: float) -> NDArray[np.float64]:
    """Return the points (K, 5) of a preset or a colour map over a range of values in bounds of a diagonal."""
    low, high = value_range
    high = high if high > low else low + max(1.0, abs(low))
    if isinstance(name, str) and name in PRESETS:
        if PRESETS[name][0] == CT and low < -500:  # Hounsfield units
            low, high = CT
        return make_preset(name, low, high, 1 / diagonal)
    try:
        return make_colormap(name, low, high, 20 / diagonal)
    except DependencyError:
        more = "; all of matplotlib's: pip install autostereo[colormaps]"
    except InputError:
        more = " and all of matplotlib's"
    raise InputError(
        f"transfer {name!r}: expected a .json file, a preset ({', '.join(PRESETS)}) or a colour map "
        f"({', '.join(sorted([*COLORMAPS, *CORNERS]))}{more})"
    )


def _stops(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (K,) in 0…1 and colours (K, 3) of a colour map."""
    if not isinstance(name, str):
        raise InputError(f"colour map: expected its name, got {shown(name)}")
    reverse = name.endswith("_r")
    base = name[:-2] if reverse else name
    if base in CORNERS:
        rows = np.array(CORNERS[base])
        place, color = rows[:, 0], rows[:, 1:]
    else:
        if base in COLORMAPS:
            color = np.array([list(bytes.fromhex(stop)) for stop in COLORMAPS[base].split()]) / 255.0
        else:
            color = _matplotlib_colors(base)
        place = np.linspace(0.0, 1.0, len(color))
    return (1 - place[::-1], color[::-1]) if reverse else (place, color)


def _matplotlib_colors(name: str) -> NDArray[np.float64]:
    """The 256 colours (256, 3) of matplotlib's map."""
    built_in = ", ".join(sorted([*COLORMAPS, *CORNERS]))
    try:
        import matplotlib
    except ImportError:
        raise DependencyError(
            f"colour map {name!r}: built in are {built_in}; others need matplotlib: pip install autostereo[colormaps]"
        ) from None
    try:
        found = matplotlib.colormaps[name]
    except (KeyError, TypeError):
        raise InputError(f"colour map {name!r}: neither built in ({built_in}) nor known to matplotlib") from None
    return np.asarray(found(np.linspace(0.0, 1.0, 256)))[:, :3].astype(np.float64)
