"""Blinn–Phong shading, as a specification (DESIGN section 5, "Values"), in eye space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import DirectionalLight, Light, Material
from ...transforms import apply
from ..engine import Camera
from ..options import Options
from .mesh import Hits, Samples, Surface
from .texture import level_of_detail, trilinear

Array = NDArray[np.float64]


def unit(vectors: Array) -> Array:
    """Vectors (…, 3) scaled to length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)


def lights_in_eye_space(lights: tuple[Light, ...] | None, camera: Camera) -> list[tuple[Array, Array]]:
    """Lights as (homogeneous position (4,), colour (3,)): w = 1 a point, w = 0 the direction towards the light.

    Without lights there is one, white, shining along the centre camera's line of sight.
    """
    if lights is None:
        return [(np.array([0.0, 0.0, -1.0, 0.0]), np.ones(3))]
    result = []
    for light in lights:
        if isinstance(light, DirectionalLight):
            towards = -camera.eye_from_world[:3, :3] @ light.direction
            result.append((np.append(unit(towards), 0.0), np.array(light.color)))
        else:
            position = apply(camera.eye_from_world, np.array(light.position))
            result.append((np.append(position, 1.0), np.array(light.color)))
    return result


def illuminate(
    points: Array, normals: Array, eyes: Array, material: Material, lights: list[tuple[Array, Array]],
    both_sides: bool = False,
) -> tuple[Array, Array]:
    """What multiplies the surface's own colour, and the highlight added to it; each (M, 3), not clamped.

    The first is ambient + diffuse·Σ L·max(N·L, 0), the second specular·Σ L·max(N·H, 0)^shininess with
    H = unit(L + V); a light behind the surface (N·L ≤ 0) makes no highlight.

    Parameters
    ----------
    points, normals, eyes : ndarray of shape (M, 3)
        Surface points, unit normals on the side that is seen, and the eyes that see them.
    material : Material
    lights : list of (homogeneous position (4,), colour (3,))
    both_sides : bool
        |N·L| and |N·H| instead, for volumes: there is no outside.
    """
    view = unit(eyes - points)
    reflected = np.full(points.shape, material.ambient)
    highlight = np.zeros(points.shape)
    for position, color in lights:
        towards = unit(position[:3] - position[3] * points)
        cosine = np.sum(normals * towards, axis=1)
        half = np.sum(normals * unit(towards + view), axis=1)
        if both_sides:
            cosine, half = np.abs(cosine), np.abs(half)
        gloss = np.maximum(half, 0.0) ** material.shininess
        reflected += material.diffuse * np.maximum(cosine, 0.0)[:, None] * color
        highlight += material.specular * np.where(cosine > 0, gloss, 0.0)[:, None] * color
    return reflected, highlight


def shade(
    surface: Surface, hits: Hits, samples: Samples, camera: Camera, lights: list[tuple[Array, Array]], options: Options
) -> Array:
    """Colours (M, 3) of hits on one surface, `hits.triangle` being its faces; not clamped.

    `shading="reuse"` is a way to save work, not another look: it is shaded exactly here.
    """
    corner = surface.faces[hits.triangle]
    front = (hits.side < 0) if surface.mirrored else (hits.side > 0)
    sign = np.where(front, 1.0, -1.0)[:, None]
    centre = np.array([0.0, camera.offset_y, 0.0])

    def mix(per_vertex: Array) -> Array:
        return np.einsum("mk,mkc->mc", hits.weights, per_vertex[corner])

    if options.lighting == "vertex":
        # lit for the centre eye, both sides; what is interpolated includes the vertex colour
        eyes = np.broadcast_to(centre, surface.vertices.shape)
        sides = [illuminate(surface.vertices, s * surface.normals, eyes, surface.material, lights) for s in (1.0, -1.0)]
        (front_light, front_highlight), (back_light, back_highlight) = sides
        color = np.where(front[:, None], mix(surface.colors * front_light), mix(surface.colors * back_light))
        highlight = np.where(front[:, None], mix(front_highlight), mix(back_highlight))
    else:
        eyes = np.tile(centre, (len(sign), 1))
        if options.shading != "center":
            eyes[:, 0] = samples.v[hits.where]
        normals = sign * unit(mix(surface.normals))
        reflected, highlight = illuminate(mix(surface.vertices), normals, eyes, surface.material, lights)
        color = mix(surface.colors) * reflected

    if surface.uv is not None:
        uv = surface.uv[hits.triangle]
        at, dx, dy = (np.einsum("mk,mkc->mc", w, uv) for w in (hits.weights, hits.weights_dx, hits.weights_dy))
        color = color * trilinear(surface.levels, at, level_of_detail(surface.levels, dx, dy))
    return color + highlight
