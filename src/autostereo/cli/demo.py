"""autostereo demo: meshes, a volume, a point cloud and all of them together on several displays."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import common, outputs
from .common import say

if TYPE_CHECKING:
    from ..display.display import Display
    from ..display.quilt import Quilt
    from ..display.rig import Rig
    from ..frame import ViewStack
    from ..render import Renderer
    from ..scene.scene import Scene

Captions = list[tuple[str, str]]  # (file name, what it shows)

PORTRAIT = "looking-glass-portrait"
WIDE = (1280, 720)
TILE = (252, 336)  # of the quilt and the animation: large enough to look at, small enough to be quick
EYES = {"left": (-31.5, 500.0), "right": (31.5, 500.0)}  # mm to the right and in front of the panel
LENS = {"lens_pitch": 0.4266, "subpixel_pitch": 0.0805, "slant_deg": 12.0}  # about 5.4 sub-pixels a lens


@dataclass(frozen=True)
class Show:
    """One scene of the demo: its file names begin with `name`; steps are what is made of it."""

    name: str
    title: str
    text: str
    scene: Callable[[], Scene]
    steps: tuple[Callable[[Show, Renderer, Scene, Path], Captions], ...]


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the pictures.")] = Path(
        "demo"
    ),
    quiet: common.Quiet = False,
) -> None:
    """Render built-in scenes for several displays: meshes, a volume, a point cloud, and all of them together.

    The folder receives interlaced panels, what a left and a right eye would see of them, the views as looping
    animations, a quilt, and index.html, which explains them. File names begin with mesh_, volume_, points_ and mixed_.

    Examples:
      autostereo demo
      autostereo demo -o /tmp/demo
    """
    with outputs.whole_folder(output) as folder:
        from ..render import Renderer

        made: list[tuple[Show, Captions]] = []
        with common.working("rendering", total=sum(len(show.steps) for show in SHOWS)) as advance:
            for show in SHOWS:
                scene = show.scene()
                renderer, captions = Renderer(scene), Captions()
                for step in show.steps:
                    captions += step(show, renderer, scene, folder)
                    advance()
                made.append((show, captions))
        (folder / "index.html").write_text(page(made), encoding="utf-8")
    for show, captions in made:
        for name, caption in captions:
            say(f"{output / name}  {show.title}: {caption.split('. ')[0].rstrip('.')}")
    say(f"{output / 'index.html'}  all of them, explained")


# --- scenes --------------------------------------------------------------------------------------------------------
def mesh_scene() -> Scene:
    """Meshes on a floor."""
    from ..scene.shapes import demo_scene

    return demo_scene()


def volume_scene() -> Scene:
    """A machine part as computed tomography shows it."""
    from ..scene.samples import engine_part

    return _alone(engine_part(), 1.75, 40)


def points_scene() -> Scene:
    """A scanned rock of 200,000 surfels."""
    from ..scene.samples import surfel_cloud

    return _alone(surfel_cloud(), 1.9, 20)


def mixed_scene() -> Scene:
    """The floor and three of the meshes; for the rock the point cloud, for the crate the machine part."""
    from ..scene.samples import engine_part, surfel_cloud
    from ..scene.shapes import demo_scene
    from ..scene.transfer import TransferFunction
    from ..transforms import rotation, scaling, translation

    scene = demo_scene()
    floor, _, knot, globe, _, ring = scene.objects
    lean = rotation((1, 0, 0), 17)  # as demo_scene does
    rock = lean @ translation(-0.5, 0.05, -0.7) @ rotation((0, 1, 0), 20) @ scaling(1.1)
    place = lean @ translation(0.9, -0.2, 0.1) @ rotation((0, 1, 0), 32) @ scaling(1.1)
    part = engine_part()
    denser = TransferFunction(part.transfer.points * (1, 1, 1, 1, 2))  # opacity is per length, and it is smaller here
    cloud, volume = replace(surfel_cloud(), transform=rock), replace(part, transform=place, transfer=denser)
    return replace(scene, objects=(floor, knot, globe, ring, cloud, volume))


def _alone(item: Any, size: float, turn: float) -> Scene:
    """One object in the light of the mesh scene, enlarged, turned by degrees about the vertical, leaning likewise."""
    from ..scene.shapes import demo_scene
    from ..transforms import rotation, scaling, translation

    place = translation(0.05, 0.2, -0.3) @ rotation((1, 0, 0), 17) @ rotation((0, 1, 0), turn) @ scaling(size)
    return replace(demo_scene(), objects=(replace(item, transform=place),))


def choose_rig(scene: Scene, display: Display) -> Rig:
    """Cameras a little above the objects, as far apart as the display's comfort and cone allow.

    `Rig.frame` keeps everything in every view; here objects are larger, and the floor may leave the picture.
    """
    from ..display.framing import depth_budget
    from ..display.rig import Rig

    fov_y = 26.0 if display.aspect > 1 else 43.0
    place = {"position": (0.05, 1.3, 9.3), "target": (0.05, 0.15, -0.3)}
    rig = Rig(**place, fov_y=fov_y, baseline=1.0, views=display.views, aspect=display.aspect)  # type: ignore[arg-type]
    budget = depth_budget(replace(scene, objects=scene.objects[1:] or scene.objects), display, rig)
    comfortable = display.comfort / max(abs(budget.disparity_near), abs(budget.disparity_far))
    cone = 2 * rig.focal * math.tan(math.radians(display.cone_deg) / 2)
    return replace(rig, baseline=min(comfortable, cone))


# --- steps ---------------------------------------------------------------------------------------------------------
def _portrait(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    """The panel of a Looking Glass Portrait, and what two eyes see of it."""
    from ..display.display import Display
    from ..image import write_image
    from ..render import observe

    display = Display.preset(PORTRAIT)
    panel = renderer.render(display, choose_rig(scene, display))
    name = f"{show.name}_panel_{PORTRAIT}.png"
    panel.save(folder / name)
    captions = [(name, "Looking Glass Portrait, the interlaced panel. Each sub-pixel is from its own view.")]
    for side, eye in EYES.items():
        name = f"{show.name}_eye_{side}.png"
        write_image(folder / name, observe(panel, display, eye=eye))
        seen = f"what the {side} eye sees of it. Computed from that panel alone through its lenses, from half a metre."
        captions.append((name, f"Looking Glass Portrait, {seen}"))
    return captions


def _wavelength(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    from ..display.display import Display

    caption = "Wavelength-selective filter array, 8 views. The three colours of a pixel are from three views."
    return _panel(show, renderer, scene, folder, ("wavelength-selective", Display.wavelength_selective(*WIDE), caption))


def _slanted(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    from ..display.display import Display

    display = Display.slanted(*WIDE, 28, **LENS, continuous=True)  # type: ignore[arg-type]
    caption = "Slanted lenticular, continuous. Every sub-pixel has its exact angle, not one of V views."
    return _panel(show, renderer, scene, folder, ("slanted", display, caption))


def _anaglyph(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    from ..display.display import Display

    caption = "Anaglyph (Dubois). Look at it through red-cyan glasses."
    return _panel(show, renderer, scene, folder, ("anaglyph", Display.anaglyph(*WIDE), caption))


def _side_by_side(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    from ..display.display import Display

    display = Display.stereo(WIDE[0] // 2, WIDE[1] // 2)
    return _panel(show, renderer, scene, folder, ("side-by-side", display, "Side by side. For parallel free viewing."))


def _panel(
    show: Show, renderer: Renderer, scene: Scene, folder: Path, what: tuple[str, Display, str]
) -> Captions:
    """The panel of one display; what = (its name, itself, caption)."""
    kind, display, caption = what
    name = f"{show.name}_panel_{kind}.png"
    renderer.render(display, choose_rig(scene, display)).save(folder / name)
    return [(name, caption)]


def _views(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    """The views as an animation."""
    return _animation(show, _stack(renderer, scene), folder, "webp")


def _quilt(show: Show, renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    """A quilt, and the same views as animations."""
    from ..encoders.quilt import quilt_path, save_quilt

    layout, stack = _layout(), _stack(renderer, scene)
    path = save_quilt(quilt_path(folder / f"{show.name}_quilt.png", layout), stack, layout)
    return [
        (path.name, "Quilt of 48 views, the leftmost at the bottom left. A Looking Glass plays this file."),
        *_animation(show, stack, folder, "webp"),
        *_animation(show, stack, folder, "gif"),
    ]


def _layout() -> Quilt:
    from ..display.quilt import Quilt

    columns, rows = 8, 6
    return Quilt(columns, rows, columns * TILE[0], rows * TILE[1], TILE[0] / TILE[1])


def _stack(renderer: Renderer, scene: Scene) -> ViewStack:
    """The 48 views of a Portrait, small."""
    from ..display.display import Display

    return renderer.render_views(choose_rig(scene, replace(Display.preset(PORTRAIT), quilt=_layout())), TILE)


def _animation(show: Show, stack: ViewStack, folder: Path, suffix: str) -> Captions:
    from ..encoders.video import save_animation
    from ..frame import ViewStack

    name = f"{show.name}_views.{suffix}"
    save_animation(folder / name, ViewStack(stack.color[::2]))
    what = "The views one after the other, there and back. What moving the head shows."
    return [(name, what if suffix == "webp" else "The same as a GIF.")]


SHOWS = (
    Show(
        "mesh",
        "Meshes",
        "Textures, vertex colours, highlights and two lights.",
        mesh_scene,
        (_portrait, _wavelength, _slanted, _anaglyph, _side_by_side, _quilt),
    ),
    Show(
        "volume",
        "Volume",
        "A machine part as computed tomography would show it. Light metal becomes a haze, steel solid.",
        volume_scene,
        (_portrait, _wavelength, _views),
    ),
    Show(
        "points",
        "Point cloud",
        "A rock of 200,000 surfels, as a scanner on a turntable would take them.",
        points_scene,
        (_portrait, _wavelength, _views),
    ),
    Show(
        "mixed",
        "Meshes, points and a volume",
        "One scene: every view shows the right thing in front, and what stands behind the volume through it.",
        mixed_scene,
        (_portrait, _anaglyph, _views),
    ),
)

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>autostereo demo</title>
<style>
  body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; }}
  figure {{ margin: 2rem 0; }}
  img {{ max-width: 100%; max-height: 80vh; }}
</style>
<h1>autostereo demo</h1>
<p>Four scenes, rendered for several glasses-free 3D displays, every picture in a single pass. Interlaced panels look
scrambled on a normal screen: show them on their display at one pixel per pixel, full screen.</p>
{shows}
</html>
"""


def page(made: list[tuple[Show, Captions]]) -> str:
    """Return the HTML page that shows and explains the pictures."""
    lines = []
    for show, captions in made:
        lines.append(f"<h2>{escape(show.title)}</h2>\n<p>{escape(show.text)}</p>")
        lines += [
            f'<figure><a href="{escape(name)}"><img src="{escape(name)}" alt="{escape(caption)}" loading="lazy"></a>'
            f"<figcaption>{escape(caption)} <code>{escape(name)}</code></figcaption></figure>"
            for name, caption in captions
        ]
    return PAGE.format(shows="\n".join(lines))
