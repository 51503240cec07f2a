// What the three sub-pixels of a pixel see of one surfel: the depth of its disc (NEAREST; blended to the least), or its
// share of the mean of all that are within their own radius of the nearest (blended to a sum).
#include "lib/frame.glsl"
#include "lib/shading.glsl"
#include "lib/memory.glsl"
#define RECORD_TEXTURE
#include "lib/surfels.glsl"
#include "lib/discs.glsl"

uniform sampler2D offsets;  // of the cameras of sub-pixels
#ifdef STOPPED
uniform sampler2D stops;    // depths of what is opaque
#endif
#ifdef NEAREST
layout(location = 0) out vec4 nearest;
#else
uniform sampler2D nearest;
layout(location = 0) out vec4 sum;
layout(location = 1) out vec4 weights;
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 v = texelFetch(offsets, at, 0).rgb, dx, depth;
    float dy;
    rays_of(at, v, dx, dy);
    vec3 weight = meet(v, dx, dy, depth), margin = weight;
#ifdef STOPPED
    margin = min(margin, texelFetch(stops, at, 0).rgb - depth);
#endif
#ifndef NEAREST
    margin = min(margin, texelFetch(nearest, at, 0).rgb * (1.0 + ROUNDING) + place.w - depth);
#endif
    vec3 seen = (1.0 - step(margin, vec3(0.0))) * step(vec3(depth_range.z), depth);
    if (seen.x + seen.y + seen.z == 0.0) {
        discard;
    }
#ifdef NEAREST
    nearest = vec4(chosen(vec3(FAR), depth, seen), FAR);
#else
    weight = max(weight, 0.0) * seen;
    sum = vec4(weight * light_for(v), 0.0);
    weights = vec4(weight, 0.0);
#endif
}
