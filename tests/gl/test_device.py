"""The context, its errors, its shaders, and who may use it."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
import threading
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo.engines import constants
from autostereo.engines.gl import context, programs
from autostereo.engines.gl.atlas import MAX_PIXELS, Layout
from autostereo.engines.gl.engine import METHODS
from autostereo.engines.gl.job import read_by
from autostereo.engines.gl.volume import TOGETHER
from autostereo.scene.samples import shells, surfel_cloud
from gl_device import need_device

SCENE = aus.Scene(aus.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]]))
RIG = aus.Rig(views=3)


def test_any_thread_may_render():
    need_device()
    expected = aus.render_views(SCENE, RIG, (32, 24), engine="gl").color
    found = {}

    def render(number: int) -> None:
        found[number] = aus.render_views(SCENE, RIG, (32, 24), engine="gl").color

    threads = [threading.Thread(target=render, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(found) == [0, 1, 2, 3]
    for picture in found.values():
        np.testing.assert_array_equal(picture, expected)


def live_objects() -> dict[str, int]:
    """How many OpenGL objects of each kind there are: held by Python, or waiting to be released."""
    import moderngl

    device = need_device()
    kinds = (moderngl.Buffer, moderngl.Texture, moderngl.Framebuffer, moderngl.VertexArray, moderngl.Program)
    with device:  # releases what waits
        assert len(device.ctx.objects) == 0
    found = [item for item in gc.get_objects() if type(item) in kinds]
    return dict(Counter(type(item).__name__ for item in found))


def textured() -> aus.Mesh:
    """A triangle with a picture on it."""
    return replace(SCENE.objects[0], uv=[(0, 0), (1, 0), (0, 1)], texture=np.full((4, 4, 3), 99, np.uint8))


def isosurface() -> aus.Volume:
    """A volume of another mode than that of `shells`."""
    return replace(shells(16), mode="iso", iso=0.5)


KINDS = {
    "mesh": lambda: SCENE,
    "texture": lambda: aus.Scene(textured()),
    "points": lambda: aus.Scene(surfel_cloud(200)),
    "volume": lambda: aus.Scene(shells(16)),
    "mixed": lambda: aus.Scene([textured(), surfel_cloud(200), isosurface(), shells(16)]),
}
LEFT = [
    *((kind, "single-pass") for kind in KINDS), *((kind, "n-pass-masked") for kind in KINDS),
    *((kind, "covering-quad") for kind in KINDS), ("mixed", "n-pass-subres"), ("mixed", "dibr"),
    *(("texture", method) for method in METHODS[aus.Mesh]),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "method"), LEFT)
def test_a_renderer_leaves_nothing_behind(kind, method):
    """Not even one that is let go of on another thread; and without the help of Python's cycle collector."""
    need_device()
    display, scene = aus.Display.wavelength_selective(32, 24), KINDS[kind]()

    def render_and_forget() -> None:
        for options in (aus.Options(), aus.Options(samples=4, sampling="subpixel"), aus.Options(alpha="averaged")):
            renderer = aus.Renderer(scene, "gl")
            renderer.render(display, method=method, options=options)
            renderer.render_views(RIG, (32, 24))

    render_and_forget()  # compiles programs, which stay
    gc.collect()
    gc.disable()
    try:
        before = live_objects()
        thread = threading.Thread(target=render_and_forget)
        thread.start()
        thread.join()
        assert live_objects() == before
        render_and_forget()
        assert live_objects() == before
    finally:
        gc.enable()


def test_an_update_leaves_nothing_behind_and_shows_the_new_scene():
    need_device()
    renderer, still = aus.Renderer(SCENE, "gl"), SCENE.objects[0]
    display = aus.Display.lenticular(32, 24, 4)
    counts = []
    for step in range(4):
        moved = np.eye(4)
        moved[0, 3] = 0.3 * step
        renderer.update(transform=moved)
        found = renderer.render(display, RIG.with_views(4), method="instanced").pixels
        fresh = aus.Renderer(replace(still, transform=moved), "gl")
        expected = fresh.render(display, RIG.with_views(4), method="instanced")
        assert np.abs(found.astype(int) - expected.pixels).max() <= 1  # another origin of local coordinates
        del fresh
        counts.append(live_objects())
    assert counts[1:] == counts[:1] * 3


def test_a_frame_after_the_first_sends_no_scene_data():
    device = need_device()
    before = device.uploaded
    renderer = aus.Renderer(SCENE, "gl")
    renderer.render_views(RIG, (32, 24))
    corner, index = (3 + 3 + 3) * 4, 4
    assert device.uploaded - before == 3 * corner + 3 * index
    renderer.render_views(aus.Rig(views=5, position=(1, 0, 3)), (48, 24), method="n-pass")
    renderer.render(aus.Display.lenticular(32, 24, 4), options=aus.Options(lighting="vertex"))
    assert device.uploaded - before == 3 * corner + 3 * index


def test_without_moderngl_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    monkeypatch.setattr(context, "_made", None)
    for _ in range(2):  # the second is remembered
        with pytest.raises(aus.DependencyError, match=r"pip install autostereo\[gl\]"):
            context.get_device()


def test_without_a_driver_the_error_names_the_packages(monkeypatch):
    moderngl = pytest.importorskip("moderngl")

    def fail(*_, **__):
        raise Exception("(create) cannot open libEGL\nmore")

    monkeypatch.setattr(moderngl, "create_context", fail)
    monkeypatch.setattr(context, "_made", None)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(aus.DependencyError, match=r"cannot open libEGL\).*libegl1 libgl1-mesa-dri libgl1") as caught:
        context.get_device()
    assert "\n" not in str(caught.value)


def test_an_old_opengl_is_named():
    device = need_device()
    with pytest.raises(aus.UnsupportedError, match=r"rasteriser needs OpenGL 9\.9, .* has 4\.\d"):
        device.require(990, "the rasteriser")


def test_what_an_old_opengl_lacks_is_named_with_what_to_choose_instead(monkeypatch):
    monkeypatch.setattr(need_device(), "version", 420)
    continuous = aus.Display.slanted(24, 16, 3, lens_pitch=0.5, subpixel_pitch=0.1, slant_deg=9, continuous=True)
    table = aus.Display.wavelength_selective(24, 16)
    with pytest.raises(aus.UnsupportedError, match=r"^drawing points .* needs OpenGL 4\.3.* choose engine='cpu'$"):
        aus.Renderer(surfel_cloud(100), "gl")
    quads = (table, "covering-quad"), (continuous, "covering-quad"), (continuous, "single-pass")
    for display, method in quads:
        instead = "choose method 'n-pass' or engine='cpu'$"
        with pytest.raises(aus.UnsupportedError, match=f"^method {method!r} of meshes .* needs OpenGL 4.3.* {instead}"):
            aus.render(SCENE, display, RIG, method=method, engine="gl")
        assert aus.render(SCENE, display, RIG, method="n-pass", engine="gl").pixels.any()
    assert aus.render(SCENE, table, RIG, engine="gl").pixels.any()  # few triangles: else by covering quads


def test_auto_takes_no_gpu_that_cannot_draw_all_kinds(monkeypatch):
    device = need_device()
    monkeypatch.setattr(context, "GPU_NODES", ("/",))
    monkeypatch.setattr(device, "renderer", "a GPU")
    for version, answers in ((430, True), (420, False)):
        monkeypatch.setattr(device, "version", version)
        assert context.hardware_answers() is answers


def test_a_picture_above_the_limit_is_named():
    device = need_device()
    too_wide = device.limits.texture + 1
    with pytest.raises(aus.UnsupportedError, match=rf"{too_wide}×4 pixels .* {device.limits.texture} pixels a side"):
        aus.render_views(SCENE, RIG, (too_wide, 4), engine="gl")


def test_auto_is_the_cpu_on_software(monkeypatch):
    from autostereo.engines import engine
    from autostereo.engines.gl import engine as gl_engine

    engine.gpu_answers.cache_clear()
    device = need_device()
    if not device.is_hardware:
        monkeypatch.setattr(context, "GPU_NODES", ("/",))
        assert engine.choose_engine(SCENE) == "cpu"
    engine.gpu_answers.cache_clear()
    monkeypatch.setattr(context, "hardware_answers", lambda: True)
    assert engine.choose_engine(SCENE) == "gl"
    assert aus.Renderer(SCENE).engine.name == "gl"
    body = shells(16)
    assert engine.choose_engine(aus.Scene([body] * TOGETHER + [replace(body, mode="mip")])) == "gl"
    assert engine.choose_engine(aus.Scene([body] * (TOGETHER + 1))) == "cpu"
    monkeypatch.setattr(gl_engine, "METHODS", {})  # a GPU, and a scene that gl does not draw
    assert engine.choose_engine(SCENE) == "cpu"
    engine.gpu_answers.cache_clear()


def test_auto_loads_no_opengl_where_the_system_shows_no_gpu():
    code = (
        "import autostereo.engines.gl.context as c, autostereo.engines.engine as e, sys\n"
        "c.GPU_NODES = ()\n"
        "assert not e.gpu_answers()\n"
        "assert 'moderngl' not in sys.modules"
    )
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux shows its GPUs as files")
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_method_that_is_not_there_lists_what_is():
    need_device()
    with pytest.raises(aus.UnsupportedError, match=r"'painter': the gl engine has single-pass, n-pass"):
        aus.render_views(SCENE, RIG, engine="gl", method="painter")
    with pytest.raises(aus.UnsupportedError, match="for panels only"):
        aus.render_views(SCENE, RIG, engine="gl", method="n-pass-masked")


# --- shaders -------------------------------------------------------------------------------------------


def test_a_refused_shader_is_printed_with_numbers():
    device = need_device()
    with device, pytest.raises(programs.ShaderError) as caught:
        device.programs.compile(
            {"screen.vert": programs.source("screen.vert"), "mine.frag": "#version 400\nvoid main() {\n    oops;\n}"}
        )
    assert "refuses screen.vert, mine.frag" in str(caught.value)
    assert re.search(r"--- mine\.frag\n +1  #version 400\n +2  void main\(\) \{\n +3      oops;", str(caught.value))


def test_constants_reach_shaders():
    text = programs.expand("void main() {}", {"ON": True, "OFF": False, "HALF": 0.5, "COUNT": 3})
    assert f"#define LEVELS {constants.LEVELS}" in text and "#define ON\n" in text
    assert "OFF" not in text and "#define HALF 0.5" in text and "#define COUNT 3" in text


def test_includes_are_flat_and_all_there():
    for path in sorted(Path(programs.SHADERS).rglob("*")):
        if path.is_file():
            names = programs.INCLUDE.findall(path.read_text(encoding="utf-8"))
            assert not (names and path.parent.name == "lib"), path
            assert all((programs.SHADERS / name).is_file() for name in names), path


def test_attributes_that_a_driver_drops_are_left_out_of_vertex_arrays():
    """GPUs drop normals where there is no light; moderngl's skip_errors then bound them to gl_InstanceID, nowhere."""
    texts = {
        "mine.vert": "#version 400\nin vec3 position, normal, color;\nout vec3 tint;\n"
        "void main() { tint = color; gl_Position = vec4(position.xy, 0.1 * float(gl_InstanceID), 1.0); }",
        "mine.frag": "#version 400\nin vec3 tint;\nout vec4 shown;\nvoid main() { shown = vec4(tint, 1.0); }",
    }
    corners = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]])
    data = np.hstack([corners, np.full((3, 3), 9), np.tile([1, 0, 1], (3, 1))]).astype(np.float32)
    device = need_device()
    with device:
        ctx, program = device.ctx, device.programs.compile(texts)
        content = read_by(program, ctx.buffer(data.tobytes()), "3f4 3f4 3f4", "position", "normal", "color")
        assert content[1:] == ("3f4 3x4 3f4", "position", "color")
        target = ctx.framebuffer([ctx.texture((2, 2), 4)])
        target.use()
        ctx.enable_only(ctx.NOTHING)
        ctx.vertex_array(program, [content]).render(vertices=3)
        assert ctx.error == "GL_NO_ERROR"
        assert target.read(components=3) == b"\xff\x00\xff" * 4


def test_programs_are_compiled_once():
    device = need_device()
    aus.render_views(SCENE, RIG, (32, 24), engine="gl")
    count = len(device.programs)
    aus.render_views(SCENE, aus.Rig(views=4), (33, 24), engine="gl")
    assert len(device.programs) == count


# --- layouts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("views", "size"), [(1, (512, 512)), (8, (512, 512)), (48, (420, 560)), (45, (4096, 4096)),
                                             (3, (7680, 4320)), (4096, (16, 16)), (7, (16384, 1)), (7, (1, 16384))])
def test_layouts_hold_their_tiles_and_fit(views, size):
    limits = need_device().limits
    layout = Layout.fitting(views, size, limits)
    assert 1 <= layout.count <= views and layout.rows * layout.columns >= layout.count
    assert max(layout.size) <= limits.texture
    assert layout.count == 1 or layout.count * size[0] * size[1] <= MAX_PIXELS
    taken = {tuple(tile) for tile in layout.tiles}
    assert len(taken) == layout.count
    assert all(x % size[0] == 0 and y % size[1] == 0 for x, y in taken)
    assert np.all(layout.tiles + size <= layout.size) and np.all(layout.tiles >= 0)
    assert tuple(layout.tiles[0]) == (0, layout.size[1] - size[1])  # tile 0 at the bottom left
