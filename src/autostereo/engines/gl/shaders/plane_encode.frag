// Stage 4: pixel encoding (PMR 2020, section 4.4): the colour of the triangle that was found for a voxel or sub-pixel.
//
// Only what is seen is shaded, of a panel only its sub-pixels. The weights are those of quad.vert, of the whole
// triangle in eye space, perspective-correct also where it was clipped. Switches: PANEL, and those of lib/surface.glsl.
#define DEPTHS
#define WINNERS
#define POINTS
#ifdef PANEL
#define CAMERA_OFFSET
#endif
#define COLORING
#define MIXING
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/color.glsl"
#include "lib/shading.glsl"
#ifdef TEXTURED
#include "lib/texture.glsl"
#endif
#include "lib/surface.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_surface.glsl"

layout(rgba32ui, binding = 1) readonly uniform uimage2D corners;  // three vertices of each triangle

uniform ivec2 picture;       // width; rows of this round
uniform int first_row;
uniform int first_tile;      // whose plane is the first
uniform int plane_count;
uniform int first_channel;   // of the tiles
uniform vec4 sample_at;      // x of three channels, y
uniform ivec2 range;         // numbers of the part's triangles: first, how many

flat in int tile;
flat in vec2 origin;

layout(location = 0) out vec4 color;

const uint NOTHING = 0xffffffffu;

void shade(uint number, ivec2 pixel, ivec2 at) {
#ifdef PANEL
    float v = imageLoad(camera_offset, at).x;
    vec3 ray = ray_direction(vec2(pixel) + vec2(sample_at[first_channel + tile], sample_at.w), v);
#else
    float v = views[tile].x;
    vec3 ray = ray_direction(vec2(pixel) + sample_at.xw, v);
#endif
    uvec4 corner = imageLoad(corners, place_of(number));
    vec3 p[3];
    Surface surface[3];
    for (int k = 0; k < 3; ++k) {
        p[k] = imageLoad(points, place_of(corner[k])).xyz;
        surface[k] = load_surface(corner[k]);
    }
    vec3 eye = vec3(v, lens.w, 0.0), e, e_dx, e_dy;
    for (int k = 0; k < 3; ++k) {
        vec3 i = p[(k + 1) % 3] - eye, j = p[(k + 2) % 3] - eye, n = cross(i + j, j - i);
        e[k] = dot(n, ray);
        e_dx[k] = n.x / lens.x;
        e_dy[k] = -n.y / lens.y;
    }
    float total = e.x + e.y + e.z;
    total = total == 0.0 ? TINY : total;
    vec3 w = max(e / total, 0.0);  // snapping moves edges: a sample may be beyond
    w /= max(w.x + w.y + w.z, TINY);
    vec3 point = w.x * p[0] + w.y * p[1] + w.z * p[2];
    Surface s = mixed(surface, w, point);
    vec3 paint = vec3(1.0);
#ifdef TEXTURED
    vec3 w_dx = (e_dx - w * (e_dx.x + e_dx.y + e_dx.z)) / total, w_dy = (e_dy - w * (e_dy.x + e_dy.y + e_dy.z)) / total;
    paint = trilinear(s.uv, uv_of(surface, w_dx), uv_of(surface, w_dy));
#endif
    color = vec4(quantized(surface_color(s, total > 0.0, v, paint)), 1.0);
    gl_FragDepth = uintBitsToFloat(imageLoad(depths, at).x);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy - origin);
    int row = pixel.y - first_row;
    uint number = NOTHING;
    ivec2 at;
    if (row >= 0 && row < picture.y) {
        at = place_of(sample_number(ivec2(pixel.x, row), tile - first_tile, picture.x, plane_count));
        number = imageLoad(winners, at).x - uint(range.x);
    }
    if (number < uint(range.y)) {
        shade(number, pixel, at);
    } else {
        discard;  // not before: software devices go on where all of a group are discarded
    }
}
