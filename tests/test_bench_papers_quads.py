"""``bench papers focal-plane-quads``: the fragments that covering quads generate, counted by the shaders that draw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from autostereo.cli.benchmarks import papers_quads
from autostereo.cli.benchmarks.papers_studio import PapersStudio, Way, programs_in_use
from autostereo.cli.benchmarks.suite import BenchOptions
from autostereo.display.display import Display
from autostereo.display.rig import Rig
from autostereo.engines.options import Options
from autostereo.errors import UnsupportedError
from autostereo.render import Renderer
from autostereo.scene.mesh import Mesh
from autostereo.scene.points import Points
from autostereo.scene.scene import Scene
from autostereo.scene.shapes import displaced_sphere
from gl_device import need_device

SIZE = WIDTH, HEIGHT = 192, 128
RIG = Rig(position=(0, 0, 4), target=(0, 0, 0), fov_y=40.0, baseline=0.6, views=8)
PANEL = Display.wavelength_selective(*SIZE)
PER_SLOPE = HEIGHT / 2 / np.tan(np.radians(20))  # pixels: fx and fy
DEPTHS = np.array([3.0, 4.0, 6.0])
PLACES = np.array([[-0.11, 0.23], [0.07, 0.01], [0.2, -0.31]]) * DEPTHS[:, None] / 4
FOCI = (2.0, *DEPTHS, 12.0)


def quads(focal):
    """A panel's covering quads with the focal plane at a distance."""
    return Way("", PANEL, replace(RIG, focal_distance=focal), "covering-quad")


def slide(focal, depth):
    """Hübner 2007b, section 3.2: how far in pixels a point's projections lie apart, over all cameras."""
    return PER_SLOPE * RIG.baseline * np.abs(1 / focal - 1 / depth)


def upright(corners):
    """Triangles (3, 2) parallel to the picture, at DEPTHS: as a mesh, and their corners in pixels from the middle."""
    flat = np.concatenate([corners, np.broadcast_to((4 - DEPTHS)[:, None, None], (3, 3, 1))], axis=2)
    return Mesh(flat.reshape(-1, 3), np.arange(9).reshape(3, 3)), PER_SLOPE * corners / DEPTHS[:, None, None]


TRIANGLES, PIXELS = upright(PLACES[:, None] + np.array([[-0.13, -0.11], [0.17, -0.07], [0.03, 0.15]]))


@pytest.mark.parametrize("focal", FOCI)
def test_quads_of_triangles_grow_with_the_distance_from_the_focal_plane(focal):
    """Whole rows and columns that the projections of all cameras touch."""
    need_device()
    counts = papers_quads.fragments(Renderer(Scene((TRIANGLES,)), "gl"), quads(focal), 3)
    rows = np.ceil(PIXELS[..., 1].max(axis=1)) - np.floor(PIXELS[..., 1].min(axis=1))
    columns = counts / rows
    assert (columns == np.round(columns)).all()
    reached = np.ptp(PIXELS[..., 0], axis=1) + slide(focal, DEPTHS)
    assert (reached <= columns).all() and (columns < reached + 2).all()


@pytest.mark.parametrize(("place", "depth"), list(zip(PLACES, DEPTHS, strict=True)), ids=["near", "middle", "far"])
def test_quads_of_surfels_grow_with_the_distance_from_the_focal_plane(place, depth):
    """Rows and columns whose middles the projections of all cameras touch."""
    need_device()
    radius = 0.15
    renderer = Renderer(Scene((Points([[*place, 4 - depth]], radii=radius),)), "gl")
    y, half = PER_SLOPE * place[1] / depth, PER_SLOPE * radius / depth
    rows = np.floor(half - y - 0.5) - np.ceil(-half - y - 0.5) + 1
    for focal in FOCI:
        (count,) = papers_quads.fragments(renderer, quads(focal), 1)
        assert count % rows == 0
        assert abs(count / rows - 2 * half - slide(focal, depth)) <= 1


def test_a_single_view_generates_the_fragments_of_its_triangles():
    need_device()
    renderer = Renderer(Scene((TRIANGLES,)), "gl")
    counts = papers_quads.fragments(renderer, Way("", SIZE, RIG.with_views(1), "n-pass"), 3)
    (ax, ay), (bx, by) = (PIXELS[:, k].T - PIXELS[:, 0].T for k in (1, 2))
    areas, around = (ax * by - ay * bx) / 2, np.linalg.norm(np.roll(PIXELS, 1, axis=1) - PIXELS, axis=2).sum(axis=1)
    assert (np.abs(counts - areas) < around / 2).all()
    one = Way("", papers_quads.one_view(SIZE), RIG.with_views(1), "covering-quad")
    boxes = papers_quads.fragments(renderer, one, 3)
    assert (boxes > counts).all() and (boxes <= papers_quads.fragments(renderer, quads(4.0), 3)).all()


@pytest.mark.parametrize("way", [quads(4.0), Way("", SIZE, RIG.with_views(1), "n-pass")], ids=["quads", "triangles"])
def test_hidden_fragments_are_counted_and_those_outside_are_not(way):
    """A wall that is drawn first, in front of all and larger than the picture."""
    need_device()
    wall = np.array([[-90, -90, 1.5], [90, -90, 1.5], [0, 90, 1.5]])
    both = Mesh(np.concatenate([wall, TRIANGLES.vertices]), np.arange(12).reshape(4, 3))
    alone = papers_quads.fragments(Renderer(Scene((TRIANGLES,)), "gl"), way, 3)
    behind = papers_quads.fragments(Renderer(Scene((both,)), "gl"), way, 4)
    assert behind[0] == WIDTH * HEIGHT and (behind[1:] == alone).all() and alone.min() > 0


@pytest.mark.parametrize("alpha", ["exact", "minimal"])
def test_shaders_that_count_draw_the_same_picture(alpha):
    """A quad a channel or one for three: each triangle's is counted once."""
    device, options, scene = need_device(), Options(alpha=alpha), Scene((displaced_sphere(2),))
    way = replace(quads(3.0), options=options)
    usual = device.programs
    expected = way.draw(Renderer(scene, "gl")).copy()
    counts = papers_quads.fragments(renderer := Renderer(scene, "gl"), way, 320)
    assert device.programs is usual
    with device, programs_in_use(device, papers_quads.programs_of(device)):
        held = device.ctx.buffer(bytes(4 * 320))
        held.bind_to_storage_buffer(papers_quads.BINDING)
        np.testing.assert_array_equal(way.draw(renderer), expected)
    plain = papers_quads.fragments(renderer, replace(way, options=Options()), 320)
    np.testing.assert_array_equal(counts, plain)


# --- the work --------------------------------------------------------------------------------------------------------


def figures(name):
    studio = PapersStudio(BenchOptions(quick=True, repeats=1, shrink=8), lambda line: None)
    return {f.measure: f for f in papers_quads.focal_plane(studio, name, "")}


@pytest.mark.parametrize(("name", "near"), [("triangles", (0.75, 1.0)), ("surfels", (1.0,))])
def test_fragments_a_quad_are_least_in_focus_and_more_the_farther_it_is(name, near):
    """Triangles that face away generate none, and those of a sphere's front lie from 0.75 of the distance on."""
    need_device()
    found = figures(name)
    ways = [papers_quads.called(focus) for focus in papers_quads.FOCI]
    counts = [found[f"fragments a quad, {way}"].value for way in ways]
    least = int(np.argmin(counts))
    assert papers_quads.FOCI[least] in near
    assert (np.diff(counts[: least + 1]) < 0).all() and (np.diff(counts[least:]) > 0).all()
    assert 0 < found["fragments a quad, quads of one view"].value < counts[least]
    if name == "triangles":
        assert 0 < found["fragments a triangle, SV"].value < found["fragments a quad, quads of one view"].value
    for way in ways:
        assert found[way].unit == found[f"{way}, cpu engine"].unit == "fps"
        assert way == "in focus" or found[f"{way} / in focus"].value > 0


def test_what_cannot_be_counted_says_why(monkeypatch):
    need_device()

    def refuse(renderer, way, count):
        raise UnsupportedError("no")

    monkeypatch.setattr(papers_quads, "fragments", refuse)
    counted = [f for measure, f in figures("triangles").items() if measure.startswith("fragments")]
    assert len(counted) == 8 and all(f.note.startswith("not available: no; data: stand-in") for f in counted)
