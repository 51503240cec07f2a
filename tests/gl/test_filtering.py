"""Volumes where the device interpolates with few bits: it is found out, and shaders do it by themselves."""

from __future__ import annotations

import numpy as np
import pytest

import autostereo as aus
from autostereo.engines.gl import filtering
from gl_device import need_device

from .test_volume import DISPLAYS, RIG, H, W, assert_agree, reference_panel, scenes

PARTS = np.arange(filtering.PLACES) / filtering.PLACES


@pytest.fixture(params=["device", "by hand"])
def way(request, monkeypatch):
    """Interpolation as the device is found to need it, and by hand wherever it runs."""
    if request.param == "by hand":
        monkeypatch.setitem(need_device().__dict__, "filters_coarsely", True)
    return request.param


def test_weights_of_eight_bits_are_coarse_and_those_of_sixteen_are_not():
    for steps, expected in ((2**8, True), (2**16, False)):
        for rounding in (0.0, 0.5):
            assert filtering.coarse(np.floor(PARTS * steps + rounding) / steps) is expected
    assert not filtering.coarse(PARTS.astype(np.float32))


def test_the_device_is_asked_between_its_voxels():
    """Lookups ascend from one voxel to the other, whatever the weights; llvmpipe's are floats."""
    device = need_device()
    with device:
        found = filtering.lookups(device)
        assert device.filters_coarsely == filtering.coarse(found)
    assert found.shape == (filtering.PLACES,) and (np.diff(found) >= 0).all()
    assert np.abs(found - PARTS).max() <= 2**-8
    if "llvmpipe" in device.renderer:
        np.testing.assert_allclose(found, PARTS, atol=2**-16)


@pytest.mark.parametrize("scene", ["composite", "sobel, clipped", "mip", "iso", "two", "all modes, a mesh"])
def test_panels_are_the_references(scene, way):
    for proxy in ("march", "slices"):
        options = aus.Options(volume="exact", proxy=proxy)
        found = aus.render(scenes()[scene], DISPLAYS["wavelength-selective"], RIG, engine="gl", options=options).pixels
        assert_agree(found, reference_panel(scene, "wavelength-selective", aus.Options(volume="exact")))


@pytest.mark.parametrize("scene", ["composite", "lights", "mip", "all modes, a mesh"])
def test_by_hand_is_as_a_device_with_fine_weights(scene, monkeypatch):
    """By other shaders; nothing but the order of additions differs."""
    device = need_device()
    rig, options, found = RIG.with_views(2), aus.Options(depth=True), []
    for coarse in (False, True):
        monkeypatch.setitem(device.__dict__, "filters_coarsely", coarse)
        views = aus.render_views(scenes()[scene], rig, (W, H), engine="gl", options=options)
        found.append((views.color.copy(), views.depth.copy()))
    assert any(dict(defines).get("COARSE") for _, defines, _ in device.programs._made)
    if "llvmpipe" not in device.renderer:
        return  # its weights may be coarse
    assert np.abs(found[0][0].astype(int) - found[1][0]).max() <= 1
    assert (found[0][0] != found[1][0]).mean() <= 1e-3
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-5)
