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
from .memory import Memory
from .mesh_buffers import Part

BLOCK_VIEWS = 4  # views of a tile (PMR 2020, section 4: 4×4×4 voxels)
PANEL_BLOCKS = 8  # at least, of a panel of so many views: what its tiles hold is sub-pixels, however many show a block
MAX_BLOCKS = 256  # of a pass: 8 bits of an entry
MAX_SIDE = 4 * 2**12  # pixels of a picture: 12 bits of an entry for its tiles
MAX_TRIANGLES = 2**21  # set up at a time; near clipping may double them
MAX_SAMPLES = 2**25  # voxels, or sub-pixels, of a round
MAX_ENTRIES = 2**25  # in the queue
TRIANGLE_TEXELS = 4  # of lib/plane_triangle.glsl
SURFACE_TEXELS = 4  # of lib/plane_surface.glsl
FIRST_ROOM = 2**16  # entries that the queue holds at first
COUNTERS = 4 * (8 + 15)  # bytes
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


def rounds(size: tuple[int, int], planes: int, blocks: int) -> Iterator[Round]:
    """Cut a picture (width, height) into rows whose memory is bounded.

    blocks: of views, for a panel's table of what each tile shows; else 0.
    """
    width, height = size
    tile_row = max(4 * width * planes, -(-width // 4) * blocks)  # elements for four rows
    step = 4 * max(1, MAX_SAMPLES // tile_row)
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
    """Tiles to be rasterised, and the counts of a pass; as large as the frame before would have needed.

    Attributes
    ----------
    most : int
        Triangles of a piece of the scene, so few that their tiles find room.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self.counters = device.ctx.buffer(bytes(COUNTERS))
        self.most = MAX_TRIANGLES
        self._make(FIRST_ROOM)

    def _make(self, room: int) -> None:
        self.room, self.entries = room, Memory(self._device, room, 4, "u4")

    def grow(self, triangles: int) -> None:
        """Make room for what was asked for, and a quarter more, or smaller pieces of a scene of so many triangles.

        Called when the frame before is long finished.
        """
        wanted = int(np.frombuffer(self.counters.read(16), np.uint32)[3])
        self.counters.write(bytes(4), 12)
        if self.room < min(wanted, MAX_ENTRIES):
            self._make(min(wanted + wanted // 4, MAX_ENTRIES))
        if wanted > MAX_ENTRIES:
            self.most = max(1, int(min(self.most, triangles) * 0.8 * MAX_ENTRIES / wanted))
        elif 0 < 4 * wanted < MAX_ENTRIES:
            self.most = min(2 * self.most, MAX_TRIANGLES)


class Voxels:
    """Depth and winner of every sample of a round."""

    def __init__(self, device: Device, samples: int) -> None:
        self.depths, self.winners = (Memory(device, samples, 1, "u4") for _ in range(2))

    def clear(self, job: Job) -> None:
        """Nothing is seen: all bits set, greater than any depth or number. Then bind both to their image units."""
        self.depths.fill(job, True)
        self.winners.fill(job, True)
        self.depths.bind(2)
        self.winners.bind(3)


class Corners:
    """A part's triangles, and its vertices in eye space."""

    def __init__(self, device: Device, part: Part) -> None:
        self.triangles = Memory(device, part.triangles, 4, "u4")
        self.points = Memory(device, part.corners, 4, "f4")
        self.surfaces = Memory(device, SURFACE_TEXELS * part.corners, 4, "f4")


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
    result[:, 4] = offset_at(offsets, (first - more).astype(np.float64))
    result[:, 5] = offset_at(offsets, (last + more).astype(np.float64))
    found = result.astype(np.float32)
    found[:, 4:6] += np.abs(found[:, 4:6]) * np.float32(1e-6 if continuous else 0) * [-1, 1]  # rounding
    return found


def upload_blocks(job: Job, size: int) -> tuple[NDArray[np.float32], Any]:
    """The blocks of the job's views, and a texture of them, that of the frame before if they are the same."""
    views = job.draw.offsets if job.columns is not None else job.draw.offsets[job.first : job.first + job.count]
    viewmap = job.draw.viewmap
    continuous = job.columns is not None and viewmap is not None and viewmap.continuous
    found = blocks_of(views, size, continuous)
    raw, ctx = found.tobytes(), job.device.ctx
    return found, job.kept.get(("plane blocks", size), raw, lambda: ctx.texture((2, len(found)), 4, raw, dtype="f4"))
