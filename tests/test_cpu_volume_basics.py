"""Volumes on the cpu engine: closed forms, the reference, single-pass against n-pass, panels, mixed scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import autostereo as aus
from autostereo.scene import samples, shapes

RIG = aus.Rig(position=(0.7, 0.6, 3.2), fov_y=36, views=3, baseline=1.0)
SIZE = (72, 56)
SHELLS = replace(samples.shells(32), material=aus.Material())
CLOUD = samples.surfel_cloud(2000)
MESH = shapes.displaced_sphere(3)


def psnr(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    error = a.astype(np.float64) - b
    return float(10 * np.log10(255**2 / max((error**2).mean(), 1e-9)))


def views(scene: object, rig: aus.Rig = RIG, **options: object) -> NDArray[np.uint8]:
    return aus.render_views(scene, rig, SIZE, engine="cpu", options=aus.Options(**options)).color  # type: ignore[arg-type]


def reference(scene: object, rig: aus.Rig = RIG, **options: object) -> aus.ViewStack:
    return aus.render_views(scene, rig, SIZE, engine="reference", options=aus.Options(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize("volume", ["shared", "exact"])
@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
def test_homogeneous_cube_attenuates_as_the_closed_form(volume: str, step: float) -> None:
    """Through the middle of a cube of edge 2 seen face on, T = exp(−2τ·(length of the ray per unit of depth))."""
    tau = 0.35
    transfer = aus.TransferFunction([(0, 1, 1, 1, tau), (255, 1, 1, 1, tau)])
    cube = aus.Volume(np.full((17, 17, 17), 90, np.uint8), (0.125,) * 3, (-1, -1, -1), transfer=transfer, shade=False)
    rig = aus.Rig(position=(0, 0, 6), fov_y=24, views=5, baseline=0.8)
    got = views(cube, rig, volume=volume, step=step)[:, SIZE[1] // 2, SIZE[0] // 2]
    f = SIZE[1] / 2 / np.tan(np.deg2rad(12))
    across = (0.5 / f) - rig.camera_offsets / rig.focal
    alpha = 255 * (1 - np.exp(-2 * tau * np.sqrt(1 + across**2 + (0.5 / f) ** 2)))
    assert np.abs(got[:, 3] - alpha).max() <= 1.0
    assert np.abs(got[:, 0] - alpha).max() <= 1.0  # white emission over black


SCENES = {
    "composite": (SHELLS, 45, 0.4),
    "unshaded": (replace(SHELLS, shade=False), 50, 0.2),
    "mip": (replace(SHELLS, mode="mip"), 55, 0.1),
    "iso": (replace(SHELLS, mode="iso", iso=100.0), 40, 0.1),
    "clipped": (replace(SHELLS, clip_plane=(0, 0, -1, 0.2), clip_box=[[-0.8, -1, -1], [1, 1, 1]]), 42, 0.4),
    "with a mesh": ([aus.Mesh(np.asarray(MESH.vertices) * 0.45, MESH.faces, colors=MESH.colors), SHELLS], 45, 0.4),
    "with points": ([replace(CLOUD, transform=np.diag([0.6, 0.6, 0.6, 1.0])), SHELLS], 42, 0.4),
}


@pytest.mark.parametrize("name", SCENES)
def test_rays_of_their_own_agree_with_the_reference(name: str) -> None:
    scene, least, bias = SCENES[name]
    want, got = reference(scene).color, views(scene, volume="exact")
    assert want.any()
    assert psnr(want, got) >= least
    assert abs(got.astype(int) - want).mean() <= 1 and abs((got.astype(int) - want).mean()) <= bias


@pytest.mark.parametrize("kind", ["uint8", "int8", "uint16", "int16", "float32", "float64"])
def test_storage_does_not_change_the_picture(kind: str) -> None:
    small = (samples.shells(24).values // 2).astype(kind)
    transfer = samples.shells(24).transfer
    half = aus.TransferFunction(np.column_stack([transfer.points[:, :1] / 2, transfer.points[:, 1:]]))
    scene = replace(samples.shells(24), values=small, transfer=half, material=aus.Material())
    base = replace(scene, values=small.astype(np.uint8))
    got, want = views(scene), views(base)
    if kind.startswith("float"):  # scaled to 16 bits, so that a table's row may be the next one
        assert psnr(got, want) >= 45
    else:
        assert np.abs(got.astype(int) - want).max() <= 1


def test_shared_slabs_agree_with_rays_of_their_own() -> None:
    """At the outermost views too; a pixel is a voxel here. Steps: test_cpu_volume_shared."""
    scene = samples.shells(64)
    shared, exact = views(scene), views(scene, volume="exact", shading="center")
    for i in range(3):
        assert psnr(shared[i], exact[i]) >= 46


PANELS = {
    "wavelength": aus.Display.wavelength_selective(72, 48),
    "lenticular": aus.Display.lenticular(72, 48, 8, per="pixel"),
    "slanted": aus.Display.slanted(72, 48, 8, lens_pitch=15.0, subpixel_pitch=1.0, slant_deg=9.5),
    "continuous": aus.Display.slanted(
        72, 48, 8, lens_pitch=15.0, subpixel_pitch=1.0, slant_deg=9.5, continuous=True, reverse=True
    ),
}


@pytest.mark.parametrize("name", PANELS)
@pytest.mark.parametrize("volume", ["shared", "exact"])
def test_panels_agree_with_the_reference(name: str, volume: str) -> None:
    rig = replace(RIG, views=8)
    want = aus.render(SHELLS, PANELS[name], rig, engine="reference").pixels
    got = aus.render(SHELLS, PANELS[name], rig, engine="cpu", options=aus.Options(volume=volume)).pixels
    assert want.any()
    assert psnr(want, got) >= (45 if volume == "exact" else 36)


def test_discrete_panel_of_own_rays_is_the_n_pass_panel() -> None:
    """Views of n passes are rays of their own, so the panel gathered from them is the same, bit for bit."""
    rig, display = replace(RIG, views=8), PANELS["wavelength"]
    options = aus.Options(volume="exact")
    single = aus.render(SHELLS, display, rig, engine="cpu", options=options).pixels
    many = aus.render(SHELLS, display, rig, engine="cpu", method="n-pass", options=options).pixels
    assert np.abs(single.astype(int) - many).max() <= 1


def test_averaged_alpha_is_the_papers() -> None:
    rig, options = replace(RIG, views=8), aus.Options(alpha="averaged")
    want = aus.render(SHELLS, PANELS["wavelength"], rig, engine="reference", options=options).pixels
    got = aus.render(SHELLS, PANELS["wavelength"], rig, engine="cpu", options=options).pixels
    exact = aus.render(SHELLS, PANELS["wavelength"], rig, engine="cpu").pixels
    assert psnr(want, got) >= 34 and (got != exact).any()


def test_nothing_shown_is_the_background_exactly() -> None:
    clear = aus.TransferFunction([(0, 1, 1, 1, 0.0), (255, 1, 1, 1, 0.0)])
    scene = aus.Scene(replace(SHELLS, transfer=clear), background=(0.2, 0.4, 0.6))
    assert (views(scene) == np.array([51, 102, 153, 0])).all()


def test_frames_of_a_renderer_equal_fresh_ones() -> None:
    renderer = aus.Renderer(SHELLS, engine="cpu")
    renderer.render_views(replace(RIG, views=5), (40, 30))
    renderer.render(PANELS["slanted"], replace(RIG, views=8))
    assert (renderer.render_views(RIG, SIZE).color == views(SHELLS)).all()


def test_camera_inside_and_near_plane() -> None:
    rig = aus.Rig(position=(0, 0, 0.4), target=(0, 0, -1), fov_y=60, views=2, baseline=0.1)
    assert psnr(reference(SHELLS, rig).color, views(SHELLS, rig, volume="exact")) >= 40
