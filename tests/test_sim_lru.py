"""The simulator's caches against a dictionary, on random and on hand-written traces."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo.simulator.kernels.lru import FREE, HIT, make_lru, play


def simple_lru(trace: list[int], slots: int, ways: int) -> list[int]:
    """The same answers from ordered dictionaries, one a set."""
    sets = slots // ways
    content: list[OrderedDict[int, None]] = [OrderedDict() for _ in range(sets)]
    answers = []
    for line in trace:
        mine = content[line % sets]
        if line in mine:
            mine.move_to_end(line)
            answers.append(HIT)
        elif len(mine) < ways:
            mine[line] = None
            answers.append(FREE)
        else:
            answers.append(mine.popitem(last=False)[0])
            mine[line] = None
    return answers


def answers(trace: list[int], slots: int, ways: int, lines: int = 40) -> list[int]:
    result = np.empty(len(trace), np.int64)
    play(make_lru(lines, slots, ways), np.array(trace, np.int64), result)
    return result.tolist()


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.integers(0, 39), max_size=300),
    st.sampled_from([(1, 1), (2, 2), (7, 7), (8, 1), (8, 2), (12, 4), (6, 3)]),
)
def test_equal_to_a_dictionary(trace, shape):
    assert answers(trace, *shape) == simple_lru(trace, *shape)


@pytest.mark.parametrize(
    ("trace", "slots", "ways", "expected"),
    [
        ([5, 5, 5], 1, 1, [FREE, HIT, HIT]),
        ([1, 2, 1, 3, 2], 2, 2, [FREE, FREE, HIT, 2, 1]),  # 2 is older than 1, then 1 is older than 3
        ([0, 2, 0, 2], 2, 1, [FREE, 0, 2, 0]),  # directly mapped: both fall into set 0
        ([0, 1, 0, 1], 2, 1, [FREE, FREE, HIT, HIT]),
        ([0, 1, 2, 3, 0], 4, 4, [FREE, FREE, FREE, FREE, HIT]),
        ([0, 1, 2, 3, 0], 3, 3, [FREE, FREE, FREE, 0, 1]),  # a loop one longer than the cache never hits
    ],
)
def test_traces_by_hand(trace, slots, ways, expected):
    assert answers(trace, slots, ways) == expected
