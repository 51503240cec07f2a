// Stage 2: the tile rasteriser (PMR 2020, section 4.2). Finds the tiles of 4 x 4 pixels x 4 views that a triangle covers.
//
// An invocation looks at one triangle in one block of views: at those tiles within the triangle's box, which slides with the
// parallax; if there are many, at those not wholly outside one of the three side faces. Tiles that are covered go to the
// queue with their coverage masks; one that finds no room there is rasterised at once, and `everything` repeats that for
// the second round.
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
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_triangle.glsl"
#include "lib/plane_pass.glsl"
#include "lib/plane_order.glsl"
#include "lib/plane_tile.glsl"
#include "lib/plane_coverage.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

uniform int room;              // of the entries
uniform int triangle_room;     // of the triangles
uniform bool large;            // triangles of many tiles: sixteen rows an invocation
uniform bool everything;       // rasterise all tiles here

const float SLACK = 1.0 / 64.0;  // of a pixel, for rounding
const int FEW = 4;               // rows or columns of tiles, which are not looked at as wholes
const float ROUNDING = 4e-6;     // of E's terms

int clamped(float x, int most) {
    return int(clamp(x, -1.0, float(most)));
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

// A tile to the queue, if it is covered; or, where it finds no room there, to the picture.
void place(uint slot, Triangle t, Edge e[3], vec2 span, ivec3 tile) {
    uvec2 mask = coverage(t, e, span, tile);
    if (mask == uvec2(0u)) {
        return;
    }
    uint at = everything ? uint(room) : atomicAdd(entry_count, 1u);
    if (at < uint(room)) {
        uint where = uint(tile.x) | uint(tile.y) << 12 | uint(tile.z) << 24;
        imageStore(entries, place_of(at), uvec4(slot, where, mask));
    } else {
        put_tile(t, tile, mask);
    }
}

void main() {
    uint k = invocation();
    if (k >= (large ? large_triangles : small_triangles)) {
        return;
    }
    uint slot = large ? uint(triangle_room) - 1u - k : k;
    Triangle t = triangle_at(slot);
    int block = int(gl_WorkGroupID.z) % pass_views.y;
    ivec2 rows = ivec2(t.info.zw) >> 2;
    if (large) {
        int band = int(gl_WorkGroupID.z) / pass_views.y;
        rows = ivec2(max(rows.x, 4 * band), min(rows.y, 4 * band + 3));
    }
    if (rows.x > rows.y) {
        return;
    }

    // columns of tiles that the triangle's box slides over in the block of views
    vec3 x = vec3(t.corner[0].x, t.corner[1].x, t.corner[2].x), p = vec3(t.corner[0].z, t.corner[1].z, t.corner[2].z);
    vec2 reach = imageLoad(blocks, ivec2(1, pass_views.x + block)).xy;
    vec3 left = x + reach.x * p, right = x + reach.y * p, low = min(left, right), high = max(left, right);
    float early = min(sample_at.x, min(sample_at.y, sample_at.z));
    float late = max(sample_at.x, max(sample_at.y, sample_at.z));
    vec2 span = vec2(min(low.x, min(low.y, low.z)) - SLACK, max(high.x, max(high.y, high.z)) + SLACK);
    int first = max(clamped(ceil(span.x - late), picture.x), 0), last = clamped(floor(span.y - early), picture.x - 1);
    if (first > last) {
        return;
    }
    first >>= 2;
    last >>= 2;

    bool many = last - first >= FEW && rows.y - rows.x >= FEW, both = (t.info.y & BOTH_SIDES) != 0u;
    Edge e[3] = Edge[3](edge_of(t, 0), edge_of(t, 1), edge_of(t, 2));
    for (int row = rows.x; row <= rows.y; ++row) {
        for (int column = first; column <= last; ++column) {
            if (!many || may_cover(e, both, ivec2(column, row), reach)) {
                place(slot, t, e, span, ivec3(column, row, block));
            }
        }
    }
}
