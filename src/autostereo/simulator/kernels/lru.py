"""Caches of lines, the least recently used replaced: one structure for every associativity.

Each line of memory has an entry that says in which slot it is, so that a look-up costs one read at any associativity;
the slots of a set form a ring, the most recently used first. Line n belongs to set n mod sets; one set is a fully
associative cache.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .compiling import inlined, kernel

HIT, FREE = -1, -2  # what `touch` answers if no line had to leave


class Lru(NamedTuple):
    """A cache of S slots in G sets over L lines of memory.

    Attributes
    ----------
    slot_of : ndarray of shape (L,), int32
        Slot of each line; −1 absent.
    line_of : ndarray of shape (S,), int32
        Line in each slot; −1 empty.
    newer, older : ndarray of shape (S + G,), int32
        Rings of slots, in order of use; entry S + g is set g's head.
    """

    slot_of: Any
    line_of: Any
    newer: Any
    older: Any


def make_lru(lines: int, slots: int, ways: int = 0) -> Lru:
    """An empty cache of `slots` slots over `lines` lines; `ways` = 0: fully associative."""
    ways = ways or slots
    sets = slots // ways
    newer = np.empty(slots + sets, np.int32)
    older = np.empty(slots + sets, np.int32)
    for g in range(sets):
        ring = [slots + g, *range(g * ways, (g + 1) * ways)]  # from the head to ever older slots
        older[ring] = np.roll(ring, -1)
        newer[ring] = np.roll(ring, 1)
    return Lru(np.full(lines, -1, np.int32), np.full(slots, -1, np.int32), newer, older)


@inlined
def _use(cache, slot, head):
    """Make `slot` the most recently used of its ring."""
    newer, older = cache.newer, cache.older
    if older[head] == slot:
        return
    before, after = newer[slot], older[slot]
    older[before] = after
    newer[after] = before
    first = older[head]
    older[head] = slot
    newer[slot] = head
    older[slot] = first
    newer[first] = slot


@inlined
def touch(cache, line):
    """Use a line. Returns HIT, FREE where it took an empty slot, or the line that had to leave for it."""
    slots = len(cache.line_of)
    sets = len(cache.newer) - slots
    head = slots
    if sets > 1:
        head = slots + line % sets
    slot = cache.slot_of[line]
    if slot >= 0:
        _use(cache, slot, head)
        return np.int64(HIT)
    slot = cache.newer[head]  # the head's newer neighbour is the oldest of all
    left = np.int64(cache.line_of[slot])
    if left >= 0:
        cache.slot_of[left] = -1
    else:
        left = np.int64(FREE)
    cache.line_of[slot] = line
    cache.slot_of[line] = slot
    _use(cache, slot, head)
    return left


@kernel
def play(cache, trace, answers):
    """Use the lines of a trace (N,) in turn; answers (N,) receives what `touch` says."""
    for i in range(len(trace)):
        answers[i] = touch(cache, trace[i])
