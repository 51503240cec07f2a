// Stage 0 of the plane rasteriser: a mesh's vertices in eye space, once for all views.
#define POINTS
#include "lib/frame.glsl"
#include "lib/shading.glsl"
#include "lib/surface.glsl"
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_surface.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = 1) readonly buffer Vertices { float vertices[]; };
uniform int count;

const int SIZE =
#ifdef TEXTURED
    11;
#else
    9;
#endif

void main() {
    int k = int(invocation());
    if (k >= count) {
        return;
    }
    int at = k * SIZE;
    vec3 position = vec3(vertices[at], vertices[at + 1], vertices[at + 2]);
    vec3 normal = vec3(vertices[at + 3], vertices[at + 4], vertices[at + 5]);
    vec3 color = vec3(vertices[at + 6], vertices[at + 7], vertices[at + 8]);
    vec2 uv = vec2(0.0);
#ifdef TEXTURED
    uv = vec2(vertices[at + 9], vertices[at + 10]);
#endif
    vec3 point = (eye_from_local * vec4(position, 1.0)).xyz;
    imageStore(points, place_of(uint(k)), vec4(point, 0.0));
    store_surface(uint(k), surface_at(point, mat3(eye_from_local) * normal, color, uv));
}
