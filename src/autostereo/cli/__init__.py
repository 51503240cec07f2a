"""The command line: one file per verb. `main` is the console script `autostereo`."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line on sys.argv and exit with its status."""
    from .app import run

    sys.exit(run(sys.argv[1:]))
