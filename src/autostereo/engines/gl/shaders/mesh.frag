// A mesh's samples.
#define COLORING
#include "lib/frame.glsl"
#include "lib/color.glsl"
#include "lib/shading.glsl"
#ifdef TEXTURED
#include "lib/texture.glsl"
#include "lib/rasterised.glsl"
#endif
#include "lib/surface.glsl"

in Vertex {
    Surface surface;
} vertex;
flat in float camera_offset;

out vec4 color;

void main() {
#ifdef TEXTURED
    vec3 paint = rasterised(vertex.surface.uv, gl_FragCoord.w);
#else
    vec3 paint = vec3(1.0);
#endif
    color = vec4(quantized(surface_color(vertex.surface, gl_FrontFacing, camera_offset, paint)), 1.0);
}
