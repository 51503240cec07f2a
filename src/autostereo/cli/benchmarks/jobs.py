"""Works that need a process of their own, or a hand on Numba's threads."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import AutostereoError
from ...viewmap import ViewMap
from . import workloads
from .workloads import Size

MEMORY_JOBS = ("views-96", "panel-portrait", "panel-8k", "weave")
WEAVE_GRID = (8, 6)


# --- threads ---------------------------------------------------------------------------------------------------------


def available_threads() -> int:
    """Number of threads that the cpu engine may use."""
    return int(_numba().config.NUMBA_NUM_THREADS)


def set_threads(count: int) -> None:
    """Let the cpu engine use `count` threads."""
    _numba().set_num_threads(count)


@contextmanager
def threads_restored() -> Iterator[None]:
    """Undo `set_threads` in the end."""
    before = _numba().get_num_threads()
    try:
        yield
    finally:
        set_threads(before)


def _numba() -> Any:
    # only the cpu engine imports Numba; the benchmark turns a screw of what that engine has loaded
    from ...engines.engine import get_engine

    get_engine("cpu")
    return sys.modules["numba"]


# --- weaving ---------------------------------------------------------------------------------------------------------


def weave_job(quilt_size: Size, panel_size: Size) -> tuple[Callable[[], NDArray[np.uint8]], NDArray, ViewMap, Size]:
    """A function that weaves a random 8×6 quilt to a Portrait-like panel, and its quilt, view map and panel size."""
    from ...engines.cpu.gather import weave

    viewmap = workloads.portrait_display(panel_size).viewmap
    quilt = np.random.default_rng(0).integers(0, 256, (quilt_size[1], quilt_size[0], 3), dtype=np.uint8)
    assert viewmap is not None
    return lambda: weave(quilt, WEAVE_GRID, viewmap, panel_size), quilt, viewmap, panel_size


# --- memory ----------------------------------------------------------------------------------------------------------


def peak_memory(job: str, lighting: str, quick: bool = False) -> tuple[int, int]:
    """Bytes at the peak of `job` in a fresh process above those after a tiny warm-up render, and bytes of output."""
    code = f"from autostereo.cli.benchmarks.jobs import _memory_main; _memory_main({job!r}, {lighting!r}, {quick})"
    above, output = run_alone(f"bench memory, {job}", code)
    return above, output


def run_alone(name: str, code: str) -> Any:
    """Run Python code in a fresh process and return what its last line prints as JSON.

    Raises
    ------
    AutostereoError
        It failed; the message has the last line of its complaint.
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if done.returncode:
        complaint = done.stderr.strip().splitlines() or [f"exit {done.returncode}"]  # killed: it says nothing
        raise AutostereoError(f"{name}: {complaint[-1].rpartition('Error: ')[2]}")
    return json.loads(done.stdout.splitlines()[-1])


def _memory_main(job: str, lighting: str, quick: bool) -> None:
    """Body of the process: print [bytes above the warm-up, bytes of output] as JSON."""
    _memory_job(job, lighting, 2, 16)()
    work = _memory_job(job, lighting, 4 if quick else 6, 4 if quick else 1)
    before = reset_peak()
    output = work()
    print(json.dumps([peak() - before, output.nbytes]))


def _memory_job(job: str, lighting: str, subdivision: int, shrink: int) -> Callable[[], NDArray[np.uint8]]:
    """The whole job, building the scene included; of `weave` without making the quilt, which is its input."""
    import autostereo as aus

    if job == "weave":
        return weave_job((3360 // shrink, 3360 // shrink), (1536 // shrink, 2048 // shrink))[0]
    options = aus.Options(lighting=lighting)

    def stack() -> NDArray[np.uint8]:
        scene, size = workloads.sphere_scene(subdivision, 0.0), (1024 // shrink, 512 // shrink)
        rig = workloads.rig_for(scene, 96, size)
        return aus.render_views(scene, rig, size=size, engine="cpu", options=options).color

    def panel() -> NDArray[np.uint8]:
        scene = workloads.sphere_scene(subdivision, 0.0)
        if job == "panel-8k":
            display = workloads.panel_8k_display((7680 // shrink, 4320 // shrink))
        else:
            display = workloads.portrait_display((1536 // shrink, 2048 // shrink))
        rig = workloads.rig_for(scene, display.views, (display.width, display.height))
        return aus.render(scene, display, rig, engine="cpu", options=options).pixels

    return stack if job == "views-96" else panel


def reset_peak() -> int:
    """Forget the peak so far, where the system can, and return the bytes that count as the start."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
        return _status_bytes("VmRSS")
    except OSError:
        return peak()


def peak() -> int:
    """Largest resident size in bytes, since `reset_peak` where the system can."""
    try:
        return _status_bytes("VmHWM")
    except OSError:
        import resource

        unit = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def _status_bytes(field: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1]) * 1024
    raise OSError(f"/proc/self/status has no {field}")


# --- starting --------------------------------------------------------------------------------------------------------


def import_seconds() -> float:
    """Seconds that `import autostereo` takes in a fresh interpreter, its own start not counted."""
    code = "import time; t = time.perf_counter(); import autostereo; print(time.perf_counter() - t)"
    return float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)


def command_seconds(mesh: Path, repeats: int) -> tuple[float, tuple[float, ...]]:
    """Wall seconds of `autostereo render mesh` to a Portrait panel: the very first, compiling, and `repeats` more."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": f"{folder}/cache"}
        output = f"{folder}/panel.png"
        arguments = ["render", str(mesh), "--display", "looking-glass-portrait", "-o", output]
        code = f"import sys; from autostereo.cli import main; sys.argv[1:] = {arguments!r}; sys.exit(main())"
        seconds = []
        for _ in range(1 + repeats):
            start = time.perf_counter()
            command = [sys.executable, "-c", code]
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
            seconds.append(time.perf_counter() - start)
            if done.returncode:
                raise AutostereoError(f"bench start: autostereo render failed: {done.stderr.strip()}")
    return seconds[0], tuple(seconds[1:])
