// Rectangles around the projections of volumes: in the tiles of views, every instance one more, or on a panel for all of
// its cameras (Huebner 2007b, section 3.2; the covering quad of a box).
#include "lib/frame.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
uniform vec2 reach;                  // least and greatest camera offset
#ifdef SORTED
#include "lib/sorted.glsl"
#endif
#else
#include "lib/views.glsl"
uniform int first_view;
flat out vec3 view;
#endif

uniform vec3 corners[8 * VOLUMES];   // eye space

void main() {
#ifdef PANEL
    vec2 size = window.xy, target = window.xy, origin = vec2(0.0), eyes = reach;
#else
    view = views[first_view + gl_InstanceID].xyz;
    vec2 size = atlas_size.zw, target = atlas_size.xy, origin = view.yz, eyes = view.xx;
#endif
    vec2 low = size, high = vec2(0.0);
    float near = depth_range.z, nearest = 1e30;
    for (int k = 0; k < 8 * VOLUMES; ++k) {
        vec3 p = corners[k];
        nearest = min(nearest, p.z);
        vec2 left = picture_times_depth(p, eyes.x) / p.z, right = picture_times_depth(p, eyes.y) / p.z;
        low = min(low, min(left, right));
        high = max(high, max(left, right));
    }
    // around the eyes there are volumes on all sides
    low = nearest < near ? vec2(0.0) : clamp(floor(low - 1.0), vec2(0.0), size);
    high = nearest < near ? size : clamp(ceil(high + 1.0), vec2(0.0), size);
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? low.x : high.x, (gl_VertexID & 2) == 0 ? low.y : high.y);
#ifdef PANEL
    corner = vec2(flip.x ? size.x - corner.x : corner.x, flip.y ? size.y - corner.y : corner.y);
#ifdef SORTED
    bool right = ((gl_VertexID & 1) != 0) != flip.x;  // whole runs of periods, in which columns change places
    corner.x = right ? min(float(start_of(int(corner.x) - 1) + RUN * period), size.x) : float(start_of(int(corner.x)));
#endif
#endif
    float z = clamp(window_from_depth(max(nearest, near)), 0.0, 1.0);
    gl_Position = vec4(2.0 * (corner + origin) / target - 1.0, 2.0 * z - 1.0, 1.0);
}
