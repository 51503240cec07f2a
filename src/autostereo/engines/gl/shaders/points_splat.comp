// Surfels to the samples that see them, an invocation a surfel (view, band of rows): its pixels, of a panel those around its
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
uniform vec4 sheet;         // its size; first row of the panel, or columns of tiles
uniform int band_rows;      // an invocation's share of a picture, or of a band of the panel
#ifdef PANEL
layout(rgba32f, binding = 4) readonly uniform image2D camera_offsets;  // of sub-pixels
uniform vec2 reach;      // least and greatest camera offset
uniform vec3 columns;
uniform float row;
#ifdef LATTICE
// Sub-pixels (UNITS 3), or pixels (1), whose phase grows by the same step: those of a slot are found without a search.
layout(r32f, binding = 5) readonly uniform image2D row_starts;  // phase of each row of the panel at its left end
uniform float phase_step;
uniform vec4 slots[SLOTS];  // least and greatest camera offset; between which phases
uniform bvec2 flip;
#endif
#else
uniform int first_view;  // of the atlas's
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

// The sample that looks along this ray; channel: of a panel's, that which it shows; stop: depth of what is opaque there.
void splat(uint sample_number, int channel, float v, float dx, float dy, float stop) {
    float depth, weight = meet(v, dx, dy, depth);
    if (min(weight, stop - depth) > 0.0 && depth >= depth_range.z) {
#ifdef NEAREST
        imageAtomicMin(nearest, place_of(sample_number), floatBitsToUint(depth));
#else
        float least = uintBitsToFloat(imageLoad(nearest, place_of(sample_number)).x);
        if (depth >= least * (1.0 + ROUNDING) + place.w) {
            return;
        }
        vec3 light = light_for(v);
        uint k = VALUES * sample_number;
#ifdef PANEL
        add(k, weight * light[channel]);
        add(k + 1u, weight);
#else
        for (int c = 0; c < 3; ++c) {
            add(k + uint(c), weight * light[c]);
        }
        add(k + 3u, weight);
#endif
#endif
    }
}

#ifdef PANEL
// A channel of a pixel, if its camera lies between these offsets; EXACT: it is the first of them.
void splat_channel(ivec2 pixel, int c, vec2 ends) {
    ivec2 at = pixel - ivec2(0, int(sheet.z));
#ifdef EXACT
    float camera = ends.x;
#else
    vec3 v = imageLoad(camera_offsets, at).rgb;
    float camera = c == 0 ? v.x : c == 1 ? v.y : v.z;
#endif
    float column = c == 0 ? columns.x : c == 1 ? columns.y : columns.z;
#ifndef EXACT
    if (camera < ends.x || camera >= ends.y) {
        return;
    }
#endif
    float dx = (float(pixel.x) + column - window.z) / lens.x - camera * depth_range.w;
    float dy = -(float(pixel.y) + row - window.w) / lens.y - lens.w * depth_range.w;
#ifdef STOPPED
    float stop = texelFetch(stops, at, 0)[c];
#else
    float stop = FAR;
#endif
    splat(3u * uint(at.y * int(window.x) + at.x) + uint(c), c, camera, dx, dy, stop);
}
#endif

#ifdef LATTICE
// The first unit from `unit` on whose phase may lie between these two; start: the row's phase at unit 0.
float next_unit(float unit, vec2 phases, float start) {
    float turn = floor(unit * phase_step + start - phases.x);
    return unit * phase_step + start <= turn + phases.y ? unit : ceil((turn + 1.0 + phases.x - start) / phase_step);
}
#endif

void main() {
    uint invoked = invocation();
    if (invoked >= count) {
        return;
    }
    int number = int(invoked);
    place = record(number, PLACE);
    vec4 box = record(number, BOX);
    vec2 low, high;
#ifdef PANEL
    float first_row = sheet.z + float(int(gl_WorkGroupID.z) * band_rows);
    vec4 bounds = vec4(0.0, first_row, window.x, min(min(sheet.z + sheet.y, window.y), first_row + float(band_rows)));
    find_quad(place.xyz, box, reach, bounds, low, high);
#else
    int height = int(atlas_size.w), bands = (height + band_rows - 1) / band_rows;
    int tile = int(gl_WorkGroupID.z) / bands, first_row = int(gl_WorkGroupID.z) % bands * band_rows;
    int tile_columns = int(sheet.z);
    float v = views[first_view + tile].x;
    vec4 bounds = vec4(0.0, first_row, atlas_size.z, min(first_row + band_rows, height));
    find_quad(place.xyz, box, vec2(v), bounds, low, high);
#endif
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
    int width = int(bounds.z);
#ifdef PANEL
#ifdef LATTICE
    // one loop over slots, rows and units: where invocations go together, nested ones would each wait for the longest
    int k = -1;
    vec4 slot;
    vec2 ends, range;
    float y = 0.0, bottom = 0.0, at = 0.0, end = 0.0, start;
    while (true) {
        if (at >= end) {
            y += 1.0;
            if (y >= bottom) {
                if (++k == SLOTS) {
                    break;
                }
                slot = slots[k];
#ifdef EXACT
                ends = slot.xy;
#else
                ends = vec2(k == 0 ? -FAR : slot.x, k == SLOTS - 1 ? FAR : slots[k + 1].x);
#endif
                find_quad(place.xyz, box, slot.xy, bounds, low, high);
                range = float(UNITS) * (flip.x ? window.x - vec2(high.x, low.x) : vec2(low.x, high.x));
                y = low.y;
                bottom = high.y;
            }
            if (y < bottom) {
                start = imageLoad(row_starts, ivec2(flip.y ? window.y - 1.0 - y : y, 0)).x;
                at = next_unit(range.x, slot.zw, start);
                end = range.y;
            }
        }
        if (at < end) {
#if UNITS == 3
            int unit = int(at), x = unit / 3, c = unit - 3 * x;
            splat_channel(ivec2(flip.x ? width - 1 - x : x, y), c, ends);
#else
            for (int c = 0; c < 3; ++c) {
                splat_channel(ivec2(flip.x ? width - 1 - int(at) : int(at), y), c, ends);
            }
#endif
            at = next_unit(at + 1.0, slot.zw, start);
        }
    }
#else
    for (int y = int(low.y); y < int(high.y); ++y) {
        for (int x = int(low.x); x < int(high.x); ++x) {
            for (int c = 0; c < 3; ++c) {
                splat_channel(ivec2(x, y), c, vec2(-FAR, FAR));
            }
        }
    }
#endif
#else
    ivec2 origin = ivec2(tile % tile_columns, tile / tile_columns) * ivec2(atlas_size.zw);
    uint offset = uint(tile * width * height);
    ivec4 range = ivec4(low, high);
    int x = range.x, y = range.y;
    while (y < range.w) {  // one loop, as above
        vec3 ray = ray_direction(vec2(x, y) + 0.5, v);
#ifdef STOPPED
        float stop = texelFetch(stops, ivec2(x, y) + origin, 0).r;
#else
        float stop = FAR;
#endif
        splat(offset + uint(y * width + x), 0, v, ray.x, ray.y, stop);
        bool ends = ++x == range.z;
        x = ends ? range.x : x;
        y += int(ends);
    }
#endif
}
