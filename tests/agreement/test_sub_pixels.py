"""Panels sampled at their sub-pixels' own centres: the same by every method, on every engine."""

from __future__ import annotations

import numpy as np
import pytest

import autostereo as aus
from autostereo.scene.samples import shells, surfel_cloud

from .helpers import need, smooth, soup

W, H, V = 48, 36, 5
SLANTED = aus.Display.slanted(W, H, V, lens_pitch=5.7, subpixel_pitch=1.0, slant_deg=9.46)
RIG = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=1.2, views=V, near=0.2)
ENGINES = ("reference", "cpu", "gl")


SCENES = {
    "ball": smooth,
    "triangles": soup,
    "points": lambda: aus.Scene(surfel_cloud(400), aus.DirectionalLight((0, 0, -1))),
    "volume": lambda: aus.Scene(shells(16)),
}


def panel(scene, method, engine, display=SLANTED, **options):
    """A panel sampled at the sub-pixels' own centres."""
    given = aus.Options(sampling="subpixel", volume="exact", **options)
    return aus.render(scene, display, RIG, method=method, engine=engine, options=given).pixels.astype(int)


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("engine", ENGINES)
def test_n_passes_are_the_single_pass(engine, name, samples):
    scene = SCENES[name]()
    one, n = (panel(scene, method, need(engine), samples=samples) for method in ("single-pass", "n-pass"))
    assert (np.abs(one - n) > 1).mean() <= (0 if engine == "reference" else 2e-3)
    at_pixels = aus.render(scene, SLANTED, RIG, method="n-pass", engine=engine, options=aus.Options(volume="exact"))
    assert (np.abs(at_pixels.pixels - n) > 1).mean() > 0.02  # the option does something


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("engine", ENGINES)
def test_of_every_view_a_picture_warped_to_itself_is_n_passes(engine, name):
    scene = SCENES[name]()
    n, warped = (panel(scene, method, need(engine), references=V) for method in ("n-pass", "dibr"))
    assert (np.abs(n - warped) > (1 if engine == "gl" else 0)).mean() <= (2e-3 if engine == "gl" else 0)


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("engine", ENGINES)
def test_small_views_that_are_as_large_as_the_panel_are_the_single_pass(engine, name, samples):
    """One view has all the panel's pixels; each small view takes its samples all over its pixels, as it is blurred."""
    scene, display = SCENES[name](), aus.Display.lenticular(W, H, 1)
    small = panel(scene, "n-pass-subres", need(engine), display, samples=samples)
    one = panel(scene, "single-pass", engine, display, samples=samples)
    if samples == 1:
        assert (np.abs(small - one) > 1).mean() <= 2e-3
    else:
        assert np.abs(small - one).mean() < 4 < np.abs(small - one).max()


@pytest.mark.parametrize("name", ["ball", "points"])
@pytest.mark.parametrize("engine", ["cpu", "gl"])
def test_small_views_are_those_of_the_reference(engine, name):
    scene = SCENES[name]()
    ours, theirs = (panel(scene, "n-pass-subres", e) for e in (need(engine), "reference"))
    assert (np.abs(ours - theirs) > 3).mean() < 0.01
