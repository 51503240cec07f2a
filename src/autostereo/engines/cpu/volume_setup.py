"""Volumes before they are drawn: scalars, quantised gradients, blocks that show something, classification.

Once per scene: scalars of 8 or 16 bits (others are scaled to 16), gradients of three bytes or, beside 16 bits, of three
times 10 bits, the range of scalars in every block of 4³ voxels. Once per transfer function: which blocks show anything,
and the table of pre-integrated slabs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.transfer import TransferFunction
from ...scene.volume import Volume
from ..volumes import may_show
from .jit import inlined, kernel
from .threads import run_rows

BLOCK = 2  # log2 of the edge of a block, in voxels
PLAIN = 1 / 512  # of full colour or opacity: what is plain enough between two scalars
SHARP = 0.1  # of full colour or opacity: a jump that makes edges
OPAQUE_CUT = 0.5  # opacity of a voxel that makes edges where a volume ends or is clipped
FEW_PIXELS = 128  # across a volume: the length of wider voxels, for this purpose
TABLE = 256  # scalars of the pre-integration table
SOUNDINGS = 65_521  # voxels whose gradients are measured, to know how steep they are
STEEP = 99.9  # percentile of those that differ from zero: steeper gradients keep their direction only


class Grid(NamedTuple):
    """One volume as the kernels read it.

    scalars (nz·ny·nx,) uint8 or uint16; words (nz·ny·nx,) int32: gradients, see store_gradients, or (0,) without
    shading; shape (3,) int64: nx, ny, nz; low, high: stored scalars of the first and the last row of the table.
    """

    scalars: NDArray[Any]
    words: NDArray[np.int32]
    shape: NDArray[np.int64]
    low: float
    high: float


class Field(NamedTuple):
    """A prepared volume: what it is, its grid, (2, …) block ranges, the value of stored scalar 0 and of one step.

    faces: see face_range.
    """

    volume: Volume
    grid: Grid
    blocks: NDArray[np.float32]
    first_value: float
    value_step: float
    faces: tuple[float, float]


@kernel
def block_ranges(scalars, shape, first, last, ranges):
    """Fill ranges (2, nbz, nby, nbx) with least and greatest scalar of block layers first … last and their border."""
    nx, ny, nz = shape[0], shape[1], shape[2]
    for bz in range(first, last):
        for by in range(ranges.shape[2]):
            for bx in range(ranges.shape[3]):
                least, most = scalars[0], scalars[0]
                begin = True
                for z in range(bz << BLOCK, min(((bz + 1) << BLOCK) + 1, nz)):
                    for y in range(by << BLOCK, min(((by + 1) << BLOCK) + 1, ny)):
                        row = (z * ny + y) * nx
                        for x in range(bx << BLOCK, min(((bx + 1) << BLOCK) + 1, nx)):
                            value = scalars[np.uint64(row + x)]
                            if begin:
                                least, most, begin = value, value, False
                            least, most = min(least, value), max(most, value)
                ranges[0, bz, by, bx] = least
                ranges[1, bz, by, bx] = most


@inlined
def gradient_at(scalars, shape, sobel, x, y, z):
    """Gradient ∂s/∂(i, j, k) at a voxel: central differences, one-sided at the borders.

    For `sobel` each is smoothed by (¼, ½, ¼) along both other axes, border voxels repeated.
    """
    nx, ny, nz = shape[0], shape[1], shape[2]
    reach = 1 if sobel else 0
    g0, g1, g2 = 0.0, 0.0, 0.0
    for c in range(-reach, reach + 1):
        for b in range(-reach, reach + 1):
            weight = (2 - abs(b)) * (2 - abs(c)) / 16.0 if sobel else 1.0
            xb, yb = min(max(x + b, 0), nx - 1), min(max(y + b, 0), ny - 1)
            yc, zc = min(max(y + c, 0), ny - 1), min(max(z + c, 0), nz - 1)
            a, e = max(x - 1, 0), min(x + 1, nx - 1)
            k = (zc * ny + yb) * nx
            g0 += weight * (np.float64(scalars[k + e]) - np.float64(scalars[k + a])) / (e - a)
            a, e = max(y - 1, 0), min(y + 1, ny - 1)
            k = zc * ny * nx + xb
            g1 += weight * (np.float64(scalars[k + e * nx]) - np.float64(scalars[k + a * nx])) / (e - a)
            a, e = max(z - 1, 0), min(z + 1, nz - 1)
            k = yc * nx + xb
            below, above = np.float64(scalars[k + a * ny * nx]), np.float64(scalars[k + e * ny * nx])
            g2 += weight * (above - below) / (e - a)
    return g0, g1, g2


@inlined
def turned(matrix, g):
    """A gradient over (i, j, k) in object space; matrix (3, 3): ∂(i, j, k)/∂(x, y, z)."""
    return (
        matrix[0, 0] * g[0] + matrix[1, 0] * g[1] + matrix[2, 0] * g[2],
        matrix[0, 1] * g[0] + matrix[1, 1] * g[1] + matrix[2, 1] * g[2],
        matrix[0, 2] * g[0] + matrix[1, 2] * g[1] + matrix[2, 2] * g[2],
    )


@kernel
def measure_gradients(scalars, shape, sobel, matrix, every, lengths):
    """Fill lengths (N,) float64 with those of the gradients, in object space, of every so many-th voxel."""
    nx, ny = shape[0], shape[1]
    for i in range(lengths.shape[0]):
        k = i * every
        a, b, c = turned(matrix, gradient_at(scalars, shape, sobel, k % nx, k // nx % ny, k // (nx * ny)))
        lengths[i] = np.sqrt(a * a + b * b + c * c)


@kernel
def store_gradients(scalars, shape, sobel, matrix, steepest, first, last, words):
    """Quantise the gradients (object space, so that transforms do not matter) of voxel layers first … last.

    A word holds three numbers with sign, turned at half of what they can be: of 8 bits, 127 being `steepest`, and the
    scalar above them; or, where that has 16 bits and is read on its own, of 10 bits, 511 being `steepest`. Slight
    gradients keep a direction, with at least one step.
    """
    nx, ny = shape[0], shape[1]
    narrow = scalars.itemsize == 1
    bits, middle = (8, 128) if narrow else (10, 512)
    for z in range(first, last):
        for y in range(ny):
            for x in range(nx):
                a, b, c = turned(matrix, gradient_at(scalars, shape, sobel, x, y, z))
                length = np.sqrt(a * a + b * b + c * c)
                scale = 0.0
                if length > 0.0:
                    most = max(abs(a), abs(b), abs(c))
                    scale = max((middle - 1) * min(length / steepest, 1.0) / length, 1.0 / most)
                k = (z * ny + y) * nx + x
                p = np.int64(np.floor(a * scale + 0.5)) + middle
                q = np.int64(np.floor(b * scale + 0.5)) + middle
                r = np.int64(np.floor(c * scale + 0.5)) + middle
                above = (np.int64(scalars[k]) & 255) << 24 if narrow else 0
                words[k] = np.int32(above | (r << (2 * bits)) | (q << bits) | p)


def steepest_gradient(scalars: NDArray[Any], volume: Volume, matrix: NDArray[np.float64]) -> float:
    """Length in object space, in stored scalars, of all but the few steepest gradients of a volume."""
    every = max(1, scalars.size // SOUNDINGS) | 1  # odd, so that it does not stay in few columns of voxels
    lengths = np.empty(-(-scalars.size // every))
    measure_gradients(scalars, np.array(volume.shape, np.int64), volume.gradient == "sobel", matrix, every, lengths)
    lengths = lengths[lengths > 0]
    return float(np.percentile(lengths, STEEP)) if len(lengths) else 1.0 / min(volume.spacing)


def prepare_field(volume: Volume, wide: bool) -> Field:
    """Prepare a volume; `wide` asks for 16 bits, so that several volumes are of one type.

    Scalars that are 8 or 16 bits without sign already are not copied.
    """
    values, (low, high) = volume.values, volume.value_range
    first_value, value_step = 0.0, 1.0
    if values.dtype == np.uint16 or (values.dtype == np.uint8 and not wide):
        scalars = values.reshape(-1)
    elif values.dtype.kind in "iu":
        first_value = low if values.dtype.kind == "i" else 0.0
        target = np.uint8 if values.dtype.itemsize == 1 and not wide else np.uint16
        scalars = np.empty(values.size, target)
        np.subtract(values.reshape(-1), int(first_value), out=scalars, dtype=np.int32, casting="unsafe")
    else:
        first_value, value_step = low, max(high - low, 1e-300) / 65535.0
        scalars = np.empty(values.size, np.uint16)
        flat = values.reshape(-1)
        for k in range(0, len(flat), 1 << 22):
            part = flat[k : k + (1 << 22)].astype(np.float64)
            scalars[k : k + (1 << 22)] = np.floor((part - low) / value_step + 0.5)
    shape = np.array(volume.shape, np.int64)
    blocks = np.empty((2, *(-(-(n - 1) // (1 << BLOCK)) for n in volume.values.shape)), np.float32)
    run_rows(blocks.shape[1], lambda first, last: block_ranges(scalars, shape, first, last, blocks), 2)
    words = np.zeros(0, np.int32)
    if volume.shade and volume.mode == "composite":
        words = np.empty(values.size, np.int32)
        matrix = np.linalg.inv(volume.object_from_index)[:3, :3].astype(np.float64)
        steepest = steepest_gradient(scalars, volume, matrix)
        args = (scalars, shape, volume.gradient == "sobel", matrix, steepest)
        run_rows(volume.values.shape[0], lambda first, last: store_gradients(*args, first, last, words), 2)
    grid = Grid(scalars, words, shape, (low - first_value) / value_step, (high - first_value) / value_step)
    return Field(volume, grid, blocks, first_value, value_step, face_range(volume))


# --- classification ------------------------------------------------------------------------------------------------


def table_range(volume: Volume) -> tuple[float, float]:
    """Scalars between which a volume is classified; beyond the ends of a transfer function nothing changes."""
    low, high = volume.value_range
    points = volume.transfer.points[:, 0]
    if volume.mode != "composite":
        return low, high
    margin = 0.5 * float(points[-1] - points[0])  # for slabs that lead beyond an end
    first, last = max(low, float(points[0]) - margin), min(high, float(points[-1]) + margin)
    return (first, last) if first < last else (low, high)


def face_range(volume: Volume) -> tuple[float, float]:
    """Least and greatest value on the six faces of a volume's box."""
    faces = [np.take(volume.values, k, axis) for axis in range(3) for k in (0, -1)]
    return min(float(face.min()) for face in faces), max(float(face.max()) for face in faces)


def is_sharp(volume: Volume, faces: tuple[float, float]) -> bool:
    """Whether pictures have sharp edges: voxels jump from a scalar to the next but one, or are cut where opaque.

    faces: what face_range found.
    """
    low, high = faces
    if volume.clip_box is not None or volume.clip_plane is not None:
        low, high = volume.value_range
    scalars = np.linspace(*table_range(volume), TABLE)
    rgba = volume.transfer.evaluate(np.append(scalars, (low, high)))
    length = min(volume.voxel_size.min(), (volume.voxel_size * (np.array(volume.shape) - 1)).max() / FEW_PIXELS)
    opacity = -np.expm1(-rgba[:, 3:] * length)
    cut = opacity[np.append((scalars >= low) & (scalars <= high), (True, True))].max()
    shown = np.hstack([opacity, opacity * rgba[:, :3]])[:TABLE]
    return bool(cut > OPAQUE_CUT or np.abs(shown[2:] - shown[:-2]).max() > SHARP)


def make_table(transfer: TransferFunction, low: float, high: float, length: float) -> NDArray[np.int64]:
    """Return the table of slabs of a length in scene units: [front, back] over 256 scalar values from low to high.

    (65536,) int64, below the bits of a float32, the optical depth in powers of ½, above the colour, 10 bits a channel.
    """
    high = high if high > low else low + max(abs(low), 1.0)
    rgba = transfer.table(low, high, TABLE, length).reshape(-1, 4)
    optical = (rgba[:, 3].astype(np.float64) * length / np.log(2.0)).astype(np.float32)
    c = np.floor(np.clip(rgba[:, :3], 0, 1) * 1023.0 + 0.5).astype(np.int64)
    return optical.view(np.int32).astype(np.int64) | (c[:, 0] | (c[:, 1] << 10) | (c[:, 2] << 20)) << 32


def make_plain(table: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return where [one, other] a slab's colour and opacity hardly depart from a straight line between two scalars.

    (65536,) uint8. Between the ends of an interval a curve departs from its chord by at most a quarter of the
    interval's length times all changes of slope within.
    """
    same = table.reshape(TABLE, TABLE).diagonal()
    opacity = 1.0 - np.exp2(-(same & 0xFFFFFFFF).astype(np.uint32).view(np.float32).astype(np.float64))
    channels = [opacity * ((same >> shift & 1023) / 1023.0) for shift in (32, 42, 52)]
    curve = np.pad(np.array([opacity, *channels]), ((0, 0), (1, 1)), mode="edge")
    bends = np.cumsum(np.abs(np.diff(curve, 2, axis=1)), axis=1)
    before = np.pad(bends, ((0, 0), (1, 0)))[:, :-1]
    rows = np.arange(TABLE)
    low, high = np.minimum.outer(rows, rows), np.maximum.outer(rows, rows)
    departs = 0.25 * (high - low + 1) * (bends[:, high] - before[:, low]).max(axis=0)
    return (departs <= PLAIN).astype(np.uint8).reshape(-1)


def shown_blocks(field: Field, reach: int) -> NDArray[np.uint8]:
    """Blocks (nbz, nby, nbx) within `reach` blocks of which the volume shows anything."""
    least, most = field.blocks.astype(np.float64) * field.value_step + field.first_value
    shown = may_show(field.volume, least, most)
    for axis in range(3):
        padded = np.pad(shown, [(reach, reach) if a == axis else (0, 0) for a in range(3)])
        parts = [np.take(padded, range(k, k + shown.shape[axis]), axis) for k in range(2 * reach + 1)]
        shown = np.logical_or.reduce(parts)
    return np.ascontiguousarray(shown, dtype=np.uint8)
