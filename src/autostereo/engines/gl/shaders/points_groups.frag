// What the three sub-pixels of a pixel see of one surfel, in its group's tile, where one depth for all three decides
// which surfel is kept (Huebner 2007b, section 3.5.2, geometry pass, and section 3.6). Switches: those of points.frag;
// LEAST_DEPTH: the least of the three, else their mean.
#include "lib/frame.glsl"
#include "lib/shading.glsl"
#include "lib/memory.glsl"
#define RECORD_TEXTURE
#include "lib/surfels.glsl"
#include "lib/discs.glsl"

uniform sampler2D offsets;
#ifdef STOPPED
uniform sampler2D stops;
#endif

layout(location = 0) out uvec4 shares;  // colour and weight of each channel, as half floats; the depth
layout(location = 1) out float epsilon;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) % ivec2(sheet.xy);
    vec3 v = texelFetch(offsets, at, 0).rgb, dx, depth;
    float dy;
    rays_of(at, v, dx, dy);
    vec3 weight = meet(v, dx, dy, depth), margin = weight;
#ifdef STOPPED
    margin = min(margin, texelFetch(stops, at, 0).rgb - depth);
#endif
    bvec3 seen = bvec3(vec3(greaterThan(margin, vec3(0.0))) * vec3(greaterThanEqual(depth, vec3(depth_range.z))));
    if (!any(seen)) {
        discard;
    }
    weight = mix(vec3(0.0), weight, seen);
#ifdef LEAST_DEPTH
    depth = mix(vec3(FAR), depth, seen);
    float kept = min(min(depth.x, depth.y), depth.z);
#else
    float kept = dot(mix(vec3(0.0), depth, seen), vec3(1.0)) / dot(vec3(seen), vec3(1.0));
#endif
    vec3 light = light_for(v);
    for (int c = 0; c < 3; ++c) {
        shares[c] = packHalf2x16(vec2(light[c], weight[c]));
    }
    shares.a = floatBitsToUint(kept);
    epsilon = place.w;
    gl_FragDepth = window_from_depth(kept);
}
