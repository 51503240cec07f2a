"""How finely the device interpolates in textures: found by trying, as OpenGL neither promises nor tells it.

GPUs weigh texels with some 8 bits (OpenGL 4.6, section 8.14, asks for no number), which steep transfer functions show.
Where weights are that coarse, shaders of volumes interpolate by themselves (shaders/lib/filtering.glsl).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .context import Device

PLACES = 4096  # lookups between two texels
FINE = 2.0**-12  # error of a weight that still is fine: with 8 bits it is 2⁻⁹ at least


def interpolates_coarsely(device: Device) -> bool:
    """Whether weights between two voxels are off by more than FINE somewhere; the device has to be entered."""
    return coarse(lookups(device))


def lookups(device: Device) -> NDArray[np.float32]:
    """What the device finds (PLACES,) at k/PLACES of the way from a voxel that is 0 to one that is 1."""
    ctx = device.ctx
    voxels = ctx.texture3d((2, 1, 1), 1, np.array([0, 65535], np.uint16).tobytes(), dtype="nu2")
    voxels.filter = (ctx.LINEAR, ctx.LINEAR)
    voxels.repeat_x = voxels.repeat_y = voxels.repeat_z = False
    target = ctx.framebuffer([ctx.texture((PLACES, 1), 1, dtype="f4")])
    program: Any = device.programs.get("screen.vert", "filtering.frag", defines={"PLACES": PLACES})
    voxels.use(0)
    program["voxels"] = 0
    target.use()
    ctx.enable_only(ctx.NOTHING)
    ctx.vertex_array(program, []).render(vertices=3)
    return np.frombuffer(target.read(components=1, dtype="f4"), np.float32)


def coarse(found: NDArray[np.float32]) -> bool:
    """Whether lookups (n,) at k/n between 0 and 1 tell of coarse weights."""
    return bool(np.abs(found - np.arange(len(found)) / len(found)).max() > FINE)
