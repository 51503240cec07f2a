// Depths of what is opaque already, for surfels to be tested against; and the farthest of a pixel's in the depth buffer,
// so that what is hidden from all is not drawn. Ties keep what was first: depths are taken nearer by their precision.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/viewmap.glsl"

uniform vec4 sheet;
uniform sampler2D depths;
#ifndef PANEL
uniform ivec2 held;     // first view of the atlas, and how many
#endif

layout(location = 0) out vec4 stops;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
#ifdef PANEL
    ivec2 shown_at = mirrored(at + ivec2(0, int(sheet.z)), ivec2(window.xy));
    vec3 z = texelFetch(depths, shown_at, 0).rgb;
#else
    ivec2 size = ivec2(atlas_size.zw), tile = at / size;
    int number = tile.y * int(sheet.z) + tile.x;
    if (number >= held.y) {
        discard;
    }
    vec3 z = texelFetch(depths, ivec2(views[held.x + number].yz) + at - tile * size, 0).rrr;
#endif
    gl_FragDepth = max(max(z.x, z.y), z.z);
    vec3 nearer = z - DEPTH_PRECISION;
    for (int c = 0; c < 3; ++c) {
        stops[c] = z[c] >= 1.0 ? FAR : nearer[c] <= 0.0 ? 0.0 : depth_from_window(nearer[c]);
    }
    stops.a = 0.0;
}
