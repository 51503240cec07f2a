"""Arguments of the wrong kind: one sentence, whatever the engine."""

from __future__ import annotations

import sys

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


@pytest.mark.parametrize(
    ("name", "reason"),
    [("a\0b", "null byte"), ("x" * 300, "too long"), ("a\ud800b", "surrogates")],
    ids=["nul", "long", "surrogate"],
)
def test_names_that_the_system_refuses(tmp_path, monkeypatch, name, reason):
    from autostereo.encoders import save
    from autostereo.encoders.video import save_animation
    from autostereo.simulator.machine import Machine

    monkeypatch.chdir(tmp_path)
    panel, views = aus.Panel(np.zeros((2, 2, 3), np.uint8)), aus.ViewStack(np.zeros((2, 2, 2, 4), np.uint8))
    calls = {
        "": (views.save, aus.Rig.load, aus.load), ".png": (panel.save, lambda path: save(panel, path), aus.load),
        ".npz": (views.save, aus.load), ".gif": (lambda path: save_animation(path, views),),
        ".json": (aus.Rig().save, aus.Rig.load, aus.Display.from_calibration, aus.Display.preset),
        ".toml": (Machine.load, aus.Display.preset), ".obj": (aus.load,), ".mha": (aus.load,), ".nii.gz": (aus.load,),
    }  # fmt: skip
    for suffix, doors in calls.items():
        for door in doors:
            with pytest.raises(aus.FileError, match=f"expected the name of a file, which .*{reason}"):
                door(name + suffix)
    assert not list(tmp_path.iterdir())


def test_names_as_long_as_they_may_be(tmp_path):
    path = tmp_path / ("ä" * 125 + ".png")
    assert aus.Panel(np.zeros((2, 2, 3), np.uint8)).save(path) == path
    assert list(tmp_path.iterdir()) == [path]


def test_files_that_name_others_by_names_that_none_can_have(tmp_path):
    wavefront = tmp_path / "a.obj"
    wavefront.write_text(f"mtllib {'x' * 300}.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    with pytest.warns(UserWarning, match="does not exist"):
        aus.load(wavefront)
    meta = tmp_path / "a.mhd"
    meta.write_text(f"NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = {'x' * 300}.raw\n")
    with pytest.raises(aus.FileError, match="which does not exist"):
        aus.load(meta)


@pytest.mark.skipif(sys.platform != "linux", reason="names are bytes on Linux only")
def test_names_that_are_no_unicode(tmp_path):
    """SimpleITK would end the process."""
    pytest.importorskip("SimpleITK")
    folder, file = tmp_path / "a\udcffb", tmp_path / "a\udcffb.mha"
    folder.mkdir()
    for path in (file, folder / "a.dcm"):
        path.write_bytes(b"x")
    for path in (file, folder):
        with pytest.raises(aus.FileError, match="expected a name in UTF-8"):
            aus.load(path)


STACK, QUILT = aus.ViewStack(np.zeros((6, 2, 2, 4), np.uint8)), np.zeros((6, 6, 3), np.uint8)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: STACK.quilt(1.5, 4), "quilt columns: expected a whole number ≥ 1, got 1.5"),
        (lambda: STACK.quilt(6, 1.5), "quilt rows: expected a whole number ≥ 1, got 1.5"),
        (lambda: STACK.quilt("3", 2), "quilt columns: expected a whole number ≥ 1, got '3'"),
        (lambda: STACK.quilt(True, 6), "quilt columns: expected a whole number ≥ 1, got True"),
        (lambda: STACK.quilt(6, 0), "quilt rows: expected a whole number ≥ 1, got 0"),
        (lambda: STACK.quilt(5, 1), "quilt: 5×1 tiles cannot hold 6 views"),
        (lambda: aus.ViewStack.from_quilt(QUILT, 1.5, 2), "quilt columns: expected a whole number ≥ 1, got 1.5"),
        (lambda: aus.ViewStack.from_quilt(QUILT, 3, None), "quilt rows: expected a whole number ≥ 1, got None"),
        (lambda: aus.ViewStack.from_quilt(QUILT, 3, 2, views=7), "views: expected a whole number 1…6, got 7"),
        (lambda: aus.ViewStack.from_quilt(QUILT, 3, 2, views=0), "views: expected a whole number 1…6, got 0"),
        (lambda: aus.ViewStack.from_quilt(QUILT, 3, 2, views=2.0), "views: expected a whole number 1…6, got 2.0"),
        (lambda: aus.ViewStack.from_quilt(QUILT, 7, 2, views=7), "quilt: 6×6 pixels cannot be 7×2 tiles"),
        (lambda: aus.Rig().offset_at("x"), "u: expected numbers, got str"),
        (lambda: aus.Rig().offset_at([0, None]), "u: expected numbers, got list"),
        (lambda: aus.Rig().offset_at([0, True]), "u: expected numbers, got [0, True]"),
        (lambda: aus.Rig().offset_at([0, np.nan]), "u: expected finite numbers, found infinite ones or NaN"),
    ],
)
def test_tiles_and_places_of_cameras(call, message):
    with pytest.raises(aus.InputError) as caught:
        call()
    assert str(caught.value) == message


def test_numbers_of_numpy_are_as_good():
    assert STACK.quilt(np.int64(3), np.uint8(2)).shape == (4, 6, 4)
    assert aus.ViewStack.from_quilt(QUILT, np.int64(3), 2, np.int8(5)).views == 5
    assert aus.Rig(offsets=(-1, 0, 2)).offset_at([0, 1.5, 3]).tolist() == [-1, 1, 4]
    assert aus.Rig(offsets=(-1, 0, 2)).offset_at(1).shape == ()


def test_no_name_is_not_the_current_folder(tmp_path, monkeypatch):
    from autostereo.encoders import save

    monkeypatch.chdir(tmp_path)
    panel = aus.Panel(np.zeros((2, 2, 3), np.uint8))
    doors = (STACK.save, panel.save, aus.Rig().save, aus.Rig.load, lambda path: save(STACK, path))
    for door in doors:
        with pytest.raises(aus.InputError, match="path: expected the name of a file, got an empty text"):
            door("")
    assert not list(tmp_path.iterdir())
    STACK.save(".")
    assert len(list(tmp_path.iterdir())) == 6
