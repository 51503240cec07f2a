// The camera offset of every sub-pixel of a panel. Needs viewmap.glsl. Filled by blocks.py.

layout(std140) uniform Cameras {
    vec4 camera_offsets[MAX_CAMERAS / 4];  // of all views of the panel, four by four
};

float camera_offset_of(int view) {
    return camera_offsets[view >> 2][view & 3];
}

// Camera offsets of the three sub-pixels of column x, row r of the panel. Between cameras they are linear in u, and
// continued beyond the outermost (viewmap.py, offset_at).
vec3 offsets_of_subpixels(int x, int r) {
    vec3 offset;
#ifdef CONTINUOUS
    dvec3 u = camera_coordinates(x, r);
    ivec3 k = clamp(ivec3(floor(u)), 0, max(view_count - 2, 0));
    vec3 part = vec3(u - dvec3(k));
    for (int c = 0; c < 3; ++c) {
        float low = camera_offset_of(k[c]), high = camera_offset_of(min(k[c] + 1, view_count - 1));
        offset[c] = low + part[c] * (high - low);
    }
#else
    ivec3 view = view_indices(x, r);
    for (int c = 0; c < 3; ++c) {
        offset[c] = camera_offset_of(view[c]);
    }
#endif
    return offset;
}
