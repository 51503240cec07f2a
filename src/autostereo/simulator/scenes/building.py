"""What procedural scenes are built of: quads, patches, tileable noise, light maps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..textures import Texture
from ..workload import Draw

Array = NDArray[np.float64]
Points = tuple[Any, Any, Any]  # x, y, z
Patch = Callable[[Array, Array], Points]
REGIONS = 4  # a light map is cut into 4×4 regions, one for each of a room's surfaces


def noise(size: int, seed: int, roughness: float = 1.0) -> Array:
    """Tileable noise (size, size), 0…1, with a spectrum of 1/f^roughness."""
    rng = np.random.default_rng(seed)
    f = np.fft.fftfreq(size) * size
    radius = np.hypot(f[:, None], f[None, :])
    radius[0, 0] = np.inf
    spectrum = np.fft.fft2(rng.standard_normal((size, size))) / radius**roughness
    values = np.fft.ifft2(spectrum).real
    low, high = np.percentile(values, [1, 99])
    return np.clip((values - low) / (high - low), 0.0, 1.0)


def image(values: Array) -> NDArray[np.uint8]:
    """Values (h, w, …) 0…1 as uint8."""
    return np.floor(255 * np.clip(values, 0, 1) + 0.5).astype(np.uint8)


def colored(values: Array, dark: ArrayLike, light: ArrayLike) -> Array:
    """Noise (h, w) as colours (h, w, 3) between two."""
    return np.asarray(dark) + values[..., None] * (np.asarray(light) - np.asarray(dark))


def masonry(size: int, seed: int, courses: int, joint: float = 0.06) -> Texture:
    """Stones in courses with joints, each of its own shade: detail at all scales, as photographs have."""
    rng = np.random.default_rng(seed)
    y, x = np.divmod(np.arange(size * size), size)
    v = y / size * courses
    course = np.floor(v).astype(int)
    u = x / size * courses / 2 + 0.5 * (course % 2)
    stone = np.floor(u).astype(int) % max(1, courses // 2)
    across = max(1, courses // 2)
    shade = rng.uniform(0.55, 1.0, (courses, across, 1)) * rng.uniform(0.85, 1.0, (courses, across, 3))
    color = shade[course % courses, stone] * rng.uniform(0.5, 0.95, 3)
    grain = noise(size, seed + 1, 0.8).reshape(-1, 1)
    edge = np.minimum(np.minimum(u % 1, 1 - u % 1) * 2, np.minimum(v % 1, 1 - v % 1))
    color = np.where(edge[:, None] < joint, 0.25, color) * (0.6 + 0.5 * grain)
    return Texture(image(color.reshape(size, size, 3)))


def light_map(size: int, seed: int) -> Texture:
    """16 smooth patches of light and shadow in one texture."""
    tile = size // REGIONS
    rows = [
        np.concatenate([0.15 + 0.75 * noise(tile, seed + REGIONS * j + i, 2.2) for i in range(REGIONS)], axis=1)
        for j in range(REGIONS)
    ]
    light = np.concatenate(rows, axis=0)
    return Texture(image(colored(light, (0.02, 0.02, 0.05), (1.0, 0.95, 0.85))))


class Builder:
    """Collects surfaces with two sets of texture coordinates, by texture."""

    def __init__(self, light: int, scale: float = 0.5) -> None:
        self.light, self.scale = light, scale  # unit of the light map; repeats of a texture per metre
        self.parts: dict[int, list[tuple[Array, Array]]] = {}
        self.region = 0

    def patch(self, texture: int, shape: Patch, cells: tuple[int, int], size: tuple[float, float]) -> None:
        """A surface point(s, t), s and t in 0…1, counter-clockwise from its front; `size`: its extent in metres."""
        columns, rows = cells
        s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
        points = np.stack(np.broadcast_arrays(*shape(s, t), s), axis=-1)[..., :3].astype(np.float64)
        region = self.region % REGIONS**2
        self.region += 1
        j, i = divmod(region, REGIONS)
        inset = 0.02
        light = np.stack([i + inset + s * (1 - 2 * inset), j + inset + t * (1 - 2 * inset)], axis=-1) / REGIONS
        uv = np.stack([s * size[0], t * size[1]], axis=-1) * self.scale
        grid = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
        a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
        faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1, 3)
        corners = points.reshape(-1, 3)[faces]
        attributes = np.concatenate([uv, light], axis=-1).reshape(-1, 4)[faces]
        self.parts.setdefault(texture, []).append((corners, attributes))

    def quad(
        self, texture: int, origin: ArrayLike, right: ArrayLike, up: ArrayLike, cells: tuple[int, int] = (1, 1)
    ) -> None:
        """A parallelogram; right × up points to its front."""
        o, r, u = (np.asarray(x, np.float64) for x in (origin, right, up))

        def shape(s: Array, t: Array) -> Points:
            points = o + s[..., None] * r + t[..., None] * u
            return points[..., 0], points[..., 1], points[..., 2]

        self.patch(texture, shape, cells, (float(np.linalg.norm(r)), float(np.linalg.norm(u))))

    def column(self, texture: int, foot: ArrayLike, radius: float, height: float, cells: tuple[int, int]) -> None:
        """An upright column with a swelling, a base and a capital in its profile."""
        x, y, z = np.asarray(foot, np.float64)

        def shape(s: Array, t: Array) -> Points:
            profile = radius * (1 + 0.35 * np.exp(-((t / 0.06) ** 2)) + 0.5 * np.exp(-(((1 - t) / 0.08) ** 2)))
            return x + profile * np.sin(2 * np.pi * s), y + height * t, z + profile * np.cos(2 * np.pi * s)

        self.patch(texture, shape, cells, (2 * np.pi * radius, height))

    def pipe(self, texture: int, start: ArrayLike, stop: ArrayLike, radius: float, cells: tuple[int, int]) -> None:
        """A level tube that undulates a little."""
        a, b = np.asarray(start, np.float64), np.asarray(stop, np.float64)
        along = (b - a) / np.linalg.norm(b - a)
        side = np.cross(along, (0.0, 1.0, 0.0))

        def shape(s: Array, t: Array) -> Points:
            bend = 0.08 * np.sin(4 * np.pi * t)
            p = a + t[..., None] * (b - a) + (radius * np.cos(2 * np.pi * s) + bend)[..., None] * side
            return p[..., 0], p[..., 1] - radius * np.sin(2 * np.pi * s), p[..., 2]

        self.patch(texture, shape, cells, (2 * np.pi * radius, float(np.linalg.norm(b - a))))

    def box(self, texture: int, center: ArrayLike, size: float) -> None:
        """A crate."""
        c, h = np.asarray(center, np.float64), size / 2
        for axis in range(3):
            for sign in (-1.0, 1.0):
                n = np.zeros(3)
                n[axis] = sign
                r = np.roll(n, 1) * size
                u = np.cross(n, r)
                self.quad(texture, c + n * h - r / 2 - u / 2, r, u)

    def draws(self) -> list[Draw]:
        """One draw for each texture, one-sided, with the shader "level"."""
        result = []
        for texture, parts in self.parts.items():
            corners = np.concatenate([p[0] for p in parts])
            attributes = np.concatenate([p[1] for p in parts])
            attributes[..., :2] -= np.floor(attributes[..., :2].min(axis=1, keepdims=True))
            result.append(Draw(corners, attributes, "level", (texture, self.light), (1.0,), facing=1))
        return result
