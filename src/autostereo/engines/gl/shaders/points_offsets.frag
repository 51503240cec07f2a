// The camera offsets of a panel's sub-pixels, once for all surfels.
#include "lib/frame.glsl"
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"

uniform int first_row;  // of the band

layout(location = 0) out vec4 offsets;

void main() {
    ivec2 at = mirrored(ivec2(gl_FragCoord.xy) + ivec2(0, first_row), ivec2(window.xy));
    offsets = vec4(offsets_of_subpixels(at.x, at.y), 0.0);
}
