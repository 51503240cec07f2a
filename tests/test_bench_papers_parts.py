"""The parts that ``bench papers`` is made of: its data, and scenes and programs of its own."""

from __future__ import annotations

import numpy as np
import pytest

from autostereo.cli.benchmarks import (
    papers_counts,
    papers_data,
    papers_plots,
    papers_varyings,
    papers_volume,
    workloads,
)
from autostereo.cli.benchmarks.papers_published import BUCKY, BUNNY, DRAGON, NEGHIP
from autostereo.cli.benchmarks.papers_studio import PapersStudio, Way, programs_in_use
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


@pytest.mark.parametrize("work", ["2020-fig15", "focal-plane-quads"])
def test_no_two_series_of_a_chart_look_alike(monkeypatch, tmp_path, work):
    """Lines and bars."""
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    charts, names = [], [f"way {k}" for k in range(34)]
    monkeypatch.setattr(Figure, "savefig", lambda chart, file, **_: charts.append(chart))
    one = {"work": work, "unit": "fps", "scene": "8 views", "value": 1.0, "published": None}
    papers_plots.plot(tmp_path, [one | {"measure": name} for name in names])
    (axes,) = charts[0].axes
    lines = [(line.get_color(), line.get_linestyle()) for line in axes.lines]
    bars = [(bars[0].get_facecolor(), bars[0].get_hatch()) for bars in axes.containers]
    assert len(set(lines + bars)) == len(names)


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


# --- multiplications -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("code", "expected"), [
    ("a * b + c / d;", "times(a,b)+over(c,d);"),
    ("x = -a.y * -b[2 * i].z * c;", "x=-times(times(a.y,-b[times(2,i)].z),c);"),
    ("w /= max(a * b, c);", "w=over(w,max(times(a,b),c));"),
    ("return (a + b) * f(k % 3 * 2);", "returntimes((a+b),f(times((k%3),2)));"),
    ("for (; k < 2 * n; ++k) { s *= dot(u, v); }", "for(;k<times(2,n);++k){s=times(s,counted_dot(u,v));}"),
    ("vec2 p = vec2(4 * t.x, 1.5e-3 / z), q = p;", "vec2p=vec2(times(4,t.x),over(1.5e-3,z)),q=p;"),
], ids=str)  # fmt: skip
def test_products_become_calls_that_count(code, expected):
    text = papers_counts.Rewriter(f"const float K = 1.0 / 64.0;\nvoid f() {{ {code} }}").rewritten()
    found = "".join(text.split("\nvoid main")[0].split())
    assert found == "constfloatK=1.0/64.0;voidf(){" + expected + "}"


def test_multiplications_are_those_of_the_shaders():
    """By hand: 25 a vertex; 18 a corner and 19 a triangle to set it up; the same in every view, or once for all."""
    need_device()
    for views in (1, 6):
        one, covered = papers_counts.count(views, "plane-rasterizer")
        many, same = papers_counts.count(views, "plane-rasterizer-n-pass")
        assert covered == same > 100 * views
        for counts, times in ((one, 1), (many, views)):
            assert counts["plane_vertex.comp"] == times * 3 * (16 + 9)
            assert counts["plane_setup.comp"] == times * (3 * 18 + 6 + 2 * 5 + 3)
        for stage in ("plane_fine.comp", "plane_encode.comp"):
            assert one[stage] == many[stage]
        assert one["plane_fine.comp"] == 2 * 13 * covered  # twice: 11 for the plane of depths, 2 for a depth


def test_one_more_multiplication_in_a_shader_is_counted():
    need_device()

    class Changed(papers_counts.CountingPrograms):
        def text(self, name, defines, version):
            text = super().text(name, defines, version)
            for place in ("uint flags = ", "uvec4 entry = "):  # in setup and in the fine rasteriser
                text = text.replace(place, f"depth_range * 2.0;\n    {place}", 1)
            return text

    views = 3
    for method, times in (("plane-rasterizer", 1), ("plane-rasterizer-n-pass", views)):
        usual, _ = papers_counts.count(views, method)
        more, _ = papers_counts.count(views, method, Changed)
        gained = {stage: more[stage] - usual[stage] for stage in usual if more[stage] != usual[stage]}
        assert gained.pop("plane_setup.comp") == 4 * times  # four numbers, for each triangle that is set up
        assert set(gained) == {"plane_fine.comp"} and gained["plane_fine.comp"] % 4 == 0


def test_shaders_that_count_draw_the_same_picture():
    device, scene = need_device(), Scene((displaced_sphere(2),))
    way = Way("", SIZE, workloads.rig_for(scene, 5, SIZE), "plane-rasterizer")
    expected = way.draw(Renderer(scene, "gl")).copy()
    with device, programs_in_use(device, papers_counts.CountingPrograms(device)):
        counts = device.ctx.buffer(bytes(4 * len(papers_counts.STAGES)))
        counts.bind_to_storage_buffer(papers_counts.BINDING)
        np.testing.assert_array_equal(way.draw(Renderer(scene, "gl")), expected)
        assert np.frombuffer(counts.read(), np.uint32).min() > 0
