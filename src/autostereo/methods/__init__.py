"""In which order: schedules of draws that work on any engine. METHODS lists every one.

An engine may carry out methods by itself, those here or others (`own_methods`): then one draw is all, and the engine is
told the method's name.
"""

from __future__ import annotations

from types import ModuleType

from ..checks import shown
from ..engines.engine import Engine, engine_that_has
from ..errors import UnsupportedError
from . import dibr, n_pass, n_pass_subres, single_pass

METHODS: dict[str, ModuleType] = {
    "single-pass": single_pass,
    "n-pass": n_pass,
    "n-pass-subres": n_pass_subres,
    "dibr": dibr,
}


def get_method(name: str, engine: Engine) -> ModuleType:
    """Return the schedule called `name`, which has draw_views and draw_panel, if `engine` can draw it."""
    if not isinstance(name, str):
        raise UnsupportedError(f"method {shown(name)}: the {engine.name} engine has {', '.join(engine.methods)}")
    if name in getattr(engine, "own_methods", ()):
        return single_pass
    if name not in METHODS or name not in engine.methods:
        other = engine_that_has(name)
        hint = "" if other in (None, engine.name) else f"; engine {other} has it (--engine {other})"
        raise UnsupportedError(f"method {name!r}: the {engine.name} engine has {', '.join(engine.methods)}{hint}")
    return METHODS[name]
