"""Volumes in textures: voxels, once per scene; and what their transfer function makes of them.

A texel holds the gradient and the scalar, as in Hübner 2007a, section 3.1, in 16 bits each: llvmpipe interpolates
textures of 8 bits to 8 bits only, which shows. Without light a texel is the scalar alone. So a voxel takes 8 bytes or
2, whatever its type was, 4 and 1 where 16 bits would take more than WIDE bytes; the host holds a few layers of them.
Nothing here depends on the transform of the volume: new transforms and transfer functions send no voxels again.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...scene.volume import Volume
from ..constants import BLOCK_BITS, STEPS
from ..reference.volume import voxel_gradients
from ..volumes import may_show
from .context import Device

WIDE = 2**30  # bytes of a volume, above which texels are of 8 bits
PART = 2**20  # voxels that are made texels of at a time
TABLE = 256  # scalars of the table of pre-integrated slabs
COLORS = 4096  # of the greatest values
FAR = 255  # blocks, the farthest that is told
THICKEST = 1e20  # extinction that the table holds; beyond it nothing changes


class Voxels:
    """A volume's values in a texture.

    Attributes
    ----------
    texture : moderngl.Texture3D
        RGBA: gradient ∂s/∂(i, j, k) over the range of values, 0 stored as STEPS of 65535; scalar, 0 … 1 of the range.
    ranges : ndarray of shape (2, nbz, nby, nbx), float32
        Least and greatest value of every block of cells.
    values : ndarray of shape (nz, ny, nx)
        The volume's own.
    """

    def __init__(self, device: Device, volume: Volume) -> None:
        self.values = volume.values
        shaded = is_shaded(volume)
        self.ranges = block_ranges(volume.values)
        channels = 4 if shaded else 1
        kind = np.uint16 if volume.values.size * channels * 2 <= WIDE else np.uint8
        self.texture = new_texture(device, volume, channels, kind)
        depth = max(1, PART // (volume.shape[0] * volume.shape[1]))
        for first in range(0, volume.shape[2], depth):
            last = min(first + depth, volume.shape[2])
            raw = texels(volume, first, last, kind).tobytes()
            self.texture.write(raw, (0, 0, first, *volume.shape[:2], last - first), alignment=1)
            device.uploaded += len(raw)


_sent: WeakValueDictionary[tuple[int, str], Voxels] = WeakValueDictionary()


def send(device: Device, volume: Volume) -> Voxels:
    """The voxels of a volume; those that are on the device already, for some scene, are not sent again."""
    key = id(volume.values), volume.gradient if is_shaded(volume) else ""
    found = _sent.get(key)
    if found is None or found.values is not volume.values:
        found = _sent[key] = Voxels(device, volume)
    return found


def is_shaded(volume: Volume) -> bool:
    """Whether gradients are wanted."""
    return volume.shade and volume.mode != "mip"


def new_texture(device: Device, volume: Volume, channels: int, kind: Any) -> Any:
    """An empty texture of a volume's size.

    Raises
    ------
    UnsupportedError
        It is larger than the device's textures, or than its memory.
    """
    nx, ny, nz = volume.shape
    limit, size = device.limits.texture_3d, nx * ny * nz * channels * np.dtype(kind).itemsize
    remedy = f"({device.renderer}): crop it, take every second voxel, or choose engine='cpu'"
    if max(volume.shape) > limit:
        raise UnsupportedError(
            f"a volume of {nx}×{ny}×{nz} voxels is larger than a 3-D texture of this device, {limit} voxels a side "
            f"{remedy}"
        )
    device.ctx.error  # noqa: B018  # reading forgets what went wrong before
    try:
        texture = device.ctx.texture3d(volume.shape, channels, dtype="f1" if kind is np.uint8 else "nu2", alignment=1)
        error = device.ctx.error
    except Exception as caught:  # moderngl raises its own
        error = str(caught)
    if error != "GL_NO_ERROR":
        raise UnsupportedError(
            f"a volume of {nx}×{ny}×{nz} voxels takes {size / 1e6:.0f} MB of this device's memory, more than it gives "
            f"to a texture {remedy}"
        )
    texture.filter = (device.ctx.LINEAR, device.ctx.LINEAR)
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    if channels == 1:
        texture.swizzle = "RRRR"
    return texture


def texels(volume: Volume, first: int, last: int, kind: Any) -> NDArray[Any]:
    """Texels (n, ny, nx, 4 or 1) of layers first … last."""
    low, high = volume.value_range
    span, top = max(high - low, 1e-300), float(np.iinfo(kind).max)
    own = volume.values[first:last]
    scalars = ((own.astype(np.float64) - low) * (top / span) + 0.5).astype(kind)
    if not is_shaded(volume):
        return scalars[..., None]
    before, after = max(first - 1, 0), min(last + 1, len(volume.values))  # gradients look one layer around
    slope = voxel_gradients(volume.values[before:after], volume.gradient)[first - before : last - before]
    result = np.empty((*own.shape, 4), kind)
    zero = top * (STEPS / 65535.0)
    np.multiply(slope, zero / span, out=slope)
    slope += np.floor(zero) + 0.5 if kind is np.uint16 else zero + 0.5
    result[..., :3] = np.clip(slope, 0.0, top)
    result[..., 3] = scalars
    return result


def block_ranges(values: NDArray) -> NDArray[np.float32]:
    """Least and greatest value (2, nbz, nby, nbx) of the cells of each block, their outer voxels included."""
    result = []
    for extreme in (np.minimum, np.maximum):
        part = values
        for axis in (2, 1, 0):
            start = np.arange(0, part.shape[axis] - 1, 1 << BLOCK_BITS)
            border = np.minimum(start + (1 << BLOCK_BITS), part.shape[axis] - 1)
            part = extreme(extreme.reduceat(part, start, axis=axis), np.take(part, border, axis=axis))
        result.append(part.astype(np.float32))
    return np.stack(result)


# --- what a transfer function makes of it ----------------------------------------------------------------------------


def emptiness(volume: Volume, ranges: NDArray[np.float32]) -> NDArray[np.uint8]:
    """How many blocks away, any way, the nearest is that shows something; 0 for those themselves."""
    from scipy.ndimage import distance_transform_cdt

    low, high = volume.value_range
    least, most = ranges.astype(np.float64)
    shown = may_show(volume, least, most, 2 * (high - low) / 65535)  # scalars are stored in 16 bits
    if not shown.any():
        return np.full(shown.shape, FAR, np.uint8)
    return np.minimum(distance_transform_cdt(~shown, "chessboard"), FAR).astype(np.uint8)


def table_range(volume: Volume) -> tuple[float, float]:
    """Scalars between which slabs are classified; beyond the ends of a transfer function little changes."""
    low, high = volume.value_range
    points = volume.transfer.points[:, 0]
    margin = 0.5 * float(points[-1] - points[0])  # for slabs that lead beyond an end
    first, last = max(low, float(points[0]) - margin), min(high, float(points[-1]) + margin)
    return (first, last) if first < last else (low, high if high > low else low + max(abs(low), 1.0))


def slab_table(volume: Volume, length: float) -> NDArray[np.float32]:
    """Pre-integrated slabs (TABLE, TABLE, 4), [front, back]: colour times extinction, extinction.

    Colours weighted by extinction may be interpolated: next to where nothing shows there is no other colour.
    """
    table = volume.transfer.table(*table_range(volume), TABLE, length)
    table[..., 3] = np.minimum(table[..., 3], THICKEST)
    table[..., :3] *= table[..., 3:]
    return table


def place_in(values: tuple[float, float], range_of_scalar: tuple[float, float], size: int) -> tuple[float, float]:
    """Scale and offset from a stored scalar 0 … 1 to its place in a texture of `size` texels that span `values`."""
    (low, high), (first, last) = range_of_scalar, values
    scale = (size - 1) / size / (last - first)
    return (high - low) * scale, (low - first) * scale + 0.5 / size


def float_texture(device: Device, data: NDArray[np.float32]) -> Any:
    """A texture (h, w, channels), linearly interpolated."""
    texture = device.ctx.texture(data.shape[1::-1], data.shape[2], np.ascontiguousarray(data).tobytes(), dtype="f4")
    texture.filter = (device.ctx.LINEAR, device.ctx.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def make_table(device: Device, volume: Volume, length: float, apart: bool) -> Any:
    """The texture of `slab_table`; `apart`: its channels one above the other, each with the extinction."""
    table = slab_table(volume, length)
    if apart:
        table = np.concatenate([table[..., [c, 3]] for c in range(3)])
    return float_texture(device, table)


class Look:
    """What the transfer function makes of a volume, in textures.

    Attributes
    ----------
    emptiness : moderngl.Texture3D
    colors : moderngl.Texture, optional
        Of the greatest values (COLORS, 4): colour, share of the greatest opacity; for mode "mip".
    """

    def __init__(self, device: Device, volume: Volume, voxels: Voxels) -> None:
        blocks = emptiness(volume, voxels.ranges)
        self.emptiness = device.ctx.texture3d(blocks.shape[::-1], 1, blocks.tobytes(), dtype="u1", alignment=1)
        self.emptiness.filter = (device.ctx.NEAREST, device.ctx.NEAREST)
        self.colors = None
        if volume.mode == "mip":
            colors = volume.transfer.evaluate(np.linspace(*volume.value_range, COLORS))
            colors[:, 3] /= max(volume.transfer.max_opacity, 1e-30)
            self.colors = float_texture(device, colors[None].astype(np.float32))
