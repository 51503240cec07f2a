"""ViewMap: the phase form, the table form, reversal, cells, and offsets between cameras."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo.errors import InputError
from autostereo.viewmap import ViewMap, cell_index, offset_at

RNG = np.random.default_rng(1)


def phase_map(views: int = 8, a: float = 0.37, b: float = -0.12, **options: object) -> ViewMap:
    return ViewMap(views, a=a, b=b, offsets=np.array([[0.1, 0.22, 0.34]]), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (0, [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]),
        (1, [[0, 1, 0, 1], [1, 0, 1, 0], [0, 1, 0, 1], [1, 0, 1, 0]]),
        (2, [[0, 1, 0, 1], [0, 1, 0, 1], [0, 1, 0, 1], [0, 1, 0, 1]]),
        (3, [[0, 2, 0, 2], [1, 3, 1, 3], [2, 0, 2, 0], [3, 1, 3, 1]]),
        (4, [[0, 0, 0, 0], [1, 1, 1, 1], [0, 0, 0, 0], [1, 1, 1, 1]]),
    ],
)
def test_cells_of_a_block_of_4_by_4_pixels(mode: int, expected: list[list[int]]) -> None:
    y, x = np.mgrid[:4, :4]  # y from the bottom: the first line of `expected` is the lowest row
    assert cell_index(mode, x, y).tolist() == expected


@pytest.mark.parametrize("mode", range(5))
@pytest.mark.parametrize("height", [4, 5])
def test_cells_count_rows_from_the_bottom(mode: int, height: int) -> None:
    offsets = np.arange(12).reshape(4, 3) / 16  # each cell and channel has a phase of its own
    vm = ViewMap(16, offsets=offsets, cell_mode=mode, height=height)
    phase = vm.phase(np.arange(height), np.arange(4))
    for r in range(height):
        for x in range(4):
            assert phase[r, x].tolist() == offsets[int(cell_index(mode, x, height - 1 - r))].tolist()


def test_cell_index_wraps_to_the_number_of_cells() -> None:
    vm = ViewMap(4, offsets=np.array([[0.0, 0, 0], [0.5, 0.5, 0.5]]), cell_mode=3, height=8)
    cells = cell_index(3, np.arange(4)[None, :], 7 - np.arange(8)[:, None]) % 2
    assert np.array_equal(vm.phase(np.arange(8), np.arange(4))[..., 0], cells / 2)


@settings(deadline=None)
@given(
    a=st.floats(-2, 2), b=st.floats(-2, 2), o=st.floats(-50, 50), views=st.integers(1, 200), r=st.integers(0, 9000)
)
def test_phase_and_view_stay_in_range_and_reverse_mirrors(a: float, b: float, o: float, views: int, r: int) -> None:
    rows, columns = np.array([0, r]), np.arange(0, 8000, 613)
    forward = ViewMap(views, a=a, b=b, offsets=np.full((1, 3), o))
    backward = ViewMap(views, a=a, b=b, offsets=np.full((1, 3), o), reverse=True)
    phi, mirrored = forward.phase(rows, columns), backward.phase(rows, columns)
    for p in (phi, mirrored):
        assert (p >= 0).all() and (p < 1).all()
    assert np.array_equal(mirrored, np.where((phi == 0) | (1 - phi >= 1), 0, 1 - phi))
    view = forward.view(rows, columns)
    assert view.min() >= 0 and view.max() < views
    assert np.array_equal(view, np.floor(phi * views).astype(int))
    assert np.array_equal(backward.view(rows, columns), views - 1 - view)


def test_phase_follows_the_fixed_order_of_operations() -> None:
    vm = phase_map()
    rows, columns = np.arange(7), np.arange(11)
    for r in rows:
        for x in columns:
            for c in range(3):
                t = float(vm.a * x + vm.b * r) + float(vm.offsets[0, c])  # type: ignore[index]
                assert vm.phase(np.array([r]), np.array([x]))[0, 0, c] == t - np.floor(t)


def test_continuous_is_phase_times_views_minus_half() -> None:
    vm = phase_map(continuous=True)
    rows, columns = np.arange(5), np.arange(9)
    assert np.array_equal(vm.camera(rows, columns), vm.phase(rows, columns) * 8 - 0.5)
    discrete = phase_map().camera(rows, columns)
    assert discrete.dtype == np.float64
    assert np.array_equal(discrete, np.floor(vm.camera(rows, columns) + 0.5))


def test_table_repeats_and_reverses() -> None:
    table = RNG.integers(0, 5, (3, 4, 3))
    vm = ViewMap(5, table)
    rows, columns = np.arange(8), np.arange(10)
    expected = table[rows[:, None] % 3, columns[None, :] % 4]
    assert np.array_equal(vm.view(rows, columns), expected)
    assert vm.view(rows, columns).dtype == np.int32
    assert np.array_equal(ViewMap(5, table, reverse=True).view(rows, columns), 4 - expected)
    assert np.array_equal(vm.camera(rows, columns), expected.astype(float))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (dict(views=0, table=np.zeros((1, 1, 3), int)), "views: expected a whole number 1…4096, got 0"),
        (dict(views=True, table=np.zeros((1, 1, 3), int)), "views: expected a whole number"),
        (dict(views=2.0, table=np.zeros((1, 1, 3), int)), "views: expected a whole number"),
        (dict(views=2), "either a table or a phase"),
        (dict(views=2, table=np.zeros((1, 1, 3), int), offsets=np.zeros((1, 3))), "either a table or a phase"),
        (dict(views=2, table=np.zeros((2, 3), int)), r"table: expected shape \(h, w, 3\), got \(2, 3\)"),
        (dict(views=2, table=np.zeros((0, 2, 3), int)), "table: expected shape"),
        (dict(views=2, table=np.zeros((1, 1, 3))), "table: expected integers, got float64"),
        (dict(views=2, table=np.full((1, 1, 3), 2)), "view indices 0…1, found 2…2"),
        (dict(views=2, table=np.full((1, 1, 3), -1)), "found -1…-1"),
        (dict(views=2, table=np.zeros((1, 1, 3), int), continuous=True), "discrete views only"),
        (dict(views=2, offsets=np.zeros((1, 2))), r"offsets: expected shape \(cells, 3\)"),
        (dict(views=2, offsets=np.full((1, 3), np.nan)), "finite phase"),
        (dict(views=2, a=np.inf, offsets=np.zeros((1, 3))), "finite phase"),
        (dict(views=2, offsets=np.zeros((1, 3)), cell_mode=5), "cell_mode: expected one of"),
        (dict(views=2, offsets=np.zeros((2, 3)), cell_mode=1), "height: cells need the panel's number of rows"),
    ],
)
def test_bad_maps_name_the_field(fields: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ViewMap(**fields)


def test_per_pixel_maps_show_one_camera_in_three_sub_pixels() -> None:
    table = np.repeat(np.arange(4, dtype=np.int32).reshape(2, 2, 1), 3, axis=2)
    other = table.copy()
    other[1, 0, 2] = 3
    assert ViewMap(4, table=table).per_pixel and not ViewMap(4, table=other).per_pixel
    assert ViewMap(8, a=0.37, offsets=np.array([[0.1] * 3, [0.4] * 3])).per_pixel and not phase_map().per_pixel


def test_a_table_has_no_phase() -> None:
    with pytest.raises(InputError, match="a table has no phase"):
        ViewMap(2, np.zeros((1, 1, 3), int)).phase(np.arange(1), np.arange(1))


@settings(deadline=None)
@given(st.lists(st.integers(-1000, 1000), min_size=1, max_size=9, unique=True), st.integers(-24, 200))
def test_offset_at_is_piecewise_linear_and_continues(offsets: list[int], eighths: int) -> None:
    offsets = sorted(offsets)
    u = Fraction(eighths, 8)
    if len(offsets) == 1:
        expected = Fraction(offsets[0])
    else:
        k = min(max(int(u // 1), 0), len(offsets) - 2)
        expected = offsets[k] + (u - k) * (offsets[k + 1] - offsets[k])
    assert offset_at(np.array(offsets, float), np.array(float(u))) == float(expected)
