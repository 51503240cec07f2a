"""Meshes: normals against closed forms, closedness, and what a constructor refuses."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autostereo import DirectionalLight, InputError, Material, Mesh, PointLight, Scene
from autostereo.scene import shapes
from autostereo.scene.appearance import check_image
from autostereo.scene.mesh import merge_positions
from autostereo.transforms import rotation, scaling, translation

CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
# each side as a quad, counter-clockwise from outside
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLE = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])


def cube_faces(diagonals):
    """Twelve triangles; bit k of `diagonals` chooses how side k is cut."""
    faces = []
    for k, (a, b, c, d) in enumerate(SIDES):
        faces += [(a, b, c), (a, c, d)] if diagonals >> k & 1 else [(b, c, d), (b, d, a)]
    return np.array(faces)


# --- normals ---------------------------------------------------------------------------------------


def test_computed_normals_of_a_sphere_are_radial():
    sphere = shapes.icosphere(4)
    normals = replace(sphere, normals=None).shading_normals
    assert np.einsum("nk,nk->n", normals, sphere.vertices).min() > 0.99999
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)


@given(st.integers(0, 63))
def test_cube_corner_normal_does_not_depend_on_the_tessellation(diagonals):
    normals = Mesh(CUBE, cube_faces(diagonals)).shading_normals
    np.testing.assert_allclose(normals, (2 * CUBE - 1) / np.sqrt(3), atol=1e-12)


def test_texture_seams_shade_smoothly():
    sphere = replace(shapes.uv_sphere(16, 8), normals=None)
    _, group = merge_positions(sphere.vertices)
    assert len(np.unique(group)) < len(sphere.vertices)
    for shared in range(group.max() + 1):
        at = sphere.shading_normals[group == shared]
        used = at[at.any(axis=1)]  # the last column of a pole belongs to no face
        assert (used == used[0]).all()


def test_normals_do_not_depend_on_scale_or_on_degenerate_faces():
    wanted = Mesh(CUBE, cube_faces(5)).shading_normals
    for size in (1e-15, 1e15):
        np.testing.assert_allclose(Mesh(CUBE * size, cube_faces(5)).shading_normals, wanted, atol=1e-12)
    faces = np.concatenate([cube_faces(5), [(0, 0, 1), (2, 2, 2)]])
    np.testing.assert_allclose(Mesh(CUBE, faces).shading_normals, wanted, atol=1e-12)


def test_back_to_back_leaves_keep_their_own_normals():
    leaf = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)] * 2, dtype=float)
    normals = Mesh(leaf, [(0, 1, 2), (3, 5, 4)]).shading_normals
    np.testing.assert_array_equal(normals, [(0, 0, 1)] * 3 + [(0, 0, -1)] * 3)


def test_given_normals_are_scaled_and_missing_ones_computed():
    mesh = replace(TRIANGLE, normals=[(0, 0, 0), (3, 0, 4), (0, -2, 0)])
    np.testing.assert_allclose(mesh.shading_normals, [(0, 0, 1), (0.6, 0, 0.8), (0, -1, 0)])


def test_vertices_without_faces_have_no_normal():
    mesh = Mesh([*TRIANGLE.vertices, (5, 5, 5)], [(0, 1, 2)])
    np.testing.assert_array_equal(mesh.shading_normals, [(0, 0, 1)] * 3 + [(0, 0, 0)])


# --- merging and closedness ---------------------------------------------------------------------------


@given(st.lists(st.tuples(*[st.sampled_from([0.0, -0.0, 1.0, 1e-300, 2.0, 3e8])] * 3), min_size=1, max_size=60))
def test_merging_groups_exactly_the_equal_positions(points):
    points = np.array(points)
    first, group = merge_positions(points)
    equal = (points[:, None] == points).all(axis=2)
    np.testing.assert_array_equal(group[:, None] == group, equal)
    np.testing.assert_array_equal(points[first[group]], points)


def test_merging_a_grid_of_small_integers_keeps_all_points():
    points = np.stack(np.meshgrid(*[np.arange(32.0)] * 3), axis=-1).reshape(-1, 3)
    first, group = merge_positions(points)
    assert len(first) == len(points) and len(np.unique(group)) == len(points)


def test_negative_zero_closes_a_cube():
    loose = CUBE[cube_faces(0)].reshape(-1, 3)  # every triangle has its own vertices
    loose[::2] = np.where(loose[::2] == 0, -0.0, loose[::2])
    assert Mesh(loose, np.arange(36).reshape(-1, 3)).is_closed


def test_closed_and_not_closed():
    faces = cube_faces(0)
    assert Mesh(CUBE, faces).is_closed
    assert Mesh(CUBE + 1e6, faces).is_closed  # far from the origin
    assert Mesh(CUBE, np.concatenate([faces, [(0, 0, 1)]])).is_closed  # faces without area do not matter
    assert not Mesh(CUBE, faces[:, ::-1]).is_closed  # inside out
    assert not Mesh(CUBE, faces[1:]).is_closed  # a hole
    assert not Mesh(CUBE, np.concatenate([faces, faces[:1]])).is_closed  # a face twice
    assert not Mesh(CUBE, np.concatenate([faces, faces[:1, ::-1]])).is_closed  # a fin
    turned = faces.copy()
    turned[3] = turned[3, ::-1]
    assert not Mesh(CUBE, turned).is_closed  # one face turned
    assert not Mesh(CUBE, [(0, 0, 1), (1, 1, 1)]).is_closed  # nothing but degenerate faces


def test_two_sided_follows_the_material_else_the_surface():
    closed, open_ = Mesh(CUBE, cube_faces(0)), TRIANGLE
    assert not closed.two_sided and open_.two_sided
    assert replace(closed, material=Material(two_sided=True)).two_sided
    assert not replace(open_, material=Material(two_sided=False)).two_sided


def test_bounds_are_of_the_vertices_in_use_in_world_space():
    vertices = [*TRIANGLE.vertices, (99, 99, 99)]
    mesh = Mesh(vertices, [(0, 1, 2)], transform=translation(1, 2, 3) @ rotation((0, 0, 1), 90) @ scaling(2))
    np.testing.assert_allclose(mesh.bounds, [(-1, 2, 3), (1, 4, 3)], atol=1e-12)
    scene = Scene([mesh, replace(mesh, transform=translation(0, 0, -5))])
    np.testing.assert_allclose(scene.bounds, [(-1, 0, -5), (1, 4, 3)], atol=1e-12)


# --- validation -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("vertices", [(0, 0), (1, 0), (0, 1)], r"vertices: expected shape \(N, 3\), got \(3, 2\)"),
        ("vertices", "abc", "vertices: expected an array of numbers"),
        ("vertices", [(0, 0, 0), (1, 0, np.nan), (0, np.inf, 0)], "vertices: .* NaN or infinity in 2 of 3 rows"),
        ("vertices", [(0, 0, 0), (1, 0, 0), (0, 1e31, 0)], r"vertices: expected numbers within ±1e\+30, found ±1e\+31"),
        ("faces", [(0, 1, 3)], "faces: expected indices 0…2, found 0…3"),
        ("faces", [(0, -1, 2)], "faces: expected indices 0…2, found -1…2"),
        ("faces", np.zeros((0, 3), int), "faces: expected at least one triangle"),
        ("faces", [(0, 1, 2, 0)], r"faces: expected shape \(F, 3\), got \(1, 4\)"),
        ("faces", [(0.0, 1.0, 2.0)], "faces: expected integers, got float64"),
        ("faces", [(0, 1, 2), (0, 1)], "faces: expected an array of integers, got list of uneven rows"),
        ("colors", [(0, 0, 0), (0, 0), (0, 0, 0)], "colors: expected an array of numbers"),
        ("normals", [(0, 0, 1)], r"normals: expected shape \(3, 3\), got \(1, 3\)"),
        ("colors", [(0, 0, 2.0)] * 3, "colors: expected .*0…1"),
        ("colors", [(0, 0)] * 3, r"colors: expected shape \(3, 3\) or \(3, 4\)"),
        ("colors", [(0, 0, 256)] * 3, "colors: expected .*0…1"),
        ("uv", [(0, 0, 0)] * 3, r"uv: expected shape \(3, 2\), got \(3, 3\)"),
        ("texture", np.zeros((2, 2, 3), np.uint8), "texture: needs uv"),
        ("material", "shiny", "material: expected a Material, got str"),
        ("transform", np.eye(3), r"transform: expected shape \(4, 4\), got \(3, 3\)"),
        ("transform", np.diag([1, 1, 1, 2]), "transform: expected an affine matrix"),
    ],
)
def test_mesh_errors_name_the_field(field, value, words):
    with pytest.raises(InputError, match=words):
        replace(TRIANGLE, **{field: value})


def test_uint8_and_float_colors_agree_and_alpha_is_dropped():
    a = replace(TRIANGLE, colors=np.array([(255, 51, 0, 7)] * 3, np.uint8))
    b = replace(TRIANGLE, colors=[(1.0, 0.2, 0.0)] * 3)
    np.testing.assert_array_equal(a.colors, b.colors)
    assert a.colors.dtype == np.float32 and a.colors.shape == (3, 3)


def test_a_mesh_does_not_change_with_the_arrays_it_was_made_from():
    vertices, faces = TRIANGLE.vertices.copy(), TRIANGLE.faces.copy()
    mesh = Mesh(vertices, faces)
    vertices += 1
    faces[:] = 0
    np.testing.assert_array_equal(mesh.vertices, TRIANGLE.vertices)
    np.testing.assert_array_equal(mesh.faces, TRIANGLE.faces)


def test_textures_become_rgb_bytes():
    grey = np.array([[0.0, 0.5], [1.0, 1.0]])
    np.testing.assert_array_equal(check_image("texture", grey)[..., 1], [[0, 128], [255, 255]])
    rgba = np.arange(16, dtype=np.uint8).reshape(2, 2, 4)
    np.testing.assert_array_equal(check_image("texture", rgba), rgba[..., :3])
    shared = np.zeros((4, 4, 3), np.uint8)
    assert check_image("texture", shared) is shared
    for bad in (np.zeros((2, 2, 5), np.uint8), np.zeros((0, 2, 3), np.uint8), np.full((2, 2, 3), 256), "x"):
        with pytest.raises(InputError, match=r"^texture: "):
            check_image("texture", bad)
    with pytest.raises(InputError, match="texture: expected finite"):
        check_image("texture", np.full((2, 2), np.nan))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Material(ambient=-0.1), "material ambient"),
        (lambda: Material(diffuse="1"), "material diffuse"),
        (lambda: Material(specular=np.nan), "material specular"),
        (lambda: Material(specular=1j), "material specular"),
        (lambda: Material(shininess=1e5), "material shininess"),
        (lambda: Material(two_sided="yes"), "material two_sided"),
        (lambda: DirectionalLight((0, 0, 0)), "light direction"),
        (lambda: DirectionalLight((0, 0)), "light direction"),
        (lambda: PointLight((0, 0, np.inf)), "light position"),
        (lambda: PointLight((0, 0, 0), color="red"), "light color"),
        (lambda: Scene([]), "objects: expected at least one"),
        (lambda: Scene([1]), "objects: expected Mesh, .*got int"),
        (lambda: Scene(5), "objects: expected an object or a sequence"),
        (lambda: Scene(TRIANGLE, lights=[1]), "lights: expected lights, got int"),
        (lambda: Scene(TRIANGLE, lights=3), "lights: expected"),
        (lambda: Scene(TRIANGLE, background=(0, 0, 1.5)), "background"),
        (lambda: Scene.of("bunny.ply"), "objects: expected"),
    ],
)
def test_scene_errors_name_the_field(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_scene_takes_a_single_object_and_a_single_light():
    light = PointLight((1, 2, 3))
    scene = Scene(TRIANGLE, lights=light)
    assert scene.objects == (TRIANGLE,) and scene.lights == (light,)
    assert Scene.of(scene) is scene and Scene.of([TRIANGLE]).objects == (TRIANGLE,)


TEXTURED = replace(TRIANGLE, uv=[(0, 0), (1, 0), (0, 1)])


@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64])
def test_integer_colours_and_textures_are_of_255_whatever_their_type(dtype):
    """0 and 1 as well: what an integer means does not depend on the other ones in the array."""
    ones = replace(TRIANGLE, colors=np.eye(3, dtype=dtype))
    np.testing.assert_array_equal(ones.colors, np.eye(3, dtype=np.float32) / np.float32(255))
    np.testing.assert_array_equal(check_image("texture", np.eye(3, dtype=dtype))[..., 0], np.eye(3, dtype=np.uint8))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.full((3, 3), 256), r"expected integers 0…255 \(or floats 0…1\), found 256 \(int64\)"),
        (np.full((3, 3), -1, np.int16), r"expected integers 0…255 \(or floats 0…1\), found -1 \(int16\)"),
        (np.full((3, 3), 2**64 - 1, np.uint64), r"found 18446744073709551615 \(uint64\)"),
        (np.full((3, 3), 1.5), r"expected floats 0…1 \(or integers 0…255\), found 1.5$"),
        (np.full((3, 3), -0.5, np.float32), r"expected floats 0…1 \(or integers 0…255\), found -0.5$"),
        (np.full((3, 2), 0.5), "expected"),
    ],
)
def test_colours_and_textures_beyond_their_range_are_refused(value, words):
    with pytest.raises(InputError, match=f"colors: .*{words}"):
        replace(TRIANGLE, colors=value)
    with pytest.raises(InputError, match=f"texture: .*{words}"):
        replace(TEXTURED, texture=value[None])


def test_colours_may_be_off_by_a_rounding():
    assert replace(TRIANGLE, colors=np.full((3, 3), 1.0000001)).colors.max() == 1
    assert check_image("texture", np.full((2, 2, 3), 1.0000001, np.float64)).max() == 255


def test_pil_textures_of_every_mode_are_colours():
    red = Image.new("RGB", (4, 4), (255, 0, 0))
    for image in (red, red.convert("RGBA"), red.quantize(4)):
        assert (check_image("texture", image) == (255, 0, 0)).all()
    with pytest.raises(InputError, match="found 4000"):
        check_image("texture", Image.fromarray(np.full((4, 4), 4000, np.uint16)))
    assert (check_image("texture", Image.new("LA", (4, 4), (51, 9))) == 51).all()
