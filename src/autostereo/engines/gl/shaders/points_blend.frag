// Of all groups' surfels of a pixel, sums the shares of those within their own radius of the nearest: the image
// compositing pass of Huebner 2007b, section 3.5.2, whose epsilon is a constant.

uniform vec4 sheet;            // size of a tile; unused; columns of groups
uniform usampler2D shares;
uniform sampler2D epsilons;
uniform sampler2D kept;        // depth buffer: 1 where a group has nothing

layout(location = 0) out vec4 nearest;
layout(location = 1) out vec4 sums;
layout(location = 2) out vec4 weights;

ivec2 texel_of(int group) {
    int columns = int(sheet.w);
    return ivec2(gl_FragCoord.xy) + ivec2(group % columns, group / columns) * ivec2(sheet.xy);
}

void main() {
    float least = FAR;
    for (int k = 0; k < GROUPS; ++k) {
        ivec2 at = texel_of(k);
        if (texelFetch(kept, at, 0).r < 1.0) {
            least = min(least, uintBitsToFloat(texelFetch(shares, at, 0).a));
        }
    }
    nearest = vec4(least);
    sums = weights = vec4(0.0);
    for (int k = 0; k < GROUPS; ++k) {
        ivec2 at = texel_of(k);
        uvec4 share = texelFetch(shares, at, 0);
        float depth = uintBitsToFloat(share.a);
        if (texelFetch(kept, at, 0).r < 1.0 && depth <= least + texelFetch(epsilons, at, 0).r) {
            for (int c = 0; c < 3; ++c) {
                vec2 own = unpackHalf2x16(share[c]);
                sums[c] += own.x * own.y;
                weights[c] += own.y;
            }
        }
    }
}
