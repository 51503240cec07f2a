"""Several frames of one scene: a Renderer keeps what does not change, so each frame costs only its drawing.

Writes: views.webp, frame_0.png, frame_1.png, frame_2.png
"""

from dataclasses import replace

import autostereo as aus
from autostereo.encoders.video import save_animation
from autostereo.scene.shapes import demo_scene

scene = demo_scene()
renderer = aus.Renderer(scene)
display = aus.Display.wavelength_selective(320, 240)
rig = aus.Rig.frame(scene, display)

# the cameras come closer; arrays are valid until the next frame, so save or copy them
for k, z in enumerate((1.0, 0.9, 0.8)):
    closer = tuple(t + z * (p - t) for p, t in zip(rig.position, rig.target, strict=True))
    renderer.render(display, replace(rig, position=closer)).save(f"frame_{k}.png")

# the single views as a looping animation, to look at on a normal screen
views = renderer.render_views(replace(rig, views=12, offsets=None), size=(320, 240))
save_animation("views.webp", views)
