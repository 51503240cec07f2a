"""A picture with depth (RGBD), from a depth camera or a renderer, to the views of a display and its panel.

Writes: rgbd.png, rgbd.webp
"""

import numpy as np

import autostereo as aus
from autostereo.encoders.video import save_animation
from autostereo.scene import shapes

# a stand-in for a camera's two arrays: colour (H, W, 4) uint8, and depth (H, W) along its axis, inf where there is none
ball = shapes.displaced_sphere(5)
scene = aus.Scene(ball, background=(0.15, 0.15, 0.2))
rig = aus.Rig(position=(0, 0.6, 4.5), fov_y=32, baseline=0.5, views=8, focal_distance=4.2)
taken = aus.render_views(scene, rig.with_views(1), size=(480, 360), options=aus.Options(depth=True))
color, depth = taken.color[0], taken.depth[0]
print(f"{np.isfinite(depth).mean():.0%} of the picture has a depth, {depth.min():.2f} and more")

# the other views are warped from it; what it did not see is guessed from what lies behind
display = aus.Display.lenticular(480, 360, views=8, per="subpixel")
views = aus.warp(aus.ViewStack(color[None], depth[None]), rig)
aus.interlace(views, display).save("rgbd.png")
save_animation("rgbd.webp", views)
