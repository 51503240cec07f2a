"""Slabs that views share on the cpu engine: bundles of them, what lies between sampled positions, woven panels."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo.engines.cpu import volume, volume_cut
from autostereo.engines.cpu.volume_plan import view_groups
from autostereo.engines.cpu.volume_setup import PLAIN, TABLE, face_range, is_sharp, make_plain, make_table
from autostereo.scene import samples
from test_cpu_volume_basics import psnr

SHELLS = replace(samples.shells(32), material=aus.Material())
CLOSE = aus.Rig(position=(0.3, 0.4, 3.0), fov_y=40, views=24, baseline=0.9)
DISPLAYS = {
    "wavelength-selective": aus.Display.wavelength_selective(120, 90),
    "one view": aus.Display.slanted(120, 90, views=1, lens_pitch=0.2, subpixel_pitch=0.05, slant_deg=0),
    "slanted": aus.Display.slanted(120, 90, views=7, lens_pitch=0.25, subpixel_pitch=0.06, slant_deg=-9.5),
    "alioscopy": aus.Display.preset("alioscopy-8").resized(120, 90),
    "flipped": replace(aus.Display.wavelength_selective(120, 90), flip_x=True, flip_y=True),
}


@pytest.mark.parametrize("name", DISPLAYS)
def test_a_panel_of_few_views_is_woven_from_views_that_share_their_slabs(name: str) -> None:
    """Bit for bit where voxels are so wide that views, too, take one position a pixel."""
    display = DISPLAYS[name]
    rig, scene = CLOSE.with_views(display.views), samples.shells(16)
    stack = aus.render_views(scene, rig, (120, 90), engine="cpu")
    if display.views == 1:  # a view of its own takes its own rays
        assert psnr(aus.render(scene, display, rig, engine="cpu").pixels, stack.color[0, ..., :3]) > 45
        return
    expected = aus.interlace(stack, display).pixels
    assert np.array_equal(aus.render(scene, display, rig, engine="cpu").pixels, expected)
    assert len(np.unique(expected)) > 100


@pytest.mark.parametrize("size", [2, 4, 8])
def test_bundles_are_like_slabs_blended_one_by_one(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def views(size: int) -> np.ndarray:
        def plan(camera, slices, offsets, fine, pixel):  # type: ignore[no-untyped-def]
            return size, view_groups(offsets, 0.1 if size > 1 else np.inf)

        monkeypatch.setattr(volume, "plan_bundles", plan)
        return aus.render_views(SHELLS, CLOSE, (150, 110), engine="cpu").color

    one, bundles = views(1), views(size)
    assert psnr(bundles, one) > 45
    for offset in (-1, 1):  # moved by a pixel they would be far from it
        assert psnr(np.roll(bundles, offset, axis=2), one) < 35


@given(st.lists(st.floats(-5, 5), min_size=1, max_size=40, unique=True), st.floats(0.01, 20))
def test_groups_of_views_are_no_wider_than_asked(offsets: list[float], most: float) -> None:
    offsets = np.sort(offsets)
    begins = view_groups(offsets, most)
    assert begins[0] == 0 and begins[-1] == len(offsets) and (np.diff(begins) > 0).all()
    for first, end in pairwise(begins):
        assert offsets[end - 1] - offsets[first] <= most * (1 + 1e-9)


points = st.tuples(st.integers(0, 255), *[st.floats(0, 1)] * 3, st.floats(0, 40))


@given(
    st.lists(points, min_size=2, max_size=6, unique_by=lambda point: point[0]), st.integers(0, 255), st.integers(0, 255)
)
@settings(deadline=None, max_examples=30)
def test_a_slab_is_plain_where_it_keeps_to_its_chord(given_points, one: int, other: int) -> None:  # type: ignore[no-untyped-def]
    table = make_table(aus.TransferFunction(sorted(given_points)), 0.0, 255.0, 0.05)
    plain = make_plain(table).reshape(TABLE, TABLE)
    assert np.array_equal(plain, plain.T)
    low, high = min(one, other), max(one, other)
    if not plain[low, high] or low == high:
        return
    same = table.reshape(TABLE, TABLE).diagonal()
    opacity = 1 - np.exp2(-(same & 0xFFFFFFFF).astype(np.uint32).view(np.float32).astype(np.float64))
    for curve in (opacity, *(opacity * ((same >> shift & 1023) / 1023) for shift in (32, 42, 52))):
        chord = np.interp(np.arange(low, high + 1), [low, high], curve[[low, high]])
        assert np.abs(curve[low : high + 1] - chord).max() <= PLAIN * (1 + 1e-9)


def test_constant_and_empty_transfer_functions_are_plain_everywhere() -> None:
    for opacity in (0.0, 3.0):
        table = make_table(aus.TransferFunction([(0, 1, 1, 1, opacity), (255, 1, 1, 1, opacity)]), 0.0, 255.0, 0.1)
        assert make_plain(table).all()


def sheet(edge: int) -> aus.Volume:
    """Scalars that rise across the picture, of which one narrow range shows: an upright line of a pixel or two."""
    ramp = np.broadcast_to(np.linspace(0, 60000, edge).astype(np.uint16), (edge, edge, edge))
    spike = aus.TransferFunction([(29450, 1, 1, 1, 0), (30000, 1, 1, 1, 20), (30550, 1, 1, 1, 0)])
    return aus.Volume(ramp, (2 / (edge - 1),) * 3, (-1, -1, -1), transfer=spike, shade=False)


SCENES = {
    "shells": samples.shells(32),
    "engine part": samples.engine_part(32),
    "orbital": samples.hydrogen_orbital(24),
    "sheet": sheet(16),
    "sheet of narrow voxels": sheet(40),
}


@pytest.mark.parametrize("name", SCENES)
def test_what_lies_between_sampled_positions_is_as_if_it_were_sampled(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = aus.Rig(position=(0, 0, 6), fov_y=24, views=9, baseline=0.6)

    def views(plain: int | None) -> np.ndarray:
        if plain is not None:
            monkeypatch.setattr(volume_cut, "make_plain", lambda table: np.full(TABLE**2, plain, np.uint8))
        return aus.render_views(SCENES[name], rig, (96, 64), engine="cpu").color.astype(int)

    found, sampled, careless = views(None), views(0), views(1)
    assert np.abs(found - sampled).max() <= 5 and psnr(found, sampled) >= 60
    assert not np.array_equal(careless, sampled)  # some are interpolated at all
    if name == "sheet of narrow voxels":  # which would be missed, were the transfer function not looked at
        assert np.abs(careless - sampled).max() > 100


# --- sharp edges -----------------------------------------------------------------------------------------------------


def ball(opacity: float, edge: int = 48) -> aus.Volume:
    """All within 0.8 shows, nothing beyond."""
    x = np.linspace(-1, 1, edge)
    radius = np.sqrt(x[:, None, None] ** 2 + x[:, None] ** 2 + x**2).astype(np.float32)
    shown = [(0, 1, 0.3, 0.1, opacity), (0.8, 1, 0.3, 0.1, opacity), (0.8, 0, 0, 0, 0), (1.8, 0, 0, 0, 0)]
    return aus.Volume(radius, (2 / (edge - 1),) * 3, (-1, -1, -1), transfer=aus.TransferFunction(shown), shade=False)


OPAQUE = aus.TransferFunction([(0, 1, 1, 1, 100), (1, 0.9, 0.3, 0.1, 100)])
STEP = aus.TransferFunction([(0, 0, 0, 0, 0), (100, 0, 0, 0, 0), (100, 1, 0.7, 0.3, 30), (255, 1, 0.7, 0.3, 30)])
SHARP = {
    "thin ball": ball(10),
    "ball": ball(30),
    "opaque ball": ball(300),
    "step in shells": replace(samples.shells(64), transfer=STEP),
    "box": aus.Volume(np.ones((9, 9, 9)), (0.2,) * 3, (-0.8,) * 3, transfer=OPAQUE, shade=False),
    "cut": replace(
        samples.shells(48),
        transfer=aus.TransferFunction([(0, 0, 0, 0, 0), (80, 1, 1, 0, 0), (250, 1, 0, 1, 90)]),
        clip_plane=(0.3, 0.2, -1, 0),
    ),
}


@pytest.mark.parametrize("name", SHARP)
def test_edges_are_as_sharp_as_those_of_rays_of_their_own(name: str) -> None:
    """In the outermost views too, beside which the middle one shows by how far they would be blurred."""
    scene, rig = SHARP[name], CLOSE.with_views(9)
    assert is_sharp(scene, face_range(scene))
    exact = aus.Options(volume="exact", shading="center")
    found = aus.render_views(scene, rig, (160, 120), engine="cpu").color
    expected = aus.render_views(scene, rig, (160, 120), engine="cpu", options=exact).color
    for k in (0, 4, 8):
        assert psnr(found[k], expected[k]) >= 50
    assert psnr(np.roll(found, 1, axis=2), expected) < 35
    for display in DISPLAYS.values():
        own = rig.with_views(display.views)
        panels = [aus.render(scene, display, own, engine="cpu", options=o).pixels for o in (aus.Options(), exact)]
        assert psnr(*panels) >= 50


@pytest.mark.parametrize("name", ["shells", "engine_part", "hydrogen_orbital", "c60_density"])
def test_most_volumes_have_no_sharp_edges(name: str) -> None:
    volume = getattr(samples, name)()
    assert not is_sharp(volume, face_range(volume))


def test_edges_are_drawn_over_what_is_behind_them() -> None:
    """Volumes of the greatest value come after those that compose, an isosurface before: then all rays are exact."""
    behind = replace(samples.shells(32), mode="mip")
    scene = aus.Scene((ball(30), behind), background=(0.2, 0.5, 0.9))
    exact = aus.Options(volume="exact", shading="center")
    found = aus.render_views(scene, CLOSE.with_views(5), (160, 120), engine="cpu").color
    expected = aus.render_views(scene, CLOSE.with_views(5), (160, 120), engine="cpu", options=exact).color
    assert psnr(found, expected) >= 50
