// What samples see of one surfel: the depth of its disc (NEAREST; blended to the least), or its share of the mean of all
// that are within their own radius of the nearest (blended to a sum).
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/surfels.glsl"
#include "lib/discs.glsl"

#ifdef PANEL
#define MINE rgb
#else
flat in float camera_offset;
flat in vec2 origin;
#define MINE r
#endif
#ifdef STOPPED
uniform sampler2D stops;    // depths of what is opaque
#endif
#ifdef NEAREST
layout(location = 0) out vec4 nearest;
#else
uniform sampler2D nearest;
layout(location = 0) out vec4 sum;
#ifdef PANEL
layout(location = 1) out vec4 weights;
#endif
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
#ifdef PANEL
    vec3 dx;
    float dy;
    vec3 v = rays_of(at, dx, dy);
#else
    float v = camera_offset;
    vec3 ray = ray_direction(gl_FragCoord.xy - origin, v);
    real dx = ray.x;
    float dy = ray.y;
#endif
    real depth, weight = meet(v, dx, dy, depth);
    real margin = weight;
#ifdef STOPPED
    margin = min(margin, texelFetch(stops, at, 0).MINE - depth);
#endif
#ifndef NEAREST
    margin = min(margin, texelFetch(nearest, at, 0).MINE * (1.0 + ROUNDING) + place.w - depth);
#endif
    real seen = (1.0 - step(margin, real(0.0))) * step(real(depth_range.z), depth);
#ifdef PANEL
    if (seen.x + seen.y + seen.z == 0.0) {
        discard;
    }
#else
    if (seen == 0.0) {
        discard;
    }
#endif
#ifdef NEAREST
    nearest = vec4(FAR);
    nearest.MINE = chosen(real(FAR), depth, seen);
#else
    weight = max(weight, 0.0) * seen;
    vec3 light = light_for(v);
#ifdef PANEL
    sum = vec4(weight * light, 0.0);
    weights = vec4(weight, 0.0);
#else
    sum = vec4(weight * light, weight);
#endif
#endif
}
