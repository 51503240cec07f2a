"""What shaders take of a device is within what every device has, whatever is switched on (OpenGL 4.6, section 23).

What may be more is asked of the device: storage buffers of vertex shaders, how large these are, lights, numbers that
vertices hand on.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

import autostereo as aus
from autostereo.engines.gl import mesh, plane_rasterizer, volume
from autostereo.engines.gl.context import Limits
from autostereo.engines.gl.points_quads import Blended
from autostereo.engines.gl.programs import SHADERS, source
from autostereo.scene.samples import surfel_cloud
from gl_device import need_device

STAGES = sorted(path.name for path in SHADERS.iterdir() if path.is_file())
SWITCH = re.compile(r"#\s*(?:ifn?def\s+(\w+)|(?:el)?if\b.*)")
KINDS = {
    "images": re.compile(r"\buniform\s+[ui]?image\w+\s+\w+"),
    "samplers": re.compile(r"\buniform\s+(?:\w+\s+)*?[ui]?sampler\w+\s+\w+"),
    "storage": re.compile(r"^layout\(std430[^)]*\)[^;{]*\bbuffer\s+\w+"),
    "colours": re.compile(r"^(?:layout\([^)]*\)\s*)?out\s+u?vec4\s+\w+;"),
}
OWN = {
    name for stage in STAGES for name in re.findall(r"^#define (\w+)$", (SHADERS / stage).read_text("utf-8"), re.M)
}
MOST = {"images": 8, "samplers": 16, "storage": 8, "colours": 8}
TOGETHER = 8  # images, storage buffers and colours (GL_MAX_COMBINED_SHADER_OUTPUT_RESOURCES)
UNITS = 8  # bindings of images and of storage buffers


class Zeros(dict):
    """Names that the preprocessor does not know are 0."""

    def __missing__(self, name: str) -> int:
        return 0


@cache
def lines_of(stage: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """A stage's lines that matter, and the switches that it looks at and no stage sets by itself."""
    wanted: list[str] = []
    for line in (text.split("//")[0].strip() for text in source(stage).splitlines()):
        if not line.startswith("#"):
            wanted += [line] if any(kind.search(line) for kind in KINDS.values()) else []
        elif not line.startswith("#endif"):
            wanted.append(line)
        else:  # what nothing depends on goes
            while wanted[-1].startswith("#el"):
                wanted.pop()
            if wanted[-1].startswith("#if"):
                wanted.pop()
            else:
                wanted.append(line)
    asked = {name for line in wanted for name in re.findall(r"#\s*ifn?def\s+(\w+)|defined\((\w+)\)", line)}
    names = {a or b for a, b in asked}
    return tuple(wanted), tuple(sorted(name for name in names if name not in OWN or is_given(stage, name)))


def is_given(stage: str, name: str) -> bool:
    """Whether a stage's own file looks at a switch that it does not set."""
    text = (SHADERS / stage).read_text("utf-8")
    return re.search(rf"#\s*ifn?def {name}$", text, re.M) is not None and f"#define {name}\n" not in text


def size(line: str) -> int:
    """How many a line declares: one, or one for each volume that is drawn at a time."""
    found = re.search(r"\[(\w+)\];", line)
    assert found is None or found[1] == "VOLUMES", line
    return 1 if found is None or "buffer" in line else volume.TOGETHER


def kept(lines: tuple[str, ...], switches: set[str]) -> list[str]:
    """What the preprocessor leaves."""
    defined, stack, result = set(switches), [True], []
    for line in lines:
        word = line[1:].split()[0] if line.startswith("#") else ""
        if word in ("ifdef", "ifndef"):
            stack.append((line.split()[1] in defined) == (word == "ifdef"))
        elif word == "if":
            test = re.sub(r"defined\((\w+)\)", lambda m: str(m[1] in defined), line[3:])
            test = test.replace("||", " or ").replace("&&", " and ").replace("!", " not ")
            stack.append(bool(eval(test, {}, Zeros())))
        elif word == "else":
            stack[-1] = not stack[-1]
        elif word == "endif":
            stack.pop()
        elif word == "define" and all(stack):
            defined.add(line.split()[1])
        elif not word and all(stack):
            result.append(line)
    assert stack == [True]
    return result


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_takes_no_more_than_every_device_has(stage: str) -> None:
    lines, names = lines_of(stage)
    assert len(names) <= 12
    for count in range(len(names) + 1):
        for switches in itertools.combinations(names, count):
            left = kept(lines, set(switches))
            found = {kind: [line for line in left if pattern.search(line)] for kind, pattern in KINDS.items()}
            counts = {kind: sum(map(size, lines)) for kind, lines in found.items()}
            for kind, lines in found.items():
                most = 0 if kind == "images" and stage.endswith((".vert", ".geom")) else MOST[kind]
                assert counts[kind] <= most, (kind, switches, lines)
            assert counts["images"] + counts["storage"] + counts["colours"] <= TOGETHER, (switches, found)
            for kind in ("images", "storage"):
                units = [int(n) for line in found[kind] for n in re.findall(r"binding = (\d+)", line)]
                assert len(units) == len(set(units)) == len(found[kind]), (switches, found[kind])
                assert max(units, default=0) < UNITS


def test_the_count_counts() -> None:
    """Nine images are found, and those behind a switch only with it."""
    nine = tuple(f"layout(r32ui, binding = {k}) uniform uimage2D a{k};" for k in range(9))
    assert len(kept(nine, set())) == 9 and all(KINDS["images"].search(line) for line in nine)
    behind = ("#ifdef A", nine[0], "#else", nine[1], nine[2], "#endif")
    assert len(kept(behind, {"A"})) == 1 and len(kept(behind, set())) == 2
    assert any(KINDS["images"].search(line) for line in lines_of("plane_fine.comp")[0])
    left = kept(lines_of("volume.frag")[0], {"PANEL", "VIEWMAP_TABLE", "OPAQUE", "COVERED", "SHADED"})
    assert sum(size(line) for line in left if KINDS["samplers"].search(line)) == 3 * volume.TOGETHER + 3


RIG = aus.Rig(position=(0, 0, 4), views=2)
SQUARE = aus.Mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
PANEL = aus.Display.lenticular(12, 8, 2)


def poorer(monkeypatch: pytest.MonkeyPatch, **limits: int) -> None:
    """A device that has less, and has compiled nothing."""
    device = need_device()
    monkeypatch.setattr(device, "limits", replace(device.limits, **limits))
    monkeypatch.setattr(device.programs, "_made", {})


def test_a_device_without_buffers_in_vertex_shaders_is_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    poorer(monkeypatch, vertex_buffers=0)
    with pytest.raises(aus.UnsupportedError, match=r"quad.vert needs \d storage buffers, .* have 0"):
        aus.render(SQUARE, PANEL, RIG, method="covering-quad", engine="gl")
    aus.render(surfel_cloud(500), PANEL, RIG, method="covering-quad", engine="gl")


def refuse(*_: object) -> None:
    raise aus.UnsupportedError("refused")


def test_an_error_amid_a_drawing_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither blending by the least, as points have it, nor clip distances, which meshes have."""
    draw = partial(aus.render, SQUARE, PANEL, RIG, engine="gl")
    expected = draw(method="covering-quad").pixels.copy()
    assert expected.any()
    with pytest.raises(aus.UnsupportedError, match="refused"):
        monkeypatch.setattr(mesh, "copies_at_once", refuse)
        draw(method="geometry-shader")
    with pytest.raises(aus.UnsupportedError, match="refused"):
        monkeypatch.setattr(Blended, "give", refuse)
        aus.render(surfel_cloud(500), PANEL, RIG, method="covering-quad", engine="gl")
    np.testing.assert_array_equal(draw(method="covering-quad").pixels, expected)


@pytest.mark.parametrize("method", ["covering-quad", "plane-rasterizer"])
def test_an_object_that_shaders_cannot_read_is_refused(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    poorer(monkeypatch, storage=4 * 36)
    aus.render(SQUARE, PANEL, RIG, method=method, engine="gl")
    poorer(monkeypatch, storage=4 * 36 - 1)
    with pytest.raises(aus.UnsupportedError, match=r"takes 0 MB, shaders of this device read 0 MB .*another method"):
        aus.render(SQUARE, PANEL, RIG, method=method, engine="gl")
    aus.render(SQUARE, PANEL, RIG, method="instanced", engine="gl")


@pytest.mark.parametrize(("limits", "points"), [({"storage": 499 * 12 * 4}, 500), ({"texture": 2}, 1171)])
def test_points_that_shaders_cannot_read_are_refused(monkeypatch, limits, points) -> None:
    poorer(monkeypatch, **limits)
    with pytest.raises(aus.UnsupportedError, match=f"{points} points are more than shaders of .* read, {points - 1}"):
        aus.render_views(surfel_cloud(points), RIG, (8, 8), engine="gl")


def test_more_lights_than_a_shader_can_be_told_of_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    most = 78  # of the 1024 numbers that OpenGL promises
    poorer(monkeypatch, uniforms=1024)
    lights = [aus.DirectionalLight((0, 0, -1), (0.01, 0.01, 0.01))] * (most + 1)
    aus.render_views(aus.Scene(SQUARE, lights[:most]), RIG, (8, 8), engine="gl")
    with pytest.raises(aus.UnsupportedError, match=r"79 lights are more than .*, 78 "):
        aus.render_views(aus.Scene(SQUARE, lights), RIG, (8, 8), engine="gl")


def test_what_quads_hand_on_is_asked_of_the_device(monkeypatch: pytest.MonkeyPatch) -> None:
    poorer(monkeypatch, vertex_outputs=60)
    image = np.zeros((2, 2, 3), np.uint8)
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    shiny = replace(SQUARE, material=aus.Material(specular=0.5), uv=uv, texture=image)
    draw = partial(aus.render, shiny, PANEL, RIG, method="covering-quad", engine="gl")
    draw()
    with pytest.raises(aus.UnsupportedError, match=r"hand on 69 numbers, 60 at most .*lighting='sample'"):
        draw(options=aus.Options(lighting="vertex"))


def test_pictures_that_entries_have_no_bits_for_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    need_device()
    monkeypatch.setattr(plane_rasterizer, "MAX_SIDE", 16)
    aus.render_views(SQUARE, RIG, (16, 8), engine="gl", method="plane-rasterizer")
    with pytest.raises(aus.UnsupportedError, match="at most 16 pixels a side, this one 8×17"):
        aus.render_views(SQUARE, RIG, (8, 17), engine="gl", method="plane-rasterizer")


def test_what_a_device_does_not_tell_is_what_opengl_promises() -> None:
    info = {"GL_MAX_TEXTURE_SIZE": 16384, "GL_MAX_VIEWPORT_DIMS": (16384, 8192), "GL_MAX_3D_TEXTURE_SIZE": 2048,
            "GL_MAX_VARYING_VECTORS": 15, "GL_MAX_DRAW_BUFFERS": 8, "GL_MAX_GEOMETRY_OUTPUT_VERTICES": 256}  # fmt: skip
    limits = Limits.of(info, software=False)
    assert (limits.texture, limits.storage, limits.uniforms) == (8192, 2**24, 1024)
    assert (limits.vertex_outputs, limits.vertex_buffers) == (60, 0)
