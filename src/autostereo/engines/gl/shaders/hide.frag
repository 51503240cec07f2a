// Covers the pixels of a view that none of the channels shows, so that nothing can be seen there any more.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/viewmap.glsl"

uniform int first_held;  // view of tile 0
uniform vec3 channels;   // 1 where a channel is wanted

flat in int tile;
flat in vec2 origin;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy - origin);
    at = mirrored(at, ivec2(atlas_size.zw));
    bvec3 shown = equal(nearest_views(at.x, at.y), ivec3(first_held + tile));
    if (any(shown) && dot(vec3(shown), channels) > 0.0) {
        discard;
    }
}
