"""The command line: one file per verb. `main` is the console script `autostereo`."""

from __future__ import annotations

import os
import signal
import sys


def _leave(*_: object) -> None:
    """End at once, as a later Ctrl-C does: while modules are imported there is nothing to clean up."""
    os.write(2, b"autostereo: interrupted\n")
    os._exit(130)


def main() -> None:
    """Run the command line on sys.argv and exit with its status."""
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # else Ctrl-C is to be ignored, as in nohup
    try:
        if usual:
            signal.signal(signal.SIGINT, _leave)
        from .app import run

        signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))  # so that temporary files are removed
        if usual:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        status = run(sys.argv[1:])
    except KeyboardInterrupt:  # just before or just after what catches it
        _leave()
    sys.exit(status)
