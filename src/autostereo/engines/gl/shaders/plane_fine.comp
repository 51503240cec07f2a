// Stage 3: the fine rasteriser, an invocation per tile of the queue.
#define TRIANGLES
#define ENTRIES
#define DEPTHS
#define WINNERS
#ifdef PANEL
#define CAMERA_OFFSET
#else
#define BLOCKS
#endif
#include "lib/frame.glsl"
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_triangle.glsl"
#include "lib/plane_pass.glsl"
#include "lib/plane_order.glsl"
#include "lib/plane_tile.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

uniform int room;  // of the entries

void main() {
    uint k = invocation();
    if (k >= min(entry_count, uint(room))) {
        return;
    }
    uvec4 entry = imageLoad(entries, place_of(k));
    ivec3 tile = ivec3(entry.y & 4095u, (entry.y >> 12) & 4095u, entry.y >> 24);
    put_tile(triangle_at(entry.x), tile, entry.zw);
}
