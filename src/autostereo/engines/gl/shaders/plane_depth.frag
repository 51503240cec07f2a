// The depths that the plane rasteriser found, into tiles of views.
#define DEPTHS
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"

uniform ivec2 picture;    // width; rows of this round
uniform int first_row;
uniform int first_tile;   // whose plane is the first
uniform int plane_count;

flat in int tile;
flat in vec2 origin;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy - origin) - ivec2(0, first_row);
    uint bits = 0xffffffffu;
    if (pixel.y >= 0 && pixel.y < picture.y) {
        bits = imageLoad(depths, place_of(sample_number(pixel, tile - first_tile, picture.x, plane_count))).x;
    }
    if (bits == 0xffffffffu) {
        discard;
    }
    gl_FragDepth = uintBitsToFloat(bits);
}
