"""The decorators for the cpu engine's kernels, and their cache (`autostereo.jit`)."""

from __future__ import annotations

from pathlib import Path

from ...jit import Kernels
from . import simd_compiled  # noqa: F401  (kernels may use the vectors of `simd`)

_kernels = Kernels(Path(__file__).parent)
CACHE = _kernels.cache
kernel, inlined, lean = _kernels.kernel, _kernels.inlined, _kernels.lean
