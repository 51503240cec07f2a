"""Words out of a few, objects and pairs: arrays, lists and nothing in their place are refused in one sentence."""

from __future__ import annotations

import numpy as np
import pytest

import autostereo as aus
from autostereo.encoders.rgbd import rgbd
from autostereo.encoders.stereo import pack
from autostereo.engines.gathering import quilt_tiles
from autostereo.scene.shapes import icosphere
from autostereo.simulator.workload import Draw

BALL = icosphere(0)
DISPLAY = aus.Display.lenticular(12, 8, 3)
CUBE = np.arange(8, dtype=np.uint8).reshape(2, 2, 2)
NONE = [np.array(["a", "b"]), np.array([1, 2]), [], ["n-pass", "dibr"], None, 4]
CHOICES = {
    "mode": lambda wrong: aus.Volume(CUBE, mode=wrong),
    "gradient": lambda wrong: aus.Volume(CUBE, gradient=wrong),
    "rig spacing": lambda wrong: aus.Rig(spacing=wrong),
    "layout": lambda wrong: aus.Display.stereo(12, 8, layout=wrong),
    "per": lambda wrong: aus.Display.lenticular(12, 8, 3, per=wrong),
    "side": lambda wrong: aus.Rig.frame(BALL, DISPLAY, wrong),
    "transfer preset": lambda wrong: aus.TransferFunction.preset(wrong),
    "filter": lambda wrong: quilt_tiles(np.zeros((4, 4, 3), np.uint8), (3, 1), DISPLAY.viewmap, (12, 8), wrong),
    "rgbd side": lambda wrong: rgbd(np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), np.uint8), wrong),
    "draw blend": lambda wrong: Draw(np.zeros((1, 3, 3)), np.zeros((1, 3, 2)), blend=wrong),
}


@pytest.mark.parametrize("wrong", NONE, ids=repr)
@pytest.mark.parametrize("name", CHOICES)
def test_choices(name, wrong):
    with pytest.raises(aus.InputError, match=rf"^{name}: expected one of [a-z].*, got "):
        CHOICES[name](wrong)


@pytest.mark.parametrize("wrong", NONE, ids=repr)
def test_methods_engines_and_packings(wrong):
    with pytest.raises(aus.UnsupportedError, match=r"^method .*: the reference engine has single-pass"):
        aus.render(BALL, DISPLAY, method=wrong, engine="reference")
    with pytest.raises(aus.UnsupportedError, match=r"^engine .*: there are cpu"):
        aus.render(BALL, DISPLAY, engine=wrong)
    with pytest.raises(aus.InputError, match=r"^layout: expected one of "):
        pack(np.zeros((2, 4, 4, 3), np.uint8), wrong)
    with pytest.raises(aus.InputError, match=r"^colour map: expected its name, got "):
        aus.TransferFunction.colormap(wrong, 0, 1)
    with pytest.raises(aus.InputError, match=r"^transfer .*: expected a \.json file, a preset"):
        aus.TransferFunction.fitted(wrong, aus.Volume(CUBE))


@pytest.mark.parametrize("wrong", [np.array([True, False]), [], "yes", 2], ids=repr)
def test_two_sided(wrong):
    with pytest.raises(aus.InputError, match=r"^material two_sided: expected True, False or None, got "):
        aus.Material(two_sided=wrong)


@pytest.mark.parametrize("wrong", [None, [], np.array(4), "looking-glass-go"], ids=repr)
def test_framing_needs_a_display(wrong):
    with pytest.raises(aus.InputError, match=r"^display: expected a Display"):
        aus.Rig.frame(BALL, wrong)


def test_arrays_without_axes_hold_nothing():
    for make in (aus.Scene, lambda x: aus.render(x, DISPLAY)):
        with pytest.raises(aus.InputError, match=r"^objects: expected an object or a sequence of them, got ndarray"):
            make(np.array(4))
    with pytest.raises(aus.InputError, match=r"^lights: expected lights, got ndarray"):
        aus.Scene([BALL], lights=np.array(4))


@pytest.mark.parametrize("wrong", [np.array(4), np.zeros((2, 2)), "12", 3, (1, 2, 3)], ids=repr)
def test_pairs(wrong):
    with pytest.raises(aus.InputError, match=r"^size_mm"):
        DISPLAY.physical(size_mm=wrong)
    panel = aus.Panel(np.zeros((8, 12, 3), np.uint8))
    with pytest.raises(aus.InputError, match=r"^eye"):
        aus.observe(panel, DISPLAY.physical(size_mm=(60, 40)), eye=wrong)


def test_masked_pictures():
    color = np.ma.masked_equal(np.zeros((1, 2, 2, 4), np.uint8), 0)
    with pytest.raises(aus.InputError, match=r"^color: expected pixels, none of them masked, found 16 masked entries"):
        aus.ViewStack(color)
    with pytest.raises(aus.InputError, match=r"^depth: expected depths, none of them masked, found 4 masked entries"):
        aus.ViewStack(color.data, np.ma.masked_equal(np.ones((1, 2, 2), np.float32), 1))
    with pytest.raises(aus.InputError, match=r"^quilt: expected pixels, none of them masked, found 16"):
        aus.ViewStack.from_quilt(color[0], 1, 1)
    with pytest.raises(aus.InputError, match=r"^pixels: expected pixels, none of them masked, found 12"):
        aus.Panel(color[0, ..., :3])
    assert aus.Panel(np.ma.masked_equal(np.ones((2, 2, 3), np.uint8), 0)).width == 2
