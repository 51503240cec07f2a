"""Multi-view rasterisation hardware, as a functional simulator (Hasselgren and Akenine-Möller 2006).

`simulate(scene, rig, machine)` draws a frame on a `Machine` and reports the bytes it moved. Independent of the render
engines; its pictures equal theirs.
"""

from .machine import BufferCache, Machine, Shading, TextureCache, Traversal
from .report import Report
from .simulate import in_parallel, simulate, simulate_accumulation
from .textures import Texture
from .workload import Draw, Workload

__all__ = [
    "BufferCache", "Draw", "Machine", "Report", "Shading", "Texture", "TextureCache", "Traversal", "Workload",
    "in_parallel", "simulate", "simulate_accumulation",
]  # fmt: skip
