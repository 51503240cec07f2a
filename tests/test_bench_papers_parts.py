"""The parts that ``bench papers`` is made of: its data, and scenes and programs of its own."""

from __future__ import annotations

import numpy as np
import pytest

from autostereo.cli.benchmarks import papers_data, papers_varyings, papers_volume, workloads
from autostereo.cli.benchmarks.papers_published import BUCKY, BUNNY, DRAGON, NEGHIP
from autostereo.cli.benchmarks.papers_studio import PapersStudio, Way
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.display.display import Display
from autostereo.engines.options import Options
from autostereo.render import Renderer
from autostereo.scene.mesh import Mesh
from autostereo.scene.scene import Scene
from autostereo.scene.shapes import displaced_sphere, icosphere
from gl_device import need_device

SIZE = (48, 32)


RAW = [(BUCKY, "Bucky.raw", 32), (NEGHIP, "neghip_64x64x64_uint8.raw", 64)]


@pytest.mark.parametrize(("name", "file", "side"), RAW)
def test_raw_data_of_the_papers_is_read(tmp_path, name, file, side):
    """What has no header is of the paper's size; without the file there is a stand-in."""
    options = BenchOptions(data=tmp_path)
    assert "stand-in" in papers_data.volume(options, name).words
    (tmp_path / "volumes").mkdir()
    np.arange(side**3, dtype=np.uint8).tofile(tmp_path / "volumes" / file)
    scene, words = papers_data.volume(options, name)
    assert words == f"data: {file}, {side}×{side}×{side} voxels" and scene.objects[0].shape == (side,) * 3


def test_meshes_of_the_papers_are_read(tmp_path):
    """2007b's from the data folder; without them spheres of as many triangles."""
    options = BenchOptions(data=tmp_path)
    for name, least in ((BUNNY, 69_000), (DRAGON, 100_000)):
        scene, words = papers_data.stanford(options, name)
        count = len(scene.objects[0].faces)
        assert least <= count < 1.01 * least and words.startswith("data: stand-in uv_sphere(")
        assert words.endswith(f", {count} triangles")
    (tmp_path / "meshes").mkdir()
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "meshes" / "dragon.ply").write_text(header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    scene, words = papers_data.stanford(options, DRAGON)
    assert words == "data: dragon.ply, 1 triangles" and len(scene.objects[0].vertices) == 3


def test_vertices_of_their_own_draw_the_same_picture():
    """Chart 4's triangles are Chart 3's; also of a mesh that has colours and an inside."""
    need_device()
    shape = icosphere(2)
    colored = Mesh(shape.vertices, shape.faces[:100], colors=np.abs(shape.vertices).clip(0, 1))
    for mesh in (colored, shape):
        rig = workloads.rig_for(Scene((mesh,)), 2, SIZE)
        own = papers_data.unindexed(Scene((mesh,)))
        one, other = (Renderer(scene, "gl").render_views(rig, SIZE).color for scene in (Scene((mesh,)), own))
        np.testing.assert_array_equal(one, other)
        assert len(own.objects[0].vertices) == 3 * len(mesh.faces) and own.objects[0].two_sided == mesh.two_sided


def test_small_views_have_the_papers_sizes():
    """256×256 for a panel of 512×512, 512×512 for one of 1900×1200 (2007a: Fig. 6, Table 2)."""
    studio, rig = PapersStudio(BenchOptions(), print), workloads.rig_for(Scene((icosphere(1),)), 8, SIZE)
    for name, size in (("MV sub-res 256×256", (256, 256)), ("MV sub-res 512×512", (512, 512))):
        way = papers_volume.small_views(studio, name, Display.wavelength_selective(*SIZE), rig)
        assert (way.method, way.options.small_size) == ("n-pass-subres", size)


@pytest.mark.parametrize("numbers", papers_varyings.NUMBERS)
def test_so_many_numbers_are_handed_on_and_all_reach_the_picture(numbers):
    """None is left out by the compiler, and with their weight of 0 the picture is the engine's own."""
    device, scene = need_device(), Scene((displaced_sphere(3),))
    rig, options = workloads.rig_for(scene, 4, SIZE), Options(lighting="vertex")
    way = papers_varyings.Handing("", SIZE, rig, "geometry-shader", options=options, numbers=numbers)
    text = papers_varyings.text("mesh.frag", numbers, {"LIGHTS": 1}, 400)
    assert 4 * int(text.split("#define FOURS ")[1].split()[0]) + numbers % 4 == numbers
    papers_varyings.programs_of.cache_clear()
    renderer, usual = Renderer(scene, "gl"), device.programs
    plain = Way("", SIZE, rig, "geometry-shader", options=options).draw(renderer).copy()
    np.testing.assert_array_equal(way.draw(renderer), plain)
    assert device.programs is usual
    (program,) = papers_varyings.programs_of(device, numbers)._made.values()
    with device:
        program["weight"] = 0.01
    changed = way.draw(renderer).copy()
    with device:
        program["weight"] = 0.0
    assert (changed != plain).any()
