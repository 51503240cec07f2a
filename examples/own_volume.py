"""A volume from a NumPy array: classified by a transfer function, cut open, as a surface, and with a mesh inside.

Writes: cloud.png, surface.png, mixed.png, cloud.json
"""

from dataclasses import replace

import numpy as np

import autostereo as aus
from autostereo.scene.shapes import torus
from autostereo.transforms import rotation

# values (nz, ny, nx): the sum of five bells; voxels may be longer along one axis, as slices of a scanner often are
z, y, x = np.meshgrid(np.linspace(-1, 1, 40), *[np.linspace(-1, 1, 64)] * 2, indexing="ij")
centers = np.array([(0, 0, 0), (0.5, 0.3, 0.2), (-0.5, 0.3, -0.1), (0.3, -0.5, 0.3), (-0.3, -0.4, -0.3)])
values = sum(np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / 0.08) for a, b, c in centers)
spacing = (2 / 63, 2 / 63, 2 / 39)

# rows of value, r, g, b, opacity: what a unit of length takes from the light; piecewise linear in between
transfer = aus.TransferFunction(
    [(0.1, 0.2, 0.4, 0.9, 0), (0.25, 0.2, 0.5, 0.9, 2), (0.6, 0.9, 0.6, 0.3, 6), (1, 1, 0.9, 0.7, 40)]
)
transfer.save("cloud.json")  # for autostereo render … --transfer cloud.json
shiny = aus.Material(specular=0.3)
cloud = aus.Volume(values.astype(np.float32), spacing, origin=(-1, -1, -1), transfer=transfer, material=shiny)

display = aus.Display.wavelength_selective(320, 320)
sun = aus.DirectionalLight((-1, -1, -2))
cut = replace(cloud, clip_plane=(0, 0, -1, 0.2))  # keeps 0.2 − z ≥ 0
aus.render(aus.Scene(cut, lights=[sun]), display).save("cloud.png")
surface = replace(cloud, mode="iso", iso=0.4)
aus.render(aus.Scene(surface, lights=[sun]), display).save("surface.png")

# opaque things end the rays: haze is seen in front of the ring, not what is behind it
ring = replace(torus(0.6, 0.08), transform=rotation((1, 0, 0), 55))
aus.render(aus.Scene([cloud, ring], lights=[sun], background=(0.1, 0.1, 0.12)), display).save("mixed.png")
