"""Machines: what hardware is simulated, as a TOML file or from Python."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field, fields, replace
from importlib import resources
from typing import Any

from ..checks import check_choice
from ..errors import FileError, InputError
from ..image import as_path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ORDERS = ("by-view", "by-triangle", "sorted")
MEASURES = ("axis", "dot", "axis-unsigned")
SOURCES = ("output-cache", "color-buffer")
FILTERS = ("linear", "tent")
NEIGHBOURS = ("use", "shade")
EXACT = ("middle", "largest")
MAX_BYTES = 1 << 20


def _whole(name: str, value: object, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError(f"machine {name}: expected a whole number from {low} to {high}, got {value!r}")


def _one_of(name: str, value: object, names: tuple[str, ...]) -> None:
    check_choice(f"machine {name}", value, names)


def _flag(name: str, value: object) -> None:
    if not isinstance(value, bool):
        raise InputError(f"machine {name}: expected true or false, got {value!r}")


def _pair(name: str, value: object, high: int) -> tuple[int, int]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"machine {name}: expected [width, height], got {value!r}")
    for number in value:
        _whole(name, number, 1, high)
    return value[0], value[1]


@dataclass(frozen=True)
class Traversal:
    """The order of triangles, tiles and views.

    Parameters
    ----------
    order : {"sorted", "by-triangle", "by-view"}
        The paper's; each triangle to all views, one after the other; the whole scene view by view (brute force).
    measure : {"axis", "dot", "axis-unsigned"}
        Efficiency measure of "sorted": section 5's, equation (4), or section 5's as printed, without the sign.
    tile : (width, height)
        [1, 1] is the scanline traversal.
    views : int
        How many views the machine draws at once; 0: all. More than that take several passes.
    """

    order: str = "sorted"
    measure: str = "axis"
    tile: tuple[int, int] = (8, 8)
    views: int = 0

    def __post_init__(self) -> None:
        _one_of("traversal.order", self.order, ORDERS)
        _one_of("traversal.measure", self.measure, MEASURES)
        object.__setattr__(self, "tile", _pair("traversal.tile", self.tile, 256))
        _whole("traversal.views", self.views, 0, 4096)


@dataclass(frozen=True)
class TextureCache:
    """The texture cache: `bytes`, and `bytes_per_added_view` for each view beyond the first.

    `ways` = 0 is fully associative. `compression` "bc1": textures take 4 bits a texel in memory, and are decompressed
    on the way into the cache.
    """

    bytes: int = 6144
    bytes_per_added_view: int = 0
    line_bytes: int = 64
    ways: int = 0
    compression: str = "none"

    def __post_init__(self) -> None:
        _whole("texture.bytes", self.bytes, 1, 1 << 30)
        _whole("texture.bytes_per_added_view", self.bytes_per_added_view, 0, 1 << 30)
        _whole("texture.line_bytes", self.line_bytes, 4, 4096)
        _whole("texture.ways", self.ways, 0, 1 << 20)
        _one_of("texture.compression", self.compression, ("none", "bc1"))
        if self.line_bytes & (self.line_bytes - 1):
            raise InputError(f"machine texture.line_bytes: expected a power of two, got {self.line_bytes}")
        if self.compression == "bc1" and self.line_bytes < 64:
            raise InputError(f"machine texture.line_bytes: bc1 has blocks of 64 bytes, got lines of {self.line_bytes}")
        for value, name in ((self.bytes, "bytes"), (self.bytes_per_added_view, "bytes_per_added_view")):
            unit = self.line_bytes * (self.ways or 1)
            if value % unit:
                raise InputError(f"machine texture.{name}: expected a multiple of {unit} (lines × ways), got {value}")

    def slots(self, views: int) -> int:
        """Lines in the cache of a machine for so many views."""
        return (self.bytes + (views - 1) * self.bytes_per_added_view) // self.line_bytes


@dataclass(frozen=True)
class BufferCache:
    """The cache of the depth or the colour buffer, and what saves its bandwidth.

    `z_max`, `z_min` are for depth only. A cache holds blocks of `block` pixels of four bytes.
    """

    bytes: int = 512
    bytes_per_added_view: int = 512
    block: tuple[int, int] = (8, 8)
    compression: bool = True
    fast_clear: bool = True
    z_max: bool = False
    z_min: bool = False

    def check(self, name: str) -> None:
        """Raise InputError, naming the fields `name`.*, unless the cache can be built."""
        _whole(f"{name}.bytes", self.bytes, 1, 1 << 30)
        _whole(f"{name}.bytes_per_added_view", self.bytes_per_added_view, 0, 1 << 30)
        w, h = _pair(f"{name}.block", self.block, 64)
        object.__setattr__(self, "block", (w, h))
        for flag in ("compression", "fast_clear", "z_max", "z_min"):
            _flag(f"{name}.{flag}", getattr(self, flag))
        if w * h > 64:
            raise InputError(f"machine {name}.block: expected at most 64 pixels, got {w}×{h}")
        for value, field_name in ((self.bytes, "bytes"), (self.bytes_per_added_view, "bytes_per_added_view")):
            if value % (w * h * 4):
                raise InputError(
                    f"machine {name}.{field_name}: expected a multiple of {w * h * 4} (a block of {w}×{h}), got {value}"
                )
        if name == "color" and (self.z_max or self.z_min):
            raise InputError("machine color: z_max and z_min are fields of depth")

    def blocks(self, views: int, pixel_bytes: int = 4) -> int:
        """Blocks in the cache of a machine for so many views."""
        size = self.block[0] * self.block[1] * pixel_bytes
        return max(1, (self.bytes + (views - 1) * self.bytes_per_added_view) // size)


@dataclass(frozen=True)
class Shading:
    """Approximate pixel shader evaluation (section 4.3).

    Parameters
    ----------
    approximate : bool
    sets : int
        The views are cut into so many sets of neighbours, each with its exact view.
    exact : {"middle", "largest"}
        A fixed view of each set, or that in which the triangle is largest.
    tiles : int
        k, entries of the shader output cache.
    filter : {"linear", "tent"}
    single_neighbour : {"use", "shade"}
    source : {"output-cache", "color-buffer"}
        The latter fails with blending, as the paper found.
    unified_camera : bool
        All views are shaded for the centre camera, also without approximation.
    """

    approximate: bool = False
    sets: int = 1
    exact: str = "middle"
    tiles: int = 4
    filter: str = "linear"
    single_neighbour: str = "use"
    source: str = "output-cache"
    unified_camera: bool = False

    def __post_init__(self) -> None:
        _flag("shading.approximate", self.approximate)
        _flag("shading.unified_camera", self.unified_camera)
        _whole("shading.sets", self.sets, 1, 4096)
        _whole("shading.tiles", self.tiles, 1, 4096)
        _one_of("shading.exact", self.exact, EXACT)
        _one_of("shading.filter", self.filter, FILTERS)
        _one_of("shading.single_neighbour", self.single_neighbour, NEIGHBOURS)
        _one_of("shading.source", self.source, SOURCES)


@dataclass(frozen=True)
class Machine:
    """A rasteriser for several views.

    Parameters
    ----------
    name, source : str
        `source`: where the machine is described.
    traversal : Traversal
    texture : TextureCache
    depth, color : BufferCache
    shading : Shading
    """

    name: str = "multi-view"
    source: str = ""
    traversal: Traversal = field(default_factory=Traversal)
    texture: TextureCache = field(default_factory=TextureCache)
    depth: BufferCache = field(default_factory=lambda: BufferCache(z_max=True))
    color: BufferCache = field(default_factory=BufferCache)
    shading: Shading = field(default_factory=Shading)

    def __post_init__(self) -> None:
        self.depth.check("depth")
        self.color.check("color")
        (tw, th), (bw, bh) = self.traversal.tile, self.depth.block
        if (self.depth.z_max or self.depth.z_min) and (bw % tw or bh % th):
            raise InputError(
                f"machine depth: z_max and z_min need tiles that blocks consist of; "
                f"got tiles {tw}×{th}, blocks {bw}×{bh}"
            )
        if self.shading.approximate and self.traversal.order == "by-view":
            raise InputError('machine shading.approximate: needs order "sorted" or "by-triangle", got "by-view"')

    def cache_bytes(self, views: int) -> int:
        """All caches of a machine for so many views."""
        parts = (self.texture, self.depth, self.color)
        return sum(part.bytes + (views - 1) * part.bytes_per_added_view for part in parts)

    def check_size(self, size: tuple[int, int]) -> None:
        """Refuse pictures that are smaller than a tile or a block."""
        for name, (w, h) in (
            ("traversal.tile", self.traversal.tile), ("depth.block", self.depth.block), ("color.block",
            self.color.block)
        ):  # fmt: skip
            if w > size[0] or h > size[1]:
                raise InputError(f"machine {name}: {w}×{h} is larger than the frame of {size[0]}×{size[1]}")

    @staticmethod
    def load(name: str | os.PathLike[str]) -> Machine:
        """A built-in machine by name (`Machine.names()`), or a path to a .toml like those.

        Raises
        ------
        InputError, FileError
            There is no such machine, or a field is unknown or impossible; the message names it.
        """
        folder = resources.files(__package__).joinpath("machines")
        if isinstance(name, str) and not name.lower().endswith(".toml"):
            if name not in Machine.names():
                raise InputError(f"machine: expected one of {', '.join(Machine.names())} or a .toml file, got {name!r}")
            return _parsed(folder.joinpath(f"{name}.toml").read_text(encoding="utf-8"), name)
        path = as_path(name)
        try:
            if path.stat().st_size > MAX_BYTES:
                raise FileError(f"{path}: expected a machine of at most {MAX_BYTES} bytes")
            text = path.read_text(encoding="utf-8-sig")
        except FileError:
            raise
        except OSError as error:
            raise FileError(f"{path}: cannot be read ({error.strerror})") from error
        except UnicodeDecodeError as error:
            raise FileError(f"{path}: expected text ({error})") from error
        return _parsed(text, str(path))

    @staticmethod
    def names() -> list[str]:
        """The built-in machines."""
        entries = resources.files(__package__).joinpath("machines").iterdir()
        return sorted(entry.name[: -len(".toml")] for entry in entries if entry.name.endswith(".toml"))

    def with_(self, **changes: Any) -> Machine:
        """A copy with some fields of its parts changed: with_(texture={"bytes": 12288}, name="twice")."""
        parts = {k: replace(getattr(self, k), **v) if isinstance(v, dict) else v for k, v in changes.items()}
        return replace(self, **parts)


def _parsed(text: str, origin: str) -> Machine:
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{origin}: expected TOML ({error})") from error
    parts: dict[str, Any] = {
        "traversal": Traversal, "texture": TextureCache, "depth": BufferCache, "color": BufferCache, "shading": Shading
    }  # fmt: skip
    known = {f.name for f in fields(Machine)}
    made: dict[str, Any] = {}
    for key, value in content.items():
        if key not in known:
            raise FileError(f"{origin}: unknown field {key!r}; expected {', '.join(sorted(known))}")
        if key not in parts:
            if not isinstance(value, str):
                raise FileError(f"{origin}: machine {key}: expected text, got {value!r}")
            made[key] = value
            continue
        if not isinstance(value, dict):
            raise FileError(f"{origin}: expected a table [{key}], got {value!r}")
        names = {f.name for f in fields(parts[key])}
        for inner in value:
            if inner not in names:
                raise FileError(f"{origin}: unknown field {key}.{inner}; expected {', '.join(sorted(names))}")
        try:
            made[key] = parts[key](**value)
        except InputError as error:
            raise FileError(f"{origin}: {error}") from error
    try:
        return Machine(**made)
    except InputError as error:
        raise FileError(f"{origin}: {error}") from error
