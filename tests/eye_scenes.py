"""Scenes and a camera for tests that need exact numbers, and the reference engine called directly."""

import numpy as np

from autostereo import Material, Mesh, Options, Scene
from autostereo.engines.engine import Camera, Draw, Target
from autostereo.engines.reference.engine import ReferenceEngine

# The eye stands at the origin and looks along the world's −z. All numbers are small binary fractions: arithmetic
# is exact, so equality means equality.
EYE = np.diag([1.0, 1.0, -1.0, 1.0])
CAMERA = Camera(EYE, fx=64.0, fy=64.0, width=64, height=48, focal=4.0, near=0.25)
FLAT = Material(ambient=1.0, diffuse=0.0, two_sided=True)
engine = ReferenceEngine()


def quad(x0, x1, y0, y1, depth, **fields):
    """A rectangle facing the camera, in world space; corners from the bottom left, counter-clockwise."""
    corners = [(x0, y0, -depth), (x1, y0, -depth), (x1, y1, -depth), (x0, y1, -depth)]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]], **({"material": FLAT} | fields))


def draw_views(scene, camera=CAMERA, offsets=(0.0,), **options):
    """Colour (V, H, W, 4) and depth (V, H, W)."""
    shape = (len(offsets), camera.height, camera.width)
    target = Target(np.zeros((*shape, 4), np.uint8), np.zeros(shape, np.float32))
    draw = Draw(camera, np.array(offsets, float), (min(offsets), max(offsets)), options=Options(**options))
    engine.draw(engine.prepare(Scene.of(scene)), draw, target)
    return target.color, target.depth


def draw_panel(scene, draw):
    target = Target(np.zeros((draw.camera.height, draw.camera.width, 3), np.uint8))
    engine.draw(engine.prepare(Scene.of(scene)), draw, target)
    return target.color


def colourful(count, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (count, 3)).astype(np.uint8)


def bumpy_plane(n, rng, size=4.0, aligned=False):
    """Grid of (n + 1)² vertices over the view with random depths; aligned: on sample positions, in one plane."""
    t = np.linspace(-size, size, n + 1)
    x, y = np.meshgrid(t, t)
    points = np.stack([x, y, np.full_like(x, -4.0)], axis=-1)
    if not aligned:
        points[1:-1, 1:-1, :2] += rng.uniform(-0.3, 0.3, (n - 1, n - 1, 2)) * (2 * size / n)
        points[..., 2] += rng.uniform(-0.5, 0.5, (n + 1, n + 1))
    i = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    a, b, c, d = i, i + 1, i + n + 2, i + n + 1
    first = rng.random(len(i)) < 0.5  # diagonals both ways
    one = np.where(first[:, None], np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    two = np.where(first[:, None], np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    return points.reshape(-1, 3), np.concatenate([one, two])
