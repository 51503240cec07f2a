"""Peer A: a bare moderngl loop that renders the V views one after another, in two variants.

Both have one indexed vertex buffer, matrices computed beforehand, one uniform and one draw a view, and no read-back.

``tuned``
    As far as we could get it: back-face culling where the mesh is closed, and views alternate between two framebuffers,
    so that a software GL transforms the next view while it rasterises this one (15 to 20 % faster on llvmpipe).
``plain``
    What a program has that does not think of either: one framebuffer, and all faces are drawn.

Lighting follows the material in the vertex shader (Gouraud) or in the fragment shader (Blinn–Phong); the highlight is
compiled in only if the material has one.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...display.rig import Rig
from ...errors import DependencyError
from ...scene.appearance import Material
from ...scene.mesh import Mesh
from ...scene.scene import Scene
from .workloads import Size, clip_from_world, eyes, the_mesh, world_arrays

_LIGHT = """
uniform vec3 to_light;
uniform vec3 eye;
vec3 lit(vec3 kd, vec3 normal, vec3 position) {
    vec3 n = normalize(normal);
    vec3 c = kd * (AMBIENT + DIFFUSE * max(dot(n, to_light), 0.0));
#ifdef SPECULAR
    vec3 h = normalize(to_light + normalize(eye - position));
    c += SPECULAR * pow(max(dot(n, h), 0.0), SHININESS);
#endif
    return c;
}
"""

_VERTEX_LIT_VERTEX = """
uniform mat4 clip_from_world;
in vec3 position; in vec3 normal; in vec3 kd;
out vec3 front;
#ifdef TWO_SIDED
out vec3 back;
#endif
void main() {
    gl_Position = clip_from_world * vec4(position, 1.0);
    front = lit(kd, normal, position);
#ifdef TWO_SIDED
    back = lit(kd, -normal, position);
#endif
}
"""

_VERTEX_LIT_FRAGMENT = """
in vec3 front;
#ifdef TWO_SIDED
in vec3 back;
#endif
out vec4 color;
void main() {
#ifdef TWO_SIDED
    color = vec4(gl_FrontFacing ? front : back, 1.0);
#else
    color = vec4(front, 1.0);
#endif
}
"""

_SAMPLE_LIT_VERTEX = """
uniform mat4 clip_from_world;
in vec3 position; in vec3 normal; in vec3 kd;
out vec3 world_normal; out vec3 world_kd;
#ifdef SPECULAR
out vec3 world_position;
#endif
void main() {
    gl_Position = clip_from_world * vec4(position, 1.0);
    world_normal = normal;
    world_kd = kd;
#ifdef SPECULAR
    world_position = position;
#endif
}
"""

_SAMPLE_LIT_FRAGMENT = """
in vec3 world_normal; in vec3 world_kd;
#ifdef SPECULAR
in vec3 world_position;
#else
const vec3 world_position = vec3(0.0);
#endif
out vec4 color;
void main() {
#ifdef TWO_SIDED
    color = vec4(lit(world_kd, gl_FrontFacing ? world_normal : -world_normal, world_position), 1.0);
#else
    color = vec4(lit(world_kd, world_normal, world_position), 1.0);
#endif
}
"""


@cache
def shared_context() -> Any:
    """Standalone EGL context, one per process: releasing one would end the EGL display of all others too.

    Raises
    ------
    DependencyError
        moderngl or a headless OpenGL 3.3 is missing.
    """
    try:
        import moderngl
    except ImportError:
        raise DependencyError("moderngl is not installed (pip install autostereo[bench])") from None
    try:
        return moderngl.create_context(standalone=True, require=330, backend="egl")  # type: ignore[arg-type]
    except Exception as error:
        raise DependencyError(f"moderngl finds no headless OpenGL 3.3 through EGL ({error})") from None


class ModernGLLoop:
    """V passes over one mesh.

    Parameters
    ----------
    context : moderngl.Context
    scene : Scene
        One mesh, no texture, the default light.
    rig : Rig
    size : (int, int)
        Width and height of one view in pixels.
    lighting : {"vertex", "sample"}
    plain : bool
        The variant.
    """

    name = "moderngl"

    def __init__(
        self, context: Any, scene: Scene, rig: Rig, size: Size, lighting: str, plain: bool = False
    ) -> None:
        mesh = the_mesh(scene)
        self._context = context
        self._size = size
        self._background = (*scene.background, 0.0)
        with context:
            self._program = context.program(
                vertex_shader=_source(_VERTEX_LIT_VERTEX, _SAMPLE_LIT_VERTEX, lighting, mesh),
                fragment_shader=_source(_VERTEX_LIT_FRAGMENT, _SAMPLE_LIT_FRAGMENT, lighting, mesh),
            )
            self._vertices = context.buffer(np.hstack(world_arrays(scene)).astype("f4").tobytes())
            self._faces = context.buffer(mesh.faces.astype("i4").tobytes())
            content = [(self._vertices, "3f4 3f4 3f4", "position", "normal", "kd")]
            self._mesh = context.vertex_array(self._program, content, index_buffer=self._faces)
            self._targets = [
                context.framebuffer([context.renderbuffer(size, 4)], context.depth_renderbuffer(size))
                for _ in range(1 if plain else 2)
            ]
            self._program["to_light"].write((-rig.eye_from_world[2, :3]).astype("f4").tobytes())
        self._matrix, self._eye = self._program["clip_from_world"], self._program.get("eye", None)
        # moderngl and GLSL store matrices by columns
        self._matrices = [m.T.astype("f4").tobytes() for m in clip_from_world(rig, size)]
        # vertices are lit for the centre eye, so that all views show the same colours
        lit_for = eyes(rig) if lighting == "sample" else np.broadcast_to(rig.position, (rig.views, 3))
        self._eyes = [eye.astype("f4").tobytes() for eye in lit_for]
        self._all_faces = plain or mesh.two_sided

    def enter(self) -> None:
        """Make this loop's context and state current."""
        context = self._context
        context.__enter__()
        context.enable_only(context.DEPTH_TEST if self._all_faces else context.DEPTH_TEST | context.CULL_FACE)

    def frame(self) -> None:
        """Draw every view once."""
        for view in range(len(self._matrices)):
            self._draw(view)

    def _draw(self, view: int) -> Any:
        target = self._targets[view % len(self._targets)]
        target.use()
        target.clear(*self._background)
        self._matrix.write(self._matrices[view])
        if self._eye is not None:
            self._eye.write(self._eyes[view])
        self._mesh.render()
        return target

    def finish(self) -> None:
        """Wait until everything is drawn."""
        self._context.finish()

    def picture(self, view: int) -> NDArray[np.uint8]:
        """Draw one view and read it back, (H, W, 3) uint8, rows from the top. For checks, not for timing."""
        self.enter()
        pixels = np.frombuffer(self._draw(view).read(components=3, alignment=1), dtype=np.uint8)
        return pixels.reshape(self._size[1], self._size[0], 3)[::-1].copy()

    def release(self) -> None:
        """Free the buffers of this loop; the context stays."""
        with self._context:
            for item in (self._mesh, self._vertices, self._faces, self._program, *self._targets):
                item.release()


def _source(vertex_lit: str, sample_lit: str, lighting: str, mesh: Mesh) -> str:
    """Complete a shader with the constants of the material; the stage that lights gets the lighting function."""
    material = mesh.material or Material()
    defines = {"AMBIENT": material.ambient, "DIFFUSE": material.diffuse}
    if material.specular > 0:
        defines |= {"SPECULAR": material.specular, "SHININESS": material.shininess}
    head = ["#version 330 core", *(f"#define {name} {value:.9f}" for name, value in defines.items())]
    if mesh.two_sided:
        head.append("#define TWO_SIDED")
    body = vertex_lit if lighting == "vertex" else sample_lit
    return "\n".join(head) + (_LIGHT if "lit(" in body else "") + body
