"""Volumes on the command line."""

import importlib
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo.cli import common
from autostereo.cli.common import VolumeOptions
from commandline import Run
from volume_files import phantom

RAW = ("--shape", "9x7x5", "--dtype", "uint8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: a.raw, the phantom; frames.npy, two; triangle.off."""
    monkeypatch.chdir(tmp_path)
    Path("a.raw").write_bytes(phantom("uint8").tobytes())
    np.save("frames.npy", np.stack([phantom(), phantom() * 2]))
    Path("triangle.off").write_text("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    return tmp_path


def seen(path: str = "a.raw", **options: object) -> aus.Volume:
    if path == "a.raw":
        options = {"shape": "9x7x5", "dtype": "uint8", **options}
    scene = common.load_scene([Path(path)], None, VolumeOptions(**options))  # type: ignore[arg-type]
    return scene.objects[0]  # type: ignore[return-value]


def test_options_reach_the_volume(folder: Path) -> None:
    assert seen().mode == "composite"
    assert seen(shape="9×7×5").shape == (9, 7, 5)
    assert seen(mode="mip").mode == "mip"
    volume = seen(iso=40.0)
    assert (volume.mode, volume.iso) == ("iso", 40.0)
    assert seen(mode="iso").iso == seen().otsu()
    assert seen(spacing="1,2,3").spacing == (1, 2, 3)
    assert seen("frames.npy", frame=1).value_range == (0, 200)


def test_transfer_by_name_or_file(folder: Path) -> None:
    volume = seen()
    for name in ("ct-bone", "viridis"):
        assert np.array_equal(seen(transfer=name).transfer.points, aus.TransferFunction.fitted(name, volume).points)
    mine = aus.TransferFunction([(0, 0, 0, 1, 0), (9, 1, 0, 0, 3)])
    mine.save("mine.json")
    assert np.array_equal(seen(transfer="mine.json").transfer.points, mine.points)


def test_info_shows_values_and_transfer_function(cli: Run, folder: Path) -> None:
    result = cli("info", "a.raw", *RAW, "--spacing", "1,2,3")
    assert result.status == 0
    assert "9×7×5 voxels of uint8, shown by composite" in result.out
    assert "spacing 1 × 2 × 3, first voxel at (0, 0, 0)" in result.out
    assert "315 voxels" in result.out and "values 0…100" in result.out
    bars = [line for line in result.out.splitlines() if "█" in line or line.endswith("0.00 %")]
    assert len(bars) == 16
    assert bars[0].split()[-2:] == ["99.37", "%"] and bars[0].count("█") == 40  # 313 of 315
    assert "transfer function" in result.out
    assert cli("info", "a.raw", *RAW, "--iso", "40").out.count("shown by iso at 40") == 1


def test_info_of_a_mixed_scene(cli: Run, folder: Path) -> None:
    Path("points.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n0 0 1\n")
    result = cli("info", "a.raw", "triangle.off", "points.xyz", *RAW)
    (total,) = (line for line in result.out.splitlines() if line.startswith("total"))
    assert set(total[12:].strip().split(", ")) == {"1 triangles", "3 vertices", "4 points", "315 voxels"}
    assert "4 points with normals, radii" in result.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("a.raw",), "give --shape, such as 64x64x32 and --dtype"),
        (("a.raw", "--shape", "9x7", "--dtype", "uint8"), "--shape: expected three whole numbers"),
        (("a.raw", "--shape", "9x7x-5", "--dtype", "uint8"), "--shape: expected three whole numbers"),
        (("a.raw", "--shape", "9x7x5", "--dtype", "float16"), "dtype: expected one of"),
        (("a.raw", "--shape", "9x7x6", "--dtype", "uint8"), "takes 378 bytes, the file has 315"),
        (("a.raw", *RAW, "--spacing", "1,2"), "--spacing: expected 3 finite numbers"),
        (("a.raw", *RAW, "--spacing", "1,2,0"), "spacing: expected numbers > 0"),
        (("a.raw", *RAW, "--mode", "xray"), "mode: expected one of composite, mip, iso"),
        (("a.raw", *RAW, "--mode", "mip", "--iso", "3"), "--iso: needs --mode iso"),
        (("a.raw", *RAW, "--iso", "nan"), "--iso: expected a value within the volume's, 0…100, got nan"),
        (("a.raw", *RAW, "--iso", "1e9"), "--iso: expected a value within the volume's, 0…100, got 1e+09"),
        (("a.raw", *RAW, "--transfer", "nope"), "expected a .json file, a preset (generic"),
        (("a.raw", *RAW, "--transfer", "nope.json"), "nope.json: no such file"),
        (("a.raw", *RAW, "--frame", "1"), "has no frame 1"),
        (("frames.npy",), "holds 2 frames; choose one, --frame 0 … 1"),
        (("frames.npy", "--frame", "-1"), "frame: expected a whole number from 0"),
        (("triangle.off", "--mode", "mip"), "none of the inputs is a volume"),
        (("triangle.off", "--shape", "9x7x5"), "only .raw files need it"),
        (("triangle.off", "--frame", "0"), "only files of volumes"),
        ((".",), "is a folder without a DICOM series"),
    ],
)
def test_mistakes_are_one_line(cli: Run, folder: Path, arguments: tuple[str, ...], words: str) -> None:
    result = cli("info", *arguments)
    assert result.status == 2
    assert words in result.err and result.err.count("\n") == 1


@pytest.mark.parametrize("verb", ["render", "quilt", "views", "info"])
def test_every_verb_that_loads_scenes_takes_volumes(cli: Run, verb: str) -> None:
    text = cli(verb, "--help").out
    for option in ("--shape", "--dtype", "--frame", "--spacing", "--transfer", "--mode", "--iso"):
        assert option in text


@pytest.mark.parametrize(
    ("path", "name"),
    [("a/head.nii.gz", "head"), ("head.v2.nrrd", "head.v2"), ("bunny.ply", "bunny"), ("x_9x7x5.raw", "x_9x7x5")],
)
def test_outputs_are_called_after_inputs(path: str, name: str) -> None:
    assert common.stem(Path(path)) == name


def test_outputs_are_called_after_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scan = tmp_path / "scan.1"
    scan.mkdir()
    assert common.stem(scan) == "scan.1"
    monkeypatch.chdir(scan)
    assert common.stem(Path(".")) == "scan.1"


@pytest.mark.parametrize("verb", ["render", "quilt", "views"])
def test_every_verb_that_renders_takes_options_of_rays(cli: Run, verb: str) -> None:
    text = cli(verb, "--help").out
    for option in ("--step", "--volume", "--from", *(["--alpha"] if verb == "render" else [])):
        assert option in text


def test_options_of_rays_reach_the_engine(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    door = importlib.import_module("autostereo.render")

    given = []
    for name in ("render", "render_views"):
        monkeypatch.setattr(door, name, lambda *_, options, **__: given.append(options) or 1 / 0)
    rays = ("--step", "2.5", "--volume", "exact", "--engine", "reference")
    cli("render", "a.raw", *RAW, "-d", "alioscopy-8", *rays, "--alpha", "averaged")
    cli("views", "a.raw", *RAW, "-o", "v", *rays)
    cli("quilt", "a.raw", *RAW, "--grid", "2x1", "--view-size", "8x8", *rays)
    assert [(o.step, o.volume, o.alpha) for o in given] == [(2.5, "exact", a) for a in ("averaged", "exact", "exact")]


def test_views_from_a_side(cli: Run, folder: Path) -> None:
    for side in ("front", "left"):
        arguments = ("-o", side, "--views", "2", "--size", "8x8", "--from", side, "--engine", "reference")
        assert cli("views", "a.raw", *RAW, *arguments).status == 0
    front, left = (aus.Rig.load(Path(side) / "rig.json") for side in ("front", "left"))
    assert front.position[2] > 4 and left.position[0] < 0 and left.up == (0, 1, 0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--step", "0"), "step: expected a number > 0"),
        (("--step", "1e-9"), "slabs"),
        (("--volume", "fast"), "volume: expected one of 'shared', 'exact', got 'fast'"),
        (("--from", "behind"), "--from: expected one of front, back, left, right, top, bottom, got 'behind'"),
        (("--from", "left", "--camera", "rig.json"), "--from: has no meaning with --camera"),
    ],
)
def test_mistakes_in_options_of_rays_are_one_line(
    cli: Run, folder: Path, arguments: tuple[str, ...], words: str
) -> None:
    aus.Rig().save("rig.json")
    result = cli("views", "a.raw", *RAW, "-o", "v", "--size", "8x8", "--engine", "reference", *arguments)
    assert result.status == 2 and words in result.err and result.err.count("\n") == 1


def test_render_and_views_of_a_volume(cli: Run, folder: Path) -> None:
    render = cli("render", "a.raw", *RAW, "-d", "alioscopy-8", "--size", "48x30", "--engine", "reference")
    assert render.status == 0 and Path("a_alioscopy-8.png").exists(), render.err
    views = cli("views", "a.raw", *RAW, "-o", "v.npz", "--views", "2", "--size", "24x20", "--engine", "reference")
    assert views.status == 0, views.err
    assert np.load("v.npz")["color"][..., 3].any()
