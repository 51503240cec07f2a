"""Peak memory of volume jobs, each in a process of its own."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import workloads
from .jobs import peak, reset_peak, run_alone
from .suite import BenchOptions

MEMORY_JOBS = ("views-48", "panel-portrait")
VALUE_TYPES = ("uint8", "uint16")


def peak_memory(job: str, dtype: str, voxels: int, options: BenchOptions) -> dict[str, int]:
    """Bytes of a whole process that reads a volume of voxels³ from a file and renders it.

    Returns
    -------
    dict
        "peak": largest resident size since the job began; "start": resident size before it, with interpreter,
        libraries and compiled kernels; "output": size of the picture.
    """
    values = workloads.the_volume(workloads.shells_scene(voxels)).values
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "volume.npy"
        np.save(path, values if dtype == "uint8" else values.astype(np.uint16) * 257)
        arguments = (job, str(path), options.divisor, options.engine)
        code = f"from autostereo.cli.benchmarks.jobs_volume import main; main{arguments!r}"
        found: dict[str, int] = run_alone(f"bench memory, {job}", code)
    return found


def main(job: str, path: str, divisor: int, engine: str) -> None:
    """Body of the process: print the figures as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        small = f"{folder}/small.npy"
        values = np.load(path, mmap_mode="r")
        stride = len(values) // 16
        np.save(small, values[::stride, ::stride, ::stride])
        _render(job, small, 32, engine)  # to load, and compile, all that the job needs
    start = reset_peak()
    output = _render(job, path, divisor, engine)
    print(json.dumps({"peak": peak(), "start": start, "output": output.nbytes}))


def _render(job: str, path: str, divisor: int, engine: str) -> NDArray[np.uint8]:
    import autostereo as aus

    values = np.load(path)
    step = 2.0 / (max(values.shape) - 1)
    transfer = workloads.shells_transfer(values.dtype)
    scene = aus.Scene((aus.Volume(values, (step,) * 3, (-1.0,) * 3, transfer=transfer),))
    if job == "views-48":
        size = (max(1, 420 // divisor), max(1, 560 // divisor))
        return aus.render_views(scene, workloads.rig_for(scene, 48, size), size=size, engine=engine).color
    display = workloads.portrait_display((max(1, 1536 // divisor), max(1, 2048 // divisor)))
    rig = workloads.rig_for(scene, display.views, (display.width, display.height))
    return aus.render(scene, display, rig, engine=engine).pixels
