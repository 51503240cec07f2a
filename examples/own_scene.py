"""A scene from NumPy arrays: a wave with colours, a light and a highlight, as a quilt for any Looking Glass.

Writes: wave_qs4x3a0.75.png
"""

import numpy as np

import autostereo as aus
from autostereo.display.quilt import Quilt
from autostereo.encoders.quilt import quilt_path, save_quilt

# a grid of 80 × 80 points, two triangles a cell, counter-clockwise seen from the front (+z)
n = 80
y, x = np.mgrid[-1 : 1 : n * 1j, -1 : 1 : n * 1j]
height = 0.3 * np.cos(9 * np.hypot(x, y)) * np.exp(-np.hypot(x, y))
vertices = np.stack([x, y, height], axis=-1).reshape(-1, 3)
colors = np.stack([0.5 + height, 0.6 + 0 * x, 0.9 - height], axis=-1).reshape(-1, 3)
corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
faces = np.stack([corner, corner + 1, corner + n + 1, corner, corner + n + 1, corner + n], axis=1).reshape(-1, 3)

shiny = aus.Material(specular=0.4, shininess=50)
wave = aus.Mesh(vertices, faces, colors=colors.clip(0, 1), material=shiny)
scene = aus.Scene(wave, lights=[aus.DirectionalLight((-1, -1, -2))], background=(0.1, 0.1, 0.12))

layout = Quilt(columns=4, rows=3, width=480, height=480, aspect=0.75)
rig = aus.Rig(position=(0, 0, 5), fov_y=28, baseline=1.0, views=layout.views, aspect=layout.aspect)
views = aus.render_views(scene, rig, size=layout.tile)
print(save_quilt(quilt_path("wave.png", layout), views, layout))
