"""Interlace, weave, observe: Numba against NumPy bit for bit, and against what must hold by definition."""

from __future__ import annotations

import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo.engines.cpu import gather as cpu
from autostereo.engines.cpu import observe as cpu_observe
from autostereo.engines.cpu.threads import run_rows
from autostereo.engines.gathering import lens_size
from autostereo.engines.reference import gather as reference
from autostereo.errors import InputError
from autostereo.frame import ViewStack
from autostereo.viewmap import ViewMap
from view_maps import EVERY, PHASES, STRIPE, TABLES, phase_maps

sys.path.insert(0, str(Path(__file__).parent.parent / "benchmarks" / "peers"))
import weave_numpy

FLIPS = pytest.mark.parametrize("flips", [(False, False), (True, False), (False, True), (True, True)])




def random_pixels(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)



# --- interlace -----------------------------------------------------------------------------------------------


@EVERY
@FLIPS
def test_interlace_is_the_reference(viewmap, flips):
    views = random_pixels(viewmap.views, 13, 29, 4)
    out, expected = np.zeros((2, 13, 29, 3), np.uint8)
    cpu.interlace(views, viewmap, *flips, out)
    reference.interlace(views, viewmap, *flips, expected)
    assert np.array_equal(out, expected)


def test_interlace_by_hand_with_flips():
    """View i holds 10·row + column + 100·i: every number says where it came from."""
    viewmap = ViewMap(2, table=[[[0, 1, 0], [1, 0, 1]]])
    views = np.zeros((2, 2, 4, 4), np.uint8)
    views[...] = (100 * np.arange(2)[:, None, None] + 10 * np.arange(2)[:, None] + np.arange(4))[..., None]
    out = np.zeros((2, 4, 3), np.uint8)
    cpu.interlace(views, viewmap, False, False, out)
    assert out[1].tolist() == [[10, 110, 10], [111, 11, 111], [12, 112, 12], [113, 13, 113]]
    cpu.interlace(views, viewmap, True, True, out)
    assert out[1].tolist() == [[3, 103, 3], [102, 2, 102], [1, 101, 1], [100, 0, 100]]


def test_continuous_map_rounds_to_the_nearest_view():
    viewmap = ViewMap(4, a=1 / 64, offsets=np.zeros((1, 3)), continuous=True)
    views = np.broadcast_to(np.arange(4, dtype=np.uint8)[:, None, None, None], (4, 1, 64, 4))
    out = np.empty((1, 64, 3), np.uint8)
    cpu.interlace(views, viewmap, False, False, out)
    assert out[0, :, 1].tolist() == [x // 16 for x in range(64)]


def test_interlace_rejects_what_does_not_fit():
    viewmap, out = TABLES["per pixel"], np.empty((4, 5, 3), np.uint8)
    for engine in (cpu, reference):
        with pytest.raises(InputError, match="8 views, got 7 pictures"):
            engine.interlace(random_pixels(7, 4, 5, 4), viewmap, False, False, out)
        with pytest.raises(InputError, match=r"expected a panel \(4, 6, 3\)"):
            engine.interlace(random_pixels(8, 4, 6, 4), viewmap, False, False, out)
        with pytest.raises(InputError, match="float64"):
            engine.interlace(np.zeros((8, 4, 5, 4)), viewmap, False, False, out)


# --- weave ---------------------------------------------------------------------------------------------------


@EVERY
@FLIPS
@pytest.mark.parametrize("filter", ["nearest", "linear"])
def test_weave_is_the_reference(viewmap, flips, filter):
    columns, rows = 5, -(-viewmap.views // 5)
    quilt = random_pixels(rows * 9 + 2, columns * 11 + 3, 3)  # 11×9 tiles and padding
    args = (quilt, (columns, rows), viewmap, (29, 13), filter, flips)
    assert np.array_equal(cpu.weave(*args), reference.weave(*args))


@EVERY
def test_weave_is_plain_numpy_indexing(viewmap):
    rows = -(-viewmap.views // 4)
    for tile in ((7, 9), (40, 31), (29, 13)):
        quilt = random_pixels(rows * tile[1], 4 * tile[0], 4)
        args = (quilt, (4, rows), viewmap, (29, 13))
        assert np.array_equal(cpu.weave(*args), weave_numpy.weave(*args))


@EVERY
@FLIPS
def test_weave_of_panel_sized_tiles_is_interlace(viewmap, flips):
    views = random_pixels(viewmap.views, 13, 29, 4)
    columns, rows = 3, -(-viewmap.views // 3)
    out = np.empty((13, 29, 3), np.uint8)
    cpu.interlace(views, viewmap, *flips, out)
    quilt = ViewStack(views).quilt(columns, rows)
    assert np.array_equal(cpu.weave(quilt, (columns, rows), viewmap, (29, 13), "nearest", flips), out)
    if not viewmap.continuous:
        assert np.array_equal(cpu.weave(quilt, (columns, rows), viewmap, (29, 13), "linear", flips), out)


@EVERY
@pytest.mark.parametrize("filter", ["nearest", "linear"])
def test_weave_never_bleeds_between_tiles(viewmap, filter):
    """Tiles of constant colour must come out as if every view were that colour, whatever the tile size."""
    colours = random_pixels(viewmap.views, 1, 1, 4)
    rows = -(-viewmap.views // 4)
    discrete = replace(viewmap, continuous=False)
    expected = np.empty((13, 29, 3), np.uint8)
    cpu.interlace(np.broadcast_to(colours, (viewmap.views, 13, 29, 4)).copy(), discrete, False, False, expected)
    for height, width in ((1, 1), (5, 3), (31, 60)):
        views = np.broadcast_to(colours, (viewmap.views, height, width, 4))
        woven = cpu.weave(ViewStack(views.copy()).quilt(4, rows), (4, rows), discrete, (29, 13), filter)
        assert np.array_equal(woven, expected)


def test_linear_weave_of_a_ramp_is_the_ramp():
    """A tile whose value is linear in x gives a panel linear in x, but for the clamped edges."""
    tile = np.repeat(np.arange(64, dtype=np.uint8)[None, :, None] * 2, 3, axis=2)
    panel = cpu.weave(np.repeat(tile, 5, axis=0), (1, 1), TABLES["one view"], (256, 3), "linear")
    x = np.clip((np.arange(256) + 0.5) / 4 - 0.5, 0, 63)
    assert np.array_equal(panel, np.repeat(np.floor(2 * x + 0.5)[None, :, None], 3, axis=2).repeat(3, axis=0))


def test_continuous_linear_weave_mixes_neighbouring_views():
    viewmap = ViewMap(4, a=1 / 64, offsets=np.zeros((1, 3)), continuous=True)
    colours = np.array([0, 100, 190, 30], np.uint8)
    quilt = ViewStack(colours[:, None, None, None] * np.ones((1, 2, 2, 4), np.uint8)).quilt(2, 2)
    panel = cpu.weave(quilt, (2, 2), viewmap, (64, 2), "linear")
    u = np.arange(64) / 16 - 0.5  # beyond the outer views the outer views
    assert np.array_equal(panel[1, :, 2], np.floor(np.interp(u, np.arange(4), colours) + 0.5))


def test_weave_rejects_what_does_not_fit():
    quilt, viewmap = random_pixels(12, 12, 3), TABLES["per pixel"]
    for engine in (cpu, reference):
        with pytest.raises(InputError, match=r"12×12 pixels cannot be 13×1 tiles"):
            engine.weave(quilt, (13, 1), viewmap, (4, 4))
        with pytest.raises(InputError, match=r"2×3 tiles cannot hold the 8 views"):
            engine.weave(quilt, (2, 3), viewmap, (4, 4))
        with pytest.raises(InputError, match="nearest, linear, got 'cubic'"):
            engine.weave(quilt, (4, 2), viewmap, (4, 4), "cubic")
        with pytest.raises(InputError, match="at least 1×1"):
            engine.weave(quilt, (4, 2), viewmap, (0, 4))
        with pytest.raises(InputError, match="uint8, got"):
            engine.weave(quilt[..., 0], (4, 2), viewmap, (4, 4))


# --- observe -------------------------------------------------------------------------------------------------


@EVERY
@pytest.mark.parametrize("crosstalk", [0.0, 0.3])
def test_observe_is_the_brute_force_search(viewmap, crosstalk):
    panel, rng = random_pixels(13, 29, 3), np.random.default_rng(1)
    for flips, period in (((False, False), None), ((True, True), 5.3)):
        wanted = rng.uniform(-1, 2, (29, 3))
        args = (panel, viewmap, wanted, period, crosstalk, flips)
        assert np.array_equal(cpu_observe.observe(*args), reference.observe(*args))


@settings(max_examples=40, deadline=None)
@given(phase_maps(), st.floats(0, 1), st.sampled_from([0.0, 0.5]))
def test_observe_of_any_map_is_the_brute_force_search(viewmap, phase, crosstalk):
    """Where two sub-pixels are equally near, rounding may choose either: such maps are not compared."""
    wanted = np.full((11, 3), phase)
    args = (random_pixels(6, 11, 3), viewmap, wanted, None, crosstalk)
    phases = viewmap.phase(np.arange(6), np.arange(11))
    rank = np.sort(np.minimum((phases - phase) % 1, (phase - phases) % 1), axis=1)
    gaps = np.diff(rank, axis=1)
    if ((gaps > 1e-11) & (gaps < 1e-8)).any():
        return
    assert np.array_equal(cpu_observe.observe(*args), reference.observe(*args))


def zones(viewmap: ViewMap, view: int, width: int) -> np.ndarray:
    return np.full((width, 3), (view + 0.5) / viewmap.views)


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("reverse", [False, True])
@FLIPS
def test_the_zone_of_a_view_shows_that_view_only(name, reverse, flips):
    """V pictures of one colour each: from the zone of view i every pixel and channel has colour i."""
    viewmap = replace(TABLES[name], reverse=reverse)
    colours = random_pixels(viewmap.views, 4)
    panel = np.empty((14, 31, 3), np.uint8)
    views = np.broadcast_to(colours[:, None, None], (viewmap.views, 14, 31, 4)).copy()
    cpu.interlace(views, viewmap, *flips, panel)
    for i in range(viewmap.views):
        seen = cpu_observe.observe(panel, viewmap, zones(viewmap, i, 31), flips=flips)
        assert np.array_equal(seen, np.broadcast_to(colours[i, :3], seen.shape))


@pytest.mark.parametrize("reverse", [False, True])
def test_a_lens_with_a_subpixel_for_every_view_shows_that_view_only(reverse):
    """Physical slant with 4 views and 8 pixels a lens: no view is missing from any row of any lens."""
    viewmap = ViewMap(4, a=1 / 8.03, b=-0.041, offsets=STRIPE, reverse=reverse)
    colours = random_pixels(4, 4)
    panel = np.empty((14, 40, 3), np.uint8)
    cpu.interlace(np.broadcast_to(colours[:, None, None], (4, 14, 40, 4)).copy(), viewmap, False, False, panel)
    for i in range(4):
        seen = cpu_observe.observe(panel, viewmap, zones(viewmap, i, 40))
        assert np.array_equal(seen, np.broadcast_to(colours[i, :3], seen.shape))


@pytest.mark.parametrize("viewmap", [*TABLES.values(), PHASES["slanted"], PHASES["running left"]])
@FLIPS
def test_at_a_views_own_subpixels_the_eye_sees_that_view(viewmap, flips):
    """Real pictures: exact where the panel has a sub-pixel of that view.

    Within half a lens of the edges the eye may find that view in the next lens, a shade nearer to the zone's centre.
    """
    views = random_pixels(viewmap.views, 13, 29, 4)
    panel = np.empty((13, 29, 3), np.uint8)
    cpu.interlace(views, viewmap, *flips, panel)
    view = viewmap.view(np.arange(13), np.arange(29))[:: -1 if flips[1] else 1, :: -1 if flips[0] else 1]
    for i in range(viewmap.views):
        seen = cpu_observe.observe(panel, viewmap, zones(viewmap, i, 29), flips=flips)
        own = view == i
        if viewmap.table is None:
            own[:, :3] = own[:, -3:] = False
        assert np.array_equal(seen[own], views[i, ..., :3][own])


def test_crosstalk_leaks_from_the_neighbouring_views_round_the_circle():
    viewmap = TABLES["wavelength-selective"]
    colours = np.array([0, 10, 40, 90, 160, 250, 30, 70])
    views = np.repeat(colours[:, None, None, None], 4, axis=3).astype(np.uint8) * np.ones((1, 14, 31, 1), np.uint8)
    panel = np.empty((14, 31, 3), np.uint8)
    cpu.interlace(views, viewmap, False, False, panel)
    for i in range(8):
        seen = cpu_observe.observe(panel, viewmap, zones(viewmap, i, 31), crosstalk=0.2)
        expected = 0.8 * colours[i] + 0.1 * (colours[(i + 1) % 8] + colours[i - 1])
        assert np.array_equal(np.unique(seen), [np.floor(expected + 0.5)])


def test_lens_size():
    assert lens_size(PHASES["slanted"], (100, 50)) == (1, 7)  # 6.2 pixels: three to each side
    assert lens_size(ViewMap(9, a=1 / 7.9, offsets=STRIPE), (100, 50)) == (1, 9)
    assert lens_size(TABLES["wavelength-selective"], (100, 50)) == (12, 9)
    assert lens_size(TABLES["wavelength-selective"], (5, 4)) == (4, 5)
    assert lens_size(ViewMap(9, b=0.1, offsets=STRIPE), (100, 50)) == (1, 3)
    assert lens_size(PHASES["slanted"], (100, 50), 1e30) == (1, 100)


def test_observe_rejects_what_does_not_fit():
    panel, viewmap = random_pixels(6, 11, 3), PHASES["slanted"]
    for observe in (cpu_observe.observe, reference.observe):
        with pytest.raises(InputError, match=r"shape \(11, 3\)"):
            observe(panel, viewmap, np.zeros((10, 3)))
        with pytest.raises(InputError, match="finite"):
            observe(panel, viewmap, np.full((11, 3), np.nan))
        with pytest.raises(InputError, match="crosstalk"):
            observe(panel, viewmap, np.zeros((11, 3)), crosstalk=1.0)
        with pytest.raises(InputError, match="period"):
            observe(panel, viewmap, np.zeros((11, 3)), period=float("nan"))
        with pytest.raises(InputError, match="panel: expected"):
            observe(panel[..., :2], viewmap, np.zeros((11, 3)))


# --- threads -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("chunk", [None, 1, 7, 1000])
@pytest.mark.parametrize("height", [0, 1, 2, 37, 500])
def test_every_row_runs_once(height, chunk):
    done = np.zeros(height, int)

    def task(start: int, stop: int) -> None:
        assert 0 <= start < stop <= height
        done[start:stop] += 1

    run_rows(height, task, chunk)
    assert (done == 1).all()


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
@pytest.mark.parametrize("bad", [0, 13, 99])
def test_errors_come_out_and_nothing_runs_on(error, bad):
    running = threading.Semaphore(100)

    def task(start: int, stop: int) -> None:
        with running:
            if start <= bad < stop:
                raise error(f"row {bad}")

    with pytest.raises(error, match=f"row {bad}"):
        run_rows(100, task, 1)
    assert all(running.acquire(blocking=False) for _ in range(100))
    test_every_row_runs_once(37, 1)  # and the pool still works


def test_nested_and_concurrent_calls_finish():
    done = np.zeros((6, 50, 40), int)

    def outer(k: int) -> None:
        def inner(r: int):
            def mark(start: int, stop: int) -> None:
                done[k, r, start:stop] += 1

            return mark

        def task(start: int, stop: int) -> None:
            for r in range(start, stop):
                run_rows(40, inner(r), 9)

        run_rows(50, task, 3)

    callers = [threading.Thread(target=outer, args=(k,)) for k in range(6)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(60)
    assert (done == 1).all()
