// What all stages of a pass of the plane rasteriser know: counts, the picture, where its samples are.

layout(std430, binding = 0) buffer Counters {
    uint small_triangles;     // from the front of the triangles
    uint large_triangles;     // from their end
    uint entry_count;         // asked for, also beyond the room there is
    uint most_entries;        // that a pass asked for since last read
    uint unused[4];
    uint dispatch[5 * 3];     // tiles of small, of large triangles; entries; small, large triangles once more
};

uniform ivec2 picture;     // width; rows of this round
uniform int first_row;     // of this round
uniform ivec4 pass_views;  // first block, blocks of this pass; views per block; views in all
uniform vec4 sample_at;    // where in a pixel samples are: x of three channels, y
uniform int plane_count;   // views of the pass, or channels: samples of a tile lie together
