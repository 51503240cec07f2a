"""The OpenGL engine: what it draws, in which order, and where.

How a frame is made (frames.py). A *stage* draws all objects of one kind; STAGES lists them in drawing order, a kind may
have two (isosurfaces come before points, other volumes after). A stage is made once per scene, `stage(device, objects,
middle)`, sends its data then and never again (`Device.upload` counts it), and has those of these routines that its
methods need; METHODS says by which methods a kind is drawn.

`draw_views(job, tiles)`
    Draw the views of `tiles` into their tiles of `job.atlas`: view `job.first + t`, camera offset and place of the tile
    in `views[t]` of lib/views.glsl. For all methods but covering-quad; `job.draw.method` says which. `tiles` is one for
    n-pass, at most `views_per_pass` for geometry-shader, all for the others. What a mask hides has depth 0 already.
`draw_channels(job)`
    Draw what the sub-pixels of a panel see, those of each channel into a tile of their own of `job.atlas` (channel
    `job.first + t`), each sub-pixel for its own camera (`job.masked_program`, lib/viewmap.glsl): a single pass that
    knows no views, and has true depth per channel. For covering-quad, and single-pass on continuous panels.
`draw_panel(job, panel)`
    Draw over a gathered panel, instead of the others if `draws_over(job)`: for what needs no tiles, such as rays that
    end at `panel.depth`. It replaces `panel.color` by what it makes of it, or blends with it.

Opaque things test and write depth (lib/frame.glsl: window_from_depth); what is translucent comes after them, reads
`job.atlas.depth` and draws to `job.atlas.over`. Colours in `job.atlas.color` are composited over the background, alpha
is opacity; colours are stored `quantized` (lib/color.glsl). A routine sets what state it needs (`ctx.enable_only`), and
leaves clip distances and colour masks as they were. Samples of a pixel are drawn one by one: the camera moves
(`write_frame`), the shaders do not know. `job.kept` keeps what is to live from frame to frame. Names of uniforms that
a shader does not use are not there: test with `in program`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...scene.mesh import Mesh
from ...scene.points import Points
from ...scene.scene import Scene
from ...scene.volume import Volume
from ..engine import Draw, Target
from ..gathering import check_interlace, quilt_tiles
from . import frames
from .blocks import Blocks, DepthRange, Mask, cameras_block
from .context import Device, get_device
from .job import Job, Kept
from .panel import Panel
from .plane_rasterizer import METHODS as PLANE_METHODS
from .plane_rasterizer import PlaneMeshes
from .points import PointClouds
from .volume import TOGETHER, Isosurfaces, Volumes, composed

STAGES: tuple[tuple[type, type[Any]], ...] = (
    (Mesh, PlaneMeshes),
    (Volume, Isosurfaces),
    (Points, PointClouds),
    (Volume, Volumes),
)
FAR_MOVED = 100.0  # of a scene's diagonal
METHODS: dict[type, tuple[str, ...]] = {
    Mesh: (
        *("single-pass", "n-pass", "n-pass-subres", "n-pass-masked"),
        *("instanced", "geometry-shader", "geometry-shader-painter", "covering-quad"),
        *PLANE_METHODS,
    ),
    Points: ("single-pass", "n-pass", "n-pass-subres", "n-pass-masked", "instanced", "covering-quad"),
    Volume: ("single-pass", "n-pass", "n-pass-subres", "n-pass-masked", "covering-quad"),
}
PANELS_ONLY = ("n-pass-subres", "n-pass-masked", "covering-quad")


@dataclass(eq=False)
class Prepared:
    """A scene on the device, and memory that lives from frame to frame."""

    scene: Scene
    middle: NDArray[np.float64]
    stages: list[Any]
    blocks: Blocks
    kept: Kept = field(default_factory=Kept)


class GlEngine:
    """Draws on an OpenGL device; see engines.engine.Engine, and the module's notes."""

    name = "gl"

    def __init__(self) -> None:
        self.device = get_device()

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods that some kind of object can be drawn by."""
        return (*self.own_methods, "dibr")

    @property
    def own_methods(self) -> tuple[str, ...]:
        """Those by which whole panels and stacks are made on the device, and read back once."""
        return tuple(dict.fromkeys(name for names in METHODS.values() for name in names))

    def prepare(self, scene: Scene) -> Prepared:
        """Send a scene to the device.

        Raises
        ------
        UnsupportedError
            The scene holds something that this engine does not draw.
        """
        for item in scene.objects:
            if type(item) not in METHODS:
                names = ", ".join(kind.__name__ for kind in METHODS)
                raise UnsupportedError(f"engine gl draws {names}, the scene holds a {type(item).__name__}")
        middle = scene.bounds.mean(axis=0)
        with self.device as device:
            device.check_lights(len(scene.lights or ()))
            return Prepared(scene, middle, make_stages(device, scene, middle), Blocks(device))

    def update(self, prepared: Prepared, scene: Scene) -> Prepared:
        """The same objects under other transforms and transfer functions: stages of what has not changed stay.

        A scene that has moved far from where it was prepared is prepared again: its middle is the origin of float32.
        """
        low, high = scene.bounds
        if np.linalg.norm((low + high) / 2 - prepared.middle) > FAR_MOVED * np.linalg.norm(high - low):
            return self.prepare(scene)
        with self.device as device:
            prepared.kept.forget("vertex array")  # they hold on to the buffers of stages that are replaced
            return replace(prepared, scene=scene, stages=make_stages(device, scene, prepared.middle, prepared))

    def beside(self, prepared: Prepared, draw: Draw) -> int:
        """On software OpenGL textures lie in main memory, too; a GPU has its own."""
        return 0 if self.device.is_hardware else frames.texture_bytes(draw, self.device.limits, prepared.kept)

    def draw(self, prepared: Prepared, draw: Draw, target: Target) -> None:
        """Draw a stack of views, or a panel, by `draw.method`."""
        check_method(prepared.scene, draw)
        with self.device as device:
            depths = DepthRange.of(prepared.scene, draw.camera)
            job = Job(device, prepared.scene, prepared.middle, draw, depths, prepared.blocks, prepared.kept)
            if draw.viewmap is None:
                frames.draw_views(job, prepared.stages, target)
            else:
                frames.draw_panel(with_mask(job), prepared.stages, target)

    def interlace(self, views: NDArray[np.uint8], draw: Draw, out: NDArray[np.uint8]) -> None:
        """Gather a panel from its V views."""
        assert draw.viewmap is not None
        check_interlace(views, draw.viewmap, out)
        with self.device as device:
            frames.interlace(self._gathering(device, draw), views, 0).read(out)

    def merge_view(self, view: NDArray[np.uint8], index: int, draw: Draw, out: NDArray[np.uint8]) -> None:
        """Write into the panel those sub-pixels that show view `index`."""
        with self.device as device:
            job, found, shown = self._gathering(device, draw), np.empty_like(out), np.empty_like(out)
            frames.interlace(job, view[None], index).read(found)
            frames.interlace(job, np.full_like(view[None], 255), index).read(shown)
        out[shown != 0] = found[shown != 0]

    def weave(
        self, quilt: NDArray[np.uint8], grid: tuple[int, int], draw: Draw, size: tuple[int, int]
    ) -> NDArray[np.uint8]:
        """Gather a panel of `size` from a quilt of views of another size, bilinearly."""
        assert draw.viewmap is not None
        tiles = quilt_tiles(quilt, grid, draw.viewmap, size, "linear")
        out = np.empty((size[1], size[0], 3), np.uint8)
        with self.device as device:
            device.check_texture((quilt.shape[1], quilt.shape[0]), "a quilt")
            texture = device.ctx.texture(quilt.shape[1::-1], quilt.shape[2], np.ascontiguousarray(quilt), alignment=1)
            panel = Panel(device, size)
            panel.clear()
            panel.weave(self._gathering(device, draw), texture, tiles, (0, draw.viewmap.views))
            panel.read(out)
        return out

    def _gathering(self, device: Device, draw: Draw) -> Job:
        """A job without a scene, to gather pictures by the mask."""
        nothing: Any = None
        return with_mask(Job(device, nothing, np.zeros(3), draw, nothing, Blocks(device), Kept()))


def draws(scene: Scene) -> bool:
    """Whether this engine draws all of a scene together, as far as that is known without a device."""
    known = all(type(item) in METHODS for item in scene.objects)
    return known and len(composed([item for item in scene.objects if isinstance(item, Volume)])) <= TOGETHER


def make_stages(
    device: Device, scene: Scene, middle: NDArray[np.float64], before: Prepared | None = None
) -> list[Any]:
    """The stages of a scene, in drawing order; those `before` whose objects are the same are used again."""
    stages: list[Any] = []
    for kind, make in STAGES:
        objects = [item for item in scene.objects if type(item) is kind]
        if not objects:
            continue
        old = [] if before is None else [item for item in before.scene.objects if type(item) is kind]
        if before is not None and all(a is b for a, b in zip(objects, old, strict=True)):
            stages.append(before.stages[len(stages)])
        else:
            stages.append(make(device, objects, middle))
    return stages


def with_mask(job: Job) -> Job:
    """The job with its panel's mask, that of the frame before if it still fits."""
    viewmap = job.draw.viewmap
    assert viewmap is not None
    job.blocks.write("Cameras", cameras_block(job.draw.offsets))
    return replace(job, mask=job.kept.get("mask", viewmap, lambda: Mask(job.device, viewmap)))


def check_method(scene: Scene, draw: Draw) -> None:
    """Raise UnsupportedError, listing what there is, unless everything in the scene can be drawn by the method."""
    for kind in {type(item) for item in scene.objects}:
        if draw.method not in METHODS[kind]:
            raise UnsupportedError(
                f"method {draw.method!r}: the gl engine draws a {kind.__name__} by {', '.join(METHODS[kind])}"
            )
    if draw.viewmap is None and draw.method in PANELS_ONLY:
        raise UnsupportedError(f"method {draw.method!r}: for panels only; a stack of views has n-pass and single-pass")
