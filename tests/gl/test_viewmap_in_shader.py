"""The mask in the shader shows the same view in every sub-pixel as ViewMap does in float64: no tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.engines.cpu.jit import kernel
from autostereo.engines.cpu.view_rows import map_args, row_camera
from autostereo.engines.gl.blocks import Mask, attach
from autostereo.engines.gl.programs import expand
from autostereo.viewmap import ViewMap
from gl_device import need_device

BAND = 512  # rows that are compared at a time


@kernel
def fill_cameras(first, width, m, out):
    """`ViewMap.camera` of rows from `first` on: out (R, W, 3); engines/cpu/view_rows.py, which tests hold to NumPy."""
    table, a, b, offsets, mode, height, views, continuous, reverse = m
    for r in range(out.shape[0]):
        row_camera(first + r, width, table, a, b, offsets, mode, height, views, continuous, reverse, out[r])


PROBE = """
#include "lib/viewmap.glsl"
uniform int first_row;
layout(location = 0) out uvec4 view;
void main() {
    view = uvec4(uvec3(VIEWS(int(gl_FragCoord.x), int(gl_FragCoord.y) + first_row)), 0u);
}
"""


def views_in_shader(viewmap: ViewMap, size: tuple[int, int], function: str = "view_indices"):
    """Yield (rows, view indices (R, W, 3)) of a panel, band after band."""
    device = need_device()
    width, height = size
    with device:
        mask = Mask(device, viewmap)
        texts = {
            "screen.vert": expand('#include "screen.vert"'),
            "probe.frag": expand(PROBE.replace("VIEWS", function), mask.defines),
        }
        program = attach(device.programs.compile(texts))
        texture = device.ctx.texture((width, min(BAND, height)), 4, dtype="u2")
        target, nothing = device.ctx.framebuffer([texture]), device.ctx.vertex_array(program, [])
        device.ctx.enable_only(device.ctx.NOTHING)
        for first in range(0, height, BAND):
            mask.use(program)
            program["first_row"] = first
            target.use()
            nothing.render(vertices=3)
            rows = np.arange(first, min(first + BAND, height))
            yield rows, np.frombuffer(texture.read(), np.uint16).reshape(-1, width, 4)[: len(rows), :, :3]


def assert_equal_everywhere(viewmap: ViewMap, size: tuple[int, int]) -> None:
    m, expected = map_args(viewmap), np.empty((BAND, size[0], 3))
    for rows, found in views_in_shader(viewmap, size):
        fill_cameras(rows[0], size[0], m, expected)
        assert np.array_equal(found, expected[: len(rows)]), "sub-pixels that show another view"


MASKED = [name for name in aus.Display.presets() if aus.Display.preset(name).viewmap is not None]


@pytest.mark.parametrize("name", MASKED)
def test_every_sub_pixel_of_every_preset(name):
    display = aus.Display.preset(name)
    assert_equal_everywhere(display.viewmap, (display.width, display.height))


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("mode", [0, 1, 2, 3, 4])
def test_cells_and_reversal(mode, reverse):
    offsets = np.random.default_rng(mode).uniform(-2, 2, (1 if mode == 0 else 4 if mode == 3 else 2, 3))
    assert_equal_everywhere(
        ViewMap(45, a=-0.7312, b=0.1234567, offsets=offsets, cell_mode=mode, height=301, reverse=reverse), (401, 301)
    )


FRACTIONS = st.sampled_from([0.0, 0.25, 1 / 3, -1 / 3, 2 / 7, 0.1, -0.1, 1e-3, 5 / 6, 1 / 49, 3 / 4.5, 2**-40])


@given(FRACTIONS, FRACTIONS, st.lists(FRACTIONS, min_size=3, max_size=3), st.integers(1, 100), st.booleans())
@settings(max_examples=25, deadline=None)
def test_on_the_borders_of_views_too(a, b, offsets, views, reverse):
    """Rational phases fall on the borders of views in every lens; there the roundings decide."""
    assert_equal_everywhere(ViewMap(views, a=a, b=b, offsets=np.array([offsets]), reverse=reverse), (300, 60))


def test_far_from_the_origin_of_the_phase():
    assert_equal_everywhere(ViewMap(100, a=1000.123, b=-777.7, offsets=np.array([[1e6, 0.5, -1e5]])), (4096, 64))


def test_the_nearest_view_of_a_continuous_map():
    viewmap = ViewMap(9, a=0.1777, b=-0.05, offsets=np.array([[0.1, 0.2, 0.3]]), continuous=True)
    for rows, found in views_in_shader(viewmap, (640, 480), "nearest_views"):
        expected = np.clip(np.floor(viewmap.camera(rows, np.arange(640)) + 0.5), 0, 8)
        np.testing.assert_array_equal(found, expected)
