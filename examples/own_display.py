"""Displays of your own: a lens sheet by its measures, any mask as a table, and what the eyes see.

Writes: lens.png, table.png, left.png, right.png
"""

import numpy as np

import autostereo as aus
from autostereo.image import write_image
from autostereo.scene.shapes import demo_scene

scene = demo_scene()

# a slanted lens sheet, all measures in millimetres; continuous: every sub-pixel has its own camera
sheet = aus.Display.slanted(
    640, 360, views=28, lens_pitch=0.4266, subpixel_pitch=0.0805, slant_deg=12.0, continuous=True
).physical(size_mm=(154.6, 86.9), distance_mm=600, cone_deg=20)
panel = aus.render(scene, sheet)
panel.save("lens.png")

# two eyes 63 mm apart, 600 mm in front of it; some light leaks in from neighbouring sub-pixels
for name, x in (("left", -31.5), ("right", 31.5)):
    write_image(f"{name}.png", aus.observe(panel, sheet, eye=(x, 600), crosstalk=0.1))

# any other panel: a table of view indices (rows, columns, channels), repeated over the panel
barrier = np.array([[[0, 1, 2], [3, 4, 0], [1, 2, 3], [4, 0, 1], [2, 3, 4]]])
aus.render(scene, aus.Display.from_table(640, 360, views=5, table=barrier)).save("table.png")
