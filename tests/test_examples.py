"""Every example runs in an empty folder and writes the files that its docstring promises, no others."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))


def promised(example: Path) -> set[str]:
    """File names in the docstring's line "Writes: …"."""
    text = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8"))) or ""
    line = next(line for line in text.splitlines() if line.startswith("Writes: "))
    return set(line.removeprefix("Writes: ").split(", "))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 4


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example_has_at_most_40_lines(example: Path) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) <= 40


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(example)], cwd=tmp_path, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    assert {path.name for path in tmp_path.iterdir()} == promised(example)
