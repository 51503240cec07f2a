// The views of an atlas: their camera offsets, and where in the atlas their tiles begin. Needs frame.glsl.
// Filled by blocks.py. Row 0 of an atlas is the top of the topmost tiles, so that it is read back rows from the top.

layout(std140) uniform Views {
    vec4 atlas_size;          // width, height of the atlas in pixels; of a tile
    vec4 views[ATLAS_VIEWS];  // camera offset; first column and row of the tile; unused
};

// Clip-space position of an eye-space point in a view's tile, and the four sides that the tile is cut at.
vec4 clip_in_tile(vec3 eye, vec4 view, out vec4 sides) {
    vec2 p = picture_times_depth(eye, view.x);
    sides = vec4(p, atlas_size.zw * eye.z - p);
    vec2 xy = 2.0 * (p + view.yz * eye.z) / atlas_size.xy - eye.z;
    float z = 2.0 * (depth_range.x * eye.z - 1.0) / depth_range.y - eye.z;
    return vec4(xy, z, eye.z);
}
