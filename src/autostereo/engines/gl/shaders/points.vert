// Covering quads of surfels, around the projections for all cameras of a panel. Four vertices per surfel. Switch: GROUPS,
// their number: surfels take turns in groups, each drawn to a tile of its own.
#define RECORD_TEXTURE
#include "lib/frame.glsl"
#include "lib/shading.glsl"
#include "lib/memory.glsl"
#include "lib/surfels.glsl"
#include "lib/covering.glsl"

uniform vec4 sheet;  // size of the band; its first row; columns of groups
uniform vec2 reach;  // least and greatest camera offset

flat out vec4 place;  // see lib/surfels.glsl
flat out vec4 normal;
flat out vec4 shape;
flat out vec4 area;
flat out vec3 color;
#ifdef SIDES
flat out vec3 back;
#endif

void main() {
    int number = gl_VertexID >> 2;
    place = record(number, PLACE);
    normal = record(number, NORMAL);
    shape = record(number, SHAPE);
    area = record(number, AREA);
    color = record(number, COLOR).rgb;
#ifdef SIDES
    back = record(number, BACK).rgb;
#endif
    vec2 low, high;
    find_quad(place.xyz, record(number, BOX), reach, vec4(0.0, sheet.z, window.x, min(sheet.z + sheet.y, window.y)), low, high);
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? low.x : high.x, (gl_VertexID & 2) == 0 ? low.y : high.y);
    vec2 origin = vec2(0.0, -sheet.z), target = sheet.xy;
#ifdef GROUPS
    int group = number % GROUPS, group_columns = int(sheet.w);
    origin += vec2(group % group_columns, group / group_columns) * sheet.xy;
    target *= vec2(group_columns, (GROUPS + group_columns - 1) / group_columns);
#endif
    float z = 0.0;
#ifdef STOPPED
    float nearest = max(place.z - place.w * sqrt(max(1.0 - normal.z * normal.z, 0.0)), depth_range.z);
    z = max(2.0 * window_from_depth(nearest) - 1.0, -1.0);
#endif
    gl_Position = vec4(2.0 * (corner + origin) / target - 1.0, z, 1.0);
}
