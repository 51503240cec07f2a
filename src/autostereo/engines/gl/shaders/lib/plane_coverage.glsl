// Which voxels of a tile, or sub-pixels of a panel's, a triangle covers. Needs plane_tile.glsl and what that needs.

#ifdef PANEL
// Pixels of a tile within a box, of rows and of columns from `span.x` to `span.y`: bit y*4 + x.
uint pixels_within(ivec2 tile, ivec2 rows, vec2 span) {
    vec2 columns = span - vec2(sample_at.z, sample_at.x) - float(4 * tile.x);
    int left = int(max(ceil(columns.x), 0.0)), right = int(min(floor(columns.y), 3.0));
    int top = max(rows.x - 4 * tile.y, 0), bottom = min(rows.y - 4 * tile.y, 3);
    if (left > right || top > bottom) {
        return 0u;
    }
    uint across = ((2u << (right - left)) - 1u) << left, down = ((2u << 4 * (bottom - top) + 3) - 1u) << 4 * top;
    return (across * 0x1111u) & down;
}

// Coverage mask of a tile: those sub-pixels that show a camera of the block and see the triangle, whose side faces are e
// and which spans some columns in the block.
uvec2 coverage(Triangle t, Edge e[3], vec2 span, ivec3 tile) {
    int tiles_across = (picture.x + 3) >> 2, all_blocks = (pass_views.w + pass_views.z - 1) / pass_views.z;
    int entry = (tile.y * tiles_across + tile.x) * all_blocks + pass_views.x + tile.z;
    uint box = pixels_within(tile.xy, ivec2(t.info.zw), span);
    uvec2 left = imageLoad(shown, place_of(uint(entry))).xy & uvec2(box | box << 16, box), mask = uvec2(0u);
    bool both = (t.info.y & BOTH_SIDES) != 0u;
    while (left != uvec2(0u)) {
        uvec2 with = left;
        SubPixel s = sub_pixel(tile, next_bit(left));
        bvec3 is_before;
        for (int k = 0; k < 3; ++k) {
            is_before[k] = before(e[k], edge_in_view(e[k], s.offset), s.place.x, s.place.y);
        }
        mask |= all(is_before) || (both && !any(is_before)) ? with ^ left : uvec2(0u);
    }
    return mask;
}
#else
// Coverage mask of a tile: bit v*16 + y*4 + x.
uvec2 coverage(Triangle t, Edge e[3], vec2 span, ivec3 tile) {
    uint both = (t.info.y & BOTH_SIDES) != 0u ? 15u : 0u;
    int block = pass_views.x + tile.z;
    int views = min(pass_views.z, pass_views.w - block * pass_views.z);
    vec4 offset = imageLoad(blocks, ivec2(0, block));
    vec4 x = float(4 * tile.x) + sample_at.x + vec4(0.0, 1.0, 2.0, 3.0);
    uint columns = (1u << min(4, picture.x - 4 * tile.x)) - 1u;
    int top = max(4 * tile.y, int(t.info.z)), bottom = min(4 * tile.y + 3, int(t.info.w));
    uvec2 mask = uvec2(0u);
    for (int k = 0; k < views; ++k) {
        vec2 in0 = edge_in_view(e[0], offset.x), in1 = edge_in_view(e[1], offset.x), in2 = edge_in_view(e[2], offset.x);
        offset = offset.yzwx;
        uint found = 0u;
        for (int row = top; row <= bottom; ++row) {
            float y = float(row + first_row) + sample_at.w;
            uint a = columns_before(e[0], in0, x, y), b = columns_before(e[1], in1, x, y), c = columns_before(e[2], in2, x, y);
            found |= (((a & b & c) | (both & ~(a | b | c))) & columns) << 4 * (row & 3);
        }
        found <<= 16 * (k & 1);
        mask |= k < 2 ? uvec2(found, 0u) : uvec2(0u, found);
    }
    return mask;
}
#endif
