// Stage 4: pixel encoding (PMR 2020, section 4.4): the colour of the triangle that was found for a voxel or sub-pixel.
//
// Only what is seen is shaded, of a panel only its sub-pixels; an invocation per voxel, or per pixel of a panel. The weights
// are those of quad.vert, of the whole triangle in eye space, perspective-correct also where it was clipped. Switches: PANEL,
// and those of lib/surface.glsl.
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
#include "lib/memory.glsl"
#include "lib/plane_memory.glsl"
#include "lib/plane_surface.glsl"

layout(local_size_x = 64) in;

layout(rgba32ui, binding = 1) readonly uniform uimage2D corners;  // three vertices of each triangle
layout(rgba8, binding = 4) uniform image2D painted;               // the panel, or the atlas of views

uniform ivec2 picture;       // width; rows of this round
uniform int first_row;
uniform int first_tile;      // whose plane is the first
uniform int plane_count;
uniform vec4 sample_at;      // x of three channels, y
uniform ivec2 range;         // numbers of the part's triangles: first, how many
uniform bvec2 flip;          // the panel shows the picture mirrored

// The part's triangle that a sample sees; a number beyond the part's if it sees none.
uint triangle_seen(uint k) {
    return imageLoad(winners, place_of(k)).x - uint(range.x);
}

// Its colour at a position of the picture, from camera offset v.
vec3 shade(uint number, vec2 position, float v) {
    vec3 ray = ray_direction(position, v);
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
    return quantized(surface_color(s, total > 0.0, v, paint));
}

void main() {
    // a group is four tiles of 4 x 4 pixels side by side; its z is the plane
    uint i = gl_LocalInvocationID.x & 15u;
    uvec2 tile = uvec2(4u * gl_WorkGroupID.x + (gl_LocalInvocationID.x >> 4), gl_WorkGroupID.y);
    ivec2 pixel = ivec2(4u * tile + uvec2(i & 3u, i >> 2));
    if (pixel.x >= picture.x || pixel.y >= picture.y) {
        return;
    }
    ivec2 at = ivec2(pixel.x, pixel.y + first_row);
#ifdef PANEL
    vec3 color = vec3(0.0);
    bvec3 found = bvec3(false);
    for (int c = 0; c < 3; ++c) {
        uint place = sample_number(pixel, c, picture.x, 3), number = triangle_seen(place);
        if (number < uint(range.y)) {
            found[c] = true;
            vec2 position = vec2(at) + vec2(sample_at[c], sample_at.w);
            color[c] = shade(number, position, imageLoad(camera_offset, place_of(place)).x)[c];
        }
    }
    ivec2 size = ivec2(window.xy);
    at = ivec2(flip.x ? size.x - 1 - at.x : at.x, flip.y ? size.y - 1 - at.y : at.y);
    if (any(found)) {
        vec3 rest = all(found) ? vec3(0.0) : imageLoad(painted, at).rgb;
        imageStore(painted, at, vec4(mix(rest, color, found), 1.0));
    }
#else
    int plane = int(gl_WorkGroupID.z);
    uint number = triangle_seen(sample_number(pixel, plane, picture.x, plane_count));
    if (number < uint(range.y)) {
        vec4 view = views[first_tile + plane];
        vec3 color = shade(number, vec2(at) + sample_at.xw, view.x);
        imageStore(painted, ivec2(view.yz) + at, vec4(color, 1.0));
    }
#endif
}
