"""The command line: displays of one's own, what is printed of them and what `pattern` says to write into them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from commandline import Run

SHEET = """title = "My 27-inch sheet"
source = "measured, 2026-01"
width = 384
height = 216
views = 28

[mask]
kind = "slanted"
lens_pitch = 0.4266
subpixel_pitch = 0.0518
slant_deg = 12.0
phase = 0.25
"""


@pytest.fixture
def sheet(folder: Path) -> str:
    Path("my.toml").write_text(SHEET)
    return "my.toml"


@pytest.mark.parametrize("kind", ["pitch", "slope", "phase"])
def test_printed_numbers_written_into_the_file_make_the_lens_that_was_shown(cli: Run, sheet: str, kind: str) -> None:
    """All of a line, or what differs from the file alone."""
    from autostereo.cli.pattern import make_sweep

    rows, columns = np.arange(0, 216, 31), np.arange(0, 384, 17)
    shown = make_sweep(aus.Display.preset(sheet), kind, 5, 0.01)
    printed = cli("pattern", "-d", sheet, "--kind", kind, "--strips", "5", "--step", "0.01", "-o", "p.png").out
    for strip, line in zip(shown, printed.splitlines(), strict=False):
        numbers = dict(re.findall(r"(lens_pitch|subpixel_pitch|slant_deg|phase) (\S+?)(?:,|$)", line))
        assert len(numbers) == 4 and numbers["subpixel_pitch"] == "0.0518", line
        for names in (set(numbers), set(numbers) - {"subpixel_pitch"}):
            text = SHEET
            for name in names:
                text = re.sub(rf"(?m)^{name} = .*$", f"{name} = {numbers[name]}", text)
            Path("again.toml").write_text(text)
            again = aus.Display.preset("again.toml").viewmap
            apart = np.abs(again.phase(rows, columns) - strip.viewmap.phase(rows, columns))
            assert np.minimum(apart, 1 - apart).max() < 1e-3  # six printed digits


def test_displays_has_the_title_and_both_widths_of_the_lens(cli: Run, sheet: str) -> None:
    said = cli("displays", sheet).out
    assert re.search(r"(?m)^title +My 27-inch sheet$", said)
    assert "lens of 8.41951 sub-pixels along the row (8.23552 across the lens)" in said
    assert re.search(r"(?m)^title +Alioscopy, 8 views$", cli("displays", "alioscopy-8").out)
    Path("plain.toml").write_text(SHEET.replace("title", "note"))
    assert "title" not in cli("displays", "plain.toml").out
