// The mean of the surfels that samples see, into the tiles of an atlas; or, PANEL, of one channel into a panel.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/color.glsl"
#include "lib/viewmap.glsl"

uniform vec4 sheet;
uniform sampler2D nearest;
uniform sampler2D sums;

layout(location = 0) out vec4 color;

#ifdef PANEL
uniform sampler2D weights;
uniform int channel;
layout(location = 1) out vec4 depth;
#else
uniform int first_view;
flat in int tile;
flat in vec2 origin;
#endif

void main() {
#ifdef PANEL
    ivec2 at = mirrored(ivec2(gl_FragCoord.xy), ivec2(window.xy)) - ivec2(0, int(sheet.z));
    if (at.y < 0 || at.y >= int(sheet.y)) {
        discard;
    }
    float d = texelFetch(nearest, at, 0)[channel], weight = texelFetch(weights, at, 0)[channel];
#else
    int number = tile - first_view, columns = int(sheet.z);
    ivec2 at = ivec2(gl_FragCoord.xy - origin) + ivec2(number % columns, number / columns) * ivec2(atlas_size.zw);
    float d = texelFetch(nearest, at, 0).r, weight = texelFetch(sums, at, 0).a;
#endif
    if (!(d < FAR && weight > 0.0)) {
        discard;
    }
    color = vec4(quantized(texelFetch(sums, at, 0).rgb / weight), 1.0);
#ifdef PANEL
    depth = vec4(window_from_depth(d));
#else
    gl_FragDepth = window_from_depth(d);
#endif
}
