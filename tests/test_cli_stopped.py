"""The command line when something stops it: interruptions, closed streams, surprises."""

from __future__ import annotations

import importlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import autostereo as aus
from commandline import SMALL, Run, files, refused


# --- interruptions and surprises -------------------------------------------------------------------------------------
def test_memory_error_is_one_line(cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def exhausted(*_: object, **__: object) -> None:
        raise MemoryError("Unable to allocate 9 TiB")

    monkeypatch.setattr("autostereo.cli.common.load_scene", exhausted)
    refused(cli("render", "square.off", "-d", "lenticular-8"), "memory", "9 TiB")


def test_unexpected_errors_are_one_line_and_a_traceback_only_on_demand(
    cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr("autostereo.cli.common.load_scene", broken)
    result = cli("render", "square.off", "-d", "lenticular-8")
    assert result.status == 1
    assert re.fullmatch(r"autostereo: error: internal error: ZeroDivisionError: oops [^\n]+\n", result.err)
    monkeypatch.setenv("AUTOSTEREO_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        cli("render", "square.off", "-d", "lenticular-8")


STRIKE = """
import os, signal, sys
signal.signal(signal.SIGINT, {handler})
class Strike:
    def find_spec(self, name, *rest):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Strike())
sys.argv = ["autostereo", "--version"]
from autostereo.cli import main
main()
"""


@pytest.mark.parametrize("module", ["autostereo.cli.app", "typer", "autostereo.cli.weave"])
def test_interrupt_while_modules_are_imported(module: str) -> None:
    code = STRIKE.format(module=module, handler="signal.default_int_handler")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "autostereo: interrupted\n")


def test_an_interrupt_that_is_to_be_ignored_is() -> None:
    """As for what a shell starts in the background."""
    code = STRIKE.format(module="typer", handler="signal.SIG_IGN")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"autostereo {aus.__version__}\n", "")


def test_interrupt_while_writing_leaves_nothing(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C after some of the files are written."""
    from autostereo import image

    write = image.write_image

    def interrupted(path: Path, *rest: object) -> Path:
        if path.name == "view_002.png":
            raise KeyboardInterrupt
        return write(path, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr("autostereo.frame.write_image", interrupted)
    result = cli("views", "square.off", "-o", "out", "--size", "16x16")
    assert result.status == 130
    assert {path.name for path in folder.iterdir()} == {"square.off"}


def heed_signals() -> None:
    """Undo what a shell does to the jobs that it starts in the background: SIGINT is ignored there."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_in_the_middle(folder: Path, number: signal.Signals) -> None:
    """A process that is stopped while it renders exits with 128 + signal, says at most one line, and leaves nothing."""
    code = (
        "import sys, time\nimport autostereo.cli.common as common\n"
        "def slow(*_): print('started', flush=True); time.sleep(60)\n"
        "common.load_scene = slow\n"
        "from autostereo.cli import main\n"
        "sys.argv = ['autostereo', 'views', 'square.off', '-o', 'out']\nmain()\n"
    )
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", code], cwd=folder, preexec_fn=heed_signals, **pipes) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "started\n"
        time.sleep(0.1)
        process.send_signal(number)
        try:
            _, err = process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode == 128 + number
    assert "Traceback" not in err and len(err.strip().splitlines()) <= 1
    assert {path.name for path in folder.iterdir()} == {"square.off"}


CALLED_BACK = """
import ctypes, os, signal, sys, time
import autostereo.cli.common as common
from autostereo import temporary
def slow(*_):
    with temporary.scratch_folder() as folder:
        print(folder, flush=True)
        ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGINT))()
        time.sleep(1)
common.load_scene = slow
from autostereo.cli import main
sys.argv = ["autostereo", "views", "square.off", "-o", "out"]
main()
"""


def test_an_interrupt_within_a_callback_is_heeded(folder: Path) -> None:
    """Python drops exceptions there, such as while Numba loads kernels; files in use are removed all the same."""
    command = [sys.executable, "-c", CALLED_BACK]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, preexec_fn=heed_signals)
    assert (done.returncode, done.stderr) == (130, "autostereo: interrupted\n")
    assert not Path(done.stdout.strip()).exists() and files(folder) == {"square.off"}


@pytest.mark.parametrize("streams", [">&-", "2>&-", ">&- 2>&-"])
def test_closed_streams_are_no_error(folder: Path, streams: str) -> None:
    command = f"{sys.executable} -m autostereo render square.off -d lenticular-8 --size 16x12 -o a.png {streams}"
    assert subprocess.run(command, shell=True, cwd=folder, capture_output=True).returncode == 0
    assert files(folder) == {"square.off", "a.png"}


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_text_that_an_output_cannot_hold_is_no_error(folder: Path, encoding: str) -> None:
    command = [sys.executable, "-m", "autostereo", "info", "square.off", "-d", "looking-glass-portrait"]
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    done = subprocess.run(command, cwd=folder, capture_output=True, env=environment)
    assert (done.returncode, done.stderr) == (0, b"") and b"verdict      fits" in done.stdout


def test_a_closed_pipe_is_no_error(folder: Path) -> None:
    command = f"{sys.executable} -c 'from autostereo.cli import main; main()' displays | head -n 1"
    done = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True)
    assert done.stdout.startswith("acer") and done.stderr == ""


def test_a_run_that_compiles_says_so_once(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    from autostereo.engines.cpu import jit  # noqa: F401  (which listens)

    if numba.config.DISABLE_JIT:
        pytest.skip("nothing is compiled")
    door = importlib.import_module("autostereo.render")
    drawn = door.render

    def compiling(*arguments: object, **options: object) -> object:
        increment = numba.njit(lambda x: x + 1)
        assert increment(1) == 2 and increment(1.0) == 2
        return drawn(*arguments, **options)

    arguments = ("render", "square.off", "-d", "lenticular-8", *SMALL, "--engine", "reference")
    assert "compiling" not in cli(*arguments).err
    monkeypatch.setattr(door, "render", compiling)
    err = cli(*arguments).err
    assert err.startswith("compiling kernels (once for each kind of picture, up to a minute)…\n")
    assert err.count("compiling") == 1
    assert cli(*arguments, "-q").err == ""
    refused(cli("bench", "papers", "nosuch"), "nosuch")
    compiling_nothing = cli("bench", "papers", "nosuch").err
    assert compiling_nothing.startswith("autostereo: error:")


def test_progress_on_a_terminal(folder: Path) -> None:
    """The spinner goes to stderr only, and is gone in the end."""
    pty = pytest.importorskip("pty")
    terminal, stderr = pty.openpty()
    code = "from autostereo.cli import main; main()"
    command = [sys.executable, "-c", code, "views", "square.off", "-o", "out", "--size", "48x64"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "80"}
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=stderr, env=environment)
    os.close(stderr)
    shown = b""
    while True:  # a terminal that nobody reads would block the process
        try:
            part = os.read(terminal, 4096)
        except OSError:  # how Linux reports the end of a terminal
            break
        if not part:
            break
        shown += part
    os.close(terminal)
    out, _ = process.communicate(timeout=30)
    assert out.decode() == "out  8 views of 48×64\n"
    assert b"rendering 8 views" in shown and b"\x1b[2K" in shown  # drawn, and erased


def test_no_progress_in_a_pipe(folder: Path) -> None:
    code = "from autostereo.cli import main; main()"
    command = [sys.executable, "-c", code, "render", "square.off", "-d", "lenticular-8", "--size", "48x64"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0
    assert "\x1b" not in done.stdout + done.stderr and "\r" not in done.stdout + done.stderr
    assert done.stdout == "square_lenticular-8.png  48×64\n"
