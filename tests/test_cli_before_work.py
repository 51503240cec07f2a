"""The command line: arguments that are wrong are refused before the long work, not after it."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from autostereo.cli.benchmarks import report
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.errors import InputError
from commandline import Run, files, refused


@pytest.fixture
def no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Benchmarks that ask the machine anything, or measure, fail."""

    def work(*_: object, **__: object) -> None:
        raise AssertionError("there was work")

    for suite in report.SUITES.values():
        monkeypatch.setattr(suite, "facts", work)
        monkeypatch.setattr(suite, "run", work)


@pytest.mark.usefixtures("no_work")
def test_bench_looks_at_its_arguments_first(cli: Run, folder: Path) -> None:
    for more in ((), ("weave",)):
        refused(cli("bench", "mesh", *more, "--data", "nope"), "nope: expected a folder with meshes/bun_zipper.ply")
    for name in ("papers", "volume", "points"):
        refused(cli("bench", name, "--data", "nope"), "nope: expected a folder")
        refused(cli("bench", name, "--data", "."), ".: expected a folder with meshes/ or volumes/, found none")
    for wrong in (".", "square.off"):
        refused(cli("bench", "mesh", "--quick", "--data", wrong), f"{wrong}: expected a folder with meshes/bun_zip")
    refused(cli("bench", "mesh", "nothing"), "there is no work 'nothing'")


def test_bench_says_which_data_it_does_not_use(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def enough(options: BenchOptions) -> None:
        raise InputError("enough")

    (tmp_path / "volumes").mkdir()
    monkeypatch.setattr(report.papers, "facts", enough)
    lines = cli("bench", "papers", "--quick", "--data", str(tmp_path)).err.splitlines()
    said = f"--data {tmp_path} is not used with --quick: small stand-ins are drawn"
    assert lines == [said, "autostereo: error: enough"]
    for name, quick, word in (("papers", True, "--quick"), ("volume", False, "bench volume"), ("points", True, "own")):
        said = report.unread(name, BenchOptions(data=tmp_path, quick=quick))
        assert said.startswith(f"--data {tmp_path} is not used") and word in said and "\n" not in said
    assert "work start" in report.unread("mesh", BenchOptions(data=tmp_path, quick=True))
    for name, options in (("papers", BenchOptions(data=tmp_path)), ("papers", BenchOptions(quick=True))):
        assert report.unread(name, options) == ""


@pytest.mark.usefixtures("no_work")
def test_bench_plots_go_into_a_folder(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused(cli("bench", "papers", "--plot", "square.off"), "square.off: expected a folder, found a file")
    refused(cli("bench", "papers", "--plot", "square.off/a/b"), "expected a folder, square.off is a file")
    monkeypatch.setattr("autostereo.cli.benchmarks.papers_plots.find_spec", lambda name: None)
    refused(cli("bench", "papers", "--plot", "charts/new"), "pip install autostereo[bench]")
    assert not Path("charts").exists()


def test_simulated_numbers_of_views_and_machines_come_once(cli: Run, folder: Path) -> None:
    refused(cli("simulate", "level", "-n", "1,4,1"), "--views: expected each number once, got '1,4,1'")
    same = ("-m", "scanline", "-m", "scanline")
    refused(cli("simulate", "level", *same), "--machine: expected machines of different names, got scanline, scanline")


@pytest.mark.parametrize(
    ("arguments", "size"),
    [
        ("render square.off -d lenticular-8 --size 16384x4 -o q.webp", "16384×4"),
        ("render square.off -d lenticular-8 --size 4x16384 -o q.webp", "4×16384"),
        ("weave a.png --grid 4x2 -d lenticular-8 --size 20000x20 -o q.webp", "20000×20"),
        ("pattern -d lenticular-8 --size 20000x20 -o q.webp", "20000×20"),
        ("quilt square.off --grid 2x1 --view-size 8192x20 -o q.webp", "16384×20"),
        ("warp a.png a.npy -d lenticular-8 --size 20000x20 -o q.webp", "20000×20"),
        ("observe wide.png -d lenticular-8 --view 0 -o q.webp", "16384×2"),
    ],
)
def test_pictures_that_webp_cannot_hold(
    arguments: str, size: str, cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("there was work")

    for module, name in (
        ("render", "render"), ("render", "render_views"), ("render", "warp"), ("render", "observe"),
        ("engines.cpu.gather", "weave"), ("cli.pattern", "spread"),
    ):  # fmt: skip
        monkeypatch.setattr(importlib.import_module(f"autostereo.{module}"), name, work)
    Image.new("RGB", (40, 20)).save("a.png")
    Image.new("RGB", (16384, 2)).save("wide.png")
    np.save("a.npy", np.ones((20, 40), np.float32))
    before = files(folder)
    refused(cli(*arguments.split()), f".webp takes at most 16383 pixels a side, got {size}")
    assert files(folder) == before


def test_animations_have_room_beside_their_views(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("there was work")

    Image.fromarray(np.zeros((800, 1000, 3), np.uint8)).save("a.png")
    np.save("a.npy", np.ones((800, 1000), np.float32))
    before = files(folder)
    for verb in ("render_views", "warp"):
        monkeypatch.setattr(importlib.import_module("autostereo.render"), verb, work)
    monkeypatch.setattr("autostereo.memory.available_memory", lambda: 4 * 10 * 800_000 + 10_000_000)  # the views have
    for suffix in ("gif", "webp", "mp4"):
        message = f"a.{suffix}: an animation of 10 views of 1000×800 pixels would take 0."
        views = ("-n", "10", "-o", f"a.{suffix}")
        refused(cli("views", "square.off", *views, "--size", "1000x800"), message)
        refused(cli("warp", "a.png", "a.npy", *views), message)
    assert files(folder) == before


def test_numbers_that_python_does_not_read_are_none(cli: Run, folder: Path) -> None:
    size = "1" * 5000 + "x9"
    refused(cli("render", "square.off", "-d", "lenticular-8", "--size", size), "--size: expected two whole")
    refused(cli("info", "square.off", "--shape", size + "x9"), "--shape: expected three whole")
    refused(cli("simulate", "level", "-n", "1" * 5000), "--views: expected numbers from 1 to 256")
