// Surfels to the samples that see them, an invocation a surfel (and view): its pixels, of a panel those around its
// projections for all cameras (PANEL; Huebner 2007b, section 3.2), meet its disc with the ray of each sample. Run twice: for
// the least depth (NEAREST), then for the shares of those within their own radius of it.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/memory.glsl"
#include "lib/surfels.glsl"
#define GIVEN
#include "lib/discs.glsl"
#include "lib/covering.glsl"
#include "lib/sums.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

uniform uint count;
#ifdef PANEL
layout(rgba32f, binding = 4) readonly uniform image2D camera_offsets;  // of sub-pixels
uniform vec2 reach;      // least and greatest camera offset
#define SAMPLES 3u
#define MINE rgb
#else
uniform vec4 sheet;      // size; columns of tiles
uniform int first_view;  // of the atlas's
#define SAMPLES 1u
#define MINE r
#endif
#ifdef STOPPED
uniform sampler2D stops; // depths of what is opaque
#endif

#ifndef NEAREST
void add(uint k, float value) {
    uint amount = uint(clamp(value, 0.0, 127.0) * UNIT + 0.5);
    uint before = imageAtomicAdd(low_words, place_of(k), amount);
    if (before + amount < before) {
        imageAtomicAdd(high_words, place_of(k), 1u);
    }
}
#endif

// Samples from number `first` on, of one pixel, that look along these rays; stop: depths of what is opaque there.
void splat(uint first, real v, real dx, float dy, real stop) {
    real depth, weight = meet(v, dx, dy, depth), margin = min(weight, stop - depth);
#ifndef NEAREST
#ifdef PANEL
    for (int c = 0; c < 3; ++c) {
        float least = uintBitsToFloat(imageLoad(nearest, place_of(first + uint(c))).x);
        margin[c] = min(margin[c], least * (1.0 + ROUNDING) + place.w - depth[c]);
    }
#else
    margin = min(margin, uintBitsToFloat(imageLoad(nearest, place_of(first)).x) * (1.0 + ROUNDING) + place.w - depth);
#endif
    vec3 light = light_for(v);
#endif
#ifdef PANEL
    for (int c = 0; c < 3; ++c) {
        if (margin[c] > 0.0 && depth[c] >= depth_range.z) {
            uint k = first + uint(c);
#ifdef NEAREST
            imageAtomicMin(nearest, place_of(k), floatBitsToUint(depth[c]));
#else
            add(VALUES * k, weight[c] * light[c]);
            add(VALUES * k + 1u, weight[c]);
#endif
        }
    }
#else
    if (margin > 0.0 && depth >= depth_range.z) {
#ifdef NEAREST
        imageAtomicMin(nearest, place_of(first), floatBitsToUint(depth));
#else
        for (int c = 0; c < 3; ++c) {
            add(VALUES * first + uint(c), weight * light[c]);
        }
        add(VALUES * first + 3u, weight);
#endif
    }
#endif
}

void main() {
    uint k = invocation();
    if (k >= count) {
        return;
    }
    int number = int(k);
    place = record(number, PLACE);
#ifdef PANEL
    vec2 ends = reach;
    vec4 bounds = vec4(0.0, sheet.z, window.x, min(sheet.z + sheet.y, window.y));
    ivec2 origin = ivec2(0, -int(sheet.z));
    uint offset = 0u;
#else
    int tile = int(gl_WorkGroupID.z), tile_columns = int(sheet.z);
    float v = views[first_view + tile].x;
    vec2 ends = vec2(v);
    vec4 bounds = vec4(0.0, 0.0, atlas_size.zw);
    ivec2 origin = ivec2(tile % tile_columns, tile / tile_columns) * ivec2(atlas_size.zw);
    uint offset = uint(tile) * uint(atlas_size.z) * uint(atlas_size.w);
#endif
    vec2 low, high;
    find_quad(place.xyz, record(number, BOX), ends, bounds, low, high);
    if (low.x >= high.x) {
        return;
    }
    normal = record(number, NORMAL);
    shape = record(number, SHAPE);
    area = record(number, AREA);
    color = record(number, COLOR).rgb;
#ifdef SIDES
    back = record(number, BACK).rgb;
#endif
    ivec4 box = ivec4(low, high);
    uint width = uint(bounds.z);
    for (int y = box.y; y < box.w; ++y) {
        for (int x = box.x; x < box.z; ++x) {
            ivec2 at = ivec2(x, y) + origin;
#ifdef PANEL
            vec3 v = imageLoad(camera_offsets, at).rgb, dx;
            float dy;
            rays_of(at, v, dx, dy);
            uint first = 3u * (uint(at.y) * width + uint(x));
#else
            vec3 ray = ray_direction(vec2(x, y) + 0.5, v);
            float dx = ray.x, dy = ray.y;
            uint first = offset + uint(y) * width + uint(x);
#endif
#ifdef STOPPED
            real stop = texelFetch(stops, at, 0).MINE;
#else
            real stop = real(FAR);
#endif
            splat(first, v, dx, dy, stop);
        }
    }
}
