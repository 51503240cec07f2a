"""Procedural volumes and a point cloud, made without a download. Every call gives the same arrays.

All lie within the cube −1…1, or the part of it that their proportions fill.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np
from numpy.typing import NDArray

from ..checks import check_number
from .appearance import Material
from .points import Points
from .shapes import _count, hills, icosphere
from .transfer import TransferFunction
from .volume import Volume

Floats = NDArray[np.floating]


def hydrogen_orbital(size: int = 128, n: int = 4, l: int = 2, m: int = 0) -> Volume:  # noqa: E741
    """Probability density |ψ|² of the electron of a hydrogen atom, per cubic scene unit; its integral is 1.

    The real orbital (n, l, ±m), whose axis is y: cos(mφ) for m > 0, sin(|m|φ) for m < 0. The sphere in the cube
    holds 99.5 % of the probability (Griffiths, Introduction to Quantum Mechanics, 2nd ed., equation 4.89).

    Parameters
    ----------
    size : int
        Voxels along each axis, 8…1024.
    n, l, m : int
        Quantum numbers: 1 ≤ n ≤ 8, 0 ≤ l < n, −l ≤ m ≤ l.
    """
    size, n = _count("size", size, 8, 1024), _count("n", n, 1, 8)
    l, m = _count("l", l, 0, n - 1), _count("m", m, -l, l)  # noqa: E741
    scale = _orbital_radius(n, l)  # Bohr radii in a scene unit
    axis = np.linspace(-1.0, 1.0, size, dtype=np.float32)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    ring = x * x + z * z
    r = np.sqrt(ring + y * y)
    cosine = y / np.maximum(r, 1e-6)
    legendre = np.polynomial.legendre.Legendre.basis(l).deriv(abs(m)).convert(kind=np.polynomial.Polynomial)
    angular = legendre.coef.astype(np.float32)
    wave = _horner(angular, cosine) * _radial(n, l, r * np.float32(scale)).astype(np.float32)
    factor = (2 * l + 1) / (4 * np.pi) * factorial(l - abs(m)) / factorial(l + abs(m)) * scale**3
    if m:
        # sin^|m| θ · e^{i|m|φ} = ((z + i·x) / r)^|m|, φ counted from z
        turned = (z + 1j * x) ** abs(m)
        wave = wave * ((turned.real if m > 0 else turned.imag) / np.maximum(r, 1e-6) ** abs(m))
        factor *= 2
    values = wave * wave * np.float32(factor)
    peak = float(np.percentile(values[values > values.max() * 1e-4], 98))
    glow = [(0.0, 0.1, 0.1, 0.5, 0.0), (0.03, 0.1, 0.2, 0.7, 0.0), (0.12, 0.15, 0.5, 0.9, 1.5)]
    glow += [(0.35, 0.9, 0.45, 0.25, 5.0), (1.0, 1.0, 0.9, 0.6, 18.0)]
    return _cube(values, _transfer(glow, peak))


def c60_density(size: int = 128) -> Volume:
    """Model of the electron density of buckminsterfullerene C60, uint16: one Gaussian on each of its 60 atoms.

    The atoms are the corners of a truncated icosahedron with equal edges, which is all that the model takes from
    chemistry. The greatest value, close to 65535, is at the atoms.
    """
    size = _count("size", size, 16, 1024)
    atoms = 0.8 * c60_atoms()
    width = 0.36 * 0.8 * 4 / np.sqrt(58 + 18 * np.sqrt(5))  # 0.36 edges: maxima stay apart, bonds show
    axis = np.linspace(-1.0, 1.0, size)
    x, y, z = (np.exp(-0.5 * ((axis - atoms[:, a, None]) / width) ** 2).astype(np.float32) for a in range(3))
    plane = (y[:, :, None] * x[:, None, :]).reshape(len(atoms), -1)
    density = (z.T @ plane).reshape(size, size, size)
    own = np.exp(-0.5 * np.square(atoms[:, None] - atoms).sum(axis=2) / width**2)[0].sum()  # at an atom
    values = np.minimum(density * np.float32(65535 / own) + np.float32(0.5), 65535).astype(np.uint16)
    steps = [(0.0, 0.1, 0.2, 0.6, 0.0), (0.08, 0.1, 0.25, 0.75, 0.0), (0.2, 0.15, 0.45, 0.9, 2.0)]
    steps += [(0.35, 0.2, 0.6, 0.85, 0.5), (0.6, 0.3, 0.8, 0.6, 4.0), (0.75, 0.95, 0.8, 0.3, 30.0)]
    steps += [(1.0, 1.0, 0.35, 0.2, 60.0)]
    return _cube(values, _transfer(steps, 65535.0), Material(specular=0.3, shininess=30.0))


def c60_atoms() -> NDArray[np.float64]:
    """Corners (60, 3) of the truncated icosahedron whose corners are at distance 1 from the origin."""
    mesh = icosphere(0)
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()  # each edge once in either direction
    corners = (2.0 * mesh.vertices[start] + mesh.vertices[end]) / 3.0
    return corners / np.linalg.norm(corners, axis=1, keepdims=True)


def engine_part(size: int = 128) -> Volume:
    """A machine part as computed tomography would show it, uint8: light metal (110), steel (215), noise of σ = 2.5.

    A block with two bores lined with steel, water jackets around them, a crankshaft tunnel, oil channels and a flange
    with steel bolts; `size` voxels along x, 0.8 and 0.6 times as many along y and z.
    """
    size = _count("size", size, 32, 1024)
    step = 2.0 / (size - 1)
    counts = [round(share * size) for share in (1.0, 0.8, 0.6)]
    x, y, z = (step * (np.arange(count, dtype=np.float32) - (count - 1) / 2) for count in counts)
    origin = (float(x[0]), float(y[0]), float(z[0]))
    z, y, x = z[:, None, None], y[:, None], x[None]
    side = np.abs(x) - np.float32(0.4)  # both cylinders at once
    radial = np.hypot(side, z)

    block = _rounded(_outside(np.abs(x) - 0.84, np.abs(y + 0.05) - 0.55, np.abs(z) - 0.4), 0.04)
    flange = _rounded(_outside(np.abs(x) - 0.92, np.abs(y + 0.6) - 0.07, np.abs(z) - 0.5), 0.02)
    metal = np.minimum(block, flange)
    for tower in (-0.84, 0.84):  # lugs at both ends
        lug = np.maximum(np.hypot(y - 0.15, z) - 0.18, np.abs(x - tower) - 0.08)
        metal = np.minimum(metal, lug)
    bore = np.maximum(radial - 0.26, -0.25 - y)
    jacket = np.maximum(np.abs(radial - 0.345) - 0.025, np.abs(y - 0.12) - 0.24)
    tunnel = np.hypot(y + 0.42, z) - 0.17
    channel = np.hypot(y + 0.2, np.abs(z) - 0.33) - 0.035
    bolt = np.hypot(np.abs(np.abs(x) - 0.585) - 0.285, np.abs(z) - 0.45)
    for hole in (bore, jacket, tunnel, channel, np.maximum(bolt - 0.035, y + 0.5)):
        metal = np.maximum(metal, -hole)
    liner = np.maximum(np.abs(radial - 0.235) - 0.035, np.abs(y - 0.12) - 0.36)
    shaft = np.maximum(np.hypot(y + 0.42, z) - 0.09, np.abs(x) - 0.95)
    head = np.maximum(bolt - 0.06, np.abs(y + 0.5) - 0.03)
    screw = np.minimum(np.maximum(bolt - 0.03, np.abs(y + 0.6) - 0.13), head)
    steel = np.minimum(np.minimum(liner, shaft), screw)

    part_steel = _filled(steel, step)
    values = 215.0 * part_steel + 110.0 * np.minimum(_filled(metal, step), 1.0 - part_steel)
    values += 4.0 + 2.5 * np.random.default_rng(60).standard_normal(values.shape, dtype=np.float32)
    values = np.clip(values + 0.5, 0.0, 255.0).astype(np.uint8)
    stops = [(0.0, 0.5, 0.55, 0.6, 0.0), (25.0, 0.5, 0.55, 0.6, 0.0), (60.0, 0.6, 0.66, 0.74, 12.0)]
    stops += [(90.0, 0.6, 0.66, 0.74, 0.8), (130.0, 0.7, 0.6, 0.5, 0.8), (165.0, 0.95, 0.65, 0.25, 20.0)]
    stops += [(200.0, 1.0, 0.74, 0.32, 60.0)]
    material = Material(specular=0.35, shininess=40.0)
    return Volume(values, (step,) * 3, origin, transfer=_transfer(stops), material=material)


def shells(size: int = 128, count: int = 4) -> Volume:
    """Nested semi-transparent spherical shells, uint8: the benchmark volume.

    The value climbs in `count` (1…8) equal steps from 0 outside to 255 at the centre; the k-th step, from outside, is
    at radius 0.95·(1 − k / (count + 1)) and 0.08 wide. Each step has its own colour, and takes about a quarter of the
    light; between the steps nothing is seen.
    """
    size, count = _count("size", size, 16, 1024), _count("count", count, 1, 8)
    axis = np.linspace(-1.0, 1.0, size, dtype=np.float32)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    r = np.sqrt(x * x + y * y + z * z)
    values = np.zeros_like(r)
    for k in range(count):
        t = np.clip((0.95 * (1.0 - k / (count + 1)) - r) / np.float32(0.08) + 0.5, 0.0, 1.0)
        values += t * t * (3.0 - 2.0 * t)
    steps: list[tuple[float, ...]] = []
    for k in range(count):
        color = 0.55 + 0.45 * np.cos(2.0 * np.pi * (k / count + np.array((0.55, 0.22, -0.1))))
        for share, opacity in ((0.1, 0.0), (0.5, 12.6), (0.9, 0.0)):
            steps.append((255.0 * (k + share) / count, *color.tolist(), opacity))
    values = (values * np.float32(255.0 / count) + np.float32(0.5)).astype(np.uint8)
    return _cube(values, _transfer(steps), Material(specular=0.2, shininess=32.0))


def surfel_cloud(count: int = 200_000, amplitude: float = 0.15) -> Points:
    """Surfels as a scanner on a turntable would take them from the displaced sphere of `shapes`.

    They follow one line around the object, 1.6 times as dense along the line as across, and are displaced by range
    noise; the brightness differs from one turn of the line to the next. Normals and colours are those of the surface,
    radii cover it without holes.
    """
    count = _count("count", count, 100, 20_000_000)
    amplitude = check_number("amplitude", amplitude, 0.0, 0.9)
    noise = np.random.default_rng(200)
    pitch = np.sqrt(1.6 * 4 * np.pi / count)  # angle between turns
    along = np.arange(count) + 0.5 + noise.uniform(-0.2, 0.2, count)
    polar = np.arccos(1.0 - 2.0 * along / count)
    turn = 2.0 * np.pi * polar / pitch
    direction = np.stack([np.sin(polar) * np.sin(turn), np.cos(polar), np.sin(polar) * np.cos(turn)], axis=1)
    height, colors = hills(direction)
    reach = 0.86 * (1.0 + amplitude * height)  # hills are at most 1.09 high

    # the normal of the surface reach(d)·d is parallel to d·reach − (gradient of reach on the sphere)
    east = np.stack([np.cos(turn), np.zeros(count), -np.sin(turn)], axis=1)
    normals = direction * reach[:, None]
    for tangent in (east, np.cross(direction, east)):
        ahead, behind = direction + 1e-4 * tangent, direction - 1e-4 * tangent
        slope = 0.86 * amplitude * (hills(ahead)[0] - hills(behind)[0]) / 2e-4
        normals -= slope[:, None] * tangent
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    step = pitch / 1.6
    facing = (normals * direction).sum(axis=1)
    radii = 0.65 * np.hypot(pitch, step) * reach / facing
    offset = 0.04 * step * noise.standard_normal(count)
    positions = direction * (reach + offset)[:, None]
    stripe = 1.0 + 0.05 * noise.standard_normal(int(np.pi / pitch) + 2)[(polar / pitch).astype(int)]
    shade = stripe * (1.0 + 0.03 * noise.standard_normal(count))
    colors = np.clip(colors * shade[:, None], 0.0, 1.0)
    return Points(positions, normals, radii, colors, material=Material(specular=0.25, shininess=24.0))


def _cube(values: NDArray, transfer: TransferFunction, material: Material | None = None) -> Volume:
    """Volume of equal axes over the cube −1…1."""
    step = 2.0 / (len(values) - 1)
    return Volume(values, (step,) * 3, (-1.0,) * 3, transfer=transfer, material=material or Material())


def _transfer(points: Sequence[tuple[float, ...]], scale: float = 1.0) -> TransferFunction:
    """Transfer function of points (value / scale, r, g, b, opacity)."""
    return TransferFunction(np.array(points) * (scale, 1.0, 1.0, 1.0, 1.0))


def _orbital_radius(n: int, l: int) -> float:  # noqa: E741
    """Radius in Bohr radii within which the electron is with a probability of 99.5 %."""
    r = np.linspace(0.0, 4.0 * n * (n + 4), 20_001)
    inside = np.cumsum((_radial(n, l, r) * r) ** 2) * (r[1] - r[0])
    return float(r[np.searchsorted(inside, 0.995)])


def _radial(n: int, l: int, r: NDArray) -> NDArray:  # noqa: E741
    """Radial wave function of hydrogen, r in Bohr radii; ∫ R² r² dr = 1."""
    degree, order = n - l - 1, 2 * l + 1
    # associated Laguerre polynomial: Σ (−1)^i · binomial(degree + order, degree − i) · ρ^i / i!
    total = factorial(degree + order)
    coefficients = [
        (-1) ** i * total / (factorial(degree - i) * factorial(order + i) * factorial(i)) for i in range(degree + 1)
    ]
    norm = np.sqrt((2.0 / n) ** 3 * factorial(degree) / (2.0 * n * factorial(n + l)))
    rho = r * r.dtype.type(2.0 / n)
    return norm * np.exp(-0.5 * rho) * rho**l * _horner(np.array(coefficients, r.dtype), rho)


def _horner(coefficients: NDArray, x: NDArray) -> NDArray:
    """Polynomial with `coefficients` in ascending order, in the precision of x."""
    value = np.full_like(x, coefficients[-1])
    for c in coefficients[-2::-1]:
        value = value * x + c
    return value


def _outside(*distances: Floats) -> Floats:
    """Distance from a box, given those from the slabs (negative inside) that it is the intersection of."""
    beyond = np.sqrt(sum(np.maximum(d, 0.0) ** 2 for d in distances))
    inner = distances[0]
    for d in distances[1:]:
        inner = np.maximum(inner, d)
    return beyond + np.minimum(inner, 0.0)


def _rounded(distance: Floats, radius: float) -> Floats:
    return distance - np.float32(radius)


def _filled(distance: Floats, step: float) -> Floats:
    """Share of a scanner's spot, 2 voxels wide, that is inside, at a signed distance from the surface."""
    return np.clip(0.5 - distance / np.float32(2.0 * step), 0.0, 1.0)
