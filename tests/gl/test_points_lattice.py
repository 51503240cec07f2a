"""Lattices of sub-pixels: every sub-pixel lies in the slot of its camera, for any map that has a lattice."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo.engines.gl.points_lattice import find_lattice
from autostereo.viewmap import ViewMap, offset_at
from view_maps import CELLS, MAPS

WIDTH, HEIGHT = 61, 23
ON_LATTICE = {"per pixel", "sub-pixel 5", "de Sorbier 4b", "wavelength-selective", "Alioscopy"}


@st.composite
def lens_maps(draw):
    step = draw(st.floats(-0.9, 0.9))
    start, channels = draw(st.floats(-3, 3)), step / 3 * np.arange(3) * draw(st.sampled_from([0, 1]))
    return ViewMap(
        draw(st.integers(2, 130)), a=step, b=draw(st.floats(-3, 3)), offsets=np.array([start + channels]),
        continuous=draw(st.booleans()), reverse=draw(st.booleans()),
    )  # fmt: skip


@st.composite
def tables(draw):
    views, step = draw(st.integers(2, 12)), draw(st.integers(0, 11))
    rows = np.array(draw(st.lists(st.integers(0, 11), min_size=1, max_size=5)))[:, None, None]
    units = np.arange(3 * views).reshape(1, -1, 3)
    if draw(st.booleans()):
        units = np.repeat(np.arange(views)[None, :, None], 3, axis=2)  # whole pixels
    return ViewMap(views, table=(rows + step * units) % views, reverse=draw(st.booleans()))


def assert_in_slots(viewmap: ViewMap, lattice) -> None:
    """The phase of every sub-pixel's unit lies between those of the slot that its camera belongs to."""
    offsets = np.linspace(-0.4, 0.7, viewmap.views)
    rows, columns = np.arange(HEIGHT), np.arange(WIDTH)
    camera = offset_at(offsets, viewmap.camera(rows, columns)).astype(np.float32)
    unit = 3 * columns[:, None] + np.arange(3) if lattice.units == 3 else columns[:, None] + np.zeros(3)
    slot = np.clip(np.searchsorted(lattice.slots[:, 0], camera, side="right") - 1, 0, len(lattice.slots) - 1)
    low, high = lattice.slots[slot, 2].astype(float), lattice.slots[slot, 3].astype(float)
    phase = lattice.starts.astype(float)[:, None, None] + lattice.step * unit
    assert ((phase - low) % 1 <= high - low).all()
    assert (np.diff(lattice.slots[:, 0]) >= 0).all() and lattice.step > 0
    if lattice.exact:
        assert np.array_equal(lattice.slots[slot, 0], camera)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("name", MAPS)
def test_maps_of_displays(name, reverse):
    viewmap = MAPS[name]
    viewmap = ViewMap(**{**vars(viewmap), "reverse": reverse})
    lattice = find_lattice(viewmap, (WIDTH, HEIGHT), np.linspace(-0.4, 0.7, viewmap.views))
    assert (lattice is not None) == (name in ON_LATTICE)
    if lattice is not None:
        assert_in_slots(viewmap, lattice)


@settings(max_examples=300, deadline=None)
@given(st.one_of(lens_maps(), tables()))
def test_any_lens_and_table(viewmap):
    lattice = find_lattice(viewmap, (WIDTH, HEIGHT), np.linspace(-0.4, 0.7, viewmap.views))
    step = viewmap.a if viewmap.per_pixel else viewmap.a / 3
    assert lattice is not None or viewmap.table is not None or abs(step - round(step)) < 1e-5
    if lattice is not None:
        assert_in_slots(viewmap, lattice)


@pytest.mark.parametrize(("spread", "middle"), [(0.0, 0.0), (1e-96, 0.0), (1e-38, 0.0), (1e-3, 1e4)])
def test_cameras_that_are_too_near_for_float32(spread, middle):
    for viewmap in (MAPS["per pixel"], ViewMap(8, a=0.3, offsets=np.array([[0.0, 0.1, 0.2]]), continuous=True)):
        assert find_lattice(viewmap, (WIDTH, HEIGHT), middle + spread * np.arange(8)) is None


def test_what_has_no_lattice():
    offsets = np.linspace(-1, 1, 6)
    uneven = ViewMap(6, table=np.array([[[0, 1, 3], [2, 4, 5]]]))
    turned = ViewMap(6, table=np.array([[[0, 1, 2]], [[0, 2, 4]]]))  # another step in each row
    cells = ViewMap(6, a=0.1, b=0.0, offsets=CELLS, cell_mode=1, height=HEIGHT)
    one = ViewMap(6, a=0.0, b=0.3, offsets=np.zeros((1, 3)))  # no step at all
    for viewmap in (uneven, turned, cells, one):
        assert find_lattice(viewmap, (WIDTH, HEIGHT), offsets) is None
