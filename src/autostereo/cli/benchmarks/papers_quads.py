"""2007b, section 4: what covering quads cost by the focal plane's distance: time, and fragments that they generate.

The fragments are counted by the shaders that draw, primitive by primitive, before any of them is discarded: a counting
main stands in front of each one's own. Since it writes to memory, fragments are counted also where depth hides them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...display.display import Display
from ...engines.gl.context import COMPUTE_VERSION, Device, get_device
from ...engines.gl.programs import GL_VERSION, Defines, Programs, source
from ...errors import AutostereoError
from ...render import Renderer
from ...scene.points import Points
from . import papers_data, workloads
from .harness import Figure
from .papers_counts import BINDING
from .papers_data import Subject
from .papers_published import BUNNY, SV
from .papers_studio import CPU, PapersStudio, Row, Way, not_available, noted, on_cpu, programs_in_use

QUADS = "covering-quad"
FOCI = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)  # of the distance to the object
TRIANGLES, SURFELS = "triangles", "surfels"
ONE_VIEW = "quads of one view"
# what draws them: which of a draw's primitives a fragment is of, and when it counts
PRIMITIVES: dict[tuple[str, ...], tuple[str, str]] = {
    ("mesh.vert", "mesh.frag"): ("gl_PrimitiveID", "true"),
    ("quad.vert", "quad.frag"): ("gl_PrimitiveID / 2", "channel == 0"),  # each channel has a quad: count one
    ("points.vert", "points.frag"): ("gl_PrimitiveID / 2", "FIRST"),  # drawn twice: count the first
}
COUNTING = """
#ifdef NEAREST
#define FIRST true
#else
#define FIRST false
#endif
void main() {{
    if ({when}) {{
        atomicAdd(fragments[{which}], 1u);
    }}
    drawing_main();
}}
"""


class FragmentCounting(Programs):
    """A device's programs; those of PRIMITIVES count the fragments of each primitive of a draw."""

    def get(self, *names: str, defines: Defines | None = None, version: int = GL_VERSION) -> Any:
        """The program of these files; see Programs.get."""
        if names not in PRIMITIVES:
            return super().get(*names, defines=defines, version=version)
        key = names, tuple(sorted((defines or {}).items())), version
        if key not in self._made:
            self._device.require(COMPUTE_VERSION, "counting fragments")
            vertices, fragments = names
            texts = {vertices: source(vertices, defines, version), fragments: counting(names, defines)}
            self._made[key] = self.compile(texts)
        return self._made[key]


def counting(names: tuple[str, ...], defines: Defines | None) -> str:
    """The completed text of a program's fragments that also counts them."""
    which, when = PRIMITIVES[names]
    version, rest = source(names[-1], defines, COMPUTE_VERSION).split("\n", 1)
    buffer = f"layout(std430, binding = {BINDING}) buffer Fragments {{ uint fragments[]; }};"
    drawing = rest.replace("void main()", "void drawing_main()")
    return f"{version}\n{buffer}\n{drawing}{COUNTING.format(which=which, when=when)}"


@cache
def programs_of(device: Device) -> FragmentCounting:
    """A device's programs that count, kept."""
    return FragmentCounting(device)


def fragments(renderer: Renderer, way: Way, count: int) -> NDArray[np.uint32]:
    """How many fragments each of the `count` primitives of a scene's only object generates, (count,).

    Of triangles in a single view; else of the quads around them, or around surfels, of the panel's first channel.
    Surfels are in the order that the device holds them in.
    """
    device = get_device()
    with device, programs_in_use(device, programs_of(device)):
        counts = device.ctx.buffer(bytes(4 * count))
        counts.bind_to_storage_buffer(BINDING)
        way.draw(renderer)
        device.ctx.memory_barrier()
        return np.frombuffer(counts.read(), np.uint32)


def focal_plane(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2007b: covering quads by the focal plane's distance from the object, beside the single view."""
    options, size = studio.options, studio.size(512, 512)
    if name == TRIANGLES:
        subject = papers_data.stanford(options, BUNNY)
        count = len(workloads.the_mesh(subject.scene).faces)
    else:
        subject = papers_data.surfels(options, 100_000)
        (cloud,) = subject.scene.objects
        assert isinstance(cloud, Points)
        count = len(cloud.positions)
    rig, filters = workloads.rig_for(subject.scene, 8, size), Display.wavelength_selective(*size)
    alone = rig.with_views(1)
    single = [Way(SV, size, alone, "n-pass"), Way(ONE_VIEW, one_view(size), alone, QUADS)]
    quads = [Way(called(f), filters, replace(rig, focal_distance=f * rig.focal), QUADS) for f in FOCI]
    cpu = [on_cpu(way, f"{way.name}, {CPU}") for way in quads]
    row = studio.row("focal-plane-quads", name, subject, [*single, *quads, *cpu])
    generate = [*single, *quads] if name == TRIANGLES else [single[1], *quads]  # single views have no quads of surfels
    counted = [per_primitive(studio, subject, row, way, count) for way in generate]
    slower = [row.ratio(way.name, called(1.0), note="times the time") for way in quads if way.name != called(1.0)]
    return [*row.rates(), *counted, *slower]


def called(focus: float) -> str:
    """The name of a focal distance, a factor of that of the object."""
    return "in focus" if focus == 1 else f"focus at {focus:g} of the distance"


def one_view(size: workloads.Size) -> Display:
    """A panel whose sub-pixels all show the same view."""
    return Display.from_table(*size, 1, [[[0, 0, 0]]])


def per_primitive(studio: PapersStudio, subject: Subject, row: Row, way: Way, count: int) -> Figure:
    """Mean fragments of a way's primitives, those that face away or lie outside too; a row without it says why."""
    measure = f"fragments a {'triangle' if way.name == SV else 'quad'}, {way.name}"
    value, reason = math.nan, row.refused.get(way.name, "")
    if not reason:
        try:
            value = float(fragments(studio.renderer(subject.scene, "gl"), way, count).mean())
        except AutostereoError as error:
            reason = not_available(error)
    figure = Figure(row.work, measure, value, value, value, "fragments", row.scene, note=reason or "mean of all")
    return noted(figure, subject.words)
