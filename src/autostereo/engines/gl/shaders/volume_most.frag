// The greatest of a volume's samples along rays, the transfer function's colour of it over what was there before.
// Switch: HALF_DEPTH: where it was met is written, if it hides half of what is behind.
#include "lib/frame.glsl"
#include "lib/color.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#endif
#include "lib/lanes.glsl"
#include "lib/filtering.glsl"
#include "lib/volume.glsl"
#ifdef SORTED
#include "lib/sorted.glsl"
#endif
#include "lib/volume_target.glsl"

uniform sampler2D most_colors;  // of the range of scalars; alpha: share of the greatest opacity
uniform vec2 most_place;        // scale and offset of a scalar's place in it

layout(location = 0) out vec4 color;

LANE most = LANE(-1.0), met = LANE(1e30);

void visit(int v, int l, vec4 voxel) {
}

void end_slab() {
    LANE found = choose(less(enter[0], leave[0]), s_back[0], LANE(-1.0));
    met = choose(less(most, found), far_end[0], met);
    most = max(most, found);
}

vec4 color_of(float value) {
    return value < 0.0 ? vec4(0.0) : looked_up(most_colors, vec2(value * most_place.x + most_place.y, 0.5));
}

void main() {
    start_rays();
    find_stretches(slices.x);
    march();
#if LANES == 3
    vec4 first = color_of(most.x), second = color_of(most.y), third = color_of(most.z);
    vec3 alpha = by_channel(vec3(first.a, second.a, third.a));
    vec3 own = first.rgb * pick(0) + second.rgb * pick(1) + third.rgb * pick(2);
#else
    vec4 first = color_of(most);
    vec3 alpha = vec3(first.a), own = first.rgb;
#endif
    color = over(alpha * own, 1.0 - alpha);
#ifdef HALF_DEPTH
    gl_FragDepth = first.a >= 0.5 ? window_from_depth(greatest(met)) : 1.0;
#endif
}
