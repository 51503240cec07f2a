"""What all shaders read: the camera, the views of an atlas, the mask; each a uniform block of a `shaders/lib` file.

Everything is computed in float64 here and rounded once; positions are sent relative to the scene's middle, so that
scenes far from the world's origin keep their precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.scene import Scene
from ...transforms import apply
from ...viewmap import ViewMap
from ..constants import ATLAS_VIEWS, LEVELS, MAX_CAMERAS, MAX_CELLS
from ..engine import Camera
from .context import Device
from .programs import Defines, put

BINDINGS = {"Frame": 0, "Views": 1, "ViewMap": 2, "Cameras": 3}  # the uniform blocks of shaders/lib; others from 4 on
MASK_UNIT = 15  # texture unit of a mask's table
MARGIN = 1e-3  # by which depth buffers reach beyond the scene, so that rounding clips nothing


def stored_background(scene: Scene) -> NDArray[np.float64]:
    """The background (3,) as it is stored, ⌊255·v + ½⌋/255."""
    return np.asarray(np.floor(np.array(scene.background) * LEVELS + 0.5) / LEVELS)


@dataclass(frozen=True)
class DepthRange:
    """Depths between which everything lies that is drawn; see lib/frame.glsl. A picture's depth buffers share it."""

    nearest: float
    farthest: float

    @staticmethod
    def of(scene: Scene, camera: Camera) -> DepthRange:
        """From the near plane, or the scene's nearest corner if that is farther, to its farthest corner."""
        bounds = scene.bounds
        corners = np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        depth = apply(camera.eye_from_world, corners)[:, 2]
        farthest = max(float(depth.max()) * (1 + MARGIN), camera.near * (1 + MARGIN))
        return DepthRange(max(camera.near, float(depth.min()) * (1 - MARGIN)), farthest)

    def depth_from_window(self, window: NDArray[np.float32]) -> NDArray[np.float32]:
        """Eye depths of a depth buffer's values; inf where nothing was drawn."""
        near = 1 / self.nearest
        with np.errstate(divide="ignore"):
            depth = 1 / (near - window.astype(np.float64) * (near - 1 / self.farthest))
        return np.where(window >= 1, np.inf, depth).astype(np.float32)


def frame_block(camera: Camera, depths: DepthRange, middle: NDArray[np.float64]) -> NDArray[np.float32]:
    """The block Frame (28,) float32; `middle` (3,) is the world position of local coordinates' origin."""
    eye_from_local = camera.eye_from_world.copy()
    eye_from_local[:3, 3] += camera.eye_from_world[:3, :3] @ middle
    near = 1 / depths.nearest
    numbers = [
        *(camera.fx, camera.fy, camera.focal, camera.offset_y),
        *(camera.width, camera.height, camera.width / 2 + camera.shift[0], camera.height / 2 + camera.shift[1]),
        *(near, near - 1 / depths.farthest, camera.near, 1 / camera.focal),
    ]
    return np.concatenate([eye_from_local.T.ravel(), numbers]).astype(np.float32)


def views_block(offsets: NDArray[np.float64], tiles: NDArray[np.int64], sizes: tuple[int, ...]) -> NDArray[np.float32]:
    """The block Views (1 + ATLAS_VIEWS, 4) float32 of camera offsets (n,) and first pixels (n, 2) of their tiles.

    sizes: width and height of the atlas and of a tile.
    """
    block = np.zeros((1 + ATLAS_VIEWS, 4), np.float32)
    block[0] = sizes
    block[1 : 1 + len(offsets), 0] = offsets
    block[1 : 1 + len(tiles), 1:3] = tiles
    return block


def cameras_block(offsets: NDArray[np.float64]) -> NDArray[np.float32]:
    """The block Cameras (MAX_CAMERAS,) float32: offsets (V,) of all views of a panel."""
    block = np.zeros(MAX_CAMERAS, np.float32)
    block[: len(offsets)] = offsets
    return block


class Blocks:
    """The buffers behind the uniform blocks, kept from frame to frame."""

    def __init__(self, device: Device) -> None:
        sizes = {"Frame": 28 * 4, "Views": (1 + ATLAS_VIEWS) * 16, "Cameras": MAX_CAMERAS * 4}
        self._buffers = {name: device.ctx.buffer(reserve=size) for name, size in sizes.items()}

    def write(self, name: str, values: NDArray[Any]) -> None:
        """Fill a block; shaders see it from the next draw on, once `attach`ed."""
        self._buffers[name].write(values.tobytes())
        self._buffers[name].bind_to_uniform_block(BINDINGS[name])


def attach(program: Any) -> Any:
    """Connect a program's uniform blocks to their buffers; returns the program."""
    for name, binding in BINDINGS.items():
        block = program.get(name, None)
        if block is not None:
            block.binding = binding
    return program


class Mask:
    """A ViewMap as lib/viewmap.glsl reads it: switches, and a block or a small texture of integers."""

    def __init__(self, device: Device, viewmap: ViewMap) -> None:
        self.viewmap = viewmap
        self.defines: Defines = {
            "VIEWMAP_TABLE": viewmap.table is not None,
            "REVERSE": viewmap.reverse,
            "CONTINUOUS": viewmap.continuous,
        }
        if viewmap.table is not None:
            height, width, _ = viewmap.table.shape
            device.check_texture((width, height), "a display's table")
            texels = np.zeros((height, width, 4), np.uint16)
            texels[..., :3] = viewmap.table
            self._held = device.ctx.texture((width, height), 4, texels.tobytes(), dtype="u2")
            self._held.filter = (device.ctx.NEAREST, device.ctx.NEAREST)
            return
        assert viewmap.offsets is not None
        cells = viewmap.offsets[:MAX_CELLS]
        if viewmap.cell_mode:
            self.defines = {**self.defines, "CELLS": viewmap.cell_mode, "CELL_COUNT": len(viewmap.offsets)}
        block = np.zeros(MAX_CELLS * 4 + 4)
        block[: MAX_CELLS * 4].reshape(MAX_CELLS, 4)[: len(cells), :3] = cells
        block[MAX_CELLS * 4 : MAX_CELLS * 4 + 2] = viewmap.a, viewmap.b
        block[MAX_CELLS * 4 + 2 :].view(np.int32)[:2] = viewmap.views, viewmap.height
        self._held = device.ctx.buffer(block.tobytes())

    def use(self, program: Any) -> None:
        """Give the mask to an attached program that includes lib/viewmap.glsl."""
        if self.viewmap.table is None:
            self._held.bind_to_uniform_block(BINDINGS["ViewMap"])
            return
        self._held.use(MASK_UNIT)
        put(program, view_table=MASK_UNIT, view_count=self.viewmap.views)
