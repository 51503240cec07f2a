// A mesh's vertices in the tiles of views. Every instance is one more view: N-pass draws one, instancing all.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/surface.glsl"

uniform int first_view;  // tile of the first instance

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
flat out float camera_offset;

void main() {
    vec4 view = views[first_view + gl_InstanceID];
    vec3 point = (eye_from_local * vec4(position, 1.0)).xyz;
    vertex.surface = surface_at(point, mat3(eye_from_local) * normal, color, uv);
    camera_offset = view.x;
    vec4 sides;
    gl_Position = clip_in_tile(point, view, sides);
    gl_ClipDistance[0] = sides.x;
    gl_ClipDistance[1] = sides.y;
    gl_ClipDistance[2] = sides.z;
    gl_ClipDistance[3] = sides.w;
}
