"""Volumes: scalars on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..checks import (
    FARTHEST,
    LARGEST,
    SMALLEST,
    Vector,
    check_choice,
    check_number,
    check_reach,
    check_vector,
    real_array,
)
from ..errors import InputError
from ..transforms import apply, as_transform
from .appearance import Material
from .transfer import TransferFunction

TYPES = ("uint8", "int8", "uint16", "int16", "float32", "float64")
MODES = ("composite", "mip", "iso")
GRADIENTS = ("central", "sobel")


def _check_values(values: object) -> NDArray:
    """Return `values` as a C-contiguous (nz, ny, nx) array of one of TYPES, finite; not copied if it is one."""
    a = real_array("values", values)
    if a.ndim == 4:
        raise InputError(f"values: expected three axes (z, y, x), got four, {a.shape}: choose one of its frames")
    if a.ndim != 3:
        raise InputError(f"values: expected three axes (z, y, x), got shape {a.shape}")
    if min(a.shape) < 2:
        raise InputError(f"values: expected at least 2 voxels along each axis, got {a.shape} (z, y, x)")
    if a.dtype.kind not in "biuf" or a.dtype.itemsize > 8:
        raise InputError(f"values: expected one of {', '.join(TYPES)}, got {a.dtype}")
    if a.dtype.kind == "b":
        a = a.astype(np.uint8)
    elif a.dtype.kind == "f" and a.dtype.itemsize < 4:
        a = a.astype(np.float32)
    elif a.dtype.kind in "iu" and a.dtype.itemsize > 2:
        low, high = int(a.min()), int(a.max())
        fitting = [t for t in TYPES[:4] if np.iinfo(t).min <= low and high <= np.iinfo(t).max]
        if not fitting:
            raise InputError(f"values: {low}…{high} ({a.dtype}) do not fit into 16 bits; convert them to float32")
        a = a.astype(fitting[0])
    if a.flags.c_contiguous and a.dtype.isnative:
        return a
    return np.ascontiguousarray(a, dtype=a.dtype.newbyteorder("="))


def _range(values: NDArray) -> tuple[float, float]:
    """Return the least and the greatest value; refuse NaN and infinity."""
    with np.errstate(invalid="ignore"):
        low, high = float(values.min()), float(values.max())  # NaN comes through
    if not (np.isfinite(low) and np.isfinite(high)):
        bad = sum(int(np.count_nonzero(~np.isfinite(part))) for part in values)
        raise InputError(f"values: expected finite numbers, found NaN or infinity in {bad:,} of {values.size:,} voxels")
    if max(-low, high) > LARGEST:
        raise InputError(f"values: expected numbers within ±{LARGEST:g}, found {low:g}…{high:g}")
    return low, high


@dataclass(frozen=True, eq=False)
class Volume:
    """Scalars on a regular grid, seen through a transfer function.

    The box of a volume spans the centres of its outermost voxels (the convention of VTK and ITK); between centres
    the scalar is interpolated trilinearly.

    Parameters
    ----------
    values : array_like of shape (nz, ny, nx)
        uint8, int8, uint16, int16, float32 or float64, finite, at least 2 along each axis. Booleans and wider
        integers that fit become the first of these types that holds them. A C-contiguous array is not copied.
    spacing : (3,) float
        Distance of neighbouring voxels along x, y, z; > 0.
    origin : (3,) float
        Centre of the first voxel.
    direction : array_like of shape (3, 3), optional
        Columns are the unit vectors along x-, y- and z-index; they need not be perpendicular.
    transfer : TransferFunction, optional
        None: `TransferFunction.suggest`.
    shade : bool
        Blinn–Phong on gradients, with `material`.
    mode : {"composite", "mip", "iso"}
        Emission and absorption; the greatest value along each ray; the surface of value `iso`.
    iso : float, optional
        None with mode "iso": Otsu's threshold.
    material : Material, optional
    transform : array_like of shape (4, 4), optional
        world_from_object, not singular.
    clip_box : array_like of shape (2, 3), optional
        Lower and upper corner of an axis-aligned box outside of which nothing is seen, in the coordinates before
        `transform` (those of `origin`).
    clip_plane : (4,) float, optional
        (a, b, c, d): only where a·x + b·y + c·z + d ≥ 0 something is seen; the same coordinates.
    gradient : {"central", "sobel"}
        Central differences, or the 3×3×3 Sobel operator (smoother).
    anatomical : bool
        The world's axes are a patient's, LPS: x to the left, y to the back, z to the head. `Rig.frame` then looks from
        the patient's front, head up.

    Raises
    ------
    InputError
        A field does not have the shape, type or range above; the message names it.
    """

    values: NDArray
    spacing: Vector = (1.0, 1.0, 1.0)
    origin: Vector = (0.0, 0.0, 0.0)
    direction: NDArray = None  # type: ignore[assignment]  # None becomes the identity, float64
    transfer: TransferFunction = None  # type: ignore[assignment]  # None becomes a suggested one
    shade: bool = True
    mode: str = "composite"
    iso: float | None = None
    material: Material = None  # type: ignore[assignment]  # None becomes Material()
    transform: NDArray = None  # type: ignore[assignment]  # None becomes the identity
    clip_box: NDArray | None = None  # (2, 3) float64
    clip_plane: NDArray | None = None  # (4,) float64
    gradient: str = "central"
    anatomical: bool = False
    value_range: tuple[float, float] = field(init=False)  # least and greatest value

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "values", _check_values(self.values))
        put(self, "value_range", _range(self.values))
        put(self, "spacing", check_vector("spacing", self.spacing))
        if min(self.spacing) < SMALLEST:
            wanted = "> 0" if min(self.spacing) <= 0 else f"≥ {SMALLEST:g}"
            raise InputError(f"spacing: expected numbers {wanted}, got {self.spacing}")
        put(self, "origin", check_vector("origin", self.origin))
        put(self, "direction", _check_direction(self.direction))
        put(self, "transform", as_transform(self.transform))
        if not abs(np.linalg.det(self.transform[:3, :3])) > 0:
            raise InputError("transform: a volume cannot be flattened, the matrix is singular")
        if not (self.voxel_size.min() >= SMALLEST and np.abs(self.corners).max() <= FARTHEST):
            sizes = " × ".join(f"{x:g}" for x in self.voxel_size)
            raise InputError(f"spacing: expected voxels of {SMALLEST:g} and more within ±{FARTHEST:g}, got {sizes}")
        for name, choices in (("mode", MODES), ("gradient", GRADIENTS)):
            check_choice(name, getattr(self, name), choices)
        for name in ("shade", "anatomical"):
            if not isinstance(getattr(self, name), (bool, np.bool_)):
                raise InputError(f"{name}: expected True or False, got {getattr(self, name)!r}")
        if self.material is None:
            put(self, "material", Material())
        elif not isinstance(self.material, Material):
            raise InputError(f"material: expected a Material, got {type(self.material).__name__}")
        put(self, "clip_box", _check_box(self.clip_box))
        put(self, "clip_plane", _check_plane(self.clip_plane))
        if self.iso is not None:
            put(self, "iso", check_number("iso", self.iso, -LARGEST, LARGEST))
        elif self.mode == "iso":
            put(self, "iso", self.otsu())
        if self.transfer is None:
            put(self, "transfer", TransferFunction.suggest(self))
        elif not isinstance(self.transfer, TransferFunction):
            raise InputError(f"transfer: expected a TransferFunction, got {type(self.transfer).__name__}")

    # --- space -----------------------------------------------------------------------------------------------------
    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along x, y, z (`values.shape` is the other way round)."""
        nz, ny, nx = self.values.shape
        return nx, ny, nz

    @cached_property
    def object_from_index(self) -> NDArray[np.float64]:
        """4×4 matrix from (i, j, k), the x-, y- and z-index, to the coordinates of `origin`."""
        m = np.eye(4)
        m[:3, :3] = self.direction * np.asarray(self.spacing)
        m[:3, 3] = self.origin
        return m

    @cached_property
    def world_from_index(self) -> NDArray[np.float64]:
        """4×4 matrix from (i, j, k), the x-, y- and z-index, to the world."""
        return self.transform @ self.object_from_index

    @property
    def voxel_size(self) -> NDArray[np.float64]:
        """Distance in the world of neighbouring voxels along x-, y- and z-index, (3,)."""
        return np.linalg.norm(self.world_from_index[:3, :3], axis=0)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """World positions (8, 3) of the corners of the box, the x-index changing fastest."""
        last = np.asarray(self.shape) - 1.0
        bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
        return apply(self.world_from_index, bits * last)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Axis-aligned bounds in world space of the whole box, (2, 3): minimum and maximum."""
        return np.stack([self.corners.min(axis=0), self.corners.max(axis=0)])

    @property
    def diagonal(self) -> float:
        """Length of the longest diagonal of the box in world units."""
        return float(np.linalg.norm(self.corners[:4] - self.corners[:3:-1], axis=1).max())

    # --- values ----------------------------------------------------------------------------------------------------
    def histogram(self, bins: int = 256) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Count the voxels in `bins` equal parts of `value_range`; of a wider one where it is a few roundings wide.

        Returns
        -------
        counts : ndarray of shape (bins,)
        edges : ndarray of shape (bins + 1,)
        """
        if self.values.dtype.kind in "iu":
            lowest = int(self.value_range[0])
            wide = np.int32
            each = sum(
                np.bincount((part.astype(wide) - lowest).ravel(), minlength=int(self.value_range[1]) - lowest + 1)
                for part in self.values
            )
            value = lowest + np.arange(len(each))  # type: ignore[arg-type]
            counts, edges = np.histogram(value, bins, range=self.value_range, weights=each)  # type: ignore[arg-type]
            return counts.astype(np.int64), edges
        total = np.zeros(bins, dtype=np.int64)
        low, high = self.value_range
        least = 2 * bins * float(np.spacing(self.values.dtype.type(max(abs(low), abs(high)))))
        wider = 0.0 if high - low > least else max(least, 0.5 * (low == high))
        for part in self.values:
            counts, edges = np.histogram(part, bins, range=(low - wider, high + wider))
            total += counts
        return total, edges

    def otsu(self) -> float:
        """Return Otsu's threshold (1979), which parts the histogram with the greatest variance between its classes."""
        counts, edges = self.histogram()
        center = (edges[:-1] + edges[1:]) / 2
        below = np.cumsum(counts)[:-1].astype(np.float64)
        above = counts.sum() - below
        mass = np.cumsum(counts * center)
        mean_below = mass[:-1] / np.maximum(below, 1)
        mean_above = (mass[-1] - mass[:-1]) / np.maximum(above, 1)
        between = below * above * (mean_below - mean_above) ** 2
        best = np.nonzero(between >= between.max() * (1 - 1e-12))[0]  # a gap between two peaks: its middle
        return float((edges[best[0] + 1] + edges[best[-1] + 1]) / 2)


def _check_direction(direction: object) -> NDArray[np.float64]:
    if direction is None:
        return np.eye(3)
    d = np.array(real_array("direction", direction, "a 3×3 matrix of numbers"), dtype=np.float64)
    if d.shape != (3, 3) or not np.isfinite(d).all():
        raise InputError(f"direction: expected a 3×3 matrix of finite numbers, got shape {d.shape}")
    check_reach("direction", d)
    length = np.linalg.norm(d, axis=0)
    if np.abs(length - 1).max() > 1e-3:
        found = ", ".join(f"{x:g}" for x in length)
        raise InputError(f"direction: expected columns of unit length, found lengths {found}")
    if abs(np.linalg.det(d)) < 1e-9:
        raise InputError("direction: expected three independent axes, the matrix is singular")
    return d


def _check_box(box: object) -> NDArray[np.float64] | None:
    if box is None:
        return None
    b = np.array(real_array("clip_box", box, "two corners of three numbers"), dtype=np.float64)
    if b.shape != (2, 3) or np.isnan(b).any():
        raise InputError(f"clip_box: expected two corners of three numbers, got shape {b.shape}")
    check_reach("clip_box", b[np.isfinite(b)])
    if (b[0] >= b[1]).any():
        raise InputError(f"clip_box: expected a lower and an upper corner, got {b[0].tolist()} and {b[1].tolist()}")
    return b


def _check_plane(plane: object) -> NDArray[np.float64] | None:
    if plane is None:
        return None
    p = np.array(real_array("clip_plane", plane, "four numbers (a, b, c, d)"), dtype=np.float64)
    if p.shape != (4,) or not np.isfinite(p).all():
        raise InputError(f"clip_plane: expected four finite numbers (a, b, c, d), got {plane!r}")
    check_reach("clip_plane", p)
    if not p[:3].any():
        raise InputError("clip_plane: expected a normal (a, b, c) of some length, got (0, 0, 0)")
    return p
