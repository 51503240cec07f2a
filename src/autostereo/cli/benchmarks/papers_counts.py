"""2020, section 3: the multiplications of the plane rasteriser, counted by its own shaders while they draw.

The source of every stage is rewritten: `a * b` becomes `times(a, b)`, `a / b` becomes `over(a, b)`, and so do `dot` and
`cross`; these functions count the products of floats that they make. A division counts as a multiplication; what is
done with whole numbers, to find places in memory, does not count.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...display.rig import Rig
from ...engines.gl.context import Device, get_device
from ...engines.gl.programs import GL_VERSION, Defines, Programs, source
from ...errors import AutostereoError
from ...render import render_views
from ...scene.appearance import Material
from ...scene.mesh import Mesh
from ...scene.scene import Scene
from .harness import Figure
from .papers_published import MULTIPLICATIONS_2020
from .papers_studio import PapersStudio, not_available, programs_in_use

ONE, N_TIMES = "plane-rasterizer", "plane-rasterizer-n-pass"
STAGES = ("plane_vertex.comp", "plane_setup.comp", "plane_tiles.comp", "plane_fine.comp", "plane_encode.comp")
SHARED = STAGES[:2]  # done once for all views
BINDING = 7  # of the counts: storage buffers that no stage uses
VECTORS = ("vec2", "vec3", "vec4")
WHOLE = ("int", "uint", "ivec2", "ivec3", "uvec2", "uvec3", "uvec4")

TOKEN = re.compile(
    r"#[^\n]*|[A-Za-z_]\w*|0x\w+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?[uUfF]?"
    r"|<<=|>>=|\+\+|--|[-+*/%&|^<>=!]=|<<|>>|&&|\|\||\^\^|\S"
)
KEYWORDS = ("return", "if", "else", "for", "while", "do", "in", "out", "inout", "const", "precise")
FUNCTIONS = {"*": "times", "/": "over", "dot": "counted_dot", "cross": "counted_cross"}


def prelude(slot: int) -> str:
    """The functions that multiply and count, and where the counts go."""
    lines = [
        f"layout(std430, binding = {BINDING}) buffer Counts {{ uint multiplications[{len(STAGES)}]; }};",
        "uint counted = 0u;",
        f"void add_count() {{ atomicAdd(multiplications[{slot}], counted); }}",
        *_function("float", "times", ("float", "float"), "a * b", 1),
        *_function("float", "over", ("float", "float"), "a / b", 1),
        *_function("vec3", "times", ("mat3", "vec3"), "a * b", 9),
        *_function("vec4", "times", ("mat4", "vec4"), "a * b", 16),
        *_function("vec3", "counted_cross", ("vec3", "vec3"), "cross(a, b)", 6),
    ]
    for size, kind in enumerate(VECTORS, 2):
        lines += _function("float", "counted_dot", (kind, kind), "dot(a, b)", size)
        for pair in ((kind, kind), (kind, "float"), ("float", kind)):
            lines += [*_function(kind, "times", pair, "a * b", size), *_function(kind, "over", pair, "a / b", size)]
    for kind in WHOLE:
        single = "uint" if kind.startswith("u") else "int"
        for pair in {(kind, kind), (kind, single), (single, kind)}:
            lines += [*_function(kind, "times", pair, "a * b", 0), *_function(kind, "over", pair, "a / b", 0)]
    return "\n".join(lines) + "\n"


def _function(result: str, name: str, kinds: tuple[str, str], value: str, count: int) -> Iterator[str]:
    yield f"{result} {name}({kinds[0]} a, {kinds[1]} b) {{ counted += {count}u; return {value}; }}"


class Rewriter:
    """The text of a shader with its products replaced, within functions."""

    def __init__(self, text: str) -> None:
        self._tokens = TOKEN.findall(re.sub(r"//[^\n]*", "", text))
        self._at = 0

    def rewritten(self) -> str:
        """The whole text."""
        out: list[str] = []
        while self._at < len(self._tokens):
            token = self._take()
            if token == "{" and out[-1] == ")":
                out.append("{" + self._until("}") + "}")
            else:
                out.append(_line(token) if token != "main" else "counted_main")
        return " ".join(out) + "\nvoid main() { counted_main(); add_count(); }\n"

    def _peek(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1]

    def _until(self, *ends: str) -> str:
        """Up to one of the ends, which is taken if it is a bracket."""
        out = []
        while self._peek() not in ends:
            token = self._peek()
            if token == "{":
                self._take()
                out.append("{" + self._until("}") + "}")
            elif token == "(" or (token[0].isalnum() and token not in KEYWORDS):
                out.append(self._product())
            else:
                out.append(_line(self._take()))
        if len(ends) == 1:
            self._take()
        return " ".join(out)

    def _product(self) -> str:
        """Operands with * and / and % between them, or an assignment of these."""
        left = self._operand()
        while self._peek() in ("*", "/", "%"):
            sign, right = self._take(), self._operand()
            left = f"{FUNCTIONS[sign]}({left}, {right})" if sign in FUNCTIONS else f"({left} {sign} {right})"
        if self._peek() in ("*=", "/="):
            sign = self._take()[0]
            left = f"{left} = {FUNCTIONS[sign]}({left}, {self._until(';', ',', ')')})"
        return left

    def _operand(self) -> str:
        out = ""
        while self._peek() in ("-", "+", "!", "~"):
            out += self._take()
        token = self._take()
        out += "(" + self._until(")") + ")" if token == "(" else FUNCTIONS.get(token, token)
        while self._peek() in (".", "[", "(", "++", "--"):
            token = self._take()
            if token == ".":
                out += token + self._take()
            elif token in ("[", "("):
                end = "]" if token == "[" else ")"
                out += token + self._until(end) + end
            else:
                out += token
        return out


def _line(token: str) -> str:
    return f"\n{token}\n" if token.startswith("#") else token


def counting(text: str, slot: int) -> str:
    """A stage's completed text that also counts, into a slot."""
    version, rest = text.split("\n", 1)
    return f"{version}\n{prelude(slot)}{Rewriter(rest).rewritten()}"


class CountingPrograms(Programs):
    """A device's programs; those of STAGES count."""

    def get(self, *names: str, defines: Defines | None = None, version: int = GL_VERSION) -> Any:
        """The program of these files; see Programs.get."""
        if names[0] not in STAGES:
            return super().get(*names, defines=defines, version=version)
        key = names, tuple(sorted((defines or {}).items())), version
        if key not in self._made:
            text = self.text(names[0], defines, version)
            self._made[key] = self.compile({names[0]: counting(text, STAGES.index(names[0]))})
        return self._made[key]

    def text(self, name: str, defines: Defines | None, version: int) -> str:
        """The completed text of a stage, before it counts."""
        return source(name, defines, version)


def count(views: int, method: str, kind: type[CountingPrograms] = CountingPrograms) -> tuple[dict[str, int], int]:
    """Draw one triangle in a row of views.

    Returns
    -------
    multiplications : dict of int by stage
    samples : int
        That it covers in all views.
    """
    device: Device = get_device()
    corners = np.array([[-0.1, -0.1, 0.0], [0.1, -0.08, -0.1], [0.0, 0.12, 0.1]])
    scene = Scene((Mesh(corners, np.array([[0, 1, 2]]), material=Material(two_sided=False)),), lights=())
    rig = Rig(position=(0, 0, 2), fov_y=18.0, baseline=0.6, views=views)
    with device, programs_in_use(device, kind(device)):
        counts = device.ctx.buffer(bytes(4 * len(STAGES)))
        counts.bind_to_storage_buffer(BINDING)
        color = render_views(scene, rig, (64, 64), engine="gl", method=method).color
        found = np.frombuffer(counts.read(), np.uint32)
    return dict(zip(STAGES, found.tolist(), strict=True)), int((color[..., 3] > 0).sum())


def multiplications(studio: PapersStudio, name: str, lighting: str) -> list[Figure]:
    """2020, section 3: multiplications a sample, by a triangle of some 200 pixels and 9 numbers to interpolate."""
    views = int(name.split()[0])
    try:
        many, covered = count(views, N_TIMES)
        one, _ = count(views, ONE)
    except AutostereoError as error:
        nothing, reason = (math.nan,) * 3, not_available(error)
        return [Figure("2020-multiplications", "counted by shaders", *nothing, "a sample", name, note=reason)]
    alone, each, shared = MULTIPLICATIONS_2020
    note = f"{covered / views:.0f} samples a view; unlit, colour, normal and position interpolated"
    values = {
        ("view by view", "a sample"): (sum(many.values()) / covered, alone),
        ("in one pass", "a sample"): (sum(one.values()) / covered, each + shared / views),
        ("once for all views: vertices, setup", "a triangle"): (sum(one[stage] for stage in SHARED), None),
        ("for each view: tiles", "a triangle"): (one["plane_tiles.comp"] / views, None),
        ("depth, twice", "a sample"): (one["plane_fine.comp"] / covered, None),
        ("interpolation and colour", "a sample"): (one["plane_encode.comp"] / covered, None),
    }
    return [
        Figure("2020-multiplications", called, value, value, value, unit, name, note=note, published=paper)
        for (called, unit), (value, paper) in values.items()
    ]
