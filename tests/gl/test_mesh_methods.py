"""Every method of the gl engine for meshes: equal to its own n-pass, like the reference, in all atlases alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from agreement.helpers import RIG, SCENES, SIZE, assert_agree, interior_of_panel, interior_of_views, levels_of, sphere
from agreement.test_mesh_agreement import DISPLAYS
from autostereo.engines.gl import atlas, frames, plane_rasterizer
from autostereo.engines.gl.mesh_buffers import split_by_repeat
from gl_device import need_device

W, H = SIZE
SAME_TILES = ["single-pass in views", "instanced", "n-pass-masked", "geometry-shader"]
SILHOUETTE = 0.002  # share of samples that rays and rasterised views may see otherwise
OPTIONS = {
    "plain": {},
    "lit vertices": {"lighting": "vertex"},
    "one eye": {"shading": "center"},
    "four samples": {"samples": 4},
    "own centres": {"sampling": "subpixel"},
}


@pytest.fixture(autouse=True, scope="module")
def device():
    return need_device()


def render(scene, display, method, rig=RIG, **options):
    """A panel; "single-pass in views" draws views also where something else is expected to be faster."""
    if method == "single-pass in views":
        with pytest.MonkeyPatch.context() as patch:
            for module in (frames, plane_rasterizer):
                patch.setattr(module, "CLEARLY", 0.0)
            return render(scene, display, "single-pass", rig, **options)
    rig = rig.with_views(display.views)
    return aus.render(scene, display, rig, method=method, engine="gl", options=aus.Options(**options)).pixels


def views(scene, rig, method, size=SIZE, **options):
    options = aus.Options(**{"depth": True, **options})
    return aus.render_views(scene, rig, size, method=method, engine="gl", options=options)


def small_ball() -> aus.Mesh:
    """A coloured sphere of 32 triangles."""
    vertices, faces = sphere(1)
    return aus.Mesh(vertices, faces, colors=0.5 + 0.5 * np.abs(vertices))


def unequal(found, expected) -> float:
    """Share of values that differ at all."""
    return float((found != expected).mean())


# --- the same tiles, drawn in another order ------------------------------------------------------------


@pytest.mark.parametrize("name", DISPLAYS)
def test_methods_for_views_draw_one_panel(name):
    display = DISPLAYS[name]
    for scene in ("smooth", "soup"):
        expected = render(SCENES[scene][0], display, "n-pass")
        for method in SAME_TILES:
            found = render(SCENES[scene][0], display, method)
            if method == "geometry-shader":  # another order of clipped corners, other roundings
                assert unequal(found, expected) <= 0.001
            else:
                np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", OPTIONS)
@pytest.mark.parametrize("scene", SCENES)
def test_methods_for_views_draw_one_panel_for_every_option(scene, name):
    display, options = DISPLAYS["looking glass, mirrored"], OPTIONS[name]
    expected = render(SCENES[scene][0], display, "n-pass", **options)
    for method in SAME_TILES:
        assert unequal(render(SCENES[scene][0], display, method, **options), expected) <= 0.001


@pytest.mark.parametrize("per_pass", [1, 2, 3, 7, None])
def test_any_number_of_views_per_pass(per_pass):
    for scene in ("smooth", "floor"):
        expected = views(SCENES[scene][0], RIG.with_views(7), "n-pass")
        found = views(SCENES[scene][0], RIG.with_views(7), "geometry-shader", views_per_pass=per_pass)
        assert unequal(found.color, expected.color) <= 0.001
        np.testing.assert_allclose(found.depth, expected.depth, rtol=1e-4)


def test_more_views_than_a_geometry_shader_makes_are_drawn_in_several_passes():
    scene, rig = SCENES["smooth"][0], RIG.with_views(70)
    found, expected = (views(scene, rig, m, (16, 12)) for m in ("geometry-shader", "n-pass"))
    assert unequal(found.color, expected.color) <= 0.001
    for per_pass in (70, 23, 7):
        same = views(scene, rig, "geometry-shader", (16, 12), views_per_pass=per_pass)
        np.testing.assert_array_equal(same.color, found.color)
        np.testing.assert_array_equal(same.depth, found.depth)


def test_views_that_one_atlas_cannot_hold_are_spread_over_several(monkeypatch):
    display, scene = DISPLAYS["slanted physical"], SCENES["floor"][0]
    methods = ["single-pass", "n-pass", "geometry-shader", "covering-quad", "n-pass-subres"]
    options = {"samples": 4, "sampling": "subpixel"}
    panels = [render(scene, display, m, **options) for m in methods]
    stack = views(scene, RIG, "single-pass", samples=4)
    monkeypatch.setattr(atlas, "MAX_PIXELS", 2 * W * H)
    assert frames.Layout.fitting(9, SIZE, need_device().limits).count == 2
    for method, expected in zip(methods, panels, strict=True):
        if method == "n-pass-subres":  # of 13×10 pixels
            monkeypatch.setattr(atlas, "MAX_PIXELS", 2 * 13 * 10)
        found = render(scene, display, method, **options)
        assert np.abs(found.astype(int) - expected).max() <= 1
        assert unequal(found, expected) <= 0.01  # roundings, as tiles lie elsewhere
    monkeypatch.setattr(atlas, "MAX_PIXELS", 2 * W * H)
    again = views(scene, RIG, "single-pass", samples=4)
    assert unequal(again.color, stack.color) <= 0.01


@pytest.mark.parametrize("scene", SCENES)
def test_views_of_an_atlas_are_the_frames_of_single_cameras(scene):
    """Tiles are cut where pictures end, and lie elsewhere: silhouettes may round differently, nothing else.

    GPUs snap corners to steps of 2^-GL_SUBPIXEL_BITS pixels of the whole atlas, and find depths between snapped ones.
    What is seen then lies at most a step beside the sample, as the weights of three corners are 1 in all: so 1/depth,
    which is affine in the picture, is off by what it gains on a step, in one picture as in the other.
    """
    thing, by = SCENES[scene]
    stack = views(thing, RIG, "single-pass")
    alone = [views(thing, replace(RIG, offsets=(v,), views=1), "single-pass") for v in RIG.camera_offsets]
    color, depth = (np.concatenate([getattr(one, name) for one in alone]) for name in ("color", "depth"))
    difference = np.abs(stack.color.astype(int) - color).max(axis=-1)
    inside = interior_of_views(thing, RIG, SIZE, 1, by)
    assert difference[inside].max() <= 1
    assert (difference > 1).mean() <= SILHOUETTE
    allowed = snapping_of(depth) if need_device().is_hardware else np.zeros_like(depth)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.abs(stack.depth / depth - 1)
    seen = inside & np.isfinite(depth)
    np.testing.assert_array_equal(np.isfinite(stack.depth)[inside], seen[inside])
    assert (off <= 1e-4 + allowed)[seen].all(), (off - allowed)[seen].max()


def snapping_of(depth: np.ndarray) -> np.ndarray:
    """How much depths (V, H, W) may differ, relative to them, where corners are snapped differently."""
    inverse = np.pad(1 / depth, ((0, 0), (1, 1), (1, 1)), mode="edge")
    middle = inverse[:, 1:-1, 1:-1]
    across = np.maximum(np.abs(inverse[:, 1:-1, 2:] - middle), np.abs(inverse[:, 1:-1, :-2] - middle))
    down = np.maximum(np.abs(inverse[:, 2:, 1:-1] - middle), np.abs(inverse[:, :-2, 1:-1] - middle))
    step = 2.0 ** -need_device().ctx.info["GL_SUBPIXEL_BITS"]
    with np.errstate(divide="ignore", invalid="ignore"):
        return 2 * step * (across + down) / middle


def test_snapped_corners_stay_within_what_is_allowed():
    """A plane through corners that are moved by half a step each way, seen at the pixels between them."""
    rng, step = np.random.default_rng(3), 2.0 ** -need_device().ctx.info["GL_SUBPIXEL_BITS"]
    x, y = np.meshgrid(np.arange(24) + 0.5, np.arange(16) + 0.5)
    for _ in range(50):
        corners, values = rng.uniform((0, 0), (24, 16), (3, 2)), rng.uniform(0.1, 2, 3)  # 1/depth
        pictures = []
        for shift in (0, step):
            moved = corners + rng.uniform(-shift, shift, (3, 2))
            samples = np.stack([x, y, np.ones_like(x)]).reshape(3, -1)
            weights = np.linalg.solve(np.vstack([moved.T, np.ones(3)]), samples)
            pictures.append((values @ weights).reshape(x.shape))
            inside = (weights >= 0).all(axis=0).reshape(x.shape)
        plain = np.where(inside, pictures[0], np.nan)
        assert (np.abs(pictures[1] / plain - 1) <= snapping_of(1 / pictures[0][None])[0] + 1e-9)[inside].all()


def test_a_single_pass_takes_the_cheaper_way():
    """Few triangles for many views: rays; many triangles for few views: views, for many the plane rasteriser.

    Continuous panels never by views.
    """
    few = aus.Scene(aus.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]]))
    many = aus.Scene(aus.Mesh(*sphere(5)))
    slanted = {"lens_pitch": 5.7, "subpixel_pitch": 1.0, "slant_deg": 9.5}
    size = 512, 384
    ways = {"views": "atlas", "rays": "channels", "planes": "plane queue"}
    for scene, display, way in [
        (few, aus.Display.slanted(*size, 45, **slanted), "rays"),
        (few, aus.Display.slanted(*size, 45, **slanted, continuous=True), "rays"),
        (many, aus.Display.wavelength_selective(*size), "views"),
        (many, aus.Display.slanted(*size, 45, **slanted), "planes"),
        (many, aus.Display.slanted(*size, 8, **slanted, continuous=True), "planes"),
    ]:
        renderer = aus.Renderer(scene, "gl")
        renderer.render(display, RIG.with_views(display.views))
        kept = {name for name, key in ways.items() if key in renderer._prepared.kept}
        assert kept == {way}


def test_a_stack_of_many_views_of_many_triangles_is_rasterised_in_one_pass():
    scene = aus.Scene(aus.Mesh(*sphere(5)))
    for count, size, way in ((2, (256, 192), "n-pass"), (64, (64, 48), "plane-rasterizer")):
        rig = RIG.with_views(count)
        found, expected = (views(scene, rig, method, size) for method in ("single-pass", way))
        np.testing.assert_array_equal(found.color, expected.color)
        np.testing.assert_array_equal(found.depth, expected.depth)


# --- every sub-pixel for its own camera ----------------------------------------------------------------


@pytest.mark.parametrize("name", OPTIONS)
@pytest.mark.parametrize("scene", SCENES)
def test_covering_quads_are_like_the_reference(scene, name):
    thing, by = SCENES[scene]
    for display in (DISPLAYS["looking glass, mirrored"], DISPLAYS["slanted table"]):
        rig, options = RIG.with_views(display.views), aus.Options(**OPTIONS[name])
        expected = aus.render(thing, display, rig, engine="reference", options=options).pixels
        found = render(thing, display, "covering-quad", **OPTIONS[name])
        inside = interior_of_panel(thing, rig, display, options, by)
        assert_agree(found, expected, inside, levels_of("gl", scene == "floor"))
        assert (np.abs(found.astype(int) - expected) > 3).mean() <= SILHOUETTE


@pytest.mark.parametrize("name", DISPLAYS)
def test_covering_quads_see_what_rasterised_views_see(name):
    for scene in ("smooth", "soup", "mirrored"):
        found, expected = (render(SCENES[scene][0], DISPLAYS[name], m) for m in ("covering-quad", "n-pass"))
        assert (np.abs(found.astype(int) - expected) > 1).mean() <= SILHOUETTE


def test_there_are_no_gaps_between_covering_quads():
    """A closed surface of small triangles fills the panel, in every sub-pixel and for every camera."""
    count = 40
    x, y = np.meshgrid(np.linspace(-4, 4, count), np.linspace(-4, 4, count))
    rng = np.random.default_rng(5)
    vertices = np.stack([x, y, rng.uniform(-1.5, 1.5, x.shape)], axis=-1).reshape(-1, 3)
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    material = aus.Material(ambient=1, diffuse=0, two_sided=True)
    scene = aus.Scene(aus.Mesh(vertices, faces, material=material), background=(0, 0, 0))
    rig = aus.Rig(position=(0, 0, 6), fov_y=36, baseline=2.0)
    display = aus.Display.slanted(200, 150, 8, lens_pitch=5.7, subpixel_pitch=1, slant_deg=9.5, continuous=True)
    for sampling in ("pixel", "subpixel"):
        assert (render(scene, display, "covering-quad", rig, sampling=sampling) == 255).all()


def test_one_depth_for_three_sub_pixels_errs_where_they_differ():
    """Depth that the views of a pixel share hides what only some of them see; on the focal plane they see the same."""
    display = aus.Display.wavelength_selective(160, 120)
    for scene in ("smooth", "soup"):
        exact, mean, least = (
            render(SCENES[scene][0], display, "covering-quad", alpha=a).astype(int)
            for a in ("exact", "averaged", "minimal")
        )
        assert 0.01 < (np.abs(mean - exact) > 1).mean() < 0.3
        assert 0.01 < (np.abs(least - exact) > 1).mean() < 0.3
    flat = aus.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    for alpha in ("averaged", "minimal"):
        found, expected = (render(flat, display, "covering-quad", alpha=a) for a in (alpha, "exact"))
        assert unequal(found, expected) <= 0.001


# --- as printed ----------------------------------------------------------------------------------------


def test_painting_from_back_to_front_is_right_for_what_can_be_sorted():
    vertices = np.concatenate([[(-1, -1, z), (1, -1, z), (0, 1, z)] for z in (1, -1, 0)])
    colors = np.repeat(np.eye(3), 3, axis=0)
    mesh = aus.Mesh(vertices, np.arange(9).reshape(3, 3), colors=colors, material=aus.Material(two_sided=True))
    apart = aus.Scene([mesh, replace(mesh, vertices=vertices - [0, 0, 4])], background=(0.2, 0.4, 0.6))
    for views_per_pass in (None, 3):
        found, expected = (
            views(apart, RIG.with_views(11), m, views_per_pass=views_per_pass, depth=False).color
            for m in ("geometry-shader-painter", "n-pass")
        )
        assert unequal(found, expected) <= SILHOUETTE
    panel = render(apart, DISPLAYS["wavelength-selective"], "geometry-shader-painter")
    assert unequal(panel, render(apart, DISPLAYS["wavelength-selective"], "n-pass")) <= SILHOUETTE


def test_painting_is_wrong_where_triangles_intersect():
    display, soup = DISPLAYS["wavelength-selective"], SCENES["soup"][0]
    assert unequal(render(soup, display, "geometry-shader-painter"), render(soup, display, "n-pass")) > 0.05


def test_painting_more_views_than_targets_takes_several_passes():
    found = [
        views(SCENES["smooth"][0], RIG.with_views(101), "geometry-shader-painter", (8, 8), views_per_pass=n).color
        for n in (None, 100, 3)
    ]
    assert found[0].any()
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


# --- small views ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lenticular per pixel", "wavelength-selective", "looking glass, mirrored"])
def test_small_views_are_woven_as_on_the_cpu(name):
    scene, display = SCENES["smooth"][0], DISPLAYS[name]
    rig = RIG.with_views(display.views)
    for size in (None, (23, 19)):
        found = render(scene, display, "n-pass-subres", small_size=size).astype(int)
        options = aus.Options(small_size=size)
        expected = aus.render(scene, display, rig, method="n-pass-subres", engine="cpu", options=options).pixels
        assert (np.abs(found - expected) > 1).mean() <= 0.02


# --- what reaches the device ---------------------------------------------------------------------------


def test_scenes_far_from_the_origin_keep_their_shape():
    far = np.array([2e6, -3e6, 1e6])
    vertices, faces = SCENES["smooth"][0].objects[0].vertices, SCENES["smooth"][0].objects[0].faces
    near, away = (aus.Scene(aus.Mesh(vertices + shift, faces)) for shift in (0, far))
    rig = replace(RIG, position=tuple(far + RIG.position), target=tuple(far))
    found, expected = views(away, rig, "single-pass"), views(near, RIG, "single-pass")
    assert np.abs(found.color.astype(int) - expected.color).max() <= 1


def test_whole_parts_of_texture_coordinates_cost_no_digits():
    """A floor tiled 4000 times looks like one tiled near the origin of its texture, vertex for vertex."""
    scene, _ = SCENES["floor"]
    mesh = scene.objects[0]
    moved = replace(scene, objects=(replace(mesh, uv=np.add(mesh.uv, (4096, -4000))),))
    found, expected = (views(s, RIG, "single-pass") for s in (moved, scene))
    np.testing.assert_array_equal(found.color, expected.color)


def test_vertices_are_doubled_only_where_whole_parts_meet():
    uv = np.array([(0.2, 0.2), (1.4, 0.3), (1.2, 1.8), (3.5, 0.5)])
    vertex, own, faces = split_by_repeat(uv, np.array([[0, 1, 2], [1, 3, 2], [2, 1, 0]]))
    assert sorted(vertex) == [0, 1, 1, 2, 2, 3]
    for face, corners in zip([[0, 1, 2], [1, 3, 2], [2, 1, 0]], faces, strict=True):
        np.testing.assert_array_equal(vertex[corners], face)
        whole = np.floor(uv[face].min(axis=0))
        np.testing.assert_allclose(own[corners], uv[face] - whole, atol=1e-15)
        assert (own[corners].min(axis=0) < 1).all() and (own[corners] >= 0).all()


def test_several_meshes_keep_their_own_materials_and_their_order():
    ball, rig = small_ball(), RIG.with_views(2)
    rng = np.random.default_rng(4)
    image = rng.integers(0, 256, (8, 8, 3)).astype(np.uint8)
    uv = rng.uniform(0, 1, (len(ball.vertices), 2))
    objects = [
        replace(ball, vertices=0.5 * ball.vertices + [x, 0, 0], material=material, **more)
        for x, material, more in [
            (-0.8, aus.Material(0.5, 0.5), {}),
            (-0.7, aus.Material(0.5, 0.5), {"colors": 1 - ball.colors}),
            (0.0, aus.Material(0.1, 0.6, 0.9, 5), {"uv": uv, "texture": image}),
            (0.7, aus.Material(0.5, 0.5), {}),
        ]
    ]
    scene = aus.Scene(objects, [aus.PointLight((1, 1, 3)), aus.DirectionalLight((0, -1, -1), (0.2, 0.3, 0.4))])
    expected = aus.render_views(scene, rig, SIZE, engine="reference")
    inside = interior_of_views(scene, rig, SIZE, 1, "object")
    assert_agree(views(scene, rig, "single-pass").color, expected.color, inside, 3)


def test_a_scene_without_light_and_one_with_many():
    ball, rig = small_ball(), RIG.with_views(2)
    for lights in ((), tuple(aus.DirectionalLight((np.cos(k), np.sin(k), -1), (0.1, 0.05, 0.02)) for k in range(20))):
        scene = aus.Scene(ball, lights)
        expected = aus.render_views(scene, rig, SIZE, engine="reference")
        inside = interior_of_views(scene, rig, SIZE, 1, "object")
        assert_agree(views(scene, rig, "single-pass").color, expected.color, inside)


# --- gathering -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DISPLAYS)
def test_pictures_are_gathered_as_by_the_reference(name):
    """interlace and merge_view bit for bit; weave by one level, where products of weights are rounded."""
    from autostereo.engines.engine import Camera, Draw, get_engine

    display, rng = DISPLAYS[name], np.random.default_rng(7)
    stack = rng.integers(0, 256, (display.views, H, W, 4)).astype(np.uint8)
    camera = Camera(np.eye(4), 1.0, 1.0, W, H, 1.0, 0.1)
    draw = Draw(camera, np.zeros(display.views), (0, 0), display.viewmap, display.flip_x, display.flip_y)
    panels = []
    for engine in (get_engine("reference"), get_engine("gl")):
        woven, merged = np.zeros((2, H, W, 3), np.uint8)
        engine.interlace(stack, draw, woven)
        merged[...] = 7
        for view in range(0, display.views, 2):
            engine.merge_view(stack[view], view, draw, merged)
        quilt = aus.ViewStack(stack).quilt(display.views, 1)[:, : display.views * W]
        panels.append((woven, merged, engine.weave(quilt, (display.views, 1), draw, (W + 13, H - 4))))
    np.testing.assert_array_equal(panels[0][0], panels[1][0])
    np.testing.assert_array_equal(panels[0][1], panels[1][1])
    assert np.abs(panels[0][2].astype(int) - panels[1][2]).max() <= 1
