"""autostereo demo: the built-in scene on several displays."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from . import common
from .common import say

if TYPE_CHECKING:
    from ..display.display import Display
    from ..display.rig import Rig
    from ..render import Renderer
    from ..scene.scene import Scene

Captions = list[tuple[str, str]]  # (file name, what it shows)

PORTRAIT = "looking-glass-portrait"
WIDE = (1280, 720)
TILE = (252, 336)  # of the quilt and the animation: large enough to look at, small enough to be quick
EYES = {"left": (-31.5, 500.0), "right": (31.5, 500.0)}  # mm to the right and in front of the panel


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the pictures.")] = Path(
        "demo"
    ),
    quiet: common.Quiet = False,
) -> None:
    """Render the built-in scene for several displays.

    The folder receives interlaced panels, a quilt, the views as a looping animation, what a left and a right eye
    would see of a panel, and index.html, which explains them.

    Examples:
      autostereo demo
      autostereo demo -o /tmp/demo
    """
    with common.whole_folder(output) as folder:
        common.announce_compilation("cpu", "draw_views", "draw_panel")
        from ..render import Renderer
        from ..scene.shapes import demo_scene

        scene = demo_scene()
        renderer = Renderer(scene)
        captions: Captions = []
        with common.working("rendering", total=len(STEPS)) as advance:
            for step in STEPS:
                captions += step(renderer, scene, folder)
                advance()
        (folder / "index.html").write_text(page(captions), encoding="utf-8")
    for name, caption in captions:
        say(f"{output / name}  {caption.split('. ')[0].rstrip('.')}")
    say(f"{output / 'index.html'}  all of them, explained")


def choose_rig(scene: Scene, display: Display) -> Rig:
    """Cameras a little above the objects, as far apart as the display's comfort and cone allow.

    `Rig.frame` keeps everything in every view; here objects are larger, and the floor may leave the picture.
    """
    from ..display.framing import depth_budget
    from ..display.rig import Rig

    fov_y = 26.0 if display.aspect > 1 else 43.0
    place = {"position": (0.05, 1.3, 9.3), "target": (0.05, 0.15, -0.3)}
    rig = Rig(**place, fov_y=fov_y, baseline=1.0, views=display.views, aspect=display.aspect)  # type: ignore[arg-type]
    budget = depth_budget(replace(scene, objects=scene.objects[1:]), display, rig)
    comfortable = display.comfort / max(abs(budget.disparity_near), abs(budget.disparity_far))
    cone = 2 * rig.focal * math.tan(math.radians(display.cone_deg) / 2)
    return replace(rig, baseline=min(comfortable, cone))


def _portrait(renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    """The panel of a Looking Glass Portrait, and what two eyes see of it."""
    from ..display.display import Display
    from ..image import write_image
    from ..render import observe

    display = Display.preset(PORTRAIT)
    panel = renderer.render(display, choose_rig(scene, display))
    panel.save(folder / f"panel_{PORTRAIT}.png")
    for name, eye in EYES.items():
        write_image(folder / f"eye_{name}.png", observe(panel, display, eye=eye))
    seen = "what the {} eye sees of it. Computed from that panel alone through its lenses, from half a metre away"
    return [
        (f"panel_{PORTRAIT}.png", "Looking Glass Portrait, the interlaced panel. Each sub-pixel is from its own view."),
        ("eye_left.png", f"Looking Glass Portrait, {seen.format('left')}."),
        ("eye_right.png", f"Looking Glass Portrait, {seen.format('right')}."),
    ]


def _panels(renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    """Panels of three other kinds."""
    from ..display.display import Display

    lens = {"lens_pitch": 0.4266, "subpixel_pitch": 0.0805, "slant_deg": 12.0}  # about 5.4 sub-pixels a lens
    displays = [
        ("wavelength-selective", Display.wavelength_selective(*WIDE), "Wavelength-selective filter array, 8 views."),
        (
            "slanted",
            Display.slanted(*WIDE, 28, **lens, continuous=True),  # type: ignore[arg-type]
            "Slanted lenticular, continuous. Every sub-pixel has its exact angle, not one of V views.",
        ),
        ("anaglyph", Display.anaglyph(*WIDE), "Anaglyph (Dubois). Look at it through red-cyan glasses."),
        ("side-by-side", Display.stereo(WIDE[0] // 2, WIDE[1] // 2), "Side by side. For parallel free viewing."),
    ]
    captions: Captions = []
    for name, display, caption in displays:
        renderer.render(display, choose_rig(scene, display)).save(folder / f"panel_{name}.png")
        captions.append((f"panel_{name}.png", caption))
    return captions


def _views(renderer: Renderer, scene: Scene, folder: Path) -> Captions:
    """A quilt, and the same views as an animation."""
    from ..display.display import Display
    from ..display.quilt import Quilt
    from ..encoders.quilt import quilt_path, save_quilt
    from ..encoders.video import save_animation
    from ..frame import ViewStack

    columns, rows = 8, 6
    layout = Quilt(columns, rows, columns * TILE[0], rows * TILE[1], TILE[0] / TILE[1])
    rig = choose_rig(scene, replace(Display.preset(PORTRAIT), quilt=layout))
    stack = renderer.render_views(rig, TILE)
    path = save_quilt(quilt_path(folder / "quilt.png", layout), stack, layout)
    for suffix in ("webp", "gif"):
        save_animation(folder / f"views.{suffix}", ViewStack(stack.color[::2]))
    return [
        (path.name, "Quilt of 48 views, the leftmost at the bottom left. A Looking Glass plays this file."),
        ("views.webp", "The views one after the other, there and back. What moving the head shows."),
        ("views.gif", "The same as a GIF."),
    ]


STEPS: tuple[Callable[[Renderer, Scene, Path], Captions], ...] = (_portrait, _panels, _views)

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
<p>One scene, rendered for several glasses-free 3D displays, every picture in a single pass. Interlaced panels look
scrambled on a normal screen: show them on their display at one pixel per pixel, full screen.</p>
{figures}
</html>
"""


def page(captions: Captions) -> str:
    """Return the HTML page that shows and explains the pictures."""
    figures = [
        f'<figure><a href="{escape(name)}"><img src="{escape(name)}" alt="{escape(caption)}" loading="lazy"></a>'
        f"<figcaption>{escape(caption)} <code>{escape(name)}</code></figcaption></figure>"
        for name, caption in captions
    ]
    return PAGE.format(figures="\n".join(figures))
