"""What reusing colours costs: said after a render with `--shading reuse`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..engines.options import Options
from ..errors import MemoryLimitError
from .common import note, working


def note_reuse(picture: Any, options: Options, draw: Callable[[Options], Any]) -> None:
    """Say which share of the samples was reused, and how near the picture comes to `draw` with exact shading."""
    if picture.reused is None:
        return
    said = f"{picture.reused:.0%} of the samples have a nearby view's colour"
    try:
        with working("comparing with exact shading"):
            exact = draw(replace(options, shading="exact"))
        note(f"{said}; PSNR {picture.psnr(exact):.1f} dB against exact shading")
    except MemoryLimitError:  # the picture is good, there is no room for a second one
        note(said)
