"""The command line and bad input: one clear line, exit codes, nothing half-written."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import autostereo as aus
from commandline import SMALL, SQUARE, Run, files, pixels, refused

# --- bad input -----------------------------------------------------------------------------------------------------
TEXTURED = b"usemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
BAD_FILES = {
    "missing.ply": None,
    "unknown.xyzzy": b"something",
    "empty.ply": b"",
    "page.ply": b"<!DOCTYPE html><html><body>404</body></html>",
    "truncated.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0",
    "binary.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\x00\x01\x02",
    "nan.off": SQUARE.replace("-1 -1 0", "nan -1 0").encode(),
    "infinite.off": SQUARE.replace("-1 -1 0", "inf -1 0").encode(),
    "range.off": SQUARE.replace("3 0 2 3", "3 0 2 7").encode(),
    "none.off": b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n",
    "garbage.glb": b"glTF\x02\x00\x00\x00\xff\xff\xff\xff",
    "text.stl": b"solid nothing\nendsolid nothing\n",
    "missing_texture.obj": b"mtllib m.mtl\n" + TEXTURED,
    "broken_texture.obj": b"mtllib n.mtl\n" + TEXTURED,
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_scene_file(cli: Run, folder: Path, name: str) -> None:
    content = BAD_FILES[name]
    if content is not None:
        Path(name).write_bytes(content)
    Path("m.mtl").write_text("newmtl a\nmap_Kd nowhere.png\n")
    Path("n.mtl").write_text("newmtl a\nmap_Kd broken.png\n")
    Path("broken.png").write_bytes(b"\x89PNG\r\n\x1a\nbut then nothing")
    before = files(folder)
    refused(cli("render", name, "-d", "lenticular-8", "-o", "out.png", *SMALL), name)
    assert files(folder) == before


@pytest.mark.parametrize(
    "text",
    [
        SQUARE.replace("1 1 0\n", "1 -1 0\n"),  # a triangle without area
        SQUARE.replace("4 2 0", "4 3 0") + "3 0 1 2\n",  # a face twice: an edge with more than two triangles
        "OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n",  # a single point
    ],
)
def test_degenerate_meshes_are_legal(cli: Run, folder: Path, text: str) -> None:
    Path("odd.off").write_text(text)
    result = cli("render", "odd.off", "-d", "lenticular-8", "-o", "out.png", *SMALL)
    assert result.status == 0, result.err


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--size", "0x10"), "--size"),
        (("--size", "10"), "--size"),
        (("--size", "-5x5"), "--size"),
        (("--size", "100000000x100000000"), "--size"),
        (("--views", "1000000000"), "--views"),
        (("--views", "0"), "--views"),
        (("--views", "7"), "views"),  # a table has 8
        (("--views", "many"), "--views"),
        (("--samples", "3"), "samples"),
        (("--shading", "none"), "shading"),
        (("--engine", "warp"), "warp"),
        (("--method", "magic"), "magic"),
        (("--background", "mauve"), "--background"),
        (("--background", "2,0,0"), "--background"),
        (("--continuous",), "continuous"),
        (("--camera", "nowhere.json"), "nowhere.json"),
        (("--nonsense",), "--nonsense"),
        (("-o", "out.xyz"), ".png"),
        (("-o", "nowhere/out.png"), "nowhere"),
        (("-o", "."), "folder"),
    ],
)
def test_bad_option(cli: Run, folder: Path, arguments: tuple[str, ...], word: str) -> None:
    refused(cli("render", "square.off", "-d", "wavelength-selective-8", "--size", "48x64", *arguments), word)
    assert files(folder) == {"square.off"}


def test_usage_errors(cli: Run) -> None:
    refused(cli("render"), "Missing")
    refused(cli("render", "square.off"), "--display")
    refused(cli("paint"), "paint")
    refused(cli("render", "", "-d", "lenticular-8"), "argument 2 is empty")
    refused(cli("render", "square.off", "-d", "lenticular-8", "-o", ""), "argument 6 is empty")
    refused(cli("render", "square.off", "-d", "looking-glass-portrai", *SMALL), "looking-glass-portrait")


def test_output_is_checked_before_the_input_is_read(cli: Run, folder: Path) -> None:
    refused(cli("render", "missing.ply", "-d", "lenticular-8", "-o", "nowhere/out.png"), "nowhere/out.png")
    refused(cli("views", "missing.ply", "-o", "nowhere/out"), "nowhere/out")
    refused(cli("quilt", "missing.ply", "-d", "looking-glass-go", "-o", "nowhere/out.png"), "nowhere/out")
    refused(cli("demo", "-o", "nowhere/demo"), "nowhere/demo")


def test_quilts_and_animations_have_limits(cli: Run, folder: Path) -> None:
    refused(cli("quilt", "square.off", "--grid", "8x6", "--view-size", "9000x9000"), "16384", "72000×54000")
    refused(cli("quilt", "square.off", "--grid", "80x6", "--view-size", "10x10"), "--grid")
    refused(cli("views", "square.off", "-o", "out.webp", "--size", "20000x10"), "16383", "20000×10")


def test_mp4_without_pyav(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    refused(cli("views", "square.off", "-o", "out.mp4"), "pip install autostereo[video]")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_folder_that_is_not_writable(cli: Run, folder: Path) -> None:
    (folder / "locked").mkdir(mode=0o500)
    refused(cli("render", "square.off", "-d", "lenticular-8", "-o", "locked/out.png"), "not writable")


def test_folder_that_refuses_files(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same for root, who can be refused by a read-only file system only."""

    def refuse(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    refused(cli("render", "square.off", "-d", "lenticular-8", "-o", "out.png"), "not writable", "Permission denied")


def test_output_folder_is_a_file(cli: Run, folder: Path) -> None:
    Path("taken").write_text("a file")
    refused(cli("views", "square.off", "-o", "taken", "--size", "16x16"), "taken")
    assert Path("taken").read_text() == "a file"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{not json",
        '{"position": [0, 0]}',
        '{"fov_y": "wide"}',
        '{"views": 2.5}',
        '{"offsets": [1, 0]}',
        '{"colour": 1}',
        '{"up": [0, 0, 1], "position": [0, 0, 4], "target": [0, 0, 0]}',
        "[" * 50_000,
        f'{{"fov_y": {"9" * 400}}}',
        f'{{"fov_y": {"9" * 5000}}}',
        f'{{"up": [0, {"9" * 400}, 0]}}',
        f'{{"offsets": [0, {"9" * 400}]}}',
    ],
)
def test_bad_camera_file(cli: Run, folder: Path, text: str) -> None:
    Path("rig.json").write_text(text)
    refused(cli("render", "square.off", "-d", "lenticular-8", "--camera", "rig.json"), "rig.json")


def test_scene_behind_the_camera(cli: Run, folder: Path) -> None:
    aus.Rig(position=(0, 0, -4), target=(0, 0, -8)).save("rig.json")
    refused(cli("render", "square.off", "-d", "lenticular-8", "--camera", "rig.json", *SMALL), "behind")


CALIBRATION = {
    key: {"value": value}
    for key, value in {
        "pitch": 52.0, "slope": -7.0, "center": 0.4, "viewCone": 40.0, "invView": 1, "DPI": 324.0, "screenW": 64,
        "screenH": 48, "flipImageX": 0, "flipImageY": 0, "flipSubp": 0,
    }.items()
}  # fmt: skip


def test_calibration_file(cli: Run, folder: Path) -> None:
    Path("visual.json").write_text(json.dumps(CALIBRATION))
    assert cli("render", "square.off", "-d", "visual.json").status == 0
    assert pixels("square_visual.png").shape == (48, 64, 3)


@pytest.mark.parametrize("field", ["pitch", "slope", "center", "DPI", "screenW", "screenH"])
@pytest.mark.parametrize("damage", ["missing", "text", "zero", "nested"])
def test_bad_calibration(cli: Run, folder: Path, field: str, damage: str) -> None:
    if damage == "zero" and field == "center":
        pytest.skip("center may be 0")
    broken = dict(CALIBRATION)
    if damage == "missing":
        del broken[field]
    else:
        broken[field] = {"value": {"text": "wide", "zero": 0, "nested": [1]}[damage]}
    Path("visual.json").write_text(json.dumps(broken))
    refused(cli("render", "square.off", "-d", "visual.json", "-o", "out.png"), "visual.json", field)


BAD_KIND = 'source = "x"\nwidth = 8\nheight = 8\n[mask]\nkind = "fog"'


@pytest.mark.parametrize("text", ["", "width = ", "width = 5", BAD_KIND])
def test_bad_display_file(cli: Run, folder: Path, text: str) -> None:
    Path("mine.toml").write_text(text)
    refused(cli("render", "square.off", "-d", "mine.toml"), "mine.toml")


def test_bad_pictures(cli: Run, folder: Path) -> None:
    Path("noise_qs4x3a1.png").write_bytes(b"no picture")
    for name in ("noise_qs4x3a1.png", "gone_qs4x3a1.png"):
        refused(cli("weave", name, "-d", "looking-glass-portrait", "-o", "out.png"), name)
        refused(cli("observe", name, "-d", "looking-glass-portrait", "--view", "1", "-o", "out.png"), name)
    assert not Path("out.png").exists()


def test_a_quilt_that_is_not_there_is_named_as_such(cli: Run, folder: Path) -> None:
    for name in ("missing.png", "missing_qs4x2a1.png"):
        for more in ((), ("--grid", "4x2")):
            result = cli("weave", name, *more, "-d", "lenticular-8", "-o", "out.png")
            refused(result, f"autostereo: error: {name}: no such file\n")


def test_absurd_sizes_say_what_memory_they_would_take(
    cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused(cli("views", "square.off", "-o", "out", "--views", "4096", "--size", "32768x32768"), "17592 GB")
    takes = "--size: expected numbers from 1 to 32768, got {}; such a picture would take {} GB of memory\n"
    for size, room in (("100000x100000", "30"), ("32769x1", "0.0000983")):
        result = cli("render", "square.off", "-d", "lenticular-8", "--size", size)
        refused(result, takes.format(size, room))
    for size in ("0x100000", f"{10**31}x1"):
        result = cli("pattern", "-d", "lenticular-8", "--size", size, "-o", "a.png")
        refused(result, f"--size: expected numbers from 1 to 32768, got {size}\n")
    monkeypatch.setattr("autostereo.memory.available_memory", lambda: 10**8)
    refused(cli("render", "square.off", "-d", "looking-glass-portrait", "--size", "8192x8192"), "0.201 GB", "0.1 GB")
    assert files(folder) == {"square.off"}
