// Gathers the sub-pixels of a panel from an atlas: of views by the mask, or of channels.
//
// Several atlases add up: what an atlas does not hold is 0. Switches: those of lib/viewmap.glsl; CHANNELS: the atlas has
// three tiles, one for the sub-pixels of each channel; ONE_TILE: one for
// all three; WITH_DEPTH: eye depths too. I(x,y) = I_mask(x,y)(x,y), Huebner 2007b 2.3.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/viewmap.glsl"

uniform sampler2D atlas_color;
uniform ivec2 held;            // first view, or channel, of the atlas, and how many
uniform vec3 channels;         // 1 where a channel is wanted

layout(location = 0) out vec4 color;
#ifdef WITH_DEPTH
uniform sampler2D atlas_depth;
layout(location = 1) out vec4 depth;
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    ivec2 size = ivec2(atlas_size.zw);
    ivec2 from = mirrored(at, size);
#if defined(ONE_TILE)
    ivec3 view = ivec3(0);
#elif defined(CHANNELS)
    ivec3 view = ivec3(0, 1, 2) - held.x;
#else
    ivec3 view = nearest_views(at.x, at.y) - held.x;
#endif
    color = vec4(0.0, 0.0, 0.0, 1.0);
#ifdef WITH_DEPTH
    depth = vec4(0.0);
#endif
    for (int c = 0; c < 3; ++c) {
        if (channels[c] != 0.0 && view[c] >= 0 && view[c] < held.y) {
            ivec2 texel = ivec2(views[view[c]].yz) + from;
            color[c] = texelFetch(atlas_color, texel, 0)[c];
#ifdef WITH_DEPTH
            depth[c] = texelFetch(atlas_depth, texel, 0).r;
#endif
        }
    }
}
