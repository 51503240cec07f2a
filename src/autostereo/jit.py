"""Compiling kernels, and the cache of compiled kernels: one `Kernels` for each folder of them.

Numba's own cache does not notice an edit in a jitted callee of another file. Here the cache folder is keyed
by the sources of the whole folder, so that kernels may live in several files and never go stale.

Numba is imported when the first folder of kernels is: `telling` costs nothing where none is.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

_waiting: list[Callable[[], object]] = []  # who is told when something is compiled


@contextmanager
def telling(tell: Callable[[], object]) -> Iterator[None]:
    """Within the block, call `tell` when the first kernel is about to be compiled, not found in the cache."""
    _waiting.append(tell)
    try:
        yield
    finally:
        if tell in _waiting:
            _waiting.remove(tell)


@lru_cache(maxsize=1)
def _listen() -> None:
    """Have Numba say when it compiles."""
    from numba.core import event

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            while _waiting:
                _waiting.pop()()

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", Listener())


class Kernels:
    """The decorators for the kernels of one folder.

    Parameters
    ----------
    folder : Path
        Where the sources lie; every `*.py` in it is part of the key.
    """

    def __init__(self, folder: Path) -> None:
        self.cache = _cache_folder(_key(folder))
        _listen()

    def kernel(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Compile `function`: no GIL, cached, C-like division, never fastmath (kernels must agree bit for bit)."""
        return self._compile(function)

    def inlined(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Compile `function` into its callers: for the small steps of an inner loop.

        Without reference counting (`_nrt`): it neither makes nor keeps arrays, and atomic counts cost as much as a
        pixel.
        """
        return self._compile(function, forceinline=True, _nrt=False)

    def lean(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Compile `function` without reference counting, as `inlined`, but as a function that is called."""
        return self._compile(function, _nrt=False)

    def _compile(self, function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
        from numba import config, njit

        before = config.CACHE_DIR
        try:
            config.CACHE_DIR = str(self.cache or "")
            return njit(nogil=True, cache=self.cache is not None, error_model="numpy", **options)(function)
        finally:
            config.CACHE_DIR = before


def _key(folder: Path) -> str:
    """Digest of the folder's sources, where they lie (Numba's cache asks), the versions, and the processor.

    The processor, because kernels for another have other vectors, which this one's could not even read.
    """
    import numba
    from llvmlite import binding

    processor = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    chosen = numba.config.CPU_NAME, numba.config.CPU_FEATURES, numba.config.ENABLE_AVX
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:3]} {folder} {processor} {chosen}".encode())
    for source in sorted(folder.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder(key: str) -> Path | None:
    """First writable place for the cache: NUMBA_CACHE_DIR, the user's cache, the temporary folder; or None."""
    from numba import config

    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    user = os.getuid() if hasattr(os, "getuid") else "user"
    for base in (config.CACHE_DIR, home / "autostereo", Path(tempfile.gettempdir()) / f"autostereo-{user}"):
        if not base:
            continue
        folder = Path(base) / f"kernels-{key}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return None
