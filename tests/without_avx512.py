"""A plugin for pytest: kernels are compiled as for a processor that has AVX2, but not AVX-512."""

from __future__ import annotations

from llvmlite import binding

_features = binding.get_host_cpu_features()
_features.update({name: False for name in _features if name.startswith(("avx512", "avx10"))})
binding.get_host_cpu_features = lambda: _features


def pytest_collection_finish() -> None:
    """Nothing has asked for the processor's features before."""
    from autostereo.engines.cpu.simd import LANES

    assert LANES == 8
