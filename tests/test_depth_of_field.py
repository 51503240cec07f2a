"""Views through a lens: the mean of cameras over it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from agreement.helpers import SCENES
from autostereo.errors import InputError, UnsupportedError
from commandline import Run

RIG = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=0.6, views=2, near=0.2)
SIZE = (40, 30)


def through_lens(engine: str, method: str = "single-pass", lens=(3, 2), aperture=0.3, scene="smooth") -> np.ndarray:
    options = aus.Options(aperture=aperture, lens=lens)
    return aus.render_views(SCENES[scene][0], RIG, SIZE, engine=engine, method=method, options=options).color


@pytest.mark.parametrize("engine", ["cpu", "reference"])
def test_the_mean_of_separately_rendered_samples(engine):
    """3×2 cameras around each of two: offsets ±0.1 and 0, heights ±0.075."""
    expected = np.zeros((2, SIZE[1], SIZE[0], 4), np.int64)
    for view, offset in enumerate((-0.3, 0.3)):
        for height in (-0.075, 0.075):
            rig = replace(RIG, views=3, offsets=tuple(offset + x for x in (-0.1, 0.0, 0.1)), offset_y=height)
            samples = aus.render_views(SCENES["smooth"][0], rig, SIZE, engine=engine).color
            expected[view] += samples.sum(axis=0, dtype=int)
    difference = np.abs(through_lens(engine).astype(int) - (expected + 3) // 6)
    assert (difference > 0).mean() < 0.005  # offsets that differ in their last bit may move a silhouette
    np.testing.assert_array_equal(through_lens(engine), through_lens(engine, "n-pass"))


def test_in_focus_is_sharp_and_the_rest_is_not():
    """A plane in the focal plane is as through a pinhole; one behind it is smeared over the circle of confusion."""
    step = np.where(np.arange(64)[None, :, None] < 32, 20, 220).astype(np.uint8).repeat(64, axis=0).repeat(3, axis=2)
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    glow = aus.Material(1.0, 0.0)
    for distance, spread in ((4.0, 0.0), (8.0, 0.5)):
        corners = np.array([(-9, -9, 4 - distance), (9, -9, 4 - distance), (9, 9, 4 - distance), (-9, 9, 4 - distance)])
        wall = aus.Mesh(corners, [[0, 1, 2], [0, 2, 3]], uv=uv, texture=step, material=glow)
        rig = replace(RIG, views=1)
        sharp, soft = (
            aus.render_views(aus.Scene(wall), rig, (80, 60), options=aus.Options(aperture=a, lens=(8, 8))).color[0, 30]
            for a in (0.0, 1.0)
        )
        between = [int(((row[:, 0] > 30) & (row[:, 0] < 210)).sum()) for row in (sharp, soft)]
        f = 30 / np.tan(np.deg2rad(20))
        circle = f * 1.0 * abs(1 / 4 - 1 / distance)  # pixels that a point spreads over
        assert between[1] - between[0] == pytest.approx(circle, abs=3) if spread else between[1] == between[0]


def test_errors():
    for fields, message in (
        ({"aperture": -1.0}, r"aperture: expected a number from 0 to 1e\+15"),
        ({"lens": (0, 4)}, "lens: expected two whole numbers"),
        ({"aperture": 0.1, "depth": True}, "no one depth"),
    ):
        with pytest.raises(InputError, match=message):
            aus.Options(**fields)
    with pytest.raises(UnsupportedError, match="not into panels"):
        aus.render(SCENES["smooth"][0], aus.Display.lenticular(20, 10, 2), RIG, options=aus.Options(aperture=0.1))


def test_views_on_the_command_line(cli: Run, folder: Path):
    result = cli("views", "square.off", "-o", "out.npz", "--views", "2", "--size", "32x24", "--depth-of-field", "2x2")
    assert result.status == 0, result.err
    assert (folder / "out.npz").exists()
    for arguments, message in (
        (("--aperture", "1"), "beside --depth-of-field"),
        (("--depth-of-field", "2x2", "--aperture", "0"), "expected a number > 0"),
        (("--depth-of-field", "2"), "expected two whole numbers"),
        (("--depth-of-field", "2x2", "--depth"), "no one depth"),
    ):
        result = cli("views", "square.off", "-o", "other.npz", *arguments)
        assert result.status == 2 and message in result.err
        assert not (folder / "other.npz").exists()
