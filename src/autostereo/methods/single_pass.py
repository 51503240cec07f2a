"""Single pass: one traversal of the scene draws all views, or the panel itself."""

from __future__ import annotations

from typing import Any

from ..engines.engine import Draw, Engine, Target


def beside(engine: Engine, prepared: Any, draw: Draw) -> int:
    """Bytes of the pictures held beside the target."""
    return engine.beside(prepared, draw)


def draw_views(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw the whole stack."""
    engine.draw(prepared, draw, target)


def draw_panel(engine: Engine, prepared: Any, draw: Draw, target: Target) -> None:
    """Draw every sub-pixel of the panel for its own camera."""
    engine.draw(prepared, draw, target)
