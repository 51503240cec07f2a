"""Arguments of the wrong kind: one sentence, whatever the engine."""

from __future__ import annotations

import numpy as np
import pytest

import autostereo as aus
from autostereo.scene.shapes import icosphere

DISPLAY = aus.Display.lenticular(12, 8, 3)


@pytest.mark.parametrize("engine", ["reference", "cpu"])
def test_an_array_that_cannot_be_written_is_refused(engine):
    panel, stack = np.zeros((8, 12, 3), np.uint8), np.zeros((3, 8, 12, 4), np.uint8)
    panel.flags.writeable = stack.flags.writeable = False
    renderer, rig = aus.Renderer(icosphere(1), engine=engine), aus.Rig(position=(0, 0, 4), views=3)
    with pytest.raises(aus.InputError, match="out: expected a contiguous, writeable uint8 array of shape"):
        renderer.render(DISPLAY, rig, out=panel)
    with pytest.raises(aus.InputError, match="out: expected a contiguous, writeable uint8 array of shape"):
        renderer.render_views(rig, (12, 8), out=stack)


@pytest.mark.parametrize("wrong", ["x", None, [0.1], 1.0, -0.1, np.nan])
def test_crosstalk_is_a_share(wrong):
    panel = aus.render(icosphere(1), DISPLAY)
    with pytest.raises(aus.InputError, match="crosstalk: expected a number"):
        aus.observe(panel, DISPLAY, view=1, crosstalk=wrong)


def test_names_that_are_lists():
    with pytest.raises(aus.UnsupportedError, match=r"method \['n-pass'\]"):
        aus.render(icosphere(1), DISPLAY, method=["n-pass"])
    with pytest.raises(aus.UnsupportedError, match=r"engine \['cpu'\]"):
        aus.render(icosphere(1), DISPLAY, engine=["cpu"])


@pytest.mark.parametrize("wrong", [None, 3, b"out.png"])
def test_names_of_files_that_are_none(wrong):
    from autostereo.encoders import save
    from autostereo.encoders.quilt import parse_quilt_name, quilt_path
    from autostereo.encoders.video import save_animation

    panel, views = aus.Panel(np.zeros((2, 2, 3), np.uint8)), aus.ViewStack(np.zeros((2, 2, 2, 4), np.uint8))
    layout = aus.Display.preset("looking-glass-go").quilt
    calls = [
        panel.save, views.save, aus.Rig().save, aus.TransferFunction.preset("mr").save, parse_quilt_name,
        lambda path: save(panel, path), lambda path: save(views, path), lambda path: save_animation(path, views),
        lambda path: quilt_path(path, layout),
    ]  # fmt: skip
    for call in calls:
        with pytest.raises(aus.InputError, match=f"path: expected the name of a file, got {type(wrong).__name__}"):
            call(wrong)
    for load in (aus.load, aus.Rig.load, aus.TransferFunction.load):
        with pytest.raises(aus.InputError, match="expected"):
            load(wrong)


def test_methods_are_listed_where_they_are():
    with pytest.raises(aus.UnsupportedError, match=r"for views the cpu engine has single-pass, n-pass, dibr$"):
        aus.render_views(icosphere(1), aus.Rig(), (8, 8), method="n-pass-subres", engine="cpu")
    with pytest.raises(aus.UnsupportedError, match=r"the cpu engine has .*; engine gl has it \(--engine gl\)$"):
        aus.render(icosphere(1), DISPLAY, method="plane-rasterizer", engine="cpu")
    with pytest.raises(aus.UnsupportedError, match=r"n-pass-subres, dibr$"):
        aus.render(icosphere(1), DISPLAY, method="magic", engine="cpu")
