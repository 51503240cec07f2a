// Stage 1: primitive setup (PMR 2020, section 4.1): clip at the near plane, project, snap, cull over the union of all views.
#define TRIANGLES
#define POINTS
#include "lib/frame.glsl"
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_triangle.glsl"
#include "lib/plane_pass.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

layout(rgba32ui, binding = 1) readonly uniform uimage2D corners;  // three vertices of each triangle of the part

uniform ivec2 range;         // of the part's triangles: first, how many
uniform int first_triangle;  // number in the scene of the part's first
uniform bool two_sided;
uniform vec2 reach;          // least and greatest camera offset of this pass
uniform int room;            // of the triangles

const float SNAP = 16384.0;       // steps of a pixel; coarser ones are seen in the depths of floors
const float FAR_OUT = 1e9;        // pixels that still are whole numbers of 32 bits
const float LARGE_TILES = 256.0;  // more than these are looked at by many invocations

// Position at offset 0, snapped; change per offset; window depth.
vec4 projected(vec3 p) {
    precise vec2 at = floor(picture_times_depth(p, 0.0) / p.z * SNAP + 0.5) / SNAP;
    return vec4(clamp(at, -FAR_OUT, FAR_OUT), lens.x * (depth_range.w - 1.0 / p.z),
                clamp(window_from_depth(p.z), 0.0, 1.0));
}

bool after(vec3 a, vec3 b) {
    return a.y != b.y ? a.y > b.y : a.x != b.x ? a.x > b.x : a.z > b.z;
}

void emit(vec4 a, vec4 b, vec4 c, uint number) {
    // rows from the top: what is counter-clockwise in space is clockwise here
    Triangle t;
    t.corner = vec4[3](a, c, b);
    float low = min(a.y, min(b.y, c.y)), high = max(a.y, max(b.y, c.y));
    vec3 x = vec3(a.x, b.x, c.x), p = vec3(a.z, b.z, c.z), left = x + reach.x * p, right = x + reach.y * p;
    vec3 least = min(left, right), most = max(left, right);
    float leftmost = min(least.x, min(least.y, least.z)), rightmost = max(most.x, max(most.y, most.z));
    float first = max(ceil(low - sample_at.w) - float(first_row), 0.0);
    float last = min(floor(high - sample_at.w) - float(first_row), float(picture.y - 1));
    if (first > last || rightmost < 0.0 || leftmost > float(picture.x)) {
        return;
    }
    // facing is affine in the camera offset: what turns its back to both ends of the row of cameras turns it to all
    vec2 area = vec2(area_of(t, reach.x), area_of(t, reach.y));
    if (two_sided ? area == vec2(0.0) : all(lessThanEqual(area, vec2(0.0)))) {
        return;
    }
    uint flags = two_sided ? BOTH_SIDES : 0u;
#ifndef PLANAR
    for (int k = 0; k < 3; ++k) {
        if (after(t.corner[(k + 1) % 3].xyz, t.corner[(k + 2) % 3].xyz)) {
            flags |= 1u << k;
        }
    }
#endif
    t.info = uvec4(number, flags, uint(first), uint(last));
    vec2 wide = vec2(max(left.x, max(left.y, left.z)) - min(left.x, min(left.y, left.z)),
                     max(right.x, max(right.y, right.z)) - min(right.x, min(right.y, right.z)));
    bool large = (min(max(wide.x, wide.y), float(picture.x)) / 4.0 + 1.0) * ((last - first) / 4.0 + 1.0) > LARGE_TILES;
    uint slot = large ? uint(room) - 1u - atomicAdd(large_triangles, 1u) : atomicAdd(small_triangles, 1u);
    for (int k = 0; k < 3; ++k) {
        imageStore(triangles, place_of(4u * slot + uint(k)), floatBitsToUint(t.corner[k]));
    }
    imageStore(triangles, place_of(4u * slot + 3u), t.info);
}

void main() {
    uint k = invocation();
    if (k >= uint(range.y)) {
        return;
    }
    k += uint(range.x);
    uint number = uint(first_triangle) + k;
    float near = depth_range.z;
    uvec4 vertex = imageLoad(corners, place_of(k));
    vec3 corner[3];
    int before = 0;
    for (int i = 0; i < 3; ++i) {
        corner[i] = imageLoad(points, place_of(vertex[i])).xyz;
        before += corner[i].z >= near ? 0 : 1;
    }
    if (before == 0) {
        emit(projected(corner[0]), projected(corner[1]), projected(corner[2]), number);
        return;
    }
    if (before == 3) {
        return;
    }
    // both triangles at an edge cut it from its inner end, at exactly the same point
    vec4 kept[4];
    int count = 0;
    for (int i = 0; i < 3; ++i) {
        vec3 a = corner[i], b = corner[(i + 1) % 3];
        if (a.z >= near) {
            kept[count++] = projected(a);
        }
        if ((a.z >= near) != (b.z >= near)) {
            vec3 inner = a.z >= near ? a : b, outer = a.z >= near ? b : a;
            precise vec2 cut = inner.xy + (near - inner.z) / (outer.z - inner.z) * (outer.xy - inner.xy);
            kept[count++] = projected(vec3(cut, near));
        }
    }
    emit(kept[0], kept[1], kept[2], number);
    if (count == 4) {
        emit(kept[0], kept[2], kept[3], number);
    }
}
