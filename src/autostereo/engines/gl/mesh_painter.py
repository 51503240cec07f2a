"""de Sorbier 2008 as printed: a render target per view, no depth test, triangles from back to front (3.2, 4.2).

For comparison only. The targets of one framebuffer share a depth buffer, of no use for several views; so triangles are
sorted by the depth of their middle on the CPU, in every frame, and painted over each other: wrong where they
intersect, overlap in a circle, or differ much in size. At most as many views a pass as the device has targets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import stored_background, views_block
from .context import Device
from .job import Job
from .mesh_buffers import Part


@dataclass(eq=False)
class Targets:
    """Pictures of `count` views, as targets of one framebuffer."""

    textures: list[Any]
    framebuffer: Any

    @staticmethod
    def of(device: Device, size: tuple[int, int], count: int) -> Targets:
        """Make them."""
        textures = [device.ctx.texture(size, 4) for _ in range(count)]
        for texture in textures:
            texture.filter = (device.ctx.NEAREST, device.ctx.NEAREST)
        return Targets(textures, device.ctx.framebuffer(textures))


def sorted_parts(job: Job, parts: list[Part]) -> list[Part]:
    """The parts with triangles from back to front, and the farthest part first. The order is sent in every frame."""
    eye_from_world = job.draw.camera.eye_from_world
    result = []
    for number, part in enumerate(parts):
        positions, indices, buffer = job.kept.get(("painted", number), part, partial(_arrays, job, part))
        depth = (positions @ eye_from_world[2, :3].astype(np.float32))[indices].sum(axis=1)
        buffer.write(indices[np.argsort(-depth, kind="stable")].tobytes())
        job.device.uploaded += indices.nbytes
        result.append((-float(depth.mean()), replace(part, indices=buffer)))
    return [part for _, part in sorted(result, key=lambda pair: pair[0])]


def _arrays(job: Job, part: Part) -> tuple[NDArray[np.float32], NDArray[np.uint32], Any]:
    """Positions (n, 3) and triangles (F, 3) as they were sent, and a buffer for the order."""
    vertices = np.frombuffer(part.vertices.read(), np.float32).reshape(part.corners, -1)
    indices = np.frombuffer(part.indices.read(), np.uint32).reshape(-1, 3)
    return vertices[:, :3].copy(), indices, job.device.ctx.buffer(reserve=indices.nbytes)


def begin(job: Job, tiles: range) -> Targets:
    """Targets for the views of these tiles, cleared and in use."""
    layout = job.atlas.layout
    size = layout.width, layout.height
    targets = job.kept.get("targets", (size, len(tiles)), lambda: Targets.of(job.device, size, len(tiles)))
    offsets = job.draw.offsets[job.first + tiles.start : job.first + tiles.stop]
    job.blocks.write("Views", views_block(offsets, np.zeros((len(tiles), 2), np.int64), (*size, *size)))
    targets.framebuffer.use()
    targets.framebuffer.clear(*stored_background(job.scene), 0.0)
    return targets


def finish(job: Job, tiles: range, targets: Targets) -> None:
    """Copy the targets into their tiles of the atlas."""
    layout, ctx = job.atlas.layout, job.device.ctx
    job.with_atlas(job.atlas, job.first, job.count)  # the views' own tiles again
    program = job.program("screen.vert", "copy.frag")
    ctx.enable_only(ctx.NOTHING)
    for tile, texture in zip(tiles, targets.textures, strict=False):
        x, y = (int(v) for v in layout.tiles[tile])
        texture.use(0)
        program["picture"], program["first_pixel"] = 0, (x, y)
        job.atlas.over.use()
        job.atlas.over.viewport = x, y, layout.width, layout.height
        job.cover(program)
    job.atlas.over.viewport = 0, 0, *layout.size
