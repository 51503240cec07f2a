// Emission and absorption of volumes along rays, front to back (Huebner 2007a, section 3; Engel 2001; engines/reference/volume.py).
// Switches: AVERAGED: sub-pixels are attenuated by the mean of their alphas; HALF_DEPTH: the depth where half of the
// light is taken is written.
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

layout(location = 0) out vec4 color;

vec3 light = vec3(0.0);
LANE through = LANE(1.0);
float half_at = 1e30;

void end_slab() {
    LANE alpha = slab_alpha(), before = through;
    light += (through * alpha) * (glow / max(optical, LANE(TINY)));
#ifdef AVERAGED
    through *= 1.0 - (LANES == 3 ? dot(vec3(alpha), vec3(1.0 / 3.0)) : greatest(alpha));
#else
    through *= 1.0 - alpha;
#endif
#ifdef HALF_DEPTH
    // optical depth is taken to grow linearly through the part of the slab that volumes fill
    float part = log(2.0 * greatest(before)) / greatest(optical);
    bool here = greatest(before) > 0.5 && greatest(through) <= 0.5;
    half_at = here ? mix(greatest(fill_begin), greatest(fill_end), part) : half_at;
#endif
    left = greatest(through) - ENOUGH;
}

void main() {
    start_rays();
    find_stretches(slices.x);
    march();
    color = over(by_channel(light), by_channel(vec3(through)));
#ifdef HALF_DEPTH
    gl_FragDepth = half_at < 1e30 ? window_from_depth(half_at) : 1.0;
#endif
}
