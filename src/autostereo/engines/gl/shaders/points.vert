// Covering quads of surfels: around the projections for all cameras (PANEL; Huebner 2007b, section 3.2, DESIGN erratum
// 2), or for that of a view; every instance is one more view. Four vertices per surfel. Switch: GROUPS, their number:
// surfels take turns in groups, each drawn to a tile of its own.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/surfels.glsl"

layout(std430, binding = 1) readonly buffer Surfels { Surfel surfels[]; };

uniform vec4 sheet;         // size of what is drawn on; columns of tiles, or the first row of a band; columns of groups
uniform vec4 sample_range;  // least and greatest position, in x and in y, at which pixels are sampled

flat out vec4 place;        // see lib/surfels.glsl
flat out vec4 normal;
flat out vec4 shape;
flat out vec4 area;
flat out vec3 color;

#ifdef PANEL
#ifdef SIDES
flat out vec3 back;
#endif
uniform vec2 reach;         // least and greatest camera offset
#else
uniform int first_view;     // of the atlas's
flat out float camera_offset;
flat out vec2 origin;       // of the tile on the sheet
#endif

void main() {
    Surfel s = surfels[gl_VertexID >> 2];
    place = s.place;
    normal = s.normal;
    shape = s.shape;
    area = s.area;
    color = s.color.rgb;
#if defined(PANEL) && defined(SIDES)
    back = s.back.rgb;
#endif

#ifdef PANEL
    vec2 left = picture_times_depth(place.xyz, reach.x) / place.z, right = picture_times_depth(place.xyz, reach.y) / place.z;
    vec2 size = window.xy, origin = vec2(0.0, -sheet.z);
#ifdef GROUPS
    int group = (gl_VertexID >> 2) % GROUPS, group_columns = int(sheet.w);
    origin += vec2(group % group_columns, group / group_columns) * sheet.xy;
    vec2 target = sheet.xy * vec2(group_columns, (GROUPS + group_columns - 1) / group_columns);
#else
    vec2 target = sheet.xy;
#endif
#else
    vec4 view = views[first_view + gl_InstanceID];
    vec2 left = picture_times_depth(place.xyz, view.x) / place.z, right = left, size = atlas_size.zw, target = sheet.xy;
    int columns = int(sheet.z);
    origin = vec2(gl_InstanceID % columns, gl_InstanceID / columns) * size;
    camera_offset = view.x;
#ifdef SIDES
    float side = side_seen(view.x, place.xyz, normal.xyz);
    color = chosen(s.back.rgb, s.color.rgb, side);
#ifdef OWN_EYE
    color += highlights(view.x, side, place.xyz, normal.xyz, area.zw);
#endif
#endif
#endif
    vec2 low = min(left, right) + s.box.xz, high = max(left, right) + s.box.yw;

    // pixels that are sampled within
    low = max(ceil(low - sample_range.yw), vec2(0.0));
    high = min(floor(high - sample_range.xz) + 1.0, size);
#ifdef PANEL
    low.y = max(low.y, sheet.z);
    high.y = min(high.y, sheet.z + sheet.y);
#endif
    if (s.box.x > s.box.y || !(low.x < high.x && low.y < high.y)) {
        low = high = vec2(0.0);
    }
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? low.x : high.x, (gl_VertexID & 2) == 0 ? low.y : high.y);
    float z = 0.0;
#ifdef STOPPED
    float nearest = max(place.z - place.w * sqrt(max(1.0 - normal.z * normal.z, 0.0)), depth_range.z);
    z = max(2.0 * window_from_depth(nearest) - 1.0, -1.0);
#endif
    gl_Position = vec4(2.0 * (corner + origin) / target - 1.0, z, 1.0);
}
