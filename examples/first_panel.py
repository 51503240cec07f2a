"""The picture for a Looking Glass Portrait: load, choose the display, render, save.

Takes a mesh file as its argument; without one it renders the built-in scene.
Writes: panel.png
"""

import sys

import autostereo as aus
from autostereo.scene.shapes import demo_scene

scene = aus.load(*sys.argv[1:]) if len(sys.argv) > 1 else demo_scene()
display = aus.Display.preset("looking-glass-portrait").resized(384, 512)  # leave .resized out for the real panel
panel = aus.render(scene, display)
panel.save("panel.png")
print(f"{panel.width}×{panel.height} px, {display.views} views in one pass")
