// A slab of volumes on a proxy slice, to be blended over what is behind it: light, and an alpha of each channel (Huebner
// 2007a, section 3.3; the second source of the blending). Switch: AVERAGED: the mean of the sub-pixels' alphas for all.
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
#include "lib/volume_slab.glsl"

flat in int slab_number;

layout(location = 0, index = 0) out vec4 color;
layout(location = 0, index = 1) out vec4 alphas;

void end_slab() {
    s_front = s_back;
}

void main() {
    start_rays();
    find_stretches(slices.x);
    float t = slices.x + float(slab_number) * slices.y, after = slices.x + float(slab_number + 1) * slices.y;
    LANE alpha = LANE(0.0);
    rounds = LANES;
    for (int end = 0; end < 2; ++end) {
        for (int v = 0; v < VOLUMES; ++v) {
            near_end[v] = clamp(LANE(t), enter[v], leave[v]);
            far_end[v] = clamp(LANE(end == 0 ? t : after), enter[v], leave[v]);
        }
        for (int l = 0; l < LANES; ++l) {
            look_up(l);
        }
        alpha = slab_alpha();
        end_slab();
    }
    if (!(greatest(alpha) > 0.0)) {
        discard;
    }
    vec3 light = by_channel(alpha * (glow / max(optical, LANE(TINY)))), each = by_channel(vec3(alpha));
#ifdef AVERAGED
    each = vec3(dot(each, vec3(1.0 / 3.0)));
#endif
    color = vec4(light, each.x);
    alphas = vec4(each, each.x);
}
