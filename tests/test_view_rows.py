"""View maps row by row: Numba against NumPy bit for bit, in float64 and in fixed point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo.engines.cpu import view_rows
from autostereo.engines.reference.gather import nearest_view
from autostereo.viewmap import ViewMap
from view_maps import EVERY, PHASES, phase_maps


def row_cameras(viewmap: ViewMap, height: int, width: int) -> np.ndarray:
    out = np.empty((height, width, 3))
    for r in range(height):
        view_rows.row_camera(r, width, *view_rows.map_args(viewmap), out[r])
    return out


@EVERY
def test_row_camera_is_view_map_camera(viewmap):
    assert np.array_equal(row_cameras(viewmap, 13, 29), viewmap.camera(np.arange(13), np.arange(29)))


@EVERY
def test_row_phase_is_view_map_phase(viewmap):
    out = np.empty((29, 3))
    for r in range(13):
        view_rows.row_phase(r, 29, *view_rows.map_args(viewmap), out)
        if viewmap.table is None:
            assert np.array_equal(out, viewmap.phase([r], np.arange(29))[0])
        else:
            assert np.array_equal(np.floor(out * viewmap.views), viewmap.view([r], np.arange(29))[0])
        assert out.min() >= 0 and out.max() < 1


@settings(max_examples=60, deadline=None)
@given(phase_maps())
def test_any_phase_map_agrees_bit_for_bit(viewmap):
    assert np.array_equal(row_cameras(viewmap, 13, 17), viewmap.camera(np.arange(13), np.arange(17)))


def nearest_views(viewmap: ViewMap, rows: list[int], width: int) -> np.ndarray:
    m, u = view_rows.map_args(viewmap), np.empty((width, 3))
    out, steps = np.empty((len(rows), 3 * width), np.int32), view_rows.steps_along(width, m)
    for i, r in enumerate(rows):
        view_rows.row_views(r, width, m, steps, u, out[i])
    return out.reshape(len(rows), width, 3)


@EVERY
def test_row_views_are_the_nearest(viewmap):
    expected = nearest_view(viewmap.camera(np.arange(13), np.arange(29)), viewmap.views)
    assert np.array_equal(nearest_views(viewmap, [*range(13)], 29), expected)


@settings(max_examples=200, deadline=None)
@given(phase_maps(), st.sampled_from([1.0, 1e-6, 1e3, 1e7, 1e12, 1e200]), st.integers(0, 12))
def test_row_views_of_any_phase_map(viewmap, scale, row):
    """Also of phases so large that fixed point decides nothing."""
    viewmap = replace(viewmap, a=viewmap.a * scale)
    expected = nearest_view(viewmap.camera([row], np.arange(40)), viewmap.views)
    assert np.array_equal(nearest_views(viewmap, [row], 40), expected)


@settings(max_examples=200, deadline=None)
@given(st.integers(1, 128), st.integers(0, 127), st.sampled_from([0, 1e-17, 1e-13, 1e-10, 3e-10, 1e-9]), st.booleans())
def test_row_views_at_the_border_of_two(views, border, off, reverse):
    """Phases at, just before and just after a border, nearer to it than fixed point can tell."""
    phases = np.array([[(border % views) / views + k * off for k in (-1, 0, 1)]])
    viewmap = ViewMap(views, a=0.0, b=1.0, offsets=phases, reverse=reverse)
    expected = viewmap.view([0, 1, 2], np.arange(4))
    assert np.array_equal(nearest_views(viewmap, [0, 1, 2], 4), expected)


@pytest.mark.parametrize(("name", "certain"), [("slanted", True), ("continuous", True), ("exact wraps", False)])
def test_fixed_point_decides_all_but_borders(name, certain):
    """A lens whose phases meet no border is decided in fixed point, one whose every phase does is not."""
    viewmap, out = PHASES[name], np.empty(3 * 29, np.int32)
    m = view_rows.map_args(viewmap)
    assert view_rows._certain_views(1, m, view_rows.steps_along(29, m), out) == certain
