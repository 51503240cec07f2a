"""Surfels on the device: sent once per scene, made ready once per frame for all its views."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...scene.points import Points
from ..constants import MEMORY_WIDTH
from ..reference.points import LEAST_RADIUS, Surfels
from ..reference.shading import lights_in_eye_space
from .context import COMPUTE_VERSION, Device
from .job import Job, put_lights
from .memory import Memory
from .programs import Defines, put

FLOATS = 12  # of a surfel as it is sent; see shaders/points_setup.comp
RECORD = 7  # texels of one that is ready; see shaders/lib/surfels.glsl
GROUP = 64  # invocations of a work group
MOST_GROUPS = 65535  # in a row: what OpenGL promises
POINTS, MATERIALS = 0, 2  # bindings
RECORDS = 5  # texture unit
CONSTANTS: Defines = {
    "LEAST_RADIUS": LEAST_RADIUS,
    "FAR": 1e30,  # depth of nothing
    "ROUNDING": 1e-6,  # by which the same depth may differ from shader to shader
    "DEPTH_PRECISION": 2.0**-23,  # of depth buffers: two steps of 24 bits
}


class SurfelBuffers:
    """All clouds of a scene as one: they are blended with each other.

    Attributes
    ----------
    count : int
    ready : Memory
        A record of each surfel (shaders/lib/surfels.glsl), once `make_ready` has been called.
    """

    def __init__(self, device: Device, clouds: Sequence[Points], middle: NDArray[np.float64]) -> None:
        parts = [_arrays(cloud, middle, number) for number, cloud in enumerate(clouds)]
        points = np.concatenate(parts).astype(np.float32)
        points = points[space_filling_order(points[:, :3])]
        self.count = len(points)
        most = min(MEMORY_WIDTH * device.limits.texture // RECORD, device.limits.storage // (4 * FLOATS))
        if self.count > most:
            raise UnsupportedError(
                f"{self.count} points are more than shaders of this device can read, {most} ({device.renderer}): "
                "choose fewer, or engine='cpu'"
            )
        materials = [cloud.material for cloud in clouds]
        self.shiny = any(material.specular > 0 for material in materials)
        self._points = device.upload(points)
        numbers = [(m.ambient, m.diffuse, m.specular, m.shininess) for m in materials]
        self._materials = device.upload(np.array(numbers, dtype=np.float32))
        self.ready = Memory(device, RECORD * self.count, 4, "f4")

    def switches(self, job: Job) -> Defines:
        """The switches of lib/surfels.glsl and lib/shading.glsl."""
        lights = len(lights_in_eye_space(job.scene.lights, job.draw.camera))
        sides = lights > 0 and job.draw.options.shading != "center"
        return {**CONSTANTS, "LIGHTS": lights, "SIDES": sides, "OWN_EYE": sides and self.shiny}

    def make_ready(self, job: Job) -> None:
        """Place and light the surfels for a draw, unless they are ready; the block Frame has to be written."""
        job.kept.get("surfels", (self, job.draw), lambda: self._run_setup(job))

    def _run_setup(self, job: Job) -> bool:
        program = job.program("points_setup.comp", defines=self.switches(job), version=COMPUTE_VERSION)
        self._points.bind_to_storage_buffer(POINTS)
        self.ready.bind(0)
        self._materials.bind_to_storage_buffer(MATERIALS)
        program["count"] = self.count
        program["reach"] = job.draw.culling
        put_lights(program, job)
        program.run(*work_groups(self.count))
        job.device.ctx.memory_barrier()
        return True


def work_groups(invocations: int) -> tuple[int, int]:
    """Work groups in x and y for so many invocations (lib/invocation.glsl)."""
    groups = -(-invocations // GROUP)
    return min(groups, MOST_GROUPS), -(-groups // MOST_GROUPS)


def give_draw(program: Any, job: Job, place: tuple[float, ...]) -> None:
    """Give a program where it draws, `place` as points.Part has it, and what shaders need to know."""
    columns = job.columns or (0.5, 0.5, 0.5)
    put(
        program, sheet=place, sample_range=(min(columns), max(columns), job.row, job.row), reach=job.draw.culling,
        columns=columns, row=job.row,
    )  # fmt: skip
    put_lights(program, job)


def _arrays(cloud: Points, middle: NDArray[np.float64], material: int) -> NDArray[np.float64]:
    """Position relative to `middle`, radius, normal, number of the material, colour of each point, (N, FLOATS)."""
    surfels = Surfels.of(cloud)
    out = np.zeros((len(surfels.positions), FLOATS))
    out[:, 0:3] = surfels.positions - middle
    out[:, 3] = surfels.radii
    out[:, 4:7] = surfels.normals
    out[:, 7] = material
    out[:, 8:11] = surfels.colors
    return out


def space_filling_order(positions: NDArray[np.floating]) -> NDArray[np.int64]:
    """Indices (N,) that sort positions (N, 3) along Morton's curve: what follows each other is close.

    Quads next to each other meet the same cache lines; and neighbours that take turns in K groups are parted.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    cells = np.uint64(2**21 - 1)
    place = (positions - low) / np.maximum((high - low).max(), np.finfo(np.float32).tiny)
    code = np.zeros(len(positions), np.uint64)
    for axis in range(3):
        x = (place[:, axis].astype(np.float64) * float(cells)).astype(np.uint64)
        for shift, mask in SPREAD:
            x = (x | (x << np.uint64(shift))) & np.uint64(mask)
        code |= x << np.uint64(axis)
    return np.argsort(code, kind="stable")


# steps that move the 21 low bits of a word apart, two zeros between each
SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)
