"""What shaders take of a device is within what every device has, whatever is switched on (OpenGL 4.6, section 23).

Storage buffers of vertex shaders are the exception: programs.py asks the device.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from functools import cache

import pytest

import autostereo as aus
from autostereo.engines.gl import volume
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


def test_a_device_without_buffers_in_vertex_shaders_is_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    device = need_device()
    monkeypatch.setattr(device, "limits", replace(device.limits, vertex_buffers=0))
    monkeypatch.setattr(device.programs, "_made", {})
    with pytest.raises(aus.UnsupportedError, match=r"points.vert needs \d storage buffers, .* have 0"):
        aus.render_views(surfel_cloud(500), aus.Rig(position=(0, 0, 4)), (8, 8), engine="gl")
