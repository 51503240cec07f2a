"""A point cloud from NumPy arrays: surfels whose radii and normals are estimated, on a lenticular panel.

Writes: shell.png, shell.webp
"""

import numpy as np

import autostereo as aus
from autostereo.encoders.video import save_animation

# a sea shell: a tube whose radius grows along a spiral, scanned at random
rng = np.random.default_rng(1)
n = 60_000
turn = 6 * np.pi * np.sqrt(rng.random(n))
around = rng.uniform(0, 2 * np.pi, n)
size = np.exp(0.13 * (turn - 6 * np.pi))
reach = size * (1 + 0.45 * np.cos(around))
positions = np.stack([reach * np.cos(turn), 1.9 * (0.5 - size) + size * 0.45 * np.sin(around), reach * np.sin(turn)], 1)
bands = 0.5 + 0.5 * np.sin(5 * around + 3 * turn)
colors = np.outer(1 - bands, (0.95, 0.88, 0.75)) + np.outer(bands, (0.75, 0.40, 0.25))

# a number serves as the radius of all; without radii each is estimated from the neighbours, as with files
shell = aus.Points(positions, colors=colors, material=aus.Material(specular=0.4, shininess=30)).with_normals()
print(f"{len(shell):,} surfels, radii {shell.radii.min():.4f}…{shell.radii.max():.4f}")
scene = aus.Scene(shell, lights=[aus.DirectionalLight((-1, -1.5, -1))], background=(0.1, 0.1, 0.12))

display = aus.Display.lenticular(480, 360, views=8, per="subpixel")
aus.render(scene, display).save("shell.png")
rig = aus.Rig(position=(1.5, 2, 5), target=(0, -0.1, 0), fov_y=30, baseline=1.5, views=12)
save_animation("shell.webp", aus.render_views(scene, rig, size=(320, 240), options=aus.Options(samples=4)))
