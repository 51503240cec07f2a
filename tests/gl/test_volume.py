"""Volumes on the gl engine: the reference's picture by every method, and closed forms."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import autostereo as aus
from autostereo.errors import UnsupportedError
from autostereo.scene.samples import shells
from gl_device import need_device
from volume_scenes import GREY, VIVID, blobs, box_entry, centred, homogeneous, linear

W, H, V = 36, 24, 8
RIG = aus.Rig(position=(0.5, 0.8, 4), fov_y=40, baseline=1.2, views=V, near=0.2)
MATERIAL = aus.Material(0.3, 0.6, 0.4, 12)
LIGHTS = [aus.DirectionalLight((0.5, -1, -1), (0.8, 0.7, 0.6)), aus.PointLight((1.5, 0.5, 2.5), (0.3, 0.4, 0.5))]
TRIANGLE = aus.Mesh([(-2, -2, 0.1), (2, -2, -0.1), (2, 2, 0.3)], [[0, 1, 2]], colors=[(1, 0, 0), (0, 1, 0), (0, 0, 1)])

DISPLAYS = {
    "wavelength-selective": aus.Display.wavelength_selective(W, H),
    "lenticular, per pixel": aus.Display.lenticular(W, H, V, per="pixel"),
    "lenticular, per subpixel": aus.Display.lenticular(W, H, V, per="subpixel"),
    "slanted": aus.Display.slanted(W, H, V, lens_pitch=0.9, subpixel_pitch=0.1, slant_deg=9.5),
    "slanted, reversed": aus.Display.slanted(W, H, V, lens_pitch=0.9, subpixel_pitch=0.1, slant_deg=9.5, reverse=True),
    "stereo": aus.Display.stereo(W, H, layout="column-interleaved"),
    "continuous": aus.Display.slanted(W, H, V, lens_pitch=0.9, subpixel_pitch=0.1, slant_deg=9.5, continuous=True),
}
DISCRETE = [name for name in DISPLAYS if name != "continuous"]


def small(**fields):
    """Shells, shaded with highlights."""
    return replace(shells(20), material=MATERIAL, **fields)


@cache
def scenes():
    """Every mode and mixture."""
    tilted = aus.transforms.rotation((1, 2, 3), 35)
    smooth = aus.Volume(blobs(), (0.12,) * 3, (-0.8,) * 3, transfer=VIVID, material=MATERIAL, transform=tilted)
    cut = {"clip_box": [(-0.5, -2, -0.7), (2, 0.6, 2)], "clip_plane": (1, 1, -1, 0.4)}
    plain = replace(smooth, shade=False, origin=(-0.3, -0.2, -1.0))
    behind = (0.1, 0.2, 0.3)
    return {
        "composite": aus.Scene(small(), background=behind),
        "lights": aus.Scene(smooth, LIGHTS, behind),
        "sobel, clipped": aus.Scene(replace(smooth, gradient="sobel", **cut), background=behind),
        "mip": aus.Scene(small(mode="mip"), background=behind),
        "iso": aus.Scene(small(mode="iso", **cut), LIGHTS, behind),
        "two": aus.Scene([smooth, plain], background=behind),
        "with a mesh": aus.Scene([small(), TRIANGLE], background=behind),
        "all modes, a mesh": aus.Scene([plain, small(mode="mip"), small(mode="iso"), TRIANGLE], background=behind),
    }


@cache
def reference_panel(scene, display, options):
    return aus.render(scenes()[scene], DISPLAYS[display], RIG, engine="reference", options=options).pixels.copy()


def panel(scene, display, method="single-pass", **options):
    need_device()
    chosen = aus.Options(**options)
    return aus.render(scenes()[scene], DISPLAYS[display], RIG, method=method, engine="gl", options=chosen).pixels.copy()


def assert_agree(found, expected, share=0.999):
    """At most 1/255 apart on `share` of the numbers: rounding of float32, tables of 256 scalars, 16 bits."""
    difference = np.abs(found.astype(int) - expected.astype(int))
    assert (difference <= 1).mean() >= share, (difference.max(), (difference > 1).mean())


def psnr(found, expected):
    return 10 * np.log10(255**2 / max(np.mean((found.astype(float) - expected) ** 2), 1e-9))


# --- against the reference -------------------------------------------------------------------------------------------

CASES = [(scene, "wavelength-selective", {}) for scene in (
    "composite", "lights", "sobel, clipped", "mip", "iso", "two", "with a mesh", "all modes, a mesh")]  # fmt: skip
CASES += [("composite", display, {}) for display in DISPLAYS if display != "wavelength-selective"]
CASES += [
    ("lights", "slanted", {"sampling": "subpixel"}),
    ("with a mesh", "slanted", {"sampling": "subpixel"}),
    ("lights", "wavelength-selective", {"shading": "center"}),
    ("lights", "wavelength-selective", {"step": 0.6}),
    ("iso", "slanted, reversed", {"samples": 4}),
]


METHODS = {  # n passes know no cameras between views; covering-quad is single-pass, for volumes
    "continuous": ("single-pass", "covering-quad"),
    "stereo": ("single-pass", "covering-quad", "n-pass", "n-pass-masked"),
}
MASKED = [(scene, "wavelength-selective", {}, "n-pass-masked") for scene in ("lights", "with a mesh")]


@pytest.mark.parametrize(
    ("scene", "display", "options", "method"),
    [(*case, method) for case in CASES for method in METHODS.get(case[1], ("single-pass", "n-pass"))] + MASKED,
)
def test_panels_are_the_references(scene, display, options, method):
    expected = reference_panel(scene, display, aus.Options(volume="exact", **options))
    assert_agree(panel(scene, display, method, volume="exact", **options), expected)


@pytest.mark.parametrize("scene", ["composite", "lights", "sobel, clipped", "two", "with a mesh"])
@pytest.mark.parametrize("alpha", ["exact", "averaged"])
def test_slices_and_averaged_alpha_are_the_references(scene, alpha):
    expected = reference_panel(scene, "wavelength-selective", aus.Options(volume="exact", alpha=alpha))
    for proxy in ("march", "slices"):
        assert_agree(panel(scene, "wavelength-selective", volume="exact", alpha=alpha, proxy=proxy), expected)
    if alpha == "exact":
        for method in ("n-pass", "n-pass-masked"):
            found = panel(scene, "wavelength-selective", method, volume="exact", proxy="slices")
            assert_agree(found, expected)


@pytest.mark.parametrize("scene", ["composite", "mip", "with a mesh", "all modes, a mesh", "two"])
@pytest.mark.parametrize("method", ["single-pass", "n-pass"])
def test_views_and_their_depths_are_the_references(scene, method):
    need_device()
    rig, options = RIG.with_views(2), aus.Options(volume="exact", depth=True)
    expected = aus.render_views(scenes()[scene], rig, (W, H), engine="reference", options=options)
    found = aus.render_views(scenes()[scene], rig, (W, H), method=method, engine="gl", options=options)
    assert_agree(found.color, expected.color)
    seen, shown = np.isfinite(expected.depth), np.isfinite(found.depth)
    assert (seen == shown).mean() >= 0.999
    both = seen & shown
    slab = 2 / 19
    assert np.quantile(np.abs(found.depth[both] - expected.depth[both]), 0.999) <= 0.05 * slab


def test_slices_of_views_are_the_march():
    need_device()
    for scene in ("composite", "with a mesh"):
        march, slices = (
            aus.render_views(scenes()[scene], RIG, (W, H), engine="gl", options=aus.Options(proxy=proxy)).color
            for proxy in ("march", "slices")
        )
        assert_agree(slices, march)


# --- one pass against many -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("display", DISCRETE)
@pytest.mark.parametrize("scene", ["lights", "mip", "iso", "two", "with a mesh", "all modes, a mesh"])
def test_one_pass_is_n_passes(scene, display):
    one, many = (panel(scene, display, method, volume="exact") for method in ("single-pass", "n-pass"))
    ties = 1 if scene == "all modes, a mesh" else 0  # depths have 24 bits in an atlas, 32 in a panel
    assert (one != many).sum() <= ties


@pytest.mark.parametrize("sampling", ["pixel", "subpixel"])
@pytest.mark.parametrize("scene", ["composite", "lights", "two", "with a mesh"])
def test_on_gpus_one_pass_is_n_passes(monkeypatch, scene, sampling):
    """Where channels are drawn one by one, nothing is shared."""
    from autostereo.engines.gl import volume as stage

    monkeypatch.setattr(stage, "apart", lambda job, group: True)
    one, many = (panel(scene, "slanted", method, sampling=sampling) for method in ("single-pass", "n-pass"))
    np.testing.assert_array_equal(one, many)


@pytest.fixture
def together(monkeypatch):
    """The rays of a pixel are followed together, on GPUs too."""
    from autostereo.engines.gl import volume as stage

    monkeypatch.setattr(stage, "apart", lambda job, group: job.draw.options.volume == "exact")


@pytest.mark.parametrize("scene", ["composite", "lights"])
def test_shared_lookups_stay_near_the_exact_rays(together, scene):
    """Lookups at most three quarters of a voxel beside a ray, on 20³ and 14³ voxels with steep transfer functions."""
    one, many = (panel(scene, "wavelength-selective", method) for method in ("single-pass", "n-pass"))
    assert psnr(one, many) >= 38
    assert (one != many).any(), "nothing was shared"


@pytest.mark.parametrize("flips", [(False, False), (True, True)])
@pytest.mark.parametrize("display", ["wavelength-selective", "stereo"])
@pytest.mark.parametrize("scene", ["lights", "two", "mip", "all modes, a mesh"])
def test_the_order_of_columns_changes_nothing(monkeypatch, together, scene, display, flips):
    """Panels of 75 columns: two runs of four periods of 8, and a part of one."""
    from autostereo.engines.gl import volume as stage

    need_device()
    wide = aus.Display.stereo if display == "stereo" else aus.Display.wavelength_selective
    shown = replace(wide(75, H), flip_x=flips[0], flip_y=flips[1])
    close = replace(RIG, position=(0.1, 0.1, 1.4))  # volumes reach beyond the panel
    for rig in (RIG, close):
        drawn = [aus.render(scenes()[scene], shown, rig, engine="gl").pixels.copy()]
        with monkeypatch.context() as patch:
            patch.setattr(stage, "sorted_period", lambda job, group: 0)
            drawn.append(aus.render(scenes()[scene], shown, rig, engine="gl").pixels)
        np.testing.assert_array_equal(*drawn)


def test_what_is_shared_is_bounded_by_its_distance(monkeypatch, together):
    """In a scalar that is linear in the picture's X a lookup that is x voxels beside the ray is off by x steps."""
    from autostereo.engines.gl import volume as stage

    ramp = linear((1, 0, 0), 0, (12, 12, 24), transfer=aus.TransferFunction([(0, 0, 0, 0, 4), (23, 1, 1, 1, 4)]))
    ramp = replace(ramp, shade=False, **centred((0.1,) * 3, (12, 12, 24)))
    scene, rig = aus.Scene(ramp), aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=30, baseline=1.0, views=V)
    need_device()
    exact = aus.render(scene, DISPLAYS["wavelength-selective"], rig, engine="gl", options=aus.Options(volume="exact"))
    exact = exact.pixels.astype(int)
    found = {}
    for near in (0.125, 0.25, 0.5):
        monkeypatch.setattr(stage, "NEAR_UNLIT", near)
        shared = aus.render(scene, DISPLAYS["wavelength-selective"], rig, engine="gl").pixels
        found[near] = np.abs(shared - exact).max()
        assert found[near] <= 255 / 23 * near + 1
    assert found[0.5] > found[0.125]


def test_what_is_shared_follows_the_gradient(monkeypatch, together):
    """The same with light, from lookups up to four voxels beside: where scalars are linear nothing is off."""
    from autostereo.engines.gl import volume as stage

    ramp = linear((1, 0, 0), 0, (12, 12, 24), transfer=aus.TransferFunction([(0, 0, 0, 0, 4), (23, 1, 1, 1, 4)]))
    ramp = replace(ramp, **centred((0.1,) * 3, (12, 12, 24)))
    scene, rig = aus.Scene(ramp), aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=30, baseline=1.0, views=V)
    need_device()
    panels = []
    for near in (-1.0, 4.0):
        monkeypatch.setattr(stage, "NEAR", near)
        panels.append(aus.render(scene, DISPLAYS["wavelength-selective"], rig, engine="gl").pixels.astype(int))
    assert np.abs(panels[1] - panels[0]).max() <= 2 and (panels[1] != panels[0]).any()


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("proxy", ["march", "slices"])
def test_homogeneous_cube_lets_through_what_it_must_in_every_view(turned, proxy):
    """A = 1 − exp(−τL), L the chord of the box, at every pixel of every view."""
    need_device()
    turn = aus.transforms.rotation((1, 2, 3), 35) if turned else np.eye(4)
    tau = 0.9
    cube = homogeneous(tau, **centred((0.5,) * 3, (5, 5, 5), 4.0, turn))
    rig = aus.Rig(position=(0, 0, 0), target=(0, 0, -4), fov_y=40, baseline=1.2, views=5, near=0.2)
    from autostereo.render import make_camera

    camera = make_camera(rig, (W, H))
    views = aus.render_views(cube, rig, (W, H), engine="gl", options=aus.Options(proxy=proxy)).color
    for i, offset in enumerate(rig.camera_offsets):
        enter, leave, per_depth = box_entry(cube, camera, offset)
        alpha = 1 - np.exp(-tau * np.maximum(leave - enter, 0) * per_depth).reshape(H, W)
        assert np.abs(views[i, ..., 3] / 255 - alpha).max() <= 1.02 / 255
        assert np.abs(views[i, ..., 0] / 255 - GREY[0] * alpha).max() <= 1.02 / 255


def test_a_ray_ends_when_it_has_seen_enough():
    """What lies behind an opaque front is not seen, and its lookups are spared: the picture is the front's."""
    need_device()
    front = homogeneous(1e6, (1, 0, 0), **centred((0.25,) * 3, (5, 5, 5), 3.0))
    views = aus.render_views(aus.Scene(front), aus.Rig(position=(0, 0, 0), target=(0, 0, -4), views=2, baseline=0.5),
                             (W, H), engine="gl").color  # fmt: skip
    hit = views[..., 3] > 0
    assert hit.any()
    np.testing.assert_array_equal(views[hit], np.tile([255, 0, 0, 255], (hit.sum(), 1)))


def test_cameras_amid_a_volume():
    need_device()
    rig = aus.Rig(position=(0.1, 0.05, 0.3), target=(0.1, 0.05, -1), fov_y=60, baseline=0.4, views=3, near=0.05)
    expected, found = (
        aus.render_views(scenes()["lights"], rig, (W, H), engine=engine, options=aus.Options(volume="exact")).color
        for engine in ("reference", "gl")
    )
    assert_agree(found, expected)


# --- data and limits -------------------------------------------------------------------------------------------------


def uploaded():
    return need_device().uploaded


def test_scene_data_is_sent_once():
    need_device()
    before = uploaded()
    renderer = aus.Renderer(small(), "gl")
    assert uploaded() - before == 20**3 * 8
    first = renderer.render(DISPLAYS["slanted"], RIG).pixels.copy()
    sent = uploaded()
    np.testing.assert_array_equal(renderer.render(DISPLAYS["slanted"], RIG).pixels, first)
    renderer.render_views(replace(RIG, position=(1, 0, 5)), (W, H))
    assert uploaded() == sent


def test_new_transfer_functions_and_transforms_send_no_voxels():
    need_device()
    renderer = aus.Renderer(small(), "gl")
    first = renderer.render(DISPLAYS["slanted"], RIG).pixels.copy()
    sent = uploaded()
    renderer.update(transform=aus.transforms.rotation((0, 1, 0), 30))
    assert (renderer.render(DISPLAYS["slanted"], RIG).pixels != first).any()
    other = replace(renderer.scene.objects[0], transfer=aus.TransferFunction([(0, 1, 0, 0, 0), (255, 1, 0, 0, 3)]))
    again = aus.Renderer(other, "gl")
    again.render(DISPLAYS["slanted"], RIG)
    assert uploaded() == sent


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
@pytest.mark.parametrize("wide", [True, False])
def test_every_type_of_value(dtype, wide, monkeypatch):
    """16 bits a number, or 8 where a volume is large: then a quarter of a percent of the range is not told apart."""
    from autostereo.engines.gl import volume_data

    if not wide:
        monkeypatch.setattr(volume_data, "WIDE", 0)
    need_device()
    values = (200 * blobs()).astype(dtype) - (100 if dtype == np.int16 else 0)
    low, high = float(values.min()), float(values.max())
    transfer = aus.TransferFunction([(low, 0, 0, 1, 0), ((low + high) / 2, 0, 1, 0, 2), (high, 1, 1, 1, 3)])
    volume = aus.Volume(values, (0.12,) * 3, (-0.8,) * 3, transfer=transfer, shade=wide)
    rig = RIG.with_views(2)
    expected, found = (
        aus.render_views(volume, rig, (W, H), engine=engine, options=aus.Options(volume="exact")).color
        for engine in ("reference", "gl")
    )
    if wide:
        assert_agree(found, expected)
    else:
        assert psnr(found, expected) >= 45


def test_a_volume_that_a_texture_cannot_hold_is_refused(monkeypatch):
    device = need_device()
    monkeypatch.setattr(device, "limits", replace(device.limits, texture_3d=16))
    with pytest.raises(UnsupportedError, match="20×20×20 voxels is larger than a 3-D texture of this device, 16"):
        aus.Renderer(small(), "gl")


def test_more_volumes_than_textures_are_refused():
    need_device()
    with pytest.raises(UnsupportedError, match="5 volumes of mode 'composite', at most 4"):
        aus.Renderer([small() for _ in range(5)], "gl")


def test_what_shows_nothing_leaves_the_background():
    need_device()
    empty = small(transfer=aus.TransferFunction([(0, 1, 1, 1, 0), (255, 1, 1, 1, 0)]))
    pixels = aus.render(aus.Scene(empty, background=(1, 0, 0)), DISPLAYS["slanted"], RIG, engine="gl").pixels
    np.testing.assert_array_equal(pixels, np.broadcast_to(np.uint8([255, 0, 0]), pixels.shape))


def test_methods_of_views_only():
    need_device()
    with pytest.raises(UnsupportedError, match="for panels only"):
        aus.render_views(small(), RIG, (W, H), method="covering-quad", engine="gl")
    with pytest.raises(UnsupportedError, match="draws a Volume by"):
        aus.render(small(), DISPLAYS["slanted"], RIG, method="geometry-shader", engine="gl")
