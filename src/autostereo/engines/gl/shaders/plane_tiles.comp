// Stage 2: the tile rasteriser (PMR 2020, section 4.2). Finds the tiles of 4 x 4 pixels x 4 views that a triangle may touch.
//
// An invocation looks at one triangle and sixteen views, in groups of 4 x 4 x 4 tiles: a group's tiles are the bits of a
// mask. First those within the triangle's box in each block of views, which slides with the parallax, then, if there are
// many, those not wholly outside one of the three side faces. Tiles go to the queue; one that finds no room there is
// rasterised at once, and `everything` repeats that for the second round.
#define TRIANGLES
#define ENTRIES
#define DEPTHS
#define WINNERS
#ifdef PANEL
#define SHOWN
#define CAMERA_OFFSET
#endif
#define BLOCKS
#include "lib/frame.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_triangle.glsl"
#include "lib/plane_pass.glsl"
#include "lib/plane_tile.glsl"

layout(local_size_x = 64) in;

uniform int room;              // of the entries
uniform int triangle_room;     // of the triangles
uniform bool large;            // triangles of many tiles: sixteen rows an invocation
uniform bool everything;       // rasterise all tiles here

const float SLACK = 1.0 / 64.0;  // of a pixel, for rounding
const float ROUNDING = 4e-6;     // of E's terms

int clamped(float x, int most) {
    return int(clamp(x, -1.0, float(most)));
}

// Four bits: those of first ... last in start ... start + 3.
uint run(int first, int last, int start) {
    int from = max(first - start, 0), to = min(last - start, 3);
    return from > to ? 0u : ((2u << (to - from)) - 1u) << from;
}

// Whether some sample of a tile may be inside, from its greatest (front) or least (back) value of each side face.
bool may_cover(Edge e[3], bool both, ivec2 tile, vec2 reach) {
    float x0 = float(4 * tile.x) + min(sample_at.x, min(sample_at.y, sample_at.z));
    float x1 = float(4 * tile.x + 3) + max(sample_at.x, max(sample_at.y, sample_at.z));
    float y0 = float(4 * tile.y + first_row) + sample_at.w;
    bool front = true, back = both;
    for (int k = 0; k < 3; ++k) {
        float most = -1e38, least = 1e38;
        vec2 low = edge_in_view(e[k], reach.x), high = edge_in_view(e[k], reach.y);
        for (int i = 0; i < 8; ++i) {
            vec2 part = terms(e[k], (i & 4) == 0 ? low : high, (i & 1) == 0 ? x0 : x1, (i & 2) == 0 ? y0 : y0 + 3.0);
            float value = part.x + part.y, slack = ROUNDING * (abs(part.x) + abs(part.y));
            most = max(most, value + slack);
            least = min(least, value - slack);
        }
        front = front && most >= 0.0;
        back = back && least <= 0.0;
    }
    return front || back;
}

void main() {
    uint k = invocation();
    if (k >= (large ? large_triangles : small_triangles)) {
        return;
    }
    uint slot = large ? uint(triangle_room) - 1u - k : k;
    Triangle t = triangle_at(slot);
    int layers = (pass_views.y + 3) / 4, layer = int(gl_WorkGroupID.z) % layers;
    ivec2 rows = ivec2(t.info.zw) >> 2;
    if (large) {
        int band = int(gl_WorkGroupID.z) / layers;
        rows = ivec2(max(rows.x, 4 * band), min(rows.y, 4 * band + 3));
    }
    if (rows.x > rows.y) {
        return;
    }

    // columns of tiles that the triangle's box slides over in each of four blocks of views
    vec3 x = vec3(t.corner[0].x, t.corner[1].x, t.corner[2].x), p = vec3(t.corner[0].z, t.corner[1].z, t.corner[2].z);
    float early = min(sample_at.x, min(sample_at.y, sample_at.z)) - SLACK;
    float late = max(sample_at.x, max(sample_at.y, sample_at.z)) + SLACK;
    ivec4 first = ivec4(1 << 20), last = ivec4(-1);
    vec2 reach[4];
    for (int b = 0; b < min(4, pass_views.y - 4 * layer); ++b) {
        reach[b] = imageLoad(blocks, ivec2(1, pass_views.x + 4 * layer + b)).xy;
        vec3 low = min(x + reach[b].x * p, x + reach[b].y * p), high = max(x + reach[b].x * p, x + reach[b].y * p);
        int column = max(clamped(ceil(min(low.x, min(low.y, low.z)) - late), picture.x), 0);
        int end = clamped(floor(max(high.x, max(high.y, high.z)) - early), picture.x - 1);
        if (column <= end) {
            first[b] = column >> 2;
            last[b] = end >> 2;
        }
    }
    int leftmost = min(min(first.x, first.y), min(first.z, first.w)) >> 2;
    int rightmost = max(max(last.x, last.y), max(last.z, last.w)) >> 2;
    bvec4 broad = greaterThan(last - first, ivec4(0));
    bool many = rows.y > rows.x && any(broad);
    bool both = (t.info.y & BOTH_SIDES) != 0u;
    Edge e[3];
    if (many) {
        e = Edge[3](edge_of(t, 0), edge_of(t, 1), edge_of(t, 2));
    }

    for (int gy = rows.x >> 2; gy <= rows.y >> 2; ++gy) {
        uint down = run(rows.x, rows.y, 4 * gy);
        down = (down & 1u) | (down & 2u) << 3 | (down & 4u) << 6 | (down & 8u) << 9;  // one bit in each row's four
        for (int gx = leftmost; gx <= rightmost; ++gx) {
            uvec2 mask = uvec2(run(first.x, last.x, 4 * gx) | run(first.y, last.y, 4 * gx) << 16,
                               run(first.z, last.z, 4 * gx) | run(first.w, last.w, 4 * gx) << 16) * down;
            ivec3 corner = ivec3(4 * gx, 4 * gy, 4 * layer);
            if (many) {
                uvec2 kept = uvec2(0u), left = mask;
                while (left != uvec2(0u)) {
                    uvec2 with = left;
                    int bit = next_bit(left);
                    if (may_cover(e, both, corner.xy + ivec2(bit & 3, (bit >> 2) & 3), reach[bit >> 4])) {
                        kept |= with ^ left;
                    }
                }
                mask = kept;
            }
            if (mask == uvec2(0u)) {
                continue;
            }
            uint at = everything ? uint(room) : atomicAdd(entry_count, uint(bitCount(mask.x) + bitCount(mask.y)));
            while (mask != uvec2(0u)) {
                int bit = next_bit(mask);
                ivec3 tile = corner + ivec3(bit & 3, (bit >> 2) & 3, bit >> 4);
                if (at < uint(room)) {
                    uint place = uint(tile.x) | uint(tile.y) << 12 | uint(tile.z) << 24;
                    imageStore(entries, place_of(at++), uvec4(slot, place, 0u, 0u));
                } else {
                    put_tile(t, tile, coverage(t, tile));
                }
            }
        }
    }
}
