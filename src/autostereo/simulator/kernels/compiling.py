"""The decorators for the simulator's kernels, and their cache (`autostereo.jit`)."""

from __future__ import annotations

from pathlib import Path

from ...jit import Kernels

_kernels = Kernels(Path(__file__).parent)
kernel, inlined, is_compiled = _kernels.kernel, _kernels.inlined, _kernels.is_compiled
