// Proxy slices of volumes, back to front: a rectangle around what lies in a slab, for all cameras (Huebner 2007a, section
// 3.2: viewport-aligned, clipped to the volume). Every instance is one slab of a tile, or of the panel.
#include "lib/frame.glsl"
#ifdef PANEL
#include "lib/viewmap.glsl"
uniform vec2 reach;                  // least and greatest camera offset
#else
#include "lib/views.glsl"
uniform int first_view;
flat out vec3 view;
#endif

uniform vec3 corners[8 * VOLUMES];   // eye space, the x-index changing fastest
uniform vec3 slices;                 // depth of the first; distance; number of slabs

flat out int slab_number;

void main() {
    int count = int(slices.z);
    slab_number = count - 1 - gl_InstanceID % count;
    float t = slices.x + float(slab_number) * slices.y, after = t + slices.y;
#ifdef PANEL
    vec2 size = window.xy, target = window.xy, origin = vec2(0.0), eyes = reach;
#else
    view = views[first_view + gl_InstanceID / count].xyz;
    vec2 size = atlas_size.zw, target = atlas_size.xy, origin = view.yz, eyes = view.xx;
#endif
    vec2 low = size, high = vec2(0.0);
    for (int e = 0; e < 12 * VOLUMES; ++e) {
        // edge e leads from one corner to that with one more bit
        int axis = (e % 12) >> 2, other = e & 3;
        int from = 8 * (e / 12) + (axis == 0 ? other << 1 : axis == 1 ? (other & 1) | ((other & 2) << 1) : other);
        vec3 a = corners[from], b = corners[from + (1 << axis)];
        if (a.z > b.z) {
            vec3 swap = a;
            a = b;
            b = swap;
        }
        if (b.z < t || a.z > after) {
            continue;
        }
        for (int end = 0; end < 2; ++end) {
            float depth = clamp(end == 0 ? t : after, a.z, b.z);
            vec3 p = b.z > a.z ? vec3(mix(a.xy, b.xy, (depth - a.z) / (b.z - a.z)), depth) : (end == 0 ? a : b);
            vec2 left = picture_times_depth(p, eyes.x) / p.z, right = picture_times_depth(p, eyes.y) / p.z;
            low = min(low, min(left, right));
            high = max(high, max(left, right));
        }
    }
    low = clamp(floor(low - 1.0), vec2(0.0), size);
    high = max(low, clamp(ceil(high + 1.0), vec2(0.0), size));
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? low.x : high.x, (gl_VertexID & 2) == 0 ? low.y : high.y);
#ifdef PANEL
    corner = vec2(flip.x ? size.x - corner.x : corner.x, flip.y ? size.y - corner.y : corner.y);
#endif
    float z = clamp(window_from_depth(t), 0.0, 1.0);
    gl_Position = vec4(2.0 * (corner + origin) / target - 1.0, 2.0 * z - 1.0, 1.0);
}
