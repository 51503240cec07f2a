// Isosurfaces: where rays first cross a level between two samples (engines/reference/volume.py, isosurface).
// In the tiles of views what is not met is discarded; on a panel each channel has its own depth.
#include "lib/frame.glsl"
#include "lib/color.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#endif
#include "lib/shading.glsl"
#include "lib/lanes.glsl"
#include "lib/filtering.glsl"
#include "lib/volume.glsl"
#include "lib/volume_light.glsl"
#ifdef SORTED
#include "lib/sorted.glsl"
#endif
#include "lib/volume_target.glsl"

uniform float level;
uniform vec3 own_color;

layout(location = 0) out vec4 color;
#ifdef PANEL
layout(location = 1) out vec4 depths;
#endif

LANE low = LANE(0.0), high = LANE(-1.0);  // ends of the slab in which a ray first crosses; high < low: none so far
LANE s_low = LANE(0.0);

void visit(int v, int l, vec4 voxel) {
}

void end_slab() {
    for (int l = 0; l < LANES; ++l) {
        bool before = of(s_front[0], l) >= level, after = of(s_back[0], l) >= level;
        if (of(high, l) < of(low, l) && of(far_end[0], l) > of(near_end[0], l) && before != after) {
            low = with(low, l, of(near_end[0], l));
            high = with(high, l, of(far_end[0], l));
            s_low = with(s_low, l, of(s_front[0], l));
        }
    }
    left = greatest(choose(less(high, low), LANE(1.0), LANE(0.0)));
}

// Depth at which lane l crosses, between low and high: halved, and at last taken to be linear.
float crossing(int l) {
    float a = of(low, l), b = of(high, l);
    bool starts_inside = of(s_low, l) >= level;
    int k = 0;
    do {
        float middle = 0.5 * (a + b);
        bool same_side = (voxel_on_ray(0, l, middle).a >= level) == starts_inside;
        a = same_side ? middle : a;
        b = same_side ? b : middle;
        ++k;
    } while (k < BISECTIONS);
    float s = voxel_on_ray(0, l, a).a - level, e = voxel_on_ray(0, l, b).a - level;
    return s == e ? b : mix(a, b, clamp(s / (s - e), 0.0, 1.0));
}

vec3 surface_color(int l, float t) {
#ifdef SHADED
    vec3 gradient = gradient_of(voxel_on_ray(0, l, t));
    vec3 normal = unit(normal_from_gradient[0] * gradient), reflected, highlight;
    normal = dot(normal, vec3(of(turn_x, l), turn_y, 1.0)) > 0.0 ? -normal : normal;
    vec3 eye = vec3(0.0, lens.w, 0.0);
#ifdef OWN_EYES
    eye.x = of(origin_x, l);
#endif
    illuminate(eye_point(l, t), normal, eye, volume_material[0], reflected, highlight);
    return dot(gradient, gradient) < FLAT ? own_color : own_color * reflected + highlight;
#else
    return own_color;
#endif
}

void main() {
    start_rays();
    find_stretches(slices.x);
    march();
    vec4 shown = before();
    vec3 far = by_channel(vec3(choose(less(stop, LANE(1e30)), (depth_range.x - 1.0 / stop) / depth_range.y, LANE(1.0))));
    int l = 0;
    do {
        if (of(high, l) >= of(low, l)) {
            float t = crossing(l);
            vec3 which = LANES == 3 ? pick(l) : vec3(1.0);
            shown.rgb = mix(shown.rgb, quantized(surface_color(l, t)), which);
            far = mix(far, vec3(window_from_depth(t)), which);
        }
        ++l;
    } while (l < LANES);
#ifdef PANEL
    color = shown;
    depths = vec4(far, 1.0);
#else
    if (!(greatest(high) >= greatest(low))) {
        discard;
    }
    color = vec4(shown.rgb, 1.0);
    gl_FragDepth = far.r;
#endif
}
