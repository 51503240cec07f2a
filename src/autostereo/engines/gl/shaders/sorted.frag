// Columns that were drawn in another order (lib/sorted.glsl), to their own places.
#include "lib/frame.glsl"
#include "lib/sorted.glsl"

uniform sampler2D picture;

layout(location = 0) out vec4 color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    color = texelFetch(picture, ivec2(drawn_at(at.x, int(window.x)), at.y), 0);
}
