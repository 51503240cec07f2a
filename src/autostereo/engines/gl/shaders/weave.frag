// A panel from a quilt of views of another size, bilinear within tiles and, on continuous panels, between views.
// The same sums as engines/reference/gather.py, in the same order. Several quilts add up: what a quilt does not hold is 0.
#include "lib/viewmap.glsl"

uniform sampler2D quilt;       // row 0 is the top
uniform int quilt_height;
uniform ivec3 tile;            // columns of tiles; width, height of a tile; tile 0 at the bottom left
uniform ivec2 panel_size;
uniform ivec2 held;            // first view of the quilt, and how many
uniform vec3 channels;         // 1 where a channel is wanted

out vec4 color;

float bilinear(int view, ivec2 low, ivec2 high, vec2 w, int c) {
    view -= held.x;
    if (view < 0 || view >= held.y) {
        return 0.0;
    }
    ivec2 origin = ivec2(view % tile.x * tile.y, quilt_height - (view / tile.x + 1) * tile.z);
    float a = texelFetch(quilt, origin + low, 0)[c], b = texelFetch(quilt, origin + ivec2(high.x, low.y), 0)[c];
    float d = texelFetch(quilt, origin + ivec2(low.x, high.y), 0)[c], e = texelFetch(quilt, origin + high, 0)[c];
    vec2 rows = LEVELS * (vec2(a, d) * (1.0 - w.x) + vec2(b, e) * w.x);
    return rows.x * (1.0 - w.y) + rows.y * w.y;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    ivec2 shown = mirrored(at, panel_size);
    dvec2 position = (dvec2(shown) + 0.5LF) * dvec2(tile.yz) / dvec2(panel_size) - 0.5LF;
    dvec2 base = floor(position);
    vec2 w = vec2(position - base);
    ivec2 low = clamp(ivec2(base), ivec2(0), tile.yz - 1), high = clamp(ivec2(base) + 1, ivec2(0), tile.yz - 1);
#ifdef CONTINUOUS
    dvec3 u = clamp(camera_coordinates(at.x, at.y), dvec3(0.0LF), dvec3(double(view_count - 1)));
    ivec3 view = ivec3(floor(u));
    vec3 between = vec3(u - floor(u));
#else
    ivec3 view = view_indices(at.x, at.y);
#endif
    for (int c = 0; c < 3; ++c) {
        float value = bilinear(view[c], low, high, w, c);
#ifdef CONTINUOUS
        float other = bilinear(min(view[c] + 1, view_count - 1), low, high, w, c);
        value = value * (1.0 - between[c]) + other * between[c];
#endif
        color[c] = channels[c] * floor(value + 0.5) / LEVELS;
    }
    color.a = 1.0;
}
