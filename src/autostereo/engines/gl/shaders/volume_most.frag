// The greatest of a volume's samples along rays, the transfer function's colour of it over what was there before.
// Switch: HALF_DEPTH: where it was met is written, if it hides half of what is behind.
#include "lib/frame.glsl"
#include "lib/color.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#endif
#include "lib/volume.glsl"
#include "lib/volume_target.glsl"

uniform sampler2D most_colors;  // of the range of scalars; alpha: share of the greatest opacity
uniform vec2 most_place;        // scale and offset of a scalar's place in it

layout(location = 0) out vec4 color;

void main() {
    start_rays();
    find_stretches(slices.x);
    float most[LANES], met[LANES];
    for (int l = 0; l < LANES; ++l) {
        most[l] = -1.0;
        met[l] = 1e30;
    }
    while (next_slab()) {
        for (int l = 0; l < LANES; ++l) {
            if (far_end[l] > near_end[l]) {
                if (s_front[l] > most[l]) {
                    most[l] = s_front[l];
                    met[l] = near_end[l];
                }
                if (s_back[l] > most[l]) {
                    most[l] = s_back[l];
                    met[l] = far_end[l];
                }
            }
        }
    }
    vec3 light = vec3(0.0), passed = vec3(0.0);
    float depth = 1.0;
    for (int l = 0; l < LANES; ++l) {
        vec4 found = vec4(0.0);
        if (most[l] >= 0.0) {
            found = textureLod(most_colors, vec2(most[l] * most_place.x + most_place.y, 0.5), 0.0);
        }
        light += found.a * pick[l] * found.rgb;
        passed += (1.0 - found.a) * pick[l];
        depth = found.a >= 0.5 ? window_from_depth(met[l]) : 1.0;
    }
    color = over(light, passed);
#ifdef HALF_DEPTH
    gl_FragDepth = depth;
#endif
}
