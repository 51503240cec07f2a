"""The plane rasteriser against the reference, its own n passes, closed forms, and itself when memory is short."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import autostereo as aus
from agreement.helpers import (
    RIG,
    SCENES,
    SIZE,
    assert_agree,
    interior_of_panel,
    interior_of_views,
    random_scene,
    smooth,
    soup,
)
from agreement.test_mesh_agreement import DISPLAYS, integers
from autostereo.engines.gl import context, plane_buffers, plane_rasterizer
from autostereo.engines.gl.programs import expand
from gl_device import need_device

W, H = SIZE
METHOD = "plane-rasterizer"
RANDOM = settings(deadline=None, max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
CONTINUOUS = aus.Display.slanted(W, H, 9, lens_pitch=5.7, subpixel_pitch=1, slant_deg=9.5, continuous=True)


@pytest.fixture(autouse=True)
def device():
    return need_device()


def views(scene, rig, method=METHOD, size=SIZE, engine="gl", **options):
    options = {"depth": True, **options}
    return aus.render_views(scene, rig, size, engine=engine, method=method, options=aus.Options(**options))


def panel(scene, display, rig, method=METHOD, engine="gl", **options):
    return aus.render(scene, display, rig, engine=engine, method=method, options=aus.Options(**options)).pixels


def assert_same(one, other):
    np.testing.assert_array_equal(one.color, other.color)
    np.testing.assert_array_equal(one.depth, other.depth)


# --- like the reference ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "options"), [
    ("smooth", {}), ("soup", {}), ("floor", {}), ("mirrored", {}), ("soup", {"lighting": "vertex"}),
    ("floor", {"samples": 4}), ("soup", {"shading": "center"}), ("floor", {"lighting": "vertex"}),
], ids=str)  # fmt: skip
def test_views_are_those_of_the_reference(name, options):
    scene, by = SCENES[name]
    rig = RIG.with_views(5)  # more than a block
    found, expected = views(scene, rig, **options), views(scene, rig, "n-pass", engine="reference", **options)
    inside = interior_of_views(scene, rig, SIZE, options.get("samples", 1), by)
    difference = np.abs(found.color.astype(int) - expected.color).max(axis=-1)
    levels = 3 if name == "floor" else 1  # textures are filtered with few bits
    assert difference[inside].max() <= levels and (difference[inside] > 1).mean() <= 0.001
    assert (difference > levels).mean() <= 0.005
    np.testing.assert_allclose(found.depth[inside], expected.depth[inside], rtol=2e-4)
    assert_same(found, views(scene, rig, "plane-rasterizer-n-pass", **options))


@pytest.mark.parametrize("sampling", ["pixel", "subpixel"])
@pytest.mark.parametrize("name", ["slanted physical", "looking glass, mirrored", "continuous"])
def test_panels_are_those_of_the_reference(name, sampling):
    display = DISPLAYS.get(name, CONTINUOUS)
    rig, options = RIG.with_views(display.views), aus.Options(sampling=sampling)
    for scene, by in (SCENES["smooth"], SCENES["soup"]):
        inside = interior_of_panel(scene, rig, display, options, by)
        expected = panel(scene, display, rig, "single-pass", "reference", sampling=sampling)
        assert_agree(panel(scene, display, rig, sampling=sampling), expected, inside)


@pytest.mark.parametrize("name", DISPLAYS)
def test_panels_are_woven_views_and_n_passes(name):
    display, scene = DISPLAYS[name], soup()
    rig = RIG.with_views(display.views)
    found = panel(scene, display, rig)
    woven = aus.interlace(views(scene, rig, depth=False), display)
    np.testing.assert_array_equal(found, getattr(woven, "pixels", woven))
    np.testing.assert_array_equal(found, panel(scene, display, rig, "plane-rasterizer-n-pass"))


def test_continuous_panels_are_n_passes():
    for sampling in ("pixel", "subpixel"):
        one, many = (panel(soup(), CONTINUOUS, RIG, m, sampling=sampling) for m in (METHOD, "plane-rasterizer-n-pass"))
        np.testing.assert_array_equal(one, many)


@given(data=st.data())
@RANDOM
def test_random_meshes(data):
    """Vertices on a lattice put edges on pixel centres."""
    scene = random_scene(integers(data), texture=data.draw(st.booleans()))
    rig = RIG.with_views(data.draw(st.integers(1, 9)))
    found = views(scene, rig)
    assert_same(found, views(scene, rig, "plane-rasterizer-n-pass"))
    assert_same(found, views(scene, rig, "plane-rasterizer-staggered"))
    display = aus.Display.lenticular(W, H, rig.views, per="subpixel")
    woven = aus.interlace(found, display)
    np.testing.assert_array_equal(panel(scene, display, rig), getattr(woven, "pixels", woven))
    np.testing.assert_array_equal(panel(scene, display, rig, "plane-rasterizer-staggered"), panel(scene, display, rig))
    expected = views(scene, rig, "n-pass", engine="reference")
    inside = interior_of_views(scene, rig, SIZE, 1, "triangle")
    difference = np.abs(found.color.astype(int) - expected.color).max(axis=-1)
    assert difference[inside].max(initial=0) <= (3 if scene.objects[0].texture is not None else 1)


@pytest.mark.parametrize("rig", [
    replace(RIG, position=(1, 2, 3.5), up=(0.3, 1, 0), aspect=2.0, offset_y=0.2),
    replace(RIG, spacing="equal-angle", baseline=3.0, focal_distance=2.5),
    replace(RIG, offsets=(-0.9, -0.1, 0.0, 0.35, 1.4)),
    replace(RIG, position=(0.2, 0.1, 0.9), near=0.3),
], ids=["anamorphic", "equal-angle", "offsets", "near plane"])  # fmt: skip
def test_any_rig(rig):
    found, expected = views(smooth(), rig), views(smooth(), rig, "n-pass", engine="reference")
    assert_agree(found.color, expected.color, interior_of_views(smooth(), rig, SIZE, 1, "object"))
    assert_same(found, views(smooth(), rig, "plane-rasterizer-n-pass"))


def test_of_equally_near_triangles_the_earlier_is_seen():
    first = soup().objects[0]
    second = replace(first, colors=1 - first.colors)
    rig = RIG.with_views(5)
    for one, other in ((first, second), (second, first)):
        assert_same(views(aus.Scene([one, other]), rig), views(aus.Scene(one), rig))


# --- closed forms ----------------------------------------------------------------------------------------

FAR = aus.Mesh([[-0.8, -1.2, -1.2], [1.3, -0.2, 0.8], [-0.1, 1.4, -0.4]], [[0, 1, 2]])  # depths 3.2 ... 5.2 from z = 4
WIDE = aus.Rig(position=(0, 0, 4), views=96, baseline=4.0, fov_y=36.0)


def masks(method, size=(256, 128)):
    """What of each view the triangle covers; and in NumPy, by the ruled surfaces of DESIGN's erratum 1, or planes.

    Where float32 cannot tell the sign of E, some 1e-3 pixels, what was found is expected.
    """
    width, height = size
    found = views(FAR, WIDE, method, size)
    focal = height / 2 / np.tan(np.radians(18))
    d = 4 - FAR.vertices[:, 2]
    x, y = width / 2 + focal * FAR.vertices[:, 0] / d, height / 2 - focal * FAR.vertices[:, 1] / d
    x, y, p = np.round(x * 16384) / 16384, np.round(y * 16384) / 16384, focal * (1 / 4 - 1 / d)
    column, row = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    expected, boxes = [], []
    for v in WIDE.camera_offsets:
        columns = x + v * p  # planes go on beyond the triangle's box, which the tiles cut off coarsely
        box = (column >= columns.min()) & (column <= columns.max()) & (row >= y.min()) & (row <= y.max())
        boxes.append(box)
        inside = np.where(box, np.inf, -np.inf)
        for i, j in ((0, 2), (2, 1), (1, 0)):  # clockwise, rows from the top
            slope = v if method == METHOD else WIDE.camera_offsets[0]
            step = x[j] - x[i] + slope * (p[j] - p[i])
            inside = np.minimum(inside, (y[i] - y[j]) * (column - x[i] - v * p[i]) + step * (row - y[i]))
        expected.append(inside)
    hit = np.isfinite(found.depth)
    assert method != METHOD or not (hit & ~np.array(boxes)).any()
    values = np.array(expected)
    assert (np.abs(values) < 0.1).sum() < 3000
    return hit & boxes, np.where(np.abs(values) < 0.1, hit, values > 0)


def test_side_faces_are_ruled_surfaces():
    found, expected = masks(METHOD)
    assert expected[-1].sum() > 500
    np.testing.assert_array_equal(found, expected)


def test_planes_as_printed_miss_the_triangle():
    """They fit view 0, and drift away from there: the paper's section 3.2 against DESIGN section 2, erratum 1."""
    found, expected = masks("plane-rasterizer-planar")
    np.testing.assert_array_equal(found, expected)
    exact = masks(METHOD)[0]
    np.testing.assert_array_equal(found[0], exact[0])
    print(f"last view: {found[-1].sum()} pixels by planes, {exact[-1].sum()} by ruled surfaces")
    assert found[-1].sum() < 0.8 * exact[-1].sum()


def test_planes_are_exact_where_parallax_is_the_same():
    scene = aus.Mesh([[-1, -1, -0.5], [1, -0.8, -0.5], [0.2, 1, -0.5]], [[0, 1, 2]])
    one, other = (views(scene, RIG.with_views(9), m) for m in (METHOD, "plane-rasterizer-planar"))
    np.testing.assert_array_equal(one.depth, other.depth)


def test_triangles_that_share_edges_leave_no_gap_and_do_not_overlap():
    """Two halves of a bumpy lattice that fills the picture: every sample is in exactly one of them."""
    rng, n = np.random.default_rng(5), 14
    grid = np.stack(np.meshgrid(np.linspace(-3, 3, n), np.linspace(-3, 3, n), indexing="ij"), axis=-1).reshape(-1, 2)
    height = 0.05 * rng.standard_normal(n * n)  # not so steep that it hides parts of itself
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + n, a + 1], 1), np.stack([a + n, a + n + 1, a + 1], 1)])
    half = rng.permutation(len(faces)) % 2
    rig = RIG.with_views(11)
    found = [views(aus.Mesh(np.column_stack([grid, height]), faces[half == k]), rig, size=(97, 61)) for k in (0, 1)]
    first, second = (np.isfinite(stack.depth) for stack in found)
    assert first.any() and second.any()
    np.testing.assert_array_equal(first, ~second)


def test_large_triangles_are_those_of_the_rasteriser():
    """Thousands of tiles in each view: other invocations look at them; silhouettes may differ by rounding."""
    corners = [[-4, -1, 3], [4, -1, 3], [4, 0.5, -3], [-4, 0.5, -3]]
    floor = aus.Mesh(corners, [[0, 1, 2], [0, 2, 3]], colors=np.eye(4)[:, :3])
    rig = replace(RIG, baseline=1.0).with_views(5)
    found, expected = (views(floor, rig, m, (320, 200)) for m in (METHOD, "single-pass"))
    assert np.isfinite(found.depth).mean() > 0.3
    assert (np.abs(found.color.astype(int) - expected.color).max(axis=-1) > 1).mean() < 0.001
    assert_same(found, views(floor, rig, "plane-rasterizer-n-pass", (320, 200)))


# --- memory ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limits", [
    {"FIRST_ROOM": 3, "MAX_ENTRIES": 3}, {"MAX_SAMPLES": 700}, {"MAX_TRIANGLES": 7},
    {"FIRST_ROOM": 3, "MAX_ENTRIES": 3, "MAX_SAMPLES": 700, "MAX_TRIANGLES": 7},
], ids=["queue overflows", "rounds of rows", "rounds of triangles", "all"])  # fmt: skip
def test_short_memory_changes_nothing(monkeypatch, limits):
    display, rig = DISPLAYS["slanted physical"], RIG.with_views(9)
    scene = aus.Scene([*soup().objects, *smooth().objects])
    stack, pixels = views(scene, rig), panel(scene, display, rig)
    for name, value in limits.items():
        monkeypatch.setattr(plane_buffers, name, value)
    for method in (METHOD, "plane-rasterizer-n-pass"):
        assert_same(views(scene, rig, method), stack)
        np.testing.assert_array_equal(panel(scene, display, rig, method), pixels)


def test_a_queue_that_overflowed_is_larger_in_the_next_frame(monkeypatch, device):
    monkeypatch.setattr(plane_buffers, "FIRST_ROOM", 3)
    renderer, rig = aus.Renderer(soup(), "gl"), RIG.with_views(9)
    first = renderer.render_views(rig, SIZE, method=METHOD).color.copy()
    second = renderer.render_views(rig, SIZE, method=METHOD).color
    queues = [value for _, value in renderer._prepared.kept._made.values() if isinstance(value, plane_buffers.Queue)]
    assert queues[0].room > 3
    np.testing.assert_array_equal(first, second)


def test_rounds_cover_the_picture_once():
    for size, planes, blocks in (((1000, 601), 48, 0), ((7680, 4320), 3, 24), ((5, 3), 1, 0), ((16384, 16384), 512, 0)):
        parts = list(plane_buffers.rounds(size, planes, blocks))
        assert [part.first_row for part in parts] == list(np.cumsum([0, *(part.rows for part in parts[:-1])]))
        assert sum(part.rows for part in parts) == size[1] and all(part.first_row % 4 == 0 for part in parts)
        most = plane_buffers.MAX_SAMPLES
        assert all(part.rows <= 4 or part.tiles * max(16 * planes, blocks) <= most for part in parts)


# --- the order of views (section 4.3) ---------------------------------------------------------------------

ORDER = """
#include "lib/plane_order.glsl"
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Result { uint order[]; };
void main() {
    uint number = gl_GlobalInvocationID.x, begin = first_plane(number);
    uvec2 all = uvec2(0xffffffffu, PLANES == 4u ? 0xffffffffu : 0xffffu), mask = turned(all, begin);
    for (uint k = 0u; mask != uvec2(0u); ++k) {
        order[64u * number + k] = uint(next_turned(mask, begin));
    }
}
"""


@pytest.mark.parametrize("on_panel", [False, True], ids=["views", "panel"])
def test_staggered_triangles_change_different_samples_of_a_tile(device, on_panel):
    """Triangles one after the other begin with different views, or channels; each changes every sample once."""
    planes = 3 if on_panel else 4
    for stagger in (False, True):
        defines = {"PANEL": on_panel, "STAGGER": stagger}
        with device:
            program = device.programs.compile({"order.comp": expand(ORDER, defines, context.COMPUTE_VERSION)})
            found = device.ctx.buffer(reserve=4 * 64 * planes)
            found.bind_to_storage_buffer(0)
            program.run(planes)
            device.ctx.finish()
            order = np.frombuffer(found.read(), np.uint32).reshape(planes, 64)[:, : 16 * planes]
        assert (np.sort(order, axis=1) == np.arange(16 * planes)).all()
        at_a_time = [len(set(order[:, k])) for k in range(16 * planes)]
        assert set(at_a_time) == {planes if stagger else 1}


# --- the device, and figures -----------------------------------------------------------------------------


def test_an_opengl_that_is_too_old_is_named(monkeypatch, device):
    monkeypatch.setattr(device, "version", 420)
    instead = "or choose method 'n-pass' or engine='cpu'$"
    with pytest.raises(aus.UnsupportedError, match=rf"'plane-rasterizer' needs OpenGL 4\.3, .* has 4\.2.* {instead}"):
        views(soup(), RIG)


def test_stages_are_clocked():
    with plane_rasterizer.stage_times() as times:
        views(soup(), RIG)
    assert tuple(times) == plane_rasterizer.STAGES and min(times.values()) > 0
    before = dict(times)
    views(soup(), RIG)
    assert times == before


def test_no_scene_data_is_sent_after_the_first_frame(device):
    renderer = aus.Renderer(soup(), "gl")
    before = device.uploaded
    renderer.render_views(RIG, SIZE, method=METHOD)
    renderer.render(DISPLAYS["looking glass"], method=METHOD)
    assert device.uploaded == before
