// Covering quads: which sub-pixels see the triangle, each from its own camera (quad.vert).
//
// The tiles are the channels of a panel, with a depth buffer each. With ONE_DEPTH there is one tile, and the sub-pixels
// of a pixel share one depth, the least or the mean (MEAN_DEPTH) of those that see the triangle: a limit of 2007's hardware
// (Huebner 2007b, section 3.6), for comparison.
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
uniform vec2 sample_at[3];   // where a pixel is sampled, for each channel

flat in vec3 normals[3];
flat in vec2 slopes[3];
flat in vec3 depths;
flat in Surface corners[3];
flat in ivec2 first_pixel;

#ifdef ONE_DEPTH
layout(location = 0, index = 0) out vec4 color;
layout(location = 0, index = 1) out vec4 replaced;  // 1 where a channel is seen
#else
layout(location = 0) out vec4 color;
#endif
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

// What the ray of camera offset v meets: barycentric weights, their changes per pixel, depth and side.
struct Meeting {
    vec3 w, w_dx, w_dy;
    float d;
    bool front;
};

bool meets(vec3 ray, float v, out Meeting m) {
    vec3 e, e_dx, e_dy;
    for (int k = 0; k < 3; ++k) {
        vec3 n = normals[k] + vec3(0.0, v * slopes[k]);
        e[k] = dot(n, ray);
        e_dx[k] = n.x / lens.x;
        e_dy[k] = -n.y / lens.y;
    }
    m.front = covers(1.0, e, e_dx, e_dy);
#ifdef TWO_SIDED
    bool met = m.front || covers(-1.0, e, e_dx, e_dy);
#else
    bool met = m.front;
#endif
    float total = met ? e.x + e.y + e.z : 1.0;
    m.w = e / total;
    m.w_dx = (e_dx - m.w * (e_dx.x + e_dx.y + e_dx.z)) / total;
    m.w_dy = (e_dy - m.w * (e_dy.x + e_dy.y + e_dy.z)) / total;
    m.d = dot(m.w, depths);
    return met && m.d >= depth_range.z;
}

vec3 color_at(Meeting m, vec3 ray, float v) {
    Surface s = mixed(corners, m.w, vec3(v, lens.w, 0.0) + m.d * ray);
    vec3 paint = vec3(1.0);
#ifdef TEXTURED
    paint = trilinear(s.uv, uv_of(corners, m.w_dx), uv_of(corners, m.w_dy));
#endif
    return quantized(surface_color(s, m.front, v, paint));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - first_pixel;
    ivec2 shown_at = mirrored(pixel, ivec2(atlas_size.zw));
    vec3 offsets = offsets_of_subpixels(shown_at.x, shown_at.y);
    Meeting m;
#ifdef ONE_DEPTH
    color = replaced = vec4(0.0);
    float least = 1e30, sum = 0.0, count = 0.0;
    for (int c = 0; c < 3; ++c) {
        vec3 ray = ray_direction(vec2(pixel) + sample_at[c], offsets[c]);
        if (meets(ray, offsets[c], m)) {
            color[c] = color_at(m, ray, offsets[c])[c];
            replaced[c] = 1.0;
            least = min(least, m.d);
            sum += m.d;
            count += 1.0;
        }
    }
    if (count == 0.0) {
        discard;
    }
#ifdef MEAN_DEPTH
    gl_FragDepth = window_from_depth(sum / count);
#else
    gl_FragDepth = window_from_depth(least);
#endif
#else
    float v = offsets[channel];
    vec3 ray = ray_direction(vec2(pixel) + sample_at[channel], v);
    if (!meets(ray, v, m)) {
        discard;
    }
    color = vec4(color_at(m, ray, v), 1.0);
    gl_FragDepth = window_from_depth(m.d);
#endif
}
