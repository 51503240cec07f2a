"""The command line: one file per verb. `main` is the console script `autostereo`."""

from __future__ import annotations

import signal
import sys


def main() -> None:
    """Run the command line on sys.argv and exit with its status."""
    from .app import run

    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))  # so that temporary files are removed
    sys.exit(run(sys.argv[1:]))
