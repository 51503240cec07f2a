"""The table of verbs, and the one place where errors become exit codes."""

from __future__ import annotations

import inspect
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import typer

from .. import __version__
from ..errors import AutostereoError, InputError
from ..jit import telling
from . import common
from .bench import bench
from .demo import demo
from .displays import displays
from .info import info
from .observe import observe
from .pattern import pattern
from .quilt import quilt
from .render import render
from .simulate import simulate
from .views import views
from .warp import warp
from .weave import weave

VERBS: tuple[Callable[..., None], ...] = (
    render, quilt, views, warp, weave, observe, pattern, displays, info, demo, bench, simulate
)  # fmt: skip

NUMBERS = {"int": "a whole number", "float": "a number"}  # by the first word of what Pydantic calls an error

app = typer.Typer(
    name="autostereo", rich_markup_mode=None, pretty_exceptions_enable=False, no_args_is_help=True, add_completion=False
)


def _version(asked: bool) -> None:
    if asked:
        print(f"autostereo {__version__}")
        raise typer.Exit


@app.callback(
    epilog="\b\nExamples:\n"
    "  autostereo render bunny.ply --display looking-glass-portrait\n"
    "  autostereo quilt head.nii.gz --display looking-glass-portrait --transfer ct-bone\n"
    "  autostereo displays\n"
    "  autostereo render --help"
)
def _root(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print it.")] = False,
) -> None:
    """Render meshes, volumes and point clouds for glasses-free 3D displays: all views in one pass, on a plain CPU."""


for _verb in VERBS:  # the examples of a docstring keep their lines; the rest of it is wrapped
    _help, _examples = inspect.cleandoc(_verb.__doc__ or "").split("\n\nExamples:\n")
    app.command(name=_verb.__name__, help=_help, epilog=f"\b\nExamples:\n{_examples}")(_verb)


def _complain(text: object) -> int:
    print(f"autostereo: error: {' '.join(str(text).split())}", file=sys.stderr)
    return 2


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit status.

    0 done; 2 something the user can put right, told in one line on stderr; 130 interrupted; 1 a bug in
    autostereo. With AUTOSTEREO_DEBUG=1 errors keep their traceback.
    """
    common.STATE.quiet = False
    arguments = list(arguments) or ["--help"]
    debug = os.environ.get("AUTOSTEREO_DEBUG", "0") not in ("", "0")
    try:
        if "" in arguments:  # Path takes it for the current folder
            raise InputError(f"argument {arguments.index('') + 1} is empty, expected a path or a value")
        with warnings.catch_warnings(), telling(common.note_compilation):
            warnings.showwarning = lambda message, *_, **__: common.note(f"autostereo: note: {message}")
            status = typer.main.get_command(app).main(args=arguments, prog_name="autostereo", standalone_mode=False)
        sys.stdout.flush()
    except KeyboardInterrupt:
        status = 130
    except BrokenPipeError:  # as in `autostereo displays | head -1`
        sys.stdout = open(os.devnull, "w")  # the interpreter's last flush must not fail
        status = 0
    except Exception as error:
        if debug and not hasattr(error, "exit_code"):
            raise
        status = _status_of(error)
    if status == 130:
        print("autostereo: interrupted", file=sys.stderr)
    return int(status or 0)


def _usage(error: Any) -> str:
    """What a usage error says; of a value that is no number, what was found, which typer leaves out."""
    causes: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    wanted = NUMBERS.get(str(causes[0].get("type")).split("_")[0]) if causes else None
    if wanted is None or error.param is None:
        return str(error.format_message())
    return f"{error.param.opts[0]}: expected {wanted}, got {causes[0].get('input')!r}"


def _status_of(error: Any) -> int:
    """Print the one line that an error deserves and return the exit status."""
    if hasattr(error, "format_message"):  # typer's usage errors, from click or its own copy of it
        hint = getattr(getattr(error, "ctx", None), "command_path", "autostereo")
        return _complain(f"{_usage(error)} (see {hint} --help)")
    if type(error).__name__ == "Abort":
        return 130
    if hasattr(error, "exit_code"):
        return int(error.exit_code)
    if isinstance(error, AutostereoError):
        return _complain(error)
    if isinstance(error, MemoryError):
        return _complain(f"this machine's memory is not enough ({error or 'out of memory'})")
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename else ""
        return _complain(f"{name}{error.strerror or error}")
    _complain(f"internal error: {type(error).__name__}: {error} (AUTOSTEREO_DEBUG=1 prints where; please report it)")
    return 1
