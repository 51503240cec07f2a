"""What a stage is told: one pass over the scene into the tiles of one atlas; and memory kept from frame to frame."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.scene import Scene
from ..engine import Camera, Draw
from ..reference.shading import lights_in_eye_space
from .atlas import Atlas
from .blocks import Blocks, DepthRange, Mask, attach, frame_block, views_block
from .context import Device
from .programs import Defines, put

VIEW_PIXEL = 15e-9  # seconds of a CPU per pixel of an atlas of views, in any scene, measured on llvmpipe
CLEARLY = 0.7  # of the expected time: estimates err


class Kept:
    """Things that are made again only when what they are made of changes."""

    def __init__(self) -> None:
        self._made: dict[Hashable, tuple[Any, Any]] = {}

    def __contains__(self, name: Hashable) -> bool:
        return name in self._made

    def holds(self, name: Hashable, key: Any) -> bool:
        """Whether `get` would make nothing."""
        return name in self._made and bool(self._made[name][0] == key)

    def get(self, name: Hashable, key: Any, make: Callable[[], Any]) -> Any:
        """What `make` returned for `name` and this key; with another key the old one is let go and made anew."""
        if not self.holds(name, key):
            self._made.pop(name, None)
            self._made[name] = key, make()
        return self._made[name][1]

    def forget(self, kind: str) -> None:
        """Let go of what is kept under names (kind, …)."""
        for name in [name for name in self._made if isinstance(name, tuple) and name[0] == kind]:
            del self._made[name]


@dataclass(frozen=True, eq=False)
class Job:
    """One draw of a scene on a device: what stages draw from.

    Attributes
    ----------
    device : Device
    scene : Scene
    middle : ndarray of shape (3,), float64
        World position of the origin of local coordinates.
    draw : Draw
    depths : DepthRange
    blocks : Blocks
    kept : Kept
        Memory of this scene's.
    mask : Mask, optional
        Of a panel.
    atlas : Atlas
        Where tiles are drawn; `with_atlas` sets it.
    first, count : int
        The view, or channel, of its first tile, and how many tiles are in use.
    columns, row : (float, float, float), float
        Where pixels are sampled, for each channel, if the tiles are channels; else None.
    """

    device: Device
    scene: Scene
    middle: NDArray[np.float64]
    draw: Draw
    depths: DepthRange
    blocks: Blocks
    kept: Kept
    mask: Mask | None = None
    atlas: Atlas = field(default=None, repr=False)  # type: ignore[assignment]  # set before anything is drawn
    first: int = 0
    count: int = 0
    columns: tuple[float, ...] | None = None
    row: float = 0.5

    @property
    def one_depth(self) -> bool:
        """Whether the channels of a panel share one depth: covering quads, unless `Options.alpha` is "exact"."""
        quads = self.columns is not None and self.draw.method == "covering-quad"
        return quads and self.draw.options.alpha != "exact"

    @property
    def views_cost(self) -> float:
        """Expected seconds of a CPU for the pixels of all views, whatever is drawn into them."""
        return VIEW_PIXEL * len(self.draw.offsets) * self.draw.camera.width * self.draw.camera.height

    def with_atlas(
        self, atlas: Atlas, first: int, count: int, positions: tuple[tuple[float, ...] | None, float] = (None, 0.5)
    ) -> Job:
        """The same job for `count` views from `first` on, in an atlas; fills the block Views.

        positions: columns and row; then tiles are channels.
        """
        layout = atlas.layout
        offsets = self.draw.offsets[first : first + count]
        self.blocks.write("Views", views_block(offsets, layout.tiles, layout.sizes))
        return replace(self, atlas=atlas, first=first, count=count, columns=positions[0], row=positions[1])

    def write_frame(self, camera: Camera) -> None:
        """Fill the block Frame for a camera: that of the draw, moved to one of the samples of a pixel."""
        self.blocks.write("Frame", frame_block(camera, self.depths, self.middle))

    def program(self, *names: str, defines: Defines | None = None, version: int = 400) -> Any:
        """A program whose uniform blocks are those of this job; see Programs.get."""
        return attach(self.device.programs.get(*names, defines=defines, version=version))

    def masked_program(self, *names: str, defines: Defines | None = None, version: int = 400) -> Any:
        """A program that includes lib/viewmap.glsl, and is given the panel's mask and mirroring."""
        assert self.mask is not None
        program = self.program(*names, defines={**(defines or {}), **self.mask.defines}, version=version)
        self.mask.use(program)
        put(program, flip=(self.draw.flip_x, self.draw.flip_y))
        return program

    def vertex_array(self, program: Any, content: list[Any], indices: Any = None) -> Any:
        """A vertex array of buffers that live as long as the scene; kept, and its buffers with it."""
        parts = (program, indices, *(item[0] for item in content))
        make = self.device.ctx.vertex_array
        return self.kept.get(
            ("vertex array", *map(id, parts)),
            parts,
            lambda: make(program, [read_by(program, *item) for item in content], index_buffer=indices),
        )

    def cover(self, program: Any) -> None:
        """Draw one triangle that covers the target."""
        self.vertex_array(program, []).render(vertices=3)


def put_lights(program: Any, job: Job) -> None:
    """Give the scene's lights to a program that includes lib/shading.glsl."""
    lights = lights_in_eye_space(job.scene.lights, job.draw.camera)
    put(program, light_place=[place for place, _ in lights], light_color=[color for _, color in lights])


def read_by(program: Any, buffer: Any, formats: str, *names: str) -> tuple[Any, ...]:
    """A buffer, its attributes' formats and names for a vertex array, without those that the program does not read.

    Drivers drop what does not reach the picture, such as normals where there is no light. moderngl's `skip_errors`
    then takes gl_InstanceID for them, which drivers list as an attribute without a place: GL_INVALID_VALUE.
    """
    each = formats.split()
    kept = [part if name in program else part.replace("f", "x") for part, name in zip(each, names, strict=True)]
    return buffer, " ".join(kept), *(name for name in names if name in program)


class Stage:
    """All objects of one kind of a scene, on the device: a base that says what a kind may draw; see engine.py.

    A stage is made as `kind(device, objects, middle)`.
    """

    def draws_over(self, job: Job) -> bool:
        """Whether this draw of a panel uses `draw_panel`, in place of the others."""
        return False

    def costs(self, job: Job) -> tuple[float, float]:
        """Expected seconds of `draw_views` of all views of a panel, and of `draw_channels`, on a CPU; to compare."""
        return 0.0, float("inf")

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of some tiles of the job's atlas."""
        raise NotImplementedError

    def draw_channels(self, job: Job) -> None:
        """Draw the sub-pixels of each channel into its tile of the job's atlas."""
        raise NotImplementedError

    def draw_panel(self, job: Job, panel: Any) -> None:
        """Draw over a gathered panel (panel.Panel)."""
        raise NotImplementedError
