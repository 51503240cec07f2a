// The mean of the surfels that samples see, into the tiles of an atlas; or, PANEL, of one channel into a panel, from the
// textures that quads were blended into (QUADS) or as points_splat.comp leaves it.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/color.glsl"
#include "lib/viewmap.glsl"
#include "lib/memory.glsl"
#ifndef QUADS
#include "lib/sums.glsl"
#endif

uniform vec4 sheet;

layout(location = 0) out vec4 color;

#ifdef PANEL
uniform int channel;
layout(location = 1) out vec4 depth;
#else
uniform int first_view;
flat in int tile;
flat in vec2 origin;
#endif
#ifdef QUADS
uniform sampler2D nearest;
uniform sampler2D sums;
uniform sampler2D weights;
#endif

void main() {
#ifdef PANEL
    ivec2 at = mirrored(ivec2(gl_FragCoord.xy), ivec2(window.xy)) - ivec2(0, int(sheet.z));
    if (at.y < 0 || at.y >= int(sheet.y)) {
        discard;
    }
#ifdef QUADS
    float d = texelFetch(nearest, at, 0)[channel], weight = texelFetch(weights, at, 0)[channel];
    vec3 sum = texelFetch(sums, at, 0).rgb;
#else
    uint k = 3u * (uint(at.y) * uint(window.x) + uint(at.x)) + uint(channel);
    float weight = total(VALUES * k + 1u);
    vec3 sum = vec3(total(VALUES * k));
#endif
#else
    ivec2 size = ivec2(atlas_size.zw), at = ivec2(gl_FragCoord.xy - origin);
    uint k = uint((tile - first_view) * size.y + at.y) * uint(size.x) + uint(at.x);
    float weight = total(VALUES * k + 3u);
    vec3 sum = vec3(total(VALUES * k), total(VALUES * k + 1u), total(VALUES * k + 2u));
#endif
#ifndef QUADS
    uint bits = imageLoad(nearest, place_of(k)).x;
    float d = bits == NOTHING ? FAR : uintBitsToFloat(bits);
#endif
    if (!(d < FAR && weight > 0.0)) {
        discard;
    }
    color = vec4(quantized(sum / weight), 1.0);
#ifdef PANEL
    depth = vec4(window_from_depth(d));
#else
    gl_FragDepth = window_from_depth(d);
#endif
}
