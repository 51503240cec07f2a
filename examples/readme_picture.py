"""The picture of the README: a cut of a panel, and what the two eyes see of the whole.

Writes: readme.png
"""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import autostereo as aus
from autostereo.cli.demo import mixed_scene

display = aus.Display.preset("looking-glass-portrait")
rig = aus.Rig(position=(0.05, 1.3, 9.3), target=(0.05, 0.15, -0.3), fov_y=43, baseline=4)
panel = aus.render(mixed_scene(), display, rig)
left, right = (aus.observe(panel, display, eye=(x, 500)) for x in (-31.5, 31.5))  # mm from the panel's centre

tile = (240, 320)
cut = Image.fromarray(panel.pixels[800:832, 1080:1104]).resize(tile, Image.Resampling.NEAREST)
pictures = [Image.fromarray(panel.pixels).resize(tile), cut]
pictures += [Image.fromarray(eye).resize(tile) for eye in (left, right)]
titles = ["one pass: the panel", "24 x 32 of its pixels", "seen by the left eye", "seen by the right eye"]

page = Image.new("RGB", (4 * tile[0] + 30, tile[1] + 28), "white")
pen, font = ImageDraw.Draw(page), ImageFont.load_default(size=15)
for k, (picture, title) in enumerate(zip(pictures, titles, strict=True)):
    page.paste(picture, (k * (tile[0] + 10), 0))
    pen.text((k * (tile[0] + 10) + tile[0] / 2, tile[1] + 15), title, fill="black", font=font, anchor="mm")
page.save("readme.png", optimize=True)
print("left and right eye differ by", np.abs(left.astype(int) - right).mean().round(2), "levels on average")
