// Isosurfaces: where rays first cross a level between two samples (engines/reference/volume.py, isosurface).
// In the tiles of views what is not met is discarded; on a panel each channel has its own depth.
#include "lib/frame.glsl"
#include "lib/color.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#endif
#include "lib/shading.glsl"
#include "lib/volume.glsl"
#include "lib/volume_light.glsl"
#include "lib/volume_target.glsl"

uniform float level;
uniform vec3 own_color;

layout(location = 0) out vec4 color;
#ifdef PANEL
layout(location = 1) out vec4 depths;
#endif

// Depth between two on different sides of the level: halved, and at last taken to be linear.
float crossing(int l, float low, float high, bool starts_inside) {
    for (int k = 0; k < BISECTIONS; ++k) {
        float middle = 0.5 * (low + high);
        if ((voxel_at(0, origin_x[l] + middle * turn_x[l], middle).a >= level) == starts_inside) {
            low = middle;
        } else {
            high = middle;
        }
    }
    float a = voxel_at(0, origin_x[l] + low * turn_x[l], low).a - level;
    float b = voxel_at(0, origin_x[l] + high * turn_x[l], high).a - level;
    return a == b ? high : mix(low, high, clamp(a / (a - b), 0.0, 1.0));
}

vec3 surface_color(int l, float t) {
#ifdef SHADED
    vec3 gradient = gradient_of(voxel_at(0, origin_x[l] + t * turn_x[l], t));
    if (dot(gradient, gradient) < FLAT) {
        return own_color;
    }
    vec3 normal = unit(normal_from_gradient[0] * gradient), reflected, highlight;
    normal = dot(normal, vec3(turn_x[l], turn_y, 1.0)) > 0.0 ? -normal : normal;
    vec3 eye = vec3(0.0, lens.w, 0.0);
#ifdef OWN_EYES
    eye.x = origin_x[l];
#endif
    illuminate(eye_point(l, t), normal, eye, volume_material[0], reflected, highlight);
    return own_color * reflected + highlight;
#else
    return own_color;
#endif
}

void main() {
    start_rays();
    find_stretches(slices.x);
    float low[LANES], high[LANES];
    bool met[LANES], starts_inside[LANES];
    for (int l = 0; l < LANES; ++l) {
        met[l] = false;
        low[l] = high[l] = 0.0;
        starts_inside[l] = false;
    }
    bool searching = true;
    while (searching && next_slab()) {
        searching = false;
        for (int l = 0; l < LANES; ++l) {
            bool in_front = s_front[l] >= level;
            if (!met[l] && far_end[l] > near_end[l] && in_front != (s_back[l] >= level)) {
                met[l] = true;
                starts_inside[l] = in_front;
                low[l] = near_end[l];
                high[l] = far_end[l];
            }
            searching = searching || !met[l];
        }
    }
    vec4 shown = before();
    vec3 far = vec3(1.0);
    for (int l = 0; l < LANES; ++l) {
        float z = stop[l] < 1e30 ? window_from_depth(stop[l]) : 1.0;
        if (met[l]) {
            float t = crossing(l, low[l], high[l], starts_inside[l]);
            z = window_from_depth(t);
            shown.rgb = mix(shown.rgb, quantized(surface_color(l, t)), pick[l]);
        }
        far = mix(far, vec3(z), pick[l]);
    }
#ifdef PANEL
    color = shown;
    depths = vec4(far, 1.0);
#else
    if (!met[0]) {
        discard;
    }
    color = vec4(shown.rgb, 1.0);
    gl_FragDepth = far.r;
#endif
}
