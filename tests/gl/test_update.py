"""A Renderer on gl follows its objects' transforms."""

from __future__ import annotations

import numpy as np

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
