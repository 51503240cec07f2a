"""Every engine draws volumes like the reference; its single pass is its n passes; shared slabs are like exact rays."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import autostereo as aus
from autostereo.scene import samples

from .helpers import engines_for, need
from .volume_cases import (
    DISCRETE,
    DISPLAYS,
    SIZE,
    H,
    W,
    assert_alike,
    assert_one_pass_is_many,
    panel,
    place,
    psnr,
    random,
    rigs,
    scenes,
    smooth,
    transfer,
    views,
)

pytestmark = pytest.mark.parametrize("engine", engines_for(aus.Volume))
STEPS = st.sampled_from([0.5, 1.0, 2.0])
EXACT = {"volume": "exact"}


# --- rays of their own against the reference -------------------------------------------------------------------------


def assert_like_the_reference(scene, rig, engine, least, **options):
    """Colours within one level on all but 2 % of the samples if `least` is None, else of so many dB; depths alike."""
    expected = views(scene, rig, "reference", depth=True, **options)
    found = views(scene, rig, engine, depth=True, **EXACT, **options)
    if least is None:
        assert_alike(found.color, expected.color)
    else:
        assert psnr(found.color, expected.color) >= least
    both = np.isfinite(found.depth) & np.isfinite(expected.depth)
    assert (np.isfinite(found.depth) != np.isfinite(expected.depth)).mean() <= 0.01
    away = np.abs(found.depth[both] - expected.depth[both]) > 0.5 * scene.objects[0].voxel_size.min()
    assert away.sum() <= 0.02 * both.size


@given(scenes(shaded=False, steep=False), rigs(), STEPS)
@random(30)
def test_unlit_volumes_of_gentle_transfer_functions(engine, scene, rig, step):
    need(engine)
    assert_like_the_reference(scene, rig, engine, None, step=step)


@given(scenes(shaded=False, steep=True), rigs(), STEPS)
@random(20)
def test_unlit_volumes_of_steep_transfer_functions(engine, scene, rig, step):
    """256 scalars are classified: where opacity jumps, half of a 255th of the range is seen."""
    need(engine)
    assert_like_the_reference(scene, rig, engine, 42, step=step)


@given(scenes(modes=("composite",), shaded=True, steep=False), rigs())
@random(25)
def test_lit_volumes_converge_to_the_reference(engine, scene, rig):
    """The light of a slab is taken at its ends here, in its middle there: the same where slabs are thin."""
    need(engine)
    assert_like_the_reference(scene, rig, engine, 46, step=0.25)


@given(scenes(modes=("iso",), shaded=True), rigs(), STEPS)
@random(25)
def test_lit_isosurfaces(engine, scene, rig, step):
    need(engine)
    assert_like_the_reference(scene, rig, engine, None, step=step)


# --- single pass = n passes ------------------------------------------------------------------------------------------


@given(scenes(), rigs(), st.sampled_from(DISCRETE), st.sampled_from([1, 1, 4]), STEPS)
@random(15)
def test_one_pass_of_exact_rays_is_many_bit_for_bit(engine, scene, rig, name, count, step):
    need(engine)
    display, options = DISPLAYS[name], {"samples": count, "step": step, **EXACT}
    assert_one_pass_is_many(scene, display, rig, engine, **options)


@given(scenes(modes=("composite",)), rigs())
@random(15)
def test_where_a_pixel_has_one_camera_its_ray_is_its_own(engine, scene, rig):
    """Whatever may be shared: one ray for three sub-pixels costs less than slabs."""
    need(engine)
    display = DISPLAYS["lenticular"]
    many = views(scene, rig.with_views(display.views), engine, method="n-pass")
    woven = aus.interlace(many, display).pixels
    assert (panel(scene, display, rig, engine) != woven).mean() <= (0.001 if engine == "gl" else 0)


@given(scenes(modes=("composite",), steep=False), rigs(inside=False))
@random(25)
def test_shared_slabs_are_like_many_passes(engine, scene, rig):
    """Noise of a few voxels is the worst case: 8 % more than two levels off, outlines as sharp as slabs are close."""
    need(engine)
    rig = rig.with_views(4)
    one = views(scene, rig, engine, shading="center", step=0.5).color
    many = views(scene, rig, engine, method="n-pass", shading="center", step=0.5).color
    difference = np.abs(one.astype(int) - many).max(axis=-1)[smooth(many)]
    assert (difference > 2).sum() <= 0.08 * many[..., 0].size
    assert psnr(one, many) >= 36


@pytest.mark.parametrize("content", [samples.shells(32), samples.hydrogen_orbital(32), samples.engine_part(32)])
def test_shared_slabs_of_samples_are_like_many_passes(engine, content):
    """Within one level on all but 6 % of what is no outline, at 40 dB all told."""
    need(engine)
    rig = aus.Rig(position=(0.4, 0.3, 3.2), fov_y=36, views=4, baseline=0.8)
    one = views(content, rig, engine, (80, 60), shading="center", step=0.5).color
    many = views(content, rig, engine, (80, 60), method="n-pass", shading="center", step=0.5).color
    assert_alike(one, many, 0.06, where=smooth(many))
    assert psnr(one, many) >= 40


@pytest.mark.parametrize("name", ["wavelength-selective", "continuous"])
@pytest.mark.parametrize("mode", ["composite", "mip", "iso"])
def test_n_pass_subres_is_that_of_the_reference(engine, name, mode):
    need(engine)
    display, content = DISPLAYS[name], replace(samples.shells(16), mode=mode, iso=90.0 if mode == "iso" else None)
    rig = aus.Rig(position=(0.4, 0.3, 3.2), fov_y=36, baseline=0.8, views=display.views)
    both = [panel(content, display, rig, e, method="n-pass-subres", step=0.5) for e in ("reference", engine)]
    assert psnr(both[1], both[0]) >= 42


# --- panels ----------------------------------------------------------------------------------------------------------


@given(
    scenes(shaded=False, steep=False), rigs(), st.sampled_from(list(DISPLAYS)), st.sampled_from(["pixel", "subpixel"]),
    st.sampled_from([1, 1, 4]), st.sampled_from(["exact", "averaged"]),
)  # fmt: skip
@random(30)
def test_panels_of_exact_rays(engine, scene, rig, name, sampling, count, alpha):
    need(engine)
    display = DISPLAYS[name]
    options = {"sampling": sampling, "samples": count, "alpha": alpha}
    rig = rig.with_views(display.views)
    expected = panel(scene, display, rig, "reference", **options)
    assert_alike(panel(scene, display, rig, engine, **EXACT, **options), expected)


@given(
    scenes(modes=("composite",), shaded=False, steep=False), rigs(inside=False), st.sampled_from(list(DISPLAYS)),
    st.sampled_from(["pixel", "subpixel"]), st.sampled_from(["exact", "averaged"]),
)  # fmt: skip
@random(25)
def test_panels_of_shared_slabs(engine, scene, rig, name, sampling, alpha):
    need(engine)
    display, options = DISPLAYS[name], {"sampling": sampling, "alpha": alpha, "step": 0.5}
    rig = rig.with_views(display.views)
    expected = panel(scene, display, rig, "reference", **options)
    assert psnr(panel(scene, display, rig, engine, **options), expected) >= 34


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (30, 1), (2, 3), (129, 2)])
@pytest.mark.parametrize("volume", ["shared", "exact"])
def test_pictures_of_any_size(engine, size, volume):
    need(engine)
    content = replace(samples.hydrogen_orbital(16), shade=False)
    rig = aus.Rig.frame(content, aus.Display.lenticular(40, 30, 9))
    expected = views(content, rig, "reference", size, step=0.5).color
    assert expected.any()
    found = views(content, rig, engine, size, step=0.5, volume=volume).color
    display = aus.Display.slanted(*size, 9, lens_pitch=5.7, subpixel_pitch=1.0, slant_deg=9.46)
    panels = [panel(content, display, rig, e, step=0.5, volume=volume) for e in ("reference", engine)]
    for one, other in ((found, expected), panels[::-1]):
        difference = one.astype(int) - other
        if volume == "exact":
            assert np.abs(difference).max() <= 4
        else:  # pixels of many voxels: slabs are blurred, but as bright
            assert abs(difference.mean()) <= 8


def test_any_number_of_views(engine):
    """From 1 to 100, drawn at once and one by one."""
    need(engine)
    content = replace(samples.shells(16), shade=False)
    for count in (1, 2, 3, 17, 100):
        rig = aus.Rig(position=(0, 0, 3.2), fov_y=36, views=count, baseline=0.8)
        one = views(content, rig, engine, step=0.5).color
        many = views(content, rig, engine, method="n-pass", step=0.5).color
        assert one.shape == (count, H, W, 4)
        assert_alike(one, many, where=smooth(many))


# --- several volumes -------------------------------------------------------------------------------------------------


@given(
    st.lists(scenes(shaded=False, steep=False), min_size=2, max_size=2), rigs(), STEPS, st.sampled_from(list(DISPLAYS))
)
@random(10)
def test_overlapping_volumes(engine, parts, rig, step, name):
    """In views and panels; their order does not matter."""
    need(engine)
    scene = replace(parts[0], objects=tuple(part.objects[0] for part in parts))
    expected = views(scene, rig, "reference", step=step).color
    found = views(scene, rig, engine, step=step, **EXACT).color
    assert_alike(found, expected)
    if sum(v.mode == "mip" for v in scene.objects) < 2 and sum(v.mode == "iso" for v in scene.objects) < 2:
        turned = views(replace(scene, objects=scene.objects[::-1]), rig, engine, step=step, **EXACT).color
        assert np.abs(turned.astype(int) - found).max() <= 1
    display = DISPLAYS[name]
    rig = rig.with_views(display.views)
    for alpha in ("exact", "averaged"):
        panels = [panel(scene, display, rig, e, step=step, alpha=alpha, **EXACT) for e in ("reference", engine)]
        assert_alike(panels[1], panels[0])


def test_opaque_volumes_that_overlap_are_mixed(engine):
    """Two opaque boxes at one place: half of each colour, whichever comes first."""
    need(engine)
    red, green = (
        aus.Volume(
            np.full((4, 4, 4), 9, np.uint8), (0.5,) * 3, (-0.75,) * 3, shade=False,
            transfer=aus.TransferFunction([(0, *color, 1e4)]),
        )
        for color in ((1, 0, 0), (0, 1, 0))
    )  # fmt: skip
    rig = aus.Rig(position=(0, 0, 4), fov_y=36, views=3, baseline=0.8)
    for pair in ([red, green], [green, red]):
        seen = views(pair, rig, engine).color[:, H // 2, W // 2]
        assert np.abs(seen.astype(int) - (128, 128, 0, 255)).max() <= 1


# --- closed forms ----------------------------------------------------------------------------------------------------


@given(rigs(inside=False), st.integers(0, 2**32 - 1), st.sampled_from(["shared", "exact"]), STEPS)
@random(25)
def test_homogeneous_boxes_let_through_exp_of_length(engine, rig, seed, volume, step):
    """T = exp(−τ·length), in every view and however the box is turned: lengths by the reference's stretch."""
    need(engine)
    rng = np.random.default_rng(seed)
    shape = tuple(int(n) for n in rng.integers(2, 12, 3))
    tau = float(rng.uniform(0.1, 1.5))
    box = aus.Volume(np.full(shape, 7, np.uint8), shade=False, **place(rng, shape, True),
                     transfer=aus.TransferFunction([(0, 1, 1, 1, tau)]))  # fmt: skip
    rig = rig.with_views(3)
    alpha = views(box, rig, "reference").color[..., 3]  # tests/test_reference_volume.py: exact
    found = views(box, rig, engine, volume=volume, step=step).color
    inside = smooth(np.repeat(alpha[..., None], 2, axis=-1))
    error = np.abs(found[..., 3].astype(int) - alpha)[inside]
    assert error.max(initial=0) <= (1 if volume == "exact" else 6)  # lengths in slabs are those of the centre's rays
    assert error.mean() <= 1
    assert np.abs(found[..., 0].astype(int) - found[..., 3]).max() <= 1  # white over black


@pytest.mark.parametrize("volume", ["shared", "exact"])
def test_the_sampling_rate_does_not_matter(engine, volume):
    """Where the scalar is linear along rays, slabs of any thickness give the same picture."""
    need(engine)
    k = np.arange(33.0)[:, None, None] + np.zeros((33, 33, 33))
    function = aus.TransferFunction([(0, 1, 0.2, 0, 0), (16, 0, 1, 0.3, 1.5), (32, 0, 0, 1, 0.2)])
    ramp = aus.Volume(k, (0.0625,) * 3, (-1,) * 3, shade=False, transfer=function)
    rig = aus.Rig(position=(0.2, 0.1, 5), fov_y=20, views=3, baseline=0.6)
    pictures = [views(ramp, rig, engine, step=step, volume=volume).color for step in (0.25, 0.5, 1.0, 2.0)]
    for picture in pictures[1:]:
        assert_alike(picture, pictures[0], share=0.01 if volume == "exact" else 0.02)


def test_the_greatest_value_of_a_ramp_is_at_an_end(engine):
    need(engine)
    k = np.arange(17.0)[:, None, None] + np.zeros((17, 17, 17))
    bright = aus.TransferFunction([(0, 1, 1, 1, 0), (16, 1, 1, 1, 1)])
    ramp = aus.Volume(k, (0.125,) * 3, (-1,) * 3, transfer=bright, mode="mip")
    rig = aus.Rig(position=(0, 0, 5), fov_y=20, views=3, baseline=0.5)
    seen = views(ramp, rig, engine, depth=True)
    assert (seen.color[:, 8:22, 10:30] == 255).all()
    np.testing.assert_allclose(seen.depth[:, 8:22, 10:30], 4.0, rtol=1e-5)


def test_shared_slabs_of_the_benchmark_are_45_decibels_from_exact_rays(engine):
    """At the outermost of 48 views 420×560, on a step; coarse volumes too, whose shared slabs cpu makes thinner.

    They are compared with exact rays of thin slabs, those of gl, which stay as thick, with exact rays of the same.
    """
    need(engine)
    from autostereo.cli.benchmarks.workloads import rig_for, step_transfer

    for count, step in ((16, 0.25), (32, 0.25), (128, 1.0)):
        scene = aus.Scene(replace(samples.shells(count), transfer=step_transfer()))
        rig = rig_for(scene, 48, (420, 560))
        rig = replace(rig, offsets=rig.camera_offsets[[0, -1]], views=2)
        shared = views(scene, rig, engine, (420, 560)).color
        step = 1.0 if engine == "gl" else step
        exact = views(scene, rig, engine, (420, 560), step=step, **EXACT).color
        assert min(psnr(shared[i], exact[i]) for i in range(2)) >= 45


def test_what_shows_nothing_is_the_background_exactly(engine):
    need(engine)
    clear = aus.TransferFunction([(0, 1, 1, 1, 0.0), (255, 1, 1, 1, 0.0)])
    for mode in ("composite", "mip"):
        scene = aus.Scene(replace(samples.shells(16), transfer=clear, mode=mode), background=(0.2, 0.4, 0.6))
        for volume in ("shared", "exact"):
            stack = views(scene, aus.Rig(position=(0, 0, 3), views=4), engine, volume=volume, depth=True)
            assert (stack.color == (51, 102, 153, 0)).all() and np.isinf(stack.depth).all()
        found = panel(scene, DISPLAYS["slanted"], aus.Rig(position=(0, 0, 3)), engine)
        assert (found == (51, 102, 153)).all()


def test_gradients_are_not_computed_again_for_a_transfer_function(engine, monkeypatch):
    """Neither for another transform: `Renderer.update` draws what a fresh renderer does."""
    need(engine)
    content = samples.shells(20)
    rig = aus.Rig(position=(0.3, 0.2, 3.2), fov_y=36, views=3, baseline=0.8)
    renderer = aus.Renderer([content, replace(content, mode="mip")], engine=engine)
    renderer.render_views(rig, SIZE)
    if engine == "cpu":
        from autostereo.engines.cpu import volume_setup

        def refuse(*_):
            raise AssertionError("the volume is prepared again")

        for name in ("store_gradients", "measure_gradients", "block_ranges"):
            monkeypatch.setattr(volume_setup, name, refuse)
    drawn = []
    other = transfer(np.random.default_rng(1), (0, 255), False, 3.0)
    turned = aus.transforms.rotation((1, 2, 0), 40) @ np.diag([1.0, 0.7, 1.2, 1.0])
    for changes in ({"transfer": other}, {"transform": turned}, {"transfer": [content.transfer, other]}):
        renderer.update(**changes)
        found = renderer.render_views(rig, SIZE).color.copy()
        drawn.append((renderer.scene, found))
    monkeypatch.undo()
    for scene, found in drawn:
        np.testing.assert_array_equal(found, views(scene, rig, engine).color)


def test_updates_that_do_not_fit(engine):
    need(engine)
    renderer = aus.Renderer(samples.shells(16), engine=engine)
    mine = renderer.scene.objects[0].transfer
    for changes in ({"transfer": [mine, mine]}, {"transfer": "ct-bone"}, {"transfer": 3}, {"transfer": [3]},
                    {"transform": np.eye(3)}, {"transform": [np.eye(4)] * 2}, {"transform": "x"}):  # fmt: skip
        with pytest.raises(aus.InputError, match="transf"):
            renderer.update(**changes)
    assert renderer.scene.objects[0].transfer is mine
    meshes = aus.Renderer(aus.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [[0, 1, 2]]), engine=engine)
    with pytest.raises(aus.InputError, match="transfer"):
        meshes.update(transfer=mine)


def test_overlapping_volumes_where_sub_pixels_share_their_ray(engine):
    """Without a baseline all sub-pixels of a pixel look along one ray: both volumes are seen on each."""
    need(engine)
    gentle = aus.TransferFunction([(0, 1, 0.2, 0, 0.2), (255, 0, 0.5, 1, 2.0)])
    scene = [
        replace(samples.shells(16), shade=False, transfer=gentle, transform=aus.transforms.translation(x, 0, 0))
        for x in (-0.3, 0.3)
    ]
    rig = aus.Rig(position=(0.4, 0.3, 3.2), fov_y=36, baseline=0.0)
    for name in ("wavelength-selective", "table", "one view"):
        display = DISPLAYS[name]
        for alpha in ("exact", "averaged"):
            options = {"step": 0.5, "alpha": alpha, **EXACT}
            both = [panel(scene, display, rig.with_views(display.views), e, **options) for e in ("reference", engine)]
            assert_alike(both[1], both[0])
