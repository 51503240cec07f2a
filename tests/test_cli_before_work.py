"""The command line: arguments that are wrong are refused before the long work, not after it."""

from __future__ import annotations

from pathlib import Path

import pytest

from autostereo.cli.benchmarks import report
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.errors import InputError
from commandline import Run, refused


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
