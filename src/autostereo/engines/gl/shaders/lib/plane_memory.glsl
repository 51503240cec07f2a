// The plane rasteriser's arrays, element i at place_of(i) (memory.glsl). Made by plane_buffers.py.
//
// Switches: those that a stage uses, as devices may have eight images a stage and no more.

#ifdef TRIANGLES
// four texels each, as bits (lib/plane_triangle.glsl): whole numbers as floats would be denormal, which devices may flush
layout(rgba32ui, binding = 0) uniform uimage2D triangles;
#endif
#ifdef ENTRIES
layout(rgba32ui, binding = 1) uniform uimage2D entries;    // triangle; tile's column, row, block in 12, 12, 8 bits; coverage
#endif
#ifdef DEPTHS
layout(r32ui, binding = 2) uniform uimage2D depths;        // per voxel, or sub-pixel: bits of window depth
#endif
#ifdef WINNERS
layout(r32ui, binding = 3) uniform uimage2D winners;       // number of the triangle that is seen
#endif
#ifdef SHOWN
layout(rg32ui, binding = 4) uniform uimage2D shown;        // per tile of a panel and block: bits c*16 + y*4 + x
#endif
#ifdef CAMERA_OFFSET
layout(r32f, binding = 5) uniform image2D camera_offset;   // per sub-pixel of a panel
#endif
#ifdef POINTS
layout(rgba32f, binding = 6) uniform image2D points;       // vertices in eye space
#endif
#ifdef BLOCKS
layout(rgba32f, binding = 7) uniform image2D blocks;       // row b: offsets of its views; least and greatest
#endif

// Number of a sample in a round: the 16 pixels of a tile lie together, and a tile's planes (views, or channels of a panel).
uint sample_number(ivec2 pixel, int plane, int width, int plane_count) {
    ivec2 tile = pixel >> 2;
    return uint(((tile.y * ((width + 3) >> 2) + tile.x) * plane_count + plane) * 16 + 4 * (pixel.y & 3) + (pixel.x & 3));
}
