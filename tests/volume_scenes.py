"""Volumes and rays of closed form, for tests of what the reference engine sees."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from scipy import ndimage

from autostereo import Options, Scene, Volume
from autostereo import TransferFunction as Transfer
from autostereo.engines.reference.engine import view_samples
from autostereo.engines.reference.picture import look
from autostereo.transforms import apply, rotation, translation
from eye_scenes import CAMERA, engine

SMALL = replace(CAMERA, fx=20.0, fy=24.0, width=20, height=16)
GREY = (0.5, 0.5, 0.5)
IDENTITY = np.eye(4)
VIVID = Transfer([(0.2, 0, 0, 1, 0.0), (0.5, 0, 1, 0, 2.0), (0.7, 1, 0.5, 0, 0.5), (1.0, 1, 1, 1, 6.0)])
turns = st.builds(rotation, st.sampled_from([(1, 0, 0), (0, 1, 0), (1, 1, 0), (1, -2, 3)]), st.floats(0, 360))


def see(scene, offset=0.0, camera=SMALL, **options):
    """What a view sees, unquantised, one sample a pixel."""
    return look(engine.prepare(Scene.of(scene)), view_samples(camera, offset, 1), camera, Options(**options))


def eye_and_direction(camera, offset):
    """The eye (3,) and directions (H·W, 3), d-component 1, of DESIGN section 1, in world space (z = −d)."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    a = (x.ravel() - camera.width / 2) / camera.fx - offset / camera.focal
    b = (camera.height / 2 - y.ravel()) / camera.fy - camera.offset_y / camera.focal
    return np.array([offset, camera.offset_y, 0.0]), np.column_stack([a, b, -np.ones_like(a)])


def box_entry(volume, camera, offset):
    """Depths at which rays enter and leave the box, by the slab method in index space, and length per depth."""
    eye, direction = eye_and_direction(camera, offset)
    inverse = np.linalg.inv(volume.world_from_index)
    start, along = apply(inverse, eye), direction @ inverse[:3, :3].T
    with np.errstate(divide="ignore"):
        ends = np.stack([-start / along, (np.array(volume.shape) - 1 - start) / along])
    enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    return np.maximum(enter, camera.near), leave, np.linalg.norm(direction, axis=1)


def homogeneous(tau, color=GREY, shape=(5, 5, 5), **fields):
    return Volume(np.full(shape, 7, np.uint8), transfer=Transfer([(0, *color, tau)]), shade=False, **fields)


def centred(spacing, shape, depth=4.0, turn=IDENTITY):
    """Fields that put a volume (nz, ny, nx) around (0, 0, −depth)."""
    half = (np.array(shape[::-1]) - 1) / 2 * spacing
    return {"spacing": spacing, "origin": tuple(-half), "transform": translation(0, 0, -depth) @ turn}


def linear(slope, constant, shape=(6, 7, 8), **fields):
    """A field that is linear in index space, s = slope·(i, j, k) + constant."""
    k, j, i = np.mgrid[tuple(slice(n) for n in shape)].astype(float)
    return Volume(slope[0] * i + slope[1] * j + slope[2] * k + constant, **fields)


def scalar_at(volume, points):
    """The scalars of a `linear` field."""
    index = apply(np.linalg.inv(volume.world_from_index), points)
    c = volume.values[0, 0, 0]
    slope = [volume.values[0, 0, 1] - c, volume.values[0, 1, 0] - c, volume.values[1, 0, 0] - c]
    return index @ np.array(slope) + c


def blobs(seed=0, n=14):
    """A smooth random field in 0…1."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).random((n, n - 2, n + 2)), 1.5)
    return (field - field.min()) / np.ptp(field)
