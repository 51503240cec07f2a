// Which camera each sub-pixel of a panel shows: ViewMap (viewmap.py) in a shader, equal to it for every sub-pixel.
//
// Switches: VIEWMAP_TABLE, else a phase; CELLS (pattern 1 ... 4) with CELL_COUNT; REVERSE. Filled by viewmap.py.
// A phase is computed in double precision in ViewMap's order of operations, without fused multiply-add: in single
// precision, and on the borders of views even with more digits but other roundings, sub-pixels would show other views.

#ifdef VIEWMAP_TABLE
uniform usampler2D view_table;    // texel (x mod w, r mod h), channels as r, g, b
uniform int view_count;
#else
layout(std140) uniform ViewMap {
    dvec4 phase_offset[MAX_CELLS];  // per cell: of the three channels
    dvec2 phase_step;               // per column and row
    int view_count;
    int panel_height;
};
#endif

#ifdef CELLS
int cell_of(int x, int r) {
    int y = panel_height - 1 - r;
#if CELLS == 1
    return ((x + y) & 1) % CELL_COUNT;
#elif CELLS == 2
    return (x & 1) % CELL_COUNT;
#elif CELLS == 3
    return ((y + 2 * (x & 1)) & 3) % CELL_COUNT;
#else
    return (y & 1) % CELL_COUNT;
#endif
}
#endif

#ifndef VIEWMAP_TABLE
// Phases in [0, 1) of the three sub-pixels of column x, row r from the top.
dvec3 phases(int x, int r) {
#ifdef CELLS
    dvec3 o = phase_offset[cell_of(x, r)].xyz;
#else
    dvec3 o = phase_offset[0].xyz;
#endif
    precise double along = phase_step.x * double(x);
    precise double down = phase_step.y * double(r);
    precise dvec3 t = (along + down) + o;
    precise dvec3 phi = t - floor(t);
#if defined(REVERSE) && defined(CONTINUOUS)
    phi = 1.0LF - phi;  // else views are counted before they are reversed
#endif
    return mix(phi, dvec3(0.0LF), greaterThanEqual(phi, dvec3(1.0LF)));  // 1 - 1e-17 rounds to 1
}
#endif

// View indices of the three sub-pixels of column x, row r from the top.
ivec3 view_indices(int x, int r) {
#ifdef VIEWMAP_TABLE
    ivec2 size = textureSize(view_table, 0);
    ivec3 view = ivec3(texelFetch(view_table, ivec2(x % size.x, r % size.y), 0).rgb);
#else
    precise dvec3 u = phases(x, r) * double(view_count);
    ivec3 view = min(ivec3(floor(u)), view_count - 1);
#endif
#ifdef REVERSE
    view = view_count - 1 - view;
#endif
    return view;
}

// Camera coordinates u of the three sub-pixels; whole numbers on panels that are not continuous.
#ifdef CONTINUOUS
dvec3 camera_coordinates(int x, int r) {
    precise dvec3 u = phases(x, r) * double(view_count) - 0.5LF;
    return u;
}
#endif

// The nearest view where cameras lie between views: what methods that draw views can show.
ivec3 nearest_views(int x, int r) {
#ifdef CONTINUOUS
    return clamp(ivec3(floor(camera_coordinates(x, r) + 0.5LF)), 0, view_count - 1);
#else
    return view_indices(x, r);
#endif
}

uniform bvec2 flip;  // the panel shows the picture mirrored

// Pixel of the picture that a panel's pixel shows, and the other way round.
ivec2 mirrored(ivec2 at, ivec2 size) {
    return ivec2(flip.x ? size.x - 1 - at.x : at.x, flip.y ? size.y - 1 - at.y : at.y);
}
