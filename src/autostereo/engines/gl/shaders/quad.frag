// Covering quads: which sub-pixels of a channel see the triangle, each from its own camera (quad.vert).
#define COLORING
#define MIXING
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/color.glsl"
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#include "lib/shading.glsl"
#ifdef TEXTURED
#include "lib/texture.glsl"
#endif
#include "lib/surface.glsl"

uniform int channel;
uniform vec2 sample_at;      // where a pixel is sampled

flat in vec3 normals[3];
flat in vec2 slopes[3];
flat in vec3 depths;
flat in Surface corners[3];
flat in ivec2 first_pixel;

layout(location = 0) out vec4 color;
layout(depth_greater) out float gl_FragDepth;

// Whether a sample belongs to a triangle that is seen from a side: top-left rule, as engines/reference/mesh.py.
bool covers(float side, vec3 e, vec3 e_dx, vec3 e_dy) {
    for (int k = 0; k < 3; ++k) {
        bool on = e[k] == 0.0 && (side * e_dx[k] > 0.0 || (e_dx[k] == 0.0 && side * e_dy[k] > 0.0));
        if (!(side * e[k] > 0.0 || on)) {
            return false;
        }
    }
    return true;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - first_pixel;
    ivec2 shown_at = mirrored(pixel, ivec2(atlas_size.zw));
    float v = offset_of_subpixel(shown_at.x, shown_at.y, channel);
    vec3 ray = ray_direction(vec2(pixel) + sample_at, v);
    vec3 e, e_dx, e_dy;
    for (int k = 0; k < 3; ++k) {
        vec3 n = normals[k] + vec3(0.0, v * slopes[k]);
        e[k] = dot(n, ray);
        e_dx[k] = n.x / lens.x;
        e_dy[k] = -n.y / lens.y;
    }
    bool front = covers(1.0, e, e_dx, e_dy);
#ifdef TWO_SIDED
    if (!front && !covers(-1.0, e, e_dx, e_dy)) {
#else
    if (!front) {
#endif
        discard;
    }
    float total = e.x + e.y + e.z;
    vec3 w = e / total;
    float d = dot(w, depths);
    if (!(d >= depth_range.z)) {
        discard;
    }
    vec3 point = vec3(v, lens.w, 0.0) + d * ray;
    Surface s = mixed(corners, w, point);
    vec3 paint = vec3(1.0);
#ifdef TEXTURED
    vec3 w_dx = (e_dx - w * (e_dx.x + e_dx.y + e_dx.z)) / total, w_dy = (e_dy - w * (e_dy.x + e_dy.y + e_dy.z)) / total;
    paint = trilinear(s.uv, uv_of(corners, w_dx), uv_of(corners, w_dy));
#endif
    color = vec4(quantized(surface_color(s, front, v, paint)), 1.0);
    gl_FragDepth = window_from_depth(d);
}
