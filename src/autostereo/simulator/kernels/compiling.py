"""The decorators for the simulator's kernels, and their cache (`autostereo.jit`).

No kernel here makes an array: what they work in is handed to them. So nothing is counted, and a call costs little.
"""

from __future__ import annotations

from pathlib import Path

from ...jit import Kernels

_kernels = Kernels(Path(__file__).parent)
kernel, inlined = _kernels.lean, _kernels.inlined
