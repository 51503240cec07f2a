"""Procedural shapes: counts, closed forms and orientation."""

from dataclasses import fields, replace

import numpy as np
import pytest

from autostereo import InputError
from autostereo.scene import shapes

CLOSED = [shapes.icosphere, shapes.displaced_sphere, shapes.uv_sphere, shapes.box, shapes.torus, shapes.torus_knot]


def face_normals(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    n = np.cross(b - a, c - a)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.einsum("fk,fk->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("make", CLOSED)
def test_closed_shapes_are_watertight_and_face_outwards(make):
    assert make().is_closed


@pytest.mark.parametrize("make", [*CLOSED, shapes.plane])
def test_normals_agree_with_the_winding_and_have_unit_length(make):
    mesh = make()
    agree = np.einsum("fck,fk->fc", mesh.shading_normals[mesh.faces], face_normals(mesh))
    assert agree.min() > 0.97
    if mesh.normals is not None:
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("make", [shapes.icosphere, shapes.uv_sphere, shapes.torus, shapes.torus_knot])
def test_exact_normals_agree_with_computed_ones(make):
    mesh = make()
    used = np.unique(mesh.faces)
    computed = replace(mesh, normals=None).shading_normals
    assert np.einsum("nk,nk->n", mesh.normals, computed)[used].min() > 0.9995


def test_volumes_approach_the_closed_forms():
    assert volume(shapes.icosphere(5, 2.0)) == pytest.approx(4 / 3 * np.pi * 8, rel=2e-3)
    assert volume(shapes.uv_sphere(200, 100, 0.5)) == pytest.approx(4 / 3 * np.pi / 8, rel=2e-3)
    assert volume(shapes.box((1, 2, 3))) == pytest.approx(6, rel=1e-12)
    assert volume(shapes.torus(2.0, 0.5, 300, 100)) == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=2e-3)
    knot = shapes.torus_knot((2, 3), 1.0, 0.1, 4000, 60)
    turn = np.linspace(0, 2 * np.pi, 100_001)
    ring = (2 + np.cos(3 * turn)) / 3
    curve = np.stack([ring * np.cos(2 * turn), ring * np.sin(2 * turn), -np.sin(3 * turn) / 3], axis=1)
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    assert volume(knot) == pytest.approx(np.pi * 0.01 * length, rel=5e-3)  # Pappus


@pytest.mark.parametrize("n", [0, 1, 4])
def test_icosphere_counts(n):
    mesh = shapes.icosphere(n, 3.0)
    assert len(mesh.vertices) == 10 * 4**n + 2 and len(mesh.faces) == 20 * 4**n
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 3.0, rtol=1e-14)


def test_benchmark_mesh_is_the_82k_displaced_icosphere():
    mesh = shapes.displaced_sphere()
    assert mesh.vertices.shape == (40_962, 3) and mesh.faces.shape == (81_920, 3)
    radius = np.linalg.norm(mesh.vertices, axis=1)
    assert 0.85 < radius.min() < 0.89 and 1.12 < radius.max() < 1.15
    assert mesh.colors.min() >= 0 and mesh.colors.max() <= 1 and (np.ptp(mesh.colors, axis=0) > 0.7).all()
    # smooth: the colour changes little along an edge
    step = np.abs(mesh.colors[mesh.faces[:, 0]] - mesh.colors[mesh.faces[:, 1]])
    assert step.max() < 0.1


def test_plane_faces_the_viewer_and_its_uv_is_its_position():
    mesh = shapes.plane((4.0, 2.0), (5, 3))
    assert len(mesh.faces) == 2 * 5 * 3 and not mesh.is_closed
    np.testing.assert_array_equal(face_normals(mesh), np.broadcast_to((0, 0, 1), (30, 3)))
    np.testing.assert_allclose(mesh.vertices[:, :2], (mesh.uv - 0.5) * (4, 2), atol=1e-15)


def test_every_side_of_a_box_shows_the_texture_upright():
    mesh = shapes.box((1, 1, 1))
    for side in range(4):  # the two remaining sides are top and bottom
        rows = slice(4 * side, 4 * side + 4)
        np.testing.assert_array_equal(mesh.vertices[rows, 1], mesh.uv[rows, 1] - 0.5)
        right = np.cross((0, 1, 0), mesh.normals[4 * side])
        np.testing.assert_allclose(mesh.vertices[rows] @ right, mesh.uv[rows, 0] - 0.5, atol=1e-15)


def test_sphere_uv_is_a_map_with_north_up_and_east_right():
    mesh = shapes.uv_sphere(8, 4)
    at = {tuple(uv): p for uv, p in zip(mesh.uv.round(6).tolist(), mesh.vertices.round(12) + 0.0, strict=True)}
    np.testing.assert_array_equal(at[0.0, 0.5], (0, 0, 1))
    np.testing.assert_array_equal(at[0.25, 0.5], (1, 0, 0))
    np.testing.assert_array_equal(at[1.0, 0.5], (0, 0, 1))
    assert {tuple(p) for uv, p in at.items() if uv[1] == 1} == {(0, 1, 0)}


def test_checker_has_equal_fields():
    picture = shapes.checker(4, 8, (1, 1, 1), (0, 0, 0))
    np.testing.assert_array_equal(picture[::2, ::2, 0] // 255, np.indices((4, 4)).sum(axis=0) % 2)
    assert picture.shape == (8, 8, 3) and picture.dtype == np.uint8 and (picture[::2] == picture[1::2]).all()


def test_demo_scene_shows_all_there_is_to_show():
    scene = shapes.demo_scene()
    assert len(scene.lights) == 2 and max(scene.background) > 0
    assert any(mesh.colors is not None for mesh in scene.objects)
    assert any(mesh.texture is not None for mesh in scene.objects)
    assert any(mesh.material.specular > 0 for mesh in scene.objects)
    assert sum(mesh.is_closed for mesh in scene.objects) >= 4
    near, far = scene.bounds[1, 2], scene.bounds[0, 2]
    assert near > 0.5 and far < -2  # in front of and behind the screen
    # closed textures: the wave of the globe meets itself
    bands = next(m.texture for m in scene.objects if m.texture is not None and m.texture.shape == (256, 512, 3))
    assert np.abs(bands[:, 0].astype(int) - bands[:, -1]).max() < 24


@pytest.mark.parametrize("make", [*CLOSED, shapes.plane])
def test_shapes_are_deterministic(make):
    for field in fields(first := make()):
        np.testing.assert_equal(getattr(first, field.name), getattr(make(), field.name))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: shapes.icosphere(-1), "subdivisions: expected a whole number in 0…10"),
        (lambda: shapes.icosphere(2.0), "subdivisions"),
        (lambda: shapes.displaced_sphere(11), "subdivisions"),
        (lambda: shapes.displaced_sphere(2, amplitude=1.0), "amplitude"),
        (lambda: shapes.uv_sphere(2), "columns"),
        (lambda: shapes.plane((0, 1)), "size"),
        (lambda: shapes.plane(cells=(0, 1)), "cells"),
        (lambda: shapes.box((1, 1, np.nan)), "size"),
        (lambda: shapes.torus(tube=-1), "tube"),
        (lambda: shapes.torus_knot((0, 3)), "turns"),
        (lambda: shapes.checker(0), "squares"),
    ],
)
def test_bad_arguments_are_named(make, words):
    with pytest.raises(InputError, match=words):
        make()
