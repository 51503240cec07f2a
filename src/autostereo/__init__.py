"""autostereo: all views of a glasses-free 3D display in one pass.

Names are loaded on first use, so that ``import autostereo`` is instant.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "errors": ["AutostereoError", "InputError", "FileError", "UnsupportedError", "DependencyError", "MemoryLimitError"],
    "scene.mesh": ["Mesh"],
    "scene.points": ["Points"],
    "scene.volume": ["Volume"],
    "scene.transfer": ["TransferFunction"],
    "scene.appearance": ["Material", "DirectionalLight", "PointLight"],
    "scene.scene": ["Scene"],
    "display.rig": ["Rig"],
    "display.display": ["Display"],
    "frame": ["ViewStack", "Panel"],
    "viewmap": ["ViewMap"],
    "engines.options": ["Options"],
    "render": ["render", "render_views", "Renderer", "interlace", "observe", "warp"],
    "io": ["load"],
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [*_MODULE_OF, "__version__"]

if TYPE_CHECKING:  # "as" tells type checkers that a name is public
    from .display.display import Display as Display
    from .display.rig import Rig as Rig
    from .engines.options import Options as Options
    from .errors import AutostereoError as AutostereoError
    from .errors import DependencyError as DependencyError
    from .errors import FileError as FileError
    from .errors import InputError as InputError
    from .errors import MemoryLimitError as MemoryLimitError
    from .errors import UnsupportedError as UnsupportedError
    from .frame import Panel as Panel
    from .frame import ViewStack as ViewStack
    from .io import load as load
    from .render import Renderer as Renderer
    from .render import interlace as interlace
    from .render import observe as observe
    from .render import render as render
    from .render import render_views as render_views
    from .render import warp as warp
    from .scene.appearance import DirectionalLight as DirectionalLight
    from .scene.appearance import Material as Material
    from .scene.appearance import PointLight as PointLight
    from .scene.mesh import Mesh as Mesh
    from .scene.points import Points as Points
    from .scene.scene import Scene as Scene
    from .scene.transfer import TransferFunction as TransferFunction
    from .scene.volume import Volume as Volume
    from .viewmap import ViewMap as ViewMap


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'autostereo' has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
    globals()[name] = value
    return value


class _Package(ModuleType):
    """Importing the submodule `render` must not hide the function of the same name."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "render" and isinstance(value, ModuleType):
            value = value.render
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    return sorted(__all__)
