// The fine rasteriser: what a tile of 4 x 4 pixels and up to 4 views holds of a triangle, voxel by voxel (PMR 2020, 4.3).
//
// There are two rounds, as not every device has atomic operations of 64 bits: `find_depth` leaves the least depth in every
// voxel, the next round the first triangle of that depth. Needs frame.glsl, plane_memory.glsl, plane_triangle.glsl,
// plane_pass.glsl, plane_order.glsl.
//
// Switch: PANEL: what counts are not voxels but the sub-pixels of a panel, each of which shows one camera.

uniform bool find_depth;

Triangle triangle_at(uint slot) {
    Triangle t;
    for (int k = 0; k < 3; ++k) {
        t.corner[k] = uintBitsToFloat(imageLoad(triangles, place_of(4u * slot + uint(k))));
    }
    t.info = imageLoad(triangles, place_of(4u * slot + 3u));
    return t;
}

// Window depth in view v: where the farthest corner is (there digits count most), what is gained per pixel to the right
// and down, and least and greatest.
struct Depth {
    vec3 start;
    vec2 gain;
    vec2 range;
    bool none;   // seen from its edge
};

Depth depth_of(Triangle t, float v) {
    precise vec3 xs = vec3(t.corner[0].x, t.corner[1].x, t.corner[2].x)
                      + v * vec3(t.corner[0].z, t.corner[1].z, t.corner[2].z);
    precise vec3 a = vec3(xs.y - xs.x, t.corner[1].yw - t.corner[0].yw);
    precise vec3 b = vec3(xs.z - xs.x, t.corner[2].yw - t.corner[0].yw);
    precise float area = a.x * b.y - b.x * a.y;
    precise float right = (a.z * b.y - b.z * a.y) / area, down = (a.x * b.z - b.x * a.z) / area;
    vec3 z = vec3(t.corner[0].w, t.corner[1].w, t.corner[2].w);
    vec2 range = vec2(min(z.x, min(z.y, z.z)), max(z.x, max(z.y, z.z)));
    vec3 start = z.y > z.x ? vec3(xs.y, t.corner[1].y, z.y) : vec3(xs.x, t.corner[0].y, z.x);
    start = z.z > start.z ? vec3(xs.z, t.corner[2].y, z.z) : start;
    return Depth(start, vec2(right, down), range, area == 0.0);
}

// Its bits at (x, y). Rounding must not lead out of the triangle.
uint depth_bits(Depth d, float x, float y) {
    precise float z = d.start.z + d.gain.x * (x - d.start.x) + d.gain.y * (y - d.start.y);
    return floatBitsToUint(clamp(z, d.range.x, d.range.y));
}

void put(uint number, uint at, uint bits) {
    ivec2 place = place_of(at);
    if (find_depth) {
        imageAtomicMin(depths, place, bits);
    } else if (imageLoad(depths, place).x == bits) {
        imageAtomicMin(winners, place, number);
    }
}

#ifdef PANEL
// A sub-pixel of a tile: bit c*16 + y*4 + x. Its number, its place, and its camera's offset.
struct SubPixel {
    uint number;
    vec2 place;
    float offset;
};

SubPixel sub_pixel(ivec3 tile, int bit) {
    int c = bit >> 4;
    ivec2 pixel = 4 * tile.xy + ivec2(bit & 3, (bit >> 2) & 3);
    uint number = sample_number(pixel, c, picture.x, plane_count);
    float column = c == 0 ? sample_at.x : c == 1 ? sample_at.y : sample_at.z;
    vec2 place = vec2(pixel.x, pixel.y + first_row) + vec2(column, sample_at.w);
    return SubPixel(number, place, imageLoad(camera_offset, place_of(number)).x);
}

void put_tile(Triangle t, ivec3 tile, uvec2 mask) {
    uint begin = first_plane(t.info.x);
    mask = turned(mask, begin);
    while (mask != uvec2(0u)) {
        SubPixel s = sub_pixel(tile, next_turned(mask, begin));
        Depth d = depth_of(t, s.offset);
        if (!d.none) {
            put(t.info.x, s.number, depth_bits(d, s.place.x, s.place.y));
        }
    }
}
#else
void put_tile(Triangle t, ivec3 tile, uvec2 mask) {
    vec4 offset = imageLoad(blocks, ivec2(0, pass_views.x + tile.z));
    vec2 corner = vec2(4 * tile.x, 4 * tile.y + first_row) + sample_at.xw;
    uint start = sample_number(4 * tile.xy, tile.z * pass_views.z, picture.x, plane_count);
    uint begin = first_plane(t.info.x);
    mask = turned(mask, begin);
    while (mask != uvec2(0u)) {
        int bit = next_turned(mask, begin);
        vec2 pair = bit < 32 ? offset.xy : offset.zw;
        Depth d = depth_of(t, (bit & 16) == 0 ? pair.x : pair.y);
        if (!d.none) {
            put(t.info.x, start + uint(bit), depth_bits(d, corner.x + float(bit & 3), corner.y + float((bit >> 2) & 3)));
        }
    }
}
#endif
