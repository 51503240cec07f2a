"""The surfels of one block, row by row: what every draw of points does before it comes to samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .jit import inlined
from .points_chord import cut, lens_of
from .points_setup import MATERIAL, PARTS, ROW0, ROW1

CLOSER = np.float32(1.0 - 1e-5)  # rounding brings a sample nearer by less than the rest


class Splats(NamedTuple):
    """The surfels in sight.

    records, words: see points_setup; bin_start (B + 1,), bins: numbers of each block's surfels; materials (M, 4) and
    lights (L, 8) float32; own_eye: highlights are those that each view sees.
    """

    records: np.ndarray
    words: np.ndarray
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
def draw_surfels(draw_chord, place, blending, bounds, splats, camera, scratch):
    """Call draw_chord(place, blending, row, surfel, chord, done, scratch) for every chord of a block's surfels.

    bounds = (first row, end row, first entry, end entry) of the block; row counts from the first; surfel = (record,
    number, shape, shapes that it takes, material, lens); done: what the call before returned, 0 for a surfel's first
    chord.
    """
    records, words, bins = splats.records, splats.words, splats.bins
    lens = lens_of(camera)
    for entry in range(np.uint64(bounds[2]), np.uint64(bounds[3])):
        i = np.uint64(bins[entry])
        record = record_of(records, i)
        parts, material = words[i, PARTS] & np.int32(15), np.uint64(words[i, PARTS] >> MATERIAL)
        done = 0
        for r in range(max(words[i, ROW0], bounds[0]), min(words[i, ROW1], bounds[1])):
            y = np.float32(r) + np.float32(0.5)
            for bit in range(4):
                part = 1 << bit
                if parts & part == 0:
                    continue
                found, chord = cut(record, part, y, lens)
                if found:
                    surfel = (record, np.int32(i), part, parts, material, lens)
                    done = draw_chord(place, blending, r - bounds[0], surfel, chord, done, scratch)
