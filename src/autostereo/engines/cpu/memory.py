"""Memory that lives from frame to frame: fresh memory is dear."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from queue import Empty, LifoQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Pool:
    """Memory for one task at a time: made when none is free, kept for the next task."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make, self._free = make, LifoQueue[Any]()
        self._local = threading.local()

    def __enter__(self) -> Any:
        try:
            self._local.item = self._free.get_nowait()
        except Empty:
            self._local.item = self._make()
        return self._local.item

    def __exit__(self, *_: object) -> None:
        self._free.put(self._local.item)


class Memory:
    """Buffers, pools of threads' memory, and things that are made again only when what they are made of changes."""

    def __init__(self) -> None:
        self._buffers: dict[str, NDArray[Any]] = {}
        self._pools: dict[tuple[Any, ...], Pool] = {}
        self._made: dict[Any, tuple[Any, Any]] = {}

    def buffer(self, name: str, shape: tuple[int, ...], dtype: type) -> NDArray[Any]:
        """An uninitialised array of this shape, in memory kept under `name`."""
        count = int(np.prod(shape))
        held = self._buffers.get(name)
        if held is None or held.size < count or held.dtype != dtype:
            held = self._buffers[name] = np.empty(count, dtype)
        return held[:count].reshape(shape)

    def missing(self, name: str, shape: tuple[int, ...], dtype: type) -> int:
        """Bytes that `buffer` would have to take for this array."""
        count, held = int(np.prod(shape)), self._buffers.get(name)
        fits = held is not None and held.size >= count and held.dtype == dtype
        return 0 if fits else count * np.dtype(dtype).itemsize

    def pool(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Pool:
        """Memory for tasks of this kind, key[0], and size; what another size needed is let go."""
        if key not in self._pools:
            for old in [k for k in self._pools if k[0] == key[0]]:
                del self._pools[old]
            self._pools[key] = Pool(make)
        return self._pools[key]

    def remember(self, name: Hashable, key: Any, make: Callable[[], Any]) -> Any:
        """What `make` returned for `name` and this key; with another key it is made anew."""
        if name not in self._made or self._made[name][0] != key:
            self._made[name] = key, make()
        return self._made[name][1]
