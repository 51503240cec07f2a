// A mesh's samples, each to the render target of its view; the other targets keep what they hold (de Sorbier 2008, 4.2).
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
flat in int target;

out vec4 color[TARGETS];

void main() {
#ifdef TEXTURED
    vec3 paint = rasterised(vertex.surface.uv, gl_FragCoord.w);
#else
    vec3 paint = vec3(1.0);
#endif
    vec3 own = quantized(surface_color(vertex.surface, gl_FrontFacing, camera_offset, paint));
    for (int k = 0; k < TARGETS; ++k) {
        color[k] = k == target ? vec4(own, 1.0) : vec4(0.0);  // transparent: blending leaves the target as it is
    }
}
