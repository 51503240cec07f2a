// Stage 3: the fine rasteriser, an invocation per tile of the queue. The first round leaves its coverage mask for the second.
#define TRIANGLES
#define ENTRIES
#define DEPTHS
#define WINNERS
#ifdef PANEL
#define SHOWN
#define CAMERA_OFFSET
#else
#define BLOCKS
#endif
#include "lib/frame.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_triangle.glsl"
#include "lib/plane_pass.glsl"
#include "lib/plane_tile.glsl"

layout(local_size_x = 64) in;

uniform int room;    // of the entries
uniform bool known;  // coverage masks: from the round before

void main() {
    uint k = invocation();
    if (k >= min(entry_count, uint(room))) {
        return;
    }
    uvec4 entry = imageLoad(entries, place_of(k));
    ivec3 tile = ivec3(entry.y & 4095u, (entry.y >> 12) & 4095u, entry.y >> 24);
    Triangle t = triangle_at(entry.x);
    if (!known) {
        entry.zw = coverage(t, tile);
        imageStore(entries, place_of(k), entry);
    }
    put_tile(t, tile, entry.zw);
}
