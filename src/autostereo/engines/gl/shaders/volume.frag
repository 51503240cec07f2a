// Emission and absorption of volumes along rays, front to back (Huebner 2007a, section 3; Engel 2001; engines/reference/volume.py).
// Switches: AVERAGED: sub-pixels are attenuated by the mean of their alphas; OWN_EYES: highlights are those of each
// ray's eye, else of the centre's; HALF_DEPTH: the depth where half of the light is taken is written.
#include "lib/frame.glsl"
#include "lib/color.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#endif
#include "lib/shading.glsl"
#include "lib/volume.glsl"
#include "lib/volume_light.glsl"
#include "lib/volume_slab.glsl"
#include "lib/volume_target.glsl"

layout(location = 0) out vec4 color;

void main() {
    start_rays();
    find_stretches(slices.x);
    vec3 light = vec3(0.0);
    float through[LANES];
    for (int l = 0; l < LANES; ++l) {
        through[l] = 1.0;
    }
    float left = 1.0;
#ifdef HALF_DEPTH
    float half_at = 1e30;
#endif
    while (left > ENOUGH && next_slab()) {
        classify();
        float total = 0.0;
        left = 0.0;
#ifdef HALF_DEPTH
        float previous = through[0];
#endif
        for (int l = 0; l < LANES; ++l) {
            light += (through[l] * alpha[l]) * pick[l] * emitted[l];
            total += alpha[l];
        }
        for (int l = 0; l < LANES; ++l) {
#ifdef AVERAGED
            through[l] *= 1.0 - total / float(LANES);
#else
            through[l] *= 1.0 - alpha[l];
#endif
            left = max(left, through[l]);
        }
#ifdef HALF_DEPTH
        if (previous > 0.5 && through[0] <= 0.5) {
            half_at = half_depth(previous);
        }
#endif
    }
    vec3 passed = vec3(0.0);
    for (int l = 0; l < LANES; ++l) {
        passed += through[l] * pick[l];
    }
    color = over(light, passed);
#ifdef HALF_DEPTH
    gl_FragDepth = half_at < 1e30 ? window_from_depth(half_at) : 1.0;
#endif
}
