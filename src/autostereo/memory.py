"""Memory for pictures: how much may be taken, and where it begins."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import MemoryLimitError

CACHE_LINE = 64  # bytes


def aligned_empty(shape: tuple[int, ...], dtype: type) -> NDArray[Any]:
    """An array that begins with a cache line, so that engines can write whole lines of it."""
    size = int(np.prod([int(n) for n in shape])) * np.dtype(dtype).itemsize
    room = np.empty(size + CACHE_LINE, np.uint8)
    first = -room.ctypes.data % CACHE_LINE
    return room[first : first + size].view(dtype).reshape(shape)


def check_memory(need: int, what: str) -> None:
    """Raise MemoryLimitError when `need` bytes are more than the machine has free."""
    free = available_memory()
    if free is not None and need > 0.9 * free:
        raise MemoryLimitError(f"{what} would take {gigabytes(need)} of memory, and {gigabytes(free)} are free")


def gigabytes(count: int) -> str:
    """A number of bytes in GB: three digits that count, those before the point all, never an exponent."""
    value = count / 1e9
    text = f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}" if count else "0"
    return f"{text.rstrip('0').rstrip('.') if '.' in text else text} GB"


def available_memory() -> int | None:
    """Bytes of memory that a process may still take, where the system tells."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            for line in file:
                if line.startswith("MemAvailable:"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
