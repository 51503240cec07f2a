"""When kernels are compiled, who is told of it, and that the cache is asked first."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from autostereo import jit

numba = pytest.importorskip("numba")


def total(values):
    result = 0.0
    for value in values:
        result += value
    return result


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
def test_whoever_waits_is_told_of_every_type_that_is_new(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    numbers = np.arange(4)

    def told(*types):
        """How often one is told while a new process's kernel sums arrays of these types."""
        kernel, calls = jit.Kernels(Path(__file__).parent).kernel(total), []
        with jit.telling(lambda: calls.append("compiling")):
            assert [kernel(numbers.astype(kind)) for kind in types] == [6.0] * len(types)
        return len(calls)

    assert told(np.uint8) == 1
    assert told(np.uint8) == 0, "it lies in the cache"
    assert told(np.uint8, np.float32) == 1, "which has it for another type only"
    assert told(np.float64, np.int16) == 1, "once is enough"
    assert jit._waiting == []


def test_nobody_is_told_outside_the_block():
    calls = []
    with pytest.raises(ZeroDivisionError), jit.telling(lambda: calls.append(1)):
        raise ZeroDivisionError
    assert jit._waiting == [] and calls == []


def test_waiting_needs_no_numba():
    script = "import sys; from autostereo import jit\nwith jit.telling(print): sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
