"""Fixtures for all tests."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from commandline import SQUARE, Result, Run
from gl_device import gl_error

# the same random cases in every run; HYPOTHESIS_PROFILE=random looks for others
settings.register_profile("same", derandomize=True)
settings.register_profile("random", derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))


@pytest.fixture(autouse=True)
def no_gl_errors() -> Iterator[None]:
    """No test leaves an OpenGL error behind."""
    yield
    assert gl_error() == "GL_NO_ERROR"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder with a square as square.off."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("AUTOSTEREO_DEBUG", raising=False)
    (tmp_path / "square.off").write_text(SQUARE)
    return tmp_path


@pytest.fixture
def cli(folder: Path, capsys: pytest.CaptureFixture[str]) -> Iterator[Run]:
    """Run a command line in this process."""

    from autostereo.cli.app import run

    def call(*arguments: str) -> Result:
        capsys.readouterr()
        handler = signal.getsignal(signal.SIGINT)
        try:
            status = run(arguments)
        finally:
            signal.signal(signal.SIGINT, handler)
        out, err = capsys.readouterr()
        return Result(status, out, err)

    yield call
