// Which sub-pixels of each tile of a panel show which block of views, and every sub-pixel's camera offset.
#define SHOWN
#define CAMERA_OFFSET
#include "lib/frame.glsl"
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"
#include "lib/viewmap.glsl"
#include "lib/cameras.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

uniform ivec2 picture;   // width; rows of this round
uniform int first_row;
uniform ivec2 grouping;  // views per block, blocks

void main() {
    ivec2 tiles = (picture + 3) >> 2;
    int k = int(invocation());
    if (k >= tiles.x * tiles.y) {
        return;
    }
    ivec2 corner = 4 * ivec2(k % tiles.x, k / tiles.x);
    for (int b = 0; b < grouping.y; ++b) {
        imageStore(shown, place_of(uint(k * grouping.y + b)), uvec4(0u));
    }
    for (int i = 0; i < 16; ++i) {
        ivec2 pixel = corner + ivec2(i & 3, i >> 2);
        if (pixel.x >= picture.x || pixel.y >= picture.y) {
            continue;
        }
        ivec2 at = mirrored(ivec2(pixel.x, pixel.y + first_row), ivec2(window.xy));
        ivec3 block = nearest_views(at.x, at.y) / grouping.x;
        vec3 offset = offsets_of_subpixels(at.x, at.y);
        for (int c = 0; c < 3; ++c) {
            uvec2 bit = c < 2 ? uvec2(1u << (16 * c + i), 0u) : uvec2(0u, 1u << i);
            ivec2 place = place_of(uint(k * grouping.y + block[c]));
            imageStore(shown, place, imageLoad(shown, place) | uvec4(bit, 0u, 0u));
            imageStore(camera_offset, place_of(sample_number(pixel, c, picture.x, 3)), vec4(offset[c]));
        }
    }
}
