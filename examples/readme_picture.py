"""The picture of the README: a cut of a panel, and what the two eyes see of the whole.

Writes: readme.png
"""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import autostereo as aus
from autostereo.scene.shapes import demo_scene

display = aus.Display.preset("looking-glass-portrait")
panel = aus.render(demo_scene(), display)
left, right = (aus.observe(panel, display, view=zone) for zone in (14.0, 33.0))

tile = (330, 440)
cut = Image.fromarray(panel.pixels[1000:1048, 500:536]).resize(tile, Image.Resampling.NEAREST)
pictures = [Image.fromarray(panel.pixels).resize(tile), cut]
pictures += [Image.fromarray(eye).resize(tile) for eye in (left, right)]
titles = ["one pass: the panel", "36×48 of its pixels", "seen by the left eye", "seen by the right eye"]

page = Image.new("RGB", (4 * tile[0] + 30, tile[1] + 28), "white")
pen, font = ImageDraw.Draw(page), ImageFont.load_default(size=17)
for k, (picture, title) in enumerate(zip(pictures, titles, strict=True)):
    page.paste(picture, (k * (tile[0] + 10), 0))
    pen.text((k * (tile[0] + 10) + tile[0] / 2, tile[1] + 15), title, fill="black", font=font, anchor="mm")
page.quantize(256, dither=Image.Dither.NONE).save("readme.png", optimize=True)
print("left and right eye differ by", np.abs(left.astype(int) - right).mean().round(2), "levels on average")
