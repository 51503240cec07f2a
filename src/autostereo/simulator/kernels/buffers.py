"""Depth and colour buffers behind a cache of blocks: what is read and written, in bytes.

The values themselves are always current in `values`; the cache only says what passes between it and memory. A block is
fetched when something is first read from it, or when it leaves and was not written as a whole. It is written back when
it leaves, compressed if that is on; `stored` is its size in memory, 0 while it is known to be clear (fast clear).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .codecs import color_size, depth_size
from .compiling import inlined, kernel
from .lru import FREE, HIT, touch

READ, WRITTEN, HITS, MISSES, RAW, PACKED = range(6)  # RAW and PACKED: write-backs without and with compression
NONE, DEPTH, COLOR = range(3)  # codecs


class Buffer(NamedTuple):
    """One buffer of all its views.

    Attributes
    ----------
    values : ndarray of shape (views, H, W), uint32
        Depths: near/depth in units of 2⁻³², greater is nearer, 0 is clear. Colours: RGBA, red in the low byte.
    block_w, block_h, across, down : int
        Size of a block in pixels, and how many there are in a view.
    pixel_bytes, codec : int
    cache : Lru
    stored : ndarray of shape (blocks,), int32
    written : ndarray of shape (slots,), uint64
        Which pixels of the block in a slot were written.
    fetched, dirty : ndarray of shape (slots,), bool
    farthest, nearest : ndarray of shape (blocks,), uint32
        Bounds of a block's depths, kept on the chip: for Z-max culling as of the last write-back, for Z-min exact.
    counts : ndarray of shape (6,), int64
    work : ndarray of shape (4, block_h, block_w), int64
        The codecs' own memory.
    """

    values: Any
    block_w: int
    block_h: int
    across: int
    down: int
    pixel_bytes: int
    codec: int
    cache: Any
    stored: Any
    written: Any
    fetched: Any
    dirty: Any
    farthest: Any
    nearest: Any
    counts: Any
    work: Any


@inlined
def block_of(buffer, view, x, y):
    return (view * buffer.down + y // buffer.block_h) * buffer.across + x // buffer.block_w


@kernel
def write_back(buffer, block, slot):
    """What happens when the block in `slot` leaves."""
    if not buffer.dirty[slot]:
        return
    bw, bh = buffer.block_w, buffer.block_h
    view = block // (buffer.across * buffer.down)
    y0 = block // buffer.across % buffer.down * bh
    x0 = block % buffer.across * bw
    height, width = buffer.values.shape[1:]
    y1, x1 = min(y0 + bh, height), min(x0 + bw, width)
    full = np.uint64(0)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            full |= np.uint64(1) << np.uint64(y * bw + x)
    counts = buffer.counts
    if not buffer.fetched[slot] and buffer.written[slot] & full != full:
        counts[READ] += buffer.stored[block]
    raw = bw * bh * buffer.pixel_bytes
    size = raw
    if buffer.codec == DEPTH:
        size = min(depth_size(buffer.values[view], x0, y0, bw, bh, buffer.work), raw)
    elif buffer.codec == COLOR:
        size = min(color_size(buffer.values[view], x0, y0, bw, bh, buffer.work), raw)
    counts[WRITTEN] += size
    counts[RAW] += raw
    counts[PACKED] += size
    buffer.stored[block] = size
    least = np.uint32(0xFFFFFFFF)
    for y in range(y0, y1):
        for x in range(x0, x1):
            least = min(least, buffer.values[view, y, x])
    buffer.farthest[block] = least


@inlined
def enter(buffer, block):
    """Bring a block into the cache, without its content. Returns its slot."""
    left = touch(buffer.cache, block)
    slot = buffer.cache.slot_of[block]
    if left == HIT:
        buffer.counts[HITS] += 1
        return slot
    buffer.counts[MISSES] += 1
    if left != FREE:
        write_back(buffer, left, slot)
    buffer.written[slot] = 0
    buffer.fetched[slot] = False
    buffer.dirty[slot] = False
    return slot


@inlined
def pixel_bit(buffer, x, y):
    return np.uint64(1) << np.uint64(y % buffer.block_h * buffer.block_w + x % buffer.block_w)


@inlined
def need(buffer, block, slot, bit):
    """A pixel of the block in `slot` is read."""
    if not buffer.fetched[slot] and buffer.written[slot] & bit == 0:
        buffer.counts[READ] += buffer.stored[block]
        buffer.fetched[slot] = True


@inlined
def mark(buffer, slot, bit):
    """A pixel of the block in `slot` was written."""
    buffer.written[slot] |= bit
    buffer.dirty[slot] = True


@inlined
def passes(depth, block, slot, v, x, y, z, equal, write, trusted):
    """Depth test of a pixel of the block in `slot`; `trusted`: it passes for certain, nothing need be read."""
    bit = pixel_bit(depth, x, y)
    if not trusted:
        need(depth, block, slot, bit)
    stored = depth.values[v, y, x]
    if (z != stored) if equal else (z <= stored):
        return False
    if write:
        depth.values[v, y, x] = z
        depth.nearest[block] = max(depth.nearest[block], z)
        mark(depth, slot, bit)
    return True


@kernel
def flush(buffer):
    """Write everything back; the cache keeps its blocks, clean."""
    for slot in range(len(buffer.cache.line_of)):
        block = buffer.cache.line_of[slot]
        if block >= 0:
            write_back(buffer, np.int64(block), slot)
            buffer.dirty[slot] = False
            buffer.written[slot] = 0
            buffer.fetched[slot] = True
