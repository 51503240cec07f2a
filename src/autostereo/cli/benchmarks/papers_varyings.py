"""2008, section 5: what one more number costs that the geometry shader hands on to the fragments of every copy.

The engine's own programs for `geometry-shader` draw, but for lib/surface.glsl, in whose place stands a surface of just
so many numbers. All of them reach the picture, in a way that no compiler can work out before they are interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...engines.gl.context import Device, get_device
from ...engines.gl.programs import GL_VERSION, SHADERS, Defines, Programs, expand
from ...engines.options import Options
from ...render import Renderer
from . import papers_data, workloads
from .harness import Figure
from .papers_mesh import VIEW_2008
from .papers_published import GEOMETRY, VARYINGS_2008
from .papers_studio import CPU, PapersStudio, Way, on_cpu, programs_in_use

NUMBERS = (13, 14, 16, 24)
FILES = ("mesh_points.vert", "mesh.geom", "mesh.frag")
REST = ("", "float", "vec2", "vec3")

SURFACE = """
struct Surface {
    vec4 fours[FOURS];
#ifdef REST
    REST rest;
#endif
};

uniform vec4 material;
uniform float weight;  // of all but the colour; never set, so 0, which compilers do not know

Surface surface_at(vec3 point, vec3 normal, vec3 color, vec2 uv) {
    vec3 reflected, highlight;
    illuminate(point, normal, vec3(0.0, lens.w, 0.0), material, reflected, highlight);
    Surface s;
    for (int k = 0; k < FOURS; ++k) {
        s.fours[k] = vec4(point * float(k + 1) + normal, point.x * normal.y - float(k));
    }
    s.fours[0].rgb = color * reflected;
#ifdef REST
    s.rest = REST(point * normal);
#endif
    return s;
}

#ifdef COLORING
vec3 surface_color(Surface s, bool front, float v, vec3 paint) {
    float sum = s.fours[0].a * s.fours[0].a;
    for (int k = 1; k < FOURS; ++k) {
        sum += dot(s.fours[k], s.fours[k]);  // not linear: is not what the sums of vertices are
    }
#ifdef REST
    sum += dot(s.rest, s.rest);
#endif
    return s.fours[0].rgb + weight * sum;
}
#endif
"""


class Numbered(Programs):
    """A device's programs, of which those that make copies of triangles hand on so many numbers."""

    def __init__(self, device: Device, numbers: int) -> None:
        super().__init__(device)
        self._numbers = numbers

    def get(self, *names: str, defines: Defines | None = None, version: int = GL_VERSION) -> Any:
        """The program of these files; see Programs.get."""
        if names != FILES:
            return super().get(*names, defines=defines, version=version)
        key = tuple(sorted((defines or {}).items())), version
        if key not in self._made:
            self._made[key] = self.compile({name: text(name, self._numbers, defines, version) for name in FILES})
        return self._made[key]


def text(name: str, numbers: int, defines: Defines | None, version: int) -> str:
    """The completed text of a stage whose surfaces are so many numbers."""
    rest = REST[numbers % 4]
    head = f"#define FOURS {numbers // 4}\n" + (f"#define REST {rest}\n" if rest else "")
    own = (SHADERS / name).read_text(encoding="utf-8").replace('#include "lib/surface.glsl"', head + SURFACE)
    return expand(own, defines, version)


@cache
def programs_of(device: Device, numbers: int) -> Numbered:
    """The programs of a number of numbers, kept."""
    return Numbered(device, numbers)


@dataclass(frozen=True)
class Handing(Way):
    """A way to draw by `geometry-shader` that hands on so many numbers.

    Attributes
    ----------
    numbers : int
    """

    numbers: int = 0

    def draw(self, renderer: Renderer, out: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """Draw a frame."""
        device = get_device()
        with programs_in_use(device, programs_of(device, self.numbers)):
            return super().draw(renderer, out)


def varyings(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """Views of 240×180, about 80,000 triangles, by surfaces of 13 to 24 numbers."""
    subject, size, views = papers_data.sphere(studio.options, 6), studio.size(*VIEW_2008), int(name.split()[0])
    rig, options = workloads.rig_for(subject.scene, views, size), Options(lighting="vertex")
    ways = [Handing(f"{n} numbers", size, rig, GEOMETRY, options=options, numbers=n) for n in NUMBERS]
    row = studio.row("2008-varyings", name, subject, [*ways, on_cpu(Way("", size, rig, options=options), CPU)])
    fewer, more, times, where = VARYINGS_2008
    note = "times the time"
    ratios = []
    for way in ways[1:]:
        ratio = row.ratio(way.name, ways[0].name, note=note)
        printed = times if (ways[0].numbers, way.numbers, views) == (fewer, more, where) else None
        ratios.append(replace(ratio, published=printed))
    return [*row.rates(), *ratios]
