"""What the two scripts beside this file share: the command line, the clock and the picture."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from autostereo.cli.benchmarks import workloads
from autostereo.errors import AutostereoError
from autostereo.image import write_image


def main(make: Callable[..., Any]) -> None:
    """Time the loop that `make(scene, rig, size, lighting)` returns, over three frames after a first one."""
    parser = argparse.ArgumentParser(description="V passes over the displaced sphere of 82k triangles")
    parser.add_argument("--views", type=int, default=48)
    parser.add_argument("--size", type=int, nargs=2, default=(420, 560), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--lighting", choices=("vertex", "sample"), default="sample")
    parser.add_argument("--picture", type=Path, help="write one view here")
    parser.add_argument("--view", type=int, default=0, help="which (0: the leftmost camera)")
    chosen = parser.parse_args()
    scene, size = workloads.sphere_scene(6, 0.0), tuple(chosen.size)
    try:
        loop = make(scene, workloads.rig_for(scene, chosen.views, size), size, chosen.lighting)
    except AutostereoError as error:
        raise SystemExit(str(error)) from None
    loop.enter()
    loop.frame()
    loop.finish()
    start = time.perf_counter()
    for _ in range(3):
        loop.frame()
    loop.finish()
    print(f"{1e3 * (time.perf_counter() - start) / 3:.1f} ms for {chosen.views} views of {size[0]}×{size[1]}")
    if chosen.picture is not None:
        write_image(chosen.picture, loop.picture(chosen.view))
