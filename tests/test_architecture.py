"""The law of the house (ARCHITECTURE.md): imports, lengths, parameters, a light start."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "autostereo"
SOURCES = sorted(PACKAGE.rglob("*.py"))
PYTHON_FILES = [*SOURCES, *sorted((ROOT / "tests").rglob("*.py")), *sorted((ROOT / "examples").rglob("*.py"))]

MAX_LINES = 400
MAX_PARAMETERS = 6
# Functions that may take more: those whose signature is the public contract, and whole rooms with a reason.
CONTRACT = {"lenticular", "slanted", "from_table", "from_calibration", "wavelength_selective", "stereo", "physical"}
ROOMS = {
    "engines/cpu": "Numba kernels take arrays one by one; structures would defeat SIMD",
    "simulator/kernels": "the small steps of an inner loop take what they compute with as scalars",
    "cli": "the parameters of a verb are the options that a user types",
}


def modules_after(statement: str) -> set[str]:
    """Names of the modules that a fresh interpreter has loaded after `statement`."""
    code = f"{statement}\nimport sys\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def functions(path: Path) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]


def count_parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Parameters a caller can name, without self and cls."""
    arguments = function.args
    names = [a.arg for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    return len([name for name in names if name not in ("self", "cls")])


def test_import_law() -> None:
    """Top may import below, never up; only engines.cpu imports Numba (contracts in pyproject.toml)."""
    pytest.importorskip("importlinter")
    done = subprocess.run(
        [sys.executable, "-c", "import importlinter.cli as c; raise SystemExit(c.lint_imports(no_cache=True))"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


@pytest.mark.parametrize("path", PYTHON_FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_file_is_longer_than_400_lines(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_LINES


def test_no_function_has_more_than_six_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    allowed, refused = [], []
    for path in SOURCES:
        name = path.relative_to(PACKAGE).as_posix()
        for function in functions(path):
            count = count_parameters(function)
            if count <= MAX_PARAMETERS:
                continue
            entry = f"{name}:{function.lineno} {function.name} ({count})"
            in_room = any(name.startswith(f"{room}/") for room in ROOMS)
            in_contract = name.startswith("display/") and function.name in CONTRACT
            (allowed if in_room or in_contract else refused).append(entry)
    with capsys.disabled():
        print(f"\nfunctions allowed more than {MAX_PARAMETERS} parameters:", *allowed, sep="\n  ")
    assert not refused


@pytest.mark.parametrize("statement", ["import autostereo", "from autostereo import Rig, Options, Mesh, Display"])
def test_import_is_light(statement: str) -> None:
    loaded = modules_after(statement)
    assert not loaded & {"numba", "llvmlite", "trimesh", "moderngl", "vtk", "PIL", "scipy", "rich", "typer", "av"}


def test_import_autostereo_loads_nothing_but_itself() -> None:
    loaded = modules_after("import autostereo")
    assert "numpy" not in loaded
    assert {name for name in loaded if name.startswith("autostereo")} == {"autostereo"}


def test_help_loads_no_renderer() -> None:
    """`autostereo --help` answers at once: no engine, no reader."""
    loaded = modules_after("import sys\nfrom autostereo.cli.app import run\nassert run(['--version']) == 0")
    assert not loaded & {"numba", "trimesh", "PIL", "scipy", "numpy"}


def test_one_file_per_verb() -> None:
    from autostereo.cli.app import VERBS

    files = {path.stem for path in (PACKAGE / "cli").glob("*.py")} - {"__init__", "app", "common", "outputs"}
    assert files == {verb.__name__ for verb in VERBS}
    assert all(verb.__module__ == f"autostereo.cli.{verb.__name__}" for verb in VERBS)


def test_every_public_name_exists() -> None:
    import autostereo

    for name in autostereo.__all__:
        assert getattr(autostereo, name) is not None
    assert sorted(autostereo.__all__) == dir(autostereo)


@pytest.mark.parametrize("first", ["from autostereo.render import Renderer", "aus.Renderer", "aus.render"])
def test_render_stays_a_function(first: str) -> None:
    """The module autostereo.render never hides the function autostereo.render."""
    code = f"import autostereo as aus\n{first}\nassert callable(aus.render), aus.render\n"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_one_version_number() -> None:
    """The version stands in __init__.py; CITATION.cff repeats it and must agree."""
    import autostereo

    assert f"\nversion: {autostereo.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert autostereo.__version__ not in (ROOT / "pyproject.toml").read_text(encoding="utf-8").split("dependencies")[0]
