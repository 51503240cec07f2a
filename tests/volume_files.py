"""A marked phantom, and what the tests of volume files share."""

from pathlib import Path

import numpy as np
import pytest

import autostereo as aus
from autostereo.transforms import apply, rotation

SHAPE = (9, 7, 5)  # x, y, z
MARK = (3, 2, 1)  # i, j, k of the bright voxel
SPACING = (0.5, 2.0, 3.0)
ORIGIN = (10.0, -20.0, 30.0)
TURN = rotation((1, 2, 3), 25)[:3, :3]  # oblique


def phantom(dtype: str = "int16") -> np.ndarray:
    """Values (nz, ny, nx), 0 but for one voxel; its neighbour along x is dimmer, so that no order is symmetric."""
    values = np.zeros(SHAPE[::-1], dtype)
    values[MARK[::-1]] = 100
    values[MARK[2], MARK[1], MARK[0] + 1] = 50
    return values


def load_one(path: Path, **hints: object) -> aus.Volume:
    """The only object of a file: a volume."""
    (volume,) = aus.load(path, **hints).objects
    assert isinstance(volume, aus.Volume)
    return volume


def check_phantom(volume: aus.Volume, spacing=SPACING, origin=ORIGIN, direction=None, value=100) -> None:
    """The values are in place, and the bright voxel is where spacing, origin and direction put it in the world."""
    assert volume.shape == SHAPE
    found = np.unravel_index(np.argmax(volume.values), volume.values.shape)[::-1]
    assert found == MARK
    assert np.array_equal(volume.values.astype(np.float64) * 100 / value, phantom("float64"))
    assert np.allclose(volume.spacing, spacing, rtol=1e-6)
    direction = np.eye(3) if direction is None else direction
    expected = np.asarray(direction) @ (np.array(MARK) * spacing) + origin
    assert np.allclose(apply(volume.world_from_index, [MARK]), expected, atol=1e-4)
    assert np.allclose(volume.direction, direction, atol=1e-6)


def refused(path: Path, *words: str, error: type[aus.AutostereoError] = aus.FileError, **hints: object) -> str:
    """Loading fails with one sentence that names the file and holds the words; returned."""
    with pytest.raises(error) as caught:
        aus.load(path, **hints)
    text = str(caught.value)
    assert str(path) in text and "\n" not in text and len(text) < 400, text
    for word in words:
        assert word in text, text
    return text
