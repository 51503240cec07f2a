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
from autostereo.scene.scene import Scene


def sphere() -> Scene:
    """The displaced sphere of 82k triangles."""
    return workloads.sphere_scene(6, 0.0)


def main(make: Callable[..., Any], make_scene: Callable[[], Scene] = sphere, views: int = 48) -> None:
    """Time the loop that `make(scene, rig, size, switches)` returns, over three frames after a first one."""
    parser = argparse.ArgumentParser(description="V passes over the scene of the benchmark")
    parser.add_argument("--views", type=int, default=views)
    parser.add_argument("--size", type=int, nargs=2, default=(420, 560), metavar=("WIDTH", "HEIGHT"))
    if make_scene is sphere:
        parser.add_argument("--lighting", choices=("vertex", "sample"), default="sample")
        parser.add_argument("--plain", action="store_true", help="the loop as it comes, not the tuned one")
    parser.add_argument("--picture", type=Path, help="write one view here")
    parser.add_argument("--view", type=int, default=0, help="which (0: the leftmost camera)")
    chosen = parser.parse_args()
    scene, size = make_scene(), tuple(chosen.size)
    try:
        loop = make(scene, workloads.rig_for(scene, chosen.views, size), size, chosen)
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
