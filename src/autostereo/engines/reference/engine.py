"""The reference engine: the scene is traced sample by sample, for each view's own camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...scene.mesh import Mesh
from ...scene.points import Points
from ...scene.scene import Scene
from ...scene.volume import Volume
from ...viewmap import offset_at
from ..engine import Camera, Draw, Target
from . import gather
from .mesh import Samples, Surface
from .picture import PreparedScene, mean_color, picture
from .picture import visible_hits as visible_hits
from .points import Surfels
from .volume import Field

SAMPLE_BYTES = 250  # of what is held for a sample of a picture of triangles

Array = NDArray[np.float64]

PREPARE: dict[type, Callable[[Any], Any]] = {Mesh: Surface.of, Points: Surfels.of, Volume: Field.of}


class ReferenceEngine:
    """Says what the right picture is. Single pass and n-pass draw the same samples, so they cannot differ.

    Rays are always those of each sample's own eye: `Options.volume` makes no difference. `alpha="averaged"`, a limit
    of 2007's hardware (Hübner 2007b, section 3.6), is drawn where it arose: in panels, in a single pass.
    """

    name = "reference"
    methods: tuple[str, ...] = ("single-pass", "n-pass", "n-pass-subres", "dibr")

    def prepare(self, scene: Scene) -> PreparedScene:
        """Bring all objects into world space.

        Raises
        ------
        UnsupportedError
            The scene holds something that this engine does not draw.
        """
        for item in scene.objects:
            if type(item) not in PREPARE:
                names = ", ".join(kind.__name__ for kind in PREPARE)
                raise UnsupportedError(f"engine reference draws {names}, the scene holds a {type(item).__name__}")
        made: dict[type, list[Any]] = {kind: [] for kind in PREPARE}
        for item in scene.objects:
            made[type(item)].append(PREPARE[type(item)](item))
        return PreparedScene(made[Mesh], made[Points], made[Volume], scene.lights, np.array(scene.background))

    def update(self, prepared: PreparedScene, scene: Scene) -> PreparedScene:
        """Prepare the scene anew: nothing here is dear."""
        return self.prepare(scene)

    def beside(self, prepared: PreparedScene, draw: Draw) -> int:
        """Arrays over the samples of a view, or of the panel: rays, hits, colours, as measured."""
        return SAMPLE_BYTES * draw.options.samples * draw.pixels * (1 if draw.viewmap is None else 3)

    def draw(self, prepared: PreparedScene, draw: Draw, target: Target) -> None:
        """Fill `target`: view by view, or the panel's sub-pixels."""
        if draw.viewmap is not None:
            self._draw_panel(prepared, draw, target)
            return
        for i, offset in enumerate(draw.offsets):
            samples = view_samples(draw.camera, offset, draw.options.samples)
            color, depth, covered = picture(prepared, samples, draw.camera, draw.options)
            target.color[i] = mean_color(color, axis=2)
            if target.depth is not None:
                target.depth[i] = depth.min(axis=2)
            target.covered += covered

    def _draw_panel(self, prepared: PreparedScene, draw: Draw, target: Target) -> None:
        """Each sub-pixel shows its own channel of what its own camera sees."""
        samples = panel_samples(draw)
        color, _, covered = picture(
            prepared, samples, draw.camera, draw.options, averaged=draw.options.alpha == "averaged"
        )
        channels = np.stack([color[:, :, c, :, c] for c in range(3)], axis=2)  # (H, W, 3, n)
        target.color[flips(draw)] = mean_color(channels[..., None], axis=3)[..., 0]
        target.covered += covered

    def interlace(self, views: NDArray[np.uint8], draw: Draw, out: NDArray[np.uint8]) -> None:
        """Gather out[r, x, c] from views (V, H, W, 4) by `draw.viewmap`, with flips; u is rounded to a view."""
        assert draw.viewmap is not None
        gather.interlace(views, draw.viewmap, draw.flip_x, draw.flip_y, out)

    def merge_view(self, view: NDArray[np.uint8], index: int, draw: Draw, out: NDArray[np.uint8]) -> None:
        """Write into the panel those sub-pixels that show view `index`, from its picture (H, W, 4)."""
        assert draw.viewmap is not None
        u = draw.viewmap.camera(np.arange(out.shape[0]), np.arange(out.shape[1]))
        mine = gather.nearest_view(u, draw.viewmap.views) == index
        out[mine] = view[(*flips(draw), slice(3))][mine]

    def weave(
        self, quilt: NDArray[np.uint8], grid: tuple[int, int], draw: Draw, size: tuple[int, int]
    ) -> NDArray[np.uint8]:
        """Gather a panel of `size` from a quilt of views of another size, bilinearly."""
        assert draw.viewmap is not None
        return gather.weave(quilt, grid, draw.viewmap, size, "linear", (draw.flip_x, draw.flip_y))


def flips(draw: Draw) -> tuple[slice, slice]:
    """Index that turns a picture (H, W, …) into what the panel is sent, and back."""
    return slice(None, None, -1 if draw.flip_y else 1), slice(None, None, -1 if draw.flip_x else 1)


def subsample_grid(samples: int) -> tuple[Array, Array]:
    """Positions (n,), (n,) of the samples of a pixel in x and y: a regular k×k grid at (j + ½)/k, n = k²."""
    k = round(samples**0.5)
    y, x = np.divmod(np.arange(k * k), k)
    return (x + 0.5) / k, (y + 0.5) / k


def view_samples(camera: Camera, offset: float, samples: int) -> Samples:
    """Samples (H, W, n) of one view."""
    dx, dy = subsample_grid(samples)
    x = np.arange(camera.width)[None, :, None] + 0.5 + camera.spread * (dx - 0.5) - camera.shift[0]
    y = np.arange(camera.height)[:, None, None] + dy - camera.shift[1]
    return Samples(*np.broadcast_arrays(x, y, np.float64(offset)))


def panel_samples(draw: Draw) -> Samples:
    """Samples (H, W, 3, n) of a panel's picture, before it is mirrored: column x, channel c of row r.

    The view map is evaluated at the pixel where the panel shows the sample. With `sampling="subpixel"` a channel
    is sampled within its own third of the pixel, left to right.
    """
    assert draw.viewmap is not None
    camera, viewmap = draw.camera, draw.viewmap
    rows, columns = np.arange(camera.height), np.arange(camera.width)
    if viewmap.continuous:
        v = offset_at(draw.offsets, viewmap.camera(rows, columns))
    else:
        v = draw.offsets[viewmap.view(rows, columns)]
    v = v[flips(draw)][..., None]
    dx, dy = subsample_grid(draw.options.samples)
    if draw.options.sampling == "subpixel":
        dx = (np.arange(3)[:, None] + dx) / 3
    x = columns[None, :, None, None] + dx
    y = rows[:, None, None, None] + dy
    return Samples(*np.broadcast_arrays(x, y, v))
