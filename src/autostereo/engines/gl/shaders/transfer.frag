// A picture from one texture into another, as it is stored with 8 bits.
#include "lib/color.glsl"
uniform sampler2D picture;
out vec4 color;
void main() {
    vec4 texel = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
    color = vec4(quantized(texel.rgb), texel.a);
}
