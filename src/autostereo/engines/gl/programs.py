"""Shaders are files: found, completed, compiled once per device.

A stage is a file in `shaders/` whose extension names it (.vert .geom .frag .comp). It may include files of
`shaders/lib/`, which include nothing themselves, by a line `#include "lib/name.glsl"`. Constants and switches come in
front of it as `#define`: those of `engines/constants.py` always, others by the caller. There is no template language.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import UnsupportedError
from ..constants import SHADER_CONSTANTS
from .context import GL_VERSION, Device

SHADERS = Path(__file__).parent / "shaders"
STAGES = {".vert": "vertex_shader", ".geom": "geometry_shader", ".frag": "fragment_shader", ".comp": "compute_shader"}
INCLUDE = re.compile(r'^#include "([^"]+)"[^\n]*$', re.MULTILINE)

TYPES = {"f": np.float32, "i": np.int32, "I": np.uint32, "d": np.float64}  # of uniforms, by moderngl's letters

Defines = Mapping[str, "bool | int | float"]


class ShaderError(UnsupportedError):
    """A driver refuses a shader; the message holds its words and the numbered source."""


@cache
def _read(name: str) -> str:
    return (SHADERS / name).read_text(encoding="utf-8")


def _literal(value: float) -> str:
    return repr(value) if isinstance(value, float) else str(value)


def expand(text: str, defines: Defines | None = None, version: int = GL_VERSION) -> str:
    """Complete a stage's text: version, constants, defines and included files.

    A define that is True is defined without a value, one that is False not at all.
    """

    def included(match: re.Match[str]) -> str:
        part = _read(match[1])
        if INCLUDE.search(part):
            raise ValueError(f"{match[1]}: included shaders include nothing themselves")
        return part

    head = [f"#version {version} core"]
    for name, value in {**SHADER_CONSTANTS, **(defines or {})}.items():
        if value is not False:
            head.append(f"#define {name}" if value is True else f"#define {name} {_literal(value)}")
    return "\n".join(head) + "\n" + INCLUDE.sub(included, text)


def source(name: str, defines: Defines | None = None, version: int = GL_VERSION) -> str:
    """The completed text of a stage's file in `shaders/`."""
    return expand(_read(name), defines, version)


def put(program: Any, **uniforms: Any) -> None:
    """Set those of the uniforms, numbers or arrays, that a program has: drivers drop what a shader does not use."""
    for name, value in uniforms.items():
        if name in program:
            uniform = program[name]
            uniform.write(np.ascontiguousarray(value, dtype=TYPES[uniform.fmt[-1]]).tobytes())


def put_textures(program: Any, **textures: tuple[Any, int]) -> None:
    """Bind textures to units, and give them to those of the samplers that a program has."""
    for name, (texture, unit) in textures.items():
        if name in program:
            texture.use(unit)
            program[name] = unit


class Programs:
    """The compiled programs of a device, by their files and defines."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._made: dict[Any, Any] = {}

    def __len__(self) -> int:
        return len(self._made)

    def get(self, *names: str, defines: Defines | None = None, version: int = GL_VERSION) -> Any:
        """The program of these files, one per stage; a single .comp file gives a compute shader.

        Raises
        ------
        ShaderError
            The driver does not compile or link it.
        UnsupportedError
            The context's OpenGL is older than `version`, or its vertex shaders read too few storage buffers.
        """
        key = (names, tuple(sorted((defines or {}).items())), version)
        if key not in self._made:
            self._device.require(version, f"the shader {names[-1]}")
            texts = {name: source(name, defines, version) for name in names}
            self._check_vertex_buffers(texts)
            self._made[key] = self.compile(texts)
        return self._made[key]

    def _check_vertex_buffers(self, texts: Mapping[str, str]) -> None:
        """Vertex shaders may have no storage buffers at all, by OpenGL 4.3; nearly all devices have eight or more."""
        most, renderer = self._device.limits.vertex_buffers, self._device.renderer
        for name, text in texts.items():
            count = text.count("layout(std430") if name.endswith(".vert") else 0
            if count > most:
                raise UnsupportedError(
                    f"the shader {name} needs {count} storage buffers, vertex shaders of {renderer} have {most}: "
                    "choose another method or engine='cpu'"
                )

    def compile(self, texts: Mapping[str, str]) -> Any:
        """Compile completed texts by file name, without keeping the result; `get` is the usual way."""
        ctx = self._device.ctx
        stages = {STAGES[Path(name).suffix]: text for name, text in texts.items()}
        try:
            if "compute_shader" in stages:
                return ctx.compute_shader(stages["compute_shader"])
            return ctx.program(**stages)
        except Exception as error:  # moderngl raises its own, or a plain one
            listing = "\n".join(
                f"--- {name}\n" + "\n".join(f"{i:4d}  {line}" for i, line in enumerate(text.splitlines(), 1))
                for name, text in texts.items()
            )
            names = ", ".join(texts)
            raise ShaderError(f"{self._device.renderer} refuses {names}:\n{error}\n{listing}") from error
