// Stage 3: the fine rasteriser, an invocation per tile of the queue.
#include "lib/frame.glsl"
#include "lib/plane_triangle.glsl"
#include "lib/plane_tile.glsl"

layout(local_size_x = 64) in;

uniform int room;  // of Entries

void main() {
    uint k = invocation();
    if (k >= min(entry_count, uint(room))) {
        return;
    }
    uvec2 entry = entries[k];
    raster_tile(triangles[entry.x], ivec3(entry.y & 4095u, (entry.y >> 12) & 4095u, entry.y >> 24));
}
