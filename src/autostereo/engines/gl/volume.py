"""Volumes on the gl engine: rays through the tiles of views, or through the sub-pixels of a panel in one pass.

The methods of Hübner 2007a: `n-pass` and its kin follow a ray per pixel of every view; `single-pass` and
`covering-quad` follow the rays of a panel's sub-pixels, each from its own eye, over what was gathered before. Rays
march in the fragment shader (volume.frag), or slices are blended (`Options.proxy`, volume_slices.py).

With `volume="exact"`, and on GPUs, each ray of a panel is a fragment's own, a channel after the other: panels are those
of n passes, to the bit. Elsewhere the three rays of a pixel are followed together. What they share then: the search for
what is empty, and the end of the march; where they pass within 2·NEAR voxels of each other, lookups and their light,
too. A ray's scalar is then that of a lookup at most NEAR voxels beside it, carried on along the gradient g that is
looked up with it (Taylor's first order): it is off by no more than NEAR·max|∂s/∂x − g|, not at all where scalars are
linear. Without light there is no gradient; rays share within 2·NEAR_UNLIT voxels, and are off by NEAR_UNLIT·|∂s/∂x|.
Each ray has its own classification. Displays that show one view in all of a pixel need one ray a pixel.
`volume="exact"` also lights slabs in their middle, not by the mean of the light at their ends. Columns of panels with a
table are drawn in an order in which neighbours show the same views (lib/sorted.glsl).

Order of a scene: isosurfaces are opaque and come before points; then volumes that compose, together; then those of the
greatest value one by one (engines/reference/picture.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...scene.mesh import Mesh
from ...scene.points import Points
from ...scene.volume import Volume
from ...viewmap import ViewMap
from ..reference.shading import lights_in_eye_space
from ..volumes import Slices, make_slices
from .beneath import Beneath
from .context import Device
from .job import Job, Stage, put_lights
from .panel import EVERYTHING, NOTHING, Panel, write_only
from .programs import Defines, put
from .volume_data import TABLE, Look, is_shaded, make_table, place_in, send, table_range
from .volume_slices import slices_on_panel, slices_on_tiles
from .volume_space import most_half_spaces, pixel_in, placing

TOGETHER = 4  # volumes that compose in one march: each takes three of the 16 texture units that there are at least
NEAR, NEAR_UNLIT = 0.75, 0.25  # voxels that a shared lookup may be beside a ray,
PIXELS = 2.0  # and pixels in the middle of the volumes, for where voxels are large
FEW_COLUMNS, MOST_COLUMNS = 4, 16  # of a table that is sorted: a ray a fragment, three rays
LENGTHS = 8  # lengths of slabs per doubling, for which tables are made
SHADERS = {
    "composite": ("volume.vert", "volume.frag"),
    "mip": ("volume.vert", "volume_most.frag"),
    "iso": ("volume.vert", "volume_iso.frag"),
    "slices": ("volume_slice.vert", "volume_slice.frag"),
}
VOXELS, EMPTY, TABLES, COLOR_BEFORE, DEPTH_BEFORE = 0, 4, 8, 12, 13  # texture units


class Rays(Stage):
    """Volumes whose rays are followed; what isosurfaces and other volumes have in common."""

    def __init__(self, device: Device, volumes: Sequence[Volume], middle: NDArray[np.float64]) -> None:
        mine = [v for v in volumes if (v.mode == "iso") == self.opaque]
        self._all = list(volumes)
        self._coarse = device.filters_coarsely
        self._voxels = {id(v): send(device, v) for v in mine}
        self._looks = {id(v): Look(device, v, self._voxels[id(v)]) for v in mine}
        compose = composed(mine)
        if len(compose) > TOGETHER:
            raise UnsupportedError(
                f"engine gl: {len(compose)} volumes of mode 'composite', at most {TOGETHER} can be drawn together: "
                "merge some of them, or choose engine='cpu'"
            )
        self._groups = ([compose] if compose else []) + [[v] for v in mine if v.mode != "composite"]

    opaque = False

    def draws_over(self, job: Job) -> bool:
        """On panels in one pass: rays need no tiles."""
        return job.draw.method in ("single-pass", "covering-quad")

    def draw_views(self, job: Job, tiles: range) -> None:
        """Draw the views of these tiles."""
        slices = self._slices(job)
        for number, group in enumerate(self._groups if slices else []):
            beneath = None
            if not self.opaque and (number > 0 or has_opaque(job)):
                beneath = Beneath.of_tiles(job, tiles, depths=number == 0)
            program = self._program(job, group, slices, beneath)
            program["first_view"] = tiles.start
            if by_slices(job, group):
                assert slices is not None
                slices_on_tiles(job, program, slices.slabs, tiles)
                continue
            # what a mask hides has depth 0; isosurfaces have depths of their own
            test = job.device.ctx.DEPTH_TEST if self.opaque or job.mask is not None else job.device.ctx.NOTHING
            render(job, program, (job.atlas.target, test, self.opaque), len(tiles))
            if job.draw.options.depth and not self.opaque:
                write_only(job.atlas.target, NOTHING)
                program = self._program(job, group, slices, beneath, half_depth=True)
                program["first_view"] = tiles.start
                render(job, program, (job.atlas.target, job.device.ctx.DEPTH_TEST, True), len(tiles))
                write_only(job.atlas.target)

    def draw_panel(self, job: Job, panel: Panel) -> None:
        """Draw the sub-pixels of a panel."""
        slices = self._slices(job)
        for number, group in enumerate(self._groups if slices else []):
            beneath = Beneath.of_panel(job, panel) if number > 0 or has_opaque(job) else None
            target = panel.both if self.opaque else panel.target
            program = self._program(job, group, slices, beneath)
            put(program, columns=job.columns, sample_row=job.row, reach=job.draw.culling)
            if by_slices(job, group):
                assert slices is not None
                slices_on_panel(job, program, slices.slabs, panel)
                continue
            period = sorted_period(job, group)
            drawn = self._sorted(job, panel).target if period else target
            put(program, period=period)
            for channel, mask in enumerate(masks(job, group)):
                put(program, channel=channel)
                write_only(drawn, mask)
                render(job, program, (drawn, job.device.ctx.NOTHING, False))
            write_only(drawn)
            if period:
                self._put_in_order(job, group, panel, period)

    def _sorted(self, job: Job, panel: Panel) -> Panel:
        made: Panel = job.kept.get("sorted panel", panel.size, lambda: Panel(job.device, panel.size))
        return made

    def _put_in_order(self, job: Job, group: list[Volume], panel: Panel, period: int) -> None:
        """Copy what a group has drawn with its columns in another order to the panel."""
        defines: Defines = {"PANEL": True, "SORTED": True, "VOLUMES": len(group)}
        program = job.masked_program("volume.vert", "sorted.frag", defines=defines)
        put(program, reach=job.draw.culling, **placing(group, job.draw.camera))
        self._sorted(job, panel).color.use(0)
        put(program, period=period, picture=0)
        render(job, program, (panel.target, job.device.ctx.NOTHING, False))

    def _slices(self, job: Job) -> Slices | None:
        return make_slices(self._all, job.draw.camera, job.draw.options.step)

    def _program(
        self, job: Job, group: list[Volume], slices: Slices | None, beneath: Beneath | None, half_depth: bool = False
    ) -> Any:
        """The program of a group, told all about the frame."""
        assert slices is not None
        on_panel, way = job.columns is not None, "slices" if by_slices(job, group) else group[0].mode
        defines: Defines = {
            **self._switches(job, group),
            "COARSE": self._coarse,
            "PANEL": on_panel,
            "SORTED": on_panel and sorted_period(job, group) > 0,
            "LANES": lanes(job, group),
            "OPAQUE": beneath is not None and has_opaque(job),
            "COVERED": beneath is not None,
            "AVERAGED": on_panel and job.draw.options.alpha == "averaged",
            "HALF_DEPTH": half_depth,
        }
        make = job.masked_program if on_panel else job.program
        program = make(*SHADERS[way], defines=defines)
        self._tell(program, job, group, slices)
        put(program, background=job.scene.background)
        if beneath is not None:
            beneath.use(program, COLOR_BEFORE, DEPTH_BEFORE)
        return program

    def _switches(self, job: Job, group: list[Volume]) -> Defines:
        """The switches of lib/volume.glsl and lib/volume_light.glsl."""
        lights = lights_in_eye_space(job.scene.lights, job.draw.camera)
        shaded = any(is_shaded(v) for v in group)
        shiny = shaded and any(v.material.specular > 0 for v in group)
        return {
            "VOLUMES": len(group),
            "HALVES": most_half_spaces(group),
            "SHADED": shaded,
            "MIDDLE": job.draw.options.volume == "exact",
            "LIGHTS": len(lights) if shaded else 0,
            "SHINY": shiny,
            "PLACED": any(place[3] != 0 for place, _ in lights),
            "OWN_EYES": self._own_eyes(job),
        }

    def _own_eyes(self, job: Job) -> bool:
        options = job.draw.options
        return options.shading != "center" and (self.opaque or options.volume == "exact")

    def _tell(self, program: Any, job: Job, group: list[Volume], slices: Slices) -> None:
        """Fill the uniforms of a group."""
        voxels, looks = [self._voxels[id(v)] for v in group], [self._looks[id(v)] for v in group]
        for k in range(len(group)):
            voxels[k].texture.use(VOXELS + k)
            looks[k].emptiness.use(EMPTY + k)
        count = range(len(group))
        put(program, voxels=[VOXELS + k for k in count], emptiness=[EMPTY + k for k in count])
        shared = job.draw.options.volume == "shared" and group[0].mode == "composite"
        places = placing(group, job.draw.camera)
        near = min(NEAR if any(is_shaded(v) for v in group) else NEAR_UNLIT, PIXELS * pixel_in(places, job.draw.camera))
        put(program, slices=(slices.first, slices.distance, slices.slabs), share_within=near if shared else -1.0)
        put(program, **places)
        materials = [v.material for v in group]
        lit = [(m.ambient, m.diffuse, m.specular, m.shininess) for m in materials]
        unlit = (1.0, 0.0, 0.0, 0.0)
        put(program, volume_material=[m if is_shaded(v) else unlit for v, m in zip(group, lit, strict=True)])
        put_lights(program, job)
        volume = group[0]
        if volume.mode == "composite":
            self._tell_tables(program, job, group, slices)
        elif looks[0].colors is not None:
            looks[0].colors.use(TABLES)
            put(program, most_colors=TABLES)
            put(program, most_place=place_in((0.0, 1.0), (0.0, 1.0), looks[0].colors.width))
        else:
            (low, high), iso = volume.value_range, volume.iso
            assert iso is not None
            level = np.clip((iso - low) / max(high - low, 1e-300), -1.0, 2.0)  # beyond 0 … 1 nothing is hit
            put(program, level=level, own_color=volume.transfer.evaluate(iso)[:3])

    def _tell_tables(self, program: Any, job: Job, group: list[Volume], slices: Slices) -> None:
        """Tables of pre-integrated slabs: made again for another transfer function or quite another length."""
        step = round(LENGTHS * np.log2(slices.distance))
        for k, volume in enumerate(group):
            each = lanes(job, group)
            make = partial(make_table, job.device, volume, 2.0 ** (step / LENGTHS), each == 3)
            table = job.kept.get(("slab table", k, each), (volume.transfer, step), make)
            table.use(TABLES + k)
        put(program, slab_table=[TABLES + k for k in range(len(group))])
        put(program, table_place=[place_in(table_range(v), v.value_range, TABLE) for v in group])


class Isosurfaces(Rays):
    """Volumes of mode "iso"; a stage (engine.py)."""

    opaque = True


class Volumes(Rays):
    """All other volumes; a stage (engine.py), the last of all."""


def composed(volumes: Sequence[Volume]) -> list[Volume]:
    """Those that are drawn together, TOGETHER at most."""
    return [v for v in volumes if v.mode == "composite"]


def has_opaque(job: Job) -> bool:
    """Whether the scene holds anything that may end a ray."""
    objects = job.scene.objects
    return any(isinstance(o, (Mesh, Points)) or (isinstance(o, Volume) and o.mode == "iso") for o in objects)


def by_slices(job: Job, group: list[Volume]) -> bool:
    """Whether proxy slices are blended: where volumes compose, and no depth is asked for that only a march finds."""
    options = job.draw.options
    return options.proxy == "slices" and group[0].mode == "composite" and not options.depth


def lanes(job: Job, group: list[Volume]) -> int:
    """How many rays a fragment follows: one, or those of a pixel's three sub-pixels."""
    return 1 if job.columns is None or same_rays(job) or apart(job, group) else 3


def same_rays(job: Job) -> bool:
    """Whether the sub-pixels of a panel's pixel see along the same ray."""
    assert job.mask is not None and job.columns is not None
    return one_view(job.mask.viewmap) and len(set(job.columns)) == 1


def apart(job: Job, group: list[Volume]) -> bool:
    """Whether a panel's channels are drawn one after the other, so that fragments follow a ray each.

    Where nothing is approximated; and on GPUs, which three rays at a time cost more registers than sharing saves.
    """
    options = job.draw.options
    alone = job.device.is_hardware or options.volume == "exact"
    return alone and not by_slices(job, group) and options.alpha != "averaged"


def sorted_period(job: Job, group: list[Volume]) -> int:
    """Columns of a table after which a panel shows the same views, if its columns are drawn in another order, else 0.

    So that neighbouring fragments show the same views (lib/sorted.glsl). Single rays of many views differ less from
    column to column than from period to period. Isosurfaces and slices write or blend in place.
    """
    assert job.mask is not None
    table = job.mask.viewmap.table
    if table is None or group[0].mode == "iso" or by_slices(job, group):
        return 0
    period: int = table.shape[1]
    return period if 1 < period <= (MOST_COLUMNS if lanes(job, group) == 3 else FEW_COLUMNS) else 0


def masks(job: Job, group: list[Volume]) -> tuple[tuple[bool, ...], ...]:
    """What of a panel's colours each draw of a group writes."""
    if lanes(job, group) == 3 or same_rays(job):
        return (EVERYTHING,)
    return tuple((*(c == channel for c in range(3)), True) for channel in range(3))


def one_view(viewmap: ViewMap) -> bool:
    """Whether a display shows one view in all of a pixel."""
    each = viewmap.table if viewmap.table is not None else viewmap.offsets
    assert each is not None
    return bool((each == each[..., :1]).all())


def render(job: Job, program: Any, where: tuple[Any, int, bool], tiles: int = 1) -> None:
    """Draw the rectangle of a group into so many tiles, or over a panel.

    where: the target, what is enabled, whether depth is written.
    """
    ctx = job.device.ctx
    target, flags, write_depth = where
    target.use()
    ctx.enable_only(flags)
    target.depth_mask = write_depth
    job.vertex_array(program, []).render(ctx.TRIANGLE_STRIP, vertices=4, instances=tiles)
    target.depth_mask = True
