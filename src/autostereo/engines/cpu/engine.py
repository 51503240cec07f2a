"""The CPU engine: Numba kernels on bands of rows, all views at once."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...scene.mesh import Mesh
from ...scene.points import Points
from ...scene.scene import Scene
from ...scene.volume import Volume
from ..engine import Draw, Target
from . import gather
from .memory import Memory
from .mesh import PreparedMeshes, draw_mesh_panel, draw_mesh_views, prepare_meshes
from .points import PointArrays, draw_points_panel, draw_points_views, prepare_points
from .scene_arrays import background_word
from .volume import draw_volume_panel, draw_volume_views
from .volume_cut import PreparedVolumes, prepare_volumes, update_volumes


@dataclass(eq=False)
class Prepared:
    """A scene ready to draw, by kind of primitive, with memory that lives from frame to frame."""

    scene: Scene
    meshes: PreparedMeshes | None
    points: PointArrays | None
    volumes: PreparedVolumes | None
    memory: Memory = field(default_factory=Memory)
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def all_volumes(self) -> list[Volume]:
        """The volumes of the scene."""
        return [] if self.volumes is None else self.volumes.volumes

    @property
    def several(self) -> bool:
        """Whether one stage needs the depths of another, or several passes of one need them."""
        opaque = self.meshes is not None or self.points is not None
        return opaque or any(v.mode == "iso" for v in self.all_volumes)


class CpuEngine:
    """Draws meshes, points and volumes; see engines.engine.Engine.

    Meshes alone are drawn into finished pictures. Everything else is drawn stage by stage over pictures and depths:
    meshes, isosurfaces, points, then volumes, whose rays end at the depth of what is opaque.
    """

    name = "cpu"
    methods = ("single-pass", "n-pass", "n-pass-subres", "dibr")

    def prepare(self, scene: Scene) -> Prepared:
        """Turn every kind of primitive into arrays."""
        meshes = [item for item in scene.objects if isinstance(item, Mesh)]
        points = [item for item in scene.objects if isinstance(item, Points)]
        volumes = [item for item in scene.objects if isinstance(item, Volume)]
        return Prepared(
            scene,
            prepare_meshes(scene, meshes) if meshes else None,
            prepare_points(points) if points else None,
            prepare_volumes(scene, volumes) if volumes else None,
        )

    def update(self, prepared: Prepared, scene: Scene) -> Prepared:
        """The same objects under other transforms and transfer functions."""
        pairs = zip(prepared.scene.objects, scene.objects, strict=True)
        changed = {type(new) for old, new in pairs if new is not old}
        meshes = [item for item in scene.objects if isinstance(item, Mesh)]
        points = [item for item in scene.objects if isinstance(item, Points)]
        volumes = [item for item in scene.objects if isinstance(item, Volume)]
        return replace(
            prepared,
            scene=scene,
            meshes=prepare_meshes(scene, meshes) if Mesh in changed else prepared.meshes,
            points=prepare_points(points) if Points in changed else prepared.points,
            volumes=prepared.volumes if prepared.volumes is None else update_volumes(prepared.volumes, scene, volumes),
        )

    def beside(self, prepared: Prepared, draw: Draw) -> int:
        """Depths of scenes that are drawn in stages, and sums of samples; meshes alone need neither."""
        if prepared.points is None and prepared.volumes is None:
            return 0
        panel, given = draw.viewmap is not None, draw.viewmap is None and draw.options.depth
        values, samples = (3, 3) if panel else (4 * len(draw.offsets), len(draw.offsets))  # a pixel has
        own = prepared.several and not given
        depths = prepared.memory.missing("depth", (draw.pixels, samples), np.float32) if own else 0
        means = draw.pixels * (2 * values + 4 * samples * given) if draw.options.samples > 1 else 0
        return depths + means

    def draw(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        """Draw a stack of views, or straight to the panel."""
        with prepared.lock:
            if prepared.meshes is not None and prepared.points is None and prepared.volumes is None:
                one = draw_mesh_views if draw.viewmap is None else draw_mesh_panel
                one(prepared.meshes, draw, target, prepared.memory)
            elif draw.options.samples == 1:
                self._draw_stages(prepared, draw, target)
            else:
                self._draw_samples(prepared, draw, target)

    def _draw_samples(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        """Draw sample after sample of every pixel, and take their mean."""
        side = round(draw.options.samples**0.5)
        sums = np.zeros(target.color.shape, np.uint16)
        nearest = None if target.depth is None else np.full(target.depth.shape, np.inf, np.float32)
        options = replace(draw.options, samples=1)
        own = draw.viewmap is not None and draw.options.sampling == "subpixel"
        wide, (across, down) = 1 / 3 if own else draw.camera.spread, draw.camera.shift
        for k in range(side * side):
            x, y = (k % side + 0.5) / side, (k // side + 0.5) / side
            camera = replace(draw.camera, shift=(across + wide * (0.5 - x), down + 0.5 - y))
            self._draw_stages(prepared, replace(draw, camera=camera, options=options), target)
            sums += target.color
            if nearest is not None and target.depth is not None:
                np.minimum(nearest, target.depth, out=nearest)
        sums += side * side // 2  # in place: sums are twice as large as the pictures
        sums //= side * side
        target.color[...] = sums
        if nearest is not None and target.depth is not None:
            target.depth[...] = nearest

    def _draw_stages(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        panel = draw.viewmap is not None
        shape = target.color.shape if panel else target.color.shape[:3]
        depth = target.depth
        if depth is None and prepared.several:
            depth = prepared.memory.buffer("depth", shape, np.float32)
        if prepared.meshes is not None:
            stage = Target(target.color, depth)
            draw_meshes = draw_mesh_panel if panel else draw_mesh_views
            draw_meshes(prepared.meshes, draw, stage, prepared.memory)
            target.covered, target.reused = target.covered + stage.covered, target.reused + stage.reused
        else:
            background = np.array([background_word(prepared.scene)]).view(np.uint8)
            line = np.tile(background[: target.color.shape[-1]], (target.color.shape[-2], 1))
            target.color[...] = line  # whole rows: numpy copies four bytes at a time much slower
            if depth is not None:
                depth[...] = np.inf
        draw_volumes = draw_volume_panel if panel else draw_volume_views
        ends = np.empty((0, 0, 0), np.float32) if depth is None else depth
        if prepared.volumes is not None:
            draw_volumes(prepared.volumes, True, draw, target.color, ends, prepared.memory)
        if prepared.points is not None:
            draw_points = draw_points_panel if panel else draw_points_views
            draw_points(prepared.points, prepared.scene, draw, target.color, ends, prepared.memory)
        if prepared.volumes is not None:
            draw_volumes(prepared.volumes, False, draw, target.color, ends, prepared.memory)

    def interlace(self, views: NDArray[np.uint8], draw: Draw, out: NDArray[np.uint8]) -> None:
        """Gather a panel from its V views."""
        assert draw.viewmap is not None
        gather.interlace(views, draw.viewmap, draw.flip_x, draw.flip_y, out)

    def merge_view(self, view: NDArray[np.uint8], index: int, draw: Draw, out: NDArray[np.uint8]) -> None:
        """Write into the panel those sub-pixels that show view `index`."""
        assert draw.viewmap is not None
        gather.merge_view(view, index, draw.viewmap, (draw.flip_x, draw.flip_y), out)

    def weave(
        self, quilt: NDArray[np.uint8], grid: tuple[int, int], draw: Draw, size: tuple[int, int]
    ) -> NDArray[np.uint8]:
        """Gather a panel of `size` from a quilt of views of another size, bilinearly."""
        assert draw.viewmap is not None
        return gather.weave(quilt, grid, draw.viewmap, size, "linear", (draw.flip_x, draw.flip_y))
