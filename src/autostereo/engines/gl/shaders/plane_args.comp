// Between the stages of the plane rasteriser: sizes of the next dispatches, from the counts of the last.
#include "lib/plane_pass.glsl"

layout(local_size_x = 1) in;

uniform int after_stage;  // 0: nothing yet, 1: setup, 2: tiles
uniform int room;         // of the entries

const uint GROUPS = 65535u;  // in one direction, as many as every device has

void spread(int at, uint count, uint layers) {
    uint groups = (count + 63u) / 64u;
    dispatch[at] = min(groups, GROUPS);
    dispatch[at + 1] = (groups + GROUPS - 1u) / GROUPS;
    dispatch[at + 2] = layers;
}

void main() {
    uint groups = uint(pass_views.y), bands = uint(picture.y + 15) / 16u;
    if (after_stage == 0) {
        small_triangles = large_triangles = entry_count = 0u;
    } else if (after_stage == 1) {
        spread(0, small_triangles, groups);
        spread(3, large_triangles, groups * bands);
    } else {
        bool over = entry_count > uint(room);
        most_entries = max(most_entries, entry_count);
        spread(6, min(entry_count, uint(room)), 1u);
        spread(9, over ? small_triangles : 0u, groups);
        spread(12, over ? large_triangles : 0u, groups * bands);
    }
}
