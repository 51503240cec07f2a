"""The command line: one file per verb. `main` is the console script `autostereo`."""

from __future__ import annotations

import os
import signal
import sys


def _leave(number: int, *_: object) -> None:
    """End at once, whatever runs: Python drops exceptions within callbacks, and libraries' locks would stay locked."""
    temporary = sys.modules.get("autostereo.temporary")
    try:
        if temporary is not None:
            temporary.remove_all()
        if number == signal.SIGINT:
            cursor = b"\r\x1b[K\x1b[?25h" if os.isatty(2) else b""  # shown again, on an empty line
            os.write(2, cursor + b"autostereo: interrupted\n")
    finally:
        os._exit(128 + number)


def main() -> None:
    """Run the command line on sys.argv and exit with its status."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else Ctrl-C is to be ignored, as in nohup
        signal.signal(signal.SIGINT, _leave)
    signal.signal(signal.SIGTERM, _leave)
    _speak_any_text()
    from .app import run

    status = run(sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done: Ctrl-C would only spoil the exit
    sys.exit(status)


def _speak_any_text() -> None:
    """Let what a terminal or a file cannot show become "?", and what is printed to a closed stream go nowhere."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the shell: >&-
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
