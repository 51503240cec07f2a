"""Numbers that kernels and shaders share. The OpenGL engine puts them into its shaders by name (`gl/programs.py`)."""

from __future__ import annotations

LEVELS = 255.0  # a colour's uint8 is ⌊255·v + ½⌋
TINY = 1e-30  # stands in for a squared length of 0 under a root or a quotient: a zero vector stays zero
MAX_CELLS = 4  # cells of sub-pixels that differ in phase: no pattern of displays.md 3.3 has more
ATLAS_VIEWS = 512  # views of one atlas: their offsets and tiles have to fit into a uniform block of 16 KB
MAX_CAMERAS = 4096  # views of a panel, checks.MAX_VIEWS: their offsets fill a uniform block of 16 KB
MEMORY_WIDTH = 4096  # columns of pictures that hold arrays (gl/memory.py)

# Volumes on the gl engine (gl/volume*.py)
BLOCK_BITS = 2  # log2 of the edge of a block of cells that are skipped together
STEPS = 32767.0  # stored gradient of 0; as many steps up and down
FLAT = 0.0025  # squared length of a gradient, in steps, below which there is none
ENOUGH = 1.0 / 512.0  # of light left, when a ray has seen enough
BISECTIONS = 10  # of a slab, in search of an isosurface

SHADER_CONSTANTS: dict[str, float | int] = {
    "LEVELS": LEVELS,
    "TINY": TINY,
    "MAX_CELLS": MAX_CELLS,
    "ATLAS_VIEWS": ATLAS_VIEWS,
    "MAX_CAMERAS": MAX_CAMERAS,
    "BLOCK_BITS": BLOCK_BITS,
    "BLOCK": 1 << BLOCK_BITS,
    "STEPS": STEPS,
    "FLAT": FLAT,
    "ENOUGH": ENOUGH,
    "BISECTIONS": BISECTIONS,
    "MEMORY_WIDTH": MEMORY_WIDTH,
}
