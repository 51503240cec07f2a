"""The surfels of one block, row by row: what every draw of points does before it comes to samples.

Nearest depths do not depend on the order of surfels: those before the middle of the block are drawn first, so that
most of what they hide is found hidden before it costs anything per sample. Only blending keeps to the order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined
from .points_chord import cut, lens_of
from .points_setup import DEPTH, INVERSE, MATERIAL, PARTS, REACH, ROW0, ROW1, A, X
from .scalars import HALF, ONE, ZERO

BEFORE, BEHIND, BLEND = 0, 1, 2  # stages, see draw_surfels
TWO, WIDE = np.float32(2.0), np.float32(1e9)
CLOSER = np.float32(1.0 - 1e-5)  # rounding brings a sample nearer by less than the rest


class Splats(NamedTuple):
    """The surfels in sight.

    records, words, backs: see points_setup; bin_start (B + 1,), bins: numbers of each block's surfels; materials (M, 4)
    and lights (L, 8) float32; own_eye: sides and highlights are those that each view sees.
    """

    records: np.ndarray
    words: np.ndarray
    backs: np.ndarray
    bin_start: np.ndarray
    bins: np.ndarray
    materials: np.ndarray
    lights: np.ndarray
    own_eye: bool


@inlined
def record_of(records, i):
    """The numbers of surfel i."""
    return (
        records[i, 0], records[i, 1], records[i, 2], records[i, 3], records[i, 4], records[i, 5], records[i, 6],
        records[i, 7], records[i, 8], records[i, 9], records[i, 10], records[i, 11], records[i, 12],
    )  # fmt: skip


@inlined
def middle_depth(start, end, splats):
    """Mean depth of the surfels of a block."""
    total = 0.0
    for entry in range(np.uint64(start), np.uint64(end)):
        total += splats.records[np.uint64(splats.bins[entry]), DEPTH]
    return np.float32(total / (end - start))


@inlined
def draw_surfels(draw_chord, is_hidden, place, stage, bounds, splats, camera, scratch):
    """Call draw_chord(place, blending, row, surfel, chord, done, scratch) for every chord of a block's surfels.

    Three stages: the depths of the surfels before bounds.middle; of those behind it, unless is_hidden(place, nearest,
    record, lens, rows, scratch) by what is drawn then; and the blending of all. bounds = (first row, end row, first
    entry, end entry, middle depth) of the block; row counts from the first; surfel = (record, number, shape, shapes
    that it takes, material, lens); done: what the call before returned, 0 for a surfel's first chord.
    """
    records, words, bins = splats.records, splats.words, splats.bins
    lens, middle, blending = lens_of(camera), bounds[4], stage == BLEND
    for entry in range(np.uint64(bounds[2]), np.uint64(bounds[3])):
        i = np.uint64(bins[entry])
        record = record_of(records, i)
        depth, reach = record[DEPTH], record[REACH]
        if not blending and (depth > middle) != (stage == BEHIND):
            continue
        row0, row1 = max(words[i, ROW0], bounds[0]), min(words[i, ROW1], bounds[1])
        if stage != BEFORE:
            nearest = CLOSER * depth * (ONE - reach) - (depth * reach if blending else ZERO)
            if is_hidden(place, nearest, record, lens, (row0 - bounds[0], row1 - bounds[0]), scratch):
                continue
        parts, material = words[i, PARTS] & np.int32((1 << MATERIAL) - 1), np.uint64(words[i, PARTS] >> MATERIAL)
        done = 0
        for r in range(row0, row1):
            y = np.float32(r) + np.float32(0.5)
            for bit in range(4):
                part = 1 << bit
                if parts & part == 0:
                    continue
                found, chord = cut(record, part, y, lens)
                if found:
                    surfel = (record, np.int32(i), part, parts, material, lens)
                    done = draw_chord(place, blending, r - bounds[0], surfel, chord, done, scratch)


@inlined
def swath(record, lens, low, high):
    """Pixels that a surfel may touch from cameras at offsets low … high, first and last; all for large ones."""
    reach = record[REACH]
    p = lens[2] - lens[0] * record[INVERSE]
    first, last = record[X] + low * p, record[X] + high * p
    # the ball around the surfel: |x − x of its centre| ≤ f·reach·(1 + |a|)/(1 − reach), a the ray's slope
    slope = abs(record[A]) + max(abs(low), abs(high)) * record[INVERSE]
    half = TWO + (lens[0] * reach * (ONE + slope) / (ONE - reach) if reach < HALF else WIDE)
    return min(first, last) - half, max(first, last) + half
