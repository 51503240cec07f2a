"""A Renderer on gl follows its objects' transforms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import autostereo as aus
from autostereo.scene.shapes import displaced_sphere
from gl_device import need_device


def test_an_updated_scene_is_drawn_as_a_fresh_one() -> None:
    need_device()
    meshes = [displaced_sphere(2), displaced_sphere(1)]
    rig = aus.Rig(position=(0, 0, 5), baseline=0.5, views=3)
    renderer = aus.Renderer(meshes, engine="gl")
    before = renderer.render_views(rig, (40, 30)).color.copy()
    moved = np.eye(4)
    moved[:3, 3] = 0.5, 0.2, -0.3
    renderer.update(transform=[np.eye(4), moved])
    after = renderer.render_views(rig, (40, 30)).color
    fresh = aus.render_views(renderer.scene, rig, (40, 30), engine="gl").color
    assert (before != after).any()
    assert np.abs(after.astype(int) - fresh).max() <= 1  # another middle of the scene rounds otherwise


@pytest.mark.parametrize("method", ["single-pass", "plane-rasterizer", "n-pass", "covering-quad"])
def test_a_mirrored_scene_is_drawn_as_a_fresh_one(method: str) -> None:
    """Mirrors turn triangles round: what was sent of them is sent again."""
    need_device()
    rig = aus.Rig(position=(0, 0, 5), baseline=0.5, views=45)
    display = aus.Display.lenticular(90, 60, 45, per="subpixel")
    renderer = aus.Renderer(displaced_sphere(5), engine="gl")
    before = renderer.render(display, rig, method=method).pixels.copy()
    renderer.update(transform=np.diag([-1.0, 1, 1, 1]))
    after = renderer.render(display, rig, method=method).pixels
    fresh = aus.render(renderer.scene, display, rig, method=method, engine="gl").pixels
    assert (before != after).any()
    np.testing.assert_array_equal(after, fresh)


def test_a_scene_that_has_moved_far_is_drawn_as_a_fresh_one() -> None:
    need_device()
    away = np.eye(4)
    away[:3, 3] = 2e6, -3e6, 1e6
    renderer = aus.Renderer(displaced_sphere(4), engine="gl")
    rig = aus.Rig(position=(0, 0, 5), baseline=0.5, views=3)
    renderer.render_views(rig, (40, 30))
    renderer.update(transform=away)
    rig = replace(rig, position=tuple(away[:3, 3] + (0, 0, 5)), target=tuple(away[:3, 3]))
    after = renderer.render_views(rig, (40, 30)).color
    np.testing.assert_array_equal(after, aus.render_views(renderer.scene, rig, (40, 30), engine="gl").color)
    assert after[..., 3].any()
