"""The verb warp, and --references of the others."""

from __future__ import annotations

from math import atan, degrees, radians, tan
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import autostereo as aus
from autostereo.display.framing import frame_depths
from autostereo.engines.cpu.gather import weave
from commandline import SMALL, Run, files, pixels, refused

H, W = 48, 64
COLOR = np.random.default_rng(1).integers(0, 256, (H, W, 3)).astype(np.uint8)
DEPTH = np.full((H, W), 3.0, np.float32)
DEPTH[10:30, 20:40] = 2.0
DEPTH[:, :5] = np.inf


@pytest.fixture
def rgbd(folder: Path) -> Path:
    """The folder with c.png and d.npy, and d.png in thousandths."""
    Image.fromarray(COLOR).save("c.png")
    np.save("d.npy", DEPTH)
    Image.fromarray(np.where(np.isfinite(DEPTH), 1000 * DEPTH, 0).astype(np.uint16)).save("d.png")
    return folder


def picture(color: np.ndarray = COLOR, depth: np.ndarray = DEPTH) -> aus.ViewStack:
    opaque = np.full((*color.shape[:2], 1), 255, np.uint8)
    return aus.ViewStack(np.concatenate([color, opaque], axis=2)[None], depth[None])


def test_views_are_the_library_s(cli: Run, rgbd: Path) -> None:
    result = cli("warp", "c.png", "d.npy", "-o", "out", "--views", "5", "--fov", "40")
    assert (result.status, result.out) == (0, "out  5 views of 64×48\n")
    rig = aus.Rig.load("out/rig.json")
    assert rig == frame_depths(DEPTH, aus.Display.lenticular(W, H, 5), 40)
    expected = aus.warp(picture(), rig)
    assert (expected.color[0] != expected.color[4]).any()
    for k in range(5):
        assert np.array_equal(pixels(f"out/view_{k:03d}.png"), expected.color[k])


def test_a_picture_of_thousandths_is_the_array(cli: Run, rgbd: Path) -> None:
    assert cli("warp", "c.png", "d.npy", "-o", "a.npz").status == 0
    assert cli("warp", "c.png", "d.png", "--unit", "0.001", "-o", "b.npz").status == 0
    with np.load("a.npz") as a, np.load("b.npz") as b:
        assert np.array_equal(a["color"], b["color"]) and np.allclose(a["depth"], b["depth"], rtol=1e-6)


def test_a_camera_has_the_field_of_view_the_focal_plane_and_the_baseline(cli: Run, rgbd: Path) -> None:
    rig = aus.Rig(position=(5, 5, 5), fov_y=25.0, focal_distance=2.5, baseline=0.7, views=3)
    rig.save("rig.json")
    assert cli("warp", "c.png", "d.npy", "-o", "out.npz", "--camera", "rig.json").status == 0
    with np.load("out.npz") as found:
        assert found["color"].shape == (8, H, W, 4)  # as many as a panel has by default
        assert np.array_equal(found["color"], aus.warp(picture(), rig.with_views(8)).color)


@pytest.mark.parametrize("wide", [True, False])
def test_a_panel_shows_the_middle_of_the_picture(cli: Run, rgbd: Path, wide: bool) -> None:
    """Interlaced from views of its own size, of a picture cut to the panel's shape."""
    size = (90, 30) if wide else (30, 60)
    shape = ("-d", "lenticular-8", "--size", f"{size[0]}x{size[1]}")
    result = cli("warp", "c.png", "d.npy", *shape, "-o", "out.png", "--fov", "40")
    assert result.status == 0, result.err
    assert f"only the middle of the picture has the panel's shape: {'64×21' if wide else '24×48'}" in result.err
    rows, columns = (slice(13, 34), slice(None)) if wide else (slice(None), slice(20, 44))
    part = picture(COLOR[rows, columns], DEPTH[rows, columns])
    field = degrees(2 * atan((21 / 48 if wide else 1) * tan(radians(40) / 2)))
    display = aus.Display.preset("lenticular-8").resized(*size)
    assert part.depth is not None and display.viewmap is not None
    rig = frame_depths(part.depth[0], display, field)
    stack = aus.warp(part, aus.Rig(**{**vars_of(rig), "aspect": part.width / part.height}))
    expected = weave(stack.quilt(8, 1), (8, 1), display.viewmap, size, "linear")
    assert np.array_equal(pixels("out.png"), expected)


def vars_of(rig: aus.Rig) -> dict[str, object]:
    return {name: getattr(rig, name) for name in rig.__dataclass_fields__}


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_an_animation(cli: Run, rgbd: Path, suffix: str) -> None:
    assert cli("warp", "c.png", "d.npy", "-o", f"out{suffix}", "--views", "4").status == 0
    with Image.open(f"out{suffix}") as image:
        assert getattr(image, "n_frames", 1) == 6


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("d.npy", "-o", "out.png"), ("--display", ".npz")),
        (("d.npy", "-o", "out.npz", "--size", "9x9"), ("--size",)),
        (("d.npy", "-o", "out.npz", "--unit", "0"), ("--unit",)),
        (("d.npy", "-o", "out.npz", "--fov", "180"), ("--fov",)),
        (("d.npy", "-o", "out.npz", "--fov", "30", "--camera", "rig.json"), ("--fov", "--camera")),
        (("d.npy", "-o", "out.npz", "--views", "0"), ("--views",)),
        (("d.npy", "-o", "out.png", "-d", "side-by-side"), ("side-by-side",)),
        (("d.npy", "-o", "nowhere/out.png", "-d", "lenticular-8"), ("nowhere",)),
        (("c.png", "-o", "out.npz"), ("c.png", "16 bits", "RGB")),
        (("gone.npy", "-o", "out.npz"), ("gone.npy",)),
        (("small.npy", "-o", "out.npz"), ("small.npy", "64×48", "4×3")),
        (("minus.npy", "-o", "out.npz"), ("minus.npy", "-1")),
        (("none.npy", "-o", "out.npz"), ("finite",)),
    ],
)
def test_what_cannot_be_warped(cli: Run, rgbd: Path, arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    np.save("small.npy", np.ones((3, 4)))
    np.save("minus.npy", -np.ones((H, W)))
    np.save("none.npy", np.zeros((H, W)))
    before = files(rgbd)
    refused(cli("warp", "c.png", *arguments), *words)
    assert files(rgbd) == before


# --- the method, at the command line ---------------------------------------------------------------------------------
def test_references_reach_the_method(cli: Run, folder: Path) -> None:
    """All verbs that render: the library's picture, which depends on how many are drawn."""
    Path("deep.off").write_text("OFF\n4 2 0\n-1 -1 0\n1 -1 -2\n1 1 0\n-1 1 1\n3 0 1 2\n3 0 2 3\n")
    scene, display = aus.load("deep.off"), aus.Display.preset("looking-glass-portrait").resized(48, 64)
    found = {}
    for count in (1, 3):
        dibr = ("--method", "dibr", "--references", str(count))
        assert cli("render", "deep.off", "-d", "looking-glass-portrait", *SMALL, *dibr, "-o", "p.png").status == 0
        options = aus.Options(references=count)
        found[count] = aus.render(scene, display, method="dibr", options=options).pixels
        assert np.array_equal(pixels("p.png"), found[count])
        assert cli("views", "deep.off", "-o", "v.npz", "--size", "24x16", *dibr).status == 0
        rig = aus.Rig.frame(scene, aus.Display.lenticular(24, 16, 8))
        stack = aus.render_views(scene, rig, (24, 16), method="dibr", options=options)
        with np.load("v.npz") as saved:
            assert np.array_equal(saved["color"], stack.color)
        layout = ("--grid", "4x2", "--view-size", "24x16", "--aspect", "1.5")
        assert cli("quilt", "deep.off", *layout, *dibr, "-o", "q.png").status == 0
        assert np.array_equal(pixels("q_qs4x2a1.5.png"), stack.quilt(4, 2)[..., :3])
    assert (found[1] != found[3]).any()


@pytest.mark.parametrize("verb", [("render", "-d", "lenticular-8", "-o", "o.png"), ("views", "-o", "o.npz")])
@pytest.mark.parametrize("option", ["--references", "--views-per-pass"])
def test_counts_are_checked(cli: Run, folder: Path, verb: tuple[str, ...], option: str) -> None:
    refused(cli(verb[0], "square.off", *verb[1:], option, "0"), option.strip("-").replace("-", "_"), "≥ 1", "got 0")
    assert files(folder) == {"square.off"}


def test_groups_are_checked(cli: Run, folder: Path) -> None:
    refused(cli("render", "square.off", "-d", "lenticular-8", "--groups", "0"), "groups", "≥ 1", "got 0")
