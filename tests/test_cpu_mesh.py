"""The cpu engine's meshes against closed forms: no cracks, exact disparity, reuse, buffers and threads."""

import threading
from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.scene import shapes

FLAT = aus.Material(ambient=1.0, diffuse=0.0, two_sided=True)


def plane_of_cells(n, z, half=4.0, shake=0.0):
    """A square of n×n cells at height z, its inner vertices shaken sideways, each triangle its own mesh colour."""
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.linspace(-half, half, n + 1), np.linspace(-half, half, n + 1))
    inner = np.zeros_like(x)
    inner[1:-1, 1:-1] = shake * 2 * half / n
    x, y = x + inner * rng.uniform(-1, 1, x.shape), y + inner * rng.uniform(-1, 1, y.shape)
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = k[:-1, :-1].ravel(), k[:-1, 1:].ravel(), k[1:, 1:].ravel(), k[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return aus.Mesh(np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], 1), faces, material=FLAT)


@pytest.mark.parametrize("tilt", [0.0, 0.7])
@pytest.mark.parametrize("z", [-3.0, 0.0, 2.5])
def test_tessellated_plane_has_no_cracks_in_any_view(z, tilt):
    mesh = plane_of_cells(37, 0.0, half=9.0, shake=0.4)
    turn = np.eye(4)
    turn[:3, :3] = [[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]]
    turn[2, 3] = z
    mesh = aus.Mesh(mesh.vertices, mesh.faces, material=FLAT, transform=turn)
    rig = aus.Rig(views=9, baseline=1.5, fov_y=30)
    views = aus.render_views(mesh, rig, size=(131, 97), engine="cpu")
    assert (views.color[..., 3] == 255).all()
    assert (views.color[..., :3] == 255).all()
    panel = aus.render(mesh, aus.Display.wavelength_selective(131, 97), rig, engine="cpu")
    assert (panel.pixels == 255).all()


def test_every_sample_of_a_tessellation_belongs_to_exactly_one_triangle():
    """Drawn one by one, the triangles of a tessellation cover every sample once: shared edges have one owner."""
    mesh = plane_of_cells(4, 0.3, half=0.9, shake=0.4)
    rig = aus.Rig(views=5, baseline=1.0)
    count = sum(
        (aus.render_views(aus.Mesh(mesh.vertices, face[None], material=FLAT), rig, size=(64, 48)).color[..., 3] > 0)
        .astype(int)
        for face in mesh.faces
    )
    together = aus.render_views(mesh, rig, size=(64, 48)).color[..., 3] > 0
    np.testing.assert_array_equal(count, together.astype(int))


def test_focal_plane_does_not_move_between_views():
    mesh = plane_of_cells(7, 0.0, half=0.8, shake=0.4)
    colored = aus.Mesh(mesh.vertices, mesh.faces, colors=np.random.default_rng(0).random((len(mesh.vertices), 3)))
    views = aus.render_views(colored, aus.Rig(views=6, baseline=2.0), size=(90, 60), engine="cpu")
    for picture in views.color[1:]:
        np.testing.assert_array_equal(picture, views.color[0])


@pytest.mark.parametrize("depth", [2.5, 3.2, 4.0, 6.0, 11.0])
def test_dots_slide_by_the_disparity_law(depth):
    """x_i − x_c = f·vd_i·(1/fd − 1/d) (DESIGN section 1), measured as the centroid of a small square."""
    width, height, half = 1200, 60, 0.02 * depth
    square = aus.Mesh(
        [[-half, -half, 4 - depth], [half, -half, 4 - depth], [half, half, 4 - depth], [-half, half, 4 - depth]],
        [[0, 1, 2], [0, 2, 3]],
        material=FLAT,
    )
    rig = aus.Rig(views=7, baseline=0.6, fov_y=3.0)
    views = aus.render_views(square, rig, size=(width, height), engine="cpu")
    f = height / 2 / np.tan(np.deg2rad(1.5))
    wanted = width / 2 + f * rig.camera_offsets * (1 / 4.0 - 1 / depth)
    seen = (wanted > 60) & (wanted < width - 60)
    assert seen.sum() >= 3
    covered = views.color[..., 3] > 0
    centroid = [(np.nonzero(c.any(axis=0))[0] + 0.5).mean() for c in covered[seen]]
    np.testing.assert_allclose(centroid, wanted[seen], atol=0.5)


def test_reuse_in_one_view_is_exact_with_textures_too():
    """The only view is an exact one, whose colours are made a whole row of a triangle at a time."""
    plane = shapes.plane((4, 4))
    texture = np.random.default_rng(0).integers(0, 256, (16, 16, 3)).astype(np.uint8)
    scene = aus.Scene((replace(plane, texture=texture),))
    rig = aus.Rig(position=(0, 0, 4), fov_y=40, views=1)
    exact, reused = (
        aus.render_views(scene, rig, (64, 48), engine="cpu", options=aus.Options(shading=shading)).color
        for shading in ("exact", "reuse")
    )
    assert np.array_equal(exact, reused)


def test_reuse_keeps_silhouettes_and_exact_views_and_counts():
    rig = aus.Rig(views=16, baseline=0.6)
    scene = aus.Scene([shapes.uv_sphere(24, 48), shapes.torus()])
    renderer = aus.Renderer(scene, engine="cpu")
    exact = renderer.render_views(rig, (160, 120)).color.copy()
    stack = renderer.render_views(rig, (160, 120), options=aus.Options(shading="reuse"))
    np.testing.assert_array_equal(stack.color[..., 3], exact[..., 3])
    same = [i for i in range(16) if np.array_equal(stack.color[i], exact[i])]
    assert len(same) >= 2  # one exact view in every set
    assert stack.reused is not None and 0.3 < stack.reused < 1.0
    error = np.mean((stack.color[..., :3].astype(float) - exact[..., :3]) ** 2)
    assert stack.psnr(aus.ViewStack(exact)) == pytest.approx(10 * np.log10(255**2 / error))
    assert 35 < stack.psnr(aus.ViewStack(exact)) < stack.psnr(stack) == np.inf
    single = renderer.render_views(aus.Rig(views=1), (40, 30), options=aus.Options(shading="reuse"))
    assert single.reused == 0.0


def test_out_holds_the_picture_and_wrong_out_is_refused():
    renderer = aus.Renderer(shapes.icosphere(1), engine="cpu")
    rig = aus.Rig(views=2)
    out = np.empty((2, 20, 30, 4), np.uint8)
    stack = renderer.render_views(rig, (30, 20), out=out)
    assert stack.color is out
    np.testing.assert_array_equal(out, renderer.render_views(rig, (30, 20)).color)
    with pytest.raises(aus.InputError, match="out"):
        renderer.render_views(rig, (30, 20), out=out[..., :3])


def test_update_moves_the_scene():
    mesh = shapes.icosphere(2)
    moved = np.eye(4)
    moved[:3, 3] = 0.4, -0.2, 0.5
    renderer = aus.Renderer(mesh, engine="cpu")
    renderer.update(transform=moved)
    again = replace(mesh, transform=moved)
    rig = aus.Rig(views=3)
    np.testing.assert_array_equal(
        renderer.render_views(rig, (50, 40)).color, aus.render_views(again, rig, (50, 40), engine="cpu").color
    )


def test_threads_may_share_a_renderer_and_use_their_own():
    rig = aus.Rig(views=4)
    scene = shapes.icosphere(3)
    wanted = aus.render_views(scene, rig, (80, 60), engine="cpu").color
    shared = aus.Renderer(scene, engine="cpu")
    results = {}

    def work(k):
        out = np.empty((4, 60, 80, 4), np.uint8)
        renderer = shared if k % 2 else aus.Renderer(scene, engine="cpu")
        for _ in range(3):
            renderer.render_views(rig, (80, 60), out=out)
        results[k] = out

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for out in results.values():
        np.testing.assert_array_equal(out, wanted)


@pytest.mark.parametrize("views", [1, 2, 3, 5, 128, 600])
def test_any_number_of_views_is_that_many_passes(views):
    scene = shapes.icosphere(1)
    rig = aus.Rig(views=views)
    one = aus.render_views(scene, rig, (21, 13), engine="cpu")
    many = aus.render_views(scene, rig, (21, 13), method="n-pass", engine="cpu")
    np.testing.assert_array_equal(one.color, many.color)


def test_cost_of_a_continuous_panel_has_no_view_count_in_it():
    """A continuous panel shows the same picture whatever V its map is cut into, if the cameras reach as far."""
    scene = shapes.displaced_sphere(3)
    pictures = []
    for views in (9, 90):
        display = aus.Display.slanted(
            96, 64, views, lens_pitch=14.3, subpixel_pitch=1.0, slant_deg=9.0, continuous=True
        )
        # u = φV − ½ runs half a view beyond the outer cameras
        rig = aus.Rig(baseline=1.2 * (views - 1) / views)
        pictures.append(aus.render(scene, display, rig, engine="cpu").pixels.astype(int))
    assert (pictures[0] != pictures[1]).mean() < 0.002  # float32 offsets differ in the last bit


def test_what_lies_beyond_the_last_bin_is_a_triangle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of memory that nothing was written to no triangle may be read, not even where the first thousands are culled."""
    from autostereo.engines.cpu.memory import Memory

    def poisoned(self: Memory, name: str, shape: tuple[int, ...], dtype: type) -> np.ndarray:
        return np.frombuffer(b"\x71" * int(np.prod(shape) * np.dtype(dtype).itemsize), dtype).reshape(shape).copy()

    ball = shapes.icosphere(5)
    behind = replace(ball, transform=aus.transforms.translation(30, 0, 0))  # beside what is seen
    rig = aus.Rig(position=(0, 0, 3), views=3, baseline=0.5)
    display = aus.Display.wavelength_selective(96, 64)
    expected = aus.render_views(aus.Scene((ball,)), rig, (96, 64), engine="cpu").color
    panel = aus.render(aus.Scene((ball,)), display, rig.with_views(8), engine="cpu").pixels
    monkeypatch.setattr(Memory, "buffer", poisoned)
    scene = aus.Scene((behind, ball))
    assert np.array_equal(aus.render_views(scene, rig, (96, 64), engine="cpu").color, expected)
    assert np.array_equal(aus.render(scene, display, rig.with_views(8), engine="cpu").pixels, panel)
