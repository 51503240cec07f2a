// A mesh's vertices in eye space, shared by all views that a geometry shader makes of them.
#include "lib/frame.glsl"
#include "lib/shading.glsl"
#include "lib/surface.glsl"

in vec3 position;        // local
in vec3 normal;          // world directions
in vec3 color;
#ifdef TEXTURED
in vec2 uv;
#else
const vec2 uv = vec2(0.0);
#endif

out Vertex {
    Surface surface;
} vertex;

void main() {
    vec3 point = (eye_from_local * vec4(position, 1.0)).xyz;
    vertex.surface = surface_at(point, mat3(eye_from_local) * normal, color, uv);
    gl_Position = vec4(point, 1.0);
}
