"""A frame is refused for all the memory that it takes, not array by array."""

from __future__ import annotations

import importlib
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo import Renderer
from autostereo.encoders.video import animation_memory, save_animation
from autostereo.memory import gigabytes
from autostereo.scene.samples import surfel_cloud
from gl_device import need_device

DOOR = importlib.import_module("autostereo.render")  # the module: the package gives the function of that name
RIG = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=1.2, views=12, near=0.2)
SIZE = (1280, 960)
TABLE = aus.Display.slanted(*SIZE, 12, lens_pitch=5.7, subpixel_pitch=1.0, slant_deg=9.46)
PICTURE = 4 * SIZE[0] * SIZE[1]
SMALL = 8_000_000  # bytes of what is no picture: bands of rows, triangles, offsets
PACKED = {
    "side by side": aus.Display.stereo(*SIZE, layout="side-by-side"),
    "frame packing": aus.Display.stereo(1920, 1080, layout="frame-packing-1080p"),
    "depth": aus.Display.rgbd(2 * SIZE[0], SIZE[1]),
}


def triangle() -> aus.Scene:
    """A triangle, which hardly takes memory itself."""
    return aus.Scene(aus.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]]))


def mixed() -> aus.Scene:
    """The triangle and some surfels: drawn in stages."""
    return aus.Scene([*triangle().objects, surfel_cloud(100)])


def frame(scene: aus.Scene, what: str, method: str, engine: str, **options: object) -> None:
    """A frame of a fresh renderer."""
    given = aus.Options(**options)  # type: ignore[arg-type]
    if what == "views":
        Renderer(scene, engine).render_views(RIG, SIZE, method=method, options=given)
    else:
        Renderer(scene, engine).render(PACKED.get(what, TABLE), RIG, method=method, options=given)


CASES = {
    "views": (triangle, "views", "single-pass", {}),
    "views with depth": (triangle, "views", "single-pass", {"depth": True}),
    "views in stages": (mixed, "views", "single-pass", {}),
    "views in stages, with depth, samples": (mixed, "views", "single-pass", {"depth": True, "samples": 4}),
    "views in stages, samples": (mixed, "views", "single-pass", {"samples": 4}),
    "n passes": (mixed, "views", "n-pass", {"depth": True}),
    "warped": (triangle, "views", "dibr", {"references": 5}),
    "warped in stages": (mixed, "views", "dibr", {"references": 5, "samples": 4}),
    "through a lens": (triangle, "views", "single-pass", {"aperture": 0.1, "lens": (6, 2)}),
    "through a lens, warped": (mixed, "views", "dibr", {"aperture": 0.1, "lens": (6, 2), "references": 4}),
    "panel": (triangle, "panel", "single-pass", {}),
    "panel in stages": (mixed, "panel", "single-pass", {"samples": 4}),
    "panel by n passes": (mixed, "panel", "n-pass", {"sampling": "subpixel"}),
    "panel of small views": (triangle, "panel", "n-pass-subres", {}),
    "panel of small views, sub-pixels": (mixed, "panel", "n-pass-subres", {"sampling": "subpixel"}),
    "panel, warped": (triangle, "panel", "dibr", {"references": 7}),
    **{f"packed {name}": (triangle, name, "single-pass", {}) for name in PACKED},
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_what_is_asked_for_is_what_is_taken(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, what, method, options = CASES[name]
    scene, asked = make(), []
    frame(scene, what, method, "cpu", **options)  # compiles
    monkeypatch.setattr(DOOR, "check_memory", lambda need, what: asked.append(need))
    tracemalloc.start()
    try:
        frame(scene, what, method, "cpu", **options)
        taken = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert taken - SMALL <= asked[0] <= 1.15 * taken + PICTURE // 2
    assert asked[0] >= 0.55 * taken  # of what is small, too


def test_parts_that_fit_one_by_one_are_refused_together(monkeypatch: pytest.MonkeyPatch) -> None:
    views = RIG.views * PICTURE
    monkeypatch.setattr("autostereo.memory.available_memory", lambda: int(1.5 * views))
    frame(triangle(), "views", "single-pass", "cpu")
    for options in ({"depth": True}, {"aperture": 0.1, "lens": (8, 1)}):
        with pytest.raises(aus.MemoryLimitError, match=r"12 views of 1280×960 pixels would take 0\.\d+ GB"):
            frame(triangle(), "views", "single-pass", "cpu", **options)
    with pytest.raises(aus.MemoryLimitError, match="12 views of 1280×960"):
        frame(triangle(), "views", "dibr", "cpu", references=8)


def test_what_is_held_already_is_not_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    for make, depths in ((triangle, 0), (mixed, RIG.views * PICTURE)):
        renderer, asked = Renderer(make(), "cpu"), list[int]()
        monkeypatch.setattr(DOOR, "check_memory", lambda need, what, asked=asked: asked.append(need))
        for _ in range(2):
            renderer.render_views(RIG, SIZE)
        renderer.render(TABLE, RIG, out=np.empty((SIZE[1], SIZE[0], 3), np.uint8))
        assert asked == [RIG.views * PICTURE + depths, 0, 0]


def test_software_opengl_asks_for_its_textures(monkeypatch: pytest.MonkeyPatch) -> None:
    """They lie in main memory: 8 bytes a pixel of all views, and a panel; of what a process grows, the most."""
    if need_device().is_hardware:
        pytest.skip("a GPU has memory of its own")
    asked: list[int] = []
    monkeypatch.setattr(DOOR, "check_memory", lambda need, what: asked.append(need))
    renderer = Renderer(mixed(), "gl")
    for _ in range(2):
        renderer.render_views(RIG, SIZE)
    for _ in range(2):
        renderer.render(TABLE, RIG, method="n-pass")
    views, panel = RIG.views * PICTURE, 3 * PICTURE // 4
    assert asked == [views + 2 * views, 0, panel + PICTURE, 0]


ANIMATE = """
import re, sys
import numpy as np
from autostereo.encoders.video import save_animation
from autostereo.frame import ViewStack

def peak():
    with open("/proc/self/status") as file:  # ru_maxrss begins with that of the process which started this one
        return 1024 * int(re.search(r"VmHWM:\\s*(\\d+)", file.read())[1])

path, views, width, height = sys.argv[1], *map(int, sys.argv[2:])
color = np.empty((views, height, width, 4), np.uint8)
x, y = np.arange(width, dtype=np.uint16), np.arange(height, dtype=np.uint16)[:, None]
for k, view in enumerate(color):
    view[..., 0], view[..., 1], view[..., 2] = x // 8 + 3 * k, x // 8 ^ y // 8, y // 8 + k
save_animation(path, ViewStack(color[:, :16, :16]))  # imports
before = peak()
save_animation(path, ViewStack(color))
print(peak() - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has /proc/self/status")
@pytest.mark.parametrize("suffix", [".gif", ".webp", ".mp4"])
def test_animations_ask_for_what_their_writers_take(suffix: str, tmp_path: Path) -> None:
    """Peak memory of a process of its own, as Pillow's and the encoders' is none of Python's."""
    if suffix == ".mp4":
        pytest.importorskip("av")
    views, width, height = 24, 1024, 512
    command = [sys.executable, "-c", ANIMATE, f"a{suffix}", *map(str, (views, width, height))]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    asked, taken = animation_memory(suffix, views, width, height), int(done.stdout)
    assert taken - SMALL <= asked
    assert asked <= 4 * taken + 2 * SMALL
    assert suffix == ".mp4" or taken < 4 * views * width * height  # that is the views; copies took more than they do


@pytest.mark.parametrize("suffix", [".gif", ".webp", ".mp4"])
def test_animations_without_room_are_refused(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autostereo.memory.available_memory", lambda: 10**6)
    views = aus.ViewStack(np.zeros((12, 200, 300, 4), np.uint8))
    with pytest.raises(aus.MemoryLimitError, match=r"animation of 12 views of 300×200 pixels would take 0\.\d+ GB"):
        save_animation(tmp_path / f"a{suffix}", views)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (0, "0 GB"), (1, "0.000000001 GB"), (59_000_000, "0.059 GB"), (201_326_592, "0.201 GB"), (10**9, "1 GB"),
        (9_996_000_000, "10 GB"), (12_340_000_000, "12.3 GB"), (100 * 10**9, "100 GB"), (4_398_046_511_104, "4398 GB"),
        (10**18, "1000000000 GB"),
    ],
)  # fmt: skip
def test_memory_is_said_without_exponents(count, text):
    assert gigabytes(count) == text
