"""Meshes, points and volumes together on the gl engine, by every method and mask."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import autostereo as aus
from autostereo.scene import samples, shapes
from autostereo.transforms import rotation, translation
from gl_device import need_device

from .point_scenes import BACKGROUND, DISPLAYS, LIGHTS, RIG, SIZE, assert_alike, cloud

KINDS = ("mesh", "points", "composite", "mip", "iso")
METHODS = ("single-pass", "covering-quad", "n-pass", "n-pass-masked")
MANY = ("n-pass", "n-pass-masked")  # they know no cameras between views
CLEAR = aus.TransferFunction([(0, 0, 0, 0, 0), (90, 0, 0, 0, 0), (140, 1, 0.5, 0.1, 2), (255, 0.2, 0.6, 1, 5)])
EXACT = {"volume": "exact"}


def volume(mode: str, *place: float) -> aus.Volume:
    """Shells, half as large, at a place."""
    fields = {"iso": 150.0} if mode == "iso" else {}
    matrix = translation(*place) @ rotation((1, 2, 3), 35) @ np.diag([0.55, 0.55, 0.55, 1])
    return replace(samples.shells(16), mode=mode, transfer=CLEAR, transform=matrix, **fields)


@cache
def objects() -> dict[str, object]:
    """One of each kind, about the same place: each cuts all others."""
    ball = shapes.displaced_sphere(1)
    shiny = aus.Material(0.3, 0.5, 0.4, 9, two_sided=True)
    mesh = aus.Mesh(np.asarray(ball.vertices) * (0.7, 0.5, 0.9), ball.faces, colors=np.abs(ball.vertices) / 2,
                    material=shiny)  # fmt: skip
    return {
        "mesh": mesh,
        "points": cloud(3, 80, transform=np.diag([0.5, 0.5, 0.5, 1])),
        "composite": volume("composite", 0.2, 0, 0.1),
        "mip": volume("mip", -0.3, 0.1, 0.5),
        "iso": volume("iso", 0.3, -0.2, 0.3),
    }


@cache
def scene(*kinds: str) -> aus.Scene:
    """These kinds of objects, all if none is named."""
    return aus.Scene([objects()[kind] for kind in kinds or KINDS], LIGHTS, BACKGROUND)


def panel(content: aus.Scene, name: str, engine: str = "gl", method: str = "single-pass", **options: object):
    """Pixels of a panel; every ray by itself, so that methods can be compared."""
    options = aus.Options(**EXACT | options)
    return aus.render(content, DISPLAYS[name], RIG, method=method, engine=engine, options=options).pixels.copy()


@cache
def expected(content: aus.Scene, name: str, options: tuple = ()):
    return panel(content, name, "reference", **dict(options))


PAIRS = [(a, b) for i, a in enumerate(KINDS) for b in KINDS[i + 1 :]]


@pytest.mark.parametrize("kinds", PAIRS)
@pytest.mark.parametrize("method", METHODS)
def test_two_kinds_hide_each_other(kinds, method):
    need_device()
    assert_alike(panel(scene(*kinds), "wavelength-selective", method=method),
                 expected(scene(*kinds), "wavelength-selective"))  # fmt: skip


@pytest.mark.parametrize(
    ("name", "method"),
    [(name, method) for name in DISPLAYS for method in METHODS if not (DISPLAYS[name].continuous and method in MANY)],
)
def test_all_kinds_together_on_every_mask(name, method):
    """A level apart on all but 0.1 % of all samples: outlines and crossings that float32 puts elsewhere."""
    need_device()
    assert_alike(panel(scene(), name, method=method), expected(scene(), name))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("options", [{"sampling": "subpixel"}, {"samples": 4}, {"shading": "center"}, {"step": 0.5}],
                         ids=str)  # fmt: skip
def test_all_kinds_with_options(method, options):
    need_device()
    reference = expected(scene(), "slanted", tuple(options.items()))
    assert_alike(panel(scene(), "slanted", method=method, **options), reference)


@pytest.mark.parametrize("mode", ["composite", "mip", "iso"])
@pytest.mark.parametrize("method", METHODS)
def test_meshes_points_and_a_volume(method, mode):
    """By slices, too, where volumes compose; averaged opacity as the reference has it, in one pass."""
    need_device()
    content = scene("mesh", "points", mode)
    assert_alike(panel(content, "slanted", method=method), expected(content, "slanted"))
    if mode == "composite":
        assert_alike(panel(content, "slanted", method=method, proxy="slices"), expected(content, "slanted"))
    if method == "single-pass":
        averaged = expected(content, "wavelength-selective", (("alpha", "averaged"),))
        assert_alike(panel(content, "wavelength-selective", alpha="averaged"), averaged)


@pytest.mark.parametrize("method", ["single-pass", "n-pass"])
def test_views_and_depths(method):
    need_device()
    found, wanted = (
        aus.render_views(scene(), RIG, SIZE, method=m, engine=e, options=aus.Options(depth=True, **EXACT))
        for e, m in (("gl", method), ("reference", "single-pass"))
    )
    assert_alike(found.color, wanted.color)
    seen = np.isfinite(found.depth) & np.isfinite(wanted.depth)
    assert (np.isfinite(found.depth) == np.isfinite(wanted.depth)).mean() >= 0.995
    assert (np.abs(found.depth[seen] - wanted.depth[seen]) > 0.01).mean() <= 0.01


@pytest.mark.parametrize("name", [name for name in DISPLAYS if not DISPLAYS[name].continuous])
def test_n_passes_are_interlaced_bit_for_bit(name):
    need_device()
    rig = RIG.with_views(DISPLAYS[name].views)
    one, many = (aus.render_views(scene(), rig, SIZE, method=m, engine="gl", options=aus.Options(**EXACT))
                 for m in ("single-pass", "n-pass"))  # fmt: skip
    np.testing.assert_array_equal(one.color, many.color)
    woven = aus.interlace(many, DISPLAYS[name]).pixels
    for method in MANY:
        np.testing.assert_array_equal(panel(scene(), name, method=method), woven)
    assert_alike(panel(scene(), name), woven)


def test_groups_leave_what_hides_them():
    """Points in as many groups as there are surfels, behind and before a mesh, where a pixel shows one view."""
    need_device()
    content = scene("mesh", "points", "composite")
    found = panel(content, "lenticular", method="covering-quad", alpha="averaged", groups=80)
    assert_alike(found, expected(content, "lenticular", (("alpha", "averaged"),)), 0.01)


def test_methods_that_lack_a_kind_say_so():
    need_device()
    with pytest.raises(aus.UnsupportedError, match=r"'geometry-shader': the gl engine draws a (Points|Volume) by"):
        panel(scene(), "slanted", method="geometry-shader")
