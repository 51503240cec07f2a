"""Memory of the plane rasteriser, and how pictures and scenes that are larger than it are cut into rounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...viewmap import offset_at
from .context import Device
from .job import Job
from .mesh_buffers import Part

BLOCK_VIEWS = 4  # views of a tile (PMR 2020, section 4: 4×4×4 voxels)
MAX_BLOCKS = 256  # of a pass: 8 bits of an entry
TRIANGLE = 64  # bytes of a Triangle (lib/plane_triangle.glsl)
CORNER = 16, 96  # bytes of a vertex in eye space, and of its Surface (lib/surface.glsl) at most
ENTRY = 8  # bytes of a tile in the queue
COUNTERS = 4 * (8 + 15)  # bytes
FIRST_ROOM = 2**16  # entries that the queue holds at first
BLANK = 2**22  # bytes that are set at once
Piece = tuple[int, int, int]  # part, its first triangle, how many


@dataclass(frozen=True)
class Round:
    """Rows of a picture that are drawn together, in a number of planes: views, or channels of a panel."""

    width: int
    first_row: int
    rows: int
    planes: int

    @property
    def tiles(self) -> int:
        """Tiles of 4×4 pixels."""
        return -(-self.width // 4) * -(-self.rows // 4)


def storage_limit(device: Device) -> int:
    """Bytes of a buffer that shaders can write, on this device; OpenGL 4.3 promises 16 MB."""
    return min(int(device.ctx.info.get("GL_MAX_SHADER_STORAGE_BLOCK_SIZE", 2**24)), device.limits.buffer)


def rounds(size: tuple[int, int], planes: int, blocks: int, limit: int) -> Iterator[Round]:
    """Cut a picture (width, height) into rows whose buffers fit into `limit` bytes.

    blocks: of views, for a panel's table of what each tile shows; else 0.
    """
    width, height = size
    tile_row = max(4 * width * planes * 4, -(-width // 4) * blocks * 8)  # bytes of four rows
    step = 4 * max(1, limit // tile_row)
    for first in range(0, height, step):
        yield Round(width, first, min(step, height - first), planes)


def chunks(parts: Sequence[Part], most: int) -> list[list[Piece]]:
    """Cut a scene into lists of at most `most` triangles."""
    result: list[list[Piece]] = []
    free = 0
    for number, part in enumerate(parts):
        first = 0
        while first < part.triangles:
            if free == 0:
                result.append([])
                free = most
            count = min(free, part.triangles - first)
            result[-1].append((number, first, count))
            first, free = first + count, free - count
    return result


class Queue:
    """Tiles to be rasterised, and the counts of a pass; as large as the frame before would have needed."""

    def __init__(self, device: Device, limit: int) -> None:
        self._ctx, self._most = device.ctx, limit // ENTRY
        self.counters = device.ctx.buffer(bytes(COUNTERS))
        self.room = min(FIRST_ROOM, self._most)
        self.entries = device.ctx.buffer(reserve=self.room * ENTRY)

    def wanted(self) -> int:
        """The most tiles that a pass has asked for since last asked; waits for the device."""
        found = int(np.frombuffer(self.counters.read(16), np.uint32)[3])
        self.counters.write(bytes(4), 12)
        return found

    def grow(self) -> None:
        """Make room for what was asked for, and a quarter more; called when the frame before is long finished."""
        wanted = self.wanted()
        if wanted > self.room:
            self.room = min(wanted + wanted // 4, self._most)
            self.entries = self._ctx.buffer(reserve=self.room * ENTRY)


class Voxels:
    """Depth and winner of every sample of a round."""

    def __init__(self, device: Device, samples: int) -> None:
        self._ctx, self._size = device.ctx, 4 * samples
        self.depths = device.ctx.buffer(reserve=self._size)
        self.winners = device.ctx.buffer(reserve=self._size)
        self._blank = device.ctx.buffer(b"\xff" * min(BLANK, self._size))

    def clear(self) -> None:
        """Nothing seen: all bits set, greater than any depth or number."""
        for buffer in (self.depths, self.winners):
            for first in range(0, self._size, BLANK):
                count = min(BLANK, self._size - first)
                self._ctx.copy_buffer(buffer, self._blank, count, read_offset=0, write_offset=first)


class Corners:
    """Vertices of a part in eye space."""

    def __init__(self, device: Device, part: Part) -> None:
        self.points, self.surfaces = (device.ctx.buffer(reserve=size * part.corners) for size in CORNER)


def blocks_of(offsets: NDArray[np.float64], size: int, continuous: bool) -> NDArray[np.float32]:
    """Blocks of `size` views each (n, 8): their camera offsets, and between which these lie (lib/plane_tile.glsl).

    On continuous panels a block is what its views are nearest to, half a view more at either end.
    """
    views = len(offsets)
    first = np.arange(0, views, size)
    last = np.minimum(first + size, views) - 1
    more = 0.5 if continuous else 0.0
    result = np.zeros((len(first), 8))
    result[:, :4] = offsets[np.minimum(first[:, None] + np.arange(4), views - 1)]
    result[:, 4] = offset_at(offsets, first - more)
    result[:, 5] = offset_at(offsets, last + more)
    found = result.astype(np.float32)
    found[:, 4:6] += np.abs(found[:, 4:6]) * np.float32(1e-6 if continuous else 0) * [-1, 1]  # rounding
    return found


def upload_blocks(job: Job, size: int) -> tuple[NDArray[np.float32], Any]:
    """The blocks of the job's views, and a buffer of them, that of the frame before if they are the same."""
    views = job.draw.offsets if job.columns is not None else job.draw.offsets[job.first : job.first + job.count]
    viewmap = job.draw.viewmap
    continuous = job.columns is not None and viewmap is not None and viewmap.continuous
    found = blocks_of(views, size, continuous)
    raw = found.tobytes()
    return found, job.kept.get(("plane blocks", size), raw, lambda: job.device.ctx.buffer(raw))
