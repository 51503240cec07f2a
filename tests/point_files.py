"""What the tests of readers of point clouds share: four points with colours, and ways to write and check them."""

import numpy as np

from autostereo import Points

XYZ = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
UP = np.tile((0.0, 0.0, 1.0), (4, 1))
RGB = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (51, 102, 204)])
GREY = np.full((4, 3), np.float32(0.8))


def write(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def table(*columns, separator=" "):
    rows = np.concatenate([np.asarray(column, float).reshape(4, -1) for column in columns], axis=1)
    return "".join(separator.join(f"{value:.9g}" for value in row) + "\n" for row in rows)


def check(points, colors=GREY, normals=UP, positions=XYZ):
    assert isinstance(points, Points)
    np.testing.assert_array_equal(points.positions, positions)
    np.testing.assert_allclose(points.colors, colors, rtol=1e-6)
    np.testing.assert_allclose(points.normals, normals, atol=1e-9)
