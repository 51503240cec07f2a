// What samples see of one surfel: the depth of its disc (NEAREST; blended to the least), or its share of the mean of all
// that are within their own radius of the nearest (blended to a sum).
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/surfels.glsl"

flat in vec4 place;
flat in vec4 normal;
flat in vec4 shape;
flat in vec4 area;
flat in vec3 color;

#ifdef PANEL
uniform vec3 columns;       // where pixels are sampled
uniform float row;
uniform vec4 sheet;
uniform sampler2D offsets;  // of the cameras of sub-pixels
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
    vec3 v = texelFetch(offsets, at, 0).rgb;
    vec2 pixel = vec2(at) + vec2(0.0, sheet.z);
    real dx = (pixel.x + columns - window.z) / lens.x - v * depth_range.w;
    float dy = -(pixel.y + row - window.w) / lens.y - lens.w * depth_range.w;
#else
    float v = camera_offset;
    vec3 ray = ray_direction(gl_FragCoord.xy - origin, v);
    real dx = ray.x;
    float dy = ray.y;
#endif
    vec3 p = place.xyz, n = normal.xyz;
    float radius = place.w, y = p.y - lens.w;
    real x = p.x - v;
    real a = x / p.z;
    real squares = shape.x + a * (shape.y + a * shape.z), areas = area.x + a * area.y;
    real wide = step(real(0.5), squares) * step(real(0.0), areas * areas - 0.25 * squares + 0.0625);

    // upright: depth d, and half axes of their own
    real across = chosen(real(1.0), n.x * dx + (n.y * dy + n.z), wide);
    across += TINY * step(abs(across), real(0.0));
    real depth = clamp(chosen(real(p.z), n.x * x + (n.y * y + n.z * p.z), wide) / across, -FAR, FAR);
    real away_x = depth * dx - x, away_y = depth * dy - y, away_z = depth - p.z;
    vec2 half_axes = max(vec2(radius), LEAST_RADIUS * p.z / lens.xy);
    real weight = 1.0 - away_x * away_x * chosen(real(1.0 / (half_axes.x * half_axes.x)), real(shape.w), wide)
        - away_y * away_y * chosen(real(1.0 / (half_axes.y * half_axes.y)), real(shape.w), wide)
        - away_z * away_z * shape.w;

    real margin = weight;
#ifdef STOPPED
    margin = min(margin, texelFetch(stops, at, 0).MINE - depth);
#endif
#ifndef NEAREST
    margin = min(margin, texelFetch(nearest, at, 0).MINE * (1.0 + ROUNDING) + radius - depth);
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
    vec3 light = color;
#if defined(PANEL) && defined(OWN_EYE)
    light += highlights(v, p, n, area.zw);
#endif
#ifdef PANEL
    sum = vec4(weight * light, 0.0);
    weights = vec4(weight, 0.0);
#else
    sum = vec4(weight * light, weight);
#endif
#endif
}
