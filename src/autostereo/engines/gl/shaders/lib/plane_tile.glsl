// The fine rasteriser: a tile of 4 x 4 pixels and up to 4 views, voxel by voxel (PMR 2020, section 4.3).
//
// There are two rounds, as not every device has atomic operations of 64 bits: `find_depth` leaves the least depth in every
// voxel, the next round the first triangle of that depth. Needs frame.glsl, plane_memory.glsl, plane_triangle.glsl.
//
// Switches: PANEL: what counts are not voxels but the sub-pixels of a panel, each of which shows one camera; STAGGER: triangles
// begin with different views, so that at one time they change different addresses (section 4.3).

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
uniform ivec2 planes;      // first channel and how many of them
uniform bool find_depth;

Triangle triangle_at(uint slot) {
    Triangle t;
    for (int k = 0; k < 3; ++k) {
        t.corner[k] = imageLoad(triangles, place_of(4u * slot + uint(k)));
    }
    t.info = floatBitsToUint(imageLoad(triangles, place_of(4u * slot + 3u)));
    return t;
}

// Bits of window depth at (x, y, v); none if the triangle is seen from its edge.
uint depth_bits(Triangle t, float x, float y, float v) {
    precise vec3 xs = vec3(t.corner[0].x, t.corner[1].x, t.corner[2].x)
                      + v * vec3(t.corner[0].z, t.corner[1].z, t.corner[2].z);
    precise vec2 a = vec2(xs.y - xs.x, t.corner[1].y - t.corner[0].y);
    precise vec2 b = vec2(xs.z - xs.x, t.corner[2].y - t.corner[0].y);
    precise vec2 q = vec2(x - xs.x, y - t.corner[0].y);
    precise float area = a.x * b.y - b.x * a.y;
    if (area == 0.0) {
        return 0xffffffffu;
    }
    vec3 near = vec3(t.corner[0].w, t.corner[1].w, t.corner[2].w);
    precise float s = (q.x * b.y - b.x * q.y) / area;
    precise float r = (a.x * q.y - q.x * a.y) / area;
    precise float inverse = near.x + s * (near.y - near.x) + r * (near.z - near.x);
    inverse = clamp(inverse, min(near.x, min(near.y, near.z)), max(near.x, max(near.y, near.z)));
    precise float window_depth = (depth_range.x - inverse) / depth_range.y;
    return floatBitsToUint(clamp(window_depth, 0.0, 1.0));
}

void put(uint number, int at, uint bits) {
    ivec2 place = place_of(uint(at));
    if (find_depth) {
        imageAtomicMin(depths, place, bits);
    } else if (imageLoad(depths, place).x == bits) {
        imageAtomicMin(winners, place, number);
    }
}

// The position of the lowest bit, which is taken away.
int next_bit(inout uvec2 mask) {
    if (mask.x != 0u) {
        int bit = findLSB(mask.x);
        mask.x &= mask.x - 1u;
        return bit;
    }
    int bit = findLSB(mask.y);
    mask.y &= mask.y - 1u;
    return bit + 32;
}

#ifdef PANEL
// Coverage mask of a tile: those sub-pixels, bit c*16 + y*4 + x, that show a camera of the block and see the triangle.
uvec2 coverage(Triangle t, ivec3 tile) {
    int tiles_across = (picture.x + 3) >> 2, all_blocks = (pass_views.w + pass_views.z - 1) / pass_views.z;
    int entry = (tile.y * tiles_across + tile.x) * all_blocks + pass_views.x + tile.z;
    uvec2 left = imageLoad(shown, place_of(uint(entry))).xy, mask = uvec2(0u);
    Edge e[3] = Edge[3](edge_of(t, 0), edge_of(t, 1), edge_of(t, 2));
    bool both = (t.info.y & BOTH_SIDES) != 0u;
    while (left != uvec2(0u)) {
        uvec2 with = left;
        int bit = next_bit(left);
        ivec2 pixel = 4 * tile.xy + ivec2(bit & 3, (bit >> 2) & 3);
        vec2 place = vec2(pixel.x, pixel.y + first_row) + vec2(sample_at[bit >> 4], sample_at.w);
        int at = (((bit >> 4) - planes.x) * picture.y + pixel.y) * picture.x + pixel.x;
        float v = imageLoad(camera_offset, place_of(uint(at))).x;
        if ((covered(e, both, vec4(place.x), place.y, v) & 1u) != 0u) {
            mask |= with ^ left;
        }
    }
    return mask;
}

void put_tile(Triangle t, ivec3 tile, uvec2 mask) {
    while (mask != uvec2(0u)) {
        int bit = next_bit(mask);
        ivec2 pixel = 4 * tile.xy + ivec2(bit & 3, (bit >> 2) & 3);
        int at = (((bit >> 4) - planes.x) * picture.y + pixel.y) * picture.x + pixel.x;
        float v = imageLoad(camera_offset, place_of(uint(at))).x;
        vec2 place = vec2(pixel.x, pixel.y + first_row) + vec2(sample_at[bit >> 4], sample_at.w);
        put(t.info.x, at, depth_bits(t, place.x, place.y, v));
    }
}
#else
// Coverage mask of a tile: bit v*16 + y*4 + x.
uvec2 coverage(Triangle t, ivec3 tile) {
    Edge e[3] = Edge[3](edge_of(t, 0), edge_of(t, 1), edge_of(t, 2));
    bool both = (t.info.y & BOTH_SIDES) != 0u;
    int block = pass_views.x + tile.z;
    int views = min(pass_views.z, pass_views.w - block * pass_views.z);
    vec4 offset = imageLoad(blocks, ivec2(0, block));
    vec4 x = float(4 * tile.x) + sample_at.x + vec4(0.0, 1.0, 2.0, 3.0);
    uint columns = (1u << min(4, picture.x - 4 * tile.x)) - 1u;
    int top = max(4 * tile.y, int(t.info.z)), bottom = min(4 * tile.y + 3, int(t.info.w));
    uvec2 mask = uvec2(0u);
    for (int k = 0; k < views; ++k) {
        for (int row = top; row <= bottom; ++row) {
            uint bits = covered(e, both, x, float(row + first_row) + sample_at.w, offset[k]) & columns;
            bits <<= 4 * (row & 3) + 16 * (k & 1);
            mask |= k < 2 ? uvec2(bits, 0u) : uvec2(0u, bits);
        }
    }
    return mask;
}

void put_tile(Triangle t, ivec3 tile, uvec2 mask) {
    int first = tile.z * pass_views.z;
    vec4 offset = imageLoad(blocks, ivec2(0, pass_views.x + tile.z));
#ifdef STAGGER
    uint turned = t.info.x & 3u;  // begin with this view: 16 bits each
    mask = (turned & 2u) != 0u ? mask.yx : mask;
    mask = (turned & 1u) != 0u ? (mask >> 16) | (mask.yx << 16) : mask;
#endif
    while (mask != uvec2(0u)) {
        int bit = next_bit(mask);
#ifdef STAGGER
        bit = (bit + 16 * int(turned)) & 63;
#endif
        ivec2 pixel = 4 * tile.xy + ivec2(bit & 3, (bit >> 2) & 3);
        int at = ((first + (bit >> 4)) * picture.y + pixel.y) * picture.x + pixel.x;
        vec2 place = vec2(pixel.x, pixel.y + first_row) + sample_at.xw;
        put(t.info.x, at, depth_bits(t, place.x, place.y, offset[bit >> 4]));
    }
}
#endif

// Number of this invocation in a dispatch whose size has been spread over x and y.
uint invocation() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
}
