"""Clouds, displays and comparisons for tests of points on the gl engine."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import autostereo as aus
from autostereo.scene.samples import surfel_cloud

W, H = SIZE = (48, 36)
RIG = aus.Rig(position=(0, 0, 4), fov_y=40, baseline=1.2, views=5, near=0.2)
LIGHTS = (aus.PointLight((1, 1, 5), (0.5, 0.4, 0.3)), aus.DirectionalLight((0.3, -0.2, -1), (0.5, 0.5, 0.6)))
BACKGROUND = (0.25, 0.5, 0.75)
LENSES = {"lens_pitch": 5.7, "subpixel_pitch": 1.0, "slant_deg": 9.46, "phase": 0.3}
SLANTED = aus.Display.slanted(W, H, 5, **LENSES)
DISPLAYS = {
    "wavelength-selective": aus.Display.wavelength_selective(W, H),
    "lenticular": aus.Display.lenticular(W, H, 5),
    "per sub-pixel, mirrored": replace(aus.Display.lenticular(W, H, 5, per="subpixel"), flip_x=True, flip_y=True),
    "slanted": SLANTED,
    "slanted, reversed": aus.Display.slanted(W, H, 7, **LENSES | {"slant_deg": -20.0}, reverse=True),
    "table": aus.Display.from_table(W, H, 6, np.random.default_rng(3).integers(0, 6, (5, 7, 3))),
    "stereo": aus.Display.stereo(W, H, layout="column-interleaved"),
    "one view": aus.Display.lenticular(W, H, 1),
    "cells": aus.Display.preset("looking-glass-16-landscape").resized(W, H).with_views(6),
    "continuous": aus.Display.slanted(W, H, 5, **LENSES, continuous=True),
    "continuous, mirrored": replace(aus.Display.slanted(W, H, 5, **LENSES, continuous=True), flip_x=True, flip_y=True),
}


def cloud(seed: int, count: int = 60, near: bool = False, **fields) -> aus.Points:
    """Surfels of all sizes, some edge-on; near: around the cameras, and some that reach behind them."""
    rng = np.random.default_rng(seed)
    positions = rng.normal((0, 0, 2.5 if near else 0), (0.9, 0.6, 1.5), (count, 3))
    normals = rng.normal(size=(count, 3)) * (1, 1, rng.choice([0.1, 1.0]))
    radii = np.exp(rng.uniform(-7, 0.5 if near else 0, count))
    fields = {"colors": rng.random((count, 3)), "material": aus.Material(0.1, 0.7, 0.5, 12.0)} | fields
    return aus.Points(positions, normals, radii, **fields)


@cache
def scenes() -> dict[str, aus.Scene]:
    """Clouds: of all sizes and without normals; around the cameras; a surface as from a scanner."""
    bare = replace(cloud(2), normals=None, material=aus.Material(0.5, 0.4))
    return {
        "mixed": aus.Scene([cloud(1), bare], LIGHTS, BACKGROUND),
        "near": aus.Scene(cloud(5, near=True), LIGHTS, BACKGROUND),
        "surface": aus.Scene(surfel_cloud(1500)),
    }


def levels(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """By how many levels samples differ, over their channels."""
    assert found.shape == expected.shape and found.dtype == expected.dtype == np.uint8
    return np.abs(found.astype(int) - expected).max(axis=-1)


def assert_alike(found: np.ndarray, expected: np.ndarray, silhouettes: float = 0.001) -> None:
    """At most one level apart on all but a share of the samples; on those a rim is covered or not.

    In float32 a disc's rim, a depth equal to z + ε, and a width of just a pixel may fall on the other side: a share of
    0.001 of all samples may differ by more than one level. (Inside silhouettes 99.9 % have to agree; here that share
    is asked for of all samples together.)
    """
    apart = (levels(found, expected) > 1).mean()
    assert np.ptp(expected) > 60, "nothing to compare"
    assert apart <= silhouettes, f"{apart:.2%} of the samples differ"
