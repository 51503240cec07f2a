"""The simulated machine draws what the reference engine draws, in every order and with every cache."""

from __future__ import annotations

import numpy as np
import pytest

import autostereo as aus
from agreement.helpers import RIG as SCENE_RIG
from agreement.helpers import SCENES
from agreement.helpers import SIZE as SCENE_SIZE
from autostereo.errors import InputError, UnsupportedError
from autostereo.simulator import Draw, Machine, Workload, simulate
from sim_scenes import MULTI, RIG, SIZE, layers


@pytest.mark.parametrize("machine", ["multi-view", "bf-tx", "scanline"])
@pytest.mark.parametrize("name", SCENES)
def test_equal_to_the_reference_engine(name, machine):
    """Coverage and depth to the last sample; colours to the last bit without textures.

    The machine's texels have eight bits in every mip level, the reference's only in the first: one level of difference.
    """
    scene = SCENES[name][0]
    found = simulate(scene, SCENE_RIG, Machine.load(machine), size=SCENE_SIZE)
    expected = aus.render_views(
        scene, SCENE_RIG, SCENE_SIZE, engine="reference", options=aus.Options(depth=True)
    )
    np.testing.assert_array_equal(found.color[..., 3], expected.color[..., 3])
    np.testing.assert_allclose(found.depth, expected.depth, rtol=3e-7)
    difference = np.abs(found.color.astype(int) - expected.color)
    assert difference.max() <= (1 if name == "floor" else 0)


@pytest.mark.parametrize("samples", [(2.5, -1.0), (0.0, 0.4)])
def test_vertical_lens_offset(samples):
    """Rows of a rig that is shifted up or down are those of the reference engine."""
    scene = SCENES["smooth"][0]
    rig = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=0.5, views=2, offset_y=samples[1], near=0.2)
    expected = aus.render_views(scene, rig, SCENE_SIZE, engine="reference")
    np.testing.assert_array_equal(simulate(scene, rig, MULTI, size=SCENE_SIZE).color, expected.color)


ORDERS = {
    "by view": {"traversal": {"order": "by-view"}},
    "by triangle": {"traversal": {"order": "by-triangle"}},
    "dot product": {"traversal": {"measure": "dot"}},
    "as printed": {"traversal": {"measure": "axis-unsigned"}},
    "scanline": {"traversal": {"tile": (1, 1)}},
    "tiles 4×2": {"traversal": {"tile": (4, 2)}},
    "tiles 8×4": {"traversal": {"tile": (8, 4)}},
    "two passes": {"traversal": {"views": 3}},
    "one line": {"texture": {"bytes": 64}},
    "direct mapped": {"texture": {"ways": 1}},
    "lines of 16 bytes": {"texture": {"line_bytes": 16}},
    "small blocks": {"depth": {"block": (4, 4), "z_max": False}, "color": {"block": (4, 4)}},
    "no tricks": {
        "depth": {"z_max": False, "compression": False, "fast_clear": False},
        "color": {"compression": False, "fast_clear": False},
    },
    "z-min": {"depth": {"z_min": True}},
}


@pytest.mark.parametrize("blend", ["replace", "alpha", "add", "multiply"])
def test_order_and_caches_do_not_change_pictures(blend):
    workload = layers(blend=blend)
    base = simulate(workload, RIG, MULTI, size=SIZE)
    assert base.passed.sum() > 5000
    for name, changes in ORDERS.items():
        other = simulate(workload, RIG, MULTI.with_(**changes), size=SIZE)
        np.testing.assert_array_equal(other.color, base.color, err_msg=name)
        np.testing.assert_array_equal(other.depth, base.depth, err_msg=name)
        np.testing.assert_array_equal(other.shaded, base.shaded, err_msg=name)
        assert other.counters["texels"] == base.counters["texels"], name


def test_every_fragment_that_passes_is_shaded_once():
    """Opaque layers, nearest first: then each covered pixel of each view is shaded exactly once."""
    workload = layers()
    draw = workload.draws[0]
    flat = np.repeat(np.array([5.0, 6.0, 7.0, 8.0])[:, None], 3, axis=1)  # depths without crossings
    corners = np.concatenate([draw.corners[:4, :, :2] * 2, 4 - flat[..., None]], axis=2)
    ordered = Workload((Draw(corners, draw.attributes[:4], "level", (0, 1), (1.0,)),), workload.textures)
    report = simulate(ordered, RIG, MULTI, size=SIZE, maps=True)
    covered = np.isfinite(report.depth).sum(axis=(1, 2))
    np.testing.assert_array_equal(report.shaded, covered)
    np.testing.assert_array_equal(report.passed, covered)
    np.testing.assert_array_equal(report.how == 1, np.isfinite(report.depth))
    assert report.misses.sum() == report.counters["texture_misses"] > 0


def test_one_way_cache_of_one_line_misses_as_often_as_lines_change():
    """A plane that reads one texel level: every change of line is a miss."""
    small = simulate(layers(count=1), RIG, MULTI.with_(texture={"bytes": 64}), size=SIZE)
    large = simulate(layers(count=1), RIG, MULTI.with_(texture={"bytes": 1 << 20}), size=SIZE)
    assert small.counters["texture_misses"] > 20 * large.counters["texture_misses"] > 0
    assert large.counters["texture_misses"] <= 128 * 128 // 16 * 4 / 3 + 100  # each line once


def test_brute_force_machines_have_the_same_cache():
    for views in (1, 2, 4, 16):
        sizes = {name: Machine.load(name).cache_bytes(views) for name in ("multi-view", "bf-tx", "bf-dc")}
        assert set(sizes.values()) == {6144 + views * 1024}, sizes


def test_own_shader_reads_textures_and_is_charged():
    from autostereo.simulator.kernels.textures import trilinear

    def twice(at, dx, dy, eye, uniforms, memory, units, out):
        trilinear(memory, units[0], at[0], at[1], dx[0], dx[1], dy[0], dy[1], out)
        trilinear(memory, units[1], out[0], out[1], 0.0, 0.0, 0.0, 0.0, out)  # a dependent read

    built = layers(count=4)
    draw = built.draws[0]
    own = Workload((Draw(draw.corners, draw.attributes, twice, (0, 1)),), built.textures)
    report = simulate(own, RIG, MULTI, size=SIZE)
    assert report.counters["lookups"] == 2 * report.shaded.sum() > 0
    other = simulate(own, RIG, MULTI.with_(traversal={"order": "by-view"}), size=SIZE)
    np.testing.assert_array_equal(report.color, other.color)


def test_errors():
    with pytest.raises(InputError, match="expected a Machine"):
        simulate(layers(), RIG, "multi-view", size=SIZE)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="tile: 8×8 is larger than the frame of 4×4"):
        simulate(layers(), RIG, MULTI, size=(4, 4))
    with pytest.raises(UnsupportedError, match="holds a Points"):
        simulate(aus.Scene(aus.Points(np.zeros((1, 3)), radii=np.ones(1))), RIG, MULTI, size=SIZE)
    with pytest.raises(InputError, match="below 2"):
        Workload((Draw(np.zeros((1, 3, 3)), np.zeros((1, 3, 1)), "plain", (2,)),), layers().textures)
