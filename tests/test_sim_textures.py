"""The filter of the simulated machine's textures: the compiled one gives the same bits as the plain one."""

from __future__ import annotations

import numpy as np
import pytest
from numba import config, njit

from autostereo.simulator.kernels import channels


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="compares what is compiled with what is not")
def test_four_channels_at_once():
    rng = np.random.default_rng(8)
    texels = rng.integers(0, 256, (50, 4)).astype(np.uint8)

    @njit
    def compiled(texels, a, b, c, d, s, t):
        return channels.filtered(texels, a, b, c, d, s, t)

    for _ in range(2000):
        places, shares = rng.integers(0, 50, 4), rng.uniform(0, 1, 2)
        found = compiled(texels, *places, *shares)
        assert found == channels.filtered(texels, *places, *shares)
        # the same by a matrix product
        a, b, c, d = texels[places].astype(float)
        s, t = shares
        expected = np.array([(1 - t) * (1 - s), (1 - t) * s, t * (1 - s), t * s]) @ np.array([a, b, c, d])
        np.testing.assert_allclose(found, expected, atol=1e-12)
