"""View maps of every kind, for tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st

from autostereo.viewmap import ViewMap

R, X = np.arange(12)[:, None, None], np.arange(24)[None, :, None]
C = np.arange(3)
S = 3 * X + C
WAVELENGTH = ((1 + (R + 1) % 12 + (R + 1) % 12 // 3) // 2 + 3 * X % 8 + C) % 8
TABLES = {
    "per pixel": ViewMap(8, table=(X + 0 * (R + C)) % 8),
    "sub-pixel 5": ViewMap(5, table=(S + 0 * R)[:, :15] % 5),
    "de Sorbier 4b": ViewMap(6, table=(2 * S - R)[:6, :2] % 6),
    "wavelength-selective": ViewMap(8, table=WAVELENGTH[:, :8]),
    "Alioscopy": ViewMap(8, table=(S - R)[:8, :8] % 8),
    "one view": ViewMap(1, table=np.zeros((1, 1, 3), int)),
}
STRIPE = np.array([[0.37, 0.37 + 1 / 19, 0.37 + 2 / 19]])
CELLS = np.array([[0.1, 0.25, 0.4], [0.2, 0.3, 0.15], [0.7, 0.6, 0.9], [0.05, 0.5, 0.95]])
PHASES = {
    "slanted": ViewMap(9, a=0.161, b=-0.0221, offsets=STRIPE),
    "continuous": ViewMap(9, a=0.161, b=0.0221, offsets=STRIPE, continuous=True),
    "running left": ViewMap(48, a=-0.161, b=0.01, offsets=STRIPE),
    "exact wraps": ViewMap(4, a=0.25, b=0.5, offsets=np.array([[0.0, 0.25, 0.5]])),
} | {f"cells {mode}": ViewMap(7, a=0.15, b=0.02, offsets=CELLS, cell_mode=mode, height=13) for mode in range(5)}
MAPS = TABLES | PHASES
EVERY = pytest.mark.parametrize("viewmap", [replace(m, reverse=v) for m in MAPS.values() for v in (False, True)])


@st.composite
def phase_maps(draw):
    number = st.floats(-3, 3)
    mode = draw(st.integers(0, 4))
    offsets = draw(st.lists(st.tuples(number, number, number), min_size=1, max_size=4))
    return ViewMap(
        draw(st.integers(1, 130)),
        a=draw(number),
        b=draw(number),
        offsets=np.array(offsets),
        cell_mode=mode,
        height=13,
        continuous=draw(st.booleans()),
        reverse=draw(st.booleans()),
    )
