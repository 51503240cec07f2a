"""Arrays that shaders read and write, as pictures: software devices read these several times faster than buffers."""

from __future__ import annotations

from ..constants import MEMORY_WIDTH
from .context import COMPUTE_VERSION, Device
from .job import Job

BLANK_ROWS = 256  # that are set at once


class Memory:
    """An array of `count` elements that shaders read and write, as a picture (lib/memory.glsl)."""

    def __init__(self, device: Device, count: int, components: int, dtype: str) -> None:
        rows = max(1, -(-count // MEMORY_WIDTH))
        device.check_texture((MEMORY_WIDTH, rows), "an array of the scene or picture")
        self.texture = device.ctx.texture((MEMORY_WIDTH, rows), components, dtype=dtype)
        self.texture.filter = (device.ctx.NEAREST, device.ctx.NEAREST)

    def bind(self, unit: int) -> None:
        """Bind it to an image unit."""
        self.texture.bind_to_image(unit)

    def fill(self, job: Job, ones: bool) -> None:
        """Set or clear all bits of 32-bit elements of one component; takes image unit 0."""
        device, height = job.device, self.texture.height
        if device.is_hardware:  # GPUs copy to textures at a hundredth of their memory's speed
            self.bind(0)
            program = job.program("memory_fill.comp", version=COMPUTE_VERSION)
            program["value"], program["rows"] = 0xFFFFFFFF if ones else 0, height
            program.run(MEMORY_WIDTH // 64, height)
            return
        size = 4 * MEMORY_WIDTH * BLANK_ROWS  # software devices copy several times faster than their shaders write
        blank = job.kept.get(("blank", ones), size, lambda: device.ctx.buffer((b"\xff" if ones else b"\0") * size))
        for first in range(0, height, BLANK_ROWS):
            self.texture.write(blank, (0, first, MEMORY_WIDTH, min(BLANK_ROWS, height - first)))
