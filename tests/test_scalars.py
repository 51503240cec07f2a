"""Small functions of kernels."""

from __future__ import annotations

import numpy as np

from autostereo.engines.cpu.scalars import quotient


def test_quotients_are_exact():
    """Blocks of columns: whole numbers divided by way of 1/size."""
    whole = np.arange(70_000)
    for size in (*range(1, 70), 416, 1920, 2048, 65_535):
        found = ((whole + 0.5) * (1.0 / size)).astype(int)
        np.testing.assert_array_equal(found, whole // size)
        edges = [n for k in (1, 7, 65_536 // size) for n in (k * size - 1, k * size)]
        assert [quotient(n, 1.0 / size) for n in edges] == [n // size for n in edges]
