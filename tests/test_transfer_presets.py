"""Transfer functions that are made: presets, colour maps, suggestions."""

import sys

import numpy as np
import pytest

import autostereo as aus
from autostereo import TransferFunction


# --- presets and colour maps ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", TransferFunction.presets())
def test_presets(name):
    own = TransferFunction.preset(name)
    assert own.points[0, 4] == 0 and own.max_opacity > 1
    assert own.points[0, 0] == (-1000 if name.startswith("ct") else 0)
    mapped = TransferFunction.preset(name, 10, 20, scale=0.5)
    assert mapped.points[0, 0] == 10 and mapped.points[-1, 0] == 20
    assert np.array_equal(mapped.points[:, 4], own.points[:, 4] / 2)
    assert np.array_equal(mapped.points[:, 1:4], own.points[:, 1:4])


def test_preset_names_and_ranges_are_checked():
    assert {"ct-bone", "ct-soft", "ct-vessels", "mr", "mr-brain", "generic", "gray", "fire", "x-ray"} <= set(
        TransferFunction.presets()
    )
    with pytest.raises(aus.InputError, match=r"transfer preset: expected one of generic, .*'nope'"):
        TransferFunction.preset("nope")
    with pytest.raises(aus.InputError, match="low < high"):
        TransferFunction.preset("gray", 3, 3)
    with pytest.raises(aus.InputError, match="scale"):
        TransferFunction.preset("gray", scale=-1)


def test_gray_colormap_is_a_ramp():
    transfer = TransferFunction.colormap("gray", 100, 300, 7)
    assert np.array_equal(transfer.points, [(100, 0, 0, 0, 0), (300, 1, 1, 1, 7)])
    reverse = TransferFunction.colormap("gray_r", 100, 300, [2])
    assert np.array_equal(reverse.points, [(100, 1, 1, 1, 2), (300, 0, 0, 0, 2)])


def test_opacities_of_a_colormap_are_spread_evenly():
    transfer = TransferFunction.colormap("viridis", 0, 1, [0, 3, 0])
    assert np.allclose(transfer.evaluate([0, 0.25, 0.5, 0.75, 1])[:, 3], (0, 1.5, 3, 1.5, 0))
    for bad in ([], [1, -1], "x"):
        with pytest.raises(aus.InputError, match="opacity"):
            TransferFunction.colormap("viridis", 0, 1, bad)


@pytest.mark.parametrize("name", ["gray", "viridis", "magma", "inferno", "plasma", "turbo", "coolwarm", "hot", "bone"])
def test_built_in_colormaps_are_those_of_matplotlib(name):
    matplotlib = pytest.importorskip("matplotlib")
    s = np.linspace(0, 1, 256)
    expected = matplotlib.colormaps[name](s)[:, :3]
    assert np.abs(TransferFunction.colormap(name).evaluate(s)[:, :3] - expected).max() < 9.5 / 255


def test_other_colormaps_come_from_matplotlib():
    matplotlib = pytest.importorskip("matplotlib")
    s = np.linspace(0, 1, 256)
    found = TransferFunction.colormap("twilight").evaluate(s)[:, :3]
    assert np.allclose(found, matplotlib.colormaps["twilight"](s)[:, :3], atol=1e-6)
    with pytest.raises(aus.InputError, match="neither built in"):
        TransferFunction.colormap("nope")


def test_without_matplotlib_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    TransferFunction.colormap("viridis")
    with pytest.raises(aus.DependencyError, match=r"autostereo\[colormaps\]"):
        TransferFunction.colormap("twilight")


# --- suggestions ---------------------------------------------------------------------------------------------------
def opacity_of_rays(values, transfer):
    """1 − transmittance of axis-parallel rays through voxels of size 1, three arrays."""
    tau = transfer.evaluate(values)[..., 3]
    return [-np.expm1(-tau.sum(axis=axis)) for axis in range(3)]


def sparse():
    values = np.zeros((80, 70, 60), np.int16)
    values[20:60, 30:33, 25:29] = np.random.default_rng(0).integers(200, 900, (40, 3, 4))
    return values


def balls():
    z, y, x = np.mgrid[-1:1:48j, -1:1:40j, -1:1:44j]
    return np.exp(-4 * (x**2 + y**2 + z**2)).astype(np.float32)


def labels():
    values = np.zeros((40, 40, 40), np.uint8)
    for k in range(1, 30):
        values[k : k + 8, k : k + 5, 2:30] = k
    return values


def noise():
    return np.random.default_rng(0).normal(100, 10, (30, 30, 30)).astype(np.float32)


def mask():
    return np.pad(np.ones((10, 12, 9), np.uint8), 8)


def one_voxel():
    values = np.zeros((200, 200, 200), np.uint8)
    values[101, 33, 77] = 255
    return values


@pytest.mark.parametrize("make", [sparse, balls, labels, noise, mask])
def test_suggestions_are_neither_empty_nor_opaque(make):
    values = make()
    rays = np.concatenate([a.ravel() for a in opacity_of_rays(values, TransferFunction.suggest(values))])
    hit = rays[rays > 0]
    assert 0.4 < hit.mean() < 0.8
    assert rays.max() > 0.5


@pytest.mark.parametrize("make", [sparse, labels, mask])
def test_suggestions_leave_the_background_out(make):
    values = make()
    assert TransferFunction.suggest(values).evaluate(0.0)[3] == 0
    opaque = TransferFunction.suggest(values).evaluate(values[values > 0])[:, 3] > 0
    assert opaque.mean() > 0.9


def test_suggestion_does_not_depend_on_the_unit_of_length():
    values = balls()
    one, ten = (TransferFunction.suggest(aus.Volume(values, spacing=(s, s, s))) for s in (1.0, 10.0))
    assert np.allclose(one.points[:, 4], 10 * ten.points[:, 4])
    assert np.allclose(one.points[:, :4], ten.points[:, :4])
    assert np.allclose(TransferFunction.suggest(values).points, one.points)
    assert np.allclose(TransferFunction.suggest(values, aus.Volume(values).diagonal * 10).points, ten.points)


@pytest.mark.parametrize("value", [0, 7])
def test_suggestion_for_a_constant(value):
    values = np.full((5, 6, 7), value, np.uint8)
    transfer = TransferFunction.suggest(values)
    diagonal = np.linalg.norm((4, 5, 6))
    assert -np.expm1(-transfer.evaluate(value)[3] * diagonal) == pytest.approx(1 - np.exp(-1))


def test_suggestion_for_one_voxel_is_visible():
    assert TransferFunction.suggest(one_voxel()).evaluate(255)[3] > 0


def test_suggestions_for_what_is_no_volume():
    for bad in (np.zeros((3, 3)), np.zeros((0, 3, 3)), np.full((2, 2, 2), np.nan), np.zeros((2, 2, 2), complex)):
        with pytest.raises(aus.InputError, match="values"):
            TransferFunction.suggest(bad)


def test_fitted():
    volume = aus.Volume(np.arange(60, dtype=np.uint8).reshape(3, 4, 5) + 20, spacing=(2, 2, 2))
    diagonal = 2 * np.linalg.norm((4, 3, 2))
    assert np.allclose(
        TransferFunction.fitted("ct-bone", volume).points,
        TransferFunction.preset("ct-bone", 20, 79, 1 / diagonal).points,
    )
    hounsfield = aus.Volume(np.array([[[-1000, 0], [0, 0]], [[0, 0], [0, 3000]]]))
    assert TransferFunction.fitted("ct-bone", hounsfield).points[:, 0].tolist() == [-1000, 150, 250, 400, 1000, 2000]
    assert TransferFunction.fitted("mr", hounsfield).points[-1, 0] == 3000
    assert TransferFunction.fitted("viridis", volume).points[[0, -1], 0].tolist() == [20, 79]
    with pytest.raises(aus.InputError, match=r"preset .*ct-bone.*colour map .*viridis"):
        TransferFunction.fitted("nope", volume)
    flat = aus.Volume(np.zeros((2, 2, 2), np.uint8))
    assert TransferFunction.fitted("fire", flat).points[-1, 0] == 1
